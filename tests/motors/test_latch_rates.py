"""The rate at which a V-joint meets its latch, from the steps around it."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import scipy
from loops import for_each

from ringsim.outputs.base import jerked, may_be_off, unresolved
from ringsim.outputs.family import Run, Series
from ringsim.scene import load_scene
from ringsim.simulation import simulate
from ringsim.stepping.instant import Array
from ringsim.stepping.locks import (
    History,
    Latches,
    Meeting,
    history,
    may_decide,
    meetings,
    ringing,
)


def meeting(times: list[float], angles: list[float], rates: list[float]) -> Meeting:
    """How one joint comes to its stop; angles (rad) are those past 180 deg."""
    shape = (-1, 1, 1)
    past, speeds = np.reshape(angles, shape), np.reshape(rates, shape)
    (one,) = meetings(np.asarray(times), math.pi + past, speeds)
    return one


def met(times: list[float], angles: list[float], rates: list[float]) -> float:
    """Its rate."""
    return meeting(times, angles, rates).rate


@pytest.mark.parametrize("acceleration", [-0.8, 0.0, 1.5])
def test_a_steady_acceleration_is_followed_to_the_stop(acceleration: float) -> None:
    """v^2 = v0^2 + 2 a s; the last step brakes on the stop and tells nothing of the arrival."""
    times = np.array([0.0, 0.03, 0.05, 0.1])
    rates = 0.5 + acceleration * times
    past = 0.5 * times + 0.5 * acceleration * times**2 - 0.03
    past[3], rates[3] = 1e-4, 0.01
    expected = math.sqrt(0.5**2 + 2.0 * acceleration * 0.03)
    assert met([*times], [*past], [*rates]) == pytest.approx(expected, rel=1e-12)


@pytest.mark.quick
def test_where_the_acceleration_grows_the_uncertain_share_holds_the_rate() -> None:
    """v^2 = c (s + b)^2 + d, of which times follow by quadrature: near 180 deg joints open ever
    faster, and the smaller of two accelerations alone had rates a quarter too small.
    """
    random, wide = np.random.default_rng(4), 0
    for _ in range(40):
        slope, apart = random.uniform(0.5, 5.0), random.uniform(0.02, 0.1)

        def rate(past: Array, slope: float = slope, apart: float = apart) -> Array:
            return np.sqrt(slope * (past + apart) ** 2 + 1e-4)

        ends = -np.cumsum(random.uniform(0.002, 0.02, 3))[::-1]
        grid = np.linspace(ends[0], 0.0, 4001)
        clock = scipy.integrate.cumulative_simpson(1.0 / rate(grid), x=grid, initial=0.0)
        times = [*np.interp(ends, grid, clock), clock[-1] + 1e-3]
        found = meeting(times, [*ends, 1e-4], [*rate(ends), 0.001])
        true = float(rate(np.zeros(1))[0])
        assert abs(found.rate - true) <= 1.001 * found.unsure * max(true, found.rate)
        wide += found.unsure > 0.1
    assert 5 < wide < 40  # neither none nor all


@pytest.mark.quick
def test_a_rate_below_what_the_joint_does_next_is_uncertain() -> None:
    """Upper joint 3 of a ring of 8 m on the ground: carried on it has 0.022 rad/s, with finer steps
    0.091, and it is 0.062 rad/s fast on its stop; one that stands at its stop but for rounding has
    no way left.
    """
    times, past = [1024.4403, 1025.7411, 1026.1378, 1026.7193], [-0.05737, -0.03223, -0.02409, 7e-5]
    found = meeting(times, past, [0.01847, 0.02029, 0.02071, 0.06198])
    assert found.rate == pytest.approx(0.022, rel=0.02)
    assert found.rate / (1.0 - found.unsure) >= 0.062 * 0.999
    slow = meeting([0.0, 1.0, 2.0, 3.0], [-0.2, -0.1, -1e-300, 1e-4], [0.1, 0.1, 0.1, 0.01])
    assert slow.rate == pytest.approx(0.1)
    assert slow.unsure < 0.01


@pytest.mark.quick
@pytest.mark.parametrize("part", [0.05, 0.1, 0.15, 0.2])
@pytest.mark.parametrize("after", [0.5, 1.0, 1.5, 1.9])
def test_a_rate_that_rings_is_uncertain_as_steps_put_its_phase_wrong(part, after) -> None:
    """A joint swings from the lock of another on: the trapezoidal rule swings at tan^-1(w h / 2)
    2 / h instead of w, and by its own lock the rate errs by that phase at most.
    """
    period, size, trend = 0.2, 0.05, 0.3
    step, omega = part * period, 2.0 * math.pi / period
    numeric = 2.0 / step * math.atan(0.5 * omega * step)
    lock = after * period
    times = 7.0 + step * np.arange(-3.0, after / part + 2.0)
    since = times - 7.0
    rates = 0.4 + trend * since + size * np.sin(numeric * np.maximum(since, 0.0))
    told = ringing(times, rates, np.array([7.0, np.nan, 7.0 + lock]), 7.0 + lock, period)
    if int(after / part) + 1 < 4:  # so few steps tell nothing
        assert told == 0.0
        return
    largest = size * (omega - numeric) * lock
    assert 0.3 * largest < told < 1.2 * largest
    # What locked long before, together with it or after it rings no more, or not yet.
    for other in (lock - 2.1 * period, lock - 0.2 * period, lock + period):
        assert ringing(times, rates, np.array([7.0 + other]), 7.0 + lock, period) == 0.0
    # A rate that grows evenly does not ring.
    assert ringing(times, 0.4 + since, np.array([7.0]), 7.0 + lock, period) < 1e-12


@pytest.mark.quick
def test_the_ringing_of_a_rate_is_in_what_a_run_tells_of_its_latches() -> None:
    """As a share of the rate, no more than from which on it may be several times larger."""
    scene, period, speed, step = load_scene("truss2"), 0.2, 0.4, 0.03
    shape = len(scene.structure.planes), scene.structure.sections
    times = step * np.arange(-3.5, 12.0)
    for size in (0.05, 0.3):
        angles, rates = np.full((len(times), *shape), math.pi - 1.0), np.zeros((len(times), *shape))
        angles[:, 0, 0] = math.pi + np.where(times > 0.0, 1e-3, -1e-3)
        own = speed + size * np.sin(2.0 * math.pi / period * np.maximum(times, 0.0))
        way = np.concatenate([[0.0], np.cumsum(0.5 * step * (own[1:] + own[:-1]))])
        angles[:, 0, 1], rates[:, 0, 1] = math.pi + way - way[-3], own
        found = history(scene, times, angles, rates, period)
        still = history(scene, times, angles, rates, 1e9)  # of rods that hardly swing meanwhile
        lock = float(times[-3])
        share = ringing(times, own, np.array([0.0, lock]), lock, period) / found.rates[0, 1]
        assert found.unsure[0, 1] == pytest.approx(max(min(share, 0.2), still.unsure[0, 1]))
        assert share > 0.02


@pytest.mark.quick
def test_a_joint_that_comes_within_one_step_has_moved() -> None:
    """Carried on it would stop before 180 deg, which it passes all the same: with steps of 4.3 s on
    the ground a joint had a rate of 0, and violated what a latch asks for.
    """
    times, past = [540.0, 545.0, 550.0, 554.34], [-0.30, -0.16, -0.107, 9e-4]
    found = meeting(times, past, [0.035, 0.02, 0.001, 0.0])
    assert found.rate == pytest.approx(0.107 / (found.time - 550.0), rel=1e-12)
    assert 550.0 < found.time < 554.34
    assert found.unsure == 1.0


@pytest.mark.quick
def test_a_joint_jerked_by_the_lock_of_another_goes_on_with_the_smaller_acceleration() -> None:
    times, speeds = np.array([0.0, 0.1, 0.2, 0.3]), np.array([0.1, 0.12, 0.2, 0.01])
    past = np.array([-0.05, -0.04, -0.02, 1e-4])
    for other, acceleration in ((-1.0, 0.8), (-0.001, 0.2)):  # it does not lock, it locks
        two = np.stack([past, [other, other, other + 0.01, other + 0.02]], axis=-1)[:, None]
        found = list(meetings(times, math.pi + two, np.stack([speeds] * 2, axis=-1)[:, None]))
        (own,) = [one for one in found if one.place == (0, 0)]
        assert own.rate == pytest.approx(math.sqrt(0.04 + 2.0 * acceleration * 0.02), rel=1e-12)


@pytest.mark.quick
def test_joints_that_lock_together_do_not_jerk_one_another() -> None:
    """A rod carries nothing within a twentieth of a step: the last acceleration goes on."""
    times, own = np.array([0.0, 0.1, 0.2, 0.3]), np.array([-0.05, -0.04, -0.02, 1e-4])
    speeds = np.array([0.1, 0.12, 0.2, 0.01])
    lock = meeting([*times], [*own], [*speeds]).time
    for before, acceleration in ((0.003, 0.8), (0.007, 0.2)):  # of steps of 0.1 s
        other = 0.05 * (times - lock + before)
        steady = np.full(4, 0.05)
        two, rates = (np.stack(each, axis=-1) for each in ((own, other), (speeds, steady)))
        found = list(meetings(times, math.pi + two[:, None], rates[:, None]))
        (first,) = [one for one in found if one.place == (0, 0)]
        assert first.rate == pytest.approx(math.sqrt(0.04 + 2.0 * acceleration * 0.02), rel=1e-9)


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


def test_a_run_says_which_rates_the_lock_of_another_joint_may_have_changed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The locks of section 1 drive section 2, by steps of 2 ms, from 0.05 to 0.1 rad/s.  Where that
    decides on a latch steps are repeated; where they cannot be, the run says so.
    """
    scene = load_scene("truss2").with_values({"latch.min_rate": 0.04})
    repeated = simulate(scene.with_values({"solver.tolerance": 1e-3}), "frame")
    assert "another joint" not in repeated.attrs["reason"]
    assert float(repeated.latch_rate[0, 1]) == pytest.approx(0.1, rel=0.05)
    monkeypatch.setattr(Latches, "undecided", lambda *_: math.inf)
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


