"""What acts on the ideal ring and what resists it, against other formulations and the engine."""

import math

import numpy as np
import pytest
from fold_rates import fold_rate

from ideal_cases import pulled, six
from ringsim.cable.chain import Chain
from ringsim.layout.free_hub import FreeHub
from ringsim.parts.persection import at_section
from ringsim.theory.ideal_forces import Forces, IdealCables
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.ideal_points import UP

ARC = {"structure__closed": False, "boom": "none", "net": "none", "structure__hinge_offset": 0.05}


def acting(scene, free, rates, *, latched=False):
    mechanism = Mechanism(scene)
    now = mechanism.configuration(np.array(free), np.array(rates))
    return Forces(scene, mechanism).act(now, UP, latched)


def diagonal_rate(shape, phi: float) -> float:
    """d theta / d phi from cos(theta) = l cos(phi) / d."""
    height = math.sqrt(shape.half_diagonal**2 - (shape.half_bar * math.cos(phi)) ** 2)
    return shape.half_bar * math.sin(phi) / height


@pytest.mark.parametrize("family", ["pivot", "hinge", "vjoint"])
def test_joint_friction_takes_the_power_of_all_its_joints(family):
    law = {"viscous": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], "coulomb": 0.02, "rate": 0.05}
    values = {f"joints__{family}": law, "stop": "none", "net": "none", "loads__force": 0.0}
    scene = pulled(sections=6, **values)
    phi, rate = 0.7, -0.4
    diagonal = diagonal_rate(scene.structure, phi)
    speeds = {
        "pivot": [2.0 * diagonal * rate],
        "hinge": [rate] * 4 + [diagonal * rate] * 4,
        "vjoint": [2.0 * rate] * 2,
    }[family]
    exact = sum(
        float(at_section(getattr(scene.joints, family), section).torque(speed) * speed)
        for section in range(6)
        for speed in speeds
    )
    found = acting(scene, [phi], [rate])
    assert -found.force[0] * rate == pytest.approx(exact, rel=1e-12)
    assert found.loss == pytest.approx(exact, rel=1e-12)


def test_hinges_of_swinging_ends_turn_against_their_assemblies():
    law = {"viscous": [0.1, 0.2, 0.4], "coulomb": 0.02, "rate": 0.05}
    scene = pulled(sections=3, joints={"hinge": law}, loads__force=0.0, **ARC)
    phi, rates = 0.7, np.array([-0.4, 0.3, -0.2, 0.5, 1.1])
    turn = diagonal_rate(scene.structure, phi)
    exact = 0.0
    for section in range(3):
        for k, sense in enumerate((-1.0, 1.0, 1.0, -1.0)):
            # Left upper, left lower, right upper, right lower; inner assemblies keep upright.
            swings = section == 0 if k < 2 else section == 2
            swing = rates[1 + k] if swings else 0.0
            for slope in (1.0, turn):
                speed = sense * slope * rates[0] - swing
                exact += float(at_section(scene.joints.hinge, section).torque(speed)) * speed
    found = acting(scene, [phi, 0.1, 0.2, 0.3, 0.4], rates)
    assert -found.force @ rates == pytest.approx(exact, rel=1e-12)
    assert found.loss == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("latched", [False, True])
def test_stops_of_all_joints_act_on_the_ring(latched):
    stop = {"stiffness": 150.0, "damping": 0.3, "stowed_angle": 10.0, "latch": True}
    scene = pulled(sections=6, stop=stop, net="none", loads__force=0.0)
    for phi in (-0.01, -2e-4, 0.3, 1.484, 1.55):
        for rate in (-2.0, 0.0, 2.0):
            opening = scene.stop.torque(2.0 * phi, 2.0 * rate, latched).total
            # 12 joints; opening them is a negative change of phi, twice as fast.
            found = acting(scene, [phi], [rate], latched=latched)
            assert found.force[0] == pytest.approx(-24.0 * float(opening), rel=1e-12, abs=1e-12)


