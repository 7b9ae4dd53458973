"""The net's strings to a hub and along the edge, and the body that slides on the boom."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ringsim.frame.kernels import Pose
from ringsim.frame.laws import Tape, play, taped
from ringsim.frame.mesh import Indices, Mesh
from ringsim.frame.vectors import compiled, cross, dot, minus, times, vector
from ringsim.layout.bodies import Array, skew
from ringsim.layout.draft import natural_lengths
from ringsim.layout.layout import EdgeNet, HubNet
from ringsim.parts.net import pull
from ringsim.parts.persection import at_section
from ringsim.scene import Scene

# The net's strings from corners to a hub, a point with three unknowns of its own.


_NUDGE = 1e-7
"""Change of stretch (m) and its rate (m/s) by which the slopes of the law are measured."""
_STRETCH, _RATE, _ELASTIC, _DAMPING, _STORED = range(5)
"""Rows of the law's tape."""


class Web(NamedTuple):
    """Strings from a hub: their law, the bodies at their ends, length without force (m), whether
    they only pull, and the mass of the hub (kg).
    """

    tape: Tape
    bodies: Indices
    free: float
    one_sided: bool
    hub_mass: float

    @classmethod
    def of(cls, held: HubNet | None) -> "Web":
        """Those of a net; none without."""
        if held is None:
            return cls(taped([], 2, 3), np.zeros(0, dtype=np.int64), 0.0, True, 0.0)
        law, bodies = held.law, np.array(held.bodies, dtype=np.int64)
        tension = at_section(law, np.arange(len(bodies))).tension
        tape = taped([(tension, bodies.shape, law)], 2, 3)
        return cls(tape, bodies, law.neutral_length, not law.two_sided, law.hub_mass)


@compiled
def stretched(
    ends: Array, rates: Array, hub: Array, hub_rate: Array
) -> tuple[Array, Array, Array, float]:
    """Lengths (m), their rates (m/s) and directions of strings from the hub, at places and rates of
    shape (n, 3) and (3,); the greatest length.
    """
    n, most = len(ends), 0.0
    lengths, along, units = np.empty(n), np.empty(n), np.empty((n, 3))
    for k in range(n):
        arm = minus(vector(ends[k]), vector(hub))
        length = math.sqrt(dot(arm, arm))
        unit = times(1.0 / length, arm)
        lengths[k], along[k] = length, dot(unit, minus(vector(rates[k]), vector(hub_rate)))
        units[k, 0], units[k, 1], units[k, 2] = unit
        most = max(most, length)
    return lengths, along, units, most


@compiled
def _feel(web: Web, lengths: Array, along: Array, more: float, faster: float) -> None:
    """Play the law at lengths and rates, all so much larger."""
    rows = web.tape.rows
    for k in range(len(lengths)):
        rows[_STRETCH, k], rows[_RATE, k] = lengths[k] - web.free + more, along[k] + faster
    play(web.tape)


@compiled
def _force(web: Web, k: int) -> float:
    return float(web.tape.rows[_ELASTIC, k] + web.tape.rows[_DAMPING, k])


@compiled
def pull_strings(
    web: Web, mesh: Mesh, ends: Array, rates: Array, hub: Array, hub_rate: Array, g: Array
) -> bool:
    """Add what resists at the bodies and, in the last three unknowns, at the hub; False while all
    strings are slack.
    """
    lengths, along, units, most = stretched(ends, rates, hub, hub_rate)
    if web.one_sided and most <= web.free:
        return False
    _feel(web, lengths, along, 0.0, 0.0)
    at = len(g) - 3
    for n in range(len(web.bodies)):
        home, pull = mesh.home[web.bodies[n]], _force(web, n)
        for i in range(3):
            g[home + i] += pull * units[n, i]
            g[at + i] -= pull * units[n, i]
    return True


