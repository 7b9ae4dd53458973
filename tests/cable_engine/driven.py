"""Trusses and rings with cables, and admissible motions of the nodes that carry the cables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ringsim.exudyn.assembly import turn_rates
from ringsim.exudyn.build import Built, build
from ringsim.exudyn.cables import CableDrive
from ringsim.parts.faults import Faults, Struck
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run, run_frame
from ringsim.variables import Outcome

Array = NDArray[np.float64]


def truss(sections: int = 2, **values: Any) -> Scene:
    """The two-section truss, or a longer one.

    Keywords name scene fields, two underscores stand for a dot, and ``both__`` for the same
    field of either cable.
    """
    chosen = {"structure.sections": sections, "record.interval": 0.05}
    for name, value in values.items():
        path = name.replace("__", ".")
        ends = ("cables.upper.", "cables.lower.") if path.startswith("both.") else ("",)
        chosen |= {end + path.removeprefix("both."): value for end in ends}
    return load_scene("truss2").with_values(chosen)


def outcome(scene: Scene, engine: str = "full") -> Outcome:
    """Run a scene; the checks that hold of every run are made here."""
    found = {"full": run, "frame": run_frame}[engine](scene)
    # Frames have no joints that could gape but for a stiff spring at each (docs/theory/frame.md).
    assert found.values["constraint_error"] < {"full": 1e-9, "frame": 1e-8}[engine]
    return found


def turned(turns: Array, rotations: Array) -> Array:
    """Unit quaternions turned by global rotation vectors (rad), shape (n, 4) and (n, 3)."""
    found = Rotation.from_rotvec(rotations) * Rotation.from_quat(np.roll(turns, -1, axis=1))
    after = np.roll(found.as_quat(), 1, axis=1)
    # A rotation has two quaternions: stay near the one that was given.
    return np.asarray(after * np.sign(np.sum(after * turns, axis=1))[:, None])


def axis_of(turn: Array) -> Array:
    """Third axis of the frame of a unit quaternion."""
    return np.asarray(Rotation.from_quat(np.roll(turn, -1)).as_matrix()[:, 2])


def write_all(drive: CableDrive) -> None:
    """Let the cables write all entries of their Jacobian, also those that Newton does without."""
    drive.pattern.passing, drive.pattern.negligible = 0.0, 0.0


@dataclass(frozen=True)
class Motion:
    """Velocities (m/s) and spins (rad/s) of nodes, and what their V-joints turn; (n, 3) each."""

    moves: Array
    spins: Array
    bends: Array


@dataclass
class Bench:
    """The cables of a built scene, moved by hand."""

    scene: Scene

    def __post_init__(self) -> None:
        self.built: Built = build(self.scene)
        drive = self.built.cables
        assert drive is not None
        self.drive: CableDrive = drive
        self.width = 7 * len(drive.path.nodes)
        self.reference = np.array(
            [
                self.built.model.assembly.system.GetNodeParameter(n, "referenceCoordinates")
                for n in drive.path.nodes
            ]
        )
        number = {int(node): k for k, node in enumerate(drive.path.nodes)}
        self.pairs = [
            (number[int(joint.nodes[0])], number[int(joint.nodes[1])])
            for plane in self.built.model.openings()
            for joint, _ in plane
        ]

    def motion(self, rng: np.random.Generator, place: Array) -> Motion:
        """A random motion that the V-joints allow, of the order of 1 m/s and 1 rad/s."""
        moves, spins = rng.normal(size=(2, len(place), 3))
        bends = np.zeros_like(spins)
        for left, right in self.pairs:
            moves[right], spins[right] = moves[left], spins[left]
            bends[right] = rng.normal() * axis_of(place[left, 3:])
        return Motion(0.3 * moves, spins, bends)

    def moved(self, place: Array, motion: Motion, by: float) -> Array:
        """The nodes' coordinates after a motion for a time ``by``; V-joints keep their axes."""
        bent = turned(place[:, 3:], by * motion.bends)
        return np.hstack([place[:, :3] + by * motion.moves, turned(bent, by * motion.spins)])

    def rates(self, place: Array, motion: Motion) -> Array:
        """Rates of the nodes' coordinates in a motion."""
        return np.hstack([motion.moves, turn_rates(place[:, 3:], motion.spins + motion.bends)])

    def force(self, place: Array, rates: Array, time: float = 0.0) -> Array:
        """Generalised forces that the solver sees, (nodes * 7,)."""
        still = np.zeros(self.drive.pattern.unknowns)
        q = np.concatenate([(place - self.reference).ravel(), still])
        q_t = np.concatenate([rates.ravel(), still])
        return self.drive.force(None, time, 0, q, q_t)[: self.width]

    def force_at(self, place: Array, velocities: Array, time: float = 0.0) -> Array:
        """The same for given velocities of the points, (nodes * 7,)."""
        path, drive = self.drive.path, self.drive
        placed = path.place(place, np.zeros_like(place))
        wound, rate = drive.winches.at(time)
        state = drive.chain.state(drive.ropes, placed.points, velocities, wound, rate)
        return path.in_a_row(path.generalised(placed, state.point_forces))

    def strike(self, place: Array, rates: Array, time: float) -> None:
        """Let the scene's faults happen at a state."""
        state, _ = self.drive.evaluate(place, rates, time)
        folded, laws = np.zeros((2, self.scene.structure.sections)), self.built.angles
        ropes = self.drive.ropes, state.stored, state.wound
        struck = Struck(self.scene.structure.planes, laws.switches, folded, *ropes)
        due = Faults(self.scene.faults).due(time)
        assert due
        for fault in due:
            fault.strike(struck)
        laws.follow()
        self.drive.take(struck.ropes)

    def jacobian(self, place: Array, rates: Array, by_rate: float, *, whole: bool = True) -> Array:
        """d(-force)/dq + by_rate * d(-force)/dq_t, auxiliary unknowns eliminated.

        ``whole``: with all entries, also those that Newton does without.
        """
        state, placed = self.drive.evaluate(place, rates, 0.0)
        if whole:
            write_all(self.drive)
        entries = self.drive.pattern.triplets(
            self.drive.chain, state, placed, 1.0, by_rate, state.exponent_slopes
        )
        size = self.width + self.drive.pattern.unknowns
        matrix = np.zeros((size, size))
        np.add.at(matrix, (entries[:, 0].astype(int), entries[:, 1].astype(int)), entries[:, 2])
        own, rest = slice(None, self.width), slice(self.width, None)
        eliminated = np.linalg.solve(matrix[rest, rest], matrix[rest, own])
        return np.asarray(matrix[own, own] - matrix[own, rest] @ eliminated)
