"""A stop of a spring and a damper."""

from typing import Any, Literal

import numpy as np

from ringsim.parts.springs import Reaction, one_sided
from ringsim.parts.stop.family import Stop

ONSET = 1e-3
"""Depth over which the damper comes in, rad: joints that arrive at 1 to 15 rad/s go 1e-3 to
1e-2 rad deep into the default spring, so that it acts in full for most of the contact."""


class SpringDamperStop(Stop):
    """Torque stiffness * depth + damping * rate while the depth is positive (never pulling)."""

    kind: Literal["spring-damper"] = "spring-damper"

    def push(self, depth: Any, rate: Any, xp: Any = np) -> Reaction:
        """See ``Stop``."""
        return one_sided(depth, rate, self.stiffness, self.damping, ONSET, xp)
