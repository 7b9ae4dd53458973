"""Runs that start anew with smaller steps, and the second run that error bars need."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ringsim.parts.solver import Solver
from ringsim.stepping.instant import Array
from ringsim.variables import COUNTS, TIMINGS, Cause, Outcome, Status

Solve = Callable[[Solver], Outcome]
"""Runs a scene with these settings; it never raises."""
ErrorBars = Callable[..., dict[str, Array]]
"""As ``ringsim.outputs.error_bars.error_bars``."""


def run_with_restarts(solve: Solve, solver: Solver, error_bars: ErrorBars) -> Outcome:
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
        reason = f"{outcome.reason} ({how}; start 1: {first.reason})"
        outcome = replace(outcome, reason=reason, cause=cause)
    if solver.error_bars and outcome.reached_goal:
        outcome = _with_bars(outcome, solve, used, error_bars)
    tolerance = used.tolerance if used.step_control == "motion" else np.nan
    values = {"restarts": restarts, "step_used": used.step, "tolerance_used": tolerance}
    values |= {f"total_{name}": totals[name] for name in COUNTS}
    outcome.values.update({name: np.array(value) for name, value in values.items()})
    return outcome


def _with_bars(outcome: Outcome, solve: Solve, used: Solver, error_bars: ErrorBars) -> Outcome:
    """The outcome of a run at these settings with its error bars, or why it has none."""
    reasons = []
    # See ``ringsim.outputs.error_bars`` for the factors of the differences.
    for words, factor, scale in (("twice as long", 2.0, 1.0), ("half as long", 0.5, 4.0)):
        found = solve(used.scaled(factor))
        # Times count from the beginning: those of the last run hold for all.
        outcome.values.update({n: found.values[n] for n in TIMINGS if n in found.values})
        bars = error_bars(outcome, found, tolerance=used.tolerance, scale=scale)
        if bars:
            outcome.values.update(bars)
            return outcome
        reasons.append(f"with steps {words} it ended as {found.status.word}: {found.reason}")
    return replace(outcome, reason=f"{outcome.reason}; no error bars, since {'; '.join(reasons)}")


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
