"""How far the V-joints are apart."""

import math

import numpy as np

from ringsim.outputs.family import Array, ErrorBar, Output, Run, Series, Values, Variable

_POINTS = 8
"""Points in each step at which the largest spread is looked for: a parabola rises above the largest
of so many by at most a 64th of what it rises above the chord of the step."""


class Asynchrony(Output):
    """Largest difference of opening angles between V-joints over time, and its maximum."""

    rank = 20
    variables = (
        Variable(
            "asynchrony", ("time",), "degree",
            "largest difference of opening angles between V-joints",
            error_bar=ErrorBar("asynchrony", safety=10.0, of_one_element=0.014),
        ),
        Variable(
            "asynchrony_max", (), "degree", "largest asynchrony up to the deployment time",
            error_bar=ErrorBar("largest asynchrony", safety=2.0, of_one_element=0.014),
            summary=("largest asynchrony", "10.4f"),
        ),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """Differences on the output grid; the maximum is looked for between readings, too."""
        if not run.scene.structure.locks:
            return {}
        joints = run.locks.size
        opening = np.degrees(run.angles.on_grid(run.rates.values)).reshape(joints, -1)
        apart = opening.max(axis=0) - opening.min(axis=0)
        angles, rates = (each.values.reshape(-1, joints) for each in (run.angles, run.rates))
        largest = math.degrees(largest_spread(run.angles.times, angles, rates, run.until))
        on_time = apart[run.angles.grid <= run.until]
        return {"asynchrony": apart, "asynchrony_max": np.fmax.reduce(on_time, initial=largest)}


def largest_spread(times: Array, angles: Array, rates: Array, until: float) -> float:
    """Largest difference between the joints' angles up to the time ``until``, rad.

    Looked for at ``_POINTS`` points in each step, on the cubics that fit angles and rates at its
    ends, and at ``until`` itself: a few long steps step over the moment of the largest one.
    ``angles`` and ``rates`` have shape (n, joints), rad and rad/s.
    """
    largest = float(np.ptp(angles[0]))
    begun = int(np.searchsorted(times[:-1], until))
    span = np.diff(times[: begun + 1])[:, None]
    left = np.minimum(until - times[:begun, None], span)
    part = np.divide(left, span, out=np.zeros_like(span), where=span > 0.0)
    first, last = angles[:begun], angles[1 : begun + 1]
    leaving, arriving = rates[:begun], rates[1 : begun + 1]
    for point in range(1, _POINTS + 1):
        s = point / _POINTS * part
        value = s**2 * (3.0 - 2.0 * s) * (last - first)  # in place: no spline of the whole run
        value += first
        value += s * (1.0 - s) ** 2 * span * leaving
        value -= s**2 * (1.0 - s) * span * arriving
        largest = max(largest, float(np.ptp(value, axis=1).max(initial=0.0)))
    return largest
