"""Steps that follow the ring's vibrations: only where stress asks for them, and how finely."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ringsim.parts.solver import NO_DEVIATIONS, Solver
from ringsim.stepping.control import RunControl
from ringsim.stepping.instant import Energies, Instant, Scales
from ringsim.stepping.repeats import MOST, DeviationSteps

pytestmark = pytest.mark.quick

AMPLITUDE, FREQUENCY, DURATION, TOLERANCE = 1e-3, 10.0, 20.0, 0.02
REST = Energies(0.0, 0.0, 0.0, 0.0)


def limit_of(step: float, tolerance: float = TOLERANCE, amplitude: float = AMPLITUDE) -> float:
    """Smallest limit of the last period of two joints that vibrate against each other."""
    control, limits = DeviationSteps(tolerance, DURATION), []
    for time in np.arange(0.0, 3.0, step):
        apart = np.array([1.0, -1.0]) * amplitude
        angles = time**2 + apart * np.sin(FREQUENCY * time)
        rates = 2.0 * time + apart * FREQUENCY * np.cos(FREQUENCY * time)
        limits.append(control.limit(Instant(float(time), angles, rates, REST)))
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
    common = [Instant(t, np.full(4, t**3), np.full(4, 3.0 * t**2), REST) for t in (0.0, 0.1, 0.2)]
    assert [control.limit(instant) for instant in common][-1] == math.inf


def test_no_step_is_shorter_than_a_share_of_the_run() -> None:
    assert limit_of(0.01, tolerance=1e-6) == pytest.approx(DURATION / MOST)


@pytest.mark.parametrize(
    ("asked", "values", "followed"),
    [
        (False, {}, False),
        (True, {}, True),
        (True, {"deviation_tolerance": NO_DEVIATIONS}, False),
        (True, {"step_control": "constant"}, False),
    ],
)
def test_runs_follow_them_where_they_are_asked_to(asked, values, followed) -> None:
    """After three instants of a vibration the next step is shorter than the motion asks for."""
    steps = []
    for follow in (False, asked):
        start = Instant(0.0, np.zeros((1, 2)), np.zeros((1, 2)), REST)
        control = RunControl(
            Solver(tolerance=0.1, **values),
            Scales(0.1, 1.0, travel=2.0, length=1.0),
            start,
            follow_deviations=follow,
        )
        for k in range(1, 9):
            rates = 0.1 + 0.05 * np.cos(30.0 * k) * np.array([[1.0, -1.0]])
            control.accept(Instant(0.1 * k, 0.1 * rates, rates, REST))
        steps.append(control.next_step())
    assert (steps[1] < steps[0]) is followed


def test_other_runs_of_a_scene_scale_them_with_the_steps() -> None:
    solver = Solver(deviation_tolerance=0.02)
    assert solver.scaled(2.0).deviation_tolerance == pytest.approx(0.08)
    assert solver.scaled(0.5).deviation_tolerance == pytest.approx(0.005)
    assert solver.refined(1).deviation_tolerance == pytest.approx(0.02 / 16.0)
    off = Solver(deviation_tolerance=NO_DEVIATIONS)
    assert off.scaled(2.0).deviation_tolerance == off.refined(2).deviation_tolerance
