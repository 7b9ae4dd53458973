"""Accelerations of corners in joint coordinates."""

import numpy as np

from ringsim.frame.model import FrameModel
from ringsim.frame.positions import weights_of
from ringsim.frame.state import State
from ringsim.layout.bodies import OnBody
from ringsim.layout.corners import corners_of
from ringsim.layout.pose import Array


class AccelerationMeter:
    """Reads the origins of corners as means of the points with mass of their bodies."""

    def __init__(self, model: FrameModel) -> None:
        corners = corners_of(model.layout, model.scene.structure.planes)
        self.coordinates = {"corner": np.array(list(corners))}
        origins = [OnBody(body) for body in corners.values()]
        self._weights = np.array([weights_of(model.mesh, origin) for origin in origins])

    def read(self, state: State) -> Array:
        """Shape (corners, 3), m/s^2."""
        return np.asarray(self._weights @ state.acceleration.points)
