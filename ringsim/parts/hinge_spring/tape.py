"""A tape of constant force on a drum at the joint."""

from typing import Any, Literal

import numpy as np

from ringsim.parts.hinge_spring.family import HingeSpring
from ringsim.parts.persection import PerSection
from ringsim.parts.springs import Reaction
from ringsim.units import MetreOrZero, Newton


class TapeSpring(HingeSpring):
    """force * radius at any angle."""

    kind: Literal["tape"] = "tape"
    force: PerSection[Newton]
    """Of the tape; negative it folds the joint."""
    radius: MetreOrZero
    """Of the drum that the tape opens."""

    def torque(self, folded: Any, xp: Any = np) -> Reaction:
        """See ``HingeSpring``."""
        lever: Any = self.radius
        torque = lever * self.force
        return Reaction(torque + 0.0 * folded, 0.0 * folded, torque * folded)