@pytest.mark.quick
@for_each(
    ("met", "unsure", "driven", "decides"),
    [
        (0.0, 1.0, False, True),  # what is not known may be anything
        (0.001, 0.99, False, True),
        (0.001, 0.97, False, False),
        (0.0, 0.1, False, False),
        (0.039, 0.04, False, False),
        (0.0395, 0.06, False, True),
        (0.041, 0.06, False, True),
        (0.05, 0.06, False, False),
        (0.009, 0.21, False, True),  # of five times it
        (0.007, 0.21, False, False),
        (0.017, 0.0, True, True),  # of two and a half times it, behind another lock
        (0.015, 0.0, True, False),
        (0.09, 0.9, False, True),
        (0.11, 0.9, False, False),
    ],
)
def test_of_rates_near_the_least_that_a_latch_asks_for_steps_may_decide(
    met: float, unsure: float, driven: bool, decides: bool
) -> None:
    assert bool(may_decide(met, unsure, 0.04, driven=driven)) == decides
    assert not may_decide(met, unsure, -math.inf, driven=driven)  # a latch that asks for none


@pytest.mark.quick
def test_least_and_largest_rate_are_told_by_their_own_uncertainty_or_a_worse_one() -> None:
    """Uncertain by 5 %, or jerked within two steps; the largest by any beyond 20 %, too."""
    times, nothing = np.arange(0.0, 3.0, 0.1), np.zeros((30, 2, 2))
    scene = load_scene("truss2")

    def told_of(
        rates: list[float], unsure: list[float], locks: list[float]
    ) -> tuple[list[str], str]:
        series = Series(times, nothing, times)
        own = Run(scene, series, series, np.reshape(locks, (2, 2)), {}, {})
        own.__dict__["history"] = History(
            np.reshape(rates, (2, 2)), np.reshape(locks, (2, 2)), np.reshape(unsure, (2, 2))
        )
        return may_be_off(unresolved(own, {}))

    def named(rates: list[float], unsure: list[float], locks: list[float]) -> list[str]:
        return told_of(rates, unsure, locks)[0]

    rates, calm = [0.1, 0.2, 0.3, 0.4], [0.25, 0.95, 1.65, 2.35]
    for unsure, told in (
        ([0.04, 0.04, 0.04, 0.04], []),
        ([0.06, 0.04, 0.04, 0.04], ["least_latch_rate"]),
        ([0.04, 0.19, 0.04, 0.06], ["peak_latch_rate"]),
        ([0.04, 0.19, 0.04, 0.04], []),
        ([0.04, 0.21, 0.04, 0.04], ["peak_latch_rate"]),
        ([0.06, 0.04, 0.04, 0.5], ["least_latch_rate", "peak_latch_rate"]),
    ):
        assert named(rates, unsure, calm) == told
    for jerk, told in ((2.348, []), (2.25, ["peak_latch_rate"]), (2.05, [])):
        assert named(rates, [0.0] * 4, [0.25, 0.95, jerk, 2.35]) == told
    # The share goes with the tolerance: that for 3 %, and a tenth to spare.
    _, cures = told_of(rates, [0.12, 0.04, 0.04, 0.04], calm)
    tolerance = 0.9 * scene.solver.tolerance * 0.03 / 0.12
    (cure,) = cures.values()
    assert cure.startswith(f"set solver.tolerance = {tolerance:.1e} (")
    missing = [0.1, math.nan, 0.3, 0.4]
    assert named(missing, [0.3, math.nan, 0.0, 0.0], calm) == ["peak_latch_rate"]


