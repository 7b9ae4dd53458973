"""Damping of the rods: acts as Kelvin-Voigt says, costs nothing in rigid motion, is accounted."""

import exudyn as exu
import numpy as np
import pytest

from ring_runs import ENGINES, Array, ring, run
from ringsim.exudyn.assembly import Assembly
from ringsim.exudyn.rods import GeometricallyExact
from ringsim.layout.bodies import Pose

LENGTH, MASS, INERTIA, RELAXATION = 0.3, 1.0, 1e-2, 1e-3
STIFFNESS = np.diag([1e4, 4e3, 4e3, 10.0, 20.0, 20.0])


def swing(
    relaxation: float,
    spin: float,
    stretch: float,
    bend: float,
    steps: int = 2000,
    end: float = 0.2,
    radius: float = 0.99,
) -> tuple[Array, Array]:
    """One nearly massless element between two bodies, set off spinning, stretching, bending.

    Returns times, s, and stretch, bending angle and spin over them.
    """
    assembly = Assembly()
    section = exu.BeamSection()
    section.massPerLength = 1e-6
    section.inertia = 1e-9 * np.eye(3)
    section.stiffnessMatrix = STIFFNESS
    section.dampingMatrix = relaxation * STIFFNESS
    poses = [Pose.of([x, 0.0, 0.0], np.eye(3)) for x in (0.0, LENGTH)]
    nodes = [assembly.add_rigid_node(pose) for pose in poses]
    for node in nodes:
        assembly.add_body(node, MASS, INERTIA * np.eye(3))
    GeometricallyExact().add_element(assembly, nodes, LENGTH, section)
    assembly.finish()
    data = assembly.system.systemData
    rates = np.zeros(data.ODE2Size())
    for sense, node in zip((-1.0, 1.0), nodes, strict=True):
        across = 0.5 * spin * LENGTH * sense
        rates[assembly.coordinates_of(node)] = [
            *(0.5 * stretch * sense, across, 0.0),
            *(0.0, 0.0, 0.25 * bend * sense, 0.5 * spin),
        ]
    data.SetODE2Coordinates_t(rates, exu.ConfigurationType.Initial)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.endTime = end
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.generalizedAlpha.spectralRadius = radius
    settings.timeIntegration.newton.relativeTolerance = 1e-6
    settings.timeIntegration.newton.absoluteTolerance = 1e-7
    kind = exu.OutputVariableType
    rows: list[list[float]] = []

    def note(system: exu.MainSystem, time: float) -> bool:
        assembly.dampers.lost(time)
        places = [np.array(system.GetNodeOutput(n, kind.Position)) for n in nodes]
        turns = [np.array(system.GetNodeOutput(n, kind.AngularVelocityLocal)) for n in nodes]
        reach = float(np.linalg.norm(places[1] - places[0]))
        rows.append([time, reach - LENGTH, turns[1][1] - turns[0][1], turns[0][2]])
        return True

    assembly.system.SetPostStepUserFunction(note)
    assembly.system.SetPreNewtonResidualUserFunction(assembly.dampers.prepare)
    assembly.dampers.lost(0.0)
    assembly.system.SolveDynamic(settings)
    table = np.array(rows)
    return table[:, 0], table[:, 1:]


def decay(times: Array, values: Array) -> float:
    """Rate at which the peaks of a vibration fade, 1/s."""
    peaks = 1 + np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:]))
    first, last = peaks[0], peaks[min(2, len(peaks) - 1)]
    return float(np.log(values[first] / values[last]) / (times[last] - times[first]))


@pytest.mark.parametrize(("column", "spring"), [(0, 1e4 / LENGTH), (1, 20.0 / LENGTH)])
def test_vibrations_fade_at_half_tau_omega_squared(column: int, spring: float) -> None:
    square = spring / (0.5 * (MASS if column == 0 else INERTIA))
    stretch, bend = (0.01, 0.0) if column == 0 else (0.0, 0.05)
    times, values = swing(RELAXATION, 0.0, stretch, bend)
    # Peaks are read on the grid of steps, 1/240 and 1/540 of a period.
    assert decay(times, values[:, column]) == pytest.approx(0.5 * RELAXATION * square, rel=0.02)


def test_undamped_vibrations_last() -> None:
    times, values = swing(0.0, 0.0, 0.01, 0.0)
    assert abs(decay(times, values[:, 0])) < 0.1


def test_a_spinning_element_is_not_braked() -> None:
    """Also with ten thousand times the damping: the ends' frames meet in the middle."""
    _, values = swing(10.0, 3.0, 0.0, 0.0)
    # The stretch by centrifugal force, m spin^2 L / 2 over EA / L, slows it once: 2 * 4e-5.
    np.testing.assert_allclose(values[:, 2], 3.0, rtol=2e-4)


def test_a_turning_element_carries_no_false_stretch_at_long_steps() -> None:
    """In steps of 0.15 rad velocities are wrong by millimetres a second along the rod, which
    times C is several times the centrifugal force.
    """
    _, values = swing(0.1, 3.0, 0.0, 0.0, steps=40, end=2.0, radius=0.8)
    stretch = MASS * 3.0**2 * 0.5 * LENGTH * LENGTH / 1e4
    # After fifteen times tau; the integrator's own error of such steps is about a percent
    # of the force.  The last row is a step of round-off length.
    np.testing.assert_allclose(values[30:40, 0], stretch, rtol=0.02)


def test_short_steps_take_velocities_and_long_ones_differences() -> None:
    """Either side of tau / 4 the vibration fades alike."""
    square = 20.0 / LENGTH / (0.5 * INERTIA)
    tau = 2e-3
    rates = []
    for steps in (250, 500):  # of 0.8 and 0.4 ms, tau / 4 between them
        times, values = swing(tau, 0.0, 0.0, 0.05, steps=steps, end=0.2)
        rates.append(decay(times, values[:, 1]))
    # A period has 67 and 130 steps: peaks are read to 1e-2, the integrator damps a little more.
    np.testing.assert_allclose(rates, 0.5 * tau * square, rtol=0.1)


@ENGINES
def test_what_the_rods_take_at_the_stop_is_accounted(engine: str) -> None:
    """With stops that take nothing all that is lost is lost in the rods."""
    coarse, fine = (
        run(
            ring(
                3,
                structure__opening_angle=120.0,
                rods__damping=1e-3,
                stop__damping=0.0,
                solver__tolerance=t,
            ),
            engine,
        )
        for t in (1e-4, 1e-5)
    )
    lost = np.array(fine.history.energies)[:, 3].sum()
    work = np.array(fine.history.energies)[-1, 2]
    # At the stop more than half of the kinetic energy ends in the rods.
    assert 0.4 < lost / work < 0.7
    assert np.abs(coarse.balance()).max() < 1e-3
    assert np.abs(fine.balance()).max() < 2e-4
