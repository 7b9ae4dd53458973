"""How a run ends: at rest, or started again with other settings."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ringsim.parts.solver import Solver
from ringsim.stepping.instant import Array, Instant, Remembering
from ringsim.variables import COUNTS, Cause, Outcome, Status

# Whether a structure has come to rest for good.


MOVED = 0.01
"""Angle that a V-joint at rest may still move by within a window, rad: V-joints that a stopped
winch leaves to their friction creep, in a ring of 6 still by 0.14 deg/s 18 s later."""
WINDOW = 0.1
"""Time over which it is watched, over ``solver.end_time``: what creeps at that rate moves by less
than 10 times ``MOVED``, 6 deg, in all the time that there is."""
_MARGIN = 2.0
"""On how far a V-joint creeps: it may have slowed down near a dead point and speed up again."""
GROWTH = 1.1
"""How much more kinetic energy creep may have in the later half of a window than in the first: a
ring that dry friction holds creeps by its smooth part, faster by a few per cent in a window as its
drive grows with the angle.  What loads set in motion from rest has four times as much."""
_STILL = 1e-12
"""Kinetic energy that is round-off, over the structure's reference energy."""


def resting(missing: str, window: float) -> str:
    """Why a run ends at rest, by who has locked and the window (s) that was watched."""
    return (
        f"came to rest with {missing}: no winch moves the ring, and every V-joint has kept within "
        f"{math.degrees(MOVED):.2g} deg for {window:.3g} s"
    )


class Rest(Remembering):
    """Watches whether anything moves or will move.

    A structure is at rest once no V-joint has moved by more than ``MOVED`` within a window in which
    no winch has turned, and none will and no fault is to come (``Instant.driven``), and in which
    its kinetic energy has hardly grown: one that its loads set in motion has hardly moved either.
    Nor may a V-joint reach its stop in the time that is left if it goes on as it creeps.
    """

    changing = ("_since", "_angles", "_largest")

    def __init__(self, start: Instant, end_time: float, energy: float) -> None:
        """Begin to watch at this instant a run that ends at ``end_time`` (s), of a structure with a
        reference energy (J).
        """
        self._end, self.window, self._still = end_time, WINDOW * end_time, _STILL * energy
        self.begin(start)

    def reached(self, now: Instant, ahead: Callable[[Array, Array], Array]) -> bool:
        """Whether the structure is at rest by now; to be asked after every step.

        ``ahead`` tells how far (rad) each V-joint is from the stop that it moves to, infinite if
        from none, by its opening angle and by how far it has moved, rad.
        """
        if now.driven or np.abs(now.angles - self._angles).max() > MOVED:
            self.begin(now)
        late = now.time - self._since > 0.5 * self.window
        self._largest[late] = max(self._largest[late], now.energies.kinetic)
        if now.time - self._since < self.window:
            return False
        moved: Array = now.angles - self._angles
        creeping = np.abs(moved) / (now.time - self._since) * (self._end - now.time)
        arrives = np.any(_MARGIN * creeping >= ahead(now.angles, moved))
        if not arrives and self._largest[True] <= max(GROWTH * self._largest[False], self._still):
            return True
        self.begin(now)
        return False

    def begin(self, now: Instant) -> None:
        """Open a window: where it starts, and the largest energy in its halves."""
        self._since, self._angles = now.time, now.angles
        self._largest = {False: 0.0, True: 0.0}


# Runs that start anew with smaller steps.


Solve = Callable[[Solver], Outcome]
"""Runs a scene with these settings; it never raises."""
WithBars = Callable[[Outcome, Solver], Outcome]
"""Gives a run with these settings its error bars; see ``ringsim.outputs.balance``."""


def run_with_restarts(solve: Solve, solver: Solver, with_bars: WithBars) -> Outcome:
    """A run that starts anew with smaller steps while that may help, at most ``solver.restarts``
    times, and has error bars where ``solver.error_bars`` asks for them.

    The outcome is that of the last start, whose settings are ``step_used`` and ``tolerance_used``
    (NaN where steps are constant); ``total_steps``, ... count those of all attempts.
    """
    used, outcome, restarts = solver, solve(solver), 0
    first, totals = outcome, _counts(outcome)
    while restarts < solver.restarts and _curable(outcome, solver):
        restarts += 1
        used = solver.refined(restarts)
        outcome = solve(used)
        totals.update(_counts(outcome))
        how = f"start {restarts + 1} with solver.step = {used.step:.3g} s"
        if used.step_control != "constant":
            how += f" and solver.tolerance = {used.tolerance:.2g}"
        # A start that only ran out of its smaller steps does not say what is wrong.
        cause = first.cause if outcome.cause is Cause.STEP_LIMIT else outcome.cause
        # What else the first start says is of an antenna that its errors have moved.
        why = first.reason.partition("; ")[0]
        reason = f"{outcome.reason} ({how}; start 1: {why})"
        outcome = replace(outcome, reason=reason, cause=cause)
    if solver.error_bars and not outcome.status.failed:
        outcome = with_bars(outcome, used)
    tolerance = used.tolerance if used.step_control == "motion" else np.nan
    values = {"restarts": restarts, "step_used": used.step, "tolerance_used": tolerance}
    values |= {f"total_{name}": totals[name] for name in COUNTS}
    outcome.values.update({name: np.array(value) for name, value in values.items()})
    return outcome


def _counts(outcome: Outcome) -> Counter[str]:
    """Zero where a start ended too early to tell."""
    return Counter({name: int(outcome.values.get(name, 0)) for name in COUNTS})


def _curable(outcome: Outcome, solver: Solver) -> bool:
    """Whether smaller steps may help: not where there were too many of them already, or the first
    one had begun from a wrong state.
    """
    failed = outcome.status in (Status.SOLVER_FAILED, Status.DIVERGED)
    failed &= outcome.cause is not Cause.STRAINED
    return failed and _counts(outcome)["steps"] < solver.step_limit
