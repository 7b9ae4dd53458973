"""The one place that decides on a run's steps: the next, the repeated, the last."""

import math
from collections.abc import Sequence

import numpy as np

from ringsim.parts.faults import AT_ONCE
from ringsim.parts.solver import NO_DEVIATIONS, Limits, Solver
from ringsim.refusal import InputError
from ringsim.stepping.ending import Rest, resting
from ringsim.stepping.guard import ConstantSteps, Guard
from ringsim.stepping.instant import AS_DRAWN, Instant, Memory, Remembering, Scales, Strained
from ringsim.stepping.locks import Locks, Overrun, StopContact, lock_times
from ringsim.stepping.repeats import (
    SHORTEST,
    DeviationSteps,
    EnergyImbalance,
    Indicator,
    MotionSteps,
    ShockSteps,
    TensionBend,
)
from ringsim.variables import Cause, Fate, Reason, Status

# The one place that decides on a run's steps: the next, the repeated, the last.
#
# An engine calls ``next_step``; ``retry`` where Newton fails or ``shorter`` refuses what it has
# found; ``accept``, while that is true; and ``conclude``.


TOLD = math.radians(2.0)
"""Angle from which on a run tells how far a V-joint was past its stop: sound rings go 0.1 to
0.2 deg deep into the default stop, 7 N m hold it at 2 deg."""
_ROUND_OFF = 1e-12
"""Relative difference of two times that are the same."""


def overstrained(strain: float, time: float, limits: Limits, missing: str) -> str:
    """Why a run ends at a time (s) where a rope is longer than ``limits`` allow."""
    return (
        f"a rope was strained by {100.0 * strain:.3g} % at {time:.6g} s, more than "
        f"limits.rope_strain = {limits.rope_strain:g}, with {missing}"
    )


