"""Cables along a net's edge on a ring of rigid rods: generalised force - sum T dl/dp."""

import numpy as np

from ringsim.layout.edge import natural_lengths
from ringsim.layout.free_hub import NetForces
from ringsim.layout.layout import EdgeNet
from ringsim.layout.pose import Array
from ringsim.parts.net.boundary import pull
from ringsim.scene import Scene


class IdealEdge:
    """Cables between corners; arguments are those of ``ringsim.layout.free_hub.FreeHub``, the
    corners both ends of all cables: shape (2 * cables, 3, ...).
    """

    def __init__(self, scene: Scene, edge: EdgeNet) -> None:
        self._present = edge.present
        natural = natural_lengths(scene, edge)
        self._natural = natural[self._present]
        self._rates = edge.law.rates(natural)[self._present]

    def forces(self, corners: Array, slopes: Array, rates: Array) -> NetForces:
        """Generalised forces on coordinates after which ``slopes`` are the corners' derivatives."""
        arms, lengths = self._stretched(corners)
        moving = slopes.reshape(-1, 2, *slopes.shape[1:])
        longer = np.einsum("ia,iaj->ij", arms / lengths[:, None], moving[:, 1] - moving[:, 0])
        reaction = pull(lengths - self._natural, self._rates)
        return NetForces(-reaction.elastic @ longer, float(np.sum(reaction.stored)), 0.0)

    def tensions(self, corners: Array) -> Array:
        """Of the cables, N, shape (planes, sections); NaN in planes without."""
        found = np.full(self._present.shape, np.nan)
        stretch = self._stretched(corners)[1] - self._natural
        found[self._present] = pull(stretch, self._rates).elastic
        return found

    def _stretched(self, corners: Array) -> tuple[Array, Array]:
        ends = corners.reshape(-1, 2, 3)
        arms = ends[:, 1] - ends[:, 0]
        return arms, np.linalg.norm(arms, axis=1)
