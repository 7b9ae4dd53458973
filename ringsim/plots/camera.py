"""Orthographic view of points in space: true to scale, so one scale bar is enough."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A far observer above the horizon; angles in degree, azimuth from +x towards +y."""

    azimuth: float
    elevation: float

    def view(self, points: Array) -> tuple[Array, Array]:
        """Project points.

        Parameters
        ----------
        points
            Positions, shape (..., 3), in metre, z up.

        Returns
        -------
        tuple[Array, Array]
            Right and up on the paper, shape (..., 2), and nearness to the observer, shape
            (...,), all in metre.
        """
        a, e = np.radians([self.azimuth, self.elevation])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        up = np.cross(towards, right)
        return points @ np.stack([right, up], axis=-1), points @ towards