class RunControl(Remembering):
    """Steps, care and guard of one run.

    ``now`` is the last accepted state, ``goes_on`` whether there is a step from there, ``status``,
    ``fate`` and ``reason`` how the run has ended, ``repeats`` how many steps were repeated.
    """

    changing = (
        "now", "goes_on", "status", "fate", "reason",
        "repeats", "_count", "_farthest", "_settled_at",
    )  # fmt: skip

    def __init__(
        self,
        solver: Solver,
        scales: Scales,
        start: Instant,
        locks: Locks | None = None,
        *,
        limits: Limits = Limits(),  # noqa: B008  frozen
        follow_deviations: bool = False,
        turn: float = math.inf,
        strained: Strained = AS_DRAWN,
        sampled: bool = False,
        jolts: Sequence[float] | None = None,
    ) -> None:
        """Begin a run, which ends when the V-joints of ``locks`` have all reached the same stop and
        their latches have caught, or one is past it by more than ``limits``, or all are at rest,
        else at ``solver.end_time``; with ``follow_deviations`` steps resolve how the joints deviate
        from their mean angle.  No stop that is reached before the time ``turn`` (s), at which loads
        turn round, ends it.  A structure that is not ``strained`` as it was put together does not
        begin.  Steps of a run that is ``sampled`` by a controller are cut at every sample; with
        ``jolts``, times (s) at which forces jump, they resolve what these, the start and locks do
        to the rods.
        """
        self.now, self._solver, self._locks, self._limits = start, solver, locks, limits
        self._rest = Rest(start, solver.end_time, scales.energy)
        self._farthest = Overrun()
        self._scales, self._turn = scales, turn if turn < solver.end_time else math.inf
        self._sampled, self._cut = sampled, False
        self._steps: MotionSteps | ConstantSteps = ConstantSteps(solver.step, locks is None)
        self._indicators: list[Indicator] = []
        self._deviations: DeviationSteps | None = None
        self._shocks: ShockSteps | None = None
        if solver.step_control == "motion":
            self._steps = MotionSteps(solver, scales)
            self._indicators.append(EnergyImbalance(solver, scales))
            self._take_tensions()
            if follow_deviations and solver.deviation_tolerance < NO_DEVIATIONS:
                duration = scales.travel / scales.rate
                self._deviations = DeviationSteps(solver.deviation_tolerance, duration)
            if jolts is not None and locks is not None and locks.stops:
                self._shocks = ShockSteps(solver, scales.period, jolts)
                self._shocks.begin(start)
        self._guard = Guard(solver, scales, strained)
        self._shorter: float | None = None
        self._count, self.repeats, self._settled_at = 0, 0, math.inf
        self.status, self.fate, self.reason = Status.OK, Fate.NONE, Reason()
        self.goes_on = True
        self._watch()
        if locks is not None:
            self._note_strain(locks, start.stretch)

    @property
    def settled(self) -> bool:
        """Whether all V-joints had locked for as long as they shall settle."""
        return self.now.time >= self._settled_at

    def memory(self) -> Memory:
        """See ``Remembering``; with that of all parts by their kinds, after an accepted step."""
        parts = {kind: part.memory() for kind, part in self._parts().items()}
        return super().memory() | {"settling": self._settling, "parts": parts}

    def recall(self, memory: Memory) -> None:
        """See ``Remembering``; other settings may have given a control other parts."""
        super().recall(memory)
        self._settled_at += self._settling - memory["settling"]
        self._turn = self._turn if self.now.time < self._turn - AT_ONCE else math.inf
        for kind, part in self._parts().items():
            if kind in memory["parts"]:
                part.recall(memory["parts"][kind])
        if isinstance(self._steps, ConstantSteps) and "ConstantSteps" not in memory["parts"]:
            self._guard.go_on_with_constant_steps()
        self._leave_tensions()

    def begin_anew(self, now: Instant, lost: float) -> None:
        """Go on from how a changed scene makes the present instant; ``lost`` is the energy that the
        change has taken since the reading that it replaces, J.
        """
        self.now = now
        self._guard.begin_anew(now, lost)
        self._set_out()

    def unsettle(self) -> None:
        """Let the stop that all V-joints have reached end the run no more: they may leave it."""
        self._settled_at = math.inf
        self._take_tensions()

    def _set_out(self) -> None:
        """Begin steps and the watch for rest as at the start: other forces act from now on."""
        self._rest.begin(self.now)
        self._steps.begin_anew()
        if self._shocks is not None:
            self._shocks.begin(self.now)

    def next_step(self, next_event: float = math.inf) -> float:
        """The next step, s; it must not pass the time ``next_event`` (s), as of a fault."""
        shocks = math.inf if self._shocks is None else self._shocks.limit
        limits = [one.limit for one in self._indicators]
        self._steps.step = min([self._steps.step, shocks, *limits])
        end = min(self._solver.end_time, self._settled_at)
        # What comes at once with the end is left to it: the step between them would be too short.
        end = next_event if next_event < end - AT_ONCE else end
        step = self._steps.towards(end - self.now.time)
        self._cut = self._sampled and step < self._steps.step
        return step

    def retry(self, shorter: float) -> float:
        """The step to repeat the last one with, s: what ``shorter`` has asked for, or else this."""
        self.repeats += 1
        self._steps.step = shorter if self._shorter is None else self._shorter
        self._shorter, self._cut = None, False
        return self._steps.step

    def shorter(self, found: Instant) -> float | None:
        """A smaller step in s to repeat the one to ``found`` with; None if it is good enough.

        To be asked once for each step that has converged.
        """
        wanted = [one.shorter(self.now, found) for one in self._indicators]
        if self._locks is not None and isinstance(self._steps, MotionSteps):
            wanted.append(self._locks.shorter(self.now, found, SHORTEST * self._solver.step))
            if self._shocks is not None:
                wanted.append(self._shocks.shorter(self.now, found, self._locks.deployed))
        self._shorter = min((one for one in wanted if one is not None), default=None)
        if self._shorter is None and isinstance(self._steps, MotionSteps):
            step = found.time - self.now.time
            self._shorter = self._steps.shorter_first(step, lambda: self._contact(found))
        return self._shorter

    def accept(self, found: Instant, struck: Instant | None = None) -> bool:
        """Go on from where the step has led; returns whether there is a next step.

        ``struck`` is the same instant after faults have struck, if any have: the next step starts
        there.
        """
        for indicator in self._indicators:
            indicator.accept(self.now, found, cut=self._cut)
        before, self.now = self.now, struck or found
        self._count += 1
        self._watch()
        if self.goes_on and self._locks is not None:
            known = self._locks.deployed.copy()
            self._locks.note(self.now.angles)
            if self._shocks is not None:
                new = bool((self._locks.deployed & ~known).any())
                self._shocks.accept(self.now, locked=new)
            self._locks.latch(before, found)
            self._note_stop(self._locks, before)
            self._note_overrun(self._locks)
            self._note_strain(self._locks, max(found.stretch, self.now.stretch))
        if self.goes_on:
            self._note_end(before.time)
        if self.goes_on:
            self._steps.advance(self.now, self._contact(self.now))
            locked = self._locks is not None and self._locks.deployed.any()
            if self._deviations is not None and not locked:
                self._steps.step = min(self._steps.step, self._deviations.limit(self.now))
            if self.now.time >= self._turn - AT_ONCE:
                self._turn = math.inf
                self._set_out()
        return self.goes_on

    def fail(self, cause: str) -> None:
        """End a run whose solver gave up, for this cause."""
        self._give_up(
            Cause.NEWTON,
            f"the solver stopped at {self.now.time:.6g} s after {self.repeats} step reductions: "
            f"reduce solver.step or solver.tolerance, or raise solver.newton_tolerance ({cause})",
        )

    def diverge(self, reason: Reason) -> None:
        """End a run that cannot be sound."""
        self.status, self.fate, self.reason = Status.DIVERGED, Fate.NONE, reason
        self.goes_on = False

    def conclude(self) -> None:
        """Judge the run as a whole."""
        refused = self._guard.verdict()
        if refused and self.status == Status.OK:
            self.diverge(refused)
        self.reason += "".join(indicator.note() for indicator in self._indicators)
        past = self._farthest
        if self.status == Status.OK and past.angle > TOLD and self.fate != Fate.OVERLOADED:
            self.reason += (
                f"; V-joint {past.joint} was up to {math.degrees(past.angle):.3g} deg past its "
                f"stop, at {past.time:.6g} s (limits.overrun = {self._limits.overrun:g} deg)"
            )

    @property
    def _settling(self) -> float:
        """Time from the last lock to the end, s."""
        return self._solver.settling_time if self._locks is None or self._locks.stops else 0.0

    def _parts(self) -> dict[str, Remembering]:
        parts = self._steps, self._guard, self._rest, self._locks, self._deviations, self._shocks
        found = (one for one in (*parts, *self._indicators) if one is not None)
        return {type(one).__name__: one for one in found}

    def _take_tensions(self) -> None:
        """Let tensions choose steps, as from a start."""
        if self._scales.slack_tension is not None and self._indicators:
            bends = TensionBend(self._solver, self._scales.slack_tension)
            self._indicators = [self._indicators[0], bends]

    def _leave_tensions(self) -> None:
        """After the last lock what tensions do is in no result but the series."""
        if math.isfinite(self._settled_at):
            self._indicators = self._indicators[:1]

    def _contact(self, at: Instant) -> StopContact:
        return StopContact() if self._locks is None else self._locks.contact(at)

    def _watch(self) -> None:
        """End the run where the guard must."""
        refused = self._guard.judge(self.now)
        if refused:
            self.diverge(refused)

    def _note_stop(self, locks: Locks, before: Instant) -> None:
        """Let the run settle once all V-joints have reached the same stop, and latches hold; go on
        once they have left the stowed one.
        """
        fate = Fate.NONE if locks.unlatched else locks.reached
        if fate is self.fate:
            return
        self.fate = fate
        if fate is Fate.NONE:
            self.reason = Reason()
            self.unsettle()
            return
        where = "180 deg" if fate is Fate.DEPLOYED else "the stowed stop"
        self.reason = Reason(text=f"all V-joints have reached {where}")
        if math.isfinite(self._turn):
            return
        # Settling counts from the last lock within this step: what happens after it must not
        # depend on where steps end.
        time = self.now.time
        ends = [(one.time, one.angles, one.rates) for one in (before, self.now)]
        times = lock_times(*map(np.array, zip(*ends, strict=True)))
        last = float(np.fmax.reduce(times, axis=None))
        end = (last if math.isfinite(last) else time) + self._settling
        self._settled_at = end if end > time * (1.0 + _ROUND_OFF) else time
        self._leave_tensions()

    def _note_end(self, before: float) -> None:
        """End a run that has settled, or reached the end time or the step limit."""
        solver, time, locks = self._solver, self.now.time, self._locks
        end = f"solver.end_time = {solver.end_time:g} s"
        if time >= self._settled_at:
            self.goes_on = False
        elif time >= solver.end_time * (1.0 - _ROUND_OFF):
            if locks is None:
                roped = self._scales.slack_tension is not None
                words = "the cable was wound" if roped else "the run lasted"
                self._end(Fate.FINISHED, f"{words} until {end}")
            elif self.fate is Fate.NONE:
                fate = Fate.NOT_LATCHED if locks.unlatched else Fate.CUT_OFF
                self._end(fate, f"{end} was reached with {locks.missing()}")
            self.goes_on = False
        elif (
            locks is not None
            and math.isinf(self._settled_at)
            and math.isinf(self._turn)
            and self._rest.reached(self.now, locks.ahead)
        ):
            fate = Fate.PARTLY_DEPLOYED if locks.deployed.any() else Fate.STALLED
            fate = Fate.NOT_LATCHED if locks.unlatched else fate
            words = resting(locks.missing(), self._rest.window)
            # Where all rest on a stop that they reached, as before loads that turned round in vain.
            self._end(self.fate or fate, self.reason or words)
        elif self._count >= solver.step_limit:
            self._give_up(
                Cause.STEP_LIMIT,
                f"solver.step_limit = {solver.step_limit} steps took the run to {time:.6g} s only, "
                f"the last of {time - before:.1e} s: raise solver.tolerance or solver.step_limit",
            )

    def _note_overrun(self, locks: Locks) -> None:
        """End the run where a V-joint is so far past its stop that the model means nothing."""
        past = locks.overrun(self.now)
        self._farthest = max(self._farthest, past)
        if past.angle > self._limits.farthest:
            self._end(
                Fate.OVERLOADED,
                f"V-joint {past.joint} was driven {math.degrees(past.angle):.3g} deg past its stop "
                f"at {past.time:.6g} s, more than limits.overrun = {self._limits.overrun:g} deg, "
                f"with {locks.missing()}",
            )

    def _note_strain(self, locks: Locks, strain: float) -> None:
        """End the run where a rope is so long that none would hold."""
        time = self.now.time
        if strain > self._limits.rope_strain and self.goes_on:
            words = overstrained(strain, time, self._limits, locks.missing())
            self._end(Fate.OVERLOADED, words)

    def _end(self, fate: Fate, words: str) -> None:
        """End a run whose numbers hold."""
        self.fate, self.reason, self.goes_on = fate, Reason(text=words), False

    def _give_up(self, cause: Cause, words: str) -> None:
        """End a run early; one that has reached its goal only settles less."""
        self.goes_on = False
        if math.isfinite(self._settled_at):
            self.reason += f"; settling was stopped early at {self.now.time:.6g} s"
        else:
            self.status, self.reason = Status.SOLVER_FAILED, Reason(cause, words)


