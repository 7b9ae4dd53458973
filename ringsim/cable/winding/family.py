"""The family of winding laws: how much rope a winch has taken up, and how fast."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from ringsim.units import Model


@dataclass(frozen=True)
class WinchReading:
    """Readings of a winch at the beginning of a step."""

    tension_ratio: Callable[[float], float]
    """Tension at the winch over the mean tension of the rope as a function of the winch's
    speed (m/s), not falling; 1 without friction."""
    path_rate: float
    """Rate of the path length and of another winch on the same rope, in m/s: negative while
    the structure gives rope free."""
    path_slope: float
    """Derivative of the ideal path length after the measured opening angle, in m/rad."""


class Winding(Model):
    """Any winding law; time counts from the start of its winch."""

    def usual_speed(self) -> float:
        """Speed of the winch for most of its time, m/s, as far as known beforehand; never negative.

        The friction of the pulleys is regularised below it (``ringsim.cable.regularisation``).
        """
        raise NotImplementedError

    def breaks(self) -> tuple[float, ...]:
        """Times at which the law is not smooth, s: steps end there."""
        return ()

    def available_tension(self, *, at_speed: bool = False, losses: float = 1.0) -> float:
        """Tension against which the winch still winds, N, at its commanded speed or however slowly;
        infinite if it is any.  ``losses`` is how many times the losses of its gear count.
        """
        return math.inf

    def commanded_speed(self) -> float:
        """Speed that the winch is told to keep, in m/s; 0 if none is."""
        return 0.0


class PrescribedWinding(Winding):
    """A law of time alone."""

    def rests_from(self) -> float:
        """Time after which the drum never turns again, s; infinite if it always does."""
        return 0.0 if self.usual_speed() == 0.0 else math.inf

    def wound(self, time: float) -> float:
        """Rope taken up since the start, in metre."""
        raise NotImplementedError

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s; the value from the right where it jumps."""
        raise NotImplementedError


class FeedbackWinding(Winding):
    """A law whose speed depends on the tension, solved within the step.

    The rope is so stiff that a speed chosen from the present tension would overshoot within one
    step: the law uses the tension at the end of the step, see ``ringsim.cable.winches``.
    """

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed wanted at a tension (N), in m/s; must not grow with the tension."""
        raise NotImplementedError

    def limits(self) -> tuple[float, float]:
        """Lowest and highest speed that the motor can run at, in m/s."""
        raise NotImplementedError
