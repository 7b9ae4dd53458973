"""Accelerations of corners: what their velocities rise by, in both engines alike."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

from ringsim.exudyn.build import build
from ringsim.exudyn.integrate import Integration as Exudyn
from ringsim.frame.integrate import Integration as Frames
from ringsim.frame.model import FrameModel
from ringsim.outputs.corners import PeakAcceleration, Position
from ringsim.outputs.recorder import Recorder
from ringsim.scene import load_scene

RING = load_scene("ring18").with_values(
    {
        "structure.sections": 4, "structure.opening_angle": 60.0, "net": "none",
        "boom.base": "fixed", "loads.force": [0.05, 0.06, 0.04, 0.055],
        "record.accelerations": True, "record.positions": True, "record.interval": 0.1,
        "solver.step_control": "constant", "solver.step": 0.005, "solver.end_time": 0.15,
    }
)  # fmt: skip
ENGINES: dict[str, Callable[[], Recorder]] = {
    "frame": lambda: Frames(FrameModel(RING)).run(),
    "full": lambda: Exudyn(build(RING)).run(),
}


@cache
def run_of(engine: str) -> Recorder:
    return ENGINES[engine]()


@pytest.mark.parametrize("engine", ENGINES)
def test_they_are_the_rates_of_velocities(engine: str) -> None:
    """Trapezoids over steps of 5 ms leave (w h)^2 / 12 of a vibration with the frequency w: 2e-3 of
    the rods' first, at 30 rad/s.
    """
    history = run_of(engine)
    readings = {type(output): values for output, values in history.readings.items()}
    found = history.outcome()
    names = found.coordinates["point"].tolist()
    corners = found.coordinates["corner"].tolist()
    assert corners == [1, 2, 3, 4]
    own = [[names.index(f"{plane} corner {k}") for k in corners] for plane in ("upper", "lower")]
    velocities = np.array(readings[Position])[:, own, 1]
    shocks = np.array(readings[PeakAcceleration])
    steps = np.diff(history.times)[:, None, None, None]
    gained = np.cumsum(0.5 * steps * (shocks[1:] + shocks[:-1]), axis=0)
    largest = np.abs(velocities).max()
    assert largest > 0.01
    assert np.abs(velocities[1:] - velocities[0] - gained).max() < 2e-3 * largest
    peaks = np.linalg.norm(shocks, axis=3).max(axis=0)
    assert found.values["peak_acceleration"] == pytest.approx(peaks, rel=1e-15)


def test_engines_agree() -> None:
    here, there = (run_of(n).outcome().values["peak_acceleration"] for n in ENGINES)
    moving = there > 0.05 * there.max()
    assert moving.sum() >= 6
    assert here[moving] == pytest.approx(there[moving], rel=1e-2)
