"""Solvers that tell about their process, or misbehave in it."""

from __future__ import annotations

import os
import re
import signal
import time
from pathlib import Path

import numpy as np

from ringsim.scene import Scene
from ringsim.variables import Outcome, Status


def run(scene: Scene, reason: str = "done") -> Outcome:
    """Tells its process by the number of steps."""
    return Outcome(Status.OK, reason, {}, {"steps": np.array(os.getpid())})


def sleep(scene: Scene) -> Outcome:
    """Long enough to be killed meanwhile; very long if the scene is."""
    time.sleep(0.5 if scene.solver.end_time < 1000.0 else 60.0)
    return run(scene)


def kill_itself(scene: Scene) -> Outcome:
    """As the kernel does when memory is short."""
    os.kill(os.getpid(), signal.SIGKILL)
    return run(scene)


def chatter(scene: Scene) -> Outcome:
    """Prints until the disk is full."""
    line = b"x" * (1 << 24)
    while True:
        os.write(1, line)


def litter(scene: Scene) -> Outcome:
    """Leaves a file in the current folder."""
    Path("litter").touch()
    return run(scene, os.getcwd())


def hold_the_lock(scene: Scene) -> Outcome:
    """Never lets go of the interpreter lock: a match that takes ages."""
    re.match(r"(a+)+$", "a" * 60 + "b")
    return run(scene)