@pytest.mark.quick
def test_a_latch_that_the_lock_of_another_within_two_steps_may_decide_is_told() -> None:
    """With the share of its rate that is told of the rate itself, 15 %: 0.1 rad/s, of 0.11."""
    times = np.arange(0.0, 3.0, 0.1)
    series = Series(times, np.zeros((30, 2, 2)), times)
    for asked, lock, told in ((0.11, 2.25, True), (0.14, 2.25, False), (0.11, 1.95, False)):
        scene = load_scene("truss2").with_values({"latch.min_rate": asked})
        locks = np.array([[0.25, 0.95], [lock, 2.35]])
        own = Run(scene, series, series, locks, {}, {})
        rates = np.array([[0.5, 0.5], [0.5, 0.1]])
        own.__dict__["history"] = History(rates, locks, np.zeros((2, 2)))
        assert jerked(own).startswith("; whether the latch of lower 2 catches") == told
        assert bool(jerked(own)) == told


@pytest.mark.quick
def test_shocks_and_uncertain_rates_have_a_sentence_each_and_the_smaller_tolerance_cures() -> None:
    told = "; steps of 1 ms at the lock at 2 s are too long for {}, so {} may be off: set {} = {}"
    tolerance = "solver.tolerance"
    value = "3.0e-06 (2 to 3 times the steps)"
    reason = "done" + told.format("shocks in the rods", "peak_base_force", tolerance, "1.0e-05")
    reason += told.format("the rate", "least_latch_rate", tolerance, value)
    names, cures = may_be_off(reason + " (start 2 with solver.step = 0.1 s)")
    assert names == ["peak_base_force", "least_latch_rate"]
    cure = "set solver.tolerance = 3.0e-06 (2 to 3 times the steps)"
    assert cures == {"steps are too long at locks": cure}


