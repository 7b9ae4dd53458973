"""Replaying one sample in the foreground, and comparing it with what was stored."""

from __future__ import annotations

import numpy as np

from ringsim.campaign.folder import Folder
from ringsim.execution.solve import load_solver, solve
from ringsim.execution.work import Task
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.storage.result import COORDINATE, Result
from ringsim.variables import TIMINGS, Outcome


def sample_scene(campaign: Folder, sample: int) -> Scene:
    """The scene of one sample.

    Raises
    ------
    InputError
        If there is no such sample.
    """
    if not 0 <= sample < campaign.table.samples:
        raise InputError(
            f"sample {sample} is not in {campaign.path}: choose one from 0 to "
            f"{campaign.table.samples - 1}"
        )
    return campaign.scene.with_values(campaign.table.values_of(sample))


def stored(campaign: Folder, sample: int) -> Result | None:
    """The stored result of one sample, if there is one."""
    return next(campaign.survey().results([sample]), None)


def replay(campaign: Folder, sample: int) -> Result:
    """Run one sample in this process; what the solver prints goes to the terminal."""
    task = Task(sample, campaign.table.values_of(sample))
    return solve(load_solver(campaign.solver), campaign.scene, task)


def differences(result: Result, before: Result) -> list[str]:
    """Names of what a replay gave differently, timings aside."""
    new, old = result.arrays(), before.arrays()
    differing = [
        name for name in new.keys() & old.keys() - set(TIMINGS) if not _same(new[name], old[name])
    ]
    return ["status"] * (result.status != before.status) + sorted(differing)


def _same(one: np.ndarray, other: np.ndarray) -> bool:
    return np.array_equal(one, other, equal_nan=one.dtype.kind == "f")


def outcome_of(result: Result) -> Outcome:
    """The result as the outcome of a single run."""
    arrays = result.arrays()
    coordinates = {name: arrays.pop(name) for name in COORDINATE if name in arrays}
    return Outcome(result.status, result.reason, coordinates, arrays)
