"""One way to move: the mobility of rings and arcs with rigid rods."""

import numpy as np
import pytest
from numpy.typing import NDArray

from ringsim.layout.mobility import internal_mobility, kutzbach_count
from ringsim.structures.ring_geometry import RingGeometry

Array = NDArray[np.float64]

CLOSED = [3, 4, 5, 6, 18]
OPEN = [1, 2, 3, 7]
OPENINGS = [0.1, 44.0, 90.0, 179.9]


def ring_of(sections: int, *, closed: bool, ratio: float = 0.934) -> RingGeometry:
    return RingGeometry.of_polygon(
        sections, closed=closed, polygon_sections=sections if closed else 18,
        aspect_ratio=ratio, half_bar=0.2889, half_diagonal=0.4275, hinge_offset=0.006554,
    )  # fmt: skip


def bar_angle(opening: float) -> float:
    return 0.5 * float(np.pi - np.radians(opening))


@pytest.mark.parametrize("opening", OPENINGS)
@pytest.mark.parametrize("sections", CLOSED)
def test_closed_ring_can_only_fold(sections: int, opening: float) -> None:
    assert internal_mobility(ring_of(sections, closed=True), bar_angle(opening)) == 1


@pytest.mark.parametrize("opening", OPENINGS)
@pytest.mark.parametrize("sections", OPEN)
def test_open_arc_folds_and_tilts_its_four_end_hinges(sections: int, opening: float) -> None:
    """The end assemblies carry the rods of one section only, all about one axis, so each can
    turn about it; an assembly between two sections cannot, because their axes differ."""
    assert internal_mobility(ring_of(sections, closed=False), bar_angle(opening)) == 1 + 4


@pytest.mark.parametrize("sections", CLOSED)
def test_deployed_ring_is_singular(sections: int) -> None:
    """At 180 deg the width is stationary: the fold is gone, and 2 N V-joints move singly."""
    assert internal_mobility(ring_of(sections, closed=True), 0.0) == 2 * sections


@pytest.mark.parametrize("sections", OPEN)
def test_deployed_arc_is_singular_and_tilts_its_end_hinges(sections: int) -> None:
    assert internal_mobility(ring_of(sections, closed=False), 0.0) == 2 * sections + 4


@pytest.mark.parametrize("ratio", [0.2, 0.6, 1.0])
def test_shape_of_the_ellipse_does_not_matter(ratio: float) -> None:
    assert internal_mobility(ring_of(8, closed=True, ratio=ratio), 0.6) == 1


def test_parallel_sections_would_let_the_hinges_between_them_tilt() -> None:
    """A straight row is no ring: two more freedoms (upper and lower) at every inner corner.

    Per inner corner the two assemblies tilt together and shear the sections against each
    other.  That is why an arc is cut from a polygon and never laid out straight.
    """
    straight = RingGeometry(
        np.array([[k, 0.0, 0.0] for k in range(3)]), False, 0.2889, 0.4275, 0.006554
    )
    assert internal_mobility(straight, 0.6) > internal_mobility(ring_of(2, closed=False), 0.6)


@pytest.mark.parametrize(
    ("sections", "closed", "count"),
    [(3, True, -27), (18, True, -132), (1, False, -1), (2, False, -8)],
)
def test_kutzbach_count(sections: int, closed: bool, count: int) -> None:
    """6 (8 N - 1) - 55 N when closed; the arc has two bodies more."""
    assert kutzbach_count(sections, closed=closed) == count


@pytest.mark.parametrize(
    ("sections", "closed"), [(3, True), (4, True), (6, True), (1, False), (2, False), (3, False)]
)
def test_same_rank_as_the_whole_jacobian_from_the_fold_state(sections: int, closed: bool) -> None:
    """The whole matrix, from the points that the ring places: no section taken for another."""
    ring = ring_of(sections, closed=closed)
    jacobian = whole_jacobian(ring, 0.8)
    assert jacobian.shape[1] - jacobian.shape[0] - 6 == kutzbach_count(sections, closed=closed)
    rank = np.linalg.matrix_rank(jacobian, tol=1e-9)
    assert jacobian.shape[1] - rank - 6 == internal_mobility(ring, 0.8)


@pytest.mark.parametrize("sections", [3, 6])
def test_the_freedom_left_is_the_fold_rate(sections: int) -> None:
    """Hinge assemblies move as ``fold_rate`` says and do not turn."""
    ring = ring_of(sections, closed=True)
    jacobian = whole_jacobian(ring, 0.8)
    _, values, rows = np.linalg.svd(jacobian)
    null = rows[int(np.sum(values > 1e-9 * values[0])) :].T
    hinges = null[36 * sections :]
    wanted = np.zeros((2, sections, 6))
    rate = ring.fold_rate(0.8)
    wanted[..., :3] = rate.corners
    weights = np.linalg.lstsq(hinges, wanted.ravel(), rcond=None)[0]
    np.testing.assert_allclose(hinges @ weights, wanted.ravel(), atol=1e-10)


def whole_jacobian(ring: RingGeometry, phi: float) -> Array:
    """All revolutes; unknowns are the twists at the origin of 6 N rods, then of the hinges."""
    fold, sections, corners = ring.fold(phi), ring.sections, len(ring.plan)
    size = 6 * (6 * sections + 2 * corners)
    rows: list[Array] = []

    def revolute(one: int, other: int, point: Array, axis: Array) -> None:
        x, y, z = point
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        across = np.stack([np.cross(axis, [0.0, 0.0, 1.0]), [0.0, 0.0, 1.0]])
        block = np.zeros((5, 6))
        block[:3, :3], block[:3, 3:], block[3:, 3:] = np.eye(3), -cross, across
        row = np.zeros((5, size))
        row[:, 6 * one : 6 * one + 6] = block
        row[:, 6 * other : 6 * other + 6] -= block
        rows.append(row)

    for k, axis in enumerate(ring.normals):
        rising, falling = 6 * k, 6 * k + 1
        revolute(rising, falling, fold.pivots[k], axis)
        for plane in range(2):
            left, right = 6 * k + 2 + 2 * plane, 6 * k + 3 + 2 * plane
            revolute(left, right, fold.vjoints[plane, k], axis)
            first = 6 * sections + plane * corners + k
            second = 6 * sections + plane * corners + (k + 1) % corners
            diagonals = (falling, rising) if plane == 0 else (rising, falling)
            for rod, hinge, pin in (
                (left, first, fold.left[plane, k]),
                (diagonals[0], first, fold.left[plane, k]),
                (right, second, fold.right[plane, k]),
                (diagonals[1], second, fold.right[plane, k]),
            ):
                revolute(rod, hinge, pin, axis)
    return np.concatenate(rows)
