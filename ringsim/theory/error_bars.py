"""What a run may be wrong by, from a second run with steps twice as long.

The integrator is of second order, so that doubling the steps multiplies an error by four and the
two runs differ by three times the error of the finer one.  That holds on average; a single number
(the largest of a trembling quantity, the time of one event) may agree by chance.  The bars
therefore take the whole difference and more, and of times and angles the largest of all joints.

Coverage and sharpness over random scenes: benchmarks/error_bars.py, docs/accuracy.md.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.variables import Outcome, Status

Array = NDArray[np.float64]
SAFETY = 2.0
"""Bar over the difference of the two runs."""
_OF_ONE_ELEMENT = 0.02
"""Share of the peak stress that the rods' own inertia between two nodes makes uncertain."""


def error_bars(fine: Outcome, coarse: Outcome) -> dict[str, Array]:
    """Error bars of a run's main numbers.

    Parameters
    ----------
    fine
        The run that counts.
    coarse
        The same scene with steps twice as long.

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
    bars = {"opening_angle_error": np.nanmax(np.abs(_until(fine, coarse)))}
    if "lock_time" in one:
        bars["deployment_time_error"] = np.abs(one["lock_time"] - two["lock_time"]).max()
        bars["asynchrony_max_error"] = np.abs(one["asynchrony_max"] - two["asynchrony_max"])
    peaks = [name for name in ("peak_tension", "peak_rod_stress") if name in one]
    relative = [abs(float(two[name] / one[name]) - 1.0) for name in peaks if one[name] > 0.0]
    for name in peaks:
        bars[f"{name}_error"] = one[name] * max(relative, default=0.0)
    found = {name: np.asarray(SAFETY * value) for name, value in bars.items()}
    if "peak_rod_stress" in one:
        found["peak_rod_stress_error"] += _OF_ONE_ELEMENT * one["peak_rod_stress"]
    return found


def _until(fine: Outcome, coarse: Outcome) -> Array:
    """Differences of all opening angles up to the end of the motion, deg."""
    times = fine.coordinates["time"]
    ends = [float(o.values.get("deployment_time", np.nan)) for o in (fine, coarse)]
    last = [float(o.values["final_time"]) for o in (fine, coarse)]
    until = times <= np.nanmin([*ends, *last])
    angles = [o.values["opening_angle"][..., until] for o in (fine, coarse)]
    return np.asarray(angles[0] - angles[1])
