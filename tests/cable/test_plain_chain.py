"""The compiled chain against the equations in plain numpy, for whole, jammed and cut ropes."""

from __future__ import annotations

import numpy as np
import pytest
from stribeck import StribeckFriction

from cable_cases import RADIUS, Case, cable
from plain_chain import plain_energy, plain_state, plain_tension
from ringsim.cable.friction import BearingFriction, CapstanFriction
from ringsim.core.chain import Chain

pytestmark = pytest.mark.quick

ROUND_OFF = 1e-11
"""Sums of a dozen terms in another order, through exponentials of their logarithms."""
EACH = tuple(np.linspace(2e-4, 2e-3, 6).tolist())
CABLES = (
    cable(friction=BearingFriction(coefficient=EACH), damping_time=0.01, initial_slack=-1e-3),
    cable(end="both", friction=CapstanFriction(coefficient=0.2), slip_speed=5e-3),
    cable(friction=StribeckFriction(coefficient=0.3 * RADIUS, kinetic=0.3, speed=1e-3)),
)
POINTS = (8, 7, 5)


def moving(seed: int, *, jammed: bool, cut: bool) -> Case:
    """Ropes at random places and rates, the second cable perhaps jammed, the first one cut."""
    random = np.random.default_rng(seed)
    count = sum(POINTS)
    points = 0.1 * random.normal(size=(count, 3))
    points[:, 0] += 0.3 * np.arange(count)
    wound = np.array([[0.004, 0.0], [0.002, 0.003], [0.003, 0.0]])
    rates = np.array([[0.02, 0.0], [0.01, -0.004], [0.003, 0.0]])
    case = Case(Chain(CABLES, POINTS), points, 2e-3 * random.normal(size=(count, 3)), wound, rates)
    if jammed:
        before = case.state()
        case.ropes = case.ropes.jam(1, 2, before.stored, before.wound)
    if cut:
        case.ropes = case.ropes.cut(0, 3)
    case.points = case.points + 1e-3 * random.normal(size=(count, 3))
    return case


@pytest.mark.parametrize("cut", [False, True])
@pytest.mark.parametrize("jammed", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_tensions_are_those_of_the_plain_chain(seed: int, jammed: bool, cut: bool) -> None:
    case = moving(seed, jammed=jammed, cut=cut)
    found, truth = case.state(), plain_state(case)
    tensions = np.concatenate([rope.tensions for rope in truth])
    assert tensions.max() > 1.0
    slips = case.ropes.slips > 0.0
    exponents = np.concatenate([rope.exponents for rope in truth])
    assert np.ptp(np.abs(exponents)) > 0.1  # some turn round, some slip
    largest = ROUND_OFF * tensions.max()
    assert found.tensions == pytest.approx(tensions, rel=ROUND_OFF, abs=largest)
    assert found.mean_tensions == pytest.approx([rope.mean for rope in truth], rel=1e-9)
    assert found.exponents[slips] == pytest.approx(exponents, rel=1e-9, abs=1e-12)
    speeds = np.concatenate([rope.speeds for rope in truth])
    assert found.speeds[slips] == pytest.approx(speeds, rel=1e-9, abs=1e-14)
    assert found.viscous_forces == pytest.approx([rope.viscous for rope in truth], rel=1e-7)
    assert found.energy_density == pytest.approx([rope.density for rope in truth], rel=1e-9)
    losses = np.concatenate([rope.losses for rope in truth])
    assert found.friction_forces[slips] == pytest.approx(losses, rel=1e-9, abs=largest)
    assert not found.friction_forces[~slips].any()
    beyond = np.concatenate([rope.beyond for rope in truth])
    assert found.held_beyond[slips] == pytest.approx(beyond, rel=ROUND_OFF)


@pytest.mark.parametrize("widths", [-250.0, -30.0, -1.0, 0.0, 0.3, 1.0, 39.9, 40.1, 1e9])
def test_energy_of_a_slack_rope_is_the_dilogarithm(widths: float) -> None:
    """At rest, by an elastic force of so many widths, in one span."""
    width, stiffness = 0.05, 1e6
    force = widths * width
    own = cable(axial_stiffness=stiffness, slack_width=width)
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    case = Case(Chain([own], [3]), points, np.zeros((3, 3)), np.zeros((1, 2)), np.zeros((1, 2)))
    case.points = points * (1.0 + force / stiffness)
    state = case.state()
    elastic = float(state.strains[0]) * stiffness
    # Lengths of 2 m are rounded by 4e-16 m, that is by 2e-10 N.
    assert elastic == pytest.approx(force, rel=1e-9, abs=1e-9)
    assert state.energy_density[0] * stiffness == pytest.approx(
        plain_energy(elastic, width), rel=1e-12, abs=0.0
    )
    assert state.mean_tensions[0] == pytest.approx(plain_tension(elastic, width), rel=1e-12)
