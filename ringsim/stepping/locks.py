"""V-joints that reach their stops: when, how latches take them, how steps meet them."""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.hermite import first_zero
from ringsim.parts.laws import Switches
from ringsim.stepping.instant import Array, Instant, Remembering
from ringsim.units import spread
from ringsim.variables import PLANES, Fate

if TYPE_CHECKING:
    from ringsim.scene import Scene

# Which V-joints have reached their stops, when, and how steps should meet them.


_NEAR = 0.1
"""A V-joint that has reached a stop counts as resting on it within this angle of it, rad."""
_APART = 1e-3
"""A V-joint that starts closer to the stowed stop than this has not come to it, rad; the stop of
``ring18`` gives 4e-5 under its load."""

_LATE = 0.04
"""Share of a step by which a plane may have locked before its end, where winches act on that."""

_NAMED = 6
"""V-joints that a sentence names at most."""


class Overrun(NamedTuple):
    """How far a V-joint is past its stop (rad), which one, and when (s)."""

    angle: float = 0.0
    joint: str = ""
    time: float = 0.0


class StopContact(NamedTuple):
    """Time (s) until the first free V-joint meets a stop at its present rate, and that rate
    (rad/s); the largest rate of a V-joint that has locked and is near its stop.
    """

    time_to_next: float = math.inf
    rate_of_next: float = 0.0
    resting_rate: float = 0.0


