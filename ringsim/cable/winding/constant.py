"""Winding at constant speed."""

from typing import Literal

from ringsim.cable.winding.family import PrescribedWinding
from ringsim.units import Speed


class ConstantWinding(PrescribedWinding):
    """wound = speed * t; a negative speed pays rope out.  Source: paper 000, eq. 32."""

    kind: Literal["constant"] = "constant"
    speed: Speed
    """Rope taken up per second; negative pays out."""

    def usual_speed(self) -> float:
        """The speed, in m/s."""
        return abs(self.speed)

    def wound(self, time: float) -> float:
        """Rope taken up, in metre."""
        return self.speed * time

    def wound_rate(self, time: float) -> float:
        """The speed, in m/s."""
        return self.speed
