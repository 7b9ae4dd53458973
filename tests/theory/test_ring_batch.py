"""Inertia, loads, net, joints and stops of the batch against their other homes."""

import math

import numpy as np
import pytest

from ideal_cases import pulled
from ringsim.engine.joints import friction_torque, stop_torque
from ringsim.engine.net import net_forces
from ringsim.theory.ideal_batch import Batch
from ringsim.theory.ideal_ring import IdealRing
from ringsim.theory.ring_batch import inertia_series

ANGLES = np.linspace(-0.02, 1.58, 9)
FREE = {"stop": "none", "net": "none", "loads.force": 0.0}


def ring_of(**values):
    scene = pulled(**values)
    return scene, Batch([scene]).equation().ring


@pytest.mark.parametrize("base", ["free", "fixed"])
@pytest.mark.parametrize("sections", [5, 18])
def test_series_is_the_inertia(sections, base):
    scene, ring = ring_of(sections=sections, boom__base=base)
    ideal = IdealRing.of(scene)
    found, slope = ring.inertias(ANGLES[None])
    exact = [ideal.motion(phi).inertia for phi in ANGLES]
    np.testing.assert_allclose(found[0], exact, rtol=1e-12)
    step = 1e-5
    for phi, value in zip(ANGLES, slope[0], strict=True):
        change = ideal.motion(phi + step).inertia - ideal.motion(phi - step).inertia
        # Second differences of order 1 times step^2, and round-off over step.
        assert value == pytest.approx(change / (2.0 * step), abs=1e-8)


def test_series_is_as_long_as_the_geometry_asks():
    plain = inertia_series(IdealRing.of(pulled(sections=6)))
    slender = pulled(sections=6, structure__half_bar=0.42)
    assert len(inertia_series(IdealRing.of(slender))) > len(plain)


def test_inertia_is_not_invented_outside_its_range():
    _, ring = ring_of(sections=6)
    assert np.isnan(ring.inertias(np.array([[2.3, -0.6]]))[0]).all()


@pytest.mark.parametrize("two_sided", [False, True])
def test_loads_and_net_are_the_work_of_the_ideal_ring(two_sided):
    scene, ring = ring_of(
        sections=6, net__two_sided=two_sided, net__neutral_length=0.3, stop="none"
    )
    ideal = IdealRing.of(scene)
    at_rest = np.zeros((1, len(ANGLES)))
    found = ring.torque(ANGLES[None], at_rest, False)[0]
    exact = [ideal.work_rate(phi) for phi in ANGLES]
    np.testing.assert_allclose(found, exact, rtol=1e-12, atol=1e-15)
    kinetic, stored, work = (e[0] for e in ring.energies(ANGLES[None], at_rest, False))
    assert not kinetic.any()
    potential = work - stored
    exact = np.array([ideal.work(phi) for phi in ANGLES])
    np.testing.assert_allclose(potential - potential[0], exact - exact[0], atol=1e-14)


def test_damped_net_has_the_engine_s_law():
    net = {"stiffness": 0.5, "damping": 0.2, "neutral_length": 0.3}
    scene, ring = ring_of(sections=6, net=net, stop="none", loads__force=0.0)
    corners = len(scene.structure.geometry().plan)
    for phi, rate in ((0.2, -0.5), (0.2, 3.0), (1.3, 1.0)):
        fold, by_phi = (f(phi).corners[0] for f in (
            scene.structure.geometry().fold, scene.structure.geometry().fold_rate))  # fmt: skip
        arms, moving = fold - fold.mean(axis=0), by_phi - by_phi.mean(axis=0)
        lengths = np.linalg.norm(arms, axis=1)
        slope = np.sum(arms * moving, axis=1) / lengths
        parts = net_forces(lengths - 0.3, slope * rate, np.full(corners, 0.5), 0.2, two_sided=False)
        exact = -float(np.sum(sum(parts) * slope))
        assert ring.torque(np.array([[phi]]), np.array([[rate]]), False)[0, 0] == pytest.approx(
            exact, rel=1e-12, abs=1e-15
        )


@pytest.mark.parametrize("family", ["pivot", "hinge", "vjoint"])
def test_joint_friction_takes_the_power_of_all_its_joints(family):
    law = {"viscous": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], "coulomb": 0.02, "rate": 0.05}
    values = FREE | {f"joints.{family}": law}
    scene, ring = ring_of(sections=6, **{k.replace(".", "__"): v for k, v in values.items()})
    phi, rate = 0.7, -0.4
    structure = scene.structure
    width = 2.0 * structure.half_bar * math.cos(phi)
    # Angle of a diagonal from the horizontal: cos = width / (2 half_diagonal).
    diagonal = (
        2.0
        * structure.half_bar
        * math.sin(phi)
        / math.sqrt(4.0 * structure.half_diagonal**2 - width**2)
    )
    speeds = {
        "pivot": [2.0 * diagonal * rate],
        "hinge": [rate] * 4 + [diagonal * rate] * 4,
        "vjoint": [2.0 * rate] * 2,
    }[family]
    exact = sum(
        float(friction_torque(getattr(scene.joints, family), section, 6, speed) * speed)
        for section in range(6)
        for speed in speeds
    )
    found = ring.torque(np.array([[phi]]), np.array([[rate]]), False)[0, 0]
    assert -found * rate == pytest.approx(exact, rel=1e-12)
    assert ring.loss(np.array([[phi]]), np.array([[rate]]), False)[0, 0] == pytest.approx(exact)


@pytest.mark.parametrize("latched", [False, True])
def test_stops_are_the_engine_s(latched):
    stop = {"stiffness": 150.0, "damping": 0.3, "stowed_angle": 10.0, "latch": True}
    scene, ring = ring_of(sections=6, stop=stop, net="none", loads__force=0.0)
    for phi in (-0.01, -2e-4, 0.3, 1.484, 1.55):
        for rate in (-2.0, 0.0, 2.0):
            folded, turning = np.array(2.0 * phi), np.array(2.0 * rate)
            opening = stop_torque(scene.stop, folded, turning, np.array(latched))
            # 12 joints; opening them is a negative change of phi, twice as fast.
            exact = -2.0 * 12.0 * float(opening)
            found = ring.torque(np.array([[phi]]), np.array([[rate]]), latched)[0, 0]
            assert found == pytest.approx(exact, rel=1e-12, abs=1e-12)
