"""The family of friction laws of joints."""

import math
from typing import Any, ClassVar

import numpy as np

from ringsim.units import Model


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
