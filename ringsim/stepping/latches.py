"""Which V-joints their latches hold, and how fast they met them."""

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.faults.failed_latch import FailedLatch
from ringsim.parts.persection import spread
from ringsim.stepping.instant import Array, Instant
from ringsim.stepping.locks import crossing
from ringsim.stepping.memory import Remembering

Flags = NDArray[np.bool_]
"""A truth for each V-joint."""
ON_STOP = 1e-9
"""Angle past 180 deg at which a stop has hardly begun to push, rad."""


class Meeting(NamedTuple):
    """A V-joint, (plane, section), comes to 180 deg at a time (s) and an opening rate (rad/s)."""

    place: tuple[int, int]
    time: float
    rate: float


class History(NamedTuple):
    """Opening rate (rad/s) at which each V-joint first came to 180 deg, and when (s) its latch
    caught, both of shape (planes, sections); NaN if that did not happen.
    """

    rates: Array
    caught_at: Array


class Latches(Remembering):
    """The latches of a scene; ``caught`` is whether each holds, shape (planes, sections).

    ``deployed`` are everywhere the V-joints that have reached 180 deg, of the same shape.
    """

    changing = ("caught", "_past")

    def __init__(self, scene: Any) -> None:
        shape = len(scene.structure.planes), scene.structure.sections
        self.caught = np.zeros(shape, dtype=bool)
        self._present = scene.stop is not None and scene.stop.latch
        least = spread(0.0 if scene.latch is None else scene.latch.min_rate, shape[1])
        self._least = np.broadcast_to(np.where(least > 0.0, least, -math.inf), shape)
        self._fails = np.full(shape, math.inf)
        for fault in (one for one in scene.faults if isinstance(one, FailedLatch)):
            place = scene.structure.planes.index(fault.plane), fault.section - 1
            self._fails[place] = min(self._fails[place], fault.time)
        self._past: list[Instant] = []
        self._sure = not (np.isfinite(self._least).any() or np.isfinite(self._fails).any())

    def missing(self, deployed: Flags) -> Flags:
        """V-joints that have come to their latches, which have not caught."""
        return deployed & ~self.caught & self._present

    def locked(self, deployed: Flags) -> Flags:
        """V-joints that have locked: that their latches hold; without latches the deployed ones."""
        return self.caught if self._present else deployed

    def note(self, before: Instant, now: Instant) -> None:
        """Go on by a step."""
        if not self._present:
            return
        if self._sure:
            self.caught = self.caught | (now.angles >= math.pi)
            return
        known = [*self._past, before, now]
        self._past = known[-3:-1]
        times = np.array([each.time for each in known])
        angles, rates = (np.array([getattr(one, k) for one in known]) for k in ("angles", "rates"))
        self.meet(one for one in meetings(times, angles, rates) if one.time > before.time)

    def meet(self, met: Iterable[Meeting]) -> None:
        """Let those catch that can, of meetings in the order of their times."""
        for place, time, rate in met:
            if self._present and rate >= self._least[place] and time < self._fails[place]:
                self.caught[place] = True


def history(scene: Any, times: Array, angles: Array, rates: Array) -> History:
    """What became of the latches of a scene in a run; see ``meetings``."""
    latches, found = Latches(scene), History(*np.full((2, *angles.shape[1:]), np.nan))
    for one in meetings(times, angles, rates):
        if np.isnan(found.rates[one.place]):
            found.rates[one.place] = one.rate
        latches.meet([one])
        if latches.caught[one.place] and np.isnan(found.caught_at[one.place]):
            found.caught_at[one.place] = one.time
    return found


def meetings(times: Array, angles: Array, rates: Array) -> Iterator[Meeting]:
    """Every arrival at 180 deg, of angles (rad) and rates (rad/s) of shape (n, planes, sections) at
    times (s).

    The step that meets a stop brakes, so that the rate is that of its begin, with the acceleration
    of the steps before over the angle that is left; unless it ends on the stop, whose rate is then
    that of its end.
    """
    past = angles - math.pi
    for step, plane, section in np.argwhere((past[:-1] < 0.0) & (past[1:] >= 0.0)).tolist():
        ends, place = slice(step, step + 2), (plane, section)
        own, speed = past[:, plane, section], rates[:, plane, section]
        time = crossing(times[ends], own[ends], speed[ends])
        if own[step + 1] < ON_STOP:
            met = max(float(speed[step + 1]), 0.0)
        else:
            bend = _acceleration(times, own, speed, step)
            met = math.sqrt(max(max(speed[step], 0.0) ** 2 - 2.0 * bend * own[step], 0.0))
        yield Meeting(place, time, met)


def _acceleration(times: Array, past: Array, rates: Array, step: int) -> float:
    """That of the two steps before, the smaller one; none where they differ in sign, or one touched
    the stop.

    A lock of another joint jerks all rates within one step: foretold from that step alone, rates
    of coarse runs were off by half, or negative.
    """
    if step < 2 or (past[step - 2 : step] >= 0.0).any():
        return 0.0
    one, two = np.diff(rates[step - 2 : step + 1]) / np.diff(times[step - 2 : step + 1])
    return float(min(one, two, key=abs)) if one * two > 0.0 else 0.0
