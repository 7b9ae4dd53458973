"""Steps that follow the ring's vibrations: only where stress asks for them, and how finely."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ringsim.engine.deviation_steps import MOST, DeviationSteps, deviation_steps
from ringsim.parts.solver import NO_DEVIATIONS, Solver
from ringsim.scene import load_scene

AMPLITUDE, FREQUENCY, DURATION, TOLERANCE = 1e-3, 10.0, 20.0, 0.02


def limit_of(step: float, tolerance: float = TOLERANCE, amplitude: float = AMPLITUDE) -> float:
    """Smallest limit of the last period of two joints that vibrate against each other."""
    control, limits = DeviationSteps(tolerance, DURATION), []
    for time in np.arange(0.0, 3.0, step):
        apart = np.array([1.0, -1.0]) * amplitude
        angles = time**2 + apart * np.sin(FREQUENCY * time)
        rates = 2.0 * time + apart * FREQUENCY * np.cos(FREQUENCY * time)
        limits.append(control.limit(float(time), angles, rates))
    return min(limits[-math.ceil(2.0 * math.pi / FREQUENCY / step) :])


def test_the_limit_is_that_of_the_global_error_of_a_vibration() -> None:
    """|d'''| = w^3 |d|: h = sqrt(e / (C T w^3)); the constant C is 0.1 / 15."""
    expected = math.sqrt(TOLERANCE / (0.1 / 15.0 * DURATION * FREQUENCY**3))
    # d''' is taken over two steps of a tenth of a period at most.
    assert limit_of(expected) == pytest.approx(expected, rel=0.05)


def test_it_goes_with_the_root_of_the_tolerance_and_not_with_the_amplitude() -> None:
    one = limit_of(0.01)
    assert limit_of(0.01, tolerance=4.0 * TOLERANCE) == pytest.approx(2.0 * one, rel=1e-9)
    assert limit_of(0.01, amplitude=10.0 * AMPLITUDE) == pytest.approx(one, rel=1e-2)


def test_a_common_motion_asks_for_nothing() -> None:
    control = DeviationSteps(TOLERANCE, DURATION)
    found = [control.limit(t, np.full(4, t**3), np.full(4, 3.0 * t**2)) for t in (0.0, 0.1, 0.2)]
    assert found[-1] == math.inf


def test_no_step_is_shorter_than_a_share_of_the_run() -> None:
    assert limit_of(0.01, tolerance=1e-6) == pytest.approx(DURATION / MOST)


@pytest.mark.parametrize(
    ("values", "followed"),
    [
        ({}, False),
        ({"record.stress": True}, True),
        ({"record.stress": True, "solver.deviation_tolerance": NO_DEVIATIONS}, False),
        ({"record.stress": True, "solver.step_control": "constant"}, False),
    ],
)
def test_scenes_ask_for_them_by_their_outputs(values: dict[str, object], followed: bool) -> None:
    assert (deviation_steps(load_scene("ring18").with_values(values)) is not None) is followed


def test_other_runs_of_a_scene_scale_them_with_the_steps() -> None:
    solver = Solver(deviation_tolerance=0.02)
    assert solver.coarsened().deviation_tolerance == pytest.approx(0.08)
    assert solver.halved().deviation_tolerance == pytest.approx(0.005)
    assert solver.refined(1).deviation_tolerance == pytest.approx(0.02 / 16.0)
    off = Solver(deviation_tolerance=NO_DEVIATIONS)
    assert off.coarsened().deviation_tolerance == off.refined(2).deviation_tolerance
