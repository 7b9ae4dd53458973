"""Laws between bodies and to the hub of a net, and the body that slides on the boom."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ringsim.frame.laws import Law, Tape, taped
from ringsim.frame.mesh import CURE, NOT_HERE, Indices, Mesh
from ringsim.frame.state import Pose, State
from ringsim.layout.bodies import Array, skew
from ringsim.layout.layout import Layout
from ringsim.parts.laws import FREE_HUB, PairLaw
from ringsim.refusal import InputError

# Laws between bodies, and from bodies to the hub of a net, a point with three unknowns of its own
# (balance.c).


class Web(NamedTuple):
    """All pairs of a layout, shape (pairs,): their laws; numbers of their ends among ``ends``,
    which are bodies, -1 for the hub; natural lengths (m); the front that has both bodies, or that
    of the second one, and their places in it, shape (pairs, 3); the mass of the hub (kg).
    """

    tape: Tape
    first: Indices
    second: Indices
    natural: Array
    ends: Indices
    spots: Indices
    hub_mass: float

    @classmethod
    def of(cls, layout: Layout, mesh: Mesh) -> "Web":
        """Those of a layout; InputError where no front has both bodies of a pair."""
        laws = layout.pair_laws
        bodies = np.concatenate([np.zeros((0, 2), np.int64), *(law.bodies for law in laws)])
        ends = list(dict.fromkeys(bodies[bodies != FREE_HUB].tolist()))
        number = {body: k for k, body in enumerate(ends)} | {FREE_HUB: -1}
        first, second = (
            np.array([number[k] for k in side], np.int64) for side in bodies.T.tolist()
        )
        return cls(
            taped([(_between(law), law.natural.shape, law.record) for law in laws], 2, 3),
            first, second, np.concatenate([np.zeros(0), *(law.natural for law in laws)]),
            np.array(ends, np.int64),
            np.array([_spots(mesh, *pair) for pair in bodies.tolist()], np.int64).reshape(-1, 3),
            0.0 if layout.hub is None else layout.hub.mass,
        )  # fmt: skip


def _between(law: PairLaw) -> Law:
    own, natural = law.own, law.natural
    return lambda stretch, rate: own.reaction(stretch, rate, natural)


def _spots(mesh: Mesh, first: int, second: int) -> tuple[int, int, int]:
    if first == FREE_HUB:
        front, place = mesh.frame_local[second].tolist()
        return front, -1, place
    # The front of both bodies that is eliminated first.
    ends = mesh.home[first], mesh.home[second]
    front = int(min(mesh.frame_local[first, 0], mesh.frame_local[second, 0]))
    own = mesh.spots[front].tolist()
    if not all(int(end) in own for end in ends):
        raise InputError(f"{NOT_HERE} a net between corners that are no neighbours: {CURE}")
    return front, own.index(int(ends[0])), own.index(int(ends[1]))


# Bodies that slide along a boom: a stiff spring across it; along a rigid one see balance.c.


STIFFNESS = 100.0
"""Over that of the stiffest rod along its axis, EA / L: it gives a hundredth of what rods do."""


class Gap(NamedTuple):
    """Distances across the boom (n,), m, and derivatives after the unknowns of frames (n, 6 f)."""

    sizes: Array
    rows: Array
    frames: tuple[int, ...]


class BeamSlide:
    """Along the cubic (Hermite) curves between the nodes of a boom with elements of a length, m.

    ``nodes`` are their frames and axes there, whose x is the curve's direction.
    """

    def __init__(
        self, mesh: Mesh, nodes: Sequence[tuple[int, Array]], length: float, low: int,
        stiffness: float,
    ) -> None:  # fmt: skip
        self._mesh, self.low, self.stiffness = mesh, low, stiffness
        self._nodes, self._length = nodes, length

    def at(self, pose: Pose) -> Gap:
        """The gap to the curve's nearest point; the last of its frames is the body's."""
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

    def size(self, pose: Pose) -> float:
        """Of the gap, m."""
        return math.hypot(*self.at(pose).sizes.tolist())

    def push(self, state: State, g: Array) -> None:
        """Add its force to the residual."""
        gap = self.at(state.pose)
        forces = self.stiffness * (gap.sizes @ gap.rows)
        for n, frame in enumerate(gap.frames):
            k = self._mesh.home[frame]
            g[k : k + 6] += forces[6 * n : 6 * n + 6]

    def add_tangent(self, state: State, by_rate: float, by_place: float, fronts: Array) -> None:
        """Add to the fronts; gaps are so small that how the rows turn does not matter."""
        gap, mesh = self.at(state.pose), self._mesh
        # Where a part holds one of the frames, it holds all of them.
        front = int(mesh.frame_local[list(gap.frames), 0].min())
        where = {int(spot): k for k, spot in enumerate(mesh.spots[front, : mesh.size[front]])}
        places = [where[int(mesh.home[f]) + k] for f in gap.frames for k in range(6)]
        fronts[front][np.ix_(places, places)] += self.stiffness * (gap.rows.T @ gap.rows)


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
