"""Friction in the joints and the stops of the V-joints."""

from __future__ import annotations

from ringsim.parts.persection import PerSection
from ringsim.units import (
    AngularRate,
    DegreeOrZero,
    Model,
    Torque,
    TorsionDamping,
    TorsionRate,
)


class JointFriction(Model):
    """Torque against the relative rate w: viscous * w + coulomb * tanh(w / rate)."""

    viscous: PerSection[TorsionDamping] = 0.0
    """One value, or one per section."""
    coulomb: PerSection[Torque] = 0.0
    """One value, or one per section."""
    rate: AngularRate = 0.01
    """Rate that regularises the Coulomb torque: 76 % of it acts at this rate."""


class Joints(Model):
    """Friction of each joint family; a family left out is free of friction."""

    pivot: JointFriction | None = None
    """Crossing of the diagonals."""
    hinge: JointFriction | None = None
    """The four revolutes of every hinge assembly."""
    vjoint: JointFriction | None = None
    """Middle of the folding bars."""


class Stop(Model):
    """One-sided stops of every V-joint: at 180 deg and at the stowed end.

    Torque stiffness * depth + damping * rate while the depth is positive (never pulling).
    """

    stiffness: TorsionRate = 200.0
    damping: TorsionDamping = 0.5
    latch: bool = False
    """Hold the joint from both sides once it has reached 180 deg."""
    stowed_angle: DegreeOrZero = 0.0
    """Opening angle of the stowed stop."""
