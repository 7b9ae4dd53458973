"""The largest asynchrony is that of the curves, not of the moments at which steps happen to end."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ring_runs import ring
from ringsim.outputs.joints import Spread, largest_spread
from ringsim.simulation import run


def two_joints(times, polynomial):
    """A joint that stays and one that follows a polynomial of time, rad, and their rates."""
    curve = np.polynomial.Polynomial(polynomial)
    still = np.ones_like(times)
    return (
        np.column_stack([still, 1.0 + curve(times)]),
        np.column_stack([0.0 * still, curve.deriv()(times)]),
    )


def test_a_peak_between_two_steps_is_found():
    """t - t^2 vanishes at both ends of the only step and is 1/4 in its middle."""
    times = np.array([0.0, 1.0])
    found = largest_spread(times, *two_joints(times, [0.0, 1.0, -1.0]), math.inf)
    assert found == Spread(0.25, time=0.5, leader=1, laggard=0)


@pytest.mark.parametrize(("bend", "leader"), [(1.0, 1), (-1.0, 0)])
def test_it_tells_when_and_which_joints(bend, leader):
    """The second step holds the peak of (t - 1)(2 - t), of either sign."""
    times = np.array([0.0, 1.0, 2.0])
    angles, rates = np.zeros((3, 2)), np.zeros((3, 2))
    rates[1:, 1] = bend, -bend
    found = largest_spread(times, angles, rates, math.inf)
    assert found == Spread(0.25, time=1.5, leader=leader, laggard=1 - leader)


def test_a_cubic_is_found_to_an_eighth_of_a_step():
    """t^3 - t between -1 and 1: 2 / sqrt(27) at +-1 / sqrt(3), in steps of any length."""
    times = np.array([-1.0, -0.3, 0.1, 1.0])
    found = largest_spread(times, *two_joints(times, [0.0, -1.0, 0.0, 1.0]), math.inf)
    peak = 2.0 / math.sqrt(27.0)
    # Half the distance of two points from the peak at most, curvature 6 t = 3.5 there.
    assert peak - 0.5 * 3.5 * (0.9 / 16.0) ** 2 < found.angle <= peak
    # As far to either side of 0: before it the second joint leads, after it the first one.
    assert abs(abs(found.time) - 1.0 / math.sqrt(3.0)) <= 0.9 / 16.0
    assert (found.leader, found.laggard) == ((1, 0) if found.time < 0.0 else (0, 1))


@pytest.mark.parametrize("until", [0.3, 1.0, 1.7, 2.0])
def test_it_counts_up_to_the_deployment_itself(until):
    """t^2 grows: its largest value is that at the end, wherever in a step that is."""
    times = np.array([0.0, 1.0, 2.0])
    found = largest_spread(times, *two_joints(times, [0.0, 0.0, 1.0]), until)
    assert found.angle == pytest.approx(until**2, rel=1e-14)
    assert found.time == pytest.approx(until, rel=1e-14)


def test_a_run_that_never_began_has_its_first_state():
    found = largest_spread(np.zeros(1), np.array([[1.0, 3.0]]), np.zeros((1, 2)), math.inf)
    assert found == Spread(2.0, time=0.0, leader=1, laggard=0)


def test_it_is_no_less_than_any_recorded_value():
    scene = ring(3, record__interval=0.001, solver__tolerance=0.05, solver__end_time=5.0)
    outcome = run(scene)
    until = outcome.coordinates["time"] <= outcome.values["deployment_time"]
    largest = float(outcome.values["asynchrony_max"])
    recorded = float(outcome.values["asynchrony"][until].max())
    # As a joint locks the spread has a peak a few milliseconds wide.  Between eight points a cubic
    # of the fitted kind rises by a few thousandths of its height.
    assert recorded <= largest < 1.05 * recorded
