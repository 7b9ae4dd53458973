"""Nets: strings between corners of a ring, or from corners to a hub."""

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ringsim.parts.laws import Reaction, one_sided, two_sided
from ringsim.parts.persection import PerSection, spread
from ringsim.units import AxialStiffness, DampingRate, Kilogram, Metre, Model, SpringRate, Unit

# The family of nets.


class Net(Model):
    """What the corners stretch as the ring opens."""

    @property
    def point_mass(self) -> float:
        """Mass of points that are its own, kg."""
        return 0.0

    @property
    def lossless(self) -> bool:
        """Whether it gives back all that it takes."""
        return True


# The net, reduced to the cables along its edge.


Array = NDArray[np.float64]
_Strain = Annotated[float, Field(ge=-0.5, le=0.1), Unit("1")]


class BoundaryNet(Net):
    """A cable without mass between neighbouring corners of a plane, one for each section.

    Slack while they are closer than its natural length; longer, tension = axial_stiffness *
    (distance / natural length - 1).  Neighbours draw apart by the cosine of half the folded angle:
    the cables come taut in the last degrees, and are at their longest at 180 deg.  Source: the
    linear elastic cable that takes no compression; that boundary cables are what resists most
    near the end, doi 10.1186/s10033-024-01065-x.
    """

    kind: Literal["boundary"] = "boundary"
    axial_stiffness: PerSection[AxialStiffness]
    """Force over strain of a cable."""
    strain: PerSection[_Strain]
    """Strain of a cable where all V-joints are at 180 deg, from which its natural length follows;
    negative: it is slack even there."""
    planes: Literal["upper", "lower", "both"] = "both"
    """Planes whose corners hold cables."""

    def natural(self, deployed: Array) -> Array:
        """Natural lengths, m, from distances in the deployed ring, shape (..., sections)."""
        return np.asarray(deployed / (1.0 + spread(self.strain, deployed.shape[-1])))

    def rates(self, natural: Array) -> Array:
        """Force over stretch of cables with natural lengths (m), N/m, shape (..., sections)."""
        return np.asarray(spread(self.axial_stiffness, natural.shape[-1]) / natural)


def pull(stretch: Any, rate: Any, xp: Any = np) -> Reaction:
    """Of a cable longer than natural by ``stretch`` (m), at its force over stretch (N/m)."""
    taut = xp.maximum(stretch, 0.0)
    return Reaction(rate * taut, 0.0 * taut, 0.5 * rate * taut * taut)


# The net, reduced to springs.


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
