"""One rod element: its energy and forces, and cantilevers of it here and in exudyn."""

from __future__ import annotations

from typing import NamedTuple

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ringsim.core.library import call
from ringsim.frame.elimination import Fronts
from ringsim.frame.mesh import Mesh
from ringsim.frame.state import Pose, Strains, room_for_loads

Array = NDArray[np.float64]
LENGTH = 0.3
STIFFNESS = np.array([4e2, 5e1, 5e1]), np.array([1.0, 3.0, 3.0])
"""Of u (N/m) and psi (N m): what a bend of 1 rad needs moves the middle by some tenths."""


class Ends(NamedTuple):
    """Places (m) and axes of the two ends."""

    x1: Array
    r1: Array
    x2: Array
    r2: Array

    def moved(self, by: Array) -> Ends:
        """Changed by (x1, phi1, x2, phi2), shape (12,)."""
        return Ends(
            self.x1 + by[:3], rotation(by[3:6]) @ self.r1,
            self.x2 + by[6:9], rotation(by[9:]) @ self.r2,
        )  # fmt: skip

    def carried_along(self, place: Array, turn: Array) -> Ends:
        """After a rigid motion."""
        return Ends(place + turn @ self.x1, turn @ self.r1, place + turn @ self.x2, turn @ self.r2)

    def exchanged(self) -> Ends:
        """The same rod counted from its other end: both axes x and y turn round."""
        back = np.diag([-1.0, -1.0, 1.0])
        return Ends(self.x2, self.r2 @ back, self.x1, self.r1 @ back)


def rotation(vector: Array) -> Array:
    """Matrix of a rotation vector."""
    return Rotation.from_rotvec(vector).as_matrix()


def bent(rng: np.random.Generator, angle: float) -> Ends:
    """An element somewhere, bent and twisted by an angle (rad) and stretched in proportion."""
    axis = rng.normal(size=3)
    r1 = rotation(rng.normal(size=3))
    r2 = r1 @ rotation(angle * axis / np.linalg.norm(axis))
    x1 = rng.normal(size=3)
    x2 = x1 + r1 @ (np.array([LENGTH, 0.0, 0.0]) + 0.1 * LENGTH * angle * rng.normal(size=3))
    return Ends(x1, r1, x2, r2)


# A model of this element alone, without mass, between two frames at its ends.
_NUMBERS = np.zeros(0, np.int64)
_MESH = Mesh(
    frame=np.array([[0, 1]]), angle=np.full((1, 2), -1), axes=np.tile(np.eye(3), (1, 2, 1, 1)),
    point=np.array([[0, 1]]), length=np.array([LENGTH]),
    stiffness=np.concatenate(STIFFNESS)[None], mass=np.zeros((1, 2)), tau=np.zeros(1),
    point_frame=np.array([0, 1]), point_arm=np.zeros((2, 3)), point_mass=np.zeros(2),
    home=np.array([0, 6]), angle_home=_NUMBERS, part=np.array([0]),
    local=np.array([[*range(6), -1, *range(6, 12), -1]]), angle_local=np.zeros((0, 2), np.int64),
    frame_local=np.array([[0, 0], [0, 6]]), gone=np.array([12]), size=np.array([12]),
    spots=np.arange(12)[None], parent=np.array([-1]), up=np.full((1, 12), -1), fixed=_NUMBERS,
    craft=_NUMBERS, unknowns=12,
)  # fmt: skip


def _loaded(ends: Ends) -> tuple[Pose, Array, Array, Array, Array]:
    """Pose, places of the points, strains, what the element holds and forces."""
    points = np.array([ends.x1, ends.x2])
    pose = Pose(points.copy(), np.array([ends.r1, ends.r2]), np.zeros(0))
    now, loads, found = np.zeros((1, 6)), room_for_loads(_MESH), np.zeros(12)
    rest, strained = np.zeros((2, 3)), Strains(now, np.zeros((1, 6)), np.zeros(1))
    call("add_forces", _MESH, pose, points, rest, strained, loads, found)
    return pose, points, now[0], loads, found


