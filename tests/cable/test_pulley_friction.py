"""What a pulley costs: closed forms, their limits and their agreement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loops import for_each
from pydantic import ValidationError

from cable_cases import LAWS, RADIUS, cable, eta
from ringsim.cable.friction import (
    BearingFriction,
    CapstanFriction,
    ExactBearingFriction,
    PulleyFriction,
)
from ringsim.choice import kinds_of

pytestmark = pytest.mark.quick

ANGLES = np.linspace(0.0, np.pi, 181)


def test_the_laws_tested_here_are_all_laws_there_are():
    shipped = {k for k, law in kinds_of(PulleyFriction).items() if "ringsim" in law.__module__}
    assert set(LAWS) == shipped


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_straight_rope_loses_nothing_and_no_rope_gains(law):
    decay = eta(law, ANGLES)
    # cos(pi/2) is 6e-17 in floating point, times a friction ratio below 1.
    assert decay[-1] == pytest.approx(1.0, abs=2e-16)
    assert np.all((decay > 0.0) & (decay <= 1.0))
    assert np.all(np.diff(decay) >= 0.0)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_the_slope_is_the_derivative_of_the_decay(law):
    inside, step = ANGLES[1:-1], 1e-5
    after, before = (law.log_decay(inside + s, RADIUS) for s in (step, -step))
    # Central differences: step^2 / 6 times a third derivative of order 1, and 1e-16 / step.
    assert law.log_slope(inside, RADIUS) == pytest.approx((after - before) / (2 * step), abs=1e-10)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_one_coefficient_for_each_pulley_equals_the_same_one_for_all(law):
    if not hasattr(law, "coefficient"):
        pytest.skip("the law has no coefficient")
    each = type(law)(coefficient=(law.coefficient,) * len(ANGLES))
    assert np.array_equal(each.log_decay(ANGLES, RADIUS), law.log_decay(ANGLES, RADIUS))


def test_closed_form_as_printed():
    friction = 0.3 * RADIUS * np.cos(0.5 * ANGLES)
    printed = (RADIUS - friction) / (RADIUS + friction)
    assert eta(LAWS["bearing"], ANGLES) == pytest.approx(printed, rel=1e-14)


@pytest.mark.parametrize("ratio", [1e-6, 0.04, 0.3, 0.95, 0.999])
def test_exact_root_satisfies_the_balance_of_moments(ratio):
    decay = eta(ExactBearingFriction(coefficient=ratio * RADIUS), ANGLES)
    radial = np.sqrt(1.0 + decay**2 + 2.0 * decay * np.cos(ANGLES))
    # The balance's terms are of order ratio; cancellation under the root costs sqrt(1e-16)
    # close to pi only when ratio * cos(a/2) is below 1e-8.
    assert 1.0 - decay == pytest.approx(ratio * radial, rel=1e-9, abs=2e-8 * ratio)


@pytest.mark.parametrize("ratio", [0.01, 0.02, 0.04])
def test_closed_form_differs_from_the_exact_root_by_the_stated_third_order_term(ratio):
    closed = BearingFriction(coefficient=ratio * RADIUS).log_decay(ANGLES, RADIUS)
    exact = ExactBearingFriction(coefficient=ratio * RADIUS).log_decay(ANGLES, RADIUS)
    term = ratio**3 * np.cos(0.5 * ANGLES) * np.sin(0.5 * ANGLES) ** 2
    assert closed - exact == pytest.approx(term, abs=ratio**5)
    # Largest at cos(a/2) = 1/sqrt(3); 1e-4 is the coarseness of the angles.
    assert term.max() == pytest.approx(2.0 / 27.0**0.5 * ratio**3, rel=1e-4)


def test_capstan_over_half_a_turn():
    law = CapstanFriction(coefficient=0.25)
    assert eta(law, np.zeros(1))[0] == pytest.approx(np.exp(-0.25 * np.pi), rel=1e-15)


def test_bearing_friction_is_capstan_friction_for_small_wraps():
    # 2 artanh(k sin(w/2)) = k w (1 - w^2 / 24 + k^2 w^2 / 12 + ...) for a wrap angle w.
    wrap, ratio = 1e-3, 0.1
    bearing = BearingFriction(coefficient=ratio * RADIUS).log_decay(
        np.array([np.pi - wrap]), RADIUS
    )
    capstan = CapstanFriction(coefficient=ratio).log_decay(np.array([np.pi - wrap]), RADIUS)
    assert bearing[0] == pytest.approx(capstan[0], rel=wrap**2)


@for_each("law", [BearingFriction, ExactBearingFriction])
@for_each("coefficient", [0.01, 0.02, (0.001, 0.01)])
def test_a_bearing_that_holds_any_tension_is_refused(law, coefficient):
    with pytest.raises(ValidationError, match=r"must be below pulley_radius = 0\.01 m"):
        cable(friction=law(coefficient=coefficient))


@given(ratio=st.floats(1e-6, 0.99), angle=st.floats(0.0, np.pi))
def test_the_exact_bearing_never_loses_less_than_the_closed_form(ratio, angle):
    angles = np.array([angle])
    closed = BearingFriction(coefficient=ratio * RADIUS).log_decay(angles, RADIUS)
    exact = ExactBearingFriction(coefficient=ratio * RADIUS).log_decay(angles, RADIUS)
    assert exact[0] <= closed[0] * (1.0 - 1e-12)
