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

The factors are the smallest that cover about 9 of 10 errors over random scenes:
benchmarks/error_bars.py, docs/accuracy.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.solver import TENSION_BEND
from ringsim.variables import Outcome, Status

Array = NDArray[np.float64]
SAFETY = {
    "deployment_time": 1.0,
    "opening_angle": 1.3,
    "asynchrony": 10.0,
    "asynchrony_max": 2.0,
    "peak_tension": 1.2,
    "peak_rod_stress": 1.1,
}
"""Bar over the difference of the two runs."""
BETWEEN_READINGS = {"peak_tension": 2.0 * TENSION_BEND / 8.0}
"""Share of a value over ``solver.tolerance``: an eighth of the largest bend that is accepted
(``ringsim.stepping.repeats``), which both runs may miss alike."""
OF_ONE_ELEMENT = {
    "asynchrony": 0.014,
    "asynchrony_max": 0.014,
    "peak_tension": 0.001,
    "peak_rod_stress": 0.03,
}
"""Share of a value that one element per rod half makes uncertain."""


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
        ``deployment_time_error`` (s), ``opening_angle_error`` and ``asynchrony_max_error`` (deg),
        ``asynchrony_error`` (deg, shape (time,)) and, where the run has them,
        ``peak_tension_error`` (N) and ``peak_rod_stress_error`` (Pa); empty if one of the runs did
        not reach its goal.
    """
    if run.status != Status.OK or other.status != Status.OK:
        return {}
    return {
        f"{name}_error": bar(name, scale * apart, largest(run, name), elements, tolerance)
        for name, apart in differences(run, other).items()
    }


def differences(one: Outcome, other: Outcome) -> dict[str, Array]:
    """Differences of the main results of two runs of a scene, as far as both have them.

    Of times and angles it is the largest of all joints, of angles also of all output times; of the
    asynchrony the largest up to each output time, shape (time,).
    """
    first, second = one.values, other.values
    angles = np.abs(first["opening_angle"] - second["opening_angle"])
    apart: dict[str, Array] = {"opening_angle": np.nanmax(angles)}
    if "lock_time" in first:
        apart["deployment_time"] = np.abs(first["lock_time"] - second["lock_time"]).max()
    if "asynchrony" in first:
        between = np.abs(first["asynchrony"] - second["asynchrony"])
        apart["asynchrony"] = np.where(
            np.isfinite(first["asynchrony"]), np.fmax.accumulate(between), np.nan
        )
    for name in ("asynchrony_max", "peak_tension", "peak_rod_stress"):
        if name in first:
            apart[name] = np.abs(first[name] - second[name])
    return apart


def largest(outcome: Outcome, name: str) -> Array:
    """Value of a result, or the largest of its series; of the asynchrony up to each time."""
    if name == "asynchrony":
        return np.asarray(np.fmax.accumulate(outcome.values[name]))
    return np.asarray(np.fmax.reduce(outcome.values[name], axis=None))


def bar(
    name: str, apart: Array | float, value: Array | float, elements: int, tolerance: float
) -> Array:
    """Error bar of a result from the difference of two runs, in its unit."""
    share = OF_ONE_ELEMENT.get(name, 0.0) / elements**2
    share += BETWEEN_READINGS.get(name, 0.0) * tolerance
    return np.asarray(SAFETY[name] * apart + share * value)
