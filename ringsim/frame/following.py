"""Generalised-alpha on points and angles: rates and accelerations follow from places.

Of each coordinate z of a point, or angle, the integrator keeps the rate z', the acceleration a and
the auxiliary one b (Arnold and Bruels, Multibody System Dynamics 18, 2007):

    z_1 = z_0 + h z'_0 + h^2 ((1/2 - beta) b_0 + beta b_1),
    z'_1 = z'_0 + h ((1 - gamma) b_0 + gamma b_1),
    (1 - alpha_m) b_1 + alpha_m b_0 = (1 - alpha_f) a_1 + alpha_f a_0,

solved for b_1, z'_1 and a_1.  Forces balance at the end of a step.  Points move in space, so that
bodies need no angular velocities and rods no gyroscopic terms.
"""

from typing import NamedTuple

import numpy as np

from ringsim.frame.vectors import compiled
from ringsim.layout.pose import Array


class Coefficients(NamedTuple):
    """Of generalised-alpha; Chung and Hulbert, Journal of Applied Mechanics 60, 1993."""

    alpha_m: float
    alpha_f: float
    beta: float
    gamma: float

    @classmethod
    def of(cls, radius: float) -> "Coefficients":
        """With a spectral radius at infinite frequency."""
        alpha_m, alpha_f = (2.0 * radius - 1.0) / (radius + 1.0), radius / (radius + 1.0)
        gamma = 0.5 - alpha_m + alpha_f
        return cls(alpha_m, alpha_f, 0.25 * (gamma + 0.5) ** 2, gamma)

    def acceleration_by_place(self, step: float) -> float:
        """Derivative of a_1 after z_1, 1/s^2."""
        return (1.0 - self.alpha_m) / ((1.0 - self.alpha_f) * self.beta * step**2)

    def rate_by_place(self, step: float) -> float:
        """Derivative of z'_1 after z_1, 1/s."""
        return self.gamma / (self.beta * step)


class Followed(NamedTuple):
    """Places, rates, accelerations and auxiliary ones, shape (n,) each."""

    place: Array
    rate: Array
    acceleration: Array
    auxiliary: Array

    @classmethod
    def at_rest(cls, place: Array, acceleration: Array) -> "Followed":
        """Released at rest with these accelerations."""
        return cls(place, np.zeros_like(place), acceleration, acceleration.copy())

    def copy(self) -> "Followed":
        """Arrays of its own."""
        return Followed(*(each.copy() for each in self))


@compiled
def follow(coefficients: Coefficients, step: float, start: Followed, now: Followed) -> None:
    """Rates and accelerations of ``now`` from its places and where the step has started."""
    alpha_m, alpha_f, beta, gamma = coefficients
    for k in range(len(now.place)):
        b0 = start.auxiliary[k]
        moved = now.place[k] - start.place[k] - step * start.rate[k]
        b1 = moved / (beta * step * step) - (0.5 / beta - 1.0) * b0
        now.auxiliary[k] = b1
        now.rate[k] = start.rate[k] + step * ((1.0 - gamma) * b0 + gamma * b1)
        pulled = (1.0 - alpha_m) * b1 + alpha_m * b0 - alpha_f * start.acceleration[k]
        now.acceleration[k] = pulled / (1.0 - alpha_f)
