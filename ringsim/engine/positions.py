"""Places and velocities of a structure's points in exudyn."""

import numpy as np

from ringsim.engine.model import Multibody
from ringsim.engine.readings import State
from ringsim.engine.rotations import Array, axes_of, cross, spin
from ringsim.layout.bodies import OnBody
from ringsim.layout.points import points_of


class PositionMeter:
    """Reads points on nodes, and those beside the nodes of bodies."""

    def __init__(self, model: Multibody) -> None:
        points = points_of(model.layout, model.scene.structure.planes)
        self.coordinates = points.coordinates
        nodes, arms = [], []
        for where in points.mounts:
            node, arm = (
                (model.loose[where], np.zeros(3)) if isinstance(where, str)
                else model.side_of(where)
            )  # fmt: skip
            nodes.append(model.assembly.coordinates_of(node))
            arms.append(arm)
        assert all(len(nodes[k]) == 7 for k, arm in enumerate(arms) if arm.any())
        self._where = np.array([own[:3] for own in nodes])
        self._aside = [k for k, arm in enumerate(arms) if arm.any()]
        self._arms = np.array([arms[k] for k in self._aside]).reshape(-1, 3)
        turns = [nodes[k][3:7] for k in self._aside]
        self._turns = np.array(turns, dtype=np.int64).reshape(-1, 4)
        assert all(isinstance(points.mounts[k], OnBody) for k in self._aside)

    def read(self, state: State) -> Array:
        """Places (m) and velocities (m/s), shape (points, 2, 3)."""
        found = np.stack([state.position[self._where], state.velocity[self._where]], axis=1)
        if self._aside:
            turns = state.position[self._turns]
            arms = np.einsum("nij,nj->ni", axes_of(turns), self._arms)
            spins = spin(turns, state.velocity[self._turns])
            found[self._aside] += np.stack([arms, cross(spins, arms)], axis=1)
        return found
