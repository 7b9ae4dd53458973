"""Pulley friction: how much of a rope's tension each pulley leaves to the next span."""

import math
from collections.abc import Sequence
from typing import Any, ClassVar, Literal, NamedTuple, Self

import numpy as np

from ringsim.cable.ropes import Array
from ringsim.units import FrictionCoefficient, MetreOrZero, Model, PerPulley

# Slip speed that regularises pulley friction, and the error that it causes at low speed.
#
# Friction reverses with the rope; p_j = tanh(s_j / s_slip) of the full decay makes that smooth
# (``ringsim.core.tension``).  On a ring of N sections that open evenly the 2 N spans beside the
# V pulleys give the rope free, so a pulley with m of them beyond it sees
#
#     s = m v,   v = winding speed / (2 N) = 1.5 winding speed / (spans of the cable),
#
# falling to v at the V pulley next to the fixed end; with two winches m counts from where the rope
# rests between them.  The tension there is too high by
#
#     exp(sum over pulleys of |ln eta| (1 - tanh(m v / s_slip))) - 1,
#
# which hardly depends on N; docs/theory/truss2.md lists it.


LARGEST_SLIP_SPEED = 2e-4
"""Metre per second; the slip speed of rope that is wound fast, or not at all."""
SHARE = 0.5
"""Slip speed over the winding speed per span: the slowest pulley has tanh(3) = 0.995 of its
friction, an excess of 0.03 % at f / R = 0.04 and below 1 % up to f / R = 0.9."""
TOLERATED = 0.01
"""Relative error of the far end's tension below which a run does not mention it."""
_MOVES = 1e-3
"""Share of the largest winding speed above which a winch counts as turning."""


def slip_speed(winding: float, pulleys: int) -> float:
    """The slip speed (m/s) that suits a winding speed (m/s, of all winches of a cable).

    >>> round(slip_speed(winding=6e-4, pulleys=5), 9)
    5e-05
    """
    if winding <= 0.0:
        return LARGEST_SLIP_SPEED
    return min(LARGEST_SLIP_SPEED, SHARE * winding / (pulleys + 1))


