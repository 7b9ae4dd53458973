"""Cables along a net's edge: springs between bodies of neighbouring blocks."""

import numpy as np

from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import Indices
from ringsim.frame.vectors import compiled, dot, minus, times, vector
from ringsim.layout.edge import natural_lengths
from ringsim.layout.layout import EdgeNet
from ringsim.layout.pose import Array
from ringsim.parts.net.boundary import pull
from ringsim.scene import Scene


@compiled
def lengths_of(places: Array, pairs: Indices, lengths: Array) -> None:
    """Write distances of pairs of frames (m)."""
    for n in range(len(pairs)):
        arm = minus(vector(places[pairs[n, 1]]), vector(places[pairs[n, 0]]))
        lengths[n] = np.sqrt(dot(arm, arm))


@compiled
def add_pulls(places: Array, pairs: Indices, pulls: Array, home: Indices, g: Array) -> None:
    """Add pulls (N) between pairs of frames to a residual."""
    for n in range(len(pairs)):
        first, second = pairs[n]
        arm = minus(vector(places[second]), vector(places[first]))
        force = times(pulls[n] / np.sqrt(dot(arm, arm)), arm)
        for i in range(3):
            g[home[second] + i] += force[i]
            g[home[first] + i] -= force[i]


@compiled
def add_slopes(
    places: Array, pairs: Indices, pulls: Array, rates: Array, spots: Indices, fronts: Array
) -> None:
    """Add derivatives of the pulls (N, and N/m along the cable) to fronts; ``spots`` are the front
    and the places of both ends in it.
    """
    for n in range(len(pairs)):
        if pulls[n] <= 0.0:
            continue
        arm = minus(vector(places[pairs[n, 1]]), vector(places[pairs[n, 0]]))
        length = np.sqrt(dot(arm, arm))
        unit = times(1.0 / length, arm)
        front, first, second = spots[n]
        for i in range(3):
            for j in range(3):
                own = unit[i] * unit[j]
                slope = rates[n] * own - pulls[n] / length * own
                if i == j:
                    slope += pulls[n] / length
                fronts[front, first + i, first + j] += slope
                fronts[front, second + i, second + j] += slope
                fronts[front, first + i, second + j] -= slope
                fronts[front, second + i, first + j] -= slope


class EdgeCables:
    """Cables between the origins of bodies; ``places`` are those of all frames, (f, 3), m."""

    def __init__(self, scene: Scene, edge: EdgeNet, mesh: Mesh) -> None:
        self._present, self._home = edge.present, mesh.home
        self._pairs = np.ascontiguousarray(edge.pairs)
        natural = natural_lengths(scene, edge)
        self._natural = natural[self._present]
        self._rates = edge.law.rates(natural)[self._present]
        self._spots = np.array([_spots(mesh, *pair) for pair in self._pairs.tolist()])
        self._lengths = np.empty(len(self._pairs))

    def push(self, places: Array, g: Array) -> None:
        """Add to the residual."""
        pulls = self._pulls(places)
        if pulls.any():
            add_pulls(places, self._pairs, pulls, self._home, g)

    def add_tangent(self, places: Array, fronts: Array) -> None:
        """Add to the fronts."""
        pulls = self._pulls(places)
        if pulls.any():
            add_slopes(places, self._pairs, pulls, self._rates, self._spots, fronts)

    def stored(self, places: Array) -> float:
        """Elastic energy, J."""
        return float(np.sum(pull(self._stretched(places), self._rates).stored))

    def tensions(self, places: Array) -> Array:
        """Of the cables, N, shape (planes, sections); NaN in planes without."""
        found = np.full(self._present.shape, np.nan)
        found[self._present] = self._pulls(places)
        return found

    def _pulls(self, places: Array) -> Array:
        return np.asarray(pull(self._stretched(places), self._rates).elastic)

    def _stretched(self, places: Array) -> Array:
        lengths_of(places, self._pairs, self._lengths)
        return self._lengths - self._natural


def _spots(mesh: Mesh, first: int, second: int) -> tuple[int, int, int]:
    """The front that both bodies are in, the one that is eliminated first, and their places."""
    ends = mesh.home[first], mesh.home[second]
    front = int(min(mesh.frame_local[first, 0], mesh.frame_local[second, 0]))
    own = mesh.spots[front].tolist()
    return front, own.index(int(ends[0])), own.index(int(ends[1]))
