"""The one place that decides on a run's steps: the next, the repeated, the last.

An engine calls ``next_step``; ``retry`` where Newton fails or ``shorter`` refuses what it has
found; ``accept``, while that is true; and ``conclude``.
"""

from __future__ import annotations

import math

import numpy as np

from ringsim.parts.solver import NO_DEVIATIONS, Solver
from ringsim.stepping.constant_steps import ConstantSteps
from ringsim.stepping.guard import Guard
from ringsim.stepping.instant import Instant, Scales
from ringsim.stepping.locks import Locks, StopContact, lock_times
from ringsim.stepping.motion_steps import DeviationSteps, MotionSteps
from ringsim.stepping.repeats import EnergyImbalance, Indicator, TensionBend
from ringsim.variables import Cause, Reason, Status

_ROUND_OFF = 1e-12
"""Relative difference of two times that are the same."""


class RunControl:
    """Steps, care and guard of one run.

    ``now`` is the last accepted state, ``goes_on`` whether there is a step from there, ``status``
    and ``reason`` how the run has ended, ``repeats`` how many steps were repeated.
    """

    def __init__(
        self,
        solver: Solver,
        scales: Scales,
        start: Instant,
        locks: Locks | None = None,
        *,
        follow_deviations: bool = False,
    ) -> None:
        """Begin a run, which ends when the V-joints of ``locks`` have all reached the same stop,
        without them at ``solver.end_time``; with ``follow_deviations`` steps resolve how the joints
        deviate from their mean angle.
        """
        self.now, self._solver, self._locks = start, solver, locks
        self._roped = scales.slack_tension is not None
        self._steps: MotionSteps | ConstantSteps = ConstantSteps(solver.step, locks is None)
        self._indicators: list[Indicator] = []
        self._deviations: DeviationSteps | None = None
        if solver.step_control == "motion":
            self._steps = MotionSteps(solver, scales)
            self._indicators.append(EnergyImbalance(solver, scales))
            if scales.slack_tension is not None:
                self._indicators.append(TensionBend(solver, scales.slack_tension))
            if follow_deviations and solver.deviation_tolerance < NO_DEVIATIONS:
                duration = scales.travel / scales.rate
                self._deviations = DeviationSteps(solver.deviation_tolerance, duration)
        self._guard = Guard(solver, scales)
        self._shorter: float | None = None
        self._count, self.repeats, self._settled_at = 0, 0, math.inf
        self.status, self.reason, self.goes_on = Status.UNFINISHED, Reason(), True
        self._watch()

    def next_step(self, next_event: float = math.inf) -> float:
        """The next step, s; it must not pass the time ``next_event`` (s), as of a fault."""
        self._steps.step = min([self._steps.step, *(one.limit for one in self._indicators)])
        end = min(self._solver.end_time, next_event, self._settled_at)
        return self._steps.towards(end - self.now.time)

    def retry(self, shorter: float) -> float:
        """The step to repeat the last one with, s: what ``shorter`` has asked for, or else this."""
        self.repeats += 1
        self._steps.step = shorter if self._shorter is None else self._shorter
        self._shorter = None
        return self._steps.step

    def shorter(self, found: Instant) -> float | None:
        """A smaller step in s to repeat the one to ``found`` with; None if it is good enough.

        To be asked once for each step that has converged.
        """
        wanted = [one.shorter(self.now, found) for one in self._indicators]
        self._shorter = min((one for one in wanted if one is not None), default=None)
        if self._shorter is None and isinstance(self._steps, MotionSteps):
            step = found.time - self.now.time
            self._shorter = self._steps.shorter_first(step, self._contact(found))
        return self._shorter

    def accept(self, found: Instant, struck: Instant | None = None) -> bool:
        """Go on from where the step has led; returns whether there is a next step.

        ``struck`` is the same instant after faults have struck, if any have: the next step starts
        there.
        """
        for indicator in self._indicators:
            indicator.accept(self.now, found)
        before, self.now = self.now, struck or found
        self._count += 1
        self._watch()
        if self.goes_on and self._locks is not None:
            self._locks.note(self.now.angles)
            if math.isinf(self._settled_at):
                self._note_lock(self._locks, before)
        if self.goes_on:
            self._note_end(before.time)
        if self.goes_on:
            self._steps.advance(self.now, self._contact(self.now))
            locked = self._locks is not None and self._locks.deployed.any()
            if self._deviations is not None and not locked:
                self._steps.step = min(self._steps.step, self._deviations.limit(self.now))
        return self.goes_on

    def fail(self, cause: str) -> None:
        """End a run whose solver gave up, for this cause."""
        self._give_up(
            Cause.NEWTON,
            f"the solver gave up at {self.now.time:.6g} s after {self.repeats} reductions of the "
            "step: reduce solver.step or solver.tolerance, or raise solver.newton_tolerance "
            f"({cause})",
        )

    def diverge(self, reason: Reason) -> None:
        """End a run that cannot be sound."""
        self.status, self.reason, self.goes_on = Status.DIVERGED, reason, False

    def conclude(self) -> None:
        """Judge the run as a whole."""
        refused = self._guard.verdict()
        if refused and self.status in (Status.OK, Status.UNFINISHED):
            self.diverge(refused)
        self.reason += "".join(indicator.note() for indicator in self._indicators)

    def _contact(self, at: Instant) -> StopContact:
        return StopContact() if self._locks is None else self._locks.contact(at)

    def _watch(self) -> None:
        """End the run where the guard must."""
        overrun = 0.0 if self._locks is None else self._locks.overrun(self.now.angles)
        refused = self._guard.judge(self.now, overrun)
        if refused:
            self.diverge(refused)

    def _note_lock(self, locks: Locks, before: Instant) -> None:
        """Let the run settle once all V-joints have reached the same stop."""
        if not (locks.deployed.all() or locks.stowed.all()):
            return
        where = "180 deg" if locks.deployed.all() else "the stowed stop"
        reason = Reason(Cause.NONE, f"all V-joints have reached {where}")
        self.status, self.reason = Status.OK, reason
        # Settling counts from the last lock within this step: what happens after it must not
        # depend on where steps end.
        time, settling = self.now.time, self._solver.settling_time if locks.stops else 0.0
        ends = [(one.time, one.angles, one.rates) for one in (before, self.now)]
        times = lock_times(*map(np.array, zip(*ends, strict=True)))
        last = float(np.fmax.reduce(times, axis=None))
        end = (last if math.isfinite(last) else time) + settling
        self._settled_at = end if end > time * (1.0 + _ROUND_OFF) else time
        # What tensions do from here on is in no result but the series.
        self._indicators = self._indicators[:1]

    def _note_end(self, before: float) -> None:
        """End a run that has settled, or reached the end time or the step limit."""
        solver, time, locks = self._solver, self.now.time, self._locks
        if time >= self._settled_at:
            self.goes_on = False
        elif time >= solver.end_time * (1.0 - _ROUND_OFF):
            self.goes_on = False
            if locks is None:
                self.status = Status.OK
                words = "the cable was wound" if self._roped else "the run lasted"
                words += f" until solver.end_time = {solver.end_time:g} s"
                self.reason = Reason(Cause.NONE, words)
            elif self.status == Status.UNFINISHED:
                self.reason = Reason(
                    Cause.END_TIME,
                    f"solver.end_time = {solver.end_time:g} s was reached with "
                    f"{int(locks.deployed.sum())} of {locks.deployed.size} V-joints locked",
                )
        elif self._count >= solver.step_limit:
            self._give_up(
                Cause.STEP_LIMIT,
                f"solver.step_limit = {solver.step_limit} steps took the run to {time:.6g} s only, "
                f"the last of {time - before:.1e} s: raise solver.tolerance or solver.step_limit",
            )

    def _give_up(self, cause: Cause, words: str) -> None:
        """End a run early; one that has reached its goal only settles less."""
        self.goes_on = False
        if math.isfinite(self._settled_at):
            self.reason += f"; settling was cut short at {self.now.time:.6g} s"
        else:
            self.status, self.reason = Status.SOLVER_FAILED, Reason(cause, words)
