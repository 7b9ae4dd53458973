"""What faults and switched winches leave of a drive on a ring of rigid rods, over the time."""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from ringsim.cable.faults.family import CableFault
from ringsim.cable.records import Winch
from ringsim.cable.ropes import Ropes
from ringsim.layout.pose import Array
from ringsim.parts.faults.failed_latch import FailedLatch
from ringsim.parts.faults.failed_spring import FailedSpring
from ringsim.parts.faults.family import AT_ONCE, Fault
from ringsim.parts.faults.stuck_vjoint import StuckVJoint
from ringsim.scene import Scene

Place = tuple[int, int]
"""Cable, of those that there are, and end of its path, both from 0."""


class Condition(NamedTuple):
    """A drive at one instant.

    ``reach`` has, of the winches that are on, 1 for the spans that their rope runs to and else 0,
    shape (spans,); ``sprung`` is 1 where the spring of a V-joint is whole, shape (planes,
    sections); a V-joint that is ``stuck`` holds all of rigid rods.
    """

    reach: dict[Place, Array]
    sprung: Array
    stuck: bool


class Conditions:
    """All of a scene, whose paths have so many ``points``.

    A jammed pulley holds the rope: what is behind it, seen from a winch, gets slack as the ring
    opens.  A span that parts takes the tension of its rope, up to the next jam.
    """

    def __init__(self, scene: Scene, points: tuple[int, ...]) -> None:
        self._structure, self._points = scene.structure, points
        self._faults = sorted(scene.faults, key=lambda fault: fault.time)
        cables = [] if scene.cables is None else [cable for _, cable in scene.cables.present()]
        self.winches: dict[Place, Winch] = {
            (number, end): winch
            for number, cable in enumerate(cables)
            for end, winch in enumerate(cable.winches)
        }
        self._known: dict[tuple[int, tuple[Place, ...]], Condition] = {}

    @cached_property
    def begin(self) -> float:
        """When the first winch starts, s; nothing is to be driven before."""
        starts = [winch.start_time for winch in self.winches.values() if turns_ever(winch)]
        return min(starts, default=0.0)

    @cached_property
    def changes(self) -> list[float]:
        """Times (s) at which anything changes."""
        found = {fault.time for fault in self._faults if fault.time > AT_ONCE}
        for winch in filter(turns_ever, self.winches.values()):
            switched = {winch.start_time, winch.stop_time} - {None, self.begin}
            found |= {time for time in switched if time is not None}
        return sorted(found)

    def at(self, time: float) -> Condition:
        """At a time (s): of faults those that have struck; of winches those that are on, or that
        will be at the ``begin``.
        """
        struck = sum(fault.time <= time + AT_ONCE for fault in self._faults)
        clock = max(time + AT_ONCE, self.begin)
        on = tuple(place for place, winch in self.winches.items() if winch.turns(clock))
        if (struck, on) not in self._known:
            self._known[struck, on] = self._after(self._faults[:struck], on)
        return self._known[struck, on]

    def _after(self, faults: list[Fault], on: tuple[Place, ...]) -> Condition:
        sprung = np.ones((len(self._structure.planes), self._structure.sections))
        ropes = _whole(self._points)
        for fault in faults:
            if isinstance(fault, FailedSpring):
                sprung[self._structure.planes.index(fault.plane), fault.section - 1] = 0.0
            elif isinstance(fault, CableFault):
                none = np.zeros(ropes.spans), np.zeros((len(self._points), 2))
                ropes = fault.change(ropes, *none)
        reach = {}
        for number, end in on:
            rope = ropes.of_end[number, end]
            own = slice(*ropes.cable_starts[number : number + 2])
            reach[number, end] = 1.0 * (ropes.alive[rope] & (ropes.of_span[own] == rope))
        return Condition(reach, sprung, any(isinstance(fault, StuckVJoint) for fault in faults))


def turns_ever(winch: Winch) -> bool:
    """Whether a winch is ever switched on."""
    return winch.start_time != winch.stop_time


def changes_drive(fault: Fault) -> bool:
    """Whether a fault takes anything from the drive of a ring, as far as the margin knows."""
    return isinstance(fault, (CableFault, FailedSpring, StuckVJoint))


def is_unknown(fault: Fault) -> bool:
    """Whether the margin of a drive does not know what a fault does."""
    return not changes_drive(fault) and not isinstance(fault, FailedLatch)


def told(fault: Fault) -> str:
    """What the margin of a drive makes of a fault."""
    if isinstance(fault, StuckVJoint):
        return "with rigid rods it holds the whole ring: margin -1"
    if isinstance(fault, FailedLatch):
        return "changes nothing: its pawl is lifted all the same"
    return "counted" if changes_drive(fault) else "NOT counted: the margin does not know it"


def _whole(points: tuple[int, ...]) -> Ropes:
    """A rope for each cable, of no matter what length."""
    spans = np.asarray(points, dtype=np.intp) - 1
    starts = np.cumsum(spans, dtype=np.intp) - spans
    return Ropes(points, starts, np.zeros(len(points)), np.ones(len(points), dtype=bool))
