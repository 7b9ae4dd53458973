"""Joints of the rods: friction, latches, springs and stops of the V-joints."""

import math
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ringsim.choice import OneOf
from ringsim.parts.laws import AngleLaw, AngleRecord, Reaction, one_sided, two_sided
from ringsim.units import (
    AngularRate,
    DegreeOrZero,
    ListIn,
    MetreOrZero,
    Model,
    Newton,
    PerSection,
    Torque,
    TorsionDamping,
    TorsionRate,
    Unit,
)

# The family of friction laws of joints.


class JointFriction(Model):
    """Torque that resists a joint's relative rate.

    Fields of a kind may be ``PerSection``; its methods are called on ``at_section`` of it.
    """

    proportional: ClassVar[tuple[str, ...]] = ()
    """Fields that the torque is proportional to, all together."""

    def torque(self, rate: Any) -> Any:
        """Torque in N m against a rate in rad/s, of the rate's sign."""
        raise NotImplementedError

    def resistance(self, rate: Any) -> Any:
        """Torque in N m at a rate of at least 0 rad/s, with dry friction in full."""
        # Ten times the rate over which it comes in: tanh(10) is 1 to 4e-9.
        full = 10.0 * self.characteristic_rate()
        return self.torque(np.maximum(rate, full) if math.isfinite(full) else rate)

    def linear_damping(self) -> float | None:
        """Torque over rate where that is one number for all rates, N m s/rad; else None."""
        return None

    def characteristic_rate(self) -> float:
        """Smallest rate over which the torque changes its slope, rad/s; infinite if none."""
        return math.inf


# Friction of the joint families.


AnyJointFriction = Annotated[JointFriction, OneOf(default="viscous-coulomb")]


class Joints(Model):
    """Friction of each joint family; a family left out is free of friction."""

    pivot: AnyJointFriction | None = None
    """Crossing of the diagonals."""
    hinge: AnyJointFriction | None = None
    """The four revolutes of every hinge assembly."""
    vjoint: AnyJointFriction | None = None
    """Middle of the folding bars."""

    def present(self) -> dict[str, JointFriction]:
        """The laws that there are, by family."""
        return {family: law for family, law in self if law is not None}


# What the latches of the V-joints ask for before they hold.


_Reach = Annotated[float, Field(gt=0.0, le=60.0), Unit("deg")]
_LeastRate = Annotated[float, Field(ge=0.0, le=1e3), Unit("rad/s")]


class Latch(AngleRecord):
    """A pawl on every V-joint that a ramp lifts in the last degrees, and that falls in at 180 deg.

    At the folded angle x the ramp resists opening with 4 peak_torque u (1 - u), u = x / reach, and
    gives the same back while the joint folds: at 180 deg it has taken 2/3 peak_torque reach.  The
    parabola is the simplest course without a jump, and this project's own.  The pawl falls in when
    the joint comes to 180 deg at ``min_rate`` or faster; one that comes more slowly meets its stop
    alone, and may come again.
    """

    peak_torque: PerSection[Torque] = 0.0
    """Largest torque against opening, half of the reach before 180 deg."""
    reach: _Reach = 5.0
    """Angle before 180 deg from which on the ramp lifts the pawl."""
    min_rate: PerSection[_LeastRate] = 0.0
    """Opening rate at 180 deg below which a latch does not catch."""

    def laws(self, planes: tuple[str, ...], sections: int) -> list[AngleLaw]:
        """Its ramps, where any resists."""
        if not np.any(np.asarray(self.peak_torque) > 0.0):
            return []
        return [AngleLaw.everywhere("latches", self, (len(planes), sections), "latch")]

    def reaction(self, folded: Any, rate: Any, setting: Any, xp: Any = np) -> Reaction:
        """See ``AngleRecord``."""
        reach: float = math.radians(self.reach)
        u = xp.minimum(xp.maximum(folded / reach, 0.0), 1.0)
        largest: Any = self.peak_torque
        left = 1.0 - u * u * (3.0 - 2.0 * u)
        return Reaction(
            -4.0 * largest * u * (1.0 - u), 0.0 * folded, 2.0 / 3.0 * reach * largest * left
        )


