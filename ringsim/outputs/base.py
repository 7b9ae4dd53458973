"""What the base carries, and how it turns."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.outputs.family import (
    Array,
    ErrorBar,
    Output,
    Peak,
    Reading,
    Run,
    Series,
    Values,
    Variable,
)
from ringsim.parts.faults import AT_ONCE
from ringsim.parts.solver import LEAST_TOLERANCE, NO_DEVIATIONS
from ringsim.scene import Scene
from ringsim.stepping.locks import SURE, UNKNOWN, History, may_decide
from ringsim.tables import number_text

# What the base carries, and how it turns.


class BaseReaction(Output):
    """Force and torque of the ground, or of the spacecraft, on the structure.

    Together with loads and weight they are the rates of change of the structure's momentum and
    angular momentum; the base feels their negative.  Peaks count over the whole run: the shock of
    the last locks comes at its end.
    """

    rank = 46
    needs = ("reactions", "held base or spacecraft")
    peaks = (
        Peak("peak_base_force", (), "the largest force at the base"),
        Peak("peak_base_torque", (), "the largest torque at the base"),
    )
    shocks = tuple((each.name, each) for each in peaks)
    variables = (
        Variable("base_force", ("axis", "time"), "N", "force of the base on the structure"),
        Variable(
            "base_torque", ("axis", "time"), "N m",
            "torque of the base on the structure, about the base's origin",
        ),
        Variable(
            "peak_base_force", (), "N", "largest force at the base at any step",
            error_bar=ErrorBar("largest base force", safety=3.0, of="base_force"),
            summary=("largest base force", "10.3g"), worse="larger", largest_of="base_force",
        ),
        Variable(
            "peak_base_torque", (), "N m", "largest torque at the base at any step",
            error_bar=ErrorBar("largest base torque", safety=3.0, of="base_torque"),
            summary=("largest base torque", "10.3g"), worse="larger", largest_of="base_torque",
        ),
        *(variable for peak in peaks for variable in peak.variables),
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (2, 3), N and N m."""
        return now.meters.reaction()

    def reduce(self, run: Run, series: Series) -> Values:
        """On the output grid; the peaks are those of all steps."""
        # At the start it is that of rods that are rigid, without faults and ropes: where these
        # pull or strike, the first step tells what holds the base.
        if _jolted_at_start(run.scene) and len(series.times) > 1:
            told = series.values.copy()
            told[0] = told[1]
            series = replace(series, values=told)
        force, torque = series.on_grid()
        values: Values = {"base_force": force, "base_torque": torque}
        for peak, sizes in zip(self.peaks, np.linalg.norm(series.values, axis=2).T, strict=True):
            most, found = peak.of(run, series.times, sizes)
            values |= found | {peak.name: np.asarray(most)}
        return values


def _jolted_at_start(scene: Scene) -> bool:
    cables = [] if scene.cables is None else scene.cables.present()
    taut = any(cable.initial_slack < 0.0 for _, cable in cables)
    return taut or any(fault.jolts and fault.time <= AT_ONCE for fault in scene.faults)


