"""A friction law that ringsim does not ship: every sheave has one efficiency."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ringsim.cable.friction import PulleyFriction
from ringsim.cable.ropes import Array
from ringsim.units import Ratio


class SheaveEfficiency(PulleyFriction):
    """eta is the same at every angle, as crane makers state it for a wire rope on ball bearings."""

    kind: Literal["sheave-efficiency"] = "sheave-efficiency"
    efficiency: Ratio = 0.98

    def log_decay(self, angle: Array, radius: float) -> Array:
        return np.full_like(angle, np.log(self.efficiency))

    def log_slope(self, angle: Array, radius: float) -> Array:
        return np.zeros_like(angle)
