"""A winding law that ringsim does not ship: a motor whose speed pulsates."""

from __future__ import annotations

import math
from typing import Literal

from ringsim.cable.winding import PrescribedWinding
from ringsim.units import PositiveSpeed, Second


class PulsatingWinding(PrescribedWinding):
    """speed (1 - cos(2 pi t / period)), from rest."""

    kind: Literal["pulsating"] = "pulsating"
    speed: PositiveSpeed
    period: Second

    def usual_speed(self) -> float:
        return self.speed

    def wound(self, time: float) -> float:
        turn = 2.0 * math.pi / self.period
        return self.speed * (time - math.sin(turn * time) / turn)

    def wound_rate(self, time: float) -> float:
        return self.speed * (1.0 - math.cos(2.0 * math.pi * time / self.period))