def test_a_latch_of_which_an_uncertain_rate_decides_is_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By coarse steps two latches do not catch that catch by finer ones, to which steps that leave
    it open are shortened.
    """
    values = {"structure.sections": 4, "latch.min_rate": 0.02, "solver.tolerance": 9e-3}
    scene = load_scene("ring18-flight").with_values(values)
    repeated, fine = simulate(scene, "frame"), scene.with_values({"solver.tolerance": 1e-4})
    assert bool((repeated.latched == 1).all())
    assert "uncertain" not in repeated.attrs["reason"]
    least = float(simulate(fine, "frame").least_latch_rate)
    assert float(repeated.least_latch_rate) == pytest.approx(least, rel=0.05)
    monkeypatch.setattr(Latches, "undecided", lambda *_: math.inf)
    run = simulate(scene, "frame")
    (said,) = re.findall(r"whether the latch of ([^;]*?) catches is uncertain", run.attrs["reason"])
    wrong = np.argwhere(run.latched.to_numpy() == 0).tolist()
    assert wrong
    assert {f"{('upper', 'lower')[p]} {s + 1}" for p, s in wrong} <= set(said.split(", "))


def test_rates_that_long_steps_make_wrong_are_told_with_the_tolerance_that_cures_them() -> None:
    """By nothing that is recorded; of the ring of 6 sections the largest is 7.7 % too small."""
    scene = load_scene("ring18-cable").with_values({"structure.sections": 6})
    first = simulate(scene, "frame")
    said = (
        r"are too long for the rate at which a latch is met, so (.*) may be off: set (\S+) = (\S+)"
    )
    ((names, key, value),) = re.findall(said, first.attrs["reason"])
    assert names == "peak_latch_rate"
    cured = simulate(scene.with_values({key: float(value)}), "frame")
    assert "may be off" not in cured.attrs["reason"]
    finest = simulate(scene.with_values({key: 3e-5}), "frame")
    least, peak = (
        [float(run[name]) for run in (first, cured, finest)]
        for name in ("least_latch_rate", "peak_latch_rate")
    )
    assert abs(peak[0] / peak[2] - 1.0) > 0.05
    assert peak[1] == pytest.approx(peak[2], rel=0.01)
    assert least[:2] == pytest.approx([least[2]] * 2, rel=1e-3)
