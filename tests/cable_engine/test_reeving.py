"""Without friction the cable is exudyn's own reeving system, over pulleys without a radius.

Both are one tension EA (L - L0) / L0 in a rope that runs freely over points of bodies.
"""

from __future__ import annotations

from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
import pytest
from numpy.typing import NDArray

from ringsim.cable.records import Cable, Cables, FixedSheave, Winch
from ringsim.cable.winding import ConstantWinding
from ringsim.exudyn.assembly import Assembly
from ringsim.exudyn.cable_path import CablePath
from ringsim.exudyn.cables import CableDrive
from ringsim.layout.bodies import Pose

Array = NDArray[np.float64]
STIFFNESS, STRETCH, GRAVITY = 2e3, 0.014, 9.81
HOOKS = np.array([[0.0, 0.0, 0.0], [0.9, 0.1, 0.2], [2.1, -0.1, 0.1]])
"""Fixed points of the rope."""
BLOCKS = ((0.4, -0.7, 0.1), (1.6, -0.8, 0.0))
"""Places of two bodies that hang in the rope's bights, each on a point off its centre."""
ARMS = np.array([[0.05, 0.12, 0.03], [-0.04, 0.1, 0.02]])
MASSES = (1.0, 0.7)
STEP, END = 0.004, 1.0


class Swing:
    """Two bodies that swing and turn in the bights of a rope, from rest."""

    def __init__(self) -> None:
        self.assembly = Assembly()
        frame = self._body(np.zeros(3), 1.0)
        system = self.assembly.system
        bodies = system.AddObject(item.ObjectGround()), frame[0]
        clamp = [self.assembly.body_marker(body, np.zeros(3)) for body in bodies]
        system.AddObject(item.ObjectJointGeneric(markerNumbers=clamp, constrainedAxes=[1] * 6))
        blocks = [self._body(np.array(p), m) for p, m in zip(BLOCKS, MASSES, strict=True)]
        for body, _ in blocks:
            marker = system.AddMarker(item.MarkerBodyMass(bodyNumber=body))
            system.AddLoad(
                item.LoadMassProportional(markerNumber=marker, loadVector=[0.0, -GRAVITY, 0.0])
            )
        self.path = [
            (frame, HOOKS[0]), (blocks[0], ARMS[0]), (frame, HOOKS[1]), (blocks[1], ARMS[1]),
            (frame, HOOKS[2]),
        ]  # fmt: skip

    def _body(self, place: Array, mass: float) -> tuple[Any, Any]:
        node = self.assembly.add_rigid_node(Pose.of(place, np.eye(3)))
        inertia = mass * np.diag([0.02, 0.03, 0.025])
        return self.assembly.add_body(node, mass, inertia), node

    def start_length(self) -> float:
        places = [np.zeros(3), np.array(BLOCKS[0]), np.zeros(3), np.array(BLOCKS[1]), np.zeros(3)]
        points = np.array([p + arm for p, (_, arm) in zip(places, self.path, strict=True)])
        return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())

    def with_cable(self) -> CableDrive:
        cable = Cable(
            winch=Winch(winding=ConstantWinding(speed=0.0)),
            axial_stiffness=STIFFNESS,
            initial_slack=-STRETCH,
        )
        sheaves = [FixedSheave(node, arm) for (_, node), arm in self.path]
        path = CablePath([sheaves])
        drive = CableDrive(self.assembly, Cables(upper=cable), path, faults=0)
        self.assembly.finish()
        return drive

    def with_reeving(self, regularization: float) -> Any:
        markers = [self.assembly.body_marker(body, arm) for (body, _), arm in self.path]
        reeving = self.assembly.system.AddObject(
            item.ObjectConnectorReevingSystemSprings(
                markerNumbers=markers,
                stiffnessPerLength=STIFFNESS,
                referenceLength=self.start_length() - STRETCH,
                sheavesAxes=exu.Vector3DList([[0.0, 0.0, 1.0]] * len(markers)),
                sheavesRadii=[0.0] * len(markers),
                regularizationForce=regularization,
            )
        )
        self.assembly.finish()
        return reeving

    def run(self, tension: Any) -> tuple[Array, Array]:
        """Tensions and coordinates of the bodies at every step."""
        system, tensions, places = self.assembly.system, [], []
        nodes = [self.assembly.coordinates_of(n) for n in self.assembly.rigid_nodes]
        columns = np.concatenate(nodes)
        data = system.systemData
        reference = np.array(data.GetODE2Coordinates(exu.ConfigurationType.Reference))

        def after_step(_: Any, time: float) -> bool:
            position = np.asarray(data.GetODE2Coordinates()) + reference
            tensions.append(tension(position, np.asarray(data.GetODE2Coordinates_t()), time))
            places.append(position[columns])
            return True

        system.SetPostStepUserFunction(after_step)
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.endTime = END
        settings.timeIntegration.numberOfSteps = round(END / STEP)
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        # The cable's auxiliary unknowns have no mass, so nobody starts from an equation of motion.
        settings.timeIntegration.generalizedAlpha.computeInitialAccelerations = False
        settings.timeIntegration.newton.relativeTolerance = 1e-12
        settings.timeIntegration.newton.absoluteTolerance = 1e-10
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        assert exu.MainSolverImplicitSecondOrder().SolveSystem(system, settings)
        return np.array(tensions), np.array(places)


