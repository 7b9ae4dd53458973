"""Friction in the pulley's bearing, without approximation."""

from typing import Literal

import numpy as np

from ringsim.cable.friction.bearing import Bearing
from ringsim.cable.ropes import Array


class ExactBearingFriction(Bearing):
    """The root below 1 of R (1 - eta) = f sqrt(1 + eta^2 + 2 eta cos a).

    With k = f/R the balance squared is (1 - k^2)(1 + eta^2) = 2 (1 + k^2 cos a) eta.  Its two
    roots are each other's inverse, one for each direction of the rope; the one below 1 is

        eta = (q - k cos(a/2)) / (q + k cos(a/2)),   q = sqrt(1 - k^2 sin(a/2)^2),

    as q^2 - k^2 cos(a/2)^2 = 1 - k^2.  The closed form (kind "bearing") is the case q = 1; both
    agree for a = 0 and a = pi.  Source of the balance: paper 000, eq. 18.

    >>> law = ExactBearingFriction(coefficient=0.0004)
    >>> round(float(np.exp(law.log_decay(np.array([0.5 * np.pi]), 0.01))[0]), 6)
    0.944966
    """

    kind: Literal["bearing-exact"] = "bearing-exact"

    def log_decay(self, angle: Array, radius: float) -> Array:
        """ln(eta) = -2 artanh(k cos(a/2) / q)."""
        ratio = self.coefficients / radius
        root = np.sqrt(1.0 - (ratio * np.sin(0.5 * angle)) ** 2)
        return np.asarray(-2.0 * np.arctanh(ratio * np.cos(0.5 * angle) / root))

    def log_slope(self, angle: Array, radius: float) -> Array:
        """The derivative k sin(a/2) / q."""
        lateral = self.coefficients / radius * np.sin(0.5 * angle)
        return np.asarray(lateral / np.sqrt(1.0 - lateral**2))
