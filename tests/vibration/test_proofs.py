"""Natural frequencies against closed forms, plain finite elements, exudyn and energies."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
import pytest

from beams import squares
from ringsim.core.library import call
from ringsim.exudyn.build import build
from ringsim.frame.modes import ENERGY_PARTS, Standing
from ringsim.layout.layout import layout_of
from ringsim.rigid.statics import OneCoordinate
from ringsim.scene import Scene, load_scene

NO_DRIVE = {"net": "none", "loads": "none"}


def ring(sections: int, **values: Any) -> Scene:
    """A small ring without net and loads."""
    chosen = {name.replace("__", "."): value for name, value in values.items()}
    return load_scene("ring18").with_values({"structure.sections": sections} | NO_DRIVE | chosen)


def hertz(squared: Any) -> Any:
    """Frequencies of w^2; negative ones where it is."""
    return np.sign(squared) * np.sqrt(np.abs(squared)) / (2.0 * np.pi)


def spring(angle: float, stiffness: float) -> dict[str, Any]:
    """V-joints with a stiffness (N m/rad), at rest at an angle (deg)."""
    torques = [stiffness * np.radians(angle - each) for each in (0.0, angle, 180.0)]
    return {"hinge_spring": {"kind": "table", "angles": [0.0, angle, 180.0], "torques": torques}}


# Closed forms.


BOOM = {
    "boom.kind": "flexible", "boom.base": "fixed", "boom.length": 6.0,
    # A ring that weighs and holds next to nothing: the boom is alone.
    "rods.density": 1e-3, "rods.young_modulus": 1e5, "structure.corner_mass": 1e-7,
    "structure.vjoint_mass": 0.0,
}  # fmt: skip


def of_boom(elements: int) -> Any:
    """The three lowest frequencies of a boom by itself, each in both directions, Hz."""
    scene = ring(4, **{k.replace(".", "__"): v for k, v in BOOM.items()}, boom__elements=elements)
    found = Standing(scene, 90.0, latched=True).modes(30)
    booms = found.shares[:, ENERGY_PARTS.index("boom")] > 0.99
    return hertz(found.squares[booms][:6]).reshape(3, 2)


def test_a_boom_alone_is_a_cantilever_in_closed_form_with_order_two() -> None:
    """(k L)^2 sqrt(E I / rho A L^4), k L = 1.8751, 4.6941, 7.8548; the turning of its sections,
    which bears on the top alone, counts by r^2 / L^2 = 1e-5.
    """
    boom = ring(4, **{k.replace(".", "__"): v for k, v in BOOM.items()}).boom
    assert boom is not None
    young, tube = 120e9, boom.tube
    roots = np.array([1.875104, 4.694091, 7.854757])
    wave = young * tube.second_moment / (boom.density * tube.area * boom.length**4)
    exact = roots**2 * np.sqrt(wave) / (2.0 * np.pi)
    sixteen, double = (of_boom(n) / exact[:, None] - 1.0 for n in (16, 32))
    assert np.all(np.abs(double) <= [[1e-4], [1.2e-3], [4e-3]])
    assert np.all(np.abs(np.log2(sixteen / double) - 2.0) < 0.05)


@pytest.mark.parametrize("angle", [40.0, 100.0, 150.0])
def test_a_ring_on_soft_springs_is_an_oscillator_of_one_coordinate(angle: float) -> None:
    """phi'' I(phi) = -(2 N) 4 k phi, with the inertia I of rigid rods, which they are to 1e-5 of
    the frequency where springs are a millionth as stiff as they.
    """
    k, sections = 1e-4, 6
    scene = ring(sections, stop="none").with_values(spring(angle, k))
    start = scene.with_values({"structure.opening_angle": angle})
    inertia = OneCoordinate(start).motion(start.structure.coordinate).inertia
    found = Standing(scene, angle, latched=False).modes(2)
    assert (found.rigid, found.mechanism) == (6, 0)
    assert found.squares[0] == pytest.approx(8.0 * sections * k / inertia, rel=1e-4)


# Finite elements of another kind.


@pytest.mark.parametrize(
    ("angle", "latched"),
    [(60.0, False), pytest.param(60.0, True, marks=pytest.mark.slow), (180.0, True)],
)
def test_a_free_ring_of_rods_agrees_with_plain_finite_elements(angle: float, latched: bool) -> None:
    """The limit of order two of 8 and 16 elements a half is theirs to 5e-5, most of it theirs with
    four, where neither has the inertia of rods about their own axes.  That counts by 6e-4 where
    bars twist about V-joints, and the frames' 16 elements by 1.3e-3.
    """
    scene, free = ring(3, boom="none"), 6 if latched else 7
    stop = scene.stop
    assert stop is not None
    layout = layout_of(scene, 0.5 * np.radians(180.0 - angle))
    found = []
    for elements in (8, 16):
        finer = scene.with_values({"rods.elements": elements})
        modes = Standing(finer, angle, latched=latched).modes(8)
        assert (modes.rigid, modes.mechanism) == (6, free - 6)
        found.append(hertz(modes.squares))
    limit = found[1] + (found[1] - found[0]) / 3.0
    for twisting, bound in ((1e-3, 5e-5), (1.0, 1e-3)):
        held = stop.stiffness if latched else 0.0
        truth = hertz(squares(layout, scene.rods, 4, held, twisting))
        assert np.all(np.abs(truth[:free]) < 0.05)
        assert limit == pytest.approx(truth[free : free + 8], rel=bound)
    assert found[1] == pytest.approx(limit, rel=2e-3)


# The other engine.


@pytest.mark.parametrize("angle", [60.0, 120.0, 179.0])
@pytest.mark.parametrize("stiffness", [0.0, 200.0])
def test_exudyns_own_eigenvalues_are_the_same(angle: float, stiffness: float) -> None:
    """Its mass and stiffness matrices in the null space of its joints: to 1e-4, of which 5e-5 is
    the inertia of rods about their own axes, which frames leave out.  A stiffness stands for
    latches: exudyn's matrices are those of a model that is at rest as it is built.
    """
    scene = ring(6, boom__base="fixed", stop="none", structure__opening_angle=angle)
    scene = scene.with_values(spring(angle, stiffness) if stiffness else {})
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    system = build(scene).model.assembly.system
    values, _ = system.ComputeODE2Eigenvalues(settings, useAbsoluteValues=False)
    found = Standing(scene, angle, latched=False).modes(10)
    free = found.rigid + found.mechanism
    assert free == (0 if stiffness else 1)
    there = hertz(np.sort(values))
    assert np.all(np.abs(there[:free]) < 1e-2)
    assert hertz(found.squares) == pytest.approx(there[free : free + 10], rel=1e-4)


# Energies.


def rayleigh(standing: Standing, vector: Any) -> float:
    """x . dg / x . M x of a shape, by differences of the forces g, rad^2/s^2."""
    by, start = 1e-6 / np.abs(standing.moving @ vector).max(), standing.state.copy()
    forces = []
    for way in (by, -by):
        standing.state.recall(start.memory())
        mesh = standing.model.mesh
        call("move", mesh, standing.state.pose, way * vector[: mesh.unknowns])
        standing.state.hub += way * vector[-3:] if standing.model.with_hub else 0.0
        forces.append(standing.unbalance().copy())
    standing.state.recall(start.memory())
    push = vector @ (forces[0] - forces[1]) / (2.0 * by)
    return float(push / (vector @ (standing.mass @ vector)))


@pytest.mark.parametrize(
    ("name", "values", "angle", "latched", "tension", "bound"),
    [
        ("ring18-ground", {}, 90.0, False, 0.0, 1e-5),
        ("ring18-cable", {}, 60.0, False, 5.0, 1e-5),
        ("ring18-motor", {}, 180.0, True, 5.0, 1e-5),
        ("ring18-ground", {}, 180.0, True, 3.0, 1e-5),
        ("ring18", {"net.stiffness": 1.0, "boom.base": "fixed"}, 150.0, True, 0.0, 1e-5),
        ("ring18", {"boom.kind": "flexible", "boom.base": "fixed", "net": "none",
                    "gravity.vector": [1.0, 2.0, -9.81]}, 180.0, True, 0.0, 3e-4),
    ],
)  # fmt: skip
def test_shapes_have_the_frequency_of_their_forces(
    name: str, values: dict[str, Any], angle: float, latched: bool, tension: float, bound: float
) -> None:
    """Rayleigh's quotient from the forces themselves, in states that weight, net and ropes strain:
    the tangent is theirs to 1e-5; along a bent boom it leaves out how the slide's force turns.
    """
    scene = load_scene(name).with_values({"structure.sections": 6, "loads": "none"} | values)
    standing = Standing(scene, angle, latched=latched, tension=tension)
    found, vectors = standing.lowest(16, 16)
    solid = np.flatnonzero(hertz(np.abs(found)) > 0.2)[:6]
    assert len(solid) == 6
    quotients = [rayleigh(standing, vectors[:, k]) for k in solid]
    assert quotients == pytest.approx(found[solid], rel=bound, abs=1e-4)
    gram = vectors.T @ (standing.mass @ vectors)
    assert np.abs(gram - np.eye(16)).max() < 1e-6


def test_energy_of_a_shape_is_that_of_its_strains() -> None:
    """Without net, ropes and weight nothing else stores any: shares of the parts sum to one."""
    found = Standing(ring(6), 180.0, latched=True).modes(8)
    assert np.abs(found.shares[:, ENERGY_PARTS.index("net, ropes and weight")]).max() < 1e-5
    assert found.shares.sum(axis=1) == pytest.approx(np.ones(8), abs=1e-12)
    assert found.shares[:, ENERGY_PARTS.index("V-joints")].max() > 0.01


def test_effective_masses_of_a_shaken_ring_sum_to_its_moving_mass() -> None:
    """Over all shapes, sum (x_k . M e)^2 = e . M e; the first 20 have most of it."""
    standing = Standing(ring(4, boom__base="fixed"), 180.0, latched=True)
    found = standing.modes(20)
    along = standing.rigid_motions()[:, :3]
    whole = np.diag(along.T @ (standing.mass @ along))
    summed = found.effective.sum(axis=0)
    assert np.all(summed <= whole * (1.0 + 1e-9))
    assert np.all(summed[:2] > 0.6 * whole[:2])
