"""Winding with a smooth start."""

from typing import Literal

from ringsim.cable.winding.family import PrescribedWinding
from ringsim.units import Second, Speed

_RATE = {"cubic": (0.0, 0.0, 3.0, -2.0), "quintic": (0.0, 0.0, 0.0, 10.0, -15.0, 6.0)}


class RampWinding(PrescribedWinding):
    """Speed rising as a smooth step p(s), s = t / duration, and constant from then on.

    cubic: p = 3 s^2 - 2 s^3 (acceleration continuous); quintic: p = 10 s^3 - 15 s^4 + 6 s^5
    (jerk continuous).  Either winds half of speed * duration during the ramp.

    >>> winding = RampWinding(speed=0.1, duration=2.0)
    >>> winding.wound(2.0), winding.wound_rate(2.0)
    (0.1, 0.1)
    """

    kind: Literal["ramp"] = "ramp"
    speed: Speed
    """Speed after the ramp; negative pays out."""
    duration: Second
    """Time from standstill to full speed."""
    shape: Literal["cubic", "quintic"] = "quintic"
    """How smooth the ramp is: continuous acceleration (cubic) or jerk (quintic)."""

    def usual_speed(self) -> float:
        """The speed after the ramp, in m/s."""
        return abs(self.speed)

    def breaks(self) -> tuple[float, ...]:
        """The end of the ramp, s."""
        return (self.duration,)

    def wound(self, time: float) -> float:
        """Rope taken up, in metre."""
        phase = min(max(time / self.duration, 0.0), 1.0)
        ramp = sum(c * phase ** (k + 1) / (k + 1) for k, c in enumerate(_RATE[self.shape]))
        return self.speed * (self.duration * ramp + max(time - self.duration, 0.0))

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s."""
        phase = min(max(time / self.duration, 0.0), 1.0)
        return self.speed * sum(c * phase**k for k, c in enumerate(_RATE[self.shape]))
