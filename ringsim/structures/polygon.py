"""Equal-chord polygons inscribed in an ellipse: the plan view of a ring."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def corners(sides: int, aspect_ratio: float) -> Array:
    """Corners of the closed polygon with equal chords of length 1, inscribed in an ellipse.

    The first corner lies on the major axis (+x), the polygon runs anticlockwise and is
    centred on the origin.  The unknowns are the ellipse parameters of the other corners and
    the chord; Newton's method starts from the regular polygon and converges quadratically.

    Parameters
    ----------
    sides
        Number of chords, at least 3.
    aspect_ratio
        Minor axis over major axis of the ellipse, in (0, 1].

    Returns
    -------
    Array
        Shape (sides, 3), in units of the chord, z = 0.

    Raises
    ------
    ValueError
        If the polygon does not exist or is not found.
    """
    if sides < 3:
        raise ValueError(f"a closed polygon needs at least 3 sides, not {sides}")
    if not 0.0 < aspect_ratio <= 1.0:
        raise ValueError(f"aspect_ratio = {aspect_ratio} must be in (0, 1]")
    return _found(sides, aspect_ratio).copy()


@functools.lru_cache(maxsize=64)
def _found(sides: int, aspect_ratio: float) -> Array:
    """The corners; kept, because the scenes of a campaign ask for the same ones again and again."""
    ratio = 1.0
    parameters = 2.0 * np.pi * np.arange(sides) / sides
    steps = 1 + int(np.ceil(8 * np.log(1.0 / aspect_ratio)))
    for ratio in aspect_ratio ** (np.arange(1, steps + 1) / steps):
        parameters, chord = _solve(parameters, float(ratio))
    points = np.stack([np.cos(parameters), ratio * np.sin(parameters), np.zeros(sides)], axis=-1)
    found: Array = points / chord
    return found


def _solve(parameters: Array, ratio: float) -> tuple[Array, float]:
    """Newton's method on |r(t_k+1) - r(t_k)|^2 = c^2, k = 0..sides-1, with t_0 = 0 fixed."""
    sides = len(parameters)
    t = parameters.copy()
    square = 4.0 * np.sin(np.pi / sides) ** 2 * (0.5 * (1.0 + ratio**2))
    this, following = np.arange(sides), (np.arange(sides) + 1) % sides
    for _ in range(60):
        x, y = np.cos(t), ratio * np.sin(t)
        dx, dy = x[following] - x, y[following] - y
        residual = dx**2 + dy**2 - square
        jacobian = np.zeros((sides, sides + 1))
        jacobian[this, this] = -2.0 * (-dx * np.sin(t) + dy * ratio * np.cos(t))
        jacobian[this, following] += 2.0 * (
            -dx * np.sin(t[following]) + dy * ratio * np.cos(t[following])
        )
        jacobian[:, sides] = -1.0
        change = np.linalg.solve(jacobian[:, 1:], -residual)
        scale = min(1.0, 0.5 / sides / max(np.abs(change[:-1]).max(), 1e-300) * 2.0 * np.pi)
        t[1:] += scale * change[:-1]
        square += scale * change[-1]
        if np.abs(change[:-1]).max() < 1e-14 * sides:
            break
    if not (np.all(np.diff(t) > 0.0) and t[-1] < 2.0 * np.pi and square > 0.0):
        raise ValueError(f"no equal-chord polygon with {sides} sides and axis ratio {ratio:.6g}")
    return t, float(np.sqrt(square))
