"""Where brackets hold the V pulleys: lengths, derivatives, and what paper 000's eq. 21 says."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from cable_cases import cable
from ringsim.cable.records import AnyBracket, BarHalfBracket, BisectorBracket, Bracket
from ringsim.choice import kinds_of

pytestmark = pytest.mark.quick

BAR, REACH = 0.2889, 0.105
OPENING = np.radians([20.0, 47.0, 90.0, 133.0, 180.0])
PHI = 0.5 * (np.pi - OPENING)
BRACKETS = {
    "bisector": BisectorBracket(),
    "bar-half": BarHalfBracket(angle=104.0),
    "bar-half, second": BarHalfBracket(angle=104.0, half="second"),
}


def test_every_kind_is_tested():
    assert {name.split(",")[0] for name in BRACKETS} == set(kinds_of(Bracket))
    assert cable().bracket == BisectorBracket()
    read = TypeAdapter(AnyBracket).validate_python
    assert read({"kind": "bar-half", "angle": 104.0}) == BRACKETS["bar-half"]
    with pytest.raises(ValidationError, match="bar-half"):
        read({"kind": "clip"})


@pytest.mark.parametrize("bracket", BRACKETS.values(), ids=BRACKETS)
def test_slopes_are_derivatives(bracket):
    step = 1e-5
    after, before = (sum(bracket.spans(BAR, REACH, OPENING + s)) for s in (step, -step))
    slope = (after - before) / (2 * step)
    assert bracket.path_slope(BAR, REACH, OPENING) == pytest.approx(slope, abs=1e-9)
    # The rope opens the bars from 20 deg on.
    assert (bracket.path_slope(BAR, REACH, OPENING[:-1]) < 0.0).all()


def test_the_bisector_is_the_section_path():
    """Paper 000, eq. 20: either span is L(phi); a winch moves a stowed ring ever faster."""
    bracket = BRACKETS["bisector"]
    length = np.sqrt(BAR**2 + REACH**2 + 2.0 * BAR * REACH * np.sin(PHI))
    for span in bracket.spans(BAR, REACH, OPENING):
        assert span == pytest.approx(length, rel=1e-14)
    slope = -BAR * REACH * np.cos(PHI) / length  # of 2 L after the opening angle pi - 2 phi
    assert bracket.path_slope(BAR, REACH, OPENING) == pytest.approx(slope, abs=1e-16)
    assert bracket.path_slope(BAR, REACH, 0.0) == pytest.approx(0.0, abs=1e-17)


def element(opening, theta):
    """The bracket's end by rotations of the first bar: theta + 90 deg, across the other half."""
    bar = -np.exp(0.5j * (np.pi - opening))  # from the joint to its hinge; real along, i inwards
    return REACH * bar * np.exp(1j * (theta + 0.5 * np.pi))


def test_eq_21_is_the_offset_of_an_element_fixed_to_a_bar_half():
    """Built by turning the bar in the complex plane, without the formulas."""
    bracket, theta = BRACKETS["bar-half"], np.radians(104.0)
    end = element(OPENING, theta)
    aside, inward = bracket.place(PHI, REACH)
    assert aside == pytest.approx(end.real, abs=1e-16)
    assert inward == pytest.approx(end.imag, abs=1e-16)
    assert inward == pytest.approx(REACH * np.sin(0.5 * (2.0 * theta - OPENING)), abs=1e-16)
    second = BRACKETS["bar-half, second"].place(PHI, REACH)
    assert second[0] == pytest.approx(-aside, abs=1e-16)
    assert second[1] == pytest.approx(inward, abs=1e-16)


def test_the_span_along_the_own_half_keeps_its_length():
    theta = np.radians(104.0)
    own, other = BRACKETS["bar-half"].spans(BAR, REACH, OPENING)
    assert own == pytest.approx(own[0], rel=1e-14)
    assert own[0] == pytest.approx(
        np.sqrt(BAR**2 + REACH**2 + 2.0 * BAR * REACH * np.sin(theta)), rel=1e-14
    )
    square = BAR**2 + REACH**2 + 2.0 * BAR * REACH * np.sin(theta - OPENING)
    assert other == pytest.approx(np.sqrt(square), rel=1e-14)
    mirrored = BRACKETS["bar-half, second"].spans(BAR, REACH, OPENING)
    assert mirrored[0] == pytest.approx(other, rel=1e-14)
    assert mirrored[1] == pytest.approx(own, rel=1e-14)


@pytest.mark.parametrize("stowed", [10.0, 46.0])
def test_angles_at_which_the_rope_would_fold_are_refused_and_no_others(stowed):
    opening = np.radians(np.linspace(stowed, 180.0, 200))
    for angle in (90.0, 90.0 + stowed):
        bracket = BarHalfBracket(angle=angle)
        assert bracket.refusal(stowed) is None
        assert bracket.path_slope(BAR, REACH, opening).max() < 1e-12
    bracket = BarHalfBracket(angle=91.0 + stowed)
    assert bracket.path_slope(BAR, REACH, opening[0]) > 0.0
    assert f"must be at most {90.0 + stowed:g} deg" in str(bracket.refusal(stowed))
    with pytest.raises(ValidationError, match="angle"):
        BarHalfBracket(angle=89.0)