def excess(slip: float, winding: float, pulleys: int, decay: float) -> float:
    """Relative excess of the tension where the rope is slowest.

    Slip speed and winding speed are in m/s; ``decay`` is the largest -ln(eta) of the pulleys.
    """
    spans = np.arange(1, max(2 * (pulleys + 1) // 3, 2))
    alike = 2.0 - spans % 2  # one V pulley, then the two hinge pulleys of neighbouring sections
    faded = 1.0 - np.tanh(spans * 1.5 * winding / (pulleys + 1) / slip)
    return math.expm1(decay * float(alike @ faded))


def usual_winding(times: Array, wound: Array) -> float:
    """Median speed (m/s) of winches while they turn, from rope wound (m) at times (s)."""
    known = np.isfinite(wound)
    speed = np.abs(np.diff(wound[known])) / np.diff(times[known])
    moving = speed[speed > _MOVES * speed.max(initial=0.0)]
    return float(np.median(moving)) if len(moving) else 0.0


# The family of friction laws: the loss of tension over a pulley.


class Pulleys(NamedTuple):
    """What friction laws see of pulleys, shape (pulleys,) each.

    ``angle`` between the two pulls (rad: pi where the rope runs straight through, 0 where it turns
    back on itself); ``speed`` of the rope over it, at least 0 m/s; ``tension``, the mean of both
    sides, at least ``LEAST_TENSION``, N.
    """

    angle: Any
    speed: Any
    tension: Any


LEAST_TENSION = 1e-6
"""Newton; a law that divides by the tension of a rope that hangs slack has no answer."""
_NUDGE = 1e-6
"""Change of angle (rad), or share of the speed, by which slopes are measured of laws that do not
tell them: central differences are off by its square."""
_SLOWEST = 1e-9
"""Change of speed at least, m/s."""


class PulleyFriction(Model):
    """Ratio eta of the tension behind a pulley to the tension before it, seen from the winch.

    It holds while rope runs to the winch.  A kind defines ln(eta), at most 0: by ``log_decay`` and
    its derivative ``log_slope`` if it depends on the angle alone, else by ``decay``, and says so
    with ``moves`` and ``loads``.  The logarithm keeps long products of weak pulleys exact.
    """

    moves: ClassVar[bool] = False
    """Whether it depends on the speed of the rope."""
    loads: ClassVar[bool] = False
    """Whether it depends on its tension: then the tensions of a rope are solved for."""

    @property
    def coefficients(self) -> Array:
        """Its field ``coefficient``, if it has one: shape (), or (pulleys,) for one each."""
        return np.asarray(getattr(self, "coefficient", 0.0), dtype=float)

    def refusal(self, radius: float) -> str | None:
        """Why the law has no solution on pulleys of this radius (m), or None if it has."""
        return None

    def factored(self, factor: float) -> Self:
        """The law with its coefficients multiplied; see ``bound_decay`` for what that may break."""
        if "coefficient" not in type(self).model_fields:
            return self
        own = self.coefficients * factor
        return self.model_copy(update={"coefficient": tuple(own) if own.ndim else float(own)})

    def bound_decay(self, pulleys: Pulleys, radius: float) -> Array:
        """ln(eta) of a law that was factored: minus infinity where it has no solution any more."""
        if self.refusal(radius) is not None:
            with np.errstate(all="ignore"):
                found = np.asarray(self.decay(pulleys, radius))
                return np.asarray(np.nan_to_num(found, nan=-np.inf, neginf=-np.inf))
        return np.asarray(self.decay(pulleys, radius))

    def decay(self, pulleys: Pulleys, radius: float) -> Any:
        """ln(eta) of pulleys of ``radius`` (m)."""
        return self.log_decay(pulleys.angle, radius)

    def by_angle(self, pulleys: Pulleys, radius: float) -> Any:
        """Derivative of ``decay`` after the angle, 1/rad."""
        if not (self.moves or self.loads):
            return self.log_slope(pulleys.angle, radius)
        ahead, behind = (
            self.decay(pulleys._replace(angle=pulleys.angle + by), radius)
            for by in (_NUDGE, -_NUDGE)
        )
        return (ahead - behind) / (2.0 * _NUDGE)

    def by_speed(self, pulleys: Pulleys, radius: float) -> Any:
        """Derivative of ``decay`` after the speed, s/m."""
        if not self.moves:
            return 0.0 * pulleys.speed
        by = np.maximum(_NUDGE * pulleys.speed, _SLOWEST)
        # One-sided next to rest, where there is no smaller speed.
        slower = np.maximum(pulleys.speed - by, 0.0)
        ahead, behind = (
            self.decay(pulleys._replace(speed=speed), radius)
            for speed in (pulleys.speed + by, slower)
        )
        return (ahead - behind) / (pulleys.speed + by - slower)

    def log_decay(self, angle: Array, radius: float) -> Array:
        """ln(eta) for the angles (rad, shape (pulleys,)) on pulleys of ``radius`` (m)."""
        raise NotImplementedError

    def log_slope(self, angle: Array, radius: float) -> Array:
        """Derivative of ln(eta) after the angle, in 1/rad; same shapes."""
        raise NotImplementedError


# What friction laws of all cables say, and the tensions that those of tension depend on.


class Friction:
    """Laws with the radius (m) of their pulleys and which of all pulleys these are."""

    def __init__(self, own: Sequence[tuple[PulleyFriction, float, slice]]) -> None:
        self._own = tuple(own)
        self.moves = any(law.moves for law, *_ in self._own)
        self.loads = any(law.loads for law, *_ in self._own)

    def decays(self, pulleys: Pulleys) -> Array:
        """ln(eta) of all pulleys, shape (pulleys,)."""
        return self._each("decay", pulleys)

    def by_angle(self, pulleys: Pulleys) -> Array:
        """Derivatives after the angles, 1/rad."""
        return self._each("by_angle", pulleys)

    def by_speed(self, pulleys: Pulleys) -> Array:
        """Derivatives after the speeds, s/m."""
        return self._each("by_speed", pulleys)

    def _each(self, name: str, pulleys: Pulleys) -> Array:
        return np.concatenate(
            [
                getattr(law, name)(Pulleys(*(each[n] for each in pulleys)), radius)
                for law, radius, n in self._own
            ]
        )


MOST_SOLVED = 60
"""Most repetitions for tensions on which friction depends."""
SOLVED = 1e-13
"""Change of an exponent's logarithm at which they are found: round-off leaves 1e-15."""
UNSOLVED = (
    "no equilibrium of rope tension and pulley friction was found, because the friction depends "
    "too strongly on tension: reduce this dependence, or raise the tension"
)
"""Why a chain has no answer."""


# Friction in the pulley's bearing, in the closed form of paper 000.


class Bearing(PulleyFriction):
    """Any law of a pulley's bearing with the friction moment f times the radial force."""

    coefficient: PerPulley[MetreOrZero]
    """f in metre: one value for all pulleys, or one for each in order from the winch."""

    def refusal(self, radius: float) -> str | None:
        """Bound f < R: otherwise a rope that turns back could not be pulled over the pulley."""
        worst = float(np.max(self.coefficients))
        if worst < radius:
            return None
        return (
            f"friction.coefficient = {worst:g} m must be below pulley_radius = {radius:g} m: the "
            "bearing would hold any tension where the rope turns back by 180 deg (lower it, or "
            "use a larger pulley)"
        )


class BearingFriction(Bearing):
    """eta = (R - f cos(a/2)) / (R + f cos(a/2)), that is ln(eta) = -2 artanh((f/R) cos(a/2)).

    f is the bearing's friction moment over its radial force: Palmgren's constant times the
    pitch diameter.  Source: paper 000, eqs 11 and 19.  With the radial force taken as 2 cos(a/2)
    times the mean of the two tensions, ln(eta) is smaller than the exact one ("bearing-exact") in
    magnitude by (f/R)^3 cos(a/2) sin(a/2)^2 + O((f/R)^5), at most 0.385 (f/R)^3.

    >>> law = BearingFriction(coefficient=0.0004)
    >>> round(float(np.exp(law.log_decay(np.array([0.5 * np.pi]), 0.01))[0]), 6)
    0.944987
    """

    kind: Literal["bearing"] = "bearing"

    def log_decay(self, angle: Array, radius: float) -> Array:
        """ln(eta) = -2 artanh((f/R) cos(a/2))."""
        return np.asarray(-2.0 * np.arctanh(self.coefficients / radius * np.cos(0.5 * angle)))

    def log_slope(self, angle: Array, radius: float) -> Array:
        """(f/R) sin(a/2) / (1 - (f/R)^2 cos(a/2)^2)."""
        ratio = self.coefficients / radius
        lost = (ratio * np.cos(0.5 * angle)) ** 2
        return np.asarray(ratio * np.sin(0.5 * angle) / (1.0 - lost))


# Friction in the pulley's bearing, without approximation.


class ExactBearingFriction(Bearing):
    """The root below 1 of R (1 - eta) = f sqrt(1 + eta^2 + 2 eta cos a).

    With k = f/R the balance squared is (1 - k^2)(1 + eta^2) = 2 (1 + k^2 cos a) eta.  Its two
    roots are each other's inverse, one for each direction of the rope; the one below 1 is

        eta = (q - k cos(a/2)) / (q + k cos(a/2)),   q = sqrt(1 - k^2 sin(a/2)^2),

    as q^2 - k^2 cos(a/2)^2 = 1 - k^2.  The closed form (kind "bearing") is the case q = 1; both
    agree for a = 0 and a = pi.  Source of the balance: paper 000, eq. 18.

    >>> law = ExactBearingFriction(coefficient=0.0004)
    >>> round(float(np.exp(law.log_decay(np.array([0.5 * np.pi]), 0.01))[0]), 6)
    0.944966
    """

    kind: Literal["bearing-exact"] = "bearing-exact"

    def log_decay(self, angle: Array, radius: float) -> Array:
        """ln(eta) = -2 artanh(k cos(a/2) / q)."""
        ratio = self.coefficients / radius
        root = np.sqrt(1.0 - (ratio * np.sin(0.5 * angle)) ** 2)
        return np.asarray(-2.0 * np.arctanh(ratio * np.cos(0.5 * angle) / root))

    def log_slope(self, angle: Array, radius: float) -> Array:
        """The derivative k sin(a/2) / q."""
        lateral = self.coefficients / radius * np.sin(0.5 * angle)
        return np.asarray(lateral / np.sqrt(1.0 - lateral**2))


# A rope that slides on fixed sheaves.


class CapstanFriction(PulleyFriction):
    """eta = exp(-mu (pi - a)): dry friction along the wrap angle pi - a.

    Source: Euler-Eytelwein.  Independent of the radius of the sheave.

    >>> law = CapstanFriction(coefficient=0.25)
    >>> float(law.log_decay(np.array([0.0]), 0.01)[0]) == -0.25 * np.pi
    True
    """

    kind: Literal["capstan"] = "capstan"
    coefficient: PerPulley[FrictionCoefficient]
    """mu: one value for all sheaves, or one for each in order from the winch."""

    def log_decay(self, angle: Array, radius: float) -> Array:
        """ln(eta) = -mu (pi - a)."""
        return np.asarray(-self.coefficients * (np.pi - angle))

    def log_slope(self, angle: Array, radius: float) -> Array:
        """The coefficient mu, whatever the angle."""
        return np.broadcast_to(self.coefficients, angle.shape).astype(float)


# Pulleys without friction.


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