class Locks(Remembering):
    """The V-joints' memory of their stops.

    ``deployed`` and ``stowed`` are whether each V-joint has reached 180 deg, and the stowed stop,
    shape (planes, sections), even if it has bounced since.  One that starts on the stowed stop has
    to leave it before it can come back.  ``reached`` is the stop that all have reached last: where
    all come to one, none counts as having reached the other any more.
    """

    changing = ("deployed", "stowed", "reached", "_away")

    def __init__(
        self, angles: Array, stowed_angle: float | None, planes: Sequence[str] = PLANES,
        latches: "Latches | None" = None, acted_on: Iterable[int] = (),
    ) -> None:  # fmt: skip
        """Begin with these opening angles (rad); the stowed stop's is None without stops.

        ``planes`` are the names by which sentences call the rows of the angles, ``latches`` what
        shall hold the V-joints at 180 deg; in the rows ``acted_on`` winches do something else once
        all have locked.
        """
        self._planes, self._latches, self._acted_on = planes, latches, tuple(acted_on)
        self.stops = stowed_angle is not None
        self._stowed_angle = stowed_angle or 0.0
        self.deployed, self.stowed = np.zeros((2, *angles.shape), dtype=bool)
        self._away = angles > self._stowed_angle + _APART
        self.reached = Fate.NONE

    def note(self, angles: Array) -> None:
        """Remember the joints that have reached a stop; opening angles in rad."""
        low, stop = float(angles.min()), self._stowed_angle
        if angles.max() >= math.pi:
            self.deployed |= angles >= math.pi
        if low <= stop:
            self.stowed |= self._away & (angles <= stop)
        self._away |= angles > stop + _NEAR
        if self.reached is Fate.FOLDED and low > stop + _NEAR:
            self.reached, self.stowed = Fate.NONE, np.zeros_like(self.stowed)
        elif self.reached is not Fate.FOLDED and low <= stop and self.stowed.all():
            self.reached, self.deployed = Fate.FOLDED, np.zeros_like(self.deployed)
        elif self.reached is Fate.NONE and self.deployed.all():
            self.reached = Fate.DEPLOYED

    def latch(self, before: Instant, now: Instant) -> None:
        """Let latches catch in a step."""
        if self._latches is not None:
            self._latches.note(before, now)

    def shorter(self, before: Instant, found: Instant, least: float) -> float | None:
        """A smaller step (s) in whose end the last V-joint of a plane locks, if a winch acts on
        that and this step goes on for long behind it; or one that leads towards a latch of which
        this one leaves open whether it catches; else None.  None is below ``least`` (s).
        """
        if not found.angles.max() >= math.pi:
            return None
        step, wanted = found.time - before.time, list[float]()
        for row in self._acted_on:
            there = found.angles[row] >= math.pi
            if (self.deployed[row] | there).all() and not self.deployed[row].all():
                times, angles, rates = (
                    np.array([getattr(one, name) for one in (before, found)])
                    for name in ("time", "angles", "rates")
                )
                locked = lock_times(times, angles[:, [row]], rates[:, [row]])[0]
                left = np.where(self.deployed[row], np.nan, locked)
                wanted.append(float(np.fmax.reduce(left)) - before.time)
        # The first of two planes leaves its step to the other.
        ending = max(min(wanted, default=step) * (1.0 + 0.5 * _LATE), least)
        if self._latches is not None:
            # Half-way to it: rates that are read nearer to the stop are surer.
            open_ = self._latches.undecided(before, found) - before.time
            ending = min(ending, max(0.5 * open_, least))
        return ending if step - ending > 0.5 * _LATE * step else None

    @property
    def unlatched(self) -> bool:
        """Whether all V-joints have reached 180 deg, and latches of some have not caught."""
        latches = self._latches if self.deployed.all() else None
        return latches is not None and bool(latches.missing(self.deployed).any())

    def ahead(self, angles: Array, moved: Array) -> Array:
        """Way (rad) to the stop in the direction of each V-joint's motion; infinite behind it."""
        way = np.where(moved > 0.0, math.pi - angles, angles - self._stowed_angle)
        there = np.where(moved > 0.0, self.deployed, self.stowed | ~self._away) | (moved == 0.0)
        return np.where(there, math.inf, way)

    def overrun(self, now: Instant) -> Overrun:
        """The V-joint that is farthest past its stop; 0 where there are none."""
        low, high = self._stowed_angle, math.pi
        if not self.stops or (now.angles.max() <= high and now.angles.min() >= low):
            return Overrun()
        past: Array = np.maximum(now.angles - high, low - now.angles)
        plane, section = divmod(int(past.argmax()), past.shape[1])
        return Overrun(float(past[plane, section]), self._name(plane, section), now.time)

    def _name(self, plane: int, section: int) -> str:
        """A V-joint by its place, both from 0: "upper 3"."""
        return f"{self._planes[plane]} {section + 1}"

    def missing(self) -> str:
        """How many V-joints have locked, or only come to their latches, and which have not."""
        open_ = [self._name(*place) for place in np.argwhere(~self.deployed)]
        word = "at 180 deg" if self.unlatched else "locked"
        count = f"{int(self.deployed.sum())} of {self.deployed.size} V-joints {word}"
        if not open_ or len(open_) == self.deployed.size:
            return count
        none = np.flatnonzero(~self.deployed.any(axis=1)).tolist()
        if len(none) == 1 and self.deployed.sum() == self.deployed.size - self.deployed.shape[1]:
            return f"{count}, none of the {self._planes[none[0]]} plane"
        more = f" and {len(open_) - _NAMED} more" if len(open_) > _NAMED else ""
        return f"{count}, not {', '.join(open_[:_NAMED])}{more}"

    def contact(self, now: Instant) -> StopContact:
        """V-joints that are about to meet a stop, and those that rest on one.

        Those that came to 180 deg and that no latch holds may come there again.
        """
        angles, rates, low, high = now.angles, now.rates, self._stowed_angle, math.pi
        ahead, some = rates > 0.0, bool(self.deployed.any())
        if some:
            away = ~self.deployed
            if self._latches is not None:
                away |= self._latches.missing(self.deployed) & (angles <= high - _NEAR)
            ahead &= away
        waiting = np.full(rates.shape, math.inf)
        np.divide(high - angles, rates, out=waiting, where=ahead)
        if rates.min() < 0.0:
            folding = (rates < 0.0) & self._away & ~self.stowed & (angles > low)
            np.divide(low - angles, rates, out=waiting, where=folding)
        first = int(waiting.argmin())
        time_to_next, rate_of_next = float(waiting.flat[first]), abs(float(rates.flat[first]))
        # Most of a run no V-joint is anywhere near a stop that it has reached.
        if not some and angles.min() >= low + _NEAR:
            return StopContact(time_to_next, rate_of_next)
        resting = self.deployed & (angles > high - _NEAR)
        if self.stops:
            resting |= (self.stowed & (angles < low + _NEAR)) | (angles < low)
        speed = float(np.abs(rates[resting]).max()) if resting.any() else 0.0
        return StopContact(time_to_next, rate_of_next, speed)


def locks_of(scene: "Scene", angles: Array, latches: "Latches") -> Locks | None:
    """Those of a scene that begins with these opening angles (rad); None if none lock."""
    structure, cables = scene.structure, () if scene.cables is None else scene.cables.present()
    if not structure.locks:
        return None
    stowed = None if scene.stop is None else math.radians(scene.stop.stowed_angle)
    acted_on = [
        plane for plane, cable in cables if any(w.after_lock != "pull" for w in cable.winches)
    ]
    return Locks(angles, stowed, structure.planes, latches, acted_on)


