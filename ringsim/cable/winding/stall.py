"""Winding by a motor that stalls."""

from typing import Literal

from ringsim.cable.winding.family import FeedbackWinding, WinchReading
from ringsim.units import PositiveSpeed, Ratio, Tension


class StallWinding(FeedbackWinding):
    """Constant speed up to a maximum tension, constant tension from there.

    speed(T) = speed * (T_max - T) / (band * T_max), cut to 0 .. speed: full speed below
    T_max (1 - band), standstill at T_max.  A winch that can be driven backwards goes on along
    that line to -speed, so that the rope's tension pulls rope off it.
    """

    kind: Literal["stall"] = "stall"
    speed: PositiveSpeed
    """Speed while the tension is low."""
    max_tension: Tension
    """Tension at which the motor stands still."""
    band: Ratio = 0.05
    """Width of the passage from constant speed to constant tension, over max_tension."""
    backdrivable: bool = False
    """Whether rope can be pulled off the winch; if not, it holds."""

    def usual_speed(self) -> float:
        """The speed below the stall, in m/s."""
        return self.speed

    def available_tension(self, *, at_speed: bool = False, losses: float = 1.0) -> float:
        """The maximum tension, or that up to which the speed is kept, in N."""
        return self.max_tension * (1.0 - self.band * at_speed)

    def commanded_speed(self) -> float:
        """The speed below the stall, in m/s."""
        return self.speed

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed of the motor at a tension (N), in m/s."""
        return self.speed * (1.0 - tension / self.max_tension) / self.band

    def limits(self) -> tuple[float, float]:
        """Standstill, or full speed backwards, to full speed."""
        return (-self.speed if self.backdrivable else 0.0), self.speed
