"""The static margin of a drive: at every angle, along a run, and of one plane alone."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ringsim.choice import kind_of
from ringsim.layout.bodies import Array
from ringsim.parts.faults import AT_ONCE
from ringsim.parts.margin import MarginStandard
from ringsim.refusal import InputError
from ringsim.rigid.drive import Drive, turns_ever
from ringsim.rigid.mechanism import Mechanism, SectionLoads
from ringsim.rigid.resistances import Opening, resistances
from ringsim.scene import Scene
from ringsim.scene.substituted import substituted
from ringsim.variables import Outcome

# The static margin of a drive on the ideal ring, at every opening angle.
#
# What drives is set against what resists at the same angle, and speed helps nowhere.  Pulley
# friction is no force beside the others but a share of the tension at every pulley, so a standard's
# factor multiplies its coefficient, and the tensions are solved again; and so are those that gears
# leave.


MOST = 1e6
"""Margin told along a run where next to nothing resists: files hold no infinite numbers."""
CABLES, LOADS = "cables", "loads"
"""Names of what drives, beside springs."""
GEARS = "gear and drum"
"""Name of what is lost between a motor's shaft and its rope."""
PULLEYS = "pulley friction"
"""Name of what is lost between the winches and the ring at the tension that they have."""

LATE = np.radians([168.0, 170.0, 172.0, 174.0, 176.0, 177.0, 178.0, 179.0])
"""Opening angles (rad) at which latches, and cables along a net's edge, are looked at besides."""
_APART = 1e-9
"""Angles (rad) that count as the same."""


class Margin(NamedTuple):
    """At one opening angle (rad): what would drive without friction in the pulleys, by its source,
    and all that resists, by its kind, without a standard's factors, N m; the margin with them; all
    that resists with them, ``required``, N m; what each cable drives without friction in the
    pulleys, and with the standard's losses, N m, shape (2, cables).
    """

    angle: float
    driving: dict[str, float]
    resisting: dict[str, float]
    margin: float
    required: float
    pulls: Array

    @property
    def available(self) -> float:
        """Sum of all that drives, N m."""
        return sum(self.driving.values())

    @property
    def counted(self) -> float:
        """What drives as the standard counts it, N m; NaN where nothing resists."""
        return (1.0 + self.margin) * self.required if self.required > 0.0 else math.nan


