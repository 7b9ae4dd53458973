"""Resistances to the opening of a ring of rigid rods."""

import math
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from ringsim.choice import load_package
from ringsim.layout.bodies import Array
from ringsim.parts.joints import JointFriction
from ringsim.parts.margin import Category
from ringsim.parts.persection import at_section
from ringsim.rigid.mechanism import Configuration, Mechanism, Points, SectionLoads, SpringEnergy
from ringsim.rigid.statics import Carried
from ringsim.scene import Scene

# The family of resistances to the opening of a ring of rigid rods.


class Opening(NamedTuple):
    """The ring at an opening angle (rad) while it opens at a rate (rad/s) and an acceleration.

    ``now`` is the mechanism at its coordinate q = (pi - angle) / 2;
    ``sprung`` is 1 where the spring of a V-joint is whole, one for all or shape (planes, sections).
    """

    angle: float
    rate: float
    acceleration: float
    now: Configuration
    sprung: Array | float = 1.0


class Resistance:
    """A kind of resistance: one file in this folder with a subclass.

    All joints open alike; forces are generalised: power over the rate of the opening angle, N m.
    """

    kind: ClassVar[str]
    """Its name in results."""
    category: ClassVar[Category]
    """The factor of a standard that it takes."""

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        self.scene, self.mechanism = scene, mechanism

    @cached_property
    def carried(self) -> Carried:
        """The corners on lines of a scene that has an offload."""
        return Carried(self.scene, self.mechanism)

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
    found = [kind(scene, mechanism) for kind in Resistance.__subclasses__()]
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
        laws = scene.joints.present()
        self._joints = [_joints(mechanism.points, *item) for item in laws.items()]

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


def _joints(points: Points, family: str, law: JointFriction) -> tuple[JointFriction, Array]:
    """The law at the joints of a family; and how fast these turn, as a product of s and s' with
    constants, shape (joints, functions, functions): z . (x x x') of their second parts less that of
    their first, with z the joint's axis and x a direction of the part square to it.
    """
    joints = [joint for joint in points.layout.joints if joint.family == family]
    axes = np.array([points.layout.pose(joint.first).axes[:, 2] for joint in joints])
    sides = [joint.first for joint in joints], [joint.second for joint in joints]
    alongs = map(points.directions, sides)
    first, second = (
        np.einsum("jaf,jag->jfg", np.cross(axes[:, :, None], along, axis=1), along)
        for along in alongs
    )
    sections = np.array([joint.section for joint in joints])
    return at_section(law, sections), second - first


# Ramps of the latches.


class LatchResistance(Resistance):
    """Torque that lifts the pawls of all V-joints."""

    kind = "latches"
    category = "latch"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.latch is not None and self.scene.latch.pushes

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        # A difference, not a negative: no resistance is 0, not -0.
        return 0.0 - SpringEnergy(self.scene).pawls(math.pi - opening.angle)[0]


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


# The net's pull.


class NetResistance(Resistance):
    """Tension of the net's strings or cables; dampers are left out."""

    kind = "net"
    category = "spring"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.net is not None

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        # The angle opens by two for one that the coordinate falls.
        return 0.5 * self.mechanism.net(opening.now).force


# Springs in the V-joints.


class SpringResistance(Resistance):
    """Torque of those that are whole, which drives where it opens the joints."""

    kind = "springs"
    category = "spring"

    @property
    def present(self) -> bool:
        """See ``Resistance``."""
        return self.scene.hinge_spring is not None

    def force(self, opening: Opening) -> float:
        """See ``Resistance``."""
        springs = SpringEnergy(self.scene)
        springs.alive = springs.alive * opening.sprung
        # One radian of every joint's angle for one of the opening angle.
        return -springs.springs(math.pi - opening.angle)[0]


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
