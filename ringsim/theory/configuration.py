"""A structure with rigid rods at one coordinate, and how its points move there."""

from typing import NamedTuple

import numpy as np

from ringsim.layout.pose import Array


class Configuration(NamedTuple):
    """The mechanism at a coordinate q (rad), which grows at 1 rad/s.

    ``values`` and ``slopes`` are the functions s of ``Points`` and their derivatives after q, shape
    (functions,); ``matrix`` is the mass matrix of (V, W, q'), shape (7, 7).
    """

    place: float
    values: Array
    slopes: Array
    matrix: Array

    def places(self, points: Array) -> Array:
        """Of points from their coefficients; (points, 3, functions) -> (points, 3), m."""
        return np.asarray(points @ self.values)

    def velocities(self, points: Array) -> Array:
        """Shape (points, 3), m/s, in the layout's rates: without V and W."""
        return np.asarray(points @ self.slopes)
