"""Resistances to the opening of a ring of rigid rods."""

import math
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ringsim.choice import load_package
from ringsim.layout.bodies import Array
from ringsim.parts.laws import Rub, Switches
from ringsim.parts.margin import Category
from ringsim.rigid.mechanism import Configuration, Mechanism, Points, SectionLoads, torques_at
from ringsim.rigid.statics import Carried
from ringsim.scene import Scene

# The family of resistances to the opening of a ring of rigid rods.


class Opening(NamedTuple):
    """The ring at an opening angle (rad) while it opens at a rate (rad/s) and an acceleration.

    ``now`` is the mechanism at its coordinate q = (pi - angle) / 2;
    ``switches`` say which laws on V-joints act.
    """

    angle: float
    rate: float
    acceleration: float
    now: Configuration
    switches: Switches


class Resistance:
    """A kind of resistance: one file in this folder with a subclass.

    All joints open alike; forces are generalised: power over the rate of the opening angle, N m.
    """

    kind: str
    """Its name in results."""
    category: Category
    """The factor of a standard that it takes."""

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        self.scene, self.mechanism = scene, mechanism

    @cached_property
    def carried(self) -> Carried:
        """The corners on lines of a scene that has an offload."""
        return Carried(self.scene, self.mechanism)

    @classmethod
    def of(cls, scene: Scene, mechanism: Mechanism) -> "list[Resistance]":
        """All of this kind that a scene may have."""
        return [cls(scene, mechanism)]

    @property
    def present(self) -> bool:
        """Whether the scene has it."""
        return True

    def force(self, opening: Opening) -> float:
        """What resists opening, N m; negative where it drives."""
        raise NotImplementedError


def resistances(scene: Scene, mechanism: Mechanism) -> list[Resistance]:
    """All that a scene has, by name."""
    load_package(__name__.rpartition(".")[0])
    found = [one for kind in Resistance.__subclasses__() for one in kind.of(scene, mechanism)]
    return sorted((one for one in found if one.present), key=lambda one: one.kind)


# Inertia of all moving parts, trolleys of a ground test among them.


_STEP = 1e-4
"""Change of the coordinate for the slope of the inertia, rad: 1e-8 of it is left."""


class InertiaResistance(Resistance):
    """I a'' + I' a'^2 / 2, nothing at rest nor where that drives: speed must not help."""

    kind = "inertia"
    category = "inertia"

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        if opening.rate == 0.0 and opening.acceleration == 0.0:
            return 0.0
        q = opening.now.place
        beside = [self._inertia(self.mechanism.at(q + by)) for by in (-_STEP, _STEP)]
        slope = -0.5 * (beside[1] - beside[0]) / (2.0 * _STEP)
        own = self._inertia(opening.now)
        # Half of the coordinate's rate goes with the angle's: a quarter of the inertia.
        force = 0.25 * (own * opening.acceleration + 0.5 * slope * opening.rate**2)
        return max(force, 0.0)

    def _inertia(self, now: Configuration) -> float:
        found = self.mechanism.inertia(now)
        if (offload := self.scene.offload) is not None and offload.trolley_mass > 0.0:
            ways = 2.0 * self.carried.at(now).ways
            found += offload.trolley_mass * float(ways @ ways)
        return found


# Friction in the joints.


class JointFrictionResistance(Resistance):
    """Torque times how far a joint turns, dry friction in full at any rate."""

    kind = "joint friction"
    category = "friction"

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        super().__init__(scene, mechanism)
        points = mechanism.points
        self._joints = [(rub.of(slice(None)), _turning(points, rub)) for rub in points.layout.rubs]

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return bool(self._joints)

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        found, now = 0.0, opening.now
        for law, products in self._joints:
            # The angle opens by two for one that the coordinate falls.
            turn = 0.5 * np.abs(now.values @ products @ now.slopes)
            found += float(np.sum(law.resistance(turn * opening.rate) * turn))
        return found