@compiled
def add_strings(
    web: Web, mesh: Mesh, ends: Array, rates: Array, hub: Array, hub_rate: Array, by_rate: float,
    fronts: Array, columns: Array, rows: Array, corner: Array,
) -> None:  # fmt: skip
    """Add derivatives of the strings' pulls to the fronts, and those after the hub's place to the
    first three columns, rows and corner of the border; ``by_rate`` is the derivative of rates after
    places, 1/s.
    """
    lengths, along, units, _ = stretched(ends, rates, hub, hub_rate)
    slope, block = np.zeros(len(lengths)), np.zeros((3, 3))
    for side in (1.0, -1.0):
        for what in range(2):
            _feel(web, lengths, along, (1 - what) * side * _NUDGE, what * side * _NUDGE)
            share = side / (2.0 * _NUDGE) * (1.0 if what == 0 else by_rate)
            for n in range(len(slope)):
                slope[n] += share * _force(web, n)
    _feel(web, lengths, along, 0.0, 0.0)
    for n in range(len(slope)):
        body = web.bodies[n]
        number, first = mesh.frame_local[body, 0], mesh.frame_local[body, 1]
        across = _force(web, n) / lengths[n]
        for i in range(3):
            for j in range(3):
                block[i, j] = (slope[n] - across) * units[n, i] * units[n, j]
            block[i, i] += across
        for i in range(3):
            for j in range(3):
                fronts[number, first + i, first + j] += block[i, j]
                columns[mesh.home[body] + i, j] -= block[i, j]
                rows[mesh.home[body] + i, j] -= block[i, j]
                corner[i, j] += block[i, j]


def passing_strings(
    web: Web, ends: Array, rates: Array, hub: Array, hub_rate: Array
) -> tuple[float, Array, Array, Array]:
    """Energy stored (J), dissipating forces of the strings (N), their lengths (m) and rates of
    these (m/s).
    """
    lengths, along, _, _ = stretched(ends, rates, hub, hub_rate)
    _feel(web, lengths, along, 0.0, 0.0)
    rows = web.tape.rows
    return float(rows[_STORED].sum()), rows[_DAMPING].copy(), lengths, along


# Cables along a net's edge: springs between bodies of neighbouring blocks.


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


# Bodies that slide along a boom: a stiff spring across it.


STIFFNESS = 100.0
"""Over that of the stiffest rod along its axis, EA / L: it gives a hundredth of what rods do."""


class Gap(NamedTuple):
    """Distances across the boom, and turns against it times a length where these are held, (n,), m,
    and derivatives after the unknowns of frames (n, 6 f).
    """

    sizes: Array
    rows: Array
    frames: tuple[int, ...]


class Slide:
    """Holds the origin of a body on a line of other frames."""

    def __init__(self, mesh: Mesh, low: int, stiffness: float) -> None:
        self._mesh, self.low, self._stiffness = mesh, low, stiffness

    def at(self, pose: Pose) -> Gap:
        """The gap at a pose; the last of its frames is the body's."""
        raise NotImplementedError

    def size(self, pose: Pose) -> float:
        """Of the gap, m."""
        return math.hypot(*self.at(pose).sizes.tolist())

    def stored(self, pose: Pose) -> float:
        """Energy of the spring, J."""
        return 0.5 * self._stiffness * self.size(pose) ** 2

    def hold(self, pose: Pose, g: Array) -> None:
        """Add its force to the residual."""
        gap = self.at(pose)
        forces = self._stiffness * (gap.sizes @ gap.rows)
        for n, frame in enumerate(gap.frames):
            k = self._mesh.home[frame]
            g[k : k + 6] += forces[6 * n : 6 * n + 6]

    def add_tangent(self, pose: Pose, fronts: Array) -> None:
        """Add to the fronts; gaps are so small that how the rows turn does not matter."""
        gap, mesh = self.at(pose), self._mesh
        # Where a part holds one of the frames, it holds all of them.
        front = int(mesh.frame_local[list(gap.frames), 0].min())
        where = {int(spot): k for k, spot in enumerate(mesh.spots[front, : mesh.size[front]])}
        places = [where[int(mesh.home[f]) + k] for f in gap.frames for k in range(6)]
        fronts[front][np.ix_(places, places)] += self._stiffness * (gap.rows.T @ gap.rows)


