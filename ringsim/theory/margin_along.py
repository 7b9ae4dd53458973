"""The static margin of a drive along a run: that of the ideal ring at the angles that it passed."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ringsim.layout.pose import Array
from ringsim.parts.faults.family import AT_ONCE
from ringsim.parts.margin.family import MarginStandard
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.scene.substituted import substituted
from ringsim.theory.condition import is_unknown
from ringsim.theory.drive_margin import MOST, DriveMargin, Margin
from ringsim.variables import Outcome


class Passed(NamedTuple):
    """Mean opening angles (rad, shape (times,)) that a run had at times (s)."""

    times: Array
    angles: Array

    def between(self, begin: float, end: float) -> "Passed":
        """Those of a stretch of time, its ends by lines between the others."""
        begin, end = max(begin, self.times[0]), min(end, self.times[-1])
        inside = self.times[(self.times > begin) & (self.times < end)]
        times = np.unique([begin, *inside, end])
        return Passed(times, np.interp(times, *self))

    def time_at(self, angle: float) -> float:
        """When it first had an angle, by lines between those known."""
        off = self.angles - angle
        k = int(np.argmax(np.append(off[:-1] * off[1:] <= 0.0, True)))
        if k == len(off) - 1 or off[k] == off[k + 1]:
            return float(self.times[k])
        share = off[k] / (off[k] - off[k + 1])
        return float(self.times[k] + share * (self.times[k + 1] - self.times[k]))


class Least(NamedTuple):
    """The smallest margin, and the time (s) and mean opening angle (rad) at which it was."""

    margin: float
    time: float
    angle: float


def passed(times: Array, opening: Array, lock: float = math.nan) -> Passed:
    """Of opening angles (degree, shape (planes, sections, times), NaN where unknown) at times (s)
    until the last joint locked (s, NaN if it never did), then with 180 deg.
    """
    angles = np.minimum(np.radians(opening.mean(axis=(0, 1))), math.pi)
    known = np.isfinite(angles) & (times <= np.nan_to_num(lock, nan=math.inf))
    times, angles = times[known], angles[known]
    if math.isfinite(lock):
        times, angles = np.append(times, lock), np.append(angles, math.pi)
    return Passed(times, angles)


def least_along(
    drive: DriveMargin, way: Passed, known: Sequence[tuple[float, Margin]] = ()
) -> Least:  # fmt: skip
    """The smallest margin over all angles that a run passed, by the search of ``check --margin``.

    Each angle counts with what is whole and on while it is passed.  Where a ring turned back
    between two output times is not seen.  Some margins may be ``known``, with their times (s).
    """
    found = []
    marks = [-math.inf, *drive.conditions.changes, math.inf]
    for begin, end in pairwise(marks):
        if end <= way.times[0] or begin > way.times[-1]:
            continue
        now = way.between(begin, end)
        told = [one for time, one in known if begin - AT_ONCE <= time < end - AT_ONCE]
        low, high = float(now.angles.min()), float(now.angles.max())
        least = drive.least(low, high, float(now.times[0]), told)
        found.append(Least(min(least.margin, MOST), now.time_at(least.angle), least.angle))
    return min(found)


def with_margin(
    outcome: Outcome, scene: Scene, before: Sequence[tuple[float, Scene]] = ()
) -> Outcome:
    """The outcome of a run with the margin of its drive, if its scene names a standard.

    At the mean opening angle of all V-joints, until the last joint has locked.  A run that went on
    from stored states had other scenes ``before``, each until a time (s): they count until then, by
    the standard of the scene.
    """
    if scene.margin is None or outcome.status.failed or "opening_angle" not in outcome.values:
        return outcome
    times = outcome.coordinates["time"]
    lock = float(outcome.values.get("deployment_time", math.nan))
    way = passed(times, outcome.values["opening_angle"], lock)
    drives = [(until, _drive(substituted(one), scene.margin)) for until, one in before]
    drives.append((math.inf, DriveMargin(scene, scene.margin)))
    kinds = list(dict.fromkeys(kind for _, drive in drives if drive for kind in drive.kinds))
    available, margin = np.full((2, len(times)), np.nan)
    resisting = np.full((len(kinds), len(times)), np.nan)
    begin, leasts = -math.inf, []
    for until, drive in drives:
        at = (way.times >= begin - AT_ONCE) & (way.times < until - AT_ONCE)
        passes = len(way.times) and begin <= way.times[-1] and until > way.times[0]
        if drive is not None and passes:
            own = np.isin(times, way.times[at])
            clock = times[own].tolist()
            rows = [drive.at(float(np.interp(time, *way)), time) for time in clock]
            available[own] = [one.available for one in rows]
            margin[own] = [min(one.margin, MOST) for one in rows]
            resisting[:, own] = [[one.resisting.get(kind, 0.0) for one in rows] for kind in kinds]
            known = list(zip(clock, rows, strict=True))
            leasts.append(least_along(drive, way.between(begin, until), known))
        begin = until
    values = {"drive_available": available, "drive_resistance": resisting, "drive_margin": margin}
    if leasts:
        least = min(leasts)
        values |= {
            "least_drive_margin": np.asarray(least.margin),
            "least_drive_margin_time": np.asarray(least.time),
            "least_drive_margin_angle": np.asarray(math.degrees(least.angle)),
        }
    unknown = [number for number, one in enumerate(scene.faults, 1) if is_unknown(one)]
    missing = "".join(f"; the margin of the drive does not know faults[{k}]" for k in unknown)
    return replace(
        outcome,
        reason=outcome.reason + missing,
        values=outcome.values | values,
        coordinates=outcome.coordinates | {"resistance": np.array(kinds, dtype=str)},
    )


def _drive(scene: Scene, standard: MarginStandard) -> DriveMargin | None:
    """None of a scene whose winches pulled with any force: it had no margin."""
    try:
        return DriveMargin(scene, standard)
    except InputError:
        return None