def _turning(points: Points, rub: Rub) -> Array:
    """How fast joints turn, as a product of s and s' with constants, shape (joints, functions,
    functions): z . (x x x') of their second parts less that of their first, with z the joint's axis
    and x a direction of the part square to it.
    """
    joints = [points.layout.joints[number] for number in rub.joints]
    axes = np.array([points.layout.pose(joint.first).axes[:, 2] for joint in joints])
    sides = [joint.first for joint in joints], [joint.second for joint in joints]
    alongs = map(points.directions, sides)
    first, second = (
        np.einsum("jaf,jag->jfg", np.cross(axes[:, :, None], along, axis=1), along)
        for along in alongs
    )
    return np.asarray(second - first)


# Stiffness of the lines of a ground test.


class LineResistance(Resistance):
    """What lines pull less, or more, than at the start, times how far they are let up: beside
    gravity, which counts what they carry at the start.
    """

    kind = "lines"
    category = "spring"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.offload is not None and self.scene.offload.stiffness > 0.0

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        lines = self.carried.at(opening.now)
        return lines.law.stiffness * float(lines.heights @ lines.climbs)


# Loads that fold the ring.


class LoadResistance(Resistance):
    """Forces on the V-joints of the sections in which they resist; where they open, they drive."""

    kind = "loads"
    category = "load"

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        super().__init__(scene, mechanism)
        self._loads = SectionLoads(mechanism)

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.loads is not None

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        return float((-self._loads.at(opening.now)).clip(min=0.0).sum())


# Laws between bodies: the pull of a net.


class PairResistance(Resistance):
    """Tension of the pairs of a group; dampers are left out."""

    def __init__(self, scene: Scene, mechanism: Mechanism, group: str, category: Category) -> None:
        super().__init__(scene, mechanism)
        self.kind, self.category = group, category

    @classmethod
    def of(cls, scene: Scene, mechanism: Mechanism) -> list[Resistance]:
        """See ``Resistance``."""
        laws = mechanism.points.layout.pair_laws
        groups = {law.group: law.category for law in laws if law.category is not None}
        return [cls(scene, mechanism, *each) for each in groups.items()]

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        # The angle opens by two for one that the coordinate falls.
        return 0.5 * self.mechanism.pairs(opening.now, self.kind).force


# Laws on the V-joints: springs, which drive where they open the joints, and ramps of latches.


class LawResistance(Resistance):
    """Torque of the laws of a group."""

    def __init__(self, scene: Scene, mechanism: Mechanism, group: str, category: Category) -> None:
        super().__init__(scene, mechanism)
        self.kind, self.category = group, category

    @classmethod
    def of(cls, scene: Scene, mechanism: Mechanism) -> list[Resistance]:
        """See ``Resistance``: those that a drive meets on its way."""
        laws = mechanism.points.layout.angle_laws
        groups = {law.group: law.category for law in laws if law.category is not None}
        return [cls(scene, mechanism, *each) for each in groups.items()]

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        # A difference, not a negative: no resistance is 0, not -0.
        folded = math.pi - opening.angle
        return 0.0 - torques_at(opening.switches, folded, self.kind).torque


# Friction of the trolleys of a ground test.


class TrolleyResistance(Resistance):
    """Friction times the pull of each line times the way of its trolley on the rail grid, in full
    at any rate.
    """

    kind = "trolleys"
    category = "friction"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.offload is not None and self.scene.offload.friction > 0.0

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        lines = self.carried.at(opening.now)
        return lines.law.friction * float(lines.pulls @ lines.ways)


# Gravity.


class WeightResistance(Resistance):
    """What gravity takes, or gives where it helps the ring to open."""

    kind = "gravity"
    category = "gravity"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.gravity is not None

    def force(self, opening: Opening) -> float:
        """See ``Resistance``; the held body stays where it is."""
        mechanism, now = self.mechanism, opening.now
        return 0.5 * float(mechanism.rates(now) @ mechanism.weight(now))
