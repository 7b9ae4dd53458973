"""Where corners are and what the rods store, in joint coordinates."""

import numpy as np

from ringsim.frame.model import FrameModel
from ringsim.frame.state import State
from ringsim.layout.pose import Array
from ringsim.outputs.series import Put


class ShapeMeter:
    """Reads corners and the elastic energy of the rods."""

    def __init__(self, model: FrameModel) -> None:
        self._corners = np.array(model.layout.corners)
        self.coordinates = {"corner": np.arange(1, self._corners.shape[1] + 1)}
        rods = sum(len(rod.lengths) for rod in model.layout.rods)
        self._stiffness: Array = model.mesh.stiffness[:rods]  # behind them stands the boom

    def read(self, state: State) -> Put:
        """At a state whose strains are known."""
        strains = state.strains[: len(self._stiffness)]
        energy = 0.5 * float(np.sum(self._stiffness * strains**2))
        return Put(state.pose.place[self._corners], energy)
