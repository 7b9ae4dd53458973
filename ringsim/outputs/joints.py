"""The V-joints: opening angles, asynchrony, locks, latches."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ringsim.outputs.family import (
    Array,
    ErrorBar,
    Output,
    Peak,
    Reading,
    Run,
    Series,
    SpanNames,
    Values,
    Variable,
    ties,
    with_ties,
)

# The opening angles of all V-joints.


class OpeningAngle(Output):
    """Angle between the bar halves; of a planar truss, between its beams and the axis."""

    rank = 10
    of_opening = True
    variables = (
        Variable(
            "opening_angle", ("plane", "section", "time"), "degree", "angle between the bar halves",
            error_bar=ErrorBar("opening angles", safety=1.5),
        ),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """Cubic Hermite interpolation of angles and rates."""
        return {"opening_angle": run.opening}


# How far the V-joints are apart.


_POINTS = 8
"""Points in each step at which the largest spread is looked for: a parabola rises above the largest
of so many by at most a 64th of what it rises above the chord of the step."""
_TOLD = 5e-5
"""Below this it is told as 0.0000 deg, and nobody is behind."""


class Asynchrony(Output):
    """Largest difference of opening angles between V-joints over time, and its maximum."""

    rank = 20
    of_opening = True
    variables = (
        Variable(
            "asynchrony", ("time",), "degree",
            "largest difference of opening angles between V-joints",
            error_bar=ErrorBar("asynchrony", safety=3.1),
        ),
        Variable(
            "asynchrony_max", (), "degree",
            "largest asynchrony up to the deployment time, or to the end of a run without one",
            error_bar=ErrorBar("largest asynchrony", safety=1.8, of="asynchrony"),
            summary=("largest asynchrony", "10.4f"), worse="larger", largest_of="asynchrony",
            round_off=1e-4,  # sections that are all alike run apart by up to 5e-6 deg
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
        opening = run.opening.reshape(joints, -1)
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
        """As "at 16.1 s: upper 10 behind lower 2"; empty if all joints are told alike, or a file
        has left out who they are.
        """
        if any(variable.name not in values for variable in self.variables if not variable.dims):
            return ""
        if not str(values["asynchrony_leader_plane"]) or values["asynchrony_max"] < _TOLD:
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


# When the V-joints reached 180 deg.

_PLACE = ("plane", "section")
_NAMED = 3
"""V-joints that are told by name beside the last one."""
_AT_ONCE = 1e-9
"""Share of the time by which joints that move alike may lock apart, by round-off."""


class Deployment(Output):
    """The lock time of every V-joint, and the latest of them."""

    rank = 0
    of_opening = True
    variables = (
        Variable(
            "deployment_time", (), "s", "time at which the last V-joint reached 180 deg",
            error_bar=ErrorBar("deployment time", safety=1.5, of="lock_time"),
            summary=("deployment time", "10.4f"), worse="larger", largest_of="lock_time",
        ),
        Variable(
            "lock_time", ("plane", "section"), "s", "time at which the V-joint reached 180 deg"
        ),
        Variable(
            "locked_joints", (), "1", "V-joints that have reached 180 deg", "i4", worse="smaller"
        ),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """As the run knows them; see ``ringsim.stepping.locks.lock_times``."""
        if not run.scene.structure.locks:
            return {}
        return {
            "lock_time": run.locks,
            "deployment_time": run.locks.max(),
            "locked_joints": np.isfinite(run.locks).sum(),
        }

    def told(self, values: Values, span_names: SpanNames) -> str:
        """Which V-joint locked last, with those that the error bar does not tell from it: as
        "(last: lower 11, or by the error bar upper 11)"; empty if that is not known.
        """
        if any(name not in values for name in ("lock_time", *_PLACE)):
            return ""
        locks = np.asarray(values["lock_time"])
        last, bar = locks.max(), float(values.get("deployment_time_error", np.nan))
        if not np.isfinite(last) or locks.size < 2:
            return ""
        if locks.min() >= last - _AT_ONCE * last:
            return "(all at once)"
        near = locks >= last - (bar if bar < math.inf else _AT_ONCE * last)
        if near.all():
            return "(which is last the error bar does not tell)"
        order = np.argsort(-locks, axis=None, kind="stable")[: near.sum()]
        where = [np.asarray(values[name])[k] for name, k in
                 zip(_PLACE, np.unravel_index(order, locks.shape), strict=True)]  # fmt: skip
        first, *others = [f"{plane} {section}" for plane, section in zip(*where, strict=True)]
        others[_NAMED:] = [f"{len(others) - _NAMED} more"] * (len(others) > _NAMED)
        by_bar = "or by the error bar " * (bar < math.inf)
        return f"(last: {first}" + f", {by_bar}{', '.join(others)}" * bool(others) + ")"


# How fast V-joints met their latches, and which of these caught.


LEAST = Peak("least_latch_rate", _PLACE, "the smallest latch rate", "opening_angle")
LARGEST = Peak("peak_latch_rate", _PLACE, "the largest latch rate", "opening_angle")


class Latching(Output):
    """The opening rate at which every V-joint first reached 180 deg, and whether its latch holds.

    ECSS-E-ST-33-01C, 4.7.5.4.3, wants latching shown over temperature and tolerances.
    """

    rank = 5
    of_opening = True
    needs = ("latches",)
    peak = LEAST
    variables = (
        Variable(
            "latch_rate", ("plane", "section"), "rad/s",
            "opening rate at which the V-joint first met its latch; missing if it did not",
        ),
        Variable(
            "least_latch_rate", (), "rad/s",
            "smallest opening rate at which a V-joint first met its latch; missing unless all did",
            error_bar=ErrorBar("least latch rate", safety=1.6, of="latch_rate"),
            summary=("least latch rate", "10.3g"), worse="smaller", least_of="latch_rate",
        ),
        *LEAST.variables,
        Variable("latched", ("plane", "section"), "1", "1 if the latch of the V-joint holds", "i4"),
        Variable("latched_joints", (), "1", "V-joints that are held by their latches", "i4",
                 worse="smaller"),
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """From the steps, as the engines do while they run."""
        rates = run.history.rates
        caught = np.isfinite(run.held).astype(np.int32)
        return {
            "latch_rate": rates,
            "least_latch_rate": rates.min(),
            # Of a ring in which some joint did not come to its latch there is no least rate.
            **LEAST.at(run, run.locks, np.where(np.isfinite(rates).all(), -rates, np.nan)),
            "latched": caught,
            "latched_joints": caught.sum(),
        }


class FastestLatch(Output):
    """The largest opening rate at which a V-joint met its latch: the shock of latching grows with
    it (I w (1 + e), see ``LockImpulse``).
    """

    rank = 5
    of_opening = True
    needs = ("latches",)
    peak = LARGEST
    variables = (
        Variable(
            "peak_latch_rate", (), "rad/s",
            "largest opening rate at which a V-joint first met its latch; missing if none did",
            error_bar=ErrorBar("largest latch rate", safety=1.5, of="latch_rate"),
            summary=("largest latch rate", "10.3g"), worse="larger", largest_of="latch_rate",
        ),
        *LARGEST.variables,
    )  # fmt: skip

    def reduce(self, run: Run, series: Series) -> Values:
        """Of the joints that came to their latches, also where others did not."""
        rates = run.history.rates
        return {"peak_latch_rate": np.fmax.reduce(rates, axis=None)} | LARGEST.at(
            run, run.locks, rates
        )


def missed(values: Values, planes: Sequence[str]) -> str:
    """Which latches did not catch though their joints came to them, in words; empty if none."""
    if "latched" not in values:
        return ""
    met = np.isfinite(values["lock_time"])
    open_ = np.argwhere(met & (values["latched"] == 0)).tolist()
    if not open_:
        return ""
    names = [f"{planes[plane]} {section + 1}" for plane, section in open_]
    more = f" and {len(names) - 6} more" if len(names) > 6 else ""
    of = f"{met.size} latches" if met.all() else f"the {met.sum()} latches that were met"
    count = f"{len(names)} of {of} did not catch"
    return f"{count}: {', '.join(names[:6])}{more}"


# The shock of every lock.


_AT_REST = 0.02
"""Share of the rate at a lock below which a V-joint has come to rest in its stop: one that drag
brakes, or that creeps on, never stops quite.  With 0.01 one of 48 slow flights had a joint that
crept on at 0.0105, and ten times the impulse."""


class LockImpulse(Output):
    """Angular impulse of the stop on every V-joint in its first contact: from the lock until the
    joint comes to rest, and as long again, or until the torque ends or turns round before.

    A V-joint that meets its stop alone, at the rate w and with the inertia I, takes I w (1 + e), e
    its coefficient of restitution: a linear stop with any damping takes as long to throw it back
    as to halt it.  What presses a latched joint on after that is load, not shock, and grows with
    the time for which one looks.
    """

    rank = 48
    needs = ("reactions", "stop")
    peak = Peak("peak_lock_impulse", _PLACE, "the largest lock impulse", "opening_angle")
    shocks = (("peak_lock_impulse", peak),)
    variables = (
        Variable(
            "lock_impulse", ("plane", "section"), "N m s",
            "angular impulse of the stop on the V-joint at its lock: until it has come to rest, "
            "and as long again for its rebound; missing if it did not lock",
        ),
        Variable(
            "peak_lock_impulse", (), "N m s",
            "largest angular impulse of a stop at a lock; missing if no V-joint has locked",
            error_bar=ErrorBar("largest lock impulse", safety=1.7, of="lock_impulse"),
            summary=("largest lock impulse", "10.3g"), worse="larger", largest_of="lock_impulse",
        ),
        *peak.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (planes, sections), N m."""
        return now.stop_torques()

    def reduce(self, run: Run, series: Series) -> Values:
        """Trapezoids over the steps, which resolve a bounce."""
        found = _impulses(run, series)
        peak = np.fmax.reduce(found, axis=None)  # without a lock NaN
        values = {"lock_impulse": found, "peak_lock_impulse": peak}
        return values | self.peak.at(run, run.locks, found)


