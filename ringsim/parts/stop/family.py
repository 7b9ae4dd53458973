"""The family of stops."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ringsim.parts.springs import Reaction
from ringsim.units import DegreeOrZero, Model


class Stop(Model):
    """One-sided stops of every V-joint: at 180 deg and at the stowed end.

    The law's angle is the one by which a joint is folded, 180 deg less the opening angle.
    """

    latch: bool = False
    """Hold the joint from both sides once it has reached 180 deg."""
    stowed_angle: DegreeOrZero = 0.0
    """Opening angle of the stowed stop."""

    @property
    def most_folded(self) -> float:
        """Folded angle at which the stowed stop is met, rad."""
        return math.pi - math.radians(self.stowed_angle)

    def push(self, depth: Any, rate: Any, xp: Any = np) -> Reaction:
        """Reaction to a depth (rad) and its rate (rad/s), none where the depth is negative."""
        raise NotImplementedError

    def hold(self, folded: Any, rate: Any) -> Reaction:
        """Reaction of a latched joint to its folded angle (rad) and rate (rad/s)."""
        raise NotImplementedError

    def contact_stiffness(self) -> float:
        """Torque over depth of a joint that meets the stop, N m/rad: sets the contact steps."""
        raise NotImplementedError

    def torque(self, folded: Any, rate: Any, latched: Any, xp: Any = np) -> Reaction:
        """Reaction of both ends, or of the latch where it holds; ``xp``: see ``springs``."""
        high = self.push(folded - self.most_folded, rate, xp)
        low = self.push(-folded, -rate, xp)
        held = self.hold(folded, rate)
        return Reaction(
            xp.where(latched, held.elastic, high.elastic - low.elastic),
            xp.where(latched, held.damping, high.damping - low.damping),
            xp.where(latched, held.stored, high.stored + low.stored),
        )
