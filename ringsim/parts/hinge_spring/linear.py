"""A spring whose torque falls as it opens its joint."""

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from ringsim.parts.hinge_spring.family import HingeSpring
from ringsim.parts.persection import PerSection
from ringsim.parts.springs import Reaction
from ringsim.units import Torque, Unit

Stiffness = Annotated[float, Field(ge=0.0, le=1e5), Unit("N m/rad")]


class LinearSpring(HingeSpring):
    """preload + stiffness * folded angle: the preload is left at 180 deg."""

    kind: Literal["linear"] = "linear"
    stiffness: PerSection[Stiffness]
    """Torque over the folded angle."""
    preload: PerSection[Torque] = 0.0
    """Torque that is left at 180 deg."""

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        """See ``HingeSpring``."""
        stored = (self.preload + 0.5 * folded * self.stiffness) * folded
        return Reaction(self.preload + folded * self.stiffness, 0.0 * folded, stored)
