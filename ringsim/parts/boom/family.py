"""The family of booms."""

from typing import Literal

from ringsim.parts.tube import Tube
from ringsim.units import Density, Metre, Model


class Boom(Model):
    """The vertical tube at the first corner: fixed to the upper hinge assembly, while the
    lower one slides along it.

    Source: papers 000 and 002.  The length is inferred: the printed 0.2889 m is shorter than
    the ring is high, so the lower hinge assembly would slide off.
    """

    base: Literal["free", "fixed"] = "free"
    """free: the ring floats with its boom; fixed: the boom's upper end is clamped."""
    length: Metre = 0.9
    """Length of the tube, at least the height of the stowed ring."""
    tube: Tube = Tube(outer_diameter=0.06, inner_diameter=0.058)
    """Cross-section."""
    density: Density = 1800.0
    """Mass over volume of the tube's material."""

    @property
    def mass(self) -> float:
        """Mass in kg."""
        return self.density * self.tube.area * self.length