def test_a_damped_net_acts_by_its_corners():
    net = {"stiffness": 0.5, "damping": 0.2, "neutral_length": 0.3}
    scene = pulled(sections=6, net=net, stop="none", loads__force=0.0)
    geometry = scene.structure.geometry()
    for phi, rate in ((0.2, -0.5), (0.2, 3.0), (1.3, 1.0)):
        fold, by_phi = geometry.fold(phi).corners[0], fold_rate(geometry, phi).corners[0]
        arms, moving = fold - fold.mean(axis=0), by_phi - by_phi.mean(axis=0)
        lengths = np.linalg.norm(arms, axis=1)
        slope = np.sum(arms * moving, axis=1) / lengths
        tension = scene.net.tension(lengths - 0.3, slope * rate)
        found = acting(scene, [phi], [rate])
        exact = -float(np.sum(tension.total * slope))
        assert found.force[0] == pytest.approx(exact, rel=1e-12, abs=1e-15)
        assert found.loss == pytest.approx(rate * float(tension.damping @ slope), rel=1e-12)


@pytest.mark.parametrize("stiffness", [0.5, [0.5, 0.1, 0.5, 0.9, 0.2]])
def test_hub_of_an_odd_net_lies_where_its_strings_balance(stiffness):
    net = {"stiffness": stiffness, "neutral_length": 0.2}
    scene = pulled(sections=5, structure__aspect_ratio=0.8, net=net)
    geometry, hub_net = scene.structure.geometry(), FreeHub(scene.net, 5)
    corners = geometry.fold(0.9).corners[0]
    hub = hub_net.hub(corners)
    arms = corners - hub
    lengths = np.linalg.norm(arms, axis=1)
    pulls = np.broadcast_to(stiffness, 5) * np.maximum(lengths - 0.2, 0.0)
    assert np.linalg.norm(hub - corners.mean(axis=0)) > 5e-4  # not in the middle
    assert np.abs((pulls / lengths) @ arms).max() < 1e-13
    # By virtual work: the energy's slope is the generalised force, though the hub moves along.
    step = 1e-5
    energy = []
    for phi in (0.9 - step, 0.9 + step):
        corners = geometry.fold(phi).corners[0]
        energy.append(hub_net.forces(corners, np.zeros((5, 3, 1)), np.zeros(1)).energy)
    force = acting(scene.with_values({"loads.force": 0.0}), [0.9], [0.0])
    # Central differences: second order of the step.
    assert force.force[0] == pytest.approx(-(energy[1] - energy[0]) / (2.0 * step), rel=1e-8)


@pytest.mark.parametrize("end", ["first", "last", "both"])
def test_cables_are_the_chain_on_the_fold_s_points(end):
    """Points by ``RingGeometry``, power by the chain's own rates."""
    friction = {"kind": "bearing", "coefficient": 0.0012}
    scene = six(cable__end=end, cable__friction=friction, cable__damping_time=0.003)
    mechanism = Mechanism(scene)
    cables = IdealCables(scene, mechanism)
    geometry, cable = scene.structure.geometry(), scene.cables.upper
    for phi, rate, time in ((1.35, -0.3, 0.9), (0.8, -0.4, 8.0), (0.8, 0.4, 8.0)):
        now = mechanism.configuration(np.array([phi]), np.array([rate]))
        found = cables.pull(time, now, np.zeros((2, 0)))
        moved = float(found.chain.tensions @ found.chain.rates)
        # Both planes are alike, so one cable stands for two.
        assert found.force[0] * rate == pytest.approx(-2.0 * moved, rel=1e-12)
        fold, by_phi = geometry.fold(phi), fold_rate(geometry, phi)
        down = np.array([0.0, 0.0, -1.0])
        bar, h = geometry.half_bar, cable.block_offset
        drop = (bar * math.sin(phi) + h) * down
        block = 0.5 * (fold.left[0] + fold.right[0]) + drop
        block_rate = 0.5 * (by_phi.left[0] + by_phi.right[0]) + bar * math.cos(phi) * down
        path = np.stack([fold.left[0], block, fold.right[0]], axis=1).reshape(-1, 3)
        moving = np.stack([by_phi.left[0], block_rate, by_phi.right[0]], axis=1).reshape(-1, 3)
        if end == "last":
            path, moving = path[::-1], moving[::-1]
        away = scene.cables.winch_distance * down
        far = slice(-1, None) if end == "both" else slice(0, 0)
        path = np.concatenate([path[:1] + away, path, path[far] + away])
        moving = rate * np.concatenate([moving[:1], moving, moving[far]])
        chain = Chain([cable], [len(path)])
        state = chain.state(cables.ropes, path, moving, found.chain.wound, found.chain.wound_rate)
        # A rope of 1e5 N over 4 m: 1e-15 m of round-off in its path are 3e-11 N.
        np.testing.assert_allclose(found.chain.tensions, state.tensions, rtol=1e-9, atol=1e-9)
