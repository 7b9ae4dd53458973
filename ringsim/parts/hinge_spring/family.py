"""The family of springs in the V-joints."""

from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.persection import at_section
from ringsim.parts.springs import Reaction
from ringsim.units import Model


class HingeSpring(Model):
    """A spring in every V-joint; its torque follows from the joint's angle alone.

    The angle is that by which the joint is folded, pi - opening angle; a positive torque opens it.
    Fields of a kind may be ``PerSection``; ``torque`` is called on what ``at`` gives.
    """

    def at(self, where: int | NDArray[np.int64]) -> Self:
        """The spring of a section, or of several, counted from 0."""
        return at_section(self, where)

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        """What resists folding, N m, and the energy stored, J, at an angle in rad; ``xp``: see
        ``ringsim.parts.springs``.
        """
        raise NotImplementedError
