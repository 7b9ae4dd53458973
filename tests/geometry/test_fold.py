"""Fold states: exact, stress-free, similar to themselves."""

from dataclasses import fields

import numpy as np
import pytest
from fold_rates import fold_rate
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from ringsim.scene import load_scene
from ringsim.structures.pantograph_ring import Fold, RingGeometry

Array = NDArray[np.float64]

ROD_ROUND_OFF = 1e-13
"""Relative: rods of half a metre between points up to 20 m away, in doubles."""

OPENING = st.floats(0.01, 180.0)


@st.composite
def rings(draw: st.DrawFn, *, closed: bool | None = None) -> RingGeometry:
    is_closed = draw(st.booleans()) if closed is None else closed
    polygon = draw(st.integers(3, 72))
    half_diagonal = draw(st.floats(0.1, 2.0))
    return RingGeometry.of_polygon(
        polygon if is_closed else draw(st.integers(1, polygon - 1)),
        closed=is_closed,
        polygon_sections=polygon,
        aspect_ratio=draw(st.floats(0.2, 1.0)),
        half_bar=half_diagonal * draw(st.floats(0.2, 0.95)),
        half_diagonal=half_diagonal,
        hinge_offset=draw(st.floats(0.0, 0.05)),
    )


def bar_angle(opening: float) -> float:
    return 0.5 * (np.pi - np.radians(opening))


def corner_pairs(ring: RingGeometry) -> tuple[Array, Array]:
    first = np.arange(ring.sections)
    return first, (first + 1) % len(ring.plan)


def distance(one: Array, other: Array) -> Array:
    return np.asarray(np.linalg.norm(one - other, axis=-1))


@given(rings(), OPENING)
def test_rods_keep_their_lengths(ring: RingGeometry, opening: float) -> None:
    fold = ring.fold(bar_angle(opening))
    for pins in (fold.left, fold.right):
        np.testing.assert_allclose(
            distance(pins, fold.pivots[None]), ring.half_diagonal, rtol=ROD_ROUND_OFF
        )
        np.testing.assert_allclose(distance(pins, fold.vjoints), ring.half_bar, rtol=ROD_ROUND_OFF)


@given(rings(), OPENING)
def test_pivots_are_the_middle_of_both_diagonals(ring: RingGeometry, opening: float) -> None:
    fold = ring.fold(bar_angle(opening))
    for left, right in ((0, 1), (1, 0)):
        middle = 0.5 * (fold.left[left] + fold.right[right])
        np.testing.assert_allclose(fold.pivots, middle, atol=1e-13)


@given(rings(), OPENING)
def test_corners_are_equally_high_and_the_planes_mirror_each_other(
    ring: RingGeometry, opening: float
) -> None:
    phi = bar_angle(opening)
    upper, lower = ring.fold(phi).corners
    np.testing.assert_array_equal(upper[:, 2], np.full(len(upper), 0.5 * ring.height(phi)))
    np.testing.assert_array_equal(lower, upper * [1.0, 1.0, -1.0])


@given(rings(), OPENING)
def test_pins_sit_at_the_hinge_offset_within_the_plane_of_their_section(
    ring: RingGeometry, opening: float
) -> None:
    fold = ring.fold(bar_angle(opening))
    first, second = corner_pairs(ring)
    out, back = fold.left - fold.corners[:, first], fold.right - fold.corners[:, second]
    expected = np.broadcast_to(ring.hinge_offset * ring.directions, out.shape)
    np.testing.assert_allclose(out, expected, atol=1e-13)
    np.testing.assert_allclose(back, -expected, atol=1e-13)


@given(rings(), OPENING)
def test_angle_between_the_bar_halves_is_the_opening_angle(
    ring: RingGeometry, opening: float
) -> None:
    fold = ring.fold(bar_angle(opening))
    one, other = fold.left - fold.vjoints, fold.right - fold.vjoints
    sine = np.linalg.norm(np.cross(one, other), axis=-1)
    cosine = np.sum(one * other, axis=-1)
    np.testing.assert_allclose(np.degrees(np.arctan2(sine, cosine)), opening, atol=1e-9)


@given(rings(), st.floats(0.01, 179.0))
def test_bars_fold_inwards(ring: RingGeometry, opening: float) -> None:
    fold = ring.fold(bar_angle(opening))
    assert np.all(fold.vjoints[0, :, 2] < fold.left[0, :, 2])
    assert np.all(fold.vjoints[1, :, 2] > fold.left[1, :, 2])


