"""Accelerations of corners in joint coordinates."""

import numpy as np

from ringsim.frame.model import FrameModel
from ringsim.frame.positions import weights_of
from ringsim.frame.state import State
from ringsim.layout.bodies import OnBody
from ringsim.layout.pose import Array


class AccelerationMeter:
    """Reads the origins of corners as means of the points with mass of their bodies."""

    def __init__(self, model: FrameModel) -> None:
        corners = model.layout.corners
        self.coordinates = {"corner": np.arange(1, len(corners[0]) + 1)}
        self._weights = np.array(
            [[weights_of(model.mesh, OnBody(body)) for body in plane] for plane in corners]
        )

    def read(self, state: State) -> Array:
        """Shape (planes, corners, 3), m/s^2."""
        return np.asarray(self._weights @ state.acceleration.points)
