"""A stop of a spring and a damper."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from ringsim.parts.springs import Reaction, one_sided, two_sided
from ringsim.parts.stop.family import Stop
from ringsim.units import TorsionDamping, TorsionRate

ONSET = 1e-3
"""Depth over which the damper comes in, rad: joints that arrive at 1 to 15 rad/s go 1e-3 to
1e-2 rad deep into the default spring, so that it acts in full for most of the contact."""


class SpringDamperStop(Stop):
    """Torque stiffness * depth + damping * rate while the depth is positive (never pulling)."""

    kind: Literal["spring-damper"] = "spring-damper"
    stiffness: TorsionRate = 200.0
    damping: TorsionDamping = 0.5

    def push(self, depth: Any, rate: Any, xp: Any = np) -> Reaction:
        """See ``Stop``."""
        return one_sided(depth, rate, self.stiffness, self.damping, ONSET, xp)

    def hold(self, folded: Any, rate: Any) -> Reaction:
        """See ``Stop``."""
        return two_sided(folded, rate, self.stiffness, self.damping)

    def contact_stiffness(self) -> float:
        """See ``Stop``."""
        return self.stiffness
