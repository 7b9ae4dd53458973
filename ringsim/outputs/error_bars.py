"""Numerical error of a run, estimated from a second run with steps twice or half as long.

The integrator is of second order: runs with steps twice as long are apart by (4 - 1) of the error,
with steps half as long by (1 - 1/4) of it, so that this difference counts four times.  Each output
states the factors of its bar (``ErrorBar``); docs/accuracy.md tells what they cover.
"""

import numpy as np

from ringsim.outputs.family import VARIABLES, Array, ErrorBar
from ringsim.variables import Outcome


def error_bars(
    run: Outcome, other: Outcome, elements: int, tolerance: float, scale: float = 1.0
) -> dict[str, Array]:
    """Error bars of the main results of a run.

    Parameters
    ----------
    run, other
        The run that counts, and the same scene with other steps.
    elements, tolerance
        Elements per rod half and ``solver.tolerance`` of the run that counts.
    scale
        Factor on the differences: 1 if the other run has longer steps, 4 for shorter ones.

    Returns
    -------
    dict
        ``NAME_error`` in the unit of NAME, of a function of time alone at every output time;
        empty if one of the runs did not reach its goal.
    """
    if not (run.reached_goal and other.reached_goal):
        return {}
    return {
        f"{name}_error": bar(
            name, scale * apart, largest(name, run.values[name]), elements, tolerance
        )
        for name, apart in differences(run, other).items()
    }


def rules() -> dict[str, ErrorBar]:
    """How the error bars of all variables that have one are made."""
    return {name: v.error_bar for name, v in VARIABLES.items() if v.error_bar is not None}


def differences(one: Outcome, other: Outcome) -> dict[str, Array]:
    """Differences of two runs of a scene in what has an error bar, as far as both have it.

    The largest difference of all joints and output times; of a function of time alone the largest
    up to each output time, shape (time,).
    """
    apart: dict[str, Array] = {}
    for name, rule in rules().items():
        judged = rule.judged_by or name
        if judged in one.values:
            first, second = one.values[judged], other.values[judged]
            found = largest(name, np.abs(first - second))
            apart[name] = np.where(np.isfinite(first), found, np.nan) if found.ndim else found
    return apart


def largest(name: str, values: Array) -> Array:
    """Value of a result, or the largest of its series; of one over time up to each time."""
    over_time = VARIABLES[name].dims == ("time",)
    return np.asarray(np.fmax.accumulate(values) if over_time else np.fmax.reduce(values, None))


def bar(
    name: str, apart: Array | float, value: Array | float, elements: int, tolerance: float
) -> Array:
    """Error bar of a result from the difference of two runs, in its unit."""
    rule = rules()[name]
    share = rule.of_one_element / elements**2 + rule.between_readings * tolerance
    return np.asarray(rule.safety * apart + share * value)
