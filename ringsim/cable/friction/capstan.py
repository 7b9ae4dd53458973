"""A rope that slides on fixed sheaves."""

from typing import Literal

import numpy as np

from ringsim.cable.friction.family import PulleyFriction
from ringsim.cable.ropes import Array
from ringsim.parts.persection import PerSection
from ringsim.units import FrictionCoefficient


class CapstanFriction(PulleyFriction):
    """eta = exp(-mu (pi - a)): dry friction along the wrap angle pi - a.

    Source: Euler-Eytelwein.  Independent of the radius of the sheave.

    >>> law = CapstanFriction(coefficient=0.25)
    >>> float(law.log_decay(np.array([0.0]), 0.01)[0]) == -0.25 * np.pi
    True
    """

    kind: Literal["capstan"] = "capstan"
    coefficient: PerSection[FrictionCoefficient]
    """mu: one value for all sheaves, or one for each in order from the winch."""

    def log_decay(self, angle: Array, radius: float) -> Array:
        """ln(eta) = -mu (pi - a)."""
        return np.asarray(-self.coefficients * (np.pi - angle))

    def log_slope(self, angle: Array, radius: float) -> Array:
        """The coefficient mu, whatever the angle."""
        return np.broadcast_to(self.coefficients, angle.shape).astype(float)
