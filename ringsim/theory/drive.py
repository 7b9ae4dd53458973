"""What drives a ring of rigid rods: its cables at the tension that their winches have.

A winch that winds has its tension T at the end of its rope; over each pulley on the way the
tension falls to the share eta.  With two winches a rope rests where both have left the same.  The
generalised force on the opening angle is - sum T_j dL_j / d(angle): virtual work.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ringsim.cable.friction.family import PulleyFriction
from ringsim.cable.limited import why_unlimited
from ringsim.cable.records import Cable
from ringsim.layout.pose import Array
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.theory.condition import Condition, Conditions
from ringsim.theory.configuration import Configuration
from ringsim.theory.ideal_mechanism import Mechanism


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
        self.conditions = Conditions(scene, tuple(map(len, self._paths)))
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

    def reeved(self, now: Configuration) -> list[Reeved]:
        """All cables on a mechanism at its coordinate."""
        found = []
        for path in self._paths:
            places, slopes = now.places(path), now.velocities(path)
            along, moving = np.diff(places, axis=0), np.diff(slopes, axis=0)
            units = along / np.linalg.norm(along, axis=1)[:, None]
            # The angle opens by two for one that the coordinate falls: L falls as it falls.
            shortening = 0.5 * np.einsum("ij,ij->i", units, moving)
            before, behind = units[:-1], units[1:]
            sine = np.linalg.norm(before + behind, axis=1)
            angles = 2.0 * np.arctan2(sine, np.linalg.norm(behind - before, axis=1))
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
        self, state: Condition, over: Sequence[Reeved], friction: float = 1.0, losses: float = 1.0
    ) -> Array:
        """What each cable drives, N m, shape (cables,), with so many times the friction of the
        pulleys and the losses of gears and drums; ``over`` is how they are ``reeved``.
        """
        if friction not in self._laws:  # the same few factors at every angle
            self._laws[friction] = [cable.friction.factored(friction) for cable in self.cables]
        found = np.zeros(len(self._paths))
        each = zip(self.cables, self._laws[friction], over, strict=True)
        for number, (cable, law, reeved) in enumerate(each):
            steps = law.bound_decay(reeved.angles, cable.pulley_radius)
            tensions = np.zeros(len(reeved.shortening))
            for end, (winch, way) in enumerate(zip(cable.winches, _ways(cable), strict=True)):
                if (reach := state.reach.get((number, end))) is None:
                    continue
                pull = winch.winding.available_tension(at_speed=self._at_speed, losses=losses)
                shares = np.exp(np.append(0.0, np.cumsum(steps[::way])))[::way]
                tensions = np.maximum(tensions, pull * shares * reach)
            found[number] = tensions @ reeved.shortening
        return found


def _ways(cable: Cable) -> tuple[int, ...]:
    """Direction from the winches along the path: 1 from its beginning, -1 from its end.

    A path begins at its first winch, wherever that stands.
    """
    return (1, -1)[: len(cable.winches)]
