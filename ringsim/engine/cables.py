"""Cables in the multibody model: their forces inside every Newton iteration.

One exudyn object spans all nodes that the paths depend on.  Its force is the chain's, its
Jacobian that of ringsim.engine.cable_jacobian.
"""

from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np

from ringsim.cable.chain import Chain
from ringsim.cable.records import Cables
from ringsim.cable.state import ChainState
from ringsim.cable.winches import Winches
from ringsim.engine.assembly import Assembly
from ringsim.engine.cable_jacobian import JacobianPattern
from ringsim.engine.cable_path import CablePath, Placed
from ringsim.engine.rotations import Array
from ringsim.stepping.turning import Turning


class CableDrive:
    """The cables of a scene, with their winches; each of the scene's ``faults`` may split a rope.

    Attributes
    ----------
    present, path
        The cables with their planes, and what they run over, on the model's nodes.
    chain, ropes, winches
        See ringsim.cable; faults replace the ropes.
    refusal
        Why the chain last had no answer to a state that Newton tried; empty if it always had.
    """

    def __init__(self, assembly: Assembly, cables: Cables, path: CablePath, faults: int) -> None:
        self.present = cables.present()
        present = [cable for _, cable in self.present]
        self.path, system = path, assembly.system
        parameter = system.GetNodeParameter
        reference, moved = (
            path.by_node(
                np.concatenate([parameter(node, f"{which}Coordinates") for node in path.nodes])
            )
            for which in ("reference", "initial")
        )
        self._reference = reference
        self._columns = np.concatenate([assembly.coordinates_of(node) for node in path.nodes])
        self.chain = Chain(present, path.per_cable)
        # Rods that are not as drawn have unstrained nodes as a reference, and begin elsewhere.
        start = path.place(reference + moved, np.zeros_like(reference))
        self.ropes = self.chain.start(start.points)
        self.winches = Winches(present)
        self._answered: tuple[tuple[float, bytes, bytes], ChainState, Placed] | None = None
        self._turning = Turning()
        self.pattern = JacobianPattern(path, self.ropes, len(present) + faults)
        self._size = path.size + self.pattern.unknowns
        self.refusal = ""
        zeros = np.zeros(self.pattern.unknowns)
        auxiliary = system.AddNode(
            item.NodeGenericODE2(
                referenceCoordinates=zeros,
                initialCoordinates=zeros,
                initialCoordinates_t=zeros,
                numberOfODE2Coordinates=len(zeros),
            )
        )
        mass = exu.MatrixContainer()
        mass.SetWithSparseMatrix(np.zeros((1, 3)), self._size, self._size)
        system.AddObject(
            item.ObjectGenericODE2(
                nodeNumbers=[*path.nodes, auxiliary],
                massMatrix=mass,
                forceUserFunction=self._force,
                jacobianUserFunction=self._jacobian,
            )
        )

    def evaluate(self, coordinates: Array, rates: Array, time: float) -> tuple[ChainState, Placed]:
        """The chain from the nodes' total coordinates and rates, (nodes, width)."""
        placed, ropes = self.path.place(coordinates, rates), self.ropes
        path = path_rate = None
        if self.winches.answering:
            lengths, _, moving = ropes.measured(placed.points, placed.velocities)
            path, path_rate = ropes.along(lengths), ropes.along(moving)
        wound, wound_rate = self.winches.at(time, ropes, path, path_rate)
        state = self.chain.state(ropes, placed.points, placed.velocities, wound, wound_rate)
        return state, placed

    def advance(self, time: float, state: ChainState, slopes: Array) -> None:
        """Let the winches begin the next step at a time (s) in a state of the chain.

        ``slopes`` are the derivatives of the cables' ideal paths after the opening angle, m/rad.
        """
        self._answered = None
        self._turning.forget()
        self.winches.advance(time, state, slopes)

    def current(self, position: Array, velocity: Array, time: float) -> ChainState:
        """The chain at a state of the whole system (total coordinates)."""
        place, rates = (self.path.by_node(x[self._columns]) for x in (position, velocity))
        return self.evaluate(place, rates, time)[0]

    def _answer(self, q: Any, q_t: Any, time: float) -> tuple[ChainState, Placed]:
        """The chain at a state of the object; Newton asks twice for force and Jacobian."""
        size = self.path.size
        place, rates = (self.path.by_node(np.asarray(x[:size])) for x in (q, q_t))
        place = place + self._reference
        asked = (time, place.tobytes(), rates.tobytes())
        known = self._answered
        if known is None or known[0] != asked or known[1].ropes is not self.ropes:
            known = self._answered = asked, *self.evaluate(place, rates, time)
            self._turning.note(self.ropes, known[1].speeds)
        return known[1:]

    def _force(self, mbs: Any, t: float, number: int, q: Any, q_t: Any) -> Array:
        force = np.zeros(self._size)
        own = force[: self.path.size]
        try:
            with np.errstate(all="ignore"):
                state, placed = self._answer(q, q_t, t)
                own[:] = self.path.in_a_row(self.path.generalised(placed, state.point_forces))
        except ValueError as error:
            # A stray Newton iterate, or no rope left: no number makes Newton take a smaller step.
            self.refusal = str(error)
            own[:] = np.nan
        return force

    def _jacobian(
        self, mbs: Any, t: float, number: int, q: Any, q_t: Any, by_q: float, by_rate: float
    ) -> Any:
        try:
            with np.errstate(all="ignore"):
                state, placed = self._answer(q, q_t, t)
                left: Array | float = 1.0
                if self.winches.answering:
                    left = self.winches.stiffness_left(t, self.ropes, state.paths, state.path_rates)
                slip = state.slip_speeds
                own = (1.0 - state.exponents**2) / slip
                slopes = self._turning.slopes(
                    self.ropes, state.speeds, own, lambda speed: np.tanh(speed / slip)
                )
                triplets = self.pattern.triplets(state, placed, by_q, by_rate, slopes, left)
        except ValueError as error:
            self.refusal = str(error)
            triplets = self.pattern.empty()
        matrix = exu.MatrixContainer()
        matrix.SetWithSparseMatrix(triplets, self._size, self._size)
        return matrix
