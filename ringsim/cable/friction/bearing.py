"""Friction in the pulley's bearing, in the closed form of paper 000."""

from typing import Literal

import numpy as np

from ringsim.cable.friction.family import PulleyFriction
from ringsim.cable.ropes import Array
from ringsim.parts.persection import PerSection
from ringsim.units import MetreOrZero


class Bearing(PulleyFriction):
    """Any law of a pulley's bearing with the friction moment f times the radial force."""

    coefficient: PerSection[MetreOrZero]
    """f in metre: one value for all pulleys, or one for each in order from the winch."""

    def refusal(self, radius: float) -> str | None:
        """Bound f < R: otherwise a rope that turns back could not be pulled over the pulley."""
        worst = float(np.max(self.coefficients))
        if worst < radius:
            return None
        return (
            f"friction.coefficient = {worst:g} m must be below pulley_radius = {radius:g} m: "
            "the bearing would hold any tension where the rope turns back (lower it, or take "
            "a larger pulley)"
        )


class BearingFriction(Bearing):
    """eta = (R - f cos(a/2)) / (R + f cos(a/2)), that is ln(eta) = -2 artanh((f/R) cos(a/2)).

    f is the bearing's friction moment over its radial force: Palmgren's constant times the
    pitch diameter.  Source: paper 000, eqs 11 and 19.  With the radial force taken as 2 cos(a/2)
    times the mean of the two tensions, ln(eta) is smaller than the exact one ("bearing-exact") in
    magnitude by (f/R)^3 cos(a/2) sin(a/2)^2 + O((f/R)^5), at most 0.385 (f/R)^3.

    >>> law = BearingFriction(coefficient=0.0004)
    >>> round(float(np.exp(law.log_decay(np.array([0.5 * np.pi]), 0.01))[0]), 6)
    0.944987
    """

    kind: Literal["bearing"] = "bearing"

    def log_decay(self, angle: Array, radius: float) -> Array:
        """ln(eta) = -2 artanh((f/R) cos(a/2))."""
        return np.asarray(-2.0 * np.arctanh(self.coefficients / radius * np.cos(0.5 * angle)))

    def log_slope(self, angle: Array, radius: float) -> Array:
        """(f/R) sin(a/2) / (1 - (f/R)^2 cos(a/2)^2)."""
        ratio = self.coefficients / radius
        lost = (ratio * np.cos(0.5 * angle)) ** 2
        return np.asarray(ratio * np.sin(0.5 * angle) / (1.0 - lost))
