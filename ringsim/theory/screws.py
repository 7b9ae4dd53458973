"""Strains of rods' elements and gaps of joints, for numbers real and complex.

Frames are places, shape (n, 3), m, and axes, (n, 3, 3); a function of two of them has derivatives
after the first one's place and turn and the second one's, (x_1, phi_1, x_2, phi_2), by the complex
step (``ringsim.layout.pose``): exact, and without a second set of equations.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.pose import STEP, Array

Of = NDArray[Any]
"""Real or complex."""
OfTwo = Callable[[Of, Of, Of, Of], Of]
"""Place and axes of a first and a second frame give numbers, shape (n, m)."""


def values_and_slopes(function: OfTwo, ends: tuple[Array, ...]) -> tuple[Array, Array]:
    """Values, shape (n, m), and derivatives, (n, m, 12), at places and axes of n pairs."""
    values = np.asarray(function(*ends), dtype=float)
    slopes = np.empty((*values.shape, 12))
    unit = np.eye(3)
    for k in range(12):
        moved: list[Of] = [*ends]
        where, axis = 2 * (k // 6) + (k % 6) // 3, unit[k % 3]
        by = axis if k % 6 < 3 else np.cross(axis, ends[where], axisb=1, axisc=1)
        moved[where] = ends[where] + 1j * STEP * by
        slopes[..., k] = function(*moved).imag / STEP
    return values, slopes


def strains(lengths: Array) -> OfTwo:
    """Strains u (m) and psi (rad) of elements with these natural lengths (m), shape (n, 6).

    Those of ``ringsim.frame.element``: u = Z R^T d - L e_x and psi = log(R_1^T R_2), with series
    for psi, which is below 0.1 rad wherever rods hardly bend: what they leave out is below 1e-11.
    """

    def of(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
        between = np.swapaxes(r1, 1, 2) @ r2
        sine = 0.5 * _axial(between - np.swapaxes(between, 1, 2))
        s = np.sum(sine * sine, axis=1)[:, None]
        arc = 1 + s * (1 / 6 + s * (3 / 40 + s * (15 / 336 + s * (105 / 3456 + s * 945 / 42240))))
        psi = arc * sine
        along = np.einsum("nji,nj->ni", r1 @ _turned(0.5 * psi), x2 - x1)
        square = np.sum(psi * psi, axis=1)[:, None]
        c = -(1 / 24 + square * (7 / 5760 + square * (31 / 967680 + square * 127 / 154828800)))
        u = along + c * _crossed(psi, _crossed(psi, along))
        return np.concatenate([u - lengths[:, None] * np.eye(3)[0], psi], axis=1)

    return of


def apart(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second place is from the first, in space, shape (n, 3), m."""
    del r1, r2
    return x2 - x1


def aside(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second place is from the first frame's z axis, shape (n, 2), m."""
    del r2
    return np.asarray(np.einsum("nji,nj->ni", r1, x2 - x1)[:, :2])


def off_x(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second place is from the first frame's x axis, shape (n, 2), m."""
    del r2
    return np.asarray(np.einsum("nji,nj->ni", r1, x2 - x1)[:, 1:])


def tilted(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second frame's x and y axes are from normal to the first one's z, (n, 2)."""
    del x1, x2
    return np.asarray(np.einsum("nk,nki->ni", r1[:, :, 2], r2)[:, :2])


def turned_aside(x1: Of, r1: Of, x2: Of, r2: Of) -> Of:
    """How far the second frame's y axis is from normal to the first one's x, shape (n, 1)."""
    del x1, x2
    return np.asarray(np.sum(r1[:, :, 0] * r2[:, :, 1], axis=1)[:, None])


def _axial(skewed: Of) -> Of:
    """Vectors a of matrices [a], shape (n, 3)."""
    return np.stack([skewed[:, 2, 1], skewed[:, 0, 2], skewed[:, 1, 0]], axis=1)


def _crossed(a: Of, b: Of) -> Of:
    return np.cross(a, b, axis=1)


def _turned(phi: Of) -> Of:
    """Rotations by small vectors (rad), shape (n, 3, 3), by series."""
    square = np.sum(phi * phi, axis=1)[:, None, None]
    sine = 1 - square * (1 / 6 - square * (1 / 120 - square / 5040))
    cosine = 0.5 - square * (1 / 24 - square * (1 / 720 - square / 40320))
    x, y, z = phi.T
    zero = 0 * x
    spun = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    return np.asarray(np.eye(3) + sine * spun + cosine * (spun @ spun))
