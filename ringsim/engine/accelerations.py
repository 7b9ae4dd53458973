"""Accelerations of corners in exudyn."""

import exudyn as exu
import numpy as np

from ringsim.engine.model import Multibody
from ringsim.engine.rotations import Array
from ringsim.layout.corners import corners_of


class AccelerationMeter:
    """Reads the nodes of corners."""

    def __init__(self, model: Multibody) -> None:
        corners = corners_of(model.layout, model.scene.structure.planes)
        self.coordinates = {"corner": np.array(list(corners))}
        nodes = [model.bodies[body][1] for body in corners.values()]
        self._where = np.array([model.assembly.coordinates_of(node)[:3] for node in nodes])
        self._data = model.assembly.system.systemData
        # exudyn's solver takes the initial ones over in its first step.
        self._next = exu.ConfigurationType.Initial

    def read(self) -> Array:
        """Shape (corners, 3), m/s^2, at the current state."""
        found = self._data.GetODE2Coordinates_tt(self._next)
        self._next = exu.ConfigurationType.Current
        return np.asarray(np.asarray(found, dtype=float)[self._where])
