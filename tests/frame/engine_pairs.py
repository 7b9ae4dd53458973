"""Scenes by both engines, and what their steps explain of the difference."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.exudyn.integrate import solve as by_exudyn
from ringsim.frame.integrate import solve as by_frames
from ringsim.scene import Scene
from ringsim.variables import Outcome

Array = NDArray[np.float64]
SERIES = (
    "opening_angle", "cable_tension", "wound_length", "rod_stress", "dissipation",
    "base_rotation", "base_force", "base_torque",
)  # fmt: skip
"""What is compared wherever a scene has it."""


class Apart(NamedTuple):
    """Largest value of a series, difference of the engines, and the error of the steps of one."""

    largest: float
    difference: float
    error: float


def apart(scene: Scene) -> dict[str, Apart]:
    """Of every series of a scene with constant steps, whose runs take the very same steps.

    The error of a run is a third of what it changes with steps twice as long: the integrator's
    order is two.  It is taken from frames, which cost a tenth: both integrate by the same scheme.
    """
    if scene.boom is not None or scene.structure.supported:
        scene = scene.with_values({"record.reactions": True})
    double = scene.with_values({"solver.step": 2.0 * scene.solver.step})
    one, two = by_exudyn(scene), by_frames(scene)
    coarse = by_frames(double)
    for outcome in (one, two, coarse):
        assert not outcome.status.failed, outcome.reason
    ends = [outcome.values["final_time"] for outcome in (one, two)]
    assert abs(ends[0] - ends[1]) < 0.5 * scene.solver.step, "the runs end at other times"
    found = {}
    for name in SERIES:
        if name in one.values:
            largest = float(np.nanmax(np.abs(one.values[name])))
            error = _far(two, coarse, name) / 3.0
            found[name] = Apart(largest, _far(one, two, name), error)
    return found


def _far(one: Outcome, two: Outcome, name: str) -> float:
    """Largest difference of a series as long as both run."""
    first, second = one.values[name], two.values[name]
    return float(np.nanmax(np.abs(first - second)))
