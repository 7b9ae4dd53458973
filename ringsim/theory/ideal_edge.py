"""Cables along a net's edge on a ring of rigid rods: generalised force - sum T dl/dq."""

import numpy as np

from ringsim.layout.edge import natural_lengths
from ringsim.layout.free_hub import NetForce
from ringsim.layout.layout import EdgeNet
from ringsim.layout.pose import Array
from ringsim.parts.net.boundary import pull
from ringsim.scene import Scene


class IdealEdge:
    """Cables between corners; arguments are those of ``ringsim.layout.free_hub.FreeHub``, the
    corners both ends of all cables: shape (2 * cables, 3).
    """

    def __init__(self, scene: Scene, edge: EdgeNet) -> None:
        natural = natural_lengths(scene, edge)
        self._natural = natural[edge.present]
        self._rates = edge.law.rates(natural)[edge.present]

    def force(self, corners: Array, slopes: Array) -> NetForce:
        """On a coordinate after which ``slopes`` are the corners' derivatives, m/rad."""
        ends, moving = corners.reshape(-1, 2, 3), slopes.reshape(-1, 2, 3)
        arms = ends[:, 1] - ends[:, 0]
        lengths = np.linalg.norm(arms, axis=1)
        longer = np.sum(arms * (moving[:, 1] - moving[:, 0]), axis=1) / lengths
        reaction = pull(lengths - self._natural, self._rates)
        return NetForce(0.0 - float(reaction.elastic @ longer), float(np.sum(reaction.stored)))
