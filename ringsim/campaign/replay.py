"""Replaying one sample in the foreground, and comparing it with what was stored."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.campaign.folder import Folder
from ringsim.execution.solve import load_solver, solve
from ringsim.execution.work import Task
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.effort import TIMINGS
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.storage.record import Result
from ringsim.storage.shards import latest, rows_of
from ringsim.storage.store import survey
from ringsim.variables import Outcome, Status


@dataclass(frozen=True)
class Stored:
    """What a folder holds of one sample."""

    status: Status
    reason: str
    step: float
    values: dict[str, NDArray[Any]]


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


def stored(campaign: Folder, sample: int) -> Stored | None:
    """The stored result of one sample, if it is in a shard."""
    found = survey(campaign.path, campaign.identity, campaign.table.samples, set_aside=False)
    owner, row = latest(found.shards, campaign.table.samples)
    if owner[sample] < 0:
        return None
    names = ["status", "reason", "largest_step", *VARIABLES]
    values = rows_of(found.shards[owner[sample]].path, names, row[sample : sample + 1])
    first = {name: each[0] for name, each in values.items()}
    return Stored(
        Status(int(first.pop("status"))),
        str(first.pop("reason")),
        float(first.pop("largest_step")),
        first,
    )


def replay(campaign: Folder, sample: int, *, step: float | None = None) -> Result:
    """Run one sample in this process; what the solver prints goes to the terminal.

    Parameters
    ----------
    campaign
        The folder.
    sample
        Which sample.
    step
        Largest time step, if a repeated attempt is to be replayed.

    Raises
    ------
    InputError
        If there is no such sample.
    """
    scene = sample_scene(campaign, sample)
    shrink = 1.0
    if step is not None and np.isfinite(step):
        shrink = step / scene.solver.step
    values, own = campaign.table.values_of(sample), campaign.retry.times == 0
    task = Task(sample, values, shrink, restarts=own)
    return solve(load_solver(campaign.solver), campaign.scene, task)


def differences(result: Result, before: Stored) -> list[str]:
    """Names of what a replay gave differently, timings aside."""
    found = result.unpack()
    names = [n for n in VARIABLES if n in found and n in before.values and n not in TIMINGS]
    differing = [
        name
        for name in names
        if not np.array_equal(found[name], before.values[name], equal_nan=True)
    ]
    if result.status != before.status:
        differing.insert(0, "status")
    return differing


def outcome_of(result: Result) -> Outcome:
    """The result as the outcome of a single run."""
    arrays = result.unpack()
    return Outcome(
        result.status,
        result.reason,
        {name: values for name, values in arrays.items() if name in COORDINATES},
        {name: values for name, values in arrays.items() if name not in COORDINATES},
        result.cause,
    )