class DriveMargin:
    """The drive of a scene by a standard; ``kinds`` are the names of what resists, ``drive`` pulls.

    Raises
    ------
    InputError
        If its structure has no basis, or its drive no limit.
    """

    def __init__(self, scene: Scene, standard: MarginStandard) -> None:
        if not scene.structure.basis(scene.structure.coordinate).size:
            raise InputError(
                f'margin: structure.kind = "{kind_of(scene.structure)}" has no basis(), the '
                "functions in which its places are linear (give it one, or leave margin out)"
            )
        self.mechanism, self.standard = Mechanism(scene), standard
        self.drive = Drive(scene, self.mechanism, at_speed=standard.keep_speed)
        self.conditions = self.drive.conditions
        self._loads = SectionLoads(self.mechanism)
        self._resistances = resistances(scene, self.mechanism)
        self._ends_steeply = scene.latch is not None or (scene.net is not None and scene.net.steep)
        self.kinds = [PULLEYS, *(one.kind for one in self._resistances)]
        self.start = math.pi - 2.0 * scene.structure.coordinate
        """Opening angle at which the scene begins, rad."""
        self._found: dict[tuple[float, float], Margin] = {}

    @property
    def factors(self) -> dict[str, float]:
        """The standard's factor of every kind of resistance that motorisation multiplies."""
        winches = self.conditions.winches.values()
        motors = any(winch.winding.motor is not None for winch in winches)
        found = {PULLEYS: self.standard.friction} if winches else {}
        found |= {GEARS: self.standard.friction} if motors else {}
        known = (one for one in self._resistances if one.category != "inertia")
        return found | {one.kind: self.standard.factor(one.category) for one in known}

    def at(self, angle: float, time: float = 0.0) -> Margin:
        """At an opening angle (rad), with what is whole and on at a time (s): at rest, or with
        ``keep_speed`` at the speed that the winches are commanded to.
        """
        # Searches of the whole drive and of each plane's ask for the same angles.
        if (angle, time) not in self._found:
            self._found[angle, time] = self._at(angle, time)
        return self._found[angle, time]

    def _at(self, angle: float, time: float) -> Margin:
        standard, now = self.standard, self.mechanism.at(0.5 * (math.pi - angle))
        over, state = self.drive.reeved(now), self.conditions.at(time)
        rate, factor = self.drive.speed(over, state), standard.friction
        opening = Opening(angle, rate, 0.0, now, state.switches)
        ideal, usual = (self.drive.pulls(state, over, rate, times) for times in (0.0, 1.0))
        factored = self.drive.pulls(state, over, rate, factor, losses=factor)
        loads = float(self._loads.at(now).clip(min=0.0).sum())  # what resists is a resistance
        driving = {CABLES: float(ideal.sum()), LOADS: loads}
        drive, required, accelerated = float(factored.sum()) + loads, 0.0, 0.0
        resisting = {PULLEYS: float((ideal - usual).sum())}
        for one in self._resistances:
            force, factor = one.force(opening), standard.factor(one.category)
            if one.category == "spring" and force < 0.0:  # what else drives is not counted on
                driving[one.kind] = -force
                drive -= standard.driving_spring * force
                force = 0.0
            resisting[one.kind] = force
            if one.category == "inertia":
                accelerated += factor * force
            else:
                required += factor * max(force, 0.0)
        required = standard.motorisation * required + accelerated
        margin = _margin(drive, math.inf if state.switches.hold else required)
        pulls = np.stack([ideal, factored])
        return Margin(angle, driving, resisting, margin, required, pulls)

    def course(self, count: int = 33) -> list[Margin]:
        """At so many angles from the start to 180 deg, and more where parts resist at the end."""
        return [self.at(float(angle)) for angle in self._angles(self.start, math.pi, count)]

    def least(
        self, low: float | None = None, high: float = math.pi, time: float = 0.0,
        known: list[Margin] | None = None,
    ) -> Margin:  # fmt: skip
        """The smallest margin of all angles from ``low`` (rad), the start if None, to ``high``,
        with what is whole at a time (s); of some the margins may be ``known``.
        """
        low = self.start if low is None else low
        angles = self._angles(min(low, self.start), math.pi)
        inside = angles[(angles > low + _APART) & (angles < high - _APART)]
        wanted = np.unique([low, *inside, high])
        course = [*(known or []), *(self.at(float(angle), time) for angle in wanted)]
        course.sort(key=lambda each: each.angle)
        # A known angle that is wanted, too, would be its own neighbour.
        apart = np.diff([each.angle for each in course], prepend=-math.inf) > _APART
        course = [each for each, own in zip(course, apart, strict=True) if own]
        k = int(np.argmin([each.margin for each in course]))
        bounds = course[max(k - 1, 0)].angle, course[min(k + 1, len(course) - 1)].angle
        if not math.isfinite(course[k].margin) or bounds[1] - bounds[0] < _APART:
            return course[k]
        from scipy.optimize import minimize_scalar  # here: most runs do not need it

        found = minimize_scalar(
            lambda angle: self.at(angle, time).margin, bounds=bounds, method="bounded",
            options={"xatol": 1e-9},
        )  # fmt: skip
        return min(course[k], self.at(float(found.x), time), key=lambda each: each.margin)

    def pull_needed(self) -> float:
        """How many times as much all winches must pull for a margin of 0 at every angle: what else
        drives stays as it is.  Infinite where none pulls, or a joint holds; an estimate where the
        friction of pulleys depends on the tension.
        """
        most = 0.0
        for now in (*self.course(), self.least()):
            if now.margin == -1.0:  # nothing drives, or whatever pulls is held
                return math.inf
            if now.required > 0.0:
                pull = float(now.pulls[1].sum())
                wanted = now.required - (now.counted - pull)
                if pull <= 0.0 < wanted:
                    return math.inf
                most = max(most, wanted / pull if pull > 0.0 else 0.0)
        return most

    def _angles(self, low: float, high: float, count: int = 33) -> Array:
        """Those of the scene's course, and as many below its start if they begin there."""
        angles = np.linspace(self.start, high, count)
        if self._ends_steeply:
            angles = np.union1d(angles, LATE[self.start < LATE])
        if low < self.start - _APART:
            angles = np.union1d(angles, np.linspace(low, self.start, count))
        return angles