def lock_times(times: Array, angles: Array, rates: Array) -> Array:
    """First time at which each V-joint reaches 180 deg, shape (planes, sections), s; NaN if never.

    The crossing is the root of the cubic that fits angles (rad) and rates (rad/s), both of shape
    (n, planes, sections), at both ends of the step.
    """
    found = np.full(angles.shape[1:], np.nan)
    for place in np.ndindex(*found.shape):
        past = angles[(slice(None), *place)] - math.pi
        first = int(np.argmax(past >= 0.0))
        if first == 0:
            continue
        ends = slice(first - 1, first + 1)
        found[place] = crossing(times[ends], past[ends], rates[(ends, *place)])
    return found


def crossing(times: Array, past: Array, rates: Array) -> float:
    """Time (s) at which an angle past 180 deg (rad) passes zero in a step."""
    return float(times[0]) + first_zero(float(times[1] - times[0]), past, rates)


# Which V-joints their latches hold, and how fast they met them.


Flags = NDArray[np.bool_]
"""A truth for each V-joint."""
ON_STOP = 1e-9
"""Angle past 180 deg at which a stop has hardly begun to push, rad."""


SURE = 0.05
"""Uncertain share of a latch's rate from which on it is told."""
UNKNOWN = 0.2
"""Uncertain share of a rate from which on it may be several times larger: in a slow flight of rods
of 8 m one of 0.23 was 0.050 rad/s instead of 0.155.  Rates are never so much too large, since
joints open ever faster towards their stops."""
_DOUBTFUL, _SEVERAL = 2.5, 5.0
"""Factor between a rate and the least that a latch asks for, within which a lock, or a rate whose
share beyond ``UNKNOWN`` is uncertain, may decide: of these one was 3.9 times as large."""


def may_decide(met: Any, unsure: Any, asked: Any, *, driven: Any) -> Any:
    """Whether steps decide that a latch catches or does not, which asks for a rate, at rates that
    were ``met`` (rad/s) and of which such a share is uncertain; ``driven`` is whether another joint
    locked before in the same step, long enough for its jerk to arrive.
    """
    several = np.maximum(_SEVERAL, 1.0 / np.maximum(1.0 - unsure, 1e-9))
    larger = np.where(unsure > UNKNOWN, several, 1.0 + 2.0 * unsure * (unsure > SURE))
    down = np.where(driven, _DOUBTFUL, np.minimum(larger, _DOUBTFUL))
    up = np.where(driven, np.maximum(larger, _DOUBTFUL), larger)
    # What is nothing may be anything where it is not known.
    unknown = (met <= 0.0) & (unsure > UNKNOWN) & (asked > 0.0)
    return unknown | ((met < down * asked) & (asked < up * met))


class Meeting(NamedTuple):
    """A V-joint, (plane, section), comes to 180 deg at a time (s) and an opening rate (rad/s), of
    which such a share is uncertain.
    """

    place: tuple[int, int]
    time: float
    rate: float
    unsure: float


class History(NamedTuple):
    """Opening rate (rad/s) at which each V-joint first came to 180 deg, when (s) its latch caught,
    and which share of the rate is uncertain, all of shape (planes, sections); NaN if that did not
    happen.
    """

    rates: Array
    caught_at: Array
    unsure: Array


