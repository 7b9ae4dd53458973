"""Viscous and dry friction."""

import math
from typing import Any, ClassVar, Literal

import numpy as np

from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import PerSection
from ringsim.units import AngularRate, Torque, TorsionDamping


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
