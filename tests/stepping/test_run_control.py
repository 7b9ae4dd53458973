"""The control of a run, driven by motions with closed forms instead of an engine."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ringsim.parts.solver import Limits, Solver
from ringsim.stepping.control import RunControl
from ringsim.stepping.instant import Energies, Instant, Scales, pack, unpack
from ringsim.stepping.locks import Latches, Locks
from ringsim.variables import Fate, Status

pytestmark = pytest.mark.quick

INERTIA, TORQUE, BEGIN = 0.2, 0.01, math.radians(20.0)
"""Of each of six V-joints, kg m^2 and N m, and the opening angle that they start from."""
SCALES = Scales(rate=0.2, energy=1e-3, travel=math.pi - BEGIN, length=0.3, contact_step=1e-3)
Law = Callable[[float], tuple[float, float]]


def falling(time: float) -> tuple[float, float]:
    """Angle and rate under a constant torque."""
    acceleration = TORQUE / INERTIA
    return BEGIN + 0.5 * acceleration * time**2, acceleration * time


def lifted(time: float) -> tuple[float, float]:
    """A rate that grows exponentially, as that of a toggle."""
    return BEGIN + 0.01 * (math.exp(2.0 * time) - 1.0), 0.02 * math.exp(2.0 * time)


class Motion:
    """What an engine would read of six joints that move alike by a law, without any loss."""

    def __init__(self, law: Law = falling, tensions: np.ndarray | None = None) -> None:
        self.law, self.tensions = law, tensions
        self.begun = 6.0 * 0.5 * INERTIA * law(0.0)[1] ** 2
        self.swallowed = 0.0

    def at(self, time: float) -> Instant:
        angle, rate = self.law(time)
        kinetic = 6.0 * 0.5 * INERTIA * rate**2
        energies = Energies(kinetic - self.swallowed, 0.0, kinetic - self.begun, 0.0)
        angles, rates = np.full((2, 3), angle), np.full((2, 3), rate)
        return Instant(time, angles, rates, energies, tensions=self.tensions)


def control_of(motion: Motion, solver: Solver, *, locking: bool = True, **more) -> RunControl:
    start = motion.at(0.0)
    locks = Locks(start.angles, BEGIN - 0.1) if locking else None
    return RunControl(solver, SCALES, start, locks, **more)


def follow(motion: Motion, control: RunControl, event: float = math.inf) -> np.ndarray:
    """Run to the end; the times of all instants."""
    times = [0.0]
    while control.goes_on:
        step = control.next_step(event if times[-1] < event else math.inf)
        found = motion.at(times[-1] + step)
        while control.shorter(found) is not None:
            step = control.retry(0.5 * step)
            found = motion.at(times[-1] + step)
        control.accept(found)
        times.append(found.time)
    control.conclude()
    return np.array(times)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-3 / 16.0])
def test_steps_are_those_of_a_relative_error_in_time(tolerance: float) -> None:
    """h = sqrt(tolerance a' / (C a''')) with C = 0.1 and a''' = 4 a', whatever the rate.

    It holds from the reference rate on, 1.15 s.  The third derivative over two steps is that of
    their middle, where the rate, and with it a''', was smaller by exp(-2 h).
    """
    solver = Solver(tolerance=tolerance, step=0.2, end_time=2.0)
    times = follow(motion := Motion(lifted), control_of(motion, solver))
    steps = np.diff(times[(times > 1.3) & (times < 1.9)])
    assert len(steps) >= 10
    assert steps * np.exp(-steps) == pytest.approx(math.sqrt(tolerance / 0.4), rel=2e-3)


def test_the_run_ends_settled_after_the_exact_time_of_the_last_lock() -> None:
    solver = Solver(settling_time=0.05)
    control = control_of(motion := Motion(), solver)
    times = follow(motion, control)
    exact = math.sqrt(2.0 * (math.pi - BEGIN) * INERTIA / TORQUE)
    assert (control.status, control.reason) == (Status.OK, "all V-joints have reached 180 deg")
    assert times[-1] == pytest.approx(exact + 0.05, abs=1e-12)
    assert control.repeats == 0
    # The joint that comes at 0.5 rad/s goes no deeper than 0.05 deg sqrt(3) in a step.
    meeting = np.diff(times)[np.searchsorted(times, exact) - 1]
    # The step was chosen for the rate at its beginning.
    rate = falling(exact - meeting)[1]
    assert meeting <= math.radians(0.05) * math.sqrt(3.0) / rate


@pytest.mark.parametrize("stowed", [BEGIN - 0.1, None], ids=["stops", "none"])
def test_a_run_that_goes_on_settles_as_long_as_its_own_scene_says(stowed: float | None) -> None:
    """At 180 deg it would have gone on for 0.05 s, and does for 0.1 s; without stops neither."""
    motion, ends = Motion(), []
    start = motion.at(0.0)
    first, other = (
        RunControl(Solver(settling_time=time), SCALES, start, Locks(start.angles, stowed))
        for time in (0.05, 0.1)
    )
    while not first.now.angles.min() >= math.pi:
        first.accept(motion.at(first.now.time + first.next_step()))
    other.recall(unpack(*pack(first.memory())))
    for control in (first, other):
        while control.goes_on:
            control.accept(motion.at(control.now.time + control.next_step()))
        ends.append(control.now.time)
    assert ends[1] - ends[0] == pytest.approx(0.05 if stowed else 0.0, abs=1e-12)


def test_no_step_passes_an_event_and_the_last_two_share_the_way() -> None:
    event = 2.345
    times = follow(motion := Motion(), control_of(motion, Solver(tolerance=0.1)), event)
    before = np.diff(times[times <= event])
    assert event in times
    assert before[-1] == pytest.approx(before[-2], rel=1e-9)


def test_a_step_that_swallows_energy_is_repeated_until_it_does_not() -> None:
    """What is missing goes with the third power of the step."""
    motion = Motion()
    control = control_of(motion, Solver(tolerance=1e-3))
    for _ in range(30):
        control.accept(motion.at(control.now.time + control.next_step()))
    now, step = control.now, control.next_step()
    asked = []
    while True:
        motion.swallowed = 0.05 * (step / 0.2) ** 3
        shorter = control.shorter(motion.at(now.time + step))
        if shorter is None:
            break
        asked.append((step, shorter, motion.swallowed))
        assert control.retry(math.nan) == shorter
        step = shorter
    assert control.repeats == len(asked) >= 1
    tried, shorter, missing = asked[-1]
    exchanged = motion.at(now.time + tried).energies.work
    allowed = 0.3 * 1e-3 * exchanged
    assert shorter == pytest.approx(0.8 * tried * (allowed / missing) ** (1.0 / 3.0), rel=1e-9)
    assert control.accept(motion.at(now.time + step))
    assert control.next_step() <= 1.5 * step


def test_a_failed_newton_halves_the_step_and_a_solver_that_gives_up_says_so() -> None:
    control = control_of(Motion(), Solver())
    step = control.next_step()
    assert control.retry(0.5 * step) == 0.5 * step
    control.fail("no convergence")
    control.conclude()
    assert control.status is Status.SOLVER_FAILED
    assert "after 1 step reductions" in control.reason
    assert control.reason.endswith("(no convergence)")
    assert not control.goes_on


@pytest.mark.parametrize(
    ("solver", "status", "words"),
    [
        (Solver(end_time=1.0), Status.OK, "reached with 0 of 6 V-joints locked"),
        (Solver(step_limit=30), Status.SOLVER_FAILED, "solver.step_limit = 30 steps"),
    ],
)
def test_a_run_that_does_not_reach_its_goal_says_why(solver, status, words) -> None:
    times = follow(motion := Motion(), control := control_of(motion, solver))
    assert control.status is status
    assert words in control.reason
    assert times[-1] <= 1.0 or len(times) == 31


def test_the_guard_ends_a_run_whose_energy_gets_lost() -> None:
    control = control_of(motion := Motion(), Solver(step_control="constant", step=0.02))
    while control.goes_on:
        motion.swallowed = 0.6 * motion.at(control.now.time).energies.work
        control.accept(motion.at(control.now.time + control.next_step()))
    assert control.status is Status.DIVERGED
    assert "solver.energy_tolerance" in control.reason


@pytest.mark.parametrize(
    ("slack_tension", "words"), [(None, "the run lasted"), (0.01, "the cable was wound")]
)
def test_constant_steps_without_locks_run_to_the_end_time(slack_tension, words) -> None:
    """A structure whose joints do not lock; the last step is what is left."""
    solver = Solver(step_control="constant", step=0.3, end_time=4.0)
    motion = Motion(tensions=None if slack_tension is None else np.ones(1))
    control = RunControl(solver, SCALES._replace(slack_tension=slack_tension), motion.at(0.0))
    times = follow(motion, control)
    assert times == pytest.approx([*(0.3 * np.arange(14)), 4.0])
    assert control.status is Status.OK
    assert control.fate is Fate.FINISHED
    assert control.reason == f"{words} until solver.end_time = 4 s"


@pytest.mark.parametrize(("time_to_stop", "repeated"), [(0.15, True), (0.6, False)])
def test_a_first_step_that_leads_too_close_to_a_stop_is_repeated(time_to_stop, repeated) -> None:
    """It takes 2 % of the time to the first stop at most, which its end is the first to tell."""
    rate = 0.1
    motion = Motion(lambda time: (math.pi - rate * (time_to_stop - time), rate))
    control = control_of(motion, Solver(step=0.2))
    step = control.next_step()
    assert step == pytest.approx(0.2 / 20.0)
    assert (step > 0.02 * time_to_stop) is repeated
    shorter = control.shorter(motion.at(step))
    assert shorter == (pytest.approx(0.2 * step) if repeated else None)
    step = control.retry(math.nan) if repeated else step
    assert step <= 0.02 * time_to_stop
    assert control.shorter(motion.at(step)) is None
    # From the second step on the last one's rates have told how far away the stop is.
    assert control.accept(motion.at(step))
    assert control.shorter(motion.at(0.5 * time_to_stop)) is None


@pytest.mark.parametrize(("locking", "grown"), [(False, [0.2, 0.4]), (True, [0.1, 0.1])])
def test_a_shortened_constant_step_grows_again_where_no_stop_is_ahead(locking, grown) -> None:
    solver = Solver(step_control="constant", step=0.4)
    control = control_of(motion := Motion(), solver, locking=locking)
    assert control.next_step() == 0.4
    steps = [control.retry(0.1)]
    for _ in range(20):
        control.accept(motion.at(control.now.time + steps[-1]))
        steps.append(control.next_step())
    assert steps[:10] == [0.1] * 10
    assert [steps[10], steps[20]] == pytest.approx(grown)


def test_the_next_step_starts_from_what_a_fault_has_left() -> None:
    motion = Motion()
    control = control_of(motion, Solver())
    found = motion.at(control.next_step())
    struck = replace(found, energies=found.energies._replace(elastic=-0.5, lost=0.5))
    control.accept(found, struck)
    assert control.now is struck
    later = motion.at(found.time + control.next_step())
    balanced = replace(later, energies=later.energies._replace(elastic=-0.5))
    assert control.shorter(balanced) is None
    assert control.shorter(later) is not None


def test_tensions_are_judged_until_the_last_lock() -> None:
    """A tension that jumps by 10 N, below the energy that matters."""
    roped = SCALES._replace(slack_tension=0.01, slack_energy=1e3)
    solver = Solver(settling_time=1.0)
    for locked in (False, True):
        motion = Motion()
        start = replace(motion.at(0.0), tensions=np.zeros(2))
        control = RunControl(solver, roped, start, Locks(start.angles, 0.1))
        exact = math.sqrt(2.0 * (math.pi - BEGIN) * INERTIA / TORQUE)
        until = exact if locked else 0.5 * exact
        while control.now.time < until:
            found = motion.at(control.now.time + control.next_step())
            control.accept(replace(found, tensions=np.ones(2)))
        found = motion.at(control.now.time + control.next_step())
        jumped = replace(found, tensions=np.full(2, 11.0))
        assert (control.shorter(jumped) is None) is locked


def parted(time: float) -> tuple[float, float]:
    """Opens within 4 s, and goes on at the same rate."""
    rate = (math.pi - BEGIN) / 4.0
    return BEGIN + rate * time, rate


def spread(motion: Motion, left: int) -> Motion:
    """The same motion, but the last joints stay where they are."""
    at = motion.at

    def held(time: float) -> Instant:
        now = at(time)
        angles, rates = now.angles.copy(), now.rates.copy()
        angles.flat[6 - left :], rates.flat[6 - left :] = BEGIN, 0.0
        return replace(now, angles=angles, rates=rates)

    motion.at = held  # type: ignore[method-assign]
    return motion


def test_a_joint_past_its_limit_ends_a_sound_run_and_is_named() -> None:
    motion = spread(Motion(parted), left=1)
    control = control_of(motion, Solver(end_time=20.0), limits=Limits(overrun=10.0))
    times = follow(motion, control)
    assert (control.status, control.fate) == (Status.OK, Fate.OVERLOADED)
    rate = (math.pi - BEGIN) / 4.0
    assert times[-1] == pytest.approx(4.0 + math.radians(10.0) / rate, abs=0.2)
    assert "V-joint upper 1 was driven 1" in control.reason
    assert control.reason.endswith(
        "more than limits.overrun = 10 deg, with 5 of 6 V-joints locked, not lower 3"
    )


def coming_twice(time: float) -> tuple[float, float]:
    """At 180 deg with 0.5 rad/s after 1 s, leaving it at 1.5 s, and with 1.5 rad/s after 3 s."""
    past = np.poly1d([1.0, 1.5, 3.0], r=True) * 0.5
    return math.pi + float(past(time)), float(past.deriv()(time))


@pytest.mark.parametrize(
    ("least", "end", "fate", "words"),
    [
        (0.3, 1.05, Fate.DEPLOYED, "all V-joints have reached 180 deg"),
        (1.0, 3.05, Fate.DEPLOYED, "all V-joints have reached 180 deg"),
        (2.0, 3.1, Fate.NOT_LATCHED, "solver.end_time = 3.1 s was reached with 6 of 6 V-joints"),
    ],
)
def test_the_run_settles_once_latches_hold(
    least: float, end: float, fate: Fate, words: str
) -> None:
    motion, solver = Motion(coming_twice), Solver(end_time=3.1, settling_time=0.05)
    places = SimpleNamespace(planes=("upper", "lower"), sections=3)
    stop, latch = SimpleNamespace(latch=True), SimpleNamespace(min_rate=least)
    latches = Latches(SimpleNamespace(structure=places, stop=stop, latch=latch, faults=[]))
    start = motion.at(0.0)
    locks = Locks(start.angles, 0.1, latches=latches)
    control = RunControl(solver, SCALES, start, locks, limits=Limits(overrun=30.0))
    times = follow(motion, control)
    assert (control.status, control.fate) == (Status.OK, fate)
    assert control.reason.startswith(words)
    assert times[-1] == pytest.approx(end, abs=1e-6)
    assert latches.caught.all() == (fate is Fate.DEPLOYED)


def test_a_solver_that_gives_up_before_latches_catch_has_failed() -> None:
    motion, solver = Motion(coming_twice), Solver(end_time=1.1, settling_time=0.05)
    places = SimpleNamespace(planes=("upper", "lower"), sections=3)
    stop, latch = SimpleNamespace(latch=True), SimpleNamespace(min_rate=1.0)
    latches = Latches(SimpleNamespace(structure=places, stop=stop, latch=latch, faults=[]))
    start = motion.at(0.0)
    locks = Locks(start.angles, 0.1, latches=latches)
    control = RunControl(solver, SCALES, start, locks, limits=Limits(overrun=30.0))
    follow(motion, control)
    assert (control.fate, locks.unlatched) == (Fate.NOT_LATCHED, True)
    assert "6 of 6 V-joints at 180 deg" in control.reason
    control.fate = Fate.NONE
    control.fail("Newton")
    assert (control.status, control.fate) == (Status.SOLVER_FAILED, Fate.NONE)
    assert "the solver stopped" in control.reason


def test_joints_go_past_180_deg_where_there_is_no_stop() -> None:
    motion = spread(Motion(parted), left=1)
    locks = Locks(motion.at(0.0).angles, None)
    control = RunControl(Solver(end_time=5.0), SCALES, motion.at(0.0), locks)
    follow(motion, control)
    assert control.fate is Fate.CUT_OFF
    assert "past" not in control.reason


def test_a_rope_that_no_rope_would_survive_ends_a_sound_run() -> None:
    motion, control = Motion(), control_of(Motion(), Solver(end_time=20.0))
    at = motion.at
    motion.at = lambda time: replace(at(time), stretch=0.2 * time)  # type: ignore[method-assign]
    times = follow(motion, control)
    assert (control.status, control.fate) == (Status.OK, Fate.OVERLOADED)
    assert 1.25 < times[-1] < 1.6
    assert "more than limits.rope_strain = 0.25, with 0 of 6 V-joints locked" in control.reason


@pytest.mark.parametrize(
    ("left", "fate", "words"),
    [
        (
            6,
            Fate.STALLED,
            "came to rest with 0 of 6 V-joints locked: no winch moves the ring, and every "
            "V-joint has kept within 0.57 deg for 3 s",
        ),
        (2, Fate.PARTLY_DEPLOYED, "came to rest with 4 of 6 V-joints locked, not lower 2, lower 3"),
        (
            3,
            Fate.PARTLY_DEPLOYED,
            "came to rest with 3 of 6 V-joints locked, none of the lower plane:",
        ),
    ],
)
def test_what_rests_before_its_goal_ends_at_once(left: int, fate: Fate, words: str) -> None:
    rate = (math.pi - BEGIN) / 4.0
    motion = spread(
        Motion(lambda t: (min(BEGIN + rate * t, math.pi), rate if t < 4.0 else 0.0)), left
    )
    solver = Solver(end_time=30.0, energy_tolerance=1e3)  # rates jump: no balance holds
    control = control_of(motion, solver)
    times = follow(motion, control)
    assert (control.status, control.fate) == (Status.OK, fate)
    assert control.reason.startswith(words)
    assert times[-1] < 4.0 + 0.1 * 30.0 + 1.0


def test_the_end_time_cuts_a_motion_off_and_tells_which_joints_are_missing() -> None:
    motion = spread(Motion(parted), left=1)
    control = control_of(motion, Solver(end_time=4.2), limits=Limits(overrun=10.0))
    follow(motion, control)
    assert (control.status, control.fate) == (Status.OK, Fate.CUT_OFF)
    assert control.reason.startswith(
        "solver.end_time = 4.2 s was reached with 5 of 6 V-joints locked, not lower 3; "
        "V-joint upper 1 was up to 8 deg past its stop, at 4.2 s"
    )
