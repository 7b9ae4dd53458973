"""What faults and switched winches leave of a drive on a ring of rigid rods, over the time."""

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np

from ringsim.cable.friction import (
    LEAST_TENSION,
    MOST_SOLVED,
    SOLVED,
    UNSOLVED,
    PulleyFriction,
    Pulleys,
)
from ringsim.cable.records import Cable, Winch, why_unlimited
from ringsim.cable.ropes import Ropes
from ringsim.layout.bodies import Array
from ringsim.parts.faults import AT_ONCE, Fault, Struck
from ringsim.parts.laws import AngleLaw, Switches
from ringsim.refusal import InputError
from ringsim.rigid.mechanism import Configuration, Mechanism
from ringsim.scene import Scene

# What faults and switched winches leave of a drive on a ring of rigid rods, over the time.


Place = tuple[int, int]
"""Cable, of those that there are, and end of its path, both from 0."""


class Condition(NamedTuple):
    """A drive at one instant.

    ``reach`` has, of the winches that are on, 1 for the spans that their rope runs to and else 0,
    shape (spans,); ``switches`` say which laws on V-joints act.
    """

    reach: dict[Place, Array]
    switches: Switches


class Conditions:
    """All of a scene, whose paths have so many ``points``.

    A jammed pulley holds the rope: what is behind it, seen from a winch, gets slack as the ring
    opens.  A span that parts takes the tension of its rope, up to the next jam.
    """

    def __init__(self, scene: Scene, points: tuple[int, ...], laws: Sequence[AngleLaw]) -> None:
        self._structure, self._points, self._laws = scene.structure, points, laws
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
    def started(self) -> float:
        """When the last winch starts, s."""
        starts = [winch.start_time for winch in self.winches.values() if turns_ever(winch)]
        return max(starts, default=0.0)

    @cached_property
    def end(self) -> float:
        """When the last winch is switched off, s; infinite if one never is, or there is none.

        A winch that a fault leaves without rope still turns: what has failed is not switched off.
        """
        stops = [winch.stop_time for winch in self.winches.values() if turns_ever(winch)]
        known = [stop for stop in stops if stop is not None]
        return max(known) if known and len(known) == len(stops) else math.inf

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
        ropes = self._struck(faults, switches := Switches(self._laws))
        reach = {}
        for number, end in on:
            rope = ropes.of_end[number, end]
            own = slice(*ropes.cable_starts[number : number + 2])
            reach[number, end] = 1.0 * (ropes.alive[rope] & (ropes.of_span[own] == rope))
        return Condition(reach, switches)

    def _struck(self, faults: Sequence[Fault], switches: Switches) -> Ropes:
        """The ropes after faults, which change the switches, too."""
        shape = len(self._structure.planes), self._structure.sections
        now = Struck(self._structure.planes, switches, np.full(shape, np.nan), _whole(self._points))
        for fault in faults:
            now.stored, now.wound = np.zeros(now.ropes.spans), np.zeros((len(self._points), 2))
            fault.strike(now)
        return cast(Ropes, now.ropes)

    def told(self, fault: Fault) -> str:
        """What a fault does to the margin of a ring that is whole."""
        ropes = self._struck([fault], switches := Switches(self._laws))
        if switches.hold:
            return "with rigid rods it holds the whole ring: margin -1"
        sound, whole = Switches(self._laws), _whole(self._points)
        same = all(map(np.array_equal, switches.on, sound.on)) and all(
            np.array_equal(getattr(ropes, name), getattr(whole, name))
            for name in ("starts", "alive")
        )
        return "changes nothing" if same else "counted"


def turns_ever(winch: Winch) -> bool:
    """Whether a winch is ever switched on."""
    return winch.start_time != winch.stop_time


def _whole(points: tuple[int, ...]) -> Ropes:
    """A rope for each cable, of no matter what length."""
    spans = np.asarray(points, dtype=np.intp) - 1
    starts = np.cumsum(spans, dtype=np.intp) - spans
    return Ropes(points, starts, np.zeros(len(points)), np.ones(len(points), dtype=bool))


# What drives a ring of rigid rods: its cables at the tension that their winches have.
#
# A winch that winds has its tension T at the end of its rope; over each pulley on the way the
# tension falls to the share eta.  With two winches a rope rests where both have left the same.  The
# generalised force on the opening angle is - sum T_j dL_j / d(angle): virtual work.


class Reeved(NamedTuple):
    """A cable on the ring: its spans' shortening with the opening angle (m/rad), shape (spans,);
    the angles at its pulleys (rad), shape (spans - 1,).
    """

    shortening: Array
    angles: Array


