"""Weight in both engines and in the one-coordinate equation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from rigid_motion import RigidRing
from scipy.interpolate import CubicSpline

from ringsim.exudyn.build import build
from ringsim.exudyn.integrate import Integration as ByExudyn
from ringsim.exudyn.integrate import solve as by_exudyn
from ringsim.frame.integrate import Integration as ByFrames
from ringsim.frame.integrate import solve as by_frames
from ringsim.frame.model import FrameModel
from ringsim.layout.layout import layout_of
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import Scene, load_scene
from test_base_reaction import Course, about_base, impulses, ring

ASLANT = [0.3, 0.2, -1.0]


def heavy(*vector: float, **values: Any) -> Scene:
    """A ring of four held at its boom, without loads."""
    plain = {"boom__base": "fixed", "loads": "none", "gravity__vector": list(vector)}
    return ring(**(plain | values))


def test_work_is_m_g_z() -> None:
    """Of every body and rod by hand, from the held corner on."""
    scene = heavy(*ASLANT)
    ideal, values = OneCoordinate(scene), []
    for q in (0.4, 1.0):
        layout = layout_of(scene, q)
        held = layout.bodies[0].pose.place
        moment = sum(b.mass * (b.pose.at(b.centre)[0] - held) for b in layout.bodies)
        for rod in layout.rods:
            moment = moment + rod.mass * (rod.station(0.5).place - held)
            for station, mass, _ in rod.masses:
                moment = moment + mass * (rod.station(rod.stations[station]).place - held)
        values.append(float(moment @ np.array(ASLANT)))
    assert ideal.work(0.4) - ideal.work(1.0) == pytest.approx(values[0] - values[1], rel=1e-12)
    slope = (ideal.work(0.7 + 1e-5) - ideal.work(0.7 - 1e-5)) / 2e-5
    assert ideal.work_rate(0.7) == pytest.approx(slope, rel=1e-8)


def test_a_ring_that_opens_by_its_weight_is_on_time() -> None:
    """Hung by its lower side up, gravity opens it.  Rods a hundred times as stiff, for the reason
    that tests/frame/test_frame_quadrature.py tells.
    """
    scene = heavy(
        0.0, 0.0, 0.3, structure__sections=4, rods__damping=0.0, rods__young_modulus=1.2e13,
        solver__step_control="motion", solver__step=0.1, solver__tolerance=2e-6,
        solver__newton_tolerance=1e-7, solver__settling_time=0.0, solver__end_time=20.0,
        record__interval=0.01, record__reactions=False,
    )  # fmt: skip
    outcome = by_frames(scene)
    mean = outcome.values["opening_angle"].mean(axis=(0, 1))
    there = np.isfinite(mean)
    course = CubicSpline(outcome.coordinates["time"][there], mean[there])
    found = course.solve(170.0, extrapolate=False)[0]
    end = 0.5 * (math.pi - math.radians(170.0))
    expected = opening_time(OneCoordinate(scene), scene.structure.coordinate, end).time
    assert found == pytest.approx(expected, rel=5e-5)


def test_the_base_carries_the_weight() -> None:
    """Reaction and weight together give the ring its momentum, M g and r x M g by hand."""
    course = Course(heavy(*ASLANT, solver__step=0.0025, solver__end_time=0.4))
    whole, pushed = np.array(course.whole), impulses(course)
    masses, start = course.model.masses, course.times[0]
    gravity = course.model.gravity
    base = course.model.layout.bodies[0].pose.place
    weight = masses.sum() * gravity * (course.times[1:, None] - start)
    states = [course.model.start, *course.states]
    arms = np.array([masses @ (state.place.points - base) for state in states])
    torques = np.cross(arms, gravity)
    steps = np.diff(course.times)[:, None]
    turned = np.cumsum(0.5 * steps * (torques[1:] + torques[:-1]), axis=0)
    assert masses.sum() == pytest.approx(sum(course.model.layout.masses().values()), rel=1e-5)
    assert np.abs(pushed[:, 0] + weight - whole[:, 0]).max() < 1e-4 * np.abs(weight).max()
    left = pushed[:, 1] + turned - about_base(course, whole)
    assert np.abs(left).max() < 1e-4 * np.abs(turned).max()


def test_engines_and_rigid_rods_agree() -> None:
    """With equal steps and rods; rigid ones lack their elasticity."""
    scene = heavy(*ASLANT, solver__newton_tolerance=1e-7, solver__end_time=0.5)
    frame = by_frames(scene)
    here, there = frame.values, by_exudyn(scene).values
    for name in ("opening_angle", "work", "base_force", "base_torque"):
        assert np.nanmax(np.abs(here[name] - there[name])) < 1e-3 * np.nanmax(np.abs(there[name]))
    assert float(here["energy_error"]) < 1e-3
    assert float(there["energy_error"]) < 1e-3
    mean = here["opening_angle"].mean(axis=(0, 1))
    rigid = RigidRing(scene).course(frame.coordinates["time"])
    assert np.nanmax(np.abs(mean - rigid.angle)) < 0.05


def test_a_hanging_boom_stretches() -> None:
    """Its lower end by rho g L^2 / 2 E, in both engines; 20 steps damp how it bounces.
    It bends a little, too, where the ring holds it, and shortens by 0.4 % of that; exudyn's
    clamp holds a tenth of the first element, too."""
    boom = {"kind": "flexible", "young_modulus": 1e10, "elements": 48, "base": "fixed"}
    scene = heavy(0.0, 0.0, -1.0, boom=boom, solver__end_time=0.2, solver__spectral_radius=0.2)
    expected = 1800.0 * 0.9**2 / 2e10
    model = FrameModel(scene)
    run = ByFrames(model)
    run.run()
    top, low = model.skeleton.beam[0].frame, model.skeleton.beam[-1].frame
    places = run.state.pose.place
    assert places[top, 2] - places[low, 2] - 0.9 == pytest.approx(expected, rel=1.5e-2)
    built = build(scene)
    ByExudyn(built).run()
    assembly = built.model.assembly
    slopes = [node for node in assembly.starts if len(assembly.coordinates_of(node)) == 6]
    moved = assembly.system.systemData.GetODE2Coordinates()[assembly.coordinates_of(slopes[-1])[2]]
    assert -moved == pytest.approx(expected, rel=1.5e-2)


def test_the_hub_of_a_net_weighs() -> None:
    """A heavy one on taut strings, in both engines."""
    net = {"stiffness": 5.0, "neutral_length": 0.1, "two_sided": True, "hub_mass": 0.1}
    scene = heavy(*ASLANT, net=net, solver__newton_tolerance=1e-7, solver__end_time=0.3)
    here, there = by_frames(scene).values, by_exudyn(scene).values
    for name in ("opening_angle", "work"):
        assert np.nanmax(np.abs(here[name] - there[name])) < 1e-3 * np.nanmax(np.abs(there[name]))


def test_nothing_changes_without_gravity() -> None:
    """A field of a billionth gives the same run to as much."""
    scene = load_scene("ring18").with_values(
        {"structure.sections": 3, "boom.base": "fixed", "solver.end_time": 0.5,
         "solver.step_control": "constant", "solver.step": 0.05}
    )  # fmt: skip
    plain = by_frames(scene).values["opening_angle"]
    light = by_frames(scene.with_values({"gravity.vector": [0.0, 0.0, -1e-9]}))
    assert np.nanmax(np.abs(plain - light.values["opening_angle"])) < 1e-6
