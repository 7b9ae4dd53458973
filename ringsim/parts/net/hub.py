"""The net, reduced to springs."""

from typing import Any, Literal

import numpy as np

from ringsim.parts.net.family import Net
from ringsim.parts.persection import PerSection
from ringsim.parts.springs import Reaction, one_sided, two_sided
from ringsim.units import DampingRate, Kilogram, Metre, SpringRate

ONSET = 1e-4
"""Stretch over which the damper of a string comes in, m: a ten-thousandth of its length."""


class SpringNet(Net):
    """A spring from every upper corner, all alike or not, to one free hub point in the middle.

    Force = stiffness * (distance - neutral_length) + damping * rate, only while longer than
    neutral unless two_sided.  Source: paper 002, eqs 9-11 and table 1; where the springs go is
    inferred from the published deployment times.
    """

    kind: Literal["hub"] = "hub"
    stiffness: PerSection[SpringRate] = 0.001
    """Force over stretch of the spring of a corner."""
    damping: DampingRate = 0.0
    """Force over rate of stretch, while the spring is taut."""
    neutral_length: Metre = 0.7116
    """Distance from corner to hub at which a spring is without force."""
    two_sided: bool = False
    """Whether springs push, too, where they are shorter than neutral."""
    hub_mass: Kilogram = 1e-5
    """Mass of the hub, next to nothing: 1 g changes the time of a clamped ring by 5e-4."""

    @property
    def point_mass(self) -> float:
        """See ``Net``."""
        return self.hub_mass

    @property
    def lossless(self) -> bool:
        """See ``Net``."""
        return self.damping == 0.0

    def tension(self, stretch: Any, rate: Any, xp: Any = np) -> Reaction:
        """Of strings longer than neutral by ``stretch`` (m), at its rate (m/s).

        The stiffness is that of all corners, or of those that ``at_section`` has picked.
        """
        law = stretch, rate, self.stiffness, self.damping
        return two_sided(*law) if self.two_sided else one_sided(*law, ONSET, xp)
