"""What a run may be wrong by, from a second run with steps twice as long.

The integrator is of second order, so that doubling the steps multiplies an error by four and the
two runs differ by three times the error of the finer one.  That holds on average; a single number
(the largest of a trembling quantity, the time of one event) may agree by chance.  The bars
therefore take the whole difference or twice that, and of times and angles the largest of all
joints.  What few elements leave out does not depend on the steps and is added: the rods' own
inertia between two nodes, as a share that falls with the square of their number.

The factors are those that cover 9 errors of 10 over random scenes and are not much larger:
benchmarks/error_bars.py, docs/accuracy.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.variables import Outcome, Status

Array = NDArray[np.float64]
SAFETY = {
    "deployment_time": 1.0,
    "opening_angle": 2.0,
    "asynchrony_max": 1.0,
    "peak_tension": 0.5,
    "peak_rod_stress": 1.0,
}
"""Bar over the difference of the two runs."""
OF_ONE_ELEMENT = {"asynchrony_max": 0.01, "peak_rod_stress": 0.02}
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
    one, two = fine.values, coarse.values
    apart = {"opening_angle": np.nanmax(np.abs(_until(fine, coarse)))}
    if "lock_time" in one:
        apart["deployment_time"] = np.abs(one["lock_time"] - two["lock_time"]).max()
    for name in ("asynchrony_max", "peak_tension", "peak_rod_stress"):
        if name in one:
            apart[name] = np.abs(one[name] - two[name])
    bars = {name: SAFETY[name] * difference for name, difference in apart.items()}
    for name, share in OF_ONE_ELEMENT.items():
        if name in bars:
            bars[name] = bars[name] + share / elements**2 * one[name]
    return {f"{name}_error": np.asarray(bar) for name, bar in bars.items()}


def _until(fine: Outcome, coarse: Outcome) -> Array:
    """Differences of all opening angles up to the end of the motion, deg."""
    times = fine.coordinates["time"]
    ends = [float(o.values.get("deployment_time", np.nan)) for o in (fine, coarse)]
    last = [float(o.values["final_time"]) for o in (fine, coarse)]
    until = times <= np.nanmin([*ends, *last])
    angles = [o.values["opening_angle"][..., until] for o in (fine, coarse)]
    return np.asarray(angles[0] - angles[1])
