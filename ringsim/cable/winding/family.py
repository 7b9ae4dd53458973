"""The family of winding laws: how much rope a winch has taken up, and how fast."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ringsim.cable.slack import tension
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
    """What a winch can know of its rope at the beginning of a step.

    Attributes
    ----------
    stretch
        Path length minus natural length of the rope, in metre; negative when slack.
    natural_length
        Rope not yet wound, in metre.
    axial_stiffness, damping_time, slack_width
        EA (N), Kelvin-Voigt time (s) and smoothing width (N) of the rope.
    tension_ratio
        Tension at the winch over the mean tension of the rope as a function of the winch's
        speed (m/s), not falling; 1 without friction.
    path_rate
        Rate of the path length and of another winch on the same rope, in m/s: negative while
        the structure gives rope free.
    path_slope
        Derivative of the ideal path length after the opening angle at the measured angles, in
        m/rad.

    """

    stretch: float
    natural_length: float
    axial_stiffness: float
    damping_time: float
    slack_width: float
    tension_ratio: Callable[[float], float]
    path_rate: float = 0.0
    path_slope: float = 0.0

    def tension_after(self, duration: float, speed: float) -> float:
        """Tension at the winch (N) once it has wound at ``speed`` for ``duration``.

        The structure is taken to move on at its present rate.
        """
        rate = speed + self.path_rate
        stretch = self.stretch + rate * duration + self.damping_time * rate
        force = np.asarray(self.axial_stiffness * stretch / self.natural_length)
        mean = float(tension(force, np.asarray(self.slack_width)))
        return self.tension_ratio(speed) * mean


class Winding(Model):
    """Any winding law; time counts from the start of its winch."""

    feedback: ClassVar[bool]
    """Whether the law needs readings of the rope."""


class PrescribedWinding(Winding):
    """A law that is known beforehand."""

    feedback: ClassVar[bool] = False

    def wound(self, time: float) -> float:
        """Rope taken up since the start, in metre."""
        raise NotImplementedError

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s; the value from the right where it jumps."""
        raise NotImplementedError


class FeedbackWinding(Winding):
    """A law whose speed answers to the rope, chosen anew for every step and held through it.

    The rope is so stiff that a speed chosen from the present tension would overshoot within
    one step.  The law therefore answers to the tension at the END of the step, predicted by
    the reading: speed v solves v = command(T(v)).  T grows with v and the command falls with
    T, so there is one solution for any EA and step, and the loop cannot run away.
    """

    feedback: ClassVar[bool] = True

    def command(self, tension: float, reading: WinchReading) -> float:
        """Speed wanted at a tension (N), in m/s; must not grow with the tension."""
        raise NotImplementedError

    def limits(self) -> tuple[float, float]:
        """Lowest and highest speed that the motor can run at, in m/s."""
        raise NotImplementedError

    def advance(
        self, time: float, duration: float, reading: WinchReading, state: WinchState
    ) -> WinchState:
        """The state at ``time`` with the speed to hold for ``duration``.

        The equation is solved by bisection to 1e-12 of the motor's range.
        """
        slowest, fastest = low, high = self.limits()

        def excess(speed: float) -> float:
            wanted = self.command(reading.tension_after(duration, speed), reading)
            return speed - min(max(wanted, slowest), fastest)

        if excess(high) <= 0.0:
            low = high
        for _ in range(40):
            if low == high:
                break
            middle = 0.5 * (low + high)
            if excess(middle) <= 0.0:
                low = middle
            else:
                high = middle
        return WinchState(time, state.at(time).wound, low)
