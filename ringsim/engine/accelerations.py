"""Accelerations of corners in exudyn."""

import exudyn as exu
import numpy as np

from ringsim.engine.model import Multibody
from ringsim.engine.rotations import Array


class AccelerationMeter:
    """Reads the nodes of corners."""

    def __init__(self, model: Multibody) -> None:
        corners, size = model.layout.corners, model.assembly.coordinates_of
        self.coordinates = {"corner": np.arange(1, len(corners[0]) + 1)}
        self._where = np.array([[size(model.bodies[k][1])[:3] for k in plane] for plane in corners])
        self._data = model.assembly.system.systemData
        # exudyn's solver takes the initial ones over in its first step.
        self._next = exu.ConfigurationType.Initial

    def read(self) -> Array:
        """Shape (planes, corners, 3), m/s^2, at the current state."""
        found = self._data.GetODE2Coordinates_tt(self._next)
        self._next = exu.ConfigurationType.Current
        return np.asarray(np.asarray(found, dtype=float)[self._where])
