"""Where corners are and what the rods store, in exudyn."""

import exudyn as exu
import numpy as np

from ringsim.engine.model import Multibody
from ringsim.engine.readings import State
from ringsim.outputs.series import Put


class ShapeMeter:
    """Reads corners and the elastic energy of the rods."""

    def __init__(self, model: Multibody) -> None:
        corners, size = model.layout.corners, model.assembly.coordinates_of
        self._where = np.array([[size(model.bodies[k][1])[:3] for k in plane] for plane in corners])
        self.coordinates = {"corner": np.arange(1, self._where.shape[1] + 1)}
        self._elements = [element for rod in model.rods for element in rod.elements]
        self._output = model.assembly.system.GetObjectOutputBody

    def read(self, state: State) -> Put:
        """At the current state."""
        kind = exu.OutputVariableType.PotentialEnergy
        energy = sum(float(self._output(element, kind)) for element in self._elements)
        return Put(state.position[self._where], energy)
