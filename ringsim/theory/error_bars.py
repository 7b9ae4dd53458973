"""What a run may be wrong by, from a second run with steps twice as long.

The integrator is of second order, so that doubling the steps multiplies an error by four and the
two runs differ by three times the error of the finer one.  That holds on average; a single number
(the largest of a trembling quantity, the time of one event) may agree by chance.  The bars
therefore take about the whole difference, and of times and angles the largest of all joints.
What few elements leave out does not depend on the steps and is added: the rods' own inertia
between two nodes, as a share that falls with the square of their number.

The factors are those that cover 9 errors of 10 over random scenes and are not much larger:
benchmarks/error_bars.py, docs/accuracy.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.variables import Outcome, Status

Array = NDArray[np.float64]
SAFETY = {
    "deployment_time": 0.6,
    "opening_angle": 1.3,
    "asynchrony_max": 1.5,
    "peak_tension": 0.9,
    "peak_rod_stress": 0.5,
}
"""Bar over the difference of the two runs."""
OF_ONE_ELEMENT = {"asynchrony_max": 0.014, "peak_tension": 0.001, "peak_rod_stress": 0.03}
"""Share of a value that one element per rod half makes uncertain."""


def error_bars(fine: Outcome, coarse: Outcome, elements: int) -> dict[str, Array]:
    """Error bars of a run's main numbers.

    Parameters
    ----------
    fine
        The run that counts.
    coarse
        The same scene with steps twice as long.
    elements
        Elements per rod half.

    Returns
    -------
    dict
        ``deployment_time_error`` (s), ``opening_angle_error`` and ``asynchrony_max_error`` (deg)
        and, where the run has them, ``peak_tension_error`` (N) and ``peak_rod_stress_error`` (Pa);
        empty if one of the runs did not reach its goal.
    """
    if fine.status != Status.OK or coarse.status != Status.OK:
        return {}
    return {
        f"{name}_error": np.asarray(bar(name, apart, largest(fine, name), elements))
        for name, apart in differences(fine, coarse).items()
    }


def differences(one: Outcome, other: Outcome) -> dict[str, float]:
    """How far two runs of a scene are apart in their main numbers, as far as they have them.

    Of times and angles it is the largest of all joints, of angles also of all output times.
    """
    first, second = one.values, other.values
    angles = np.abs(first["opening_angle"] - second["opening_angle"])
    apart = {"opening_angle": float(np.nanmax(angles))}
    if "lock_time" in first:
        apart["deployment_time"] = float(np.abs(first["lock_time"] - second["lock_time"]).max())
    for name in ("asynchrony_max", "peak_tension", "peak_rod_stress"):
        if name in first:
            apart[name] = float(np.abs(first[name] - second[name]))
    return apart


def largest(outcome: Outcome, name: str) -> float:
    """Value of a run's number, or the largest of its series; NaN where it has none."""
    return float(np.fmax.reduce(outcome.values[name], axis=None))


def bar(name: str, apart: float, value: float, elements: int) -> float:
    """Error bar of one number from the difference of two runs, in its unit."""
    of_elements = OF_ONE_ELEMENT[name] / elements**2 * value if name in OF_ONE_ELEMENT else 0.0
    return SAFETY[name] * apart + of_elements
