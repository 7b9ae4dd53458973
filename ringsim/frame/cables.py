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

_STEADY = 0.9999
"""Share of the full friction from which a pulley is left out of Newton's tangent: it no longer
changes with the rope's speed."""


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
        near, directions = self.ropes.near, np.zeros((self.ropes.spans, 3, 3))
        columns, rows = [], []
        for rope in range(len(state.natural)):
            tangent = rope_tangent(state, rates, rope)
            spans = tangent.spans
            directions[spans] = tangent.by_direction
            if not state.ropes.alive[rope]:
                continue
            mean = left[rope] * tangent.mean_by_place + by_place * tangent.mean_by_velocity
            tensions, by_difference = state.shares[spans][None], mean[None]
            turning = np.abs(state.exponents[state.ropes.inner(rope)]) < _STEADY
            if turning.any():
                logs, by_place_, by_velocity = decay_factors(state, tangent, rope)
                own = np.append(np.flatnonzero(turning), len(turning))
                tensions = np.vstack([tensions, logs.T[own]])
                change = by_place_[own] + by_place * by_velocity[own]
                by_difference = np.concatenate([by_difference, change])
            each = np.stack([tensions[:, :, None] * state.directions[spans], by_difference])
            found = np.zeros((2, len(tensions), self.points, 3))
            found[:, :, near[spans]] -= each
            found[:, :, near[spans] + 1] += each
            columns.append(found[0])
            rows.append(found[1])
        add_line_tangent(
            self._lines, pose, state.tensions, state.directions, directions, fronts
        )
        if not columns:
            return (np.zeros((0, self._mesh.unknowns)),) * 2
        forces = np.concatenate(columns + rows)
        out = np.zeros((len(forces), self._mesh.unknowns))
        pull_lines(self._lines, self._mesh, pose, forces, out)
        return out[: len(out) // 2], out[len(out) // 2 :]
