"""How far the V-joints are apart."""

import math
from typing import NamedTuple

import numpy as np

from ringsim.outputs.family import Array, ErrorBar, Output, Run, Series, SpanNames, Values, Variable
from ringsim.outputs.peaks import ties, with_ties

_POINTS = 8
"""Points in each step at which the largest spread is looked for: a parabola rises above the largest
of so many by at most a 64th of what it rises above the chord of the step."""
_TOLD = 5e-5
"""Below this it is told as 0.0000 deg, and nobody is behind."""


class Asynchrony(Output):
    """Largest difference of opening angles between V-joints over time, and its maximum."""

    rank = 20
    variables = (
        Variable(
            "asynchrony", ("time",), "degree",
            "largest difference of opening angles between V-joints",
            error_bar=ErrorBar("asynchrony", safety=5.0),
        ),
        Variable(
            "asynchrony_max", (), "degree", "largest asynchrony up to the deployment time",
            error_bar=ErrorBar("largest asynchrony", safety=1.8),
            summary=("largest asynchrony", "10.4f"), worse="larger", largest_of="asynchrony",
        ),
        Variable("asynchrony_max_time", (), "s", "time of the largest asynchrony"),
        *(
            Variable(f"asynchrony_{who}_{dim}", (), "1", f"{dim} of the {most} V-joint then", dtype)
            for who, most in (("leader", "most open"), ("laggard", "least open"))
            for dim, dtype in (("plane", "str"), ("section", "i4"))
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
        largest = largest_spread(run.angles.times, angles, rates, run.until)
        found = largest._replace(angle=math.degrees(largest.angle))
        on_time = np.nan_to_num(np.where(run.angles.grid <= run.until, apart, np.nan))
        if on_time[k := int(on_time.argmax())] > found.angle:
            time, seen = float(run.angles.grid[k]), opening[:, k]
            found = Spread(float(on_time[k]), time, int(seen.argmax()), int(seen.argmin()))
        values: Values = {
            "asynchrony": apart,
            "asynchrony_max": found.angle,
            "asynchrony_max_time": found.time,
        }
        for who, joint in (("leader", found.leader), ("laggard", found.laggard)):
            plane, section = divmod(joint, run.locks.shape[1])
            values[f"asynchrony_{who}_plane"] = run.coordinates["plane"][plane]
            values[f"asynchrony_{who}_section"] = run.coordinates["section"][section]
        return values

    def told(self, values: Values, span_names: SpanNames) -> str:
        """As "at 16.1 s: upper 10 behind lower 2"; empty if all joints are told alike."""
        known = str(values.get("asynchrony_leader_plane", ""))
        if not (known and values["asynchrony_max"] >= _TOLD):
            return ""
        time, size = (float(values[f"asynchrony_max{end}"]) for end in ("_time", ""))
        joints, dims = list[str](), ("plane", "section")
        for who in ("laggard", "leader"):
            own = tuple(np.asarray(values[f"asynchrony_{who}_{dim}"]).item() for dim in dims)
            first, more = with_ties(own, ties(values, "opening_angle", dims, own, time, size))
            joints.append(f"{first} {own[1]:.0f}{more}")
        return f"at {time:.4g} s: {' behind '.join(joints)}"


class Spread(NamedTuple):
    """How far the most open joint is from the least open one (rad), when (s), and which."""

    angle: float
    time: float
    leader: int
    laggard: int


def largest_spread(times: Array, angles: Array, rates: Array, until: float) -> Spread:
    """Largest difference between the joints' angles up to the time ``until``.

    Looked for at ``_POINTS`` points in each step, on the cubics that fit angles and rates at its
    ends, and at ``until`` itself: a few long steps step over the moment of the largest one.
    ``angles`` and ``rates`` have shape (n, joints), rad and rad/s.
    """
    largest = _spread(float(times[0]), angles[0])
    begun = int(np.searchsorted(times[:-1], until))
    span = np.diff(times[: begun + 1])[:, None]
    left = np.minimum(until - times[:begun, None], span)
    part = np.divide(left, span, out=np.zeros_like(span), where=span > 0.0)
    first, last = angles[:begun], angles[1 : begun + 1]
    leaving, arriving = rates[:begun], rates[1 : begun + 1]
    for point in range(1, _POINTS + 1) if begun else ():
        s = point / _POINTS * part
        value = s**2 * (3.0 - 2.0 * s) * (last - first)  # in place: no spline of the whole run
        value += first
        value += s * (1.0 - s) ** 2 * span * leaving
        value -= s**2 * (1.0 - s) * span * arriving
        k = int(np.ptp(value, axis=1).argmax())
        found = _spread(float(times[k] + s[k, 0] * span[k, 0]), value[k])
        largest = max(largest, found, key=lambda spread: spread.angle)
    return largest


def _spread(time: float, angles: Array) -> Spread:
    return Spread(float(np.ptp(angles)), time, int(angles.argmax()), int(angles.argmin()))
