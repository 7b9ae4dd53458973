"""The cables on frames: the chain of ringsim.cable, its pulls on the unknowns and its tangent.

Spans between two frames pull on them; that their directions turn is part of the fronts.  How
tensions change couples all spans of a rope: dT = A dlog with few columns A (one for the mean
tension, one for its share along the path, and one for every pulley whose friction turns round), so
that it enters as a border of the system, not as its entries.
"""

import numpy as np

from ringsim.cable.chain import Chain
from ringsim.cable.faults.family import CableFault
from ringsim.cable.records import Cables
from ringsim.cable.state import ChainState
from ringsim.cable.tangent import decay_factors, rope_tangent
from ringsim.cable.winches import Winches
from ringsim.frame.kernels import Pose
from ringsim.frame.lines import add_line_tangent, lines_of, place_lines, pull_lines
from ringsim.frame.mesh import Mesh, Skeleton
from ringsim.layout.pose import Array

_SLIGHT = 0.02
"""Change of tension with a place of the path that a pulley causes, over the largest T / L of the
rope, below which Newton's tangent does without it."""


class FrameCables:
    """The cables of a scene on the frames of a mesh.

    Attributes
    ----------
    present, winches, ropes
        As of ``ringsim.engine.cables.CableDrive``.
    points
        Number of points of all paths.
    """

    def __init__(self, cables: Cables, skeleton: Skeleton, mesh: Mesh, pose: Pose) -> None:
        self.present = cables.present()
        own, paths = [cable for _, cable in self.present], skeleton.layout.paths
        self._chain = Chain(own, [len(path) for path in paths])
        self.winches, self._mesh = Winches(own), mesh
        self.points = sum(len(path) for path in paths)
        start = np.array([skeleton.layout.sheave(s)[0] for path in paths for s in path])
        self.ropes = self._chain.start(start)
        self._lines = lines_of(skeleton, mesh, paths, self.ropes)

    def place(self, pose: Pose, out: Array) -> None:
        """Places of all points, shape (points, 3), m."""
        place_lines(self._lines, pose, out)

    def state(self, time: float, places: Array, rates: Array) -> ChainState:
        """The chain at places and rates of all points; ValueError if it has no answer."""
        path = path_rate = None
        if self.winches.answering:
            lengths, _, moving = self.ropes.measured(places, rates)
            path, path_rate = self.ropes.along(lengths), self.ropes.along(moving)
        wound, wound_rate = self.winches.at(time, self.ropes, path, path_rate)
        return self._chain.state(self.ropes, places, rates, wound, wound_rate)

    def strike(self, fault: CableFault, state: ChainState) -> None:
        """Let a fault change the ropes."""
        self.ropes = fault.strike(self.ropes, state)

    def pull(self, pose: Pose, state: ChainState, g: Array) -> None:
        """Add what resists the cables' pull to the residual, shape (unknowns,)."""
        pull_lines(self._lines, self._mesh, pose, -state.point_forces[None], g[None])

    def add_tangent(
        self, time: float, pose: Pose, state: ChainState, rates: Array, by_place: float,
        fronts: Array,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Add to the fronts; columns and rows of the border, shape (k, unknowns) each.

        ``by_place`` is the derivative of the points' rates after their places, 1/s.  The residual
        changes by the sum of the columns times what the rows say.
        """
        left = np.ones(len(state.natural))
        if self.winches.answering:
            left = self.winches.stiffness_left(time, self.ropes, state.paths, state.path_rates)
        columns, rows = [], []
        directions = np.zeros((self.ropes.spans, 3, 3))
        for rope in range(len(state.natural)):
            tangent = rope_tangent(state, rates, rope)
            spans = tangent.spans
            directions[spans] = tangent.by_direction
            if not state.ropes.alive[rope]:
                continue
            mean = left[rope] * tangent.mean_by_place + by_place * tangent.mean_by_velocity
            columns.append(self._on_spans(spans, state.shares[spans, None] * state.directions[spans]))
            rows.append(self._on_spans(spans, mean))
            logs, by_difference, by_velocity = decay_factors(state, tangent, rope)
            change = by_difference + by_place * by_velocity
            stiffest = float(np.max(state.tensions[spans] / state.lengths[spans]))
            felt = np.abs(logs).max(axis=0) * np.abs(change).max(axis=(1, 2))
            for k in np.flatnonzero(felt > _SLIGHT * max(stiffest, 1.0)):
                columns.append(self._on_spans(spans, logs[:, k, None] * state.directions[spans]))
                rows.append(self._on_spans(spans, change[k]))
        add_line_tangent(
            self._lines, pose, state.tensions, state.directions, directions, fronts
        )
        out = np.zeros((2 * len(columns), self._mesh.unknowns))
        if columns:
            pull_lines(self._lines, self._mesh, pose, np.array(columns + rows), out)
        return out[: len(columns)], out[len(columns) :]

    def _on_spans(self, spans: slice, each: Array) -> Array:
        """Vectors of a rope's spans as differences at the paths' points, shape (points, 3)."""
        found = np.zeros((self.points, 3))
        near = self.ropes.near[spans]
        found[near] -= each
        found[near + 1] += each
        return found