class Latches(Remembering):
    """The latches of a scene; ``caught`` is whether each holds, shape (planes, sections).

    ``deployed`` are everywhere the V-joints that have reached 180 deg, of the same shape.
    """

    changing = ("caught", "_past")

    def __init__(self, scene: "Scene") -> None:
        shape = len(scene.structure.planes), scene.structure.sections
        self.caught = np.zeros(shape, dtype=bool)
        self._present = scene.stop is not None and scene.stop.latch
        least = spread(0.0 if scene.latch is None else scene.latch.min_rate, shape[1])
        self._least = np.broadcast_to(np.where(least > 0.0, least, -math.inf), shape)
        self._fails = np.full(shape, math.inf)
        for fault in scene.faults:
            if (place := fault.unlatches(scene.structure.planes)) is not None:
                self._fails[place] = min(self._fails[place], fault.time)
        self._past: list[Instant] = []
        self._sure = not (np.isfinite(self._least).any() or np.isfinite(self._fails).any())

    def missing(self, deployed: Flags) -> Flags:
        """V-joints that have come to their latches, which have not caught."""
        return deployed & ~self.caught & self._present

    def locked(self, deployed: Flags) -> Flags:
        """V-joints that have locked: that their latches hold; without latches the deployed ones."""
        return self.caught if self._present else deployed

    def hold(self, switches: Switches) -> None:
        """Let stops hold the V-joints that have caught, from both sides from now on."""
        if self._present:
            for law in switches.of_group("stop"):
                np.copyto(switches.setting[law], 1.0, where=self.caught.ravel())

    def note(self, before: Instant, now: Instant) -> None:
        """Go on by a step."""
        if not self._present:
            return
        if self._sure:
            self.caught = self.caught | (now.angles >= math.pi)
            return
        self.meet(self._met(before, now))
        self._past = [*self._past, before][-2:]

    def _met(self, before: Instant, now: Instant) -> list[Meeting]:
        """The arrivals of a step."""
        known = [*self._past, before, now]
        times = np.array([each.time for each in known])
        angles, rates = (np.array([getattr(one, k) for one in known]) for k in ("angles", "rates"))
        return [one for one in meetings(times, angles, rates) if one.time > before.time]

    def undecided(self, before: Instant, now: Instant) -> float:
        """When (s) the first V-joint comes to a latch in a step which leaves open whether that
        catches; infinite if all is clear.
        """
        if self._sure or not self._present:
            return math.inf
        met = self._met(before, now)
        if not met:
            return math.inf
        # Another joint that locked before in this step may have jerked it.
        jerked = min(one.time for one in met) + _TOGETHER * (now.time - before.time)
        return min(
            (time for place, time, rate, unsure in met
             if not self.caught[place] and time < self._fails[place]
             and may_decide(rate, unsure, self._least[place], driven=time > jerked)),
            default=math.inf,
        )  # fmt: skip

    def meet(self, met: Iterable[Meeting]) -> None:
        """Let those catch that can, of meetings in the order of their times."""
        for place, time, rate, _ in met:
            if self._present and rate >= self._least[place] and time < self._fails[place]:
                self.caught[place] = True


def history(scene: "Scene", times: Array, angles: Array, rates: Array, period: float) -> History:
    """What became of the latches of a scene in a run, with the slowest rod's ``period`` (s); see
    ``meetings`` and ``ringing``.
    """
    latches, found = Latches(scene), History(*np.full((3, *angles.shape[1:]), np.nan))
    first = np.full(angles.shape[1:], np.nan)
    for one in meetings(times, angles, rates):
        if np.isnan(found.rates[one.place]):
            found.rates[one.place], found.unsure[one.place] = one.rate, one.unsure
            first[one.place] = one.time
        latches.meet([one])
        if latches.caught[one.place] and np.isnan(found.caught_at[one.place]):
            found.caught_at[one.place] = one.time
    for plane, section in np.argwhere(found.rates > 0.0).tolist():
        at = plane, section
        own = ringing(times, rates[:, plane, section], first, float(first[at]), period)
        # It is no reason to take a rate for several times as large.
        found.unsure[at] = max(found.unsure[at], min(own / found.rates[at], UNKNOWN))
    return found


_PERIODS = 2.0
"""Periods for which a joint rings with what an earlier lock has left."""
_PHASE = 15.0
"""Error of a vibration over itself and the square of steps in its period: in one steps of second
order lose (2 pi)^3 / 12 (h / T)^2 = 21 (h / T)^2 of its phase.  On frames of 12 scenes at their own
tolerance, 0.3 and 0.1 of it, what is told of rates rises by it from 49 of the 78 that are off by
more than 5 % to 70, and from 64 of the 870 others to 85; 21 tells 70 and 99.  Of 11 other scenes
71 of 85 are told, 45 without it, and 80 of 677 others (benchmarks/latch_rates.py)."""


