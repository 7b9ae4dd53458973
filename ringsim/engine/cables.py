"""Cables in the multibody model: their forces inside every Newton iteration.

One exudyn object spans all nodes that the paths depend on.  Its force is the chain's; its
Jacobian is written with auxiliary unknowns that carry no mass and no force: for every span the
change of its difference vector (three) and of its tension (one), for every rope that of its mean
tension.  The coupling of all spans of a rope through its mean tension is then a few sparse rows
instead of a dense block over the whole ring; eliminating the unknowns gives P^T (dF/dx) P with
the material, decay and geometric parts of ringsim.cable.tangent.  The decay part alone is dense
(spans by spans).  Its entries are written only where they matter to Newton's convergence:
those of friction that turns round within a step.  ``exact_tangent`` writes them all.
"""

from __future__ import annotations

from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.cables import Cables
from ringsim.cable.chain import Chain
from ringsim.cable.records import Winch
from ringsim.cable.state import ChainState
from ringsim.cable.tangent import RopeTangent, tangents
from ringsim.cable.winding.family import WinchState
from ringsim.engine.cable_path import WIDTH, CablePath, Carrier, Placed, cross, gyration, skew

Array = NDArray[np.float64]
_PER_SPAN = 4
"""Auxiliary unknowns of a span: three for its difference vector, one for its tension."""
_NEGLIGIBLE = 0.02
"""Decay entries are left out below this share of the largest geometric stiffness T / L."""


class CableDrive:
    """The cables of a scene, with their winches.

    Attributes
    ----------
    chain, ropes
        See ringsim.cable.
    planes
        Plane of each cable.
    """

    def __init__(self, model: Carrier, cables: Cables, path: CablePath) -> None:
        present = cables.present()
        self.planes = [plane for plane, _ in present]
        self.path = path
        self.chain = Chain([cable for _, cable in present], self.path.per_cable)
        self._model = model
        self._reference = self._gather_reference()
        start = self.path.place(self._reference, np.zeros_like(self._reference))
        self.ropes = self.chain.start(start.points)
        self.winches: list[tuple[int, int, Winch]] = [
            (number, end, winch)
            for number, (_, cable) in enumerate(present)
            for end, winch in enumerate(cable.winches)
        ]
        self._winch_states = [WinchState() for _ in self.winches]
        self._size = len(self.path.nodes) * WIDTH
        most_ropes = len(present) + len(model.scene.faults)
        self.auxiliary = _PER_SPAN * self.ropes.spans + most_ropes
        self.exact_tangent = False
        self._pattern = _Pattern(self)
        self._add_object()

    def evaluate(self, coordinates: Array, rates: Array, time: float) -> tuple[ChainState, Placed]:
        """The chain from the nodes' total coordinates and rates, shape (nodes, 7)."""
        placed = self.path.place(coordinates, rates)
        wound, wound_rate = self.wound(time)
        state = self.chain.state(self.ropes, placed.points, placed.velocities, wound, wound_rate)
        return state, placed

    def wound(self, time: float) -> tuple[Array, Array]:
        """Rope wound and its rate at both ends of each cable, shape (cables, 2)."""
        wound, rate = np.zeros((len(self.planes), 2)), np.zeros((len(self.planes), 2))
        for (number, end, winch), held in zip(self.winches, self._winch_states, strict=True):
            state = winch.at(time, held)
            wound[number, end], rate[number, end] = state.wound, state.speed
        return wound, rate

    def advance(self, time: float, duration: float, state: ChainState, slopes: Array) -> None:
        """Let the winches choose their speed for the next step.

        Parameters
        ----------
        slopes
            Derivative of each cable's ideal path length after the opening angle, m/rad.
        """
        self._winch_states = [
            winch.advance(
                time,
                duration,
                state.reading(number, end, float(slopes[number])) if winch.feedback else None,
                held,
            )
            for (number, end, winch), held in zip(self.winches, self._winch_states, strict=True)
        ]

    def current(self, position: Array, velocity: Array, time: float) -> ChainState:
        """The chain at a state of the whole system (total coordinates)."""
        place = self._columns
        return self.evaluate(position[place], velocity[place], time)[0]

    def locate(self) -> None:
        """Look up where the nodes' coordinates stand in the system vector; after assembly."""
        assembly = self._model.assembly
        self._columns = np.array([assembly.coordinates_of(node) for node in self.path.nodes])

    def _gather_reference(self) -> Array:
        system = self._model.assembly.system
        return np.array(
            [system.GetNodeParameter(node, "referenceCoordinates") for node in self.path.nodes]
        )

    def _add_object(self) -> None:
        system = self._model.assembly.system
        zeros = np.zeros(self.auxiliary)
        auxiliary = system.AddNode(
            item.NodeGenericODE2(
                referenceCoordinates=zeros,
                initialCoordinates=zeros,
                initialCoordinates_t=zeros,
                numberOfODE2Coordinates=self.auxiliary,
            )
        )
        mass = exu.MatrixContainer()
        size = self._size + self.auxiliary
        mass.SetWithSparseMatrix(np.zeros((1, 3)), size, size)
        system.AddObject(
            item.ObjectGenericODE2(
                nodeNumbers=[*self.path.nodes, auxiliary],
                massMatrix=mass,
                forceUserFunction=self._force,
                jacobianUserFunction=self._jacobian,
            )
        )

    def _split(self, q: Any, q_t: Any) -> tuple[Array, Array]:
        shape = (len(self.path.nodes), WIDTH)
        place = np.asarray(q[: self._size]).reshape(shape) + self._reference
        return place, np.asarray(q_t[: self._size]).reshape(shape)

    def _force(self, mbs: Any, t: float, number: int, q: Any, q_t: Any) -> Array:
        state, placed = self.evaluate(*self._split(q, q_t), t)
        force = np.zeros(self._size + self.auxiliary)
        force[: self._size] = self.path.generalised(placed, state.point_forces).ravel()
        return force

    def _jacobian(
        self, mbs: Any, t: float, number: int, q: Any, q_t: Any, by_q: float, by_rate: float
    ) -> Any:
        state, placed = self.evaluate(*self._split(q, q_t), t)
        matrix = exu.MatrixContainer()
        size = self._size + self.auxiliary
        triplets = self._pattern.triplets(state, placed, by_q, by_rate, exact=self.exact_tangent)
        matrix.SetWithSparseMatrix(triplets, size, size)
        return matrix


