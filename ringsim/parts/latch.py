"""What the latches of the V-joints ask for before they hold."""

import math
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ringsim.parts.persection import PerSection, at_section
from ringsim.parts.springs import Reaction
from ringsim.units import Model, Torque, Unit

_Reach = Annotated[float, Field(gt=0.0, le=60.0), Unit("deg")]
_LeastRate = Annotated[float, Field(ge=0.0, le=1e3), Unit("rad/s")]


class Latch(Model):
    """A pawl on every V-joint that a ramp lifts in the last degrees, and that falls in at 180 deg.

    At the folded angle x the ramp resists opening with 4 peak_torque u (1 - u), u = x / reach, and
    gives the same back while the joint folds: at 180 deg it has taken 2/3 peak_torque reach.  The
    parabola is the simplest course without a jump, and this project's own.  The pawl falls in when
    the joint comes to 180 deg at ``min_rate`` or faster; one that comes more slowly meets its stop
    alone, and may come again.
    """

    peak_torque: PerSection[Torque] = 0.0
    """Largest torque against opening, half of the reach before 180 deg."""
    reach: _Reach = 5.0
    """Angle before 180 deg from which on the ramp lifts the pawl."""
    min_rate: PerSection[_LeastRate] = 0.0
    """Opening rate at 180 deg below which a latch does not catch."""

    def at(self, where: int | NDArray[np.int64]) -> Self:
        """The latch of a section, or of several, counted from 0."""
        return at_section(self, where)

    @property
    def pushes(self) -> bool:
        """Whether a ramp resists anywhere."""
        return bool(np.any(np.asarray(self.peak_torque) > 0.0))

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        """What resists folding, N m, and the energy stored, J, at an angle in rad; ``xp``: see
        ``ringsim.parts.springs``.
        """
        reach: float = math.radians(self.reach)
        u = xp.minimum(xp.maximum(folded / reach, 0.0), 1.0)
        largest: Any = self.peak_torque
        left = 1.0 - u * u * (3.0 - 2.0 * u)
        return Reaction(
            -4.0 * largest * u * (1.0 - u), 0.0 * folded, 2.0 / 3.0 * reach * largest * left
        )
