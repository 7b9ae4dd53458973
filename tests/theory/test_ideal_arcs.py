"""Open arcs, whose end assemblies swing: against other Lagrangians and the full model."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ringsim.layout.layout import Layout
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run, run_ideal
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.variables import Status

HEAVY = {"structure__hinge_offset": 0.05, "structure__corner_mass": 0.1}
"""The end assemblies are pendulums of 0.1 kg, 5 cm long: without their swing 24 % are missing."""


def arc(sections: int = 1, **values: Any) -> Scene:
    """Neighbouring sections that forces open."""
    plain = {
        "structure.sections": sections,
        "structure.closed": False,
        "structure.aspect_ratio": 1.0,
        "net": "none",
        "boom": "none",
        "loads.force": 0.02,
        "record.stress": False,
        "rods.damping": 0.0,
        "solver.newton_tolerance": 1e-5,
    }
    chosen = {name.replace("__", "."): value for name, value in values.items()}
    return load_scene("ring18").with_values(plain | chosen)


def one_section_time(scene: Scene) -> float:
    """Opening time by another formulation: one quarter of a section in its plane, (phi, psi).

    T = sum m |dr/dq q'|^2 / 2 from complex-step slopes, Lagrange's equations by differences of M.
    """
    shape, rods = scene.structure, scene.rods
    bar, reach, offset = shape.half_bar, shape.half_diagonal, shape.hinge_offset
    rod = rods.density * rods.bar.area * bar
    spin = rods.density * rods.bar.second_moment * bar
    slant = rods.density * rods.diagonal.area * reach
    slant_spin = rods.density * rods.diagonal.second_moment * reach
    own = shape.corner_mass * shape.hinge_size**2 / 6.0

    def points(q):
        phi, psi = q
        along, up = bar * np.cos(phi), np.sqrt(reach**2 - (bar * np.cos(phi)) ** 2)
        joint = np.array([0.0 * phi, up - bar * np.sin(phi)])
        pin = np.array([along, up])
        centre = pin + offset * np.array([np.cos(psi), np.sin(psi)])
        return np.array([centre, pin, joint, 0.5 * (pin + joint)]), np.arctan(up / along)

    # A quarter: half of one diagonal, one bar half, half a V-joint, one end assembly.
    ends = rod / 6.0
    masses = np.array(
        [shape.corner_mass, slant / 3.0 + ends, 0.5 * shape.vjoint_mass + ends, 4.0 * ends]
    )

    def matrix(q):
        slopes, turns = zip(
            *((p.imag / 1e-30, t.imag / 1e-30) for p, t in map(points, q + 1e-30j * np.eye(2))),
            strict=True,
        )
        s = np.array(slopes)
        found = np.einsum("p,ipx,jpx->ij", masses, s, s)
        found += slant_spin * np.outer(turns, turns)
        return found + np.diag([spin, own])

    def rates(_, y):
        q, v, step = y[:2], y[2:], 1e-5
        slopes = [(matrix(q + e) - matrix(q - e)) / (2.0 * step) for e in step * np.eye(2)]
        force = 0.5 * np.array([v @ s @ v for s in slopes])
        force[0] += (
            0.5 * float(scene.loads.force) * points(q + 1e-30j * np.eye(2)[0])[0][2, 1].imag / 1e-30
        )
        force -= (slopes[0] * v[0] + slopes[1] * v[1]) @ v
        return np.concatenate([v, np.linalg.solve(matrix(q), force)])

    def deployed(_, y):
        return y[0]

    deployed.terminal = True
    start = [shape.coordinate, 0.0, 0.0, 0.0]
    found = solve_ivp(
        rates, (0.0, 20.0), start, method="DOP853", rtol=1e-10, atol=1e-12, events=deployed
    )
    return float(found.t[-1])


@pytest.mark.parametrize("values", [{}, HEAVY], ids=["default", "heavy"])
def test_one_section_opens_as_its_own_lagrangian_says(values):
    scene = arc(**values)
    found = run_ideal(scene)
    assert found.status == Status.OK
    # Differences of M are good to 1e-10; the fidelity's own local errors are 3e-7.
    assert float(found.values["deployment_time"]) == pytest.approx(
        one_section_time(scene), rel=1e-6
    )
    assert found.values["energy_error"] < 1e-7


@pytest.mark.parametrize(
    ("sections", "values"),
    [
        (1, {}),
        (1, HEAVY),
        (1, {"boom": {"kind": "rigid"}}),
        (2, {"boom": {"kind": "rigid", "base": "fixed"}}),
    ],
    ids=["default", "heavy", "free boom", "two on a fixed boom"],
)
def test_the_full_model_with_stiff_rods_opens_in_the_same_time(sections, values):
    scene = arc(sections, solver__tolerance=1e-5, rods__young_modulus=1.2e13, **values)
    full, ideal = run(scene), run_ideal(scene)
    assert full.status == ideal.status == Status.OK
    # The full model's steps follow the mean angle, not the swings: 3e-4 at this tolerance, and
    # 3e-5 with steps of 1 ms.
    mean = float(np.mean(full.values["lock_time"]))
    assert float(ideal.values["deployment_time"]) == pytest.approx(mean, rel=5e-4)


PRISMATIC = {"kind": "rigid", "joint": "prismatic"}


@pytest.mark.parametrize(
    "boom", ["none", {"kind": "rigid"}, {"kind": "rigid", "base": "fixed"}, PRISMATIC]
)
def test_nothing_is_lost_or_won_without_forces(boom):
    """Accelerations of the equations keep the kinetic energy, whatever the motion."""
    mechanism = Mechanism(arc(2, boom=boom, **HEAVY))
    random = np.random.default_rng(0)
    q, v = random.normal(size=(2, mechanism.freedom))
    q[0] = 1.0

    def kinetic(q, v):
        now = mechanism.configuration(q, v)
        rates = np.concatenate([mechanism.rigid_rates(now), now.rate])
        return 0.5 * float(rates @ now.matrix @ rates)

    now = mechanism.configuration(q, v)
    spin = mechanism.rigid_rates(now)[3:]
    pull, _ = mechanism.accelerations(now, spin, np.zeros(3), np.zeros(len(now.place)))
    step = 1e-5
    gained = kinetic(q + step * v, v + step * pull) - kinetic(q - step * v, v - step * pull)
    # Central differences: third derivatives of order 1 times the step's square.
    assert abs(gained / (2.0 * step)) < 1e-7 * kinetic(q, v)


def end_centres(layout: Layout) -> tuple[Any, Any]:
    """Centres of the left and right assemblies, upper and lower, and their derivatives."""
    poses = [layout.bodies[plane[end]].pose for end in (0, -1) for plane in layout.corners]
    return np.array([p.place for p in poses]), np.array([p.rate for p in poses])


@pytest.mark.parametrize("boom", ["none", {"kind": "rigid"}, PRISMATIC])
def test_coordinates_of_the_ends_fit_their_rates(boom):
    scene = arc(1, boom=boom, **HEAVY)
    mechanism = Mechanism(scene)
    random = np.random.default_rng(1)
    q, v = random.normal(size=(2, mechanism.freedom))
    q[0] = 1.0
    step = 1e-6
    here, before, after = (mechanism.configuration(q + e * v, v) for e in (0.0, -step, step))
    near = {"rtol": 1e-7, "atol": 1e-8}  # differences: round-off over the step
    np.testing.assert_allclose((after.place - before.place) / (2 * step), here.rate, **near)
    np.testing.assert_allclose((after.rate - before.rate) / (2 * step), here.bias, **near)
    if boom != "none":
        # The lower assembly's centre lies on the boom: on the upper one's own vertical.
        centres = mechanism.points.swung(end_centres, mechanism.points.swinging)
        upper, lower = (centres @ here.values)[:2]
        angle, along = here.place[1], scene.structure.geometry().directions[0]
        across = math.cos(angle) * along + math.sin(angle) * np.array([0.0, 0.0, 1.0])
        assert abs(across @ (lower - upper)) < 1e-15
