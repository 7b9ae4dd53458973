"""Euler parameters (scalar first), vectorised over nodes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def of_axes(axes: Array) -> Array:
    """Unit quaternion of a rotation matrix, shape (4,), by its largest component."""
    trace = np.trace(axes)
    squares = 0.25 * np.array([1.0 + trace, *(1.0 - trace + 2.0 * np.diag(axes))])
    largest = int(np.argmax(squares))
    size = np.sqrt(squares[largest])
    skew = 0.25 * np.array(
        [axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]]
    )
    if largest == 0:
        return np.array([size, *(skew / size)])
    row = 0.25 * (axes + axes.T)[largest - 1]
    found = np.array([skew[largest - 1] / size, *(row / size)])
    found[largest] = size
    return found


def product(a: Array, b: Array) -> Array:
    """Hamilton product of two quaternions, shape (4,)."""
    return np.array(
        [
            a[0] * b[0] - a[1:] @ b[1:],
            *(a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])),
        ]
    )


def axes_of(q: Array) -> Array:
    """Rotation matrices, shape (n, 3, 3), of unit quaternions, shape (n, 4)."""
    w, x, y, z = q.T
    return np.stack(
        [
            np.stack([w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)], -1),
            np.stack([2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)], -1),
            np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z], -1),
        ],
        axis=-2,
    )


def angular_velocity(q: Array, rate: Array) -> Array:
    """Global angular velocity 2 q_dot q*, shape (n, 3), rad/s."""
    w, v = q[:, :1], q[:, 1:]
    return 2.0 * (w * rate[:, 1:] - rate[:, :1] * v - np.cross(rate[:, 1:], v))
