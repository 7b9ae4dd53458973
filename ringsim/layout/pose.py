"""Where something stands at one value of a structure's coordinate, and how it moves with it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 1e-30
"""Imaginary part of the coordinate at which a layout is built: f(q + i h) = f(q) + i h f'(q), the
complex step (Squire and Trapp, SIAM Review 40, 1998), good to round-off as it subtracts nothing."""


def rate_of(values: Any) -> Array:
    """Derivative after the coordinate of something that was computed at q + i ``STEP``."""
    return np.asarray(values).imag / STEP


def real_of(values: Any) -> Array:
    """Its value at q."""
    return np.array(np.asarray(values).real, dtype=float)


@dataclass(frozen=True)
class Pose:
    """A frame and its derivative after the coordinate q.

    Origin, shape (3,), m, and axes as columns, shape (3, 3); derivative of the origin, m, and
    rotation vector per unit of q, shape (3,).

    Examples
    --------
    >>> q = 0.5 + 1j * STEP
    >>> pose = Pose.of([np.cos(q), np.sin(q), 0.0], turned_about_z(q))
    >>> pose.turn.round(12).tolist()
    [0.0, 0.0, 1.0]
    """

    place: Array
    axes: Array
    rate: Array
    turn: Array

    @classmethod
    def of(cls, place: Any, axes: Any) -> "Pose":
        """From an origin and axes computed at q + i ``STEP``."""
        frame = real_of(axes)
        spin = rate_of(axes) @ frame.T
        turn = 0.5 * np.array(
            [spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]
        )
        return cls(real_of(place), frame, rate_of(place), turn)

    def at(self, arm: Array) -> tuple[Array, Array]:
        """Points fixed in this frame, shape (..., 3): places, m, and derivatives, m per unit of
        q.
        """
        lever = arm @ self.axes.T
        return self.place + lever, self.rate + lever @ skew(self.turn).T


def cross(a: Any, b: Any) -> NDArray[Any]:
    """Cross product of two vectors, shape (3,), real or complex."""
    return np.array(  # numpy's own costs fifteen times as much
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def skew(r: Array) -> Array:
    """The matrix [r]x."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def turned_about_z(angle: Any) -> NDArray[Any]:
    """Axes turned about z by an angle in rad, real or complex, shape (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def axes_along(start: Any, end: Any, normal: Any) -> NDArray[Any]:
    """Axes as columns: x from start to end, z along ``normal``; real or complex, shape (3, 3)."""
    run = np.asarray(end) - np.asarray(start)
    x = run / np.sqrt(np.sum(run * run))  # no norm: it takes absolute values, which drop i STEP
    return np.array([x, cross(normal, x), normal]).T