class Drive:
    """Cables of a scene, whose winches wind at all, or ``at_speed`` as commanded.

    ``conditions`` are what faults and switches leave of them.

    Raises
    ------
    InputError
        If a winch pulls with any force, so that nothing resists too much, or nothing drives.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism, *, at_speed: bool = False) -> None:
        points, self._at_speed = mechanism.points, at_speed
        self._cables = [] if scene.cables is None else scene.cables.present()
        self._paths = [points.path(number) for number in range(len(self._cables))]
        self._laws: dict[float, list[PulleyFriction]] = {}
        self.conditions = Conditions(scene, tuple(map(len, self._paths)), points.layout.angle_laws)
        reason = why_unlimited(scene.cables, scene.structure.planes)
        if reason:
            raise InputError(reason)
        if scene.cables is None and scene.loads is None and scene.hinge_spring is None:
            raise InputError(
                "cables and loads are both left out: nothing drives the ring, so that there is no "
                "margin (add [cables.upper] with a motor, or leave margin out)"
            )

    @property
    def cables(self) -> list[Cable]:
        """The cables that there are."""
        return [cable for _, cable in self._cables]

    def jammed(self, over: Sequence[Reeved], friction: float) -> dict[int, int]:
        """How many pulleys of each plane pass on no tension at so many times their friction, as
        they are ``reeved``: its law has no solution there.  Planes without any are left out.
        """
        found = {}
        for (number, cable), reeved in zip(self._cables, over, strict=True):
            law = cable.friction.factored(friction)
            none = np.zeros(len(reeved.angles))
            steps = law.bound_decay(Pulleys(reeved.angles, none, none + 1.0), cable.pulley_radius)
            if count := int(np.isneginf(steps).sum()):
                found[number] = count
        return found

    def reeved(self, now: Configuration) -> list[Reeved]:
        """All cables on a mechanism at its coordinate."""
        found = []
        for path in self._paths:
            places, slopes = now.places(path), now.velocities(path)
            along, moving = np.diff(places, axis=0), np.diff(slopes, axis=0)
            units = along / _sizes(along)[:, None]
            # The angle opens by two for one that the coordinate falls: L falls as it falls.
            shortening = 0.5 * np.einsum("ij,ij->i", units, moving)
            before, behind = units[:-1], units[1:]
            angles = 2.0 * np.arctan2(_sizes(before + behind), _sizes(behind - before))
            found.append(Reeved(shortening, angles))
        return found

    def speed(self, over: Sequence[Reeved], state: Condition) -> float:
        """Rate of the opening angle at which winches wind as commanded, rad/s; the least of all.

        ``over`` is how they are ``reeved``.  0 where they need not, or have no command: a motor
        slows down until it has the torque.  Winches that are off, or have no rope, do not count.
        """
        rates = [] if self._at_speed else [0.0]
        winches = self.conditions.winches
        for (number, _), reach in state.reach.items():
            # Winches on one rope share what the ring releases of it.
            own = [
                winches[place].winding.commanded_speed()
                for place, other in state.reach.items()
                if place[0] == number and np.array_equal(other, reach)
            ]
            if reach.any():
                released = float(reach @ over[number].shortening)
                rates.append(sum(own) / max(released, 1e-300))
        return min(rates, default=0.0)

    def pulls(
        self, state: Condition, over: Sequence[Reeved], rate: float, friction: float = 1.0,
        losses: float = 1.0,
    ) -> Array:  # fmt: skip
        """What each cable drives, N m, shape (cables,), with so many times the friction of the
        pulleys and the losses of gears and drums; ``over`` is how they are ``reeved``, ``rate``
        that of the opening angle, rad/s.
        """
        if friction not in self._laws:  # the same few factors at every angle
            self._laws[friction] = [cable.friction.factored(friction) for cable in self.cables]
        found = np.zeros(len(self._paths))
        each = zip(self.cables, self._laws[friction], over, strict=True)
        for number, (cable, law, reeved) in enumerate(each):
            tensions = np.zeros(len(reeved.shortening))
            for end, (winch, way) in enumerate(zip(cable.winches, _ways(cable), strict=True)):
                if (reach := state.reach.get((number, end))) is None:
                    continue
                pull = winch.winding.available_tension(at_speed=self._at_speed, losses=losses)
                if friction:
                    shares = _decayed(law, cable.pulley_radius, reeved, rate, pull, way)
                    reach = reach * shares
                tensions = np.maximum(tensions, pull * reach)
            found[number] = tensions @ reeved.shortening
        return found


def _sizes(vectors: Array) -> Array:
    """As ``numpy.linalg.norm``, which takes several times as long for so few."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)))


def _decayed(
    law: PulleyFriction, radius: float, reeved: Reeved, rate: float, pull: float, way: int
) -> Array:
    """Tension of the spans over the ``pull`` (N) of a winch from which they run this ``way``."""
    beyond = reeved.shortening[::way][::-1].cumsum()[::-1][1:][::way]
    shares, last = np.ones(len(reeved.shortening)), np.zeros(0)
    for _ in range(MOST_SOLVED):
        both = 0.5 * pull * (shares[:-1] + shares[1:])
        seen = Pulleys(reeved.angles, np.abs(rate * beyond), np.maximum(both, LEAST_TENSION))
        steps = law.bound_decay(seen, radius)
        shares = np.exp(np.append(0.0, np.cumsum(steps[::way])))[::way]
        if not law.loads or (len(last) and np.abs(steps - last).max(initial=0.0) < SOLVED):
            return np.asarray(shares)
        last = steps
    raise InputError(UNSOLVED)


def _ways(cable: Cable) -> tuple[int, ...]:
    """Direction from the winches along the path: 1 from its beginning, -1 from its end.

    A path begins at its first winch, wherever that stands.
    """
    return (1, -1)[: len(cable.winches)]