# The family of springs in the V-joints.


class HingeSpring(AngleRecord):
    """A spring in every V-joint; its torque follows from the joint's angle alone.

    The angle is that by which the joint is folded, pi - opening angle; a positive torque opens it.
    Fields of a kind may be ``PerSection``; ``torque`` is called on what ``at`` gives.
    """

    def laws(self, planes: tuple[str, ...], sections: int) -> list[AngleLaw]:
        """One in every V-joint."""
        return [AngleLaw.everywhere("springs", self, (len(planes), sections), "spring")]

    def reaction(self, folded: Any, rate: Any, setting: Any, xp: Any = np) -> Reaction:
        """See ``AngleRecord``."""
        return self.torque(folded, xp)

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        """What resists folding, N m, and the energy stored, J, at an angle in rad; ``xp``: see
        ``ringsim.parts.laws``.
        """
        raise NotImplementedError


# A spring whose torque falls as it opens its joint.


Stiffness = Annotated[float, Field(ge=0.0, le=1e5), Unit("N m/rad")]


class LinearSpring(HingeSpring):
    """preload + stiffness * folded angle: the preload is left at 180 deg."""

    kind: Literal["linear"] = "linear"
    stiffness: PerSection[Stiffness]
    """Torque over the folded angle."""
    preload: PerSection[Torque] = 0.0
    """Torque that is left at 180 deg."""

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        """See ``HingeSpring``."""
        stored = (self.preload + 0.5 * folded * self.stiffness) * folded
        return Reaction(self.preload + folded * self.stiffness, 0.0 * folded, stored)


# A spring with a measured torque.


Angle = Annotated[float, Field(ge=0.0, le=180.0), Unit("deg")]
SignedTorque = Annotated[float, Field(ge=-1e5, le=1e5), Unit("N m")]


class TableSpring(HingeSpring):
    """Torques at opening angles, joined by lines; as at the ends before and behind them."""

    kind: Literal["table"] = "table"
    angles: Annotated[tuple[Angle, ...], ListIn, Field(min_length=2, max_length=50)]
    """Opening angles, increasing."""
    torques: Annotated[tuple[SignedTorque, ...], ListIn]
    """Torques there; positive ones open the joint."""

    @model_validator(mode="after")
    def _usable(self) -> "TableSpring":
        if len(self.torques) != len(self.angles):
            raise ValueError(
                f"torques has {len(self.torques)} values, but angles has {len(self.angles)}: give "
                "one torque for each angle"
            )
        late = [b for a, b in pairwise(self.angles) if b <= a]
        if late:
            raise ValueError(f"angles = ... {late[0]:g} deg must be above the angle before it")
        return self

    def at(self, where: int | NDArray[np.int64]) -> Self:
        """See ``HingeSpring``: one table for all."""
        return self

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        """See ``HingeSpring``."""
        # From the deployed end on: each piece adds what lies within its own angles.
        points = [
            (math.radians(180.0 - angle), torque)
            for angle, torque in zip(self.angles[::-1], self.torques[::-1], strict=True)
        ]
        torque, stored = points[0][1] + 0.0 * folded, points[0][1] * folded
        for (near, first), (far, last) in pairwise(points):
            slope = (last - first) / (far - near)
            inside = xp.minimum(xp.maximum(folded - near, 0.0), far - near)
            beyond = xp.maximum(folded - far, 0.0)
            torque = torque + slope * inside
            stored = stored + slope * inside * (0.5 * inside + beyond)
        return Reaction(torque, 0.0 * folded, stored)


# A tape of constant force on a drum at the joint.


