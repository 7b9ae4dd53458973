"""Tensions of a chain against closed forms, and where its energy goes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cable_cases import (
    LAWS,
    RADIUS,
    Case,
    cable,
    damping_loss,
    decays,
    eta,
    friction_loss,
    random_case,
    still,
    winch_power,
)
from ringsim.cable.friction import BearingFriction
from ringsim.core.chain import Chain

pytestmark = pytest.mark.quick

# Tension is so far above the smoothing width that softplus equals its argument to 1e-16.
TAUT = {"axial_stiffness": 1e4, "slack_width": 0.01}


def zigzag(spans, angle):
    """Equal spans in a plane with the same angle between the pulls at every pulley."""
    heading = (np.pi - angle) * np.tile([0.0, 1.0], spans)[:spans]
    steps = 0.5 * np.stack([np.cos(heading), np.sin(heading), np.zeros(spans)], axis=-1)
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


def test_without_friction_the_tension_is_uniform_and_that_of_paper_001():
    case = random_case(3, wound=0.002, winding=0.01, **TAUT)
    state = case.state()
    for k, rope in enumerate([state.tensions[:6], state.tensions[6:]]):
        natural = case.ropes.content[k] - 0.002
        assert rope == pytest.approx(1e4 * (state.paths[k] - natural) / natural, rel=1e-12)
    assert decays(state) == pytest.approx(1.0, abs=1e-15)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("angle", [0.3, 1.2, 2.9])
def test_tension_falls_by_the_product_of_the_decays(law, angle):
    # Fast rope: tanh(speed / slip_speed) is 1 to rounding at every pulley.
    state = still(zigzag(6, angle), 0.004, friction=law, slip_speed=1e-3, **TAUT).state()
    assert state.angles == pytest.approx(angle, rel=1e-12)
    ratio = eta(law, np.array([angle]))[0]
    assert decays(state) == pytest.approx(ratio ** np.arange(6), rel=1e-12)
    assert state.tensions / state.tensions[0] == pytest.approx(decays(state), rel=1e-12)


def test_winch_tension_is_the_corrected_sum_of_elongations():
    case = still(zigzag(6, 1.2), 0.003, friction=LAWS["bearing"], slip_speed=1e-3, **TAUT)
    state = case.state()
    elongation = 0.003
    expected = 1e4 * elongation / np.sum(decays(state) * state.lengths)
    # Equal to first order of strain, which is 1e-3 here.
    assert state.tensions[0] == pytest.approx(expected, rel=2 * state.strains[0])
    assert np.sum(state.lengths - state.stored) == pytest.approx(elongation, rel=1e-12)


def test_a_straight_rope_over_bad_pulleys_keeps_its_tension():
    points = np.outer(np.arange(9), [0.3, 0.4, 0.1])
    state = still(
        points, 0.001, friction=BearingFriction(coefficient=0.95 * RADIUS), **TAUT
    ).state()
    # The directions of the spans agree to 1e-16, which is the wrap angle left.
    assert state.tensions / state.tensions[0] == pytest.approx(1.0, abs=1e-14)


def test_symmetric_v_path():
    # Hinge pulleys at +-0.25 m, the V pulley 0.1 m below: angle and length by trigonometry.
    wound, base, depth = 0.001, 0.25, 0.1
    points = [[-0.75, 0, 0], [-base, 0, 0], [0, 0, -depth], [base, 0, 0], [0.75, 0, 0]]
    state = still(points, wound, friction=LAWS["bearing"], slip_speed=1e-3, **TAUT).state()
    slope = np.arctan2(depth, base)
    assert state.angles == pytest.approx([np.pi - slope, np.pi - 2 * slope, np.pi - slope])
    path = 1.0 + 2.0 * np.hypot(base, depth)
    assert state.paths[0] == pytest.approx(path, rel=1e-14)
    one, two = eta(LAWS["bearing"], np.pi - slope * np.array([1.0, 2.0]))
    falls = [1.0, one, one * two, one * two * one]
    assert decays(state) == pytest.approx(falls, rel=1e-12)
    half = np.hypot(base, depth)
    mean = (0.5 + one * half + one * two * half + 0.5 * falls[3]) / path
    tension = 1e4 * wound / (path - wound) / mean
    assert state.tensions[0] == pytest.approx(tension, rel=1e-12)
    lift = (falls[1] + falls[2]) * tension * np.sin(slope)
    assert state.point_forces[2, 2] == pytest.approx(lift, rel=1e-12)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_forces_and_moments_of_a_cable_balance(law):
    case = random_case(11, wound=0.01, winding=0.3, friction=law, **TAUT)
    forces, largest = case.state().point_forces, case.state().tensions.max()
    assert forces.sum(axis=0) == pytest.approx(0.0, abs=1e-13 * largest)
    assert np.cross(case.points, forces).sum(axis=0) == pytest.approx(0.0, abs=1e-12 * largest)


def test_a_rope_that_runs_back_inverts_the_decay_and_one_at_rest_has_none():
    path = zigzag(4, 1.0)
    for rate, exponent in [(1.0, 1.0), (-1.0, -1.0), (0.0, 0.0)]:
        state = still(path, 0.002, (rate, 0.0), friction=LAWS["capstan"], slip_speed=1e-3).state()
        ratio = eta(LAWS["capstan"], state.angles)
        assert state.tensions[1:] / state.tensions[:-1] == pytest.approx(ratio**exponent, rel=1e-12)


def test_two_winches_make_the_tension_lowest_in_the_middle():
    state = still(zigzag(6, 1.0), 0.002, (0.5, 0.5), friction=LAWS["bearing"], **TAUT).state()
    assert state.speeds[2] == pytest.approx(0.0, abs=1e-15)
    assert state.tensions == pytest.approx(state.tensions[::-1], rel=1e-12)
    assert np.argmin(state.tensions) in (2, 3)


def test_a_slack_rope_pulls_less_than_its_width_and_a_taut_one_like_a_spring():
    for stretch, low, high in [(-0.1, 0.0, 1e-12), (0.0, 0.0346, 0.0348), (0.01, 49.9, 50.4)]:
        state = still([[0, 0, 0], [1, 0, 0], [2, 0, 0]], stretch, axial_stiffness=1e4).state()
        assert low <= state.mean_tensions[0] <= high
        assert state.is_slack[0] == (stretch < 0.0)


def test_no_length_of_chain_or_friction_overflows():
    path = zigzag(500, 0.2)
    for rate in (1.0, -1.0):
        law = BearingFriction(coefficient=0.95 * RADIUS)
        state = still(path, 0.01, (rate, 0.0), friction=law).state()
        assert np.all(np.isfinite(state.tensions))
        mean = np.sum(state.tensions * state.lengths) / state.paths[0]
        assert mean == pytest.approx(state.mean_tensions[0], rel=1e-12)


def test_rope_speed_is_the_rate_at_which_the_spans_beyond_lose_rope():
    case = random_case(5, counts=(6,), wound=0.002, winding=0.2, far_winding=0.1)

    def held(time):
        points = case.points + time * case.velocities
        wound = case.wound + time * case.wound_rate
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        return lengths * (case.ropes.content[0] - wound.sum()) / lengths.sum()

    step = 1e-6
    change = (held(step) - held(-step)) / (2 * step)
    speeds = [-0.1 - change[j:].sum() for j in range(1, 5)]
    # Differences of lengths of order 1 m over 2e-6 s: 1e-10 by rounding.
    assert case.state().speeds == pytest.approx(speeds, abs=1e-9)
    assert -0.1 - change.sum() == pytest.approx(0.2, abs=1e-9)


MOTIONS = {
    "seed": st.integers(0, 10_000),
    "speed": st.floats(0.0, 5.0),
    "wound": st.floats(-0.02, 0.02),
    "winding": st.floats(-0.5, 0.5),
    "far_winding": st.floats(-0.5, 0.5),
    "law": st.sampled_from(sorted(LAWS)),
}


@settings(max_examples=150)
@given(**MOTIONS)
def test_friction_and_damping_never_feed_energy_in(law, **motion):
    state = random_case(**motion, friction=LAWS[law], damping_time=0.1).state()
    assert np.all(friction_loss(state) >= 0.0)
    # The viscous tension is a difference of two tensions.
    assert np.all(damping_loss(state) >= -1e-12 * state.mean_tensions.max())
    behind, before = state.ropes.behind, state.ropes.behind - 1
    stretched = 1.0 + state.strains[state.ropes.of_pulley]
    by_tensions = (state.tensions[before] - state.tensions[behind]) * state.speeds * stretched
    # Both spans' tensions are rounded products of many decays.
    assert friction_loss(state) == pytest.approx(by_tensions, abs=1e-12 * state.tensions.max())


@settings(max_examples=150)
@given(**MOTIONS)
def test_the_winch_pays_for_all_power(law, **motion):
    rope = {"axial_stiffness": 1e4, "slack_width": 1.0, "damping_time": 0.1}
    case = random_case(**motion, friction=LAWS[law], **rope)
    state = case.state()
    step = 1e-7

    def energy(time):
        points = case.points + time * case.velocities
        return case.state(points, wound=case.wound + time * case.wound_rate).elastic_energy.sum()

    terms = [
        np.sum(state.point_forces * case.velocities),
        friction_loss(state).sum(),
        damping_loss(state).sum(),
        (state.energy_density * state.wound_rates).sum(),
        (energy(step) - energy(-step)) / (2 * step),
    ]
    # The energy's rate is a central difference: the elastic force changes by up to 1e-2 of the
    # slack width within a step, which is 1e-4 / 6 of the rate; lengths are rounded to 1e-15 m,
    # that is 1e-8 m/s.
    error = 2e-5 * np.abs(terms).max() + 1e-8 * (1.0 + state.tensions.sum())
    assert winch_power(state).sum() == pytest.approx(np.sum(terms), abs=error)


def test_chains_of_unequal_cables_do_not_mix():
    both = random_case(8, counts=(5, 9), wound=0.003, winding=0.2, friction=LAWS["bearing"])
    whole = both.state()
    first = Case(
        Chain([cable(friction=LAWS["bearing"])], [9]),
        both.points[5:],
        both.velocities[5:],
        both.wound[1:],
        both.wound_rate[1:],
    ).state()
    assert whole.tensions[4:] == pytest.approx(first.tensions, rel=1e-12)
    assert whole.point_forces[5:] == pytest.approx(first.point_forces, rel=1e-10)


def test_input_without_an_answer_is_refused():
    with pytest.raises(ValueError, match="cable 1: span 2 has no length"):
        still([[0, 0, 0], [1, 0, 0], [1, 0, 0], [2, 0, 0]], 0.0).state()
    with pytest.raises(ValueError, match="not finite"):
        still([[0, 0, 0], [1, 0, 0], [np.nan, 0, 0]], 0.0).state()
    with pytest.raises(ValueError, match=r"cable 1: 0\.5 m more is wound"):
        still([[0, 0, 0], [1, 0, 0], [2, 0, 0]], 2.5).state()
    with pytest.raises(ValueError, match="has 2 values, but there are 3 pulleys"):
        Chain([cable(friction=BearingFriction(coefficient=(0.001, 0.002)))], [5])
