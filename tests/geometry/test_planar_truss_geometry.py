"""Every angle of the planar truss keeps its lengths; the rates are the lengths' derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from ringsim.structures.planar_truss import TrussGeometry

pytestmark = pytest.mark.quick

LENGTHS = st.floats(0.05, 5.0)
SHARES = st.floats(0.05, 0.95)
ANGLES = st.floats(0.02, 3.1)


@st.composite
def trusses(draw):
    beam, axis = draw(LENGTHS), draw(LENGTHS)
    return TrussGeometry(beam, axis, draw(SHARES) * axis, draw(SHARES) * beam)


def apart(first, second):
    return np.linalg.norm(first - second, axis=-1)


@given(trusses(), ANGLES)
def test_points_keep_all_lengths(truss, angle):
    points = truss.points(angle)
    size = truss.beam + truss.axis
    # Sums of a few products of lengths of this size: round-off only.
    close = {"rtol": 0.0, "atol": 1e-13 * size}
    np.testing.assert_allclose(apart(points.upper_end, points.upper), truss.beam, **close)
    np.testing.assert_allclose(apart(points.lower_end, points.lower), truss.beam, **close)
    np.testing.assert_allclose(points.upper_end - points.lower_end, [0, truss.axis, 0], **close)
    np.testing.assert_allclose(apart(points.upper, points.foot), truss.foot, **close)
    np.testing.assert_allclose(apart(points.upper, points.head), truss.head, **close)
    on_beam = np.cross(points.head - points.upper, points.upper_end - points.upper)
    np.testing.assert_allclose(on_beam, 0.0, atol=1e-13 * size**2)


@given(trusses(), ANGLES)
def test_cable_and_strut_are_distances_of_the_points(truss, angle):
    points = truss.points(angle)
    # Distances of nearly meeting points lose digits relative to the lengths that they come from.
    near = {"rtol": 0.0, "atol": 1e-12 * (truss.beam + truss.axis)}
    np.testing.assert_allclose(truss.cable(angle), apart(points.upper_end, points.lower), **near)
    np.testing.assert_allclose(truss.strut(angle), apart(points.head, points.foot), **near)


@given(trusses(), ANGLES)
def test_angle_undoes_cable(truss, angle):
    # The arc cosine loses digits where its sine is small: 1e-16 / sin(0.02)^2 of both sides.
    ratio = max(truss.beam / truss.axis, truss.axis / truss.beam)
    np.testing.assert_allclose(truss.angle(truss.cable(angle)), angle, atol=1e-11 * ratio)


def strut_rate(truss):
    """Derivative of the strut's length: ds/dg = q p sin g / s."""
    return lambda angle: truss.head * truss.foot * np.sin(angle) / truss.strut(angle)


@given(trusses(), ANGLES)
def test_rates_are_derivatives(truss, angle):
    step = 1e-5
    for length, rate in ((truss.cable, truss.cable_rate), (truss.strut, strut_rate(truss))):
        assume(length(angle) > 0.02)
        difference = (length(angle + step) - length(angle - step)) / (2.0 * step)
        # Central differences: step^2 / 6 times a third derivative of up to L^4 / length^3, and
        # round-off of 1e-16 L / step.
        size = truss.beam + truss.axis
        bound = step**2 * size**4 / length(angle) ** 3 + 1e-10 * size
        assert abs(rate(angle) - difference) <= bound


def test_lengths_do_not_change_where_it_is_folded_flat():
    truss = TrussGeometry(0.627, 0.72, 0.12, 0.54)
    assert truss.cable_rate(0.0) == 0.0
    assert truss.cable(0.0) == pytest.approx(0.72 - 0.627, rel=1e-12)
    assert truss.strut(0.0) == pytest.approx(0.54 - 0.12, rel=1e-12)


def test_a_cable_out_of_reach_has_no_angle():
    truss = TrussGeometry(0.627, 0.72, 0.12, 0.54)
    assert np.isnan(truss.angle([0.09, 1.35])).all()