class _Pattern:
    """Rows and columns of the Jacobian, found once, and its values.

    The object's equation is mass * acceleration - force = 0; what follows is its left-hand side.
    """

    def __init__(self, drive: CableDrive) -> None:
        self._path, ropes = drive.path, drive.ropes
        self._size = len(drive.path.nodes) * WIDTH
        self._spans = ropes.spans
        legs: list[tuple[int, int, float]] = []
        for span in range(ropes.spans):
            for point, sign in ((ropes.near[span], -1.0), (ropes.far[span], 1.0)):
                for leg in np.flatnonzero(drive.path.leg_point == point):
                    legs.append((span, int(leg), sign))
        self._span = np.array([leg[0] for leg in legs])
        self._leg = np.array([leg[1] for leg in legs])
        self._sign = np.array([leg[2] for leg in legs])
        nodes = drive.path.leg_node[self._leg]
        own = nodes[:, None] * WIDTH + np.arange(WIDTH)
        differences = self._difference(self._span)
        tension = self._tension(self._span)
        self._first, self._second = drive.path.turning_pairs()
        turn = drive.path.leg_node * WIDTH + 3
        turn_rows = turn[self._first][:, None] + np.arange(4)
        turn_columns = turn[self._second][:, None] + np.arange(4)
        single = turn[:, None] + np.arange(4)
        every = np.arange(self._size, self._size + drive.auxiliary)
        self._static = [
            _pairs(differences, own),
            _pairs(own, tension[:, None]),
            _pairs(own, differences),
            _pairs(turn_rows, turn_columns),
            _pairs(single, single),
            (every, every),
        ]
        self._ones = np.ones(len(every))

    def _difference(self, span: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.asarray(self._size + 3 * span[:, None] + np.arange(3))

    def _tension(self, span: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.asarray(self._size + 3 * self._spans + span)

    def _mean(self, rope: int) -> NDArray[np.int64]:
        return np.array([[self._size + _PER_SPAN * self._spans + rope]])

    def triplets(
        self, state: ChainState, placed: Placed, by_q: float, by_rate: float, *, exact: bool
    ) -> Array:
        """All entries as (row, column, value), shape (entries, 3)."""
        maps = self._path.leg_maps(placed)[self._leg] * self._sign[:, None, None]
        units = state.directions[self._span]
        values = [-maps, np.einsum("lij,li->lj", maps, units)]
        directions = np.empty((self._spans, 3, 3))
        places, blocks = list(self._static), []
        for rope, tangent in enumerate(tangents(state, placed.velocities)):
            spans = slice(state.ropes.starts[rope], state.ropes.ends[rope])
            directions[spans] = tangent.by_direction
            for place, block in self._rope(state, tangent, rope, by_q, by_rate, exact=exact):
                places.append(place)
                blocks.append(block)
        values.append(np.einsum("lij,lik->ljk", maps, directions[self._span]))
        values += [*self._turning(state, placed), self._ones]
        flat = [by_q * np.asarray(value).ravel() for value in values] + blocks
        rows = np.concatenate([r for r, _ in places])
        columns = np.concatenate([c for _, c in places])
        return np.stack([rows, columns, np.concatenate(flat)], axis=1)

    def _rope(
        self,
        state: ChainState,
        tangent: RopeTangent,
        rope: int,
        by_q: float,
        by_rate: float,
        *,
        exact: bool,
    ) -> list[tuple[tuple[NDArray[np.int64], NDArray[np.int64]], Array]]:
        """How a rope's span tensions follow its mean tension and the differences of its points."""
        spans = np.arange(state.ropes.starts[rope], state.ropes.ends[rope])
        tension, difference = self._tension(spans)[:, None], self._difference(spans).reshape(1, -1)
        shares = state.shares[spans]
        largest = int(np.argmax(shares))
        by_mean = (tangent.by_mean[largest] / shares[largest]).ravel()
        viscous = state.viscous_slope(rope) * tangent.directions.ravel()
        decay = by_q * tangent.by_share + by_rate * (
            tangent.by_velocity - shares[:, None, None] * viscous.reshape(-1, 3)
        )
        flat = decay.reshape(len(spans), -1)
        kept = np.ones(flat.shape, dtype=bool)
        if not exact:
            stiffest = float(np.max(state.tensions[spans] / state.lengths[spans]))
            kept = np.abs(flat) > by_q * _NEGLIGIBLE * max(stiffest, 1.0)
        row, column = np.nonzero(kept)
        mean = self._mean(rope)
        return [
            (_pairs(tension.T, mean), -by_q * shares),
            (_pairs(mean, difference), -(by_q * by_mean + by_rate * viscous)),
            ((tension[row, 0], difference[0, column]), -flat[row, column]),
        ]

    def _turning(self, state: ChainState, placed: Placed) -> list[Array]:
        """Change of the moments arm x F at fixed F with the turns of the nodes."""
        path = self._path
        forces = state.point_forces[path.leg_point]
        arms = placed.arms[path.leg_point]
        along = np.einsum("li,li->l", arms, forces)
        kernel = arms[:, :, None] * forces[:, None, :] - along[:, None, None] * np.eye(3)
        shares = path.leg_share
        gyrations = gyration(placed.turns[path.leg_node])
        first, second = self._first, self._second
        weight = (shares[first] * shares[second])[:, None, None]
        pairs = np.einsum(
            "lia,lij,ljb->lab", gyrations[first], weight * kernel[first], gyrations[second]
        )
        moments = shares[:, None] * cross(arms, forces)
        own = np.zeros((len(moments), 4, 4))
        own[:, 0, 1:], own[:, 1:, 0] = -2.0 * moments, 2.0 * moments
        own[:, 1:, 1:] = 2.0 * skew(moments)
        return [-pairs, -own]


def _pairs(
    rows: NDArray[np.int64], columns: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Row and column of every entry of blocks, (n, a) and (n, b) -> (n a b,) each."""
    shape = (len(rows), rows.shape[1], columns.shape[1])
    return (
        np.broadcast_to(rows[:, :, None], shape).ravel(),
        np.broadcast_to(columns[:, None, :], shape).ravel(),
    )
