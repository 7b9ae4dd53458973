"""Rigid and flexible booms, and what a free ring conserves."""

from typing import Any

import exudyn as exu
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ring_runs import ENGINES, UNTIL_LOCKED, Array, ring, run
from ringsim.exudyn.assembly import axes_of, turn_rates
from ringsim.exudyn.build import Built, build
from ringsim.exudyn.integrate import Integration
from ringsim.exudyn.integrate import solve as by_exudyn
from ringsim.exudyn.meters import EnergyMeter
from ringsim.exudyn.model import Openings, State
from ringsim.frame.integrate import Integration as Frames
from ringsim.frame.integrate import solve as by_frames
from ringsim.frame.model import FrameModel
from ringsim.parts.boom import FlexibleBoom
from ringsim.scene import Scene, load_scene


@pytest.mark.parametrize(
    ("base", "start"),
    [
        ("fixed", 110.0),
        pytest.param("fixed", 47.578, marks=pytest.mark.slow),
        pytest.param("free", 47.578, marks=pytest.mark.slow),
    ],
)
@ENGINES
def test_a_flexible_boom_hardly_bends(base: str, start: float, engine: str) -> None:
    """A tube of 60 mm against rods of 10 mm: its bending is a hundredth of the rods'."""
    rigid, flexible = (
        run(
            ring(
                3, boom__kind=kind, boom__base=base, structure__opening_angle=start, **UNTIL_LOCKED
            ),
            engine,
        )
        for kind in ("rigid", "flexible")
    )
    assert flexible.reaches(175.0) == pytest.approx(rigid.reaches(175.0), rel=3e-5)
    assert flexible.locks.max() == pytest.approx(rigid.locks.max(), rel=3e-4)


def test_the_lower_hinge_slides_from_element_to_element() -> None:
    scene = ring(3, boom__kind="flexible", boom__elements=8, solver__end_time=2.45)
    built = build(scene)
    history = Integration(built).run()
    assert history.fate.word == "cut_off"
    element, place = built.model.assembly.system.systemData.GetDataCoordinates()
    height = scene.structure.geometry().height(0.5 * (np.pi - float(history.angles[-1].mean())))
    length = scene.boom.length / 8  # type: ignore[union-attr]
    start = scene.structure.geometry().height(scene.structure.coordinate)
    assert int(element) == int(height / length) < int(start / length)
    # The first corner's height, against that of the mean angle: sections differ by elasticity.
    assert place == pytest.approx(height, rel=2e-4)


def momenta(built: Built) -> tuple[Array, Array]:
    """Momentum (kg m/s) and angular momentum (kg m^2/s) from exudyn's own mass matrix."""
    assembly = built.model.assembly
    system, data = assembly.system, assembly.system.systemData
    places = np.asarray(data.GetODE2Coordinates()) + np.asarray(
        data.GetODE2Coordinates(exu.ConfigurationType.Reference)
    )
    rates = np.asarray(data.GetODE2Coordinates_t())
    data.SetODE2Coordinates(data.GetODE2Coordinates(), exu.ConfigurationType.Initial)
    data.SetODE2Coordinates_t(rates, exu.ConfigurationType.Initial)
    solver = exu.MainSolverImplicitSecondOrder()
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    solver.InitializeSolver(system, settings)
    solver.ComputeMassMatrix(system)
    pushed = np.asarray(solver.GetSystemMassMatrix()) @ rates
    shifts, turns = np.zeros((2, 3, len(rates)))
    for node in assembly.starts:
        own = assembly.coordinates_of(node)
        for axis, unit in enumerate(np.eye(3)):
            shifts[axis, own[:3]] = unit
            turns[axis, own[:3]] = np.cross(unit, places[own[:3]])
            if len(own) == 7:
                turns[axis, own[3:]] = turn_rates(places[own[3:]][None], unit[None])[0]
            elif len(own) == 6:
                turns[axis, own[3:]] = np.cross(unit, places[own[3:]])
    return shifts @ pushed, turns @ pushed


@pytest.mark.parametrize("kind", ["none", "rigid", "flexible"])
def test_a_free_ring_keeps_its_momenta_at_zero(kind: str) -> None:
    """With a boom the ring pitches about y, and the forces, which stay vertical, then pull on
    upper and lower joints that are no longer above each other: a couple of its own."""
    boom = "none" if kind == "none" else {"kind": kind}
    built = build(ring(3, boom=boom, structure__aspect_ratio=0.7, solver__end_time=1.2))
    history = Integration(built).run()
    scale = np.sqrt(2.0 * 0.5 * history.energies[-1].kinetic)  # m v of half a kilogram
    momentum, angular = momenta(built)
    # Newton leaves 1e-5 of the driving forces.
    assert np.abs(momentum).max() < 1e-6 * scale
    assert np.abs(angular[[0, 2]]).max() < 1e-6 * scale
    assert abs(angular[1]) < (1e-6 if kind == "none" else 5e-3) * scale


def cable_arc(**values: Any) -> Scene:
    """A free arc of three on cables of up to 17 N, whose end assemblies lean on the boom."""
    plain = {
        "structure.sections": 3, "structure.closed": False, "structure.opening_angle": 40.0,
        "net": "none", "joints.hinge": {"viscous": 0.001}, "record.reactions": True,
        "solver.step_control": "constant", "solver.step": 0.01, "solver.end_time": 0.6,
        "solver.newton_tolerance": 1e-8,
    }  # fmt: skip
    chosen = {name.replace("__", "."): value for name, value in values.items()}
    return load_scene("ring18-cable").with_values(plain | chosen)