def _impulses(run: Run, series: Series) -> Array:
    """Shape (planes, sections), N m s; NaN where a joint did not lock."""
    found = np.full(run.locks.shape, np.nan)
    steps = np.searchsorted(run.rates.times, series.times)
    for place in np.argwhere(np.isfinite(run.locks)):
        where = tuple(place)
        torques, rates = series.values[:, *where], run.rates.values[steps, *where]
        found[where] = first_impulse(series.times, torques, rates, run.locks[where])
    return found


def first_impulse(times: Array, torques: Array, rates: Array, lock: float) -> float:
    """Impulse (N m s) of the first contact after a lock (s), of torques (N m) and opening rates
    (rad/s) at times (s); see ``LockImpulse``.
    """
    begun = max(int(np.searchsorted(times, lock)) - 1, 0)
    pushed = np.flatnonzero(torques[begun:]) + begun
    if not len(pushed):
        return 0.0
    first = int(pushed[0])
    over = np.flatnonzero(torques[first:] * torques[first] <= 0.0) + first
    last = int(over[0]) if len(over) else len(torques)
    # The contact begins at the lock and ends between two steps.
    held = slice(first, last)
    own = np.concatenate([[min(lock, times[first])], times[held], times[last : last + 1]])
    torque = np.concatenate([[0.0], torques[held], np.zeros(len(times[last : last + 1]))])
    end = min(2.0 * _rest(times, rates, begun, lock) - lock, float(own[-1]))
    inside = own < end
    torque = np.append(torque[inside], np.interp(end, own, torque))
    from scipy.integrate import trapezoid  # here: only scenes that record reactions need it

    return float(abs(trapezoid(torque, np.append(own[inside], end))))


def _rest(times: Array, rates: Array, begun: int, lock: float) -> float:
    """When a V-joint that locks in the step behind ``begun`` comes to rest, s; infinite if not."""
    enough = _AT_REST * rates[begun]
    there = np.flatnonzero(rates[begun + 1 :] <= enough) + begun + 1
    if not len(there):
        return math.inf
    k = int(there[0])
    before = (lock, rates[begun]) if k == begun + 1 else (times[k - 1], rates[k - 1])
    part = (before[1] - enough) / max(before[1] - rates[k], 1e-300)
    return float(before[0] + min(part, 1.0) * (times[k] - before[0]))


# How well the joints hold together.


class JointGaps(Output):
    """Largest distance of points that a joint should hold together."""

    late = True
    rank = 61
    of_antenna = False
    variables = (
        Variable("constraint_violation", ("time",), "m", "largest gap in any joint"),
        Variable(
            "constraint_error", (), "m", "largest gap in any joint at any step",
            summary=("constraint error", "10.1e"), worse="larger",
            largest_of="constraint_violation",
        ),
    )  # fmt: skip

    def read(self, now: Reading) -> float:
        """The gap, m."""
        return now.gap
