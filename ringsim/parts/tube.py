"""Tubular cross-sections and their elastic and inertial constants."""

import math
from typing import Self

from pydantic import model_validator

from ringsim.units import Metre, MetreOrZero, Model


class Tube(Model):
    """A circular tube; inner_diameter = 0 is a solid rod."""

    outer_diameter: Metre
    """Outer diameter of the tube."""
    inner_diameter: MetreOrZero
    """Inner diameter; 0 for a solid rod."""

    @model_validator(mode="after")
    def _inside(self) -> Self:
        self.require_below("inner_diameter", "outer_diameter")
        return self

    @property
    def area(self) -> float:
        """Cross-section area in m^2."""
        return 0.25 * math.pi * (self.outer_diameter**2 - self.inner_diameter**2)

    @property
    def second_moment(self) -> float:
        """Second moment of area about a diameter in m^4."""
        return math.pi / 64.0 * (self.outer_diameter**4 - self.inner_diameter**4)

    def shear_factor(self, poisson_ratio: float) -> float:
        """Timoshenko shear coefficient of a hollow circle.

        Source: Cowper, The shear coefficient in Timoshenko's beam theory, J. Appl. Mech. 33
        (1966), with m = inner over outer diameter.
        """
        m2, nu = (self.inner_diameter / self.outer_diameter) ** 2, poisson_ratio
        wall = (1.0 + m2) ** 2
        return 6.0 * (1.0 + nu) * wall / ((7.0 + 6.0 * nu) * wall + (20.0 + 12.0 * nu) * m2)
