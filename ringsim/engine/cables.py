"""Cables in the multibody model: their forces inside every Newton iteration.

One exudyn object spans all nodes that the paths depend on.  Its force is the chain's, its
Jacobian that of ringsim.engine.cable_jacobian.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.cables import Cables
from ringsim.cable.chain import Chain
from ringsim.cable.state import ChainState
from ringsim.cable.winches import Winches
from ringsim.engine.cable_jacobian import JacobianPattern, auxiliary_unknowns
from ringsim.engine.cable_path import CablePath, Carrier, Placed

Array = NDArray[np.float64]


class _Answered(NamedTuple):
    """The state of the nodes last asked for (shape (nodes, width), s), and what it gave."""

    time: float
    place: Array
    rates: Array
    chain: ChainState
    placed: Placed


class CableDrive:
    """The cables of a scene, with their winches.

    Attributes
    ----------
    chain, ropes
        See ringsim.cable.
    winches
        What winds them.
    planes
        Plane of each cable.
    refusal
        Why the chain last had no answer to a state that Newton tried; empty if it always had.
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
        self.winches = Winches(self.chain.cables)
        self._size = self.path.size
        self._answered: _Answered | None = None
        most_ropes = len(present) + len(model.scene.faults)
        self.auxiliary = auxiliary_unknowns(self.ropes.spans, most_ropes)
        self.exact_tangent = False
        self.refusal = ""
        self.pattern = JacobianPattern(self.path, self.ropes, self.auxiliary)
        self._add_object()

    def evaluate(self, coordinates: Array, rates: Array, time: float) -> tuple[ChainState, Placed]:
        """The chain from the nodes' total coordinates and rates, (nodes, width)."""
        placed = self.path.place(coordinates, rates)
        wound, wound_rate = self.winches.at(time, self.ropes, *self._paths(placed))
        state = self.chain.state(self.ropes, placed.points, placed.velocities, wound, wound_rate)
        return state, placed

    def _paths(self, placed: Placed) -> tuple[Array | None, Array | None]:
        """Path of each rope and its rate, m and m/s, if a winch asks for them."""
        if not self.winches.answering:
            return None, None
        ropes = self.ropes
        apart = placed.points[ropes.far] - placed.points[ropes.near]
        moving = placed.velocities[ropes.far] - placed.velocities[ropes.near]
        lengths = np.sqrt(np.einsum("ij,ij->i", apart, apart))
        rates = np.einsum("ij,ij->i", apart, moving) / lengths
        return np.add.reduceat(lengths, ropes.starts), np.add.reduceat(rates, ropes.starts)

    def advance(self, time: float, duration: float, state: ChainState, slopes: Array) -> None:
        """Let the winches begin the next step.

        Parameters
        ----------
        slopes
            Derivative of each cable's ideal path length after the opening angle, m/rad.
        """
        del duration
        self._answered = None
        self.winches.advance(time, state, slopes)

    def _left(self, state: ChainState, time: float) -> Array | None:
        """Share of the material stiffness that the winches leave to each rope; None for all."""
        if not self.winches.answering:
            return None
        return self.winches.stiffness_left(time, self.ropes, state.paths, state.path_rates)

    def current(self, position: Array, velocity: Array, time: float) -> ChainState:
        """The chain at a state of the whole system (total coordinates)."""
        place, rates = (self.path.by_node(x[self._columns]) for x in (position, velocity))
        return self.evaluate(place, rates, time)[0]

    def locate(self) -> None:
        """Look up where the nodes' coordinates stand in the system vector; after assembly."""
        assembly = self._model.assembly
        self._columns = np.concatenate([assembly.coordinates_of(n) for n in self.path.nodes])

    def _gather_reference(self) -> Array:
        system = self._model.assembly.system
        return self.path.by_node(
            np.concatenate(
                [system.GetNodeParameter(node, "referenceCoordinates") for node in self.path.nodes]
            )
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
        place, rates = (self.path.by_node(np.asarray(x[: self._size])) for x in (q, q_t))
        return place + self._reference, rates

    def _answer(self, q: Any, q_t: Any, time: float) -> tuple[ChainState, Placed]:
        """The chain at a state of the object; Newton asks twice for force and Jacobian."""
        place, rates = self._split(q, q_t)
        known = self._answered
        if (
            known is None
            or known.time != time
            or known.chain.ropes is not self.ropes
            or not np.array_equal(known.place, place)
            or not np.array_equal(known.rates, rates)
        ):
            known = _Answered(time, place, rates.copy(), *self.evaluate(place, rates, time))
            self._answered = known
        return known.chain, known.placed

    def _force(self, mbs: Any, t: float, number: int, q: Any, q_t: Any) -> Array:
        force = np.zeros(self._size + self.auxiliary)
        try:
            with np.errstate(all="ignore"):
                state, placed = self._answer(q, q_t, t)
                force[: self._size] = self.path.in_a_row(
                    self.path.generalised(placed, state.point_forces)
                )
        except ValueError as error:
            # A stray Newton iterate, or no rope left: no number makes Newton take a smaller step.
            self.refusal = str(error)
            force[: self._size] = np.nan
        return force

    def _jacobian(
        self, mbs: Any, t: float, number: int, q: Any, q_t: Any, by_q: float, by_rate: float
    ) -> Any:
        matrix = exu.MatrixContainer()
        size = self._size + self.auxiliary
        try:
            with np.errstate(all="ignore"):
                state, placed = self._answer(q, q_t, t)
                triplets = self.pattern.triplets(
                    state,
                    placed,
                    by_q,
                    by_rate,
                    exact=self.exact_tangent,
                    left=self._left(state, t),
                )
        except ValueError as error:
            self.refusal = str(error)
            triplets = self.pattern.empty()
        matrix.SetWithSparseMatrix(triplets, size, size)
        return matrix
