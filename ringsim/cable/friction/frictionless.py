"""Pulleys without friction."""

from typing import Literal

import numpy as np

from ringsim.cable.friction.family import PulleyFriction
from ringsim.cable.ropes import Array


class Frictionless(PulleyFriction):
    """eta = 1: one tension in the whole rope, the driving-cable element of paper 001.

    >>> Frictionless().log_decay(np.array([0.0, 1.0]), 0.01)
    array([0., 0.])
    """

    kind: Literal["none"] = "none"

    def log_decay(self, angle: Array, radius: float) -> Array:
        """Zero for every pulley."""
        return np.zeros_like(angle)

    def log_slope(self, angle: Array, radius: float) -> Array:
        """Zero for every pulley."""
        return np.zeros_like(angle)
