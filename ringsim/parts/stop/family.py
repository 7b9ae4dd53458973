"""The family of stops."""

import math
from typing import Any

import numpy as np

from ringsim.parts.springs import Reaction, two_sided
from ringsim.units import DegreeOrZero, Model, TorsionDamping, TorsionRate


class Stop(Model):
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

    @property
    def most_folded(self) -> float:
        """Folded angle at which the stowed stop is met, rad."""
        return math.pi - math.radians(self.stowed_angle)

    def push(self, depth: Any, rate: Any, xp: Any = np) -> Reaction:
        """Reaction to a depth (rad) and its rate (rad/s), none where the depth is negative."""
        raise NotImplementedError

    def torque(self, folded: Any, rate: Any, latched: Any, xp: Any = np) -> Reaction:
        """Reaction of both ends, or of the latch where it holds; ``xp``: see ``springs``."""
        high = self.push(folded - self.most_folded, rate, xp)
        low = self.push(-folded, -rate, xp)
        held = two_sided(folded, rate, self.stiffness, self.damping)
        return Reaction(
            xp.where(latched, held.elastic, high.elastic - low.elastic),
            xp.where(latched, held.damping, high.damping - low.damping),
            xp.where(latched, held.stored, high.stored + low.stored),
        )
