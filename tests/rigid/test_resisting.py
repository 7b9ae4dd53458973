"""What resists a ring of rigid rods, against other formulations."""

import math

import numpy as np
import pytest

from ringsim.layout.draft import FreeHub
from ringsim.layout.layout import layout_of
from ringsim.rigid.mechanism import Mechanism
from ringsim.rigid.resistances import JointFrictionResistance, Opening
from ringsim.units import at_section
from small_rings import pulled

pytestmark = pytest.mark.quick


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
        float(at_section(getattr(scene.joints, family), section).resistance(abs(speed)))
        * abs(speed)
        for section in range(6)
        for speed in speeds
    )
    mechanism = Mechanism(scene)
    opening = Opening(math.pi - 2.0 * phi, -2.0 * rate, 0.0, mechanism.at(phi), mechanism.switches)
    found = JointFrictionResistance(scene, mechanism).force(opening)
    assert found * opening.rate == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("stiffness", [0.5, [0.5, 0.1, 0.5, 0.9, 0.2]])
def test_hub_of_an_odd_net_lies_where_its_strings_balance(stiffness):
    net = {"stiffness": stiffness, "neutral_length": 0.2}
    scene = pulled(sections=5, structure__aspect_ratio=0.8, net=net)
    geometry, hub_net = scene.structure.geometry(), FreeHub(layout_of(scene).pair_laws[0])
    corners = geometry.fold(0.9).corners[0]
    hub = hub_net.place(corners)
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
        energy.append(hub_net.force(corners, np.zeros((5, 3))).energy)
    mechanism = Mechanism(scene)
    # Central differences: second order of the step.
    assert mechanism.pairs(mechanism.at(0.9)).force == pytest.approx(
        -(energy[1] - energy[0]) / (2.0 * step), rel=1e-8
    )
