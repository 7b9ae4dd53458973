"""The net, reduced to the cables along its edge."""

from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ringsim.parts.net.family import Net
from ringsim.parts.persection import PerSection, spread
from ringsim.parts.springs import Reaction
from ringsim.units import AxialStiffness, Unit

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