def place_of_winch(scene: Scene, cable: int, end: int) -> str:
    """The path of the winch at an end (0 first, 1 far) of the present cable of this number."""
    assert scene.cables is not None
    plane = [number for number, _ in scene.cables.present()][cable]
    return f"cables.{scene.structure.planes[plane]}.{('winch', 'far_winch')[end]}"


def _still_off(
    scene: Scene, drive: DriveMargin, time: float, way: "Passed", then: "Least | None"
) -> str:  # fmt: skip
    """What a reason says of winches that start after the time (s) of the least margin, with the
    least from ``then`` on, and of a ring that goes on after all of them have been switched off.
    """
    late = {
        f"{place_of_winch(scene, *where)} starts at {winch.start_time:g} s": winch.start_time
        for where, winch in drive.conditions.winches.items()
        if turns_ever(winch) and time < winch.start_time - AT_ONCE
    }
    told, last, end = "", float(way.times[-1]), drive.conditions.end
    if late:
        told = f"; the least drive margin is that of {time:.4g} s, before {' and '.join(late)}"
        if then is not None:
            told += f": from then on {then.margin:.4g} at {math.degrees(then.angle):.4g} deg"
    over = f"; the least drive margin ends at {end:.4g} s, when the last winch is switched off"
    return told + over * (last > end + AT_ONCE)


def _margin(drive: float, required: float) -> float:
    """-1 where nothing drives, or the ring is held."""
    if required > 0.0:
        return drive / required - 1.0
    return math.inf if drive > 0.0 else -1.0


