"""The rate at which a V-joint meets its latch, from the steps around it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ringsim.scene import load_scene
from ringsim.simulation import simulate
from ringsim.stepping.locks import meetings


def met(times: list[float], angles: list[float], rates: list[float]) -> float:
    """The rate of one joint; angles (rad) are those past 180 deg."""
    shape = (-1, 1, 1)
    past, speeds = np.reshape(angles, shape), np.reshape(rates, shape)
    (one,) = meetings(np.asarray(times), math.pi + past, speeds)
    return one.rate


@pytest.mark.parametrize("acceleration", [-0.8, 0.0, 1.5])
def test_a_steady_acceleration_is_followed_to_the_stop(acceleration: float) -> None:
    """v^2 = v0^2 + 2 a s; the last step brakes on the stop and tells nothing of the arrival."""
    times = np.array([0.0, 0.03, 0.05, 0.1])
    rates = 0.5 + acceleration * times
    past = 0.5 * times + 0.5 * acceleration * times**2 - 0.03
    past[3], rates[3] = 1e-4, 0.01
    expected = math.sqrt(0.5**2 + 2.0 * acceleration * 0.03)
    assert met([*times], [*past], [*rates]) == pytest.approx(expected, rel=1e-12)


def test_a_jerk_is_not_foretold_to_go_on() -> None:
    """The lock of another joint brakes this one within the step before: 0.5 to 0.1 rad/s."""
    rate = met([0.0, 0.1, 0.2, 0.3], [-0.1, -0.05, -0.01, 1e-4], [0.5, 0.5, 0.1, 0.02])
    assert rate == pytest.approx(0.1, rel=1e-12)


def test_no_joint_comes_from_below_with_a_rate_below_zero() -> None:
    random = np.random.default_rng(3)
    times = np.cumsum(random.uniform(1e-3, 0.1, (200, 4)), axis=1)
    past = -np.sort(random.uniform(1e-4, 0.1, (200, 4)))[:, ::-1]
    past[:, 3] *= -1e-2
    rates = random.normal(0.1, 0.5, (200, 4))
    found = [met(*(list(row[k]) for row in (times, past, rates))) for k in range(200)]
    assert min(found) >= 0.0


def test_a_run_says_which_rates_the_lock_of_another_joint_may_have_changed() -> None:
    """The locks of section 1 drive section 2, by steps of 2 ms, from 0.05 to 0.1 rad/s."""
    scene = load_scene("truss2").with_values({"latch.min_rate": 0.04})
    coarse = simulate(scene.with_values({"solver.tolerance": 1e-3}), "frame")
    said = "whether the latch of upper 2, lower 2 catches is uncertain, as another joint locked in"
    assert said in coarse.attrs["reason"]
    assert float(coarse.latch_rate[0, 1]) == pytest.approx(0.05, rel=0.05)
    fine = simulate(scene.with_values({"solver.tolerance": 3e-4}), "frame")
    assert "another joint" not in fine.attrs["reason"]
    assert float(fine.latch_rate[0, 1]) == pytest.approx(0.1, rel=0.05)
    # Latches that catch from a fiftieth of these rates on are in no doubt.
    sure = scene.with_values({"solver.tolerance": 1e-3, "latch.min_rate": 1e-3})
    assert "another joint" not in simulate(sure, "frame").attrs["reason"]
