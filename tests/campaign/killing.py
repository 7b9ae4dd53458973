"""Kills processes of a campaign by what they are, and sees that they died."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from pathlib import Path


def children_of(pid):
    """All processes below one, the deepest first."""
    try:
        direct = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return []
    return [deep for child in direct for deep in [*children_of(int(child)), int(child)]]


def alive(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state not in "ZX"


def is_solver(pid):
    try:
        return b"ringsim.execution.child" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def targets_of(process, kind, chance):
    """Processes that a kill is meant for."""
    below = children_of(process.pid)
    solvers = [pid for pid in below if is_solver(pid)]
    match kind:
        case "solver":
            return chance.sample(solvers, min(1, len(solvers)))
        case "all solvers":
            return solvers
        case "rank":
            ranks = [pid for pid in below if any(map(is_solver, children_of(pid)))]
            return chance.sample(ranks, min(1, len(ranks)))
        case "manager" | "launcher" | "tree":
            return [process.pid]


def strike(targets, bystanders):
    """Kill; says whether every target was there to be killed, and died."""
    hit = bool(targets) and all(map(alive, targets))
    for pid in [*bystanders, *targets]:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
    return hit and until(lambda: not any(map(alive, targets)))


def until(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.005)
    return False
