"""Guards stop what cannot be sound, name the cause, and leave sound runs alone."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ringsim.analysis.stability import word_of
from ringsim.parts.solver import Solver
from ringsim.stepping.guard import BLOW_UP, GAIN, GAP, LOSS, PEAK_BEND, SLIGHT, STEPS, Guard
from ringsim.stepping.instant import Energies, Instant, Scales

pytestmark = pytest.mark.quick

TOLERANCE, LEAST, BAR = 0.02, 1e-3, 0.3
SOLVER = Solver(energy_tolerance=TOLERANCE)
SCALES = Scales(rate=0.1, energy=LEAST, travel=math.pi, length=BAR)
REST = Energies(0.0, 0.0, 0.0, 0.0)


class Watching(Guard):
    """A guard to whom an instant is told by what it judges."""

    def judge(self, time, energies, gap=0.0) -> str:
        return super().judge(Instant(time, *np.zeros((2, 2, 3)), energies, gap))


def guard() -> Watching:
    """One that has seen a ring at rest."""
    fresh = Watching(SOLVER, SCALES)
    assert fresh.judge(0.0, REST) == ""
    return fresh


def after(work: float, created: float) -> Energies:
    """Everything that the loads put in moves, and what time integration added besides."""
    return Energies(work + created, 0.0, work, 0.0)


def test_a_balanced_motion_goes_on_and_is_sound() -> None:
    watching = guard()
    for k in range(1, 100):
        moving = Energies(0.8 * k, 0.1 * k, 1.0 * k, 0.2, 0.1)
        assert watching.judge(0.1 * k, moving, 1e-9) == ""
    assert watching.verdict() == ""


@pytest.mark.parametrize(("factor", "sign"), [(GAIN, 1.0), (LOSS, -1.0)])
def test_energy_that_comes_or_goes_stops_the_run_at_its_bound(factor, sign) -> None:
    """X is the work where energy is lost, and the kinetic energy where it was added."""
    share = sign * factor * TOLERANCE
    exact = share / (1.0 - share) if sign > 0.0 else share
    assert guard().judge(1.0, after(1.0, 0.999 * exact), 0.0) == ""
    reason = guard().judge(1.0, after(1.0, 1.001 * exact), 0.0)
    assert word_of(reason.cause) == ("energy grew" if sign > 0.0 else "energy lost")
    assert "1 s" in reason
    assert "solver.energy_tolerance" in reason
    assert "reduce solver.step" in reason


@pytest.mark.parametrize("created", [0.03, -0.03])
def test_a_run_that_ends_with_too_large_an_imbalance_is_not_sound(created) -> None:
    watching = guard()
    assert watching.judge(1.0, after(1.0, created), 0.0) == ""
    assert watching.judge(2.0, after(1.0, 0.0), 0.0) == ""
    assert word_of(watching.verdict().cause) == ("energy grew" if created > 0.0 else "energy lost")
    assert "up to 1 s" in watching.verdict()


def test_an_early_imbalance_is_small_beside_all_that_follows() -> None:
    watching = guard()
    watching.judge(1.0, after(1.0, 0.03), 0.0)
    watching.judge(2.0, after(10.0, 0.03), 0.0)
    assert watching.verdict() == ""


def test_next_to_no_energy_does_not_count() -> None:
    watching = guard()
    assert watching.judge(1.0, after(0.0, 0.5 * TOLERANCE * SLIGHT * LEAST), 0.0) == ""
    assert watching.verdict() == ""


def test_a_quiet_run_is_judged_by_its_own_energy_at_the_end() -> None:
    watching = guard()
    assert watching.judge(1.0, after(0.1 * LEAST, 0.01 * LEAST), 0.0) == ""
    assert word_of(watching.verdict().cause) == "energy grew"


def test_more_energy_than_there_can_be_is_a_blow_up() -> None:
    stored = (BLOW_UP + 1.0) * 2.0
    reason = guard().judge(0.5, Energies(stored, 0.0, 2.0, 0.0), 0.0)
    assert word_of(reason.cause) == "blow-up"
    assert f"{stored:.3g} J of kinetic" in reason


def test_energy_of_the_start_is_available() -> None:
    watching = Watching(SOLVER, SCALES)
    assert watching.judge(0.0, Energies(0.0, 5.0, 0.0, 0.0), 0.0) == ""
    assert watching.judge(1.0, Energies(5.0, 0.0, 0.0, 0.0), 0.0) == ""
    assert watching.verdict() == ""


def changed(credit: float) -> Watching:
    """One that saw 5 J put into a ring, and then a change whose other loads say -5 J: it credited
    what they differ by.
    """
    watching = guard()
    assert watching.judge(1.0, after(5.0, 0.0)) == ""
    now = Instant(1.0, *np.zeros((2, 2, 3)), Energies(5.0, 0.0, 5.0 - credit, 0.0))
    watching.begin_anew(now, -credit)
    return watching


def test_what_a_change_credited_is_available_where_the_work_passes_zero() -> None:
    watching = changed(10.0)
    assert watching.judge(2.0, Energies(10.0, 0.0, 0.0, 0.0)) == ""
    assert watching.judge(3.0, Energies(15.0, 0.0, 5.0, 0.0)) == ""
    assert watching.verdict() == ""


def test_a_blow_up_is_caught_behind_a_change_all_the_same() -> None:
    """10 J of credit, and works that went up by 5 J."""
    for factor, cause in ((0.9, "energy grew"), (1.1, "blow-up")):
        stored = factor * BLOW_UP * 15.0
        assert word_of(changed(10.0).judge(2.0, Energies(stored, 0.0, 0.0, 0.0)).cause) == cause


def test_the_scale_of_energy_is_not_emptied_by_a_change_of_sign() -> None:
    """Where a winch takes what loads give, and where loads take back what they gave."""
    braked, turned = guard(), guard()
    error = 0.9 * GAIN * TOLERANCE * 10.0
    assert braked.judge(1.0, Energies(error, 0.0, 5.0, 0.0, -5.0)) == ""
    assert turned.judge(1.0, after(5.0, 0.0)) == ""
    assert turned.judge(2.0, Energies(0.5 * error, 0.0, 0.0, 0.0)) == ""
    for one in (braked, turned):
        assert word_of(one.judge(3.0, Energies(2.0 * error, 0.0, 0.0, 0.0)).cause) == "energy grew"


def test_a_gap_of_a_joint_stops_the_run() -> None:
    assert guard().judge(1.0, after(1.0, 0.0), 0.99 * GAP * BAR) == ""
    reason = guard().judge(1.0, after(1.0, 0.0), 1.01 * GAP * BAR)
    assert word_of(reason.cause) == "joint gap"
    assert f"{1.01 * GAP * BAR:.2g} m" in reason


def test_an_unknown_balance_stops_nothing() -> None:
    watching = guard()
    assert watching.judge(1.0, Energies(1.0, 0.0, 1.0, math.nan), 0.0) == ""
    assert watching.verdict() == ""


def unresolved(tensions, times, slack_tension: float | None = 0.05) -> str:
    """What constant steps have not resolved of a run that went well otherwise."""
    scales = SCALES._replace(slack_tension=slack_tension)
    watching = Guard(SOLVER.model_copy(update={"step_control": "constant"}), scales)
    for time, tension in zip(times, tensions, strict=True):
        instant = Instant(time, *np.zeros((2, 2, 3)), REST, 0.0, np.array([tension]))
        assert watching.judge(instant) == ""
    return watching.verdict()


@pytest.mark.parametrize(("steps", "cause"), [(3, "tension bends"), (12, "")])
def test_constant_steps_have_to_resolve_a_swing(steps, cause) -> None:
    """A seventh of the mean, with a period of 1 s."""
    times = np.arange(0.0, 10.0, 1.0 / steps)
    swing = 10.0 + 1.5 * np.sin(2.0 * np.pi * times)
    assert word_of(unresolved(swing, times).cause) == cause
    assert unresolved(swing, times, slack_tension=None) == ""


@pytest.mark.parametrize(("share", "cause"), [(1.1, "tension bends"), (0.9, "")])
def test_constant_steps_have_to_resolve_the_largest_tension(share, cause) -> None:
    tensions = np.full(1001, 10.0)
    tensions[500] /= 1.0 - 0.5 * share * PEAK_BEND
    found = unresolved(tensions, 0.01 * np.arange(1001))
    assert word_of(found.cause) == cause
    assert "at 5 s" in found or not cause


def test_a_ramp_in_uneven_steps_does_not_bend_and_a_slack_rope_does_not_matter() -> None:
    ramp = np.array([0.0, 0.1, 0.2, 0.21, 0.22, 0.3, 0.4])
    assert unresolved(100.0 * ramp, ramp) == ""
    assert unresolved(0.01 * (-1.0) ** np.arange(9), np.arange(9.0)) == ""


@pytest.mark.parametrize(
    ("control", "steps", "cause"),
    [
        ("constant", STEPS - 1, "few steps"),
        ("constant", STEPS, ""),
        ("constant", 10 * STEPS, ""),
        ("motion", 5, ""),
    ],
)
def test_a_few_constant_steps_do_not_resolve_a_motion(control, steps, cause) -> None:
    watching = Guard(Solver(step_control=control), SCALES)
    for k in range(steps + 5):
        angles = np.full((2, 3), math.pi * k / steps)
        assert watching.judge(Instant(0.1 * k, angles, 0.0 * angles, REST)) == ""
    assert word_of(watching.verdict().cause) == cause
