"""Tension without compression: a smooth passage from slack to taut, and its energy.

With width b (N) the elastic force y (N, negative when the rope is longer than its path) gives

    tension   q(y) = b ln(1 + exp(y / b)),           q(0) = 0.693 b,
    slope     q'(y) = 1 / (1 + exp(-y / b)),
    energy    integral of q dy from -inf = b^2 (-Li2(-exp(y / b))).

Above y = 10 b the tension exceeds y by less than 5e-5 b, below y = -10 b it is less than that.
"""

import numpy as np

from ringsim.cable.ropes import Array

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS

_SLACKEST = -200.0
"""y / b below which the tension stays as it is: exp(-200) = 1e-87 is nothing beside any force, and
its square and its inverse are still doubles."""

_TAUT = 40.0
"""y / b above which exp(-y / b) is lost in the round-off of y^2."""


def tension(force: Array, width: Array) -> Array:
    """q(y) in N.

    >>> tension(np.array([-1.0, 0.0, 1.0]), np.array(0.05)).round(4)
    array([0.    , 0.0347, 1.    ])
    """
    return np.asarray(width * np.logaddexp(0.0, np.maximum(force / width, _SLACKEST)))


def slope(force: Array, width: Array) -> Array:
    """q'(y), between 0 (slack) and 1 (taut)."""
    return np.asarray(0.5 + 0.5 * np.tanh(0.5 * force / width))


def energy(force: Array, width: Array) -> Array:
    """Integral of q from -inf to y, in N^2; divided by EA it is an energy per length.

    The dilogarithm comes from -Li2(-s) = integral of ln(1 + s v) / v dv over (0, 1) for
    s <= 1, by 24 Gauss-Legendre nodes (error below 1e-14), and beyond that from its inversion
    -Li2(-exp z) = z^2 / 2 + pi^2 / 6 + Li2(-exp(-z)).
    """
    z = np.asarray(force / width, dtype=float)
    if z.min() > _TAUT:
        return np.asarray(width**2 * (0.5 * z**2 + np.pi**2 / 6.0))
    small = np.exp(-np.abs(z))
    kernel = np.log1p(small[..., None] * _NODES) / _NODES
    tail = np.asarray(kernel @ _WEIGHTS)
    whole = np.where(z > 0.0, 0.5 * z**2 + np.pi**2 / 6.0 - tail, tail)
    return np.asarray(width**2 * whole)