@given(rings(closed=True), OPENING, OPENING)
def test_closed_ring_stays_similar_to_itself(
    ring: RingGeometry, opening: float, other: float
) -> None:
    one, two = (ring.fold(bar_angle(angle)).corners[0, :, :2] for angle in (opening, other))
    scale = distance(one[0], one[1]) / distance(two[0], two[1])
    np.testing.assert_allclose(one, scale * two, rtol=1e-11, atol=1e-12)


@given(rings(closed=True), OPENING)
def test_normals_are_fixed_unit_vectors_that_point_outwards(
    ring: RingGeometry, opening: float
) -> None:
    np.testing.assert_allclose(np.linalg.norm(ring.normals, axis=1), 1.0, rtol=1e-12)
    fold = ring.fold(bar_angle(opening))
    # From the mean corner: the centre of a flat ellipse can lie outside its triangle.
    outwards = fold.pivots - fold.corners[0].mean(axis=0) * [1.0, 1.0, 0.0]
    assert np.all(np.sum(outwards * ring.normals, axis=1) > 0.0)


@given(rings(), st.floats(1.0, 179.0))
def test_fold_rate_is_the_derivative_of_the_fold(ring: RingGeometry, opening: float) -> None:
    phi, step = bar_angle(opening), 1e-4
    ahead, behind, rate = ring.fold(phi + step), ring.fold(phi - step), fold_rate(ring, phi)
    size = np.abs(ahead.corners).max()
    for field in fields(Fold):
        central = (getattr(ahead, field.name) - getattr(behind, field.name)) / (2.0 * step)
        # Third derivatives over six times step^2 (heights near half_bar = 0.95 half_diagonal
        # bend sharply: up to 50 times the size), and round-off over the step.
        np.testing.assert_allclose(
            getattr(rate, field.name), central, atol=(50.0 * step**2 + 1e-11) * max(size, 1.0)
        )


@given(rings(), st.floats(0.01, 179.9))
def test_fold_rate_keeps_rod_lengths(ring: RingGeometry, opening: float) -> None:
    """To first order: velocity differences along every rod vanish, without any step size."""
    phi = bar_angle(opening)
    fold, rate = ring.fold(phi), fold_rate(ring, phi)
    for side in ("left", "right"):
        for middle in ("pivots", "vjoints"):
            along = getattr(fold, side) - getattr(fold, middle)
            change = getattr(rate, side) - getattr(rate, middle)
            np.testing.assert_allclose(np.sum(along * change, axis=-1), 0.0, atol=1e-12)


def test_published_ring_has_the_published_axes() -> None:
    """Paper 002, table 1: 3.5184 m and 3.2856 m, with the hinge offset that closes it."""
    ring = load_scene("ring18").structure.geometry()
    upper = ring.fold(0.0).corners[0]
    assert 2.0 * upper[0, 0] == pytest.approx(3.5184, abs=1e-3)
    across = np.abs(upper[:, 1]) / np.sqrt(
        np.clip(1.0 - (upper[:, 0] / upper[0, 0]) ** 2, 1e-30, None)
    )
    np.testing.assert_allclose(2.0 * across[1:9], 3.2856, atol=1e-3)
    assert ring.hinge_offset == pytest.approx(6.554e-3, abs=5e-7)


def test_published_section_is_consistent() -> None:
    """0.63^2 + (2 x 0.2889)^2 = (2 x 0.4275)^2: the deployed height of the papers.

    Half a last digit of the bars and diagonals (0.05 mm) moves the height by 0.23 mm.
    """
    ring = load_scene("ring18").structure.geometry()
    assert ring.height(0.0) == pytest.approx(0.63, abs=2.3e-4)


@pytest.mark.parametrize(("closed", "corners"), [(True, 6), (False, 7)])
def test_shapes_follow_the_number_of_sections(closed: bool, corners: int) -> None:
    ring = RingGeometry.of_polygon(
        6, closed=closed, polygon_sections=6 if closed else 9, aspect_ratio=0.9,
        half_bar=0.3, half_diagonal=0.4, hinge_offset=0.01,
    )  # fmt: skip
    fold = ring.fold(0.5)
    assert ring.sections == 6
    assert fold.corners.shape == (2, corners, 3)
    assert fold.left.shape == fold.right.shape == fold.vjoints.shape == (2, 6, 3)
    assert fold.pivots.shape == (6, 3)
    assert ring.normals.shape == (6, 3)


def test_two_sections_of_the_18_gon_are_20_degrees_apart() -> None:
    ring = RingGeometry.of_polygon(
        2, closed=False, polygon_sections=18, aspect_ratio=1.0,
        half_bar=0.2889, half_diagonal=0.4275, hinge_offset=0.006554,
    )  # fmt: skip
    one, two = ring.normals
    assert np.degrees(np.arccos(one @ two)) == pytest.approx(20.0, abs=1e-10)