class TapeSpring(HingeSpring):
    """force * radius at any angle."""

    kind: Literal["tape"] = "tape"
    force: PerSection[Newton]
    """Of the tape; negative it folds the joint."""
    radius: MetreOrZero
    """Of the drum that the tape opens."""

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        """See ``HingeSpring``."""
        lever: Any = self.radius
        torque = lever * self.force
        return Reaction(torque + 0.0 * folded, 0.0 * folded, torque * folded)


# The family of stops.


class Stop(AngleRecord):
    """One-sided stops of every V-joint: at 180 deg and at the stowed end.

    A kind says how they push.  The angle is that by which a joint is folded, pi - opening angle.
    """

    stiffness: TorsionRate = 200.0
    """Of the latch, and of the stop at small depths: the steps of a contact follow from it."""
    damping: TorsionDamping = 0.5
    """Torque over rate while the stop is in contact, and of the latch."""
    latch: bool = False
    """Hold the joint from both sides once it has reached 180 deg."""
    stowed_angle: DegreeOrZero = 0.0
    """Opening angle of the stowed stop."""

    def laws(self, planes: tuple[str, ...], sections: int) -> list[AngleLaw]:
        """One on every V-joint; its setting is 1 once the joint is latched."""
        return [AngleLaw.everywhere("stop", self, (len(planes), sections))]

    @property
    def most_folded(self) -> float:
        """Folded angle at which the stowed stop is met, rad."""
        return math.pi - math.radians(self.stowed_angle)

    def push(self, depth: Any, rate: Any, xp: Any = np) -> Reaction:
        """Reaction to a depth (rad) and its rate (rad/s), none where the depth is negative."""
        raise NotImplementedError

    def reaction(self, folded: Any, rate: Any, setting: Any, xp: Any = np) -> Reaction:
        """Of both ends, or of the latch where it holds; see ``AngleRecord``."""
        latched = setting > 0.5
        high = self.push(folded - self.most_folded, rate, xp)
        low = self.push(-folded, -rate, xp)
        held = two_sided(folded, rate, self.stiffness, self.damping)
        return Reaction(
            xp.where(latched, held.elastic, high.elastic - low.elastic),
            xp.where(latched, held.damping, high.damping - low.damping),
            xp.where(latched, held.stored, high.stored + low.stored),
        )


# A stop of a spring and a damper.


ONSET = 1e-3
"""Depth over which the damper comes in, rad: joints that arrive at 1 to 15 rad/s go 1e-3 to
1e-2 rad deep into the default spring, so that it acts in full for most of the contact."""


class SpringDamperStop(Stop):
    """Torque stiffness * depth + damping * rate while the depth is positive (never pulling)."""

    kind: Literal["spring-damper"] = "spring-damper"

    def push(self, depth: Any, rate: Any, xp: Any = np) -> Reaction:
        """See ``Stop``."""
        return one_sided(depth, rate, self.stiffness, self.damping, ONSET, xp)


# Viscous and dry friction.


class ViscousCoulombFriction(JointFriction):
    """Torque against the relative rate w: viscous * w + coulomb * tanh(w / rate)."""

    proportional: ClassVar[tuple[str, ...]] = ("viscous", "coulomb")

    kind: Literal["viscous-coulomb"] = "viscous-coulomb"
    viscous: PerSection[TorsionDamping] = 0.0
    """Torque over rate."""
    coulomb: PerSection[Torque] = 0.0
    """Torque of dry friction at rates far above ``rate``."""
    rate: AngularRate = 0.01
    """Rate that regularises the Coulomb torque: 76 % of it acts at this rate."""

    def torque(self, rate: Any) -> Any:
        """See ``JointFriction``."""
        return self.viscous * rate + self.coulomb * np.tanh(rate / self.rate)

    def resistance(self, rate: Any) -> Any:
        """See ``JointFriction``."""
        return self.viscous * rate + self.coulomb

    def linear_damping(self) -> float | None:
        """See ``JointFriction``."""
        return None if np.any(self.coulomb) else float(np.max(self.viscous))

    def characteristic_rate(self) -> float:
        """See ``JointFriction``."""
        return self.rate if np.any(self.coulomb) else math.inf