def strains(ends: Ends) -> tuple[Array, Array]:
    """u and psi."""
    _, _, found, _, _ = _loaded(ends)
    return found[:3], found[3:]


def energy(ends: Ends) -> float:
    u, psi = strains(ends)
    return float(0.5 * (STIFFNESS[0] @ u**2 + STIFFNESS[1] @ psi**2))


def forces(ends: Ends) -> Array:
    """Forces and moments on (x1, phi1, x2, phi2), shape (12,)."""
    *_, found = _loaded(ends)
    return found


def tangent(ends: Ends) -> Array:
    """Their derivative, shape (12, 12)."""
    pose, points, _, loads, _ = _loaded(ends)
    fronts = Fronts.empty(_MESH)
    call("begin_tangent", _MESH, pose, points, np.zeros((2, 3)), loads, 0.0, 0.0, fronts)
    return fronts.whole[0, :12, :12].copy()


def differences(function, ends: Ends, step: float = 1e-6) -> Array:
    """Central differences of a function after (x1, phi1, x2, phi2), in the last axis."""
    units = step * np.eye(12)
    return np.stack(
        [(function(ends.moved(e)) - function(ends.moved(-e))) / (2.0 * step) for e in units], -1
    )


def cantilever(force: Array, moment: Array) -> Ends:
    """One element clamped at its first end, with dead loads on its second."""
    ends = Ends(np.zeros(3), np.eye(3), np.array([LENGTH, 0.0, 0.0]), np.eye(3))
    load = np.concatenate([force, moment])
    for share in np.linspace(0.1, 1.0, 10):
        for _ in range(50):
            missing = forces(ends)[6:] - share * load
            if np.linalg.norm(missing) < 1e-9 * np.linalg.norm(load):
                break
            change = np.linalg.solve(tangent(ends)[6:, 6:], missing)
            ends = ends.moved(np.concatenate([np.zeros(6), -change]))
        else:
            raise AssertionError("Newton found no balance")
    return ends


def exudyn_cantilever(force: Array, moment: Array) -> Ends:
    """The same by exudyn's own element."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    turn = [1.0, 0.0, 0.0, 0.0]
    nodes = [
        system.AddNode(item.NodeRigidBodyEP(referenceCoordinates=[x, 0.0, 0.0, *turn]))
        for x in (0.0, LENGTH)
    ]
    section = exu.BeamSection()
    section.massPerLength = 1.0
    section.inertia = 1e-3 * np.eye(3)
    section.stiffnessMatrix = np.diag([*STIFFNESS[0], *STIFFNESS[1]]) * LENGTH
    system.AddObject(
        item.ObjectBeamGeometricallyExact(nodeNumbers=nodes, length=LENGTH, sectionData=section)
    )
    ground = system.AddMarker(
        item.MarkerBodyRigid(bodyNumber=system.AddObject(item.ObjectGround()))
    )
    first, second = (system.AddMarker(item.MarkerNodeRigid(nodeNumber=node)) for node in nodes)
    system.AddObject(item.ObjectJointGeneric(markerNumbers=[ground, first]))
    system.AddLoad(item.LoadForceVector(markerNumber=second, loadVector=list(force)))
    system.AddLoad(item.LoadTorqueVector(markerNumber=second, loadVector=list(moment)))
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.staticSolver.numberOfLoadSteps = 10
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.newton.relativeTolerance = 1e-13
    settings.staticSolver.newton.absoluteTolerance = 1e-13
    settings.staticSolver.newton.maxIterations = 50
    settings.solution.file.write = False
    assert system.SolveStatic(settings)
    x2 = np.array(system.GetNodeOutput(nodes[1], exu.OutputVariableType.Position))
    r2 = np.array(system.GetNodeOutput(nodes[1], exu.OutputVariableType.RotationMatrix))
    container.Reset()
    return Ends(np.zeros(3), np.eye(3), x2, r2.reshape(3, 3))
