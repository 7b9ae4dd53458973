"""Stand-ins for the simulation with a known cost."""

from __future__ import annotations

import time

import numpy as np

from ringsim.scene import Scene
from ringsim.variables import Outcome, Status


def nothing(scene: Scene) -> Outcome:
    """No work at all."""
    return Outcome(Status.OK, "nothing to do", {}, {"deployment_time": np.array(1.0)})


def busy(scene: Scene) -> Outcome:
    """Keeps a core busy for as many seconds of processor time as ``rods.damping`` says."""
    end = time.process_time() + scene.rods.damping
    while time.process_time() < end:
        sum(range(1000))
    return nothing(scene)


def asleep(scene: Scene) -> Outcome:
    """Sleeps for as many seconds as ``rods.damping`` says."""
    time.sleep(scene.rods.damping)
    return nothing(scene)