def ringing(times: Array, rates: Array, locks: Array, lock: float, period: float) -> float:
    """About how far (rad/s) steps put the rate off that a joint has at its lock (s), since they are
    too long for what earlier ``locks`` (s) have left of vibrations of the slowest rod's period.

    Of a pure sine it is a third (half a period after the lock) to nine tenths of the largest error
    (two periods after): the straight line that is taken off holds some of it, and ``_PHASE`` is
    fitted to warn of what is off by more than ``SURE``, and no bound.
    """
    earliest = lock - _PERIODS * period
    before = locks[(locks >= earliest) & (locks < lock - 0.25 * period)]
    if not before.size:
        return 0.0
    first, last = np.searchsorted(times, [before.min(), lock])
    if last - first < 4:  # where so few steps are, rates that are carried on differ
        return 0.0
    since = times[first:last] - times[first:last].mean()
    swing = rates[first:last] - rates[first:last].mean()
    swing -= since * (since @ swing) / (since @ since)
    size = math.sqrt(2.0 * float(swing @ swing) / len(swing))
    share = _PHASE * (float(np.diff(times[first:last]).max()) / period) ** 2
    return size * share


def meetings(times: Array, angles: Array, rates: Array) -> Iterator[Meeting]:
    """Every arrival at 180 deg, of angles (rad) and rates (rad/s) of shape (n, planes, sections) at
    times (s).

    The step that meets a stop brakes, so that the rate is carried on from its begin; unless it ends
    on the stop, whose rate is then that of its end.
    """
    past, found = angles - math.pi, list[tuple[int, float, tuple[int, int]]]()
    for step, plane, section in np.argwhere((past[:-1] < 0.0) & (past[1:] >= 0.0)).tolist():
        ends, at = slice(step, step + 2), (plane, section)
        time = crossing(times[ends], past[(ends, *at)], rates[(ends, *at)])
        found.append((step, time, at))
    steps = [step for step, _, _ in found]
    for step, time, place in found:
        own, speed = past[(slice(None), *place)], rates[(slice(None), *place)]
        if own[step + 1] < ON_STOP:
            yield Meeting(place, time, max(float(speed[step + 1]), 0.0), 0.0)
            continue
        before = time - _TOGETHER * (times[step + 1] - times[step])
        lately = found[bisect_left(steps, step - 2) : bisect_right(steps, step)]
        jerked = any(when < before for _, when, _ in lately)
        rate, unsure = _carried(times, own, speed, step, jerked=jerked)
        # A stop only brakes: the joint came at least as fast as it goes on, and at an even
        # acceleration as fast as it must have to be there by then.
        fast, way = float(speed[step + 1]), time - float(times[step])
        if rate == 0.0 < way:  # it came, so that it moved: on the mean of the step as fast as this
            rate, unsure = -float(own[step]) / way, 1.0
        if way > 0.0:  # a joint may be there within rounding
            fast = max(fast, -2.0 * float(own[step]) / way - float(speed[step]))
        yield Meeting(place, time, rate, max(unsure, 1.0 - rate / fast) if fast > 0.0 else unsure)


_TOGETHER = 0.05
"""Share of a step within which two joints lock together: none has jerked the other before."""


def _carried(
    times: Array, past: Array, rates: Array, step: int, *, jerked: bool
) -> tuple[float, float]:
    """Rate (rad/s) that a joint has on its stop, carried on from the begin of a step, and the share
    of it that is uncertain; ``jerked`` is whether another joint has locked within three steps.

    v^2 = v0^2 + 2 a s, with the acceleration a of the step before; of a jerked joint with the
    smaller one of two, since a jerk does not go on (rates were off by half, or negative), and none
    where they differ in sign or one touched the stop.  The uncertain share is by what these differ
    from one another, and from a parabola of v^2 over the angle.
    """
    start, left = max(float(rates[step]), 0.0), -float(past[step])
    if step < 2 or (past[step - 2 : step] >= 0.0).any():
        return start, 1.0
    speeds, places = rates[step - 2 : step + 1], past[step - 2 : step + 1]
    one, two = np.diff(speeds) / np.diff(times[step - 2 : step + 1])
    steady = one * two > 0.0
    bends = float(min(one, two, key=abs)) if steady else 0.0, float(two)
    ends = [max(start**2 + 2.0 * bend * left, 0.0) ** 0.5 for bend in bends]
    rate, found = (ends[1] if steady and not jerked else ends[0]), list(ends)
    ways, squares = np.diff(places), np.sign(speeds) * speeds**2
    if ways.all() and ways.sum():
        first, second = np.diff(squares) / ways
        curved = left * (left + ways[1]) * (second - first) / ways.sum()
        found.append(max(float(squares[2] + left * second + curved), 0.0) ** 0.5)
    return rate, (max(found) - min(found)) / max(found) if any(found) else 1.0
