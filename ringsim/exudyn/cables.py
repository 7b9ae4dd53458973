"""Cables in the multibody model: their forces and Jacobians inside every Newton iteration."""

from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.cable.records import Cables
from ringsim.cable.ropes import Ropes
from ringsim.core.chain import Chain, Turning
from ringsim.core.tension import PASSING
from ringsim.core.winches import Winches
from ringsim.exudyn.assembly import Array, Assembly, Indices
from ringsim.exudyn.cable_path import CablePath, Placed

# The Jacobian of the cables' forces after the coordinates of the nodes that carry them.
#
# It is written with auxiliary unknowns that carry no mass and no force: for every span the change
# of its difference vector (three) and of its tension (one), for every rope that of its mean
# tension.  The coupling of all spans of a rope through its mean tension is then a few sparse rows
# instead of a dense block over the whole ring; eliminating the unknowns gives P^T (dF/dx) P with
# the material, decay and geometric parts of ringsim.core.tension.  The decay part alone is
# dense (spans by spans).  Its entries are written only where they matter to Newton's convergence:
# those of friction that turns round within a step.  Velocities of the points are taken as fixed
# while nodes turn at fixed rates; against the rest that is of the order of a node's turn within one
# step.


class JacobianPattern:
    """Rows and columns of the Jacobian, found once, and its values.

    The object's equation is mass * acceleration - force = 0; what follows is its left-hand side.
    ``most_ropes`` is the largest number of ropes that faults can make of the cables, and
    ``unknowns`` the number of auxiliary ones.
    """

    passing = PASSING
    """Slopes of pulleys' friction over those at rest below which Newton does without them."""
    negligible = 0.02
    """Decay entries are left out below this share of the largest geometric stiffness T / L.
    Newton needs one iteration more at most (tests/cable_engine/test_newton.py)."""

    def __init__(self, path: CablePath, ropes: Ropes, most_ropes: int) -> None:
        self._path, spans = path, ropes.spans
        self.unknowns = 4 * spans + most_ropes
        every = np.arange(path.size, path.size + self.unknowns)
        # The unknowns: differences of all spans, their tensions, and the ropes' mean tensions.
        self._differences = every[: 3 * spans].reshape(-1, 3)
        self._tensions, self._means = every[3 * spans : 4 * spans], every[4 * spans :]
        # Every leg of the two points of every span; the far point adds to the difference.
        ends = np.stack([ropes.near, ropes.near + 1], axis=1).ravel()
        end, self._leg = np.nonzero(path.leg_point == ends[:, None])
        self._span, self._sign = end // 2, 2.0 * (end % 2) - 1.0
        nodes = path.leg_node[self._leg]
        own, width = path.spots[nodes], path.width
        differences, tension = self._differences[self._span], self._tensions[self._span]
        first, second = path.turning_pairs
        turn = path.spots[path.leg_node, 3:]
        turned = np.ones((len(self._leg), width, 3), dtype=bool)
        turned[:, :3] = path.leg_carries[self._leg, None, None] > 0.0
        turned &= own[:, :, None] >= 0
        shifted = turned.copy()
        shifted[:, :3] &= np.eye(3, dtype=bool)
        places = [
            _pairs(differences, own),
            _pairs(own, tension[:, None]),
            _pairs(own, differences),
            _pairs(turn[first], turn[second]),
            _pairs(turn, turn),
        ]
        rows, columns = (np.concatenate([place[k] for place in places]) for k in (0, 1))
        filled = [shifted.transpose(0, 2, 1), turned[:, :, :1], turned]
        mask = np.concatenate([part.ravel() for part in filled])
        # Explicit zeros would fill the factors of the system's matrix.
        mask = np.concatenate([mask, (rows[len(mask) :] >= 0) & (columns[len(mask) :] >= 0)])
        self._kept = np.flatnonzero(mask)
        self._known = self.unknowns + len(self._kept)
        self._entries = np.ones((self._known, 3))
        self._entries[:, 0] = np.concatenate([every, rows[self._kept]])
        self._entries[:, 1] = np.concatenate([every, columns[self._kept]])

    def empty(self) -> Array:
        """Entries of a cable that pulls nothing, shape (entries, 3)."""
        return self._entries[: self.unknowns] * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0]

    def triplets(
        self,
        chain: Chain,
        state: ChainState,
        placed: Placed,
        by_q: float,
        by_rate: float,
        slopes: Array,
        left: Array | float = 1.0,
    ) -> Array:
        """All entries as (row, column, value), shape (entries, 3), until the next call.

        ``by_q`` and ``by_rate`` multiply the derivatives after coordinates and after rates;
        ``slopes`` are those of the pulleys' friction (``ringsim.core.chain``), and ``left``
        is the share of each rope's stiffness that its winches do not answer.
        """
        maps = self._path.leg_maps(placed)[self._leg] * self._sign[:, None, None]
        turned = maps.transpose(0, 2, 1)
        unit = state.directions
        across = np.eye(3) - unit[:, :, None] * unit[:, None, :]
        directions = (state.tensions / state.lengths)[:, None, None] * across
        shares = np.broadcast_to(left, len(state.natural)).astype(float)
        factors = chain.changes(
            state, placed.velocities, slopes, shares, by_q, by_rate, self.passing
        )
        parts = [part for each in factors for part in self._rope(state, *each, by_q)]
        blocks = [
            -maps,
            turned @ unit[self._span, :, None],
            turned @ directions[self._span],
            *(-block for block in self._path.turning(placed, state.point_forces)),
        ]
        values = np.concatenate([block.ravel() for block in blocks])
        count = self._known + sum(len(part) for part in parts)
        if len(self._entries) < count:  # a buffer that is kept: its first places stay the same
            room = np.empty((count // 4, 3))
            self._entries = np.concatenate([self._entries[: self._known], *parts, room])
        entries = self._entries[:count]
        entries[: self.unknowns, 2] = by_q
        np.multiply(values[self._kept], by_q, out=entries[self.unknowns : self._known, 2])
        if parts:  # none where all ropes are cut
            np.concatenate(parts, out=entries[self._known :])
        return entries

    def _rope(
        self, state: ChainState, rope: int, pulls: Array, changes: Array, by_q: float
    ) -> list[Array]:
        """How a rope's span tensions follow its mean tension and the differences of its points."""
        spans = slice(int(state.ropes.starts[rope]), int(state.ropes.ends[rope]))
        mean, tension = self._means[rope : rope + 1, None], self._tensions[spans, None]
        difference = self._differences[spans].reshape(1, -1)
        entries = [
            _entries(tension, mean, -by_q * pulls[0]),
            _entries(mean, difference, -changes[0]),
        ]
        if len(pulls) == 1:
            return entries
        flat = pulls[1:].T @ changes[1:].reshape(len(pulls) - 1, -1)
        stiffest = float(np.max(state.tensions[spans] / state.lengths[spans]))
        row, column = np.nonzero(np.abs(flat) > by_q * self.negligible * max(stiffest, 1.0))
        decay = [tension[row, 0], difference[0, column], -flat[row, column]]
        return [*entries, np.stack(decay, axis=1)]


def _entries(rows: Indices, columns: Indices, values: Array) -> Array:
    """Entries of a block with (a, 1) rows and (1, b) columns, shape (a b, 3)."""
    block = values.reshape(len(rows), columns.shape[1])
    return np.stack(np.broadcast_arrays(rows, columns, block), axis=-1).reshape(-1, 3)


def _pairs(rows: Indices, columns: Indices) -> tuple[Indices, Indices]:
    """Row and column of every entry of blocks, (n, a) and (n, b) -> (n a b,) each."""
    row, column = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return row.ravel(), column.ravel()


# Cables in the multibody model: their forces inside every Newton iteration.
#
# One exudyn object spans all nodes that the paths depend on.  Its force is the chain's, its
# Jacobian that of ``JacobianPattern``.


class CableDrive:
    """The cables of a scene, with their winches; each of the scene's ``faults`` may split a rope.

    Attributes
    ----------
    present, path
        The cables with their planes, and what they run over, on the model's nodes.
    chain, ropes, winches
        See ringsim.core.chain and ringsim.cable; faults replace the ropes.
    reference
        Coordinates of the nodes as drawn, (nodes, width).
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
        self.reference = reference
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
                forceUserFunction=self.force,
                jacobianUserFunction=self.jacobian,
            )
        )

    def evaluate(self, coordinates: Array, rates: Array, time: float) -> tuple[ChainState, Placed]:
        """The chain from the nodes' total coordinates and rates, (nodes, width)."""
        placed, ropes = self.path.place(coordinates, rates), self.ropes
        path = path_rate = None
        if self.winches.answering:
            path, path_rate = self.chain.paths(ropes, placed.points, placed.velocities)
        wound, wound_rate = self.winches.at(time, path, path_rate)
        state = self.chain.state(ropes, placed.points, placed.velocities, wound, wound_rate)
        return state, placed

    def take(self, ropes: Ropes) -> None:
        """Go on with ropes that a fault may have changed."""
        self.ropes = ropes

    def begin(self, time: float, state: ChainState, slopes: Array) -> None:
        """Let the winches begin the next step at a time (s) in a state of the chain.

        ``slopes`` are the derivatives of the cables' ideal paths after the opening angle, m/rad.
        """
        self._answered = None
        self._turning.forget()
        self.winches.advance(time, state, slopes, self.ropes, self.chain.table(self.ropes))

    def current(self, position: Array, velocity: Array, time: float) -> ChainState:
        """The chain at a state of the whole system (total coordinates)."""
        place, rates = (self.path.by_node(x[self._columns]) for x in (position, velocity))
        return self.evaluate(place, rates, time)[0]

    def _answer(self, q: Any, q_t: Any, time: float) -> tuple[ChainState, Placed]:
        """The chain at a state of the object; Newton asks twice for force and Jacobian."""
        size = self.path.size
        place, rates = (self.path.by_node(np.asarray(x[:size])) for x in (q, q_t))
        place = place + self.reference
        asked = (time, place.tobytes(), rates.tobytes())
        known = self._answered
        if known is None or known[0] != asked or known[1].ropes is not self.ropes:
            known = self._answered = asked, *self.evaluate(place, rates, time)
            self._turning.note(self.ropes, known[1].speeds)
        return known[1:]

    def force(self, mbs: Any, t: float, number: int, q: Any, q_t: Any) -> Array:
        """As exudyn asks for it at a time (s): forces on nodes and on unknowns of ropes, for
        displacements and rates of both; NaN where the chain has no answer.
        """
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

    def jacobian(
        self, mbs: Any, t: float, number: int, q: Any, q_t: Any, by_q: float, by_rate: float
    ) -> Any:
        """As exudyn asks for it: a sparse matrix, ``by_q`` and ``by_rate`` times the derivatives
        of what cables take, after coordinates and rates.
        """
        try:
            with np.errstate(all="ignore"):
                state, placed = self._answer(q, q_t, t)
                left: Array | float = 1.0
                if self.winches.answering:
                    left = self.winches.stiffness_left(t, state.paths, state.path_rates)
                slip, own = state.slip_speeds, state.exponent_slopes
                slopes = self._turning.slopes(
                    self.ropes, state.speeds, own, lambda speed: np.tanh(speed / slip)
                )
                triplets = self.pattern.triplets(
                    self.chain, state, placed, by_q, by_rate, slopes, left
                )
        except ValueError as error:
            self.refusal = str(error)
            triplets = self.pattern.empty()
        matrix = exu.MatrixContainer()
        matrix.SetWithSparseMatrix(triplets, self._size, self._size)
        return matrix
