"""Which V-joints have reached their stops, when, and how steps should meet them."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ringsim.hermite import first_zero
from ringsim.stepping.instant import Array, Instant
from ringsim.stepping.memory import Remembering
from ringsim.variables import PLANES, Fate

if TYPE_CHECKING:
    from ringsim.stepping.latches import Latches

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
        self.deployed |= angles >= math.pi
        self.stowed |= self._away & (angles <= self._stowed_angle)
        off = angles > self._stowed_angle + _NEAR
        self._away |= off
        if self.reached is Fate.FOLDED and off.all():
            self.reached, self.stowed = Fate.NONE, np.zeros_like(self.stowed)
        elif self.reached is not Fate.FOLDED and self.stowed.all():
            self.reached, self.deployed = Fate.FOLDED, np.zeros_like(self.deployed)
        elif self.reached is Fate.NONE and self.deployed.all():
            self.reached = Fate.DEPLOYED

    def latch(self, before: Instant, now: Instant) -> None:
        """Let latches catch in a step."""
        if self._latches is not None:
            self._latches.note(before, now)

    def shorter(self, before: Instant, found: Instant, least: float) -> float | None:
        """A smaller step (s) in whose end the last V-joint of a plane locks, if a winch acts on
        that and this step goes on for long behind it; else None.  None is below ``least`` (s).
        """
        step, ends = found.time - before.time, (before, found)
        times, angles, rates = (
            np.array([getattr(one, name) for one in ends]) for name in ("time", "angles", "rates")
        )
        wanted = []
        for row in self._acted_on:
            left = ~self.deployed[row]
            if left.any() and (found.angles[row, left] >= math.pi).all():
                locked = lock_times(times, angles[:, [row]], rates[:, [row]])[0, left]
                wanted.append(float(np.fmax.reduce(locked)) - before.time)
        # The first of two planes leaves its step to the other.
        ending = max(min(wanted, default=step) * (1.0 + 0.5 * _LATE), least)
        return ending if step - ending > 0.5 * _LATE * step else None

    @property
    def unlatched(self) -> bool:
        """Whether all V-joints have reached 180 deg, and latches of some have not caught."""
        missing = None if self._latches is None else self._latches.missing(self.deployed)
        return missing is not None and bool(self.deployed.all() and missing.any())

    def ahead(self, angles: Array, moved: Array) -> Array:
        """Way (rad) to the stop in the direction of each V-joint's motion; infinite behind it."""
        way = np.where(moved > 0.0, math.pi - angles, angles - self._stowed_angle)
        there = np.where(moved > 0.0, self.deployed, self.stowed | ~self._away) | (moved == 0.0)
        return np.where(there, math.inf, way)

    def overrun(self, now: Instant) -> Overrun:
        """The V-joint that is farthest past its stop; 0 where there are none."""
        if not self.stops:
            return Overrun()
        past: Array = np.maximum(now.angles - math.pi, self._stowed_angle - now.angles)
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
        more = f" and {len(open_) - _NAMED} more" if len(open_) > _NAMED else ""
        return f"{count}, not {', '.join(open_[:_NAMED])}{more}"

    def contact(self, now: Instant) -> StopContact:
        """V-joints that are about to meet a stop, and those that rest on one.

        Those that came to 180 deg and that no latch holds may come there again.
        """
        angles, rates, low, high = now.angles, now.rates, self._stowed_angle, math.pi
        away = ~self.deployed
        if self._latches is not None:
            away |= self._latches.missing(self.deployed) & (angles <= high - _NEAR)
        folding = (rates < 0.0) & self._away & ~self.stowed & (angles > low)
        waiting, opening = np.full(rates.shape, math.inf), (rates > 0.0) & away
        np.divide(high - angles, rates, out=waiting, where=opening)
        np.divide(low - angles, rates, out=waiting, where=folding)
        first = int(waiting.argmin())
        resting = self.deployed & (angles > high - _NEAR)
        if self.stops:
            resting |= (self.stowed & (angles < low + _NEAR)) | (angles < low)
        return StopContact(
            time_to_next=float(waiting.flat[first]),
            rate_of_next=abs(float(rates.flat[first])),
            resting_rate=float(np.abs(rates[resting]).max()) if resting.any() else 0.0,
        )


def locks_of(scene: Any, angles: Array, latches: "Latches") -> Locks | None:
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