@compiled
def aside(pose: Pose, top: int, low: int, reach: float) -> tuple[Array, Array]:
    """Gaps along x and y of a body's axes, and how they change, shapes (2,) and (2, 12).

    If turns are held, those about its axes times ``reach`` (m) stand behind, (5,) and (5, 12): half
    the axial vector of R_1^T R_2, a turn as long as it is small; ``reach`` is else 0.
    """
    size = 5 if reach > 0.0 else 2
    gaps, rows = np.empty(size), np.zeros((size, 12))
    apart, axes = minus(vector(pose.place[low]), vector(pose.place[top])), pose.axes[top]
    for k in range(2):
        axis = vector(axes[:, k])
        gaps[k], turned = dot(axis, apart), cross(axis, apart)
        for i in range(3):
            rows[k, i], rows[k, 3 + i], rows[k, 6 + i] = -axis[i], turned[i], axis[i]
    for k in range(size - 2):
        first, second = (k + 1) % 3, (k + 2) % 3
        sine = 0.0
        for i in range(3):
            sine += axes[i, second] * pose.axes[low, i, first]
            sine -= axes[i, first] * pose.axes[low, i, second]
            rows[2 + k, 3 + i], rows[2 + k, 9 + i] = -reach * axes[i, k], reach * axes[i, k]
        gaps[2 + k] = 0.5 * reach * sine
    return gaps, rows


class RigidSlide(Slide):
    """Along the z axis of body ``top``; ``reach`` is 0 in a sleeve, and that of ``aside`` in a
    prismatic joint.
    """

    def __init__(self, mesh: Mesh, top: int, low: int, stiffness: float, reach: float) -> None:
        super().__init__(mesh, low, stiffness)
        self.top, self.reach = top, reach

    def at(self, pose: Pose) -> Gap:
        """See ``Slide``."""
        return Gap(*aside(pose, self.top, self.low, self.reach), (self.top, self.low))


class BeamSlide(Slide):
    """Along the cubic (Hermite) curves between the nodes of a boom with elements of a length, m.

    ``nodes`` are their frames and axes there, whose x is the curve's direction.
    """

    def __init__(
        self, mesh: Mesh, nodes: Sequence[tuple[int, Array]], length: float, low: int,
        stiffness: float,
    ) -> None:  # fmt: skip
        super().__init__(mesh, low, stiffness)
        self._nodes, self._length = nodes, length

    def at(self, pose: Pose) -> Gap:
        """See ``Slide``: the gap to the curve's nearest point."""
        place, length = pose.place[self.low], self._length
        ends = np.array([pose.place[f] for f, _ in self._nodes])
        tangents = np.array([pose.axes[f] @ own[:, 0] for f, own in self._nodes])
        along = np.einsum("ij,ij->i", place - ends, tangents)
        k = int(np.clip(np.count_nonzero(along > 0.0) - 1, 0, len(self._nodes) - 2))
        points = np.array([ends[k], length * tangents[k], ends[k + 1], length * tangents[k + 1]])
        x = float(np.clip(along[k] / length, 0.0, 1.0))
        for _ in range(20):  # Newton for the foot of the perpendicular
            away, slope, bend = (place * (n == 0) - _hermite(x, n) @ points for n in range(3))
            change = float(away @ slope) / float(slope @ slope + away @ bend)
            x -= change
            if abs(change) < 1e-14:
                break
        shares = _hermite(x, 0)
        away = place - shares @ points
        direction = _hermite(x, 1) @ points
        direction /= np.linalg.norm(direction)
        rows = np.zeros((3, 18))
        rows[:, 0:3], rows[:, 6:9], rows[:, 12:15] = -shares[0] * _ONE, -shares[2] * _ONE, _ONE
        rows[:, 3:6], rows[:, 9:12] = shares[1] * skew(points[1]), shares[3] * skew(points[3])
        # Along the curve the body is free.
        rows = (_ONE - np.outer(direction, direction)) @ rows
        return Gap(away, rows, (self._nodes[k][0], self._nodes[k + 1][0], self.low))


_ONE = np.eye(3)
_CUBIC = np.array([[1.0, 0.0, -3.0, 2.0], [0.0, 1.0, -2.0, 1.0], [0.0, 0.0, 3.0, -2.0],
                   [0.0, 0.0, -1.0, 1.0]])  # fmt: skip
"""Hermite's cubics: coefficients of 1, x, x^2, x^3 for place and slope at both ends."""


def _hermite(x: float, derivative: int) -> Array:
    """Values of the cubics, or of their derivatives, shape (4,)."""
    powers = np.zeros(4)
    for k in range(derivative, 4):
        powers[k] = np.prod(np.arange(k, k - derivative, -1)) * x ** (k - derivative)
    return np.asarray(_CUBIC @ powers)
