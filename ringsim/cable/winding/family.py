"""The family of winding laws: how much rope a winch has taken up, and how fast."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from ringsim.units import Model


@dataclass(frozen=True)
class WinchState:
    """Rope wound (m) at ``time`` (s, of the winch) and the speed (m/s) held from then on."""

    time: float = 0.0
    wound: float = 0.0
    speed: float = 0.0

    def at(self, time: float) -> WinchState:
        """The state at a later time, the speed being held."""
        return WinchState(time, self.wound + self.speed * (time - self.time), self.speed)


@dataclass(frozen=True)
class WinchReading:
    """Readings of a winch at the beginning of a step."""

    tension_ratio: Callable[[float], float]
    """Tension at the winch over the mean tension of the rope as a function of the winch's
    speed (m/s), not falling; 1 without friction."""
    path_rate: float = 0.0
    """Rate of the path length and of another winch on the same rope, in m/s: negative while
    the structure gives rope free."""
    path_slope: float = 0.0
    """Derivative of the ideal path length after the opening angle at the measured angles, in
    m/rad."""


class Winding(Model):
    """Any winding law; time counts from the start of its winch."""

    def usual_speed(self) -> float:
        """Speed at which the law winds, or pays out, for most of its time, m/s; 0 if it rests.

        As far as it is known beforehand: the friction of the pulleys is regularised
        below it, see ``ringsim.cable.regularisation``.
        """
        raise NotImplementedError


class PrescribedWinding(Winding):
    """A prescribed law."""

    def wound(self, time: float) -> float:
        """Rope taken up since the start, in metre."""
        raise NotImplementedError

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s; the value from the right where it jumps."""
        raise NotImplementedError


class FeedbackWinding(Winding):
    """A law whose speed depends on the tension, solved within the step.

    The rope is so stiff that a speed chosen from the present tension would overshoot within
    one step.  The law therefore uses the tension at the end of the step, see
    ``ringsim.cable.winches``: T grows with the speed and the command falls with T, so there is
    one solution for any EA and step, and the loop is stable.
    """

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed wanted at a tension (N), in m/s; must not grow with the tension."""
        raise NotImplementedError

    def limits(self) -> tuple[float, float]:
        """Lowest and highest speed that the motor can run at, in m/s."""
        raise NotImplementedError