@pytest.mark.parametrize("values", [
    pytest.param({"boom__joint": "sleeve"}, marks=pytest.mark.slow), {"boom__joint": "prismatic"},
    pytest.param({"boom__kind": "flexible"}, marks=pytest.mark.slow),
    {"boom__kind": "flexible", "boom__elements": 9},
], ids=["sleeve", "prismatic", "flexible", "nine-elements"])  # fmt: skip
def test_cables_do_not_turn_a_free_arc(values: dict[str, Any]) -> None:
    """They pull within it.  What steps of 10 ms leave is 2e-7 of the scale; a joint whose torque is
    not dual to what it holds leaves 6e-5 and more, with steps however fine.
    """
    built = build(cable_arc(**values))
    history = Integration(built).run()
    scale = np.sqrt(2.0 * 0.5 * history.energies[-1].kinetic)
    momentum, angular = momenta(built)
    assert np.abs(momentum).max() < 1e-6 * scale
    assert np.abs(angular).max() < 1e-6 * scale


def test_a_stiff_boom_is_a_rigid_one() -> None:
    """A hundred times as stiff as the tube, in both engines: the base turns and carries as with a
    rigid boom, if the tube's sections have their inertia, too.  What is left is a hundredth of what
    the tube bends, 1e-4 of the largest.
    """
    stiff = {"boom__kind": "flexible", "boom__young_modulus": 12e12}
    for base, names in {"free": ["base_rotation"], "fixed": ["base_force", "base_torque"]}.items():
        given = {"boom__base": base, "solver__end_time": 0.3}
        rigid = by_exudyn(cable_arc(**given)).values
        for solve in (by_exudyn, by_frames):
            found = solve(cable_arc(**given, **stiff)).values
            for name in names:
                largest = np.abs(rigid[name]).max()
                assert np.abs(found[name] - rigid[name]).max() < 5e-4 * largest, (name, solve)


def test_a_prismatic_joint_holds_the_turns_that_a_sleeve_leaves() -> None:
    """Both engines; what holds them does no work."""
    for joint, holds in (("sleeve", False), ("prismatic", True)):
        scene = cable_arc(boom__joint=joint, solver__end_time=0.4, record__positions=True)
        built = build(scene)
        exact = Integration(built)
        one = exact.run().outcome().values
        nodes = [built.model.bodies[plane[0]][1] for plane in built.model.layout.corners]
        where = np.array([built.model.assembly.coordinates_of(node)[3:] for node in nodes])
        turns = axes_of(exact.state.position[where])
        run = Frames(FrameModel(scene))
        two = run.run().outcome().values
        for upper, lower in (
            turns,
            run.state.pose.axes[[plane[0] for plane in run.model.layout.corners]],
        ):
            turned = np.degrees(Rotation.from_matrix(upper.T @ lower).magnitude())
            assert (turned < 1e-6) if holds else (turned > 1.0)
        largest = np.abs(one["base_rotation"]).max()
        assert np.abs(one["base_rotation"] - two["base_rotation"]).max() < 2e-3 * largest
        for values in (one, two):
            assert values["energy_error"] < 1e-3
            assert values["constraint_error"] < 1e-8


def test_the_energy_of_a_flexible_boom_is_counted() -> None:
    """A beam that is clamped at its top and pulled aside at its tip stores F^2 L^3 / 6 E I, one
    that is stretched by e stores E A e^2 L / 2, and one that swings about its top m L^2 w^2 / 6.
    """
    scene = ring(3, boom__kind="flexible", boom__elements=3)
    built = build(scene)
    boom, system = scene.boom, built.model.assembly.system
    assert isinstance(boom, FlexibleBoom)
    data, start, meter = system.systemData, State(built.model), EnergyMeter(built)
    places = start.position
    along = np.linspace(0.0, boom.length, boom.elements + 1)
    nodes = [node for node in built.model.assembly.starts if _is_of(built, node)]
    where = np.array([built.model.assembly.coordinates_of(node) for node in nodes])
    assert where.shape == (4, 6)

    def energies(shift: Array, slope: Array, *, moving: bool = False) -> tuple[float, float]:
        """Kinetic and elastic ones of nodes that are moved, or move, so; (n, 3) each."""
        moved = np.zeros_like(places)
        moved[where] = np.hstack([shift, slope])
        data.SetODE2Coordinates(np.zeros_like(moved) if moving else moved)
        data.SetODE2Coordinates_t(moved if moving else np.zeros_like(moved))
        state = State(built.model)
        found = meter.read(0.0, state, *Openings(built.model).read(state), None)
        return found.kinetic, found.elastic

    length, young = boom.length, boom.young_modulus
    rest = energies(np.zeros((4, 3)), np.zeros((4, 3)))[1]
    bending, force, x = young * boom.tube.second_moment, 0.01, np.array([1.0, 0.0, 0.0])
    aside = force * along**2 * (3.0 * length - along) / (6.0 * bending)
    turned = force * along * (2.0 * length - along) / (2.0 * bending)
    _, bent = energies(np.outer(aside, x), np.outer(turned, x))
    assert bent - rest == pytest.approx(force**2 * length**3 / (6.0 * bending), rel=1e-4)
    strain, down = 1e-5, np.array([0.0, 0.0, -1.0])
    _, pulled = energies(strain * np.outer(along, down), strain * np.tile(down, (4, 1)))
    stretched = 0.5 * young * boom.tube.area * strain**2 * length
    assert pulled - rest == pytest.approx(stretched, rel=1e-6)
    swung, _ = energies(np.outer(along, x), np.tile(x, (4, 1)), moving=True)
    assert swung == pytest.approx(boom.mass * length**2 / 6.0, rel=1e-6)


def _is_of(built: Built, node: int) -> bool:
    """Whether a node is of a boom: a place with one slope."""
    return built.model.assembly.system.GetNode(node)["nodeType"] == "PointSlope1"
