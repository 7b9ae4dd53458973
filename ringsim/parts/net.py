"""Nets: strings between corners of a ring, or from corners to a hub."""

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from ringsim.parts.laws import (
    FREE_HUB,
    Array,
    Corners,
    PairLaw,
    PairRecord,
    Reaction,
    one_sided,
    two_sided,
)
from ringsim.units import (
    AxialStiffness,
    DampingRate,
    Kilogram,
    Metre,
    PerSection,
    SpringRate,
    Unit,
    spread,
)

# The family of nets.


class Net(PairRecord):
    """What the corners stretch as the ring opens."""

    steep: ClassVar[bool] = False
    """Whether it resists most in the last degrees."""

    def laws(self, corners: Corners) -> list[PairLaw]:
        """Its strings, between corners or from corners to a hub."""
        raise NotImplementedError

    @property
    def tells(self) -> bool:
        """Whether results tell the tension in each section."""
        return False

    @property
    def point_mass(self) -> float:
        """Mass of points that are its own, kg."""
        return 0.0

    @property
    def lossless(self) -> bool:
        """Whether it gives back all that it takes."""
        return True


# The net, reduced to the cables along its edge.


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

    steep: ClassVar[bool] = True

    @property
    def tells(self) -> bool:
        """See ``Net``."""
        return True

    def laws(self, corners: Corners) -> list[PairLaw]:
        """See ``Net``; natural lengths follow from the deployed ring."""
        chosen = {"upper": (0,), "lower": (1,), "both": (0, 1)}[self.planes]
        every = np.arange(corners.sections)
        rows = [corners.row(plane) for plane in chosen]
        pairs = [np.stack([row[every], row[(every + 1) % len(row)]], axis=1) for row in rows]
        bodies, sections = np.concatenate(pairs), np.tile(every, len(rows))

        def lengths() -> Array:
            strains = spread(self.strain, corners.sections)[sections]
            return np.asarray(corners.distances(bodies) / (1.0 + strains))

        places = tuple((plane, int(k)) for plane in chosen for k in every)
        return [PairLaw("net", self, bodies, sections, lengths, "spring", places)]

    def reaction(self, stretch: Any, rate: Any, natural: Any, xp: Any = np) -> Reaction:
        """See ``PairRecord``."""
        taut = xp.maximum(stretch, 0.0)
        pulling: Any = self.axial_stiffness / natural
        return Reaction(pulling * taut, 0.0 * taut, 0.5 * pulling * taut * taut)


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

    def laws(self, corners: Corners) -> list[PairLaw]:
        """See ``Net``."""
        ends = corners.row(0)
        bodies = np.stack([np.full(len(ends), FREE_HUB), ends], axis=1)
        natural = np.full(len(ends), self.neutral_length)
        return [PairLaw("net", self, bodies, np.arange(len(ends)), lambda: natural, "spring")]

    def linear(self) -> tuple[float, float] | None:
        """See ``PairRecord``."""
        stiffness: Any = self.stiffness
        return (stiffness, self.damping) if self.two_sided else None

    def reaction(self, stretch: Any, rate: Any, natural: Any, xp: Any = np) -> Reaction:
        """See ``PairRecord``."""
        law = stretch, rate, self.stiffness, self.damping
        return two_sided(*law) if self.two_sided else one_sided(*law, ONSET, xp)