def reeved(regularization: float) -> tuple[Array, Array]:
    swing = Swing()
    reeving = swing.with_reeving(regularization)
    output = swing.assembly.system.GetObjectOutput
    force = exu.OutputVariableType.ForceLocal
    return swing.run(lambda *_: float(np.ravel(output(reeving, force))[0]))


@pytest.fixture(scope="module")
def driven() -> tuple[Array, Array, CableDrive]:
    swing = Swing()
    drive = swing.with_cable()
    tensions, places = swing.run(lambda *state: float(drive.current(*state).mean_tensions[0]))
    return tensions, places, drive


@pytest.mark.parametrize("regularization", [-1.0, 0.1])
def test_tension_of_a_swinging_rope(
    driven: tuple[Array, Array, CableDrive], regularization: float
) -> None:
    """Whether exudyn lets the rope push (-1) or limits its push to 0.1 N: it stays taut here."""
    own, places, _ = driven
    other, others = reeved(regularization)
    # Taut by far more than both regularisations, and moving enough to tell formulas apart.
    assert own.min() > 1.0
    assert np.ptp(own) > 2.0
    assert np.ptp(places, axis=0).max() > 0.1
    # Newton stops at 1e-10 N of residual; a second of smooth motion adds little to that.
    np.testing.assert_allclose(own, other, rtol=1e-9)
    np.testing.assert_allclose(places, others, rtol=0.0, atol=1e-10)


def test_tension_at_given_states(driven: tuple[Array, Array, CableDrive]) -> None:
    """At states that another solver found, the chain has that solver's tension: no history."""
    _, _, drive = driven
    swing = Swing()
    reeving = swing.with_reeving(-1.0)
    output = swing.assembly.system.GetObjectOutput
    force = exu.OutputVariableType.ForceLocal
    pairs: list[tuple[float, float]] = []

    def both(position: Array, velocity: Array, time: float) -> float:
        del time
        nodes = [swing.assembly.coordinates_of(n) for n in swing.assembly.rigid_nodes]
        placed = np.array([position[n] for n in nodes])
        moving = np.array([velocity[n] for n in nodes])
        state, _ = drive.evaluate(placed, moving, 0.0)
        pairs.append((float(state.mean_tensions[0]), float(np.ravel(output(reeving, force))[0])))
        return 0.0

    swing.run(both)
    own, other = np.array(pairs).T
    # The same formula of the same coordinates: T = EA (L - L0) / L0 loses L / (L - L0) = 200
    # of the digits.
    np.testing.assert_allclose(own, other, rtol=1e-11)
