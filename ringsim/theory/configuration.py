"""A structure with rigid rods at one instant, and how its points move there."""

from typing import NamedTuple

import numpy as np

from ringsim.layout.pose import Array


class Configuration(NamedTuple):
    """The mechanism at one instant: its n coordinates p = (q, psi) and their rates, rad and rad/s.

    ``slopes`` are derivatives of p after the free coordinates, shape (n, freedom), ``bias`` is p''
    less slopes times the free accelerations, rad/s^2; ``first`` and ``second`` are the sums of
    m P s_k and m (P s_j) (P s_k)^T over columns k of ``functions`` (those of ``Points``) and the
    first n + 1 of them j, shapes (3, n + 3) and (n + 1, n + 3, 3, 3); ``matrix`` is the mass
    matrix of (V, W, p'), shape (6 + n, 6 + n).
    """

    place: Array
    rate: Array
    slopes: Array
    bias: Array
    functions: Array
    first: Array
    second: Array
    matrix: Array

    @property
    def values(self) -> Array:
        """Functions s, so that points are at P s, shape (functions,)."""
        return self.functions[:, 0]

    @property
    def by_place(self) -> Array:
        """Derivatives of s after p, shape (functions, n)."""
        return self.functions[:, 1:-2]

    # Products of two matrices throughout: a stack of small ones takes five times as long.

    def places(self, points: Array) -> Array:
        """Of points from their coefficients; (points, 3, functions) -> (points, 3), m."""
        return np.asarray(points.reshape(-1, len(self.functions)) @ self.values).reshape(-1, 3)

    def slopes_of(self, points: Array) -> Array:
        """Their derivatives after p, shape (points, 3, n), m/rad."""
        found = points.reshape(-1, len(self.functions)) @ self.by_place
        return found.reshape(len(points), 3, -1)

    def velocities(self, points: Array) -> Array:
        """Shape (points, 3), m/s."""
        found = points.reshape(-1, len(self.functions)) @ self.functions[:, -2]
        return np.asarray(found).reshape(-1, 3)

    def along(self, points: Array, forces: Array) -> Array:
        """Generalised forces on p of forces (N) on points, shape (n,)."""
        return np.asarray(forces.ravel() @ points.reshape(-1, len(self.functions)) @ self.by_place)
