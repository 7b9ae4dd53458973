"""Choosing the next step from the motion so far."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from ringsim.parts.solver import Solver

GROWTH = 1.5
"""Largest ratio of two successive steps."""
_LOCAL_ERROR = 0.1
"""Local error constant C of the integrator, error = C h^3 d3(angle)/dt3."""
_FINEST = 400.0
"""The motion alone asks for no step below ``step`` over this."""
_FILTERED = 1e-4
"""Below this tolerance the readings that the step follows stay as far apart as at it."""
_DEPTH = math.radians(0.05)
"""Angle by which a V-joint may pass its stop within one step, at the tolerance 1e-4."""
_FIRST = 20.0
"""The first step is ``step`` over this at most."""
_SHORTEST = 1e-7
"""Shortest first step, s."""
_PART = 0.02
"""Largest first step over the time to the first stop."""
_RETRY = 0.2
"""Ratio of the next attempt at the first step to one that was too long."""
_BRIEFEST = 1e-4
"""No first step is repeated below this share of ``step``."""


class StopContact(NamedTuple):
    """V-joints at their stops: what is coming and what is there.

    Attributes
    ----------
    time_to_next, rate_of_next
        Time until the first free V-joint meets a stop at its present rate, and that rate; s
        (infinite if none will) and rad/s.
    resting_rate
        Largest rate of a V-joint that has locked and is near its stop, rad/s; 0 if none is.
    """

    time_to_next: float
    rate_of_next: float
    resting_rate: float


class StepControl:
    """Steps that keep the relative error in time of the mean opening angle near a tolerance.

    A local error C h^3 |a'''| in the angle a shifts the motion by C h^3 |a'''| / |a'| in time;
    spread evenly over the run that gives h = sqrt(tolerance |a'| / (C |a'''|)).  The third
    derivative comes from divided differences of three rates, far enough apart not to see the rods
    vibrate; a rate below ``usual_rate``, the mean rate to be expected of the run, counts as that
    much, or the tremor of a ring that hardly moves yet would ask for tiny steps.  The ratio
    |a'''| / |a'| fades over its own time scale, so that a passage of a''' through zero does
    not open the step.  Towards the end of the travel the step shrinks so that a V-joint meets its
    stop with a small one, the smaller the faster it comes, and so it stays until it rests.
    """

    def __init__(
        self, solver: Solver, contact_step: float, usual_rate: float, first_step: float = math.inf
    ) -> None:
        """Start at rest.

        Parameters
        ----------
        solver
            The scene's settings.
        contact_step
            Step that resolves a V-joint's bounce at the tolerance 1e-4, s.
        usual_rate
            Mean opening rate to be expected of the run, rad/s.
        first_step
            Step that resolves how ropes swing as a winch starts, s.
        """
        self._solver = solver
        self._contact = min(contact_step * math.sqrt(solver.tolerance / 1e-4), solver.step)
        self._least = solver.step / _FINEST
        self._usual = usual_rate
        self._bend = 0.0
        self._past: deque[tuple[float, float]] = deque()
        self._stride = max(1.0, math.sqrt(_FILTERED / solver.tolerance))
        self.step = solver.step
        if solver.step_control != "constant":
            self.step = max(min(solver.step / _FIRST, first_step), _SHORTEST)

    def advance(self, time: float, rate: float, stops: StopContact) -> float:
        """The next step in s.

        Parameters
        ----------
        time, rate
            End of the step just taken and the mean opening rate there, s and rad/s.
        stops
            Which V-joints are about to meet a stop or rest on one, and how fast they move.

        """
        self._past.append((time, rate))
        if self._solver.step_control == "constant":
            return self.step
        wanted = max(self._from_motion(), self._least)
        if stops.resting_rate > 0.0:
            wanted = max(min(wanted, self._gentle(stops.resting_rate)), self._contact)
        if math.isfinite(stops.time_to_next):
            meeting = max(self._gentle(stops.rate_of_next), self._contact)
            wanted = min(wanted, max(0.5 * stops.time_to_next, meeting))
        self.step = min(wanted, GROWTH * self.step, self._solver.step)
        return self.step

    def towards(self, left: float) -> float:
        """The next step in s if only so much time is left to an event.

        A step that follows the motion shares the rest with the one after it: behind a long step a
        tiny one would read velocities that are still the long one's.
        """
        if self._solver.step_control == "constant" or left <= self.step or left >= 2.0 * self.step:
            return min(self.step, left)
        return 0.5 * left

    def shorter_first(self, step: float, stops: StopContact) -> float | None:
        """A smaller first step in s, or None if this one is good enough or not the first.

        It is chosen without knowing the motion; a winch may take a ring that is nearly open to its
        stops within it.

        Parameters
        ----------
        step
            What was tried, s.
        stops
            Where that has led.
        """
        if self._past or step <= _BRIEFEST * self._solver.step:
            return None
        return _RETRY * step if step > _PART * (step + stops.time_to_next) else None

    def _gentle(self, rate: float) -> float:
        """Step in which a V-joint at this rate goes no deeper than allowed into its stop."""
        return _DEPTH * math.sqrt(self._solver.tolerance / 1e-4) / rate

    def _from_motion(self) -> float:
        t2, r2 = self._past[-1]
        apart = (self._stride - 0.5) * self.step
        middle = self._before(t2 - apart)
        if middle is None:
            return self.step
        t1, r1 = middle
        first = self._before(t1 - apart)
        if first is None:
            return self.step
        t0, r0 = first
        while self._past[0][0] < t0:
            self._past.popleft()
        early, late = (r1 - r0) / (t1 - t0), (r2 - r1) / (t2 - t1)
        third = abs(2.0 * (late - early) / (t2 - t0))
        bend = third / max(abs(r2), self._usual)
        fading = max(0.0, 1.0 - (t2 - t1) * math.sqrt(self._bend))
        self._bend = max(bend, fading * self._bend)
        if self._bend == 0.0:
            return self._solver.step
        return math.sqrt(self._solver.tolerance / _LOCAL_ERROR / self._bend)

    def _before(self, time: float) -> tuple[float, float] | None:
        """The latest reading not after ``time``."""
        return next((past for past in reversed(self._past) if past[0] <= time), None)
