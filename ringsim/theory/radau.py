"""One step of Radau IIA (three stages, order 5, L-stable) for many second-order equations at once.

For x'' = F(x, x', t) the stages' accelerations a are the only unknowns: with the collocation
matrix A and nodes c

    x_i' = x' + h sum_j A_ij a_j,    x_i = x + h c_i x' + h^2 sum_j (A A)_ij a_j,

and Newton solves a_i = F(x_i, x_i', t + c_i h) with a 3 x 3 matrix per equation.  The error
estimate is that of Hairer and Wanner, Solving Ordinary Differential Equations II, sec. IV.8: it
is filtered by the equation's own stiffness, so that stiff parts at rest cost no step.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
Function = Callable[[Array, Array], Array]
"""F at angles and rates of shape (equations, stages * k): stages side by side k times."""

_R6 = np.sqrt(6.0)
NODES = np.array([(4.0 - _R6) / 10.0, (4.0 + _R6) / 10.0, 1.0])
A = np.array(
    [
        [(88 - 7 * _R6) / 360, (296 - 169 * _R6) / 1800, (-2 + 3 * _R6) / 225],
        [(296 + 169 * _R6) / 1800, (88 + 7 * _R6) / 360, (-2 - 3 * _R6) / 225],
        [(16 - _R6) / 36, (16 + _R6) / 36, 1 / 9],
    ]
)
AA = A @ A
WEIGHTS = A[2]
"""Quadrature weights at the nodes, exact for polynomials of degree 4."""
_E = np.array([-13.0 - 7.0 * _R6, -13.0 + 7.0 * _R6, -1.0]) / 3.0
_MU = 3.0 + 3.0 ** (2 / 3) - 3.0 ** (1 / 3)
_MOST_ITERATIONS = 12
_CLOSE = 1e-3
"""Newton stops at this fraction of the tolerance."""
_RATES = np.linalg.inv(A)
_EXTRAPOLATE = np.linalg.inv(np.vander(NODES, 3, increasing=True))


def stage_states(x: Array, v: Array, h: Array, a: Array) -> tuple[Array, Array]:
    """Angles and rates at the stages, shape (equations, 3)."""
    step = h[:, None]
    return (
        x[:, None] + step * NODES * v[:, None] + step**2 * (a @ AA.T),
        v[:, None] + step * (a @ A.T),
    )


def stage_rates(changes: Array, h: float) -> Array:
    """Rates at the stages of a quantity that has changed so much since the step's beginning.

    Their quadrature over the step is the change at its end.  Stages come first, shape (3, ...).
    """
    return np.asarray(np.tensordot(_RATES, changes, axes=1) / h)


def extrapolated(a: Array, ratio: Array) -> Array:
    """Stage accelerations of the next step from those of the last; ratio of next to last step."""
    where = 1.0 + ratio[:, None] * NODES
    powers = where[..., None] ** np.arange(3)
    return np.asarray(np.einsum("bsk,kj,bj->bs", powers, _EXTRAPOLATE, a))


def solve_stages(
    function: Function,
    state: tuple[Array, Array, Array],
    guess: Array,
    nudge: tuple[Array, Array],
    tolerance: tuple[Array, Array],
) -> tuple[Array, Flags, Array]:
    """Accelerations of the stages by Newton's method.

    Parameters
    ----------
    function
        F at the stages' times; called with one or three copies of the stages side by side.
    state
        Angle, rate and step, shape (equations,) each.
    guess
        Shape (equations, 3).
    nudge
        Increments of angle and rate for the derivatives, shape (equations,).
    tolerance
        Accepted error of angle and rate, shape (equations,).

    Returns
    -------
    tuple
        Accelerations (equations, 3), whether Newton converged, iterations (equations,).

    """
    x, v, h = state
    a = guess.copy()
    count = len(x)
    converged = np.zeros(count, dtype=bool)
    broken = np.zeros(count, dtype=bool)
    iterations = np.zeros(count)
    last = np.full(count, np.inf)
    step = h[:, None]
    dx, dv = nudge[0][:, None], nudge[1][:, None]
    inverse = np.zeros((count, 3, 3))
    refresh = True
    for _ in range(_MOST_ITERATIONS):
        xs, vs = stage_states(x, v, h, a)
        if refresh:
            found = function(
                np.concatenate([xs, xs + dx, xs], axis=1), np.concatenate([vs, vs, vs + dv], axis=1)
            )
            value = found[:, :3]
            by_x, by_v = (found[:, 3:6] - value) / dx, (found[:, 6:] - value) / dv
            matrix = np.eye(3) - ((step**2 * by_x)[..., None] * AA + (step * by_v)[..., None] * A)
            usable = np.isfinite(matrix).all(axis=(1, 2))
            matrix[~usable] = np.eye(3)
            inverse = np.linalg.inv(matrix)
            broken |= ~usable
        else:
            value = function(xs, vs)
        change = np.einsum("bij,bj->bi", inverse, value - a)
        active = ~converged & ~broken
        size = np.maximum(
            np.abs(step**2 * (change @ AA.T)).max(axis=1) / tolerance[0],
            np.abs(step * (change @ A.T)).max(axis=1) / tolerance[1],
        )
        broken |= active & ~np.isfinite(size)
        active &= ~broken
        a[active] += change[active]
        iterations += active
        shrink = np.where(np.isfinite(last), size / np.maximum(last, 1e-300), 0.5)
        shrink = np.minimum(shrink, 0.9)
        converged |= active & (shrink / (1.0 - shrink) * size < _CLOSE)
        waiting = active & ~converged
        if not waiting.any():
            break
        refresh = bool((shrink[waiting] > 0.05).any())
        last = size
    return a, converged, iterations


def error_size(
    state: tuple[Array, Array, Array],
    a: Array,
    start: tuple[Array, Array, Array],
    scale: tuple[Array, Array],
) -> Array:
    """Estimated error over its tolerance, shape (equations,).

    Parameters
    ----------
    state, a
        As for ``solve_stages``.
    start
        F, dF/dx and dF/dx' at the beginning of the step.
    scale
        Tolerances of angle and rate.

    """
    x, v, h = state
    force, by_x, by_v = start
    xs, vs = stage_states(x, v, h, a)
    from_x = v + (xs - x[:, None]) @ _E / h
    from_v = force + (vs - v[:, None]) @ _E / h
    m = _MU / h
    error_x = (from_x * (m - by_v) + from_v) / (m * (m - by_v) - by_x)
    error_v = m * error_x - from_x
    return np.asarray(np.sqrt(0.5 * ((error_x / scale[0]) ** 2 + (error_v / scale[1]) ** 2)))
