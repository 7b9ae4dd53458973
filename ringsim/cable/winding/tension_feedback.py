"""Winding that controls the tension of the rope, from measured bar angles."""

from typing import Literal

from ringsim.cable.winding.family import FeedbackWinding, WinchReading
from ringsim.units import AngularRate, ControlGain, PositiveSpeed, SpeedOrZero, Tension


class TensionFeedbackWinding(FeedbackWinding):
    """Wind as fast as the ideal geometry takes up rope, corrected by the tension's error.

        speed = take-up + gain * (target - T),   cut to -max_payout .. max_speed

    The measured angles give the path of the rope, hence its stretch and its tension, without
    a force sensor.  The take-up is -dS/d(delta) * opening_rate, the speed that lets the sections
    open at that rate: almost nothing at the stowed end, where a constant speed starts with a jerk.
    Without an opening rate it is the measured -dS/dt: T then settles at the target within a time
    of S / (EA * gain), whatever the structure does below max_speed.

    Paper 000 proposes control on measured angles as further work; the law is this project's.
    """

    kind: Literal["tension-feedback"] = "tension-feedback"
    target: Tension
    """Tension wanted at the winch."""
    gain: ControlGain = 0.02
    """Added speed per newton of missing tension."""
    max_speed: PositiveSpeed
    """Fastest winding of the motor."""
    max_payout: SpeedOrZero = 0.0
    """Fastest paying out; 0: it never pays out."""
    opening_rate: AngularRate | None = None
    """Wanted rate of the opening angle; left out, the winch follows the structure."""

    def usual_speed(self) -> float:
        """The speed, in m/s, at which it takes up a slack rope while nothing else moves."""
        return min(self.gain * self.target, self.max_speed)

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed wanted at a tension (N), in m/s."""
        if self.opening_rate is None:
            takeup = -reading.path_rate
        else:
            takeup = -reading.path_slope * self.opening_rate
        return takeup + self.gain * (self.target - tension)

    def limits(self) -> tuple[float, float]:
        """From paying out to winding in."""
        return -self.max_payout, self.max_speed