class BaseRotation(Output):
    """How the body at the boom's upper end has turned since the start."""

    rank = 47
    needs = ("reactions", "base")
    peak = Peak("base_rotation_max", (), "the largest rotation of the base")
    variables = (
        Variable(
            "base_rotation", ("axis", "time"), "degree",
            "rotation vector of the base since the start",
        ),
        Variable(
            "base_rotation_max", (), "degree", "largest rotation of the base at any step",
            error_bar=ErrorBar("largest base rotation", safety=1.7, of="base_rotation"),
            summary=("largest base rotation", "10.3g"), worse="larger", largest_of="base_rotation",
        ),
        *peak.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array | None:
        """Shape (3,), rad."""
        from scipy.spatial.transform import Rotation  # here: most runs have no such base

        turn = now.meters.turn()
        return None if turn is None else np.asarray(Rotation.from_matrix(turn).as_rotvec())

    def reduce(self, run: Run, series: Series) -> Values:
        """In degrees; whole turns count."""
        turned = replace(series, values=unwound(series.values))
        return _in_degrees("base_rotation", self.peak, run, turned)


def unwound(vectors: Array) -> Array:
    """Rotation vectors of steps, shape (n, 3), rad, with the whole turns that came before: as they
    are, none is longer than pi.

    The angle is carried on by the turn of each step about the last axis that was well known.  Near
    a whole turn a body that wobbles has the axis of its wobble, which tells nothing of the turns:
    there the angle counts along the axis that it had.
    """
    from scipy.spatial.transform import Rotation  # here: most runs have no such base

    found, turns = np.array(vectors), Rotation.from_rotvec(vectors)
    steps = (turns[1:] * turns[:-1].inv()).as_rotvec()
    axis, angle = np.zeros(3), 0.0
    for now, step in zip(found[1:], steps, strict=True):
        size = float(np.linalg.norm(now))
        own = now / size if size > _NO_TURN else axis
        if own @ axis < 0.0:
            own, size = -own, -size
        known = abs(math.sin(0.5 * size)) > _KNOWN
        if not known and own @ axis < _ALIKE:
            own, size = axis, float(now @ axis)
        angle += float(step @ axis)
        whole = math.tau * round((angle - size) / math.tau)
        if whole:
            now[:] = (size + whole) * own
        if known:
            axis, angle = own, size + whole
    return found


_NO_TURN = 1e-9
"""Rotation whose axis is round-off, rad."""
_KNOWN = 0.7
"""Sine of half a rotation, of a right angle, from which on its axis is well known: whoever wobbles
by less than 30 deg does not turn it round."""
_ALIKE = 0.9
"""Cosine between two axes that are taken for the same one, which wanders."""


class BaseRate(Output):
    """Angular velocity of the spacecraft, as its attitude control has to bear it."""

    rank = 47
    needs = ("reactions", "spacecraft")
    peak = Peak("base_rate_max", (), "the largest rate of the spacecraft")
    variables = (
        Variable(
            "base_rate", ("axis", "time"), "degree/s",
            "angular velocity of the spacecraft, in axes that do not turn",
        ),
        Variable(
            "base_rate_max", (), "degree/s", "largest angular velocity of the spacecraft",
            error_bar=ErrorBar("largest rate of the spacecraft", safety=2.4, of="base_rate"),
            summary=("largest base rate", "10.3g"), worse="larger", largest_of="base_rate",
        ),
        *peak.variables,
    )  # fmt: skip

    def read(self, now: Reading) -> Array:
        """Shape (3,), rad/s."""
        return now.meters.spin()

    def reduce(self, run: Run, series: Series) -> Values:
        """In degrees a second."""
        return _in_degrees("base_rate", self.peak, run, series)


def _in_degrees(name: str, peak: Peak, run: Run, series: Series) -> Values:
    """A vector over time and its largest magnitude, with its time if it is not zero throughout."""
    sizes = np.degrees(np.linalg.norm(series.values, axis=1))
    most, found = peak.of(run, series.times, sizes)
    values: Values = {name: np.degrees(series.on_grid()), peak.name: np.asarray(most)}
    return values | (found if sizes.any() else {})


# Whether the steps of a run were short enough for the shocks of its locks.
#
# One function a consequence: peaks at base and corners, and rates at which latches are met.


_NAMED = 6
"""V-joints that a sentence names at most."""

STEPS = 50.0
"""Steps in the lowest period of the slowest rod that shocks need at locks.  Steps that follow
shocks are 64 (``ringsim.stepping.repeats.FRONT``).  With 32, loads at the base of one random ring
in four were off by more than a seventh (benchmarks/shock_steps.py), with 8 those of flights of 8 m
by up to 18 %, with 1 or less by half, and impulses of stops up to 15 times too large."""
SHARP = {"peak_acceleration_max": 500.0}
"""The same of numbers that a stop's damper makes within a thousandth of a second, as it begins to
push at a corner: of 5 rings one had 8.3 m/s^2, and 2.1 with 32."""


class TooLong(NamedTuple):
    """A step that is too long for a number of a run: by which factor, for what, its length and the
    time of the lock, s.
    """

    factor: float
    name: str
    what: str
    step: float
    lock: float


def unresolved(run: Run, shocks: Mapping[str, float]) -> str:
    """What a reason says of steps that are too long for what happens at locks: which numbers of
    the run may be off, and what cures it; empty if none is.  ``shocks`` are the times (s) of
    numbers that the shock of a lock may have made.
    """
    if run.scene.stop is None or len(run.angles.times) < 2 or not np.isfinite(run.locks).any():
        return ""
    told = ""
    for found in (list(_shaken(run, shocks)), list(_uncertain_rates(run))):
        if found:
            worst, names = min(found), ", ".join(each.name for each in found)
            length = number_text(1e3 * worst.step, 3)
            told += (
                f"; steps of {length} ms at the lock at {worst.lock:.6g} s are too long for "
                f"{worst.what}, so {names} may be off: {_to(run, worst.factor)}"
            )
    return told


_AIM = 0.03
"""Uncertain share of a latch's rate that the cure of one beyond ``SURE`` aims at: it
goes with the tolerance, and so with the square of steps."""
_LEAST_FACTOR = 0.15
"""How much shorter steps shall be at most at once: fifty times the tolerance."""
_JERKED = 0.15
"""Uncertain share where another joint locked in the last two steps: the largest error found."""


def _uncertain_rates(run: Run) -> Iterator[TooLong]:
    """The least and the largest rate at latches, if they are uncertain; the largest also if another
    one is so uncertain that it may be larger.
    """
    if not run.scene.stop or not run.scene.stop.latch:
        return
    rates, times, period = run.history.rates, run.angles.times, run.slowest_period
    jerked = jolted(times, run.locks, period)
    unsure = uncertain(run.history, jerked)
    for name, sizes in (("least_latch_rate", -rates), ("peak_latch_rate", rates)):
        if not np.isfinite(sizes).any() or (name.startswith("least") and np.isnan(sizes).any()):
            continue
        place = int(np.nanargmax(sizes))
        if name.startswith("peak") and np.nanmax(unsure) > UNKNOWN:
            place = int(np.nanargmax(unsure))
        share, lock = float(unsure.flat[place]), float(run.locks.flat[place])
        if not np.isfinite(lock):
            continue
        last = int(np.clip(np.searchsorted(times, lock), 1, len(times) - 1))
        step, what = float(times[last] - times[last - 1]), "the rate at which a latch is met"
        factor = math.sqrt(_AIM / max(share, _AIM))
        if jerked.flat[place]:  # two steps are to be shorter than the delay; in turns if far longer
            factor = min(factor, max(0.5 * _DELAY * period / step, _LEAST_FACTOR))
        if share > SURE:
            yield TooLong(factor, name, what, step, lock)


_DELAY = 0.25
"""Time until a jerk has come through a rod over its period."""


def jolted(times: Array, locks: Array, period: float) -> NDArray[np.bool_]:
    """Which V-joints another one may have jerked that locked within two steps before; ``times`` of
    steps (s), ``locks`` of shape (planes, sections) (s), and the slowest rod's ``period`` (s).
    """
    last = np.clip(np.searchsorted(times, locks), 1, len(times) - 1)
    begin, end = times[np.maximum(last - 2, 0)], locks - _DELAY * period
    own = locks[..., None, None]
    return np.asarray(((locks >= begin[..., None, None]) & (locks < end[..., None, None])
                       & np.isfinite(own)).any(axis=(-2, -1)))  # fmt: skip


def uncertain(found: History, jerked: NDArray[np.bool_]) -> Array:
    """Share of each latch's rate that steps leave uncertain, shape (planes, sections)."""
    return np.asarray(np.where(jerked, np.fmax(found.unsure, _JERKED), found.unsure))


def _shaken(run: Run, shocks: Mapping[str, float]) -> Iterator[TooLong]:
    """Numbers of shocks, with their times (s), where the steps that meet a lock are too long for
    them: all of them, as finer steps may have a larger one at another lock; sharp ones if they were
    made there.
    """
    record = run.scene.record
    # Steps that follow stresses alone give the largest to 3 %, whatever their share of a period.
    if not shocks or not (record.reactions or record.accelerations):
        return
    locks = run.locks[np.isfinite(run.locks)]
    times, period = run.angles.times, run.slowest_period
    steps = np.diff(times)
    last = np.clip(np.searchsorted(times, locks) - 1, 0, len(steps) - 1)
    met = np.maximum(steps[last], steps[np.minimum(last + 1, len(steps) - 1)])
    most, lock = max(zip(met.tolist(), locks.tolist(), strict=True))
    for name, time in shocks.items():
        rods = f"shocks in the rods (period {1e3 * period:.3g} ms)"
        if most > period / STEPS:
            yield TooLong(period / STEPS / most, name, rods, most, lock)
            continue
        enough = period / SHARP.get(name, STEPS)
        own = met[(locks <= time) & (time <= locks + period) & (met > enough)]
        if own.size:
            what = "the first instants of a shock"
            yield TooLong(enough / float(own.max()), name, what, float(own.max()), lock)


SMOOTHED = "much of the pulley friction is smoothed away"
_OFF = re.compile(
    rf"; (?:steps of|({SMOOTHED}))[^;]*, so ([^;]*) may be off: "
    r"([^;(]*(?:\([^;()]*times the steps\))?)"
)
_VALUE, _SLIP = re.compile(r"= ([\d.e+-]+)"), re.compile(r"\S+\.slip_speed\b")


def may_be_off(reason: str) -> tuple[list[str], dict[str, str]]:
    """The numbers that a run calls wrong in its reason, and by what makes them so what cures it.

    >>> told = "; steps of 1 s are too long for shocks, so {} may be off: set solver.step = {}"
    >>> may_be_off("done" + told.format("a, b", 0.02) + told.format("c", 0.01) + " (start 2)")
    (['a', 'b', 'c'], {'steps are too long at locks': 'set solver.step = 0.01'})
    """
    found = _OFF.findall(reason)
    cures: dict[str, str] = {}
    for smoothed, _, told in found:
        since = smoothed or "steps are too long at locks"
        cures[since] = finest(told.strip(), cures.get(since, ""))
    return [name for _, each, _ in found for name in each.split(", ")], cures


def finest(*cures: str) -> str:
    """That of some cures which sets the smallest value, and so serves for all of them; of slip
    speeds with the cables of all.

    >>> finest("set a.slip_speed = 2e-05 m/s", "set b.slip_speed = 1e-05 m/s")
    'set a.slip_speed and b.slip_speed = 1e-05 m/s'
    """
    values = [float(value[1]) if (value := _VALUE.search(cure)) else math.inf for cure in cures]
    least = cures[values.index(min(values))]
    speeds = dict.fromkeys(path for cure in cures for path in _SLIP.findall(cure))
    return re.sub(r"set .* =", f"set {' and '.join(speeds)} =", least) if speeds else least


def without_doubts(reason: str) -> str:
    """A reason without what ``unresolved`` has added, which differs between runs that ended alike.

    >>> without_doubts("done; steps of 1 s are too long for shocks, so a may be off: set b = 1; c")
    'done; c'
    """
    return _OFF.sub("", reason)


DOUBT = " ?"
"""Stands behind what may be off, wherever it is told."""


UNCERTAIN = "catches is uncertain"
"""What a reason says of a latch of which steps leave uncertain whether it catches."""


def jerked(run: Run) -> str:
    """What a reason says of latches of which steps leave uncertain whether they catch.

    Where the shock of an earlier lock in the same step had a quarter of a period to arrive, the
    joint met its latch with another rate: on `truss2` with half of it, on rings of 12 sections with
    0.96 to 1.05 of it.  Where a rate is uncertain by itself, it may be several times larger.  Told
    are the joints for which such a factor decides.  Empty where no latch asks for a rate.
    """
    latch, locks = run.scene.latch, run.locks
    if latch is None or not np.any(np.asarray(latch.min_rate) > 0.0):
        return ""
    first = np.searchsorted(run.angles.times, locks) - 1
    ahead = (first[..., None, None] == first) & (
        locks[..., None, None] - locks > _DELAY * run.slowest_period
    )
    met = run.history.rates
    asked = np.broadcast_to(np.asarray(latch.min_rate, dtype=float), locks.shape)
    jerks = jolted(run.angles.times, locks, run.slowest_period)  # as for the rates themselves
    driven, unsure = ahead.any(axis=(-2, -1)), np.nan_to_num(uncertain(run.history, jerks))
    near = may_decide(met, unsure, asked, driven=driven)
    late = np.argwhere(near).tolist()
    if not late:
        return ""
    also = "another joint locked within two steps before" if jerks[near].any() else (
        "steps are too long")  # fmt: skip
    also = "another joint locked in the same step" if driven[near].any() else also
    planes = run.scene.structure.planes
    names = ", ".join(f"{planes[plane]} {section + 1}" for plane, section in late[:_NAMED])
    more = f" and {len(late) - _NAMED} more" if len(late) > _NAMED else ""
    return f"; whether the latch of {names}{more} {UNCERTAIN}, as {also}: reduce {_cure(run)}"


def _to(run: Run, factor: float) -> str:
    """What makes steps so many times as long; a little less, since not all of them follow."""
    solver = run.scene.solver
    if solver.step_control == "constant":
        return f"set solver.step = {_LESS * solver.step * factor:.2g}"
    # Far shorter steps in turns: the largest number of the next run may lie at no lock any more.
    # 3 times the steps were enough where 70 would have been told.
    factor = max(factor, _LEAST_FACTOR)
    tolerance = max(_LESS * solver.tolerance * factor**2, LEAST_TOLERANCE)
    record = run.scene.record
    stress = record.stress and solver.deviation_tolerance < NO_DEVIATIONS
    shocks = record.reactions or record.accelerations
    powers = _OF_SHOCKS if shocks else _OF_STRESS if stress else _OF_MOTION
    low, high = (math.sqrt(solver.tolerance / tolerance) ** power for power in powers)
    return f"set solver.tolerance = {tolerance:.1e} ({low:.2g} to {high:.2g} times the steps)"


_LESS = 0.9
_OF_MOTION, _OF_STRESS, _OF_SHOCKS = (0.7, 1.15), (0.3, 1.0), (0.4, 0.9)
"""Power of the ratio of steps with which their number grows, by what rules some of them beside the
tolerance: nothing else, vibrations of the ring, or shocks.  1 if it ruled all: measured from 2.6 to
17 times on frames of ring18-cable and ring18-ground with 4 and 6 sections and truss2, 0.71 to 0.96,
up to 1.16 on ring18-flight; with stresses on these and on flights of 4 and 12 sections, 0.32 to
0.99; with shocks on these, 0.51 to 0.81."""


def _cure(run: Run) -> str:
    constant = run.scene.solver.step_control == "constant"
    return "solver.step" if constant else "solver.tolerance"
