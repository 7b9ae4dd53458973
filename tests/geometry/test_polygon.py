"""The plan view: equal chords on an ellipse."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from loops import for_each

from ringsim.structures.pantograph_ring import polygon_corners as corners

SIDES = st.integers(3, 96)
RATIOS = st.floats(0.05, 1.0)


@given(SIDES, RATIOS)
def test_all_chords_are_equal(sides: int, ratio: float) -> None:
    points = corners(sides, ratio)
    chords = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    # Newton's residual is a round-off of the squared chord, divided by the chord: at most
    # sides * 1e-16, and 1 / ratio more where a flat triangle hides its chord.
    np.testing.assert_allclose(chords, 1.0, rtol=1e-14 * (sides / 8 + 2 / ratio))


@given(SIDES, RATIOS)
def test_corners_lie_on_one_ellipse_with_the_ratio_asked_for(sides: int, ratio: float) -> None:
    points = corners(sides, ratio)
    major = points[0, 0]
    on_ellipse = (points[:, 0] / major) ** 2 + (points[:, 1] / (ratio * major)) ** 2
    np.testing.assert_allclose(on_ellipse, 1.0, rtol=1e-12)
    assert points[0, 1] == 0.0
    assert not points[:, 2].any()


@given(SIDES, RATIOS)
def test_polygon_runs_once_around_anticlockwise_and_is_convex(sides: int, ratio: float) -> None:
    edges = np.roll(corners(sides, ratio), -1, axis=0) - corners(sides, ratio)
    following = np.roll(edges, -1, axis=0)
    turns = np.arctan2(
        edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0],
        np.sum(edges * following, axis=1),
    )
    assert np.all(turns > 0.0)
    assert np.sum(turns) == pytest.approx(2.0 * np.pi, rel=1e-12)


@pytest.mark.parametrize("sides", [3, 4, 5, 6, 17, 18, 71, 72, 101])
def test_ratio_one_is_the_regular_polygon(sides: int) -> None:
    angles = 2.0 * np.pi * np.arange(sides) / sides
    radius = 0.5 / np.sin(np.pi / sides)
    expected = radius * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)
    np.testing.assert_allclose(corners(sides, 1.0), expected, atol=1e-14 * sides)


@given(RATIOS)
def test_triangle_has_its_closed_form(ratio: float) -> None:
    """Equal sides from (1, 0): 3 r^2 sin^2 t = (1 - cos t)^2, so cos t = (1-3r^2)/(1+3r^2)."""
    cosine = (1.0 - 3.0 * ratio**2) / (1.0 + 3.0 * ratio**2)
    chord = 2.0 * ratio * np.sqrt(1.0 - cosine**2)
    points = corners(3, ratio)
    # An equilateral triangle whatever the ellipse: only its place relative to it changes.
    assert points[0, 0] == pytest.approx(1.0 / chord, rel=1e-11)
    assert points[1, 0] == pytest.approx(cosine / chord, rel=1e-11, abs=1e-11)


@given(RATIOS)
def test_square_is_the_rhombus_on_the_axes(ratio: float) -> None:
    side = np.hypot(1.0, ratio)
    expected = np.array([[1, 0, 0], [0, ratio, 0], [-1, 0, 0], [0, -ratio, 0]]) / side
    np.testing.assert_allclose(corners(4, ratio), expected, atol=1e-13)


@given(SIDES, RATIOS)
def test_polygon_is_its_own_mirror_image_in_the_major_axis(sides: int, ratio: float) -> None:
    points = corners(sides, ratio)
    mirrored = np.roll(points[::-1], 1, axis=0) * [1.0, -1.0, 1.0]
    np.testing.assert_allclose(points, mirrored, atol=1e-12 * sides / ratio)


@given(st.integers(2, 48).map(lambda half: 2 * half), RATIOS)
def test_even_polygon_is_its_own_image_under_a_half_turn(sides: int, ratio: float) -> None:
    points = corners(sides, ratio)
    turned = -np.roll(points, sides // 2, axis=0)
    np.testing.assert_allclose(points, turned, atol=1e-12 * sides / ratio)


@given(st.integers(1, 24).map(lambda quarter: 4 * quarter), RATIOS)
def test_polygon_of_four_quarters_has_corners_on_both_axes(sides: int, ratio: float) -> None:
    points = corners(sides, ratio)
    np.testing.assert_allclose(
        points[sides // 4], [0.0, ratio * points[0, 0], 0.0], atol=1e-12 * sides / ratio
    )


@for_each("sides", [0, 1, 2, -3])
def test_fewer_than_three_sides_are_refused(sides: int) -> None:
    with pytest.raises(ValueError, match="at least 3 sides"):
        corners(sides, 0.9)


@for_each("ratio", [0.0, -0.5, 1.0000001, 2.0, float("nan")])
def test_ratios_outside_zero_to_one_are_refused(ratio: float) -> None:
    with pytest.raises(ValueError, match="aspect_ratio"):
        corners(6, ratio)
