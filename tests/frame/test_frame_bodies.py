"""Inertia on points: bodies of four, and what a ring without loads keeps."""

import math
from typing import Any

import numpy as np
import pytest

from ringsim.core.library import call
from ringsim.frame.integrate import Integration
from ringsim.frame.mesh import tetrahedron
from ringsim.frame.model import FrameModel
from ringsim.scene import load_scene

pytestmark = pytest.mark.quick


@pytest.mark.parametrize("flat", [False, True], ids=["solid", "needle"])
def test_four_points_are_a_body(flat: bool) -> None:
    """Mass, centre and inertia about the origin, to round-off; a needle has no width."""
    rng = np.random.default_rng(3)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    seconds = axes @ np.diag([0.0, 0.0, 2.0] if flat else [0.5, 1.0, 2.0]) @ axes.T
    mass, centre = 3.0, rng.normal(size=3)
    about_origin = seconds + mass * np.outer(centre, centre)
    inertia = np.trace(about_origin) * np.eye(3) - about_origin
    points = tetrahedron(mass, centre, inertia)
    assert points.mean(axis=0) == pytest.approx(centre, abs=1e-14)
    found = sum(0.25 * mass * (p @ p * np.eye(3) - np.outer(p, p)) for p in points)
    # A second moment of zero is lost in round-off of the others, 1e-16, and its root is 1e-8.
    assert found == pytest.approx(inertia, abs=1e-13)


def test_a_rigid_turn_has_the_energy_of_the_whole_ring() -> None:
    """Kinetic energy of a turn about an axis is half the inertia of all masses, from the layout."""
    scene = load_scene("ring18").with_values({"structure.sections": 5, "net": "none"})
    model = FrameModel(scene)
    layout = model.layout
    turn = np.array([0.3, -0.2, 0.9])
    expected = 0.0
    for body in layout.bodies:
        spin = body.pose.axes.T @ turn
        rate = np.cross(turn, body.pose.place)
        shift = np.cross(spin, body.centre)
        expected += 0.5 * spin @ body.inertia @ spin + 0.5 * body.mass * rate @ rate
        expected += body.mass * (body.pose.axes.T @ rate) @ shift
    for rod in layout.rods:
        # A slender tube: about its own axis nothing, across it the inertia of its sections.
        direction = rod.station(0.0).axes[:, 0]
        across = turn - (turn @ direction) * direction
        sections = rod.density * rod.tube.second_moment * rod.length
        expected += 0.5 * sections * across @ across
        ends = [np.cross(turn, rod.station(share).place) for share in rod.stations]
        for k, length in enumerate(rod.lengths):
            mass, (u, v) = rod.density * rod.tube.area * length, ends[k : k + 2]
            expected += mass / 6.0 * (u @ u + u @ v + v @ v)
        for station, mass, _ in rod.masses:
            rate = np.cross(turn, rod.station(rod.stations[station]).place)
            expected += 0.5 * mass * rate @ rate
    assert _turning_energy(model, turn) == pytest.approx(expected, rel=1e-9)


def _turning_energy(model: FrameModel, turn: np.ndarray) -> float:
    """By differences of places in a small turn."""
    small, sides = 1e-6, []
    for sign in (1.0, -1.0):
        state = model.start.copy()
        by = np.zeros(model.mesh.unknowns)
        for f, place in enumerate(state.pose.place):
            k = model.mesh.home[f]
            angle = sign * small * np.linalg.norm(turn)
            axis = turn / np.linalg.norm(turn)
            # Rodrigues' formula, so that the turn is one of finite size.
            turned = place + math.sin(angle) * np.cross(axis, place)
            turned += (1.0 - math.cos(angle)) * np.cross(axis, np.cross(axis, place))
            by[k : k + 3], by[k + 3 : k + 6] = turned - place, sign * small * turn
        call("move", model.mesh, state.pose, by)
        places = np.empty((len(model.mesh.point_mass), 3))
        call("place_points", model.mesh, state.pose, places)
        sides.append(places)
    none = np.zeros((len(model.mesh.length), 6))
    found = np.zeros(2)
    call("energies_of", model.mesh, (sides[0] - sides[1]) / (2.0 * small), none, found)
    return float(found[0])


def test_damping_of_rods_leaves_the_boom_undamped() -> None:
    """The boom is a body of its own, as in the full model: ``rods.damping`` is of rods."""
    boom = {"boom.kind": "flexible", "boom.elements": 3, "rods.damping": 0.01}
    model = FrameModel(load_scene("ring18").with_values({"structure.sections": 3, **boom}))
    assert list(model.mesh.tau[-3:]) == [0.0] * 3
    assert set(model.mesh.tau[:-3]) == {0.01}


def test_a_free_ring_keeps_its_momenta() -> None:
    """It opens under forces that sum to zero, unlike from section to section, and meets its stops.

    Inner forces and moments balance exactly, and inertia is that of points: there is no error of
    steps, only Newton's, 1e-7 of the drive in every step (3e-11 has been found at any tolerance).
    """
    linear, angular = _momenta({"solver.tolerance": 1e-3})
    assert linear < 1e-9
    assert angular < 1e-9


def _momenta(values: dict[str, Any]) -> tuple[float, float]:
    """Largest momentum and angular momentum over those of the points' absolute values."""
    scene = load_scene("ring18").with_values(
        {
            "structure.sections": 5,
            "structure.aspect_ratio": 1.0,
            "boom": "none",
            "net": "none",
            "solver.newton_tolerance": 1e-7,
            "joints.vjoint.viscous": [1e-4, 3e-4, 1e-4, 2e-4, 1e-4],
        }
        | values
    )
    model, found = FrameModel(scene), []
    run = Integration(model, watch=lambda _: found.append(momenta(run)))

    def momenta(run: Integration) -> tuple[np.ndarray, np.ndarray, float, float]:
        state, mesh = run.state, model.mesh
        place, rate = state.place.points, state.rate.points
        carried = mesh.point_mass[:, None] * rate
        one, other = mesh.mass.T
        first, second = mesh.point.T
        np.add.at(carried, first, one[:, None] * rate[first] + other[:, None] * rate[second])
        np.add.at(carried, second, one[:, None] * rate[second] + other[:, None] * rate[first])
        turning = np.cross(place, carried)
        sizes = np.linalg.norm(carried, axis=1).sum(), np.linalg.norm(turning, axis=1).sum()
        return carried.sum(axis=0), turning.sum(axis=0), *sizes

    run.run()
    linear, angular, moved, turned = (np.array(each) for each in zip(*found, strict=True))
    return (
        float(np.linalg.norm(linear, axis=1).max() / moved.max()),
        float(np.linalg.norm(angular, axis=1).max() / turned.max()),
    )