# The static margin of a drive along a run: that of the ideal ring at the angles that it passed.


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

    Each angle counts with what is whole and on while it is passed.  What is passed after the last
    winch has been switched off does not: nobody drives there, and a margin of -1 would speak of a
    drive that has done its work.  If one of two stops, the other has to overcome all, and counts.
    Where a ring turned back between two output times is not seen.  Some margins may be ``known``,
    with their times (s).  The way must begin before the last winch is switched off.
    """
    found = []
    marks = [-math.inf, *drive.conditions.changes, math.inf]
    for begin, end in pairwise(marks):
        if end <= way.times[0] or begin > way.times[-1] or begin >= drive.conditions.end:
            continue
        now = way.between(begin, end)
        own = [(time, one) for time, one in known if begin - AT_ONCE <= time < end - AT_ONCE]
        low, high = float(now.angles.min()), float(now.angles.max())
        least = drive.least(low, high, float(now.times[0]), [one for _, one in own])
        time = now.time_at(least.angle)
        # Of a joint that sticks the margin is -1 all the time: then when that began.
        same = [(when, one) for when, one in own if one.margin <= least.margin + _SAME]
        if same and same[0][0] < time:
            time, least = same[0]
        found.append(Least(min(least.margin, MOST), time, least.angle))
    return min(found)


_SAME = 1e-9
"""Difference of two margins that is round-off."""


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
    scenes = [*((until, substituted(one)) for until, one in before), (math.inf, scene)]
    earlier = [(until, _drive(one, scene.margin)) for until, one in scenes[:-1]]
    last = DriveMargin(scene, scene.margin)
    drives = [*earlier, (math.inf, last)]
    kinds = list(dict.fromkeys(kind for _, drive in drives if drive for kind in drive.kinds))
    available, margin = np.full((2, len(times)), np.nan)
    resisting = np.full((len(kinds), len(times)), np.nan)
    begin, leasts, started = -math.inf, [], list[Least]()
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
            end = drive.conditions.end
            if begin < end:
                leasts.append(least_along(drive, way.between(begin, until), known))
            # What an earlier scene had, before a winch of the last one starts, is before its start.
            on = max(begin, drive.conditions.started, last.conditions.started)
            if on < min(until, end, way.times[-1]):
                since = [(time, one) for time, one in known if time >= on - AT_ONCE]
                started.append(least_along(drive, way.between(on, until), since))
        begin = until
    values = {"drive_available": available, "drive_resistance": resisting, "drive_margin": margin}
    reason = outcome.reason
    if leasts:
        least = min(leasts)
        reason += _still_off(scene, last, least.time, way, min(started, default=None))
        values |= {
            "least_drive_margin": np.asarray(least.margin),
            "least_drive_margin_time": np.asarray(least.time),
            "least_drive_margin_angle": np.asarray(math.degrees(least.angle)),
        }
        if len(last.conditions.winches) > 1:
            # Of a ring that was open, or stuck, before: what drove it then.
            then = min(started, default=least)
            values |= {
                "least_drive_margin_started": np.asarray(then.margin),
                "least_drive_margin_started_angle": np.asarray(math.degrees(then.angle)),
            }
    by_plane = _by_plane(outcome, drives)
    if np.isfinite(by_plane).any():
        values["least_drive_margin_plane"] = by_plane
        values["least_plane_margin"] = np.asarray(by_plane.min())
        if len(last.conditions.winches) > 1:
            later = _by_plane(outcome, drives, last.conditions.started)
            later = later if np.isfinite(later).any() else by_plane
            values["least_plane_margin_started"] = np.asarray(np.fmin.reduce(later))
    return replace(
        outcome,
        reason=reason,
        values=outcome.values | values,
        coordinates=outcome.coordinates | {"resistance": np.array(kinds, dtype=str)},
    )


def _drive(scene: Scene, standard: MarginStandard) -> DriveMargin | None:
    """None of a scene whose winches pulled with any force: it had no margin."""
    try:
        return DriveMargin(scene, standard)
    except InputError:
        return None


def _by_plane(
    outcome: Outcome, drives: Sequence[tuple[float, DriveMargin | None]], since: float = -math.inf
) -> Array:
    """The least margin of each plane at the mean angles of its own V-joints, from ``since`` (s)
    until it has locked, shape (planes,), of drives each until a time (s); NaN unless there are
    are cables in two planes, and of a plane that had locked before.
    """
    opening = outcome.values["opening_angle"]
    locks = outcome.values.get("lock_time", np.full(opening.shape[:2], math.nan)).max(axis=1)
    found = np.full(len(opening), math.nan)
    for plane, lock in enumerate(locks.tolist()):
        way = passed(outcome.coordinates["time"], opening[[plane]], lock)
        begin = -math.inf
        for until, drive in drives:
            on = max(begin, since)
            inside = len(way.times) and on <= way.times[-1] and until > max(way.times[0], since)
            two = drive is not None and len(drive.drive.cables) == 2
            if drive is not None and two and inside and on < drive.conditions.end:
                least = least_along(PlaneMargin(drive, plane), way.between(on, until))
                found[plane] = np.fmin(found[plane], least.margin)
            begin = until
    return found


# The margin of one plane's drive, were it to carry half of all that resists.
#
# Rigid rods make both planes one mechanism, in which either winch may drive both.  Elastic rods let
# a plane with less drive lag behind.


class PlaneMargin(DriveMargin):
    """Of the plane 0 (upper) or 1 (lower) of a scene with cables in both.

    With Q_p what the cable of the plane p gives, Q_o the other's, L what loads and springs give,
    Q = Q_p + Q_o + L, and R what all resistances ask for, with a standard's factors,

        margin_p = (Q_p + L / 2) / (R / 2) - 1 = (Q + Q_p - Q_o) / R - 1,

    so that the mean of both planes is the margin of the whole.
    """

    def __init__(self, whole: DriveMargin, plane: int) -> None:
        vars(self).update(vars(whole))
        self.whole, self._plane = whole, plane

    def at(self, angle: float, time: float = 0.0) -> Margin:
        """See ``DriveMargin``; what drives is that of the plane."""
        whole = self.whole.at(angle, time)
        ideal, factored = whole.pulls[:, self._plane] - whole.pulls[:, 1 - self._plane]
        half = {source: 0.5 * force for source, force in whole.driving.items()}
        half[CABLES] += 0.5 * float(ideal)
        held = self.conditions.at(time).switches.hold
        if held or whole.required == 0.0 or not math.isfinite(whole.margin):
            return whole._replace(driving=half)
        margin = whole.margin + float(factored) / whole.required
        return whole._replace(driving=half, margin=margin)
