"""What drives a ring of rigid rods: its cables at the tension that their winches have, and loads.

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
from ringsim.theory.configuration import Configuration
from ringsim.theory.ideal_mechanism import Mechanism


class Reeved(NamedTuple):
    """A cable on the ring: its spans' shortening with the opening angle (m/rad), shape (spans,);
    the angles at its pulleys (rad), shape (spans - 1,).
    """

    shortening: Array
    angles: Array


class Drive:
    """Cables and loads of a scene, whose winches wind at all, or ``at_speed`` as commanded.

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
        self._loads = points.forces
        self._loaded = bool(self._loads[0].any())
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
        """All cables on a mechanism that folds at the unit rate."""
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

    def speed(self, over: Sequence[Reeved]) -> float:
        """Rate of the opening angle at which winches wind as commanded, rad/s; the least of all.

        ``over`` is how they are ``reeved``.  0 where they need not, or have no command: a motor
        slows down until it has the torque.
        """
        rates = [] if self._at_speed else [0.0]
        for cable, reeved in zip(self.cables, over, strict=True):
            commands = sum(winch.winding.commanded_speed() for winch in cable.winches)
            rates.append(commands / max(float(reeved.shortening.sum()), 1e-300))
        return min(rates, default=0.0)

    def force(
        self, now: Configuration, over: Sequence[Reeved], friction: float = 1.0,
        time: float | None = None,
    ) -> float:  # fmt: skip
        """What drives, N m, with so many times the friction of the pulleys; at a time (s) only of
        the winches that are switched on; ``over`` is how the cables are ``reeved`` now.
        """
        if friction not in self._laws:  # the same few factors at every angle
            self._laws[friction] = [cable.friction.factored(friction) for cable in self.cables]
        found = 0.0
        for cable, law, reeved in zip(self.cables, self._laws[friction], over, strict=True):
            steps = law.bound_decay(reeved.angles, cable.pulley_radius)
            tensions = np.zeros(len(reeved.shortening))
            for winch, way in zip(cable.winches, _ways(cable), strict=True):
                on = time is None or winch.turns(time)
                pull = winch.winding.available_tension(at_speed=self._at_speed) if on else 0.0
                shares = np.exp(np.append(0.0, np.cumsum(steps[::way])))[::way]
                tensions = np.maximum(tensions, pull * shares)
            found += float(tensions @ reeved.shortening)
        if not self._loaded:
            return found
        loads, places = self._loads
        # Along z in the ring's own axes, as the loads of the rigid ring are.
        return found - 0.5 * float(np.sum(loads * now.velocities(places)))


def _ways(cable: Cable) -> tuple[int, ...]:
    """Direction from the winches along the path: 1 from its beginning, -1 from its end.

    A path begins at its first winch, wherever that stands.
    """
    return (1, -1)[: len(cable.winches)]
