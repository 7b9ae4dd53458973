"""Numerical error of a run, estimated from a second run with steps twice as long.

The integrator is of second order, so that doubling the steps multiplies an error by four and the
two runs differ by three times the error of the finer one.  That holds on average; a single number
(the largest of an oscillating quantity, the time of one event) may agree by chance.  The bars
therefore take about the whole difference, and of times and angles the largest of all joints.
The asynchrony as a function of time oscillates with the ring's own vibrations, which long steps do
not resolve: its bar at any time follows from the largest difference up to then; an asynchrony
below its bar is not significant.  The error of few elements, independent of the steps, is added:
the rods' own inertia between two nodes, as a share that falls with the square of their number.
So is the part of a peak tension that may lie between two readings, as the step control allows it.

Where the run with longer steps does not end as ok, one with steps of half the length takes
its place; it differs by three quarters of the error, so that its differences count four times.

Each output states its factors (``ErrorBar``), the smallest that cover about 9 of 10 errors over
random scenes: benchmarks/error_bars.py, docs/accuracy.md.
"""

from __future__ import annotations

import numpy as np

from ringsim.outputs.family import VARIABLES, Array, ErrorBar
from ringsim.variables import Outcome, Status


def error_bars(
    run: Outcome, other: Outcome, elements: int, tolerance: float, scale: float = 1.0
) -> dict[str, Array]:
    """Error bars of the main results of a run.

    Parameters
    ----------
    run
        The run that counts.
    other
        The same scene with steps twice as long, or of half the length.
    elements
        Elements per rod half.
    tolerance
        ``solver.tolerance`` of the run that counts.
    scale
        Factor on the differences: 1 for longer steps, 4 for shorter ones.

    Returns
    -------
    dict
        ``NAME_error`` in the unit of NAME, of a function of time alone at every output time;
        empty if one of the runs did not reach its goal.
    """
    if run.status != Status.OK or other.status != Status.OK:
        return {}
    apart = differences(run, other)
    values = {name: largest(name, run.values[name]) for name in apart}
    return {
        f"{name}_error": bar(name, scale * apart[name], values[name], elements, tolerance)
        for name in apart
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
    if VARIABLES[name].dims == ("time",):
        return np.asarray(np.fmax.accumulate(values))
    return np.asarray(np.fmax.reduce(values, axis=None))


def bar(
    name: str, apart: Array | float, value: Array | float, elements: int, tolerance: float
) -> Array:
    """Error bar of a result from the difference of two runs, in its unit."""
    rule = rules()[name]
    share = rule.of_one_element / elements**2 + rule.between_readings * tolerance
    return np.asarray(rule.safety * apart + share * value)