# Runs that go on from what another one remembers.


_UNFINISHED = (Fate.CUT_OFF, Fate.FINISHED, Fate.DEPLOYED, Fate.NOT_LATCHED)
"""What runs may go on from without a change: the end time, or the settling time, is later now, or
joints lean on latches that have not caught."""


def go_on(control: RunControl, solver: Solver, memory: Memory, changed: bool, where: str) -> None:
    """Let a control that has just begun go on from the memory of another one.

    ``changed`` is whether the scene is another one, ``where`` what the state is called.

    Raises
    ------
    InputError
        If nothing is left to be run.
    """
    control.recall(memory)
    if control.now.time >= solver.end_time:
        raise InputError(
            f"solver.end_time = {solver.end_time:g} s: must be after {control.now.time:g} s, the "
            f"time of {where}"
        )
    if changed and control.fate is Fate.FOLDED:
        control.unsettle()
    if control.settled:
        folded = control.fate is Fate.FOLDED
        words = "come to the stowed stop" if folded else "locked"
        cure = "change the loads (--set), " if folded else ""
        raise InputError(
            f"{where}: all V-joints had {words} and settled: {cure}start from an earlier state "
            "(--at), or raise solver.settling_time"
        )
    if control.goes_on:
        return
    if not changed and control.fate not in _UNFINISHED:
        raise InputError(
            f"{where}: the run ended there ({control.reason}), and the scene is unchanged: start "
            "from an earlier state (--at), or change the scene (--set)"
        )
    control.goes_on = True
    if control.fate not in (Fate.DEPLOYED, Fate.FOLDED):
        control.fate, control.reason = Fate.NONE, Reason()
