"""One way to move: the mobility of rings and arcs with rigid rods."""

from typing import Literal

import numpy as np
import pytest
from fold_rates import fold_rate
from numpy.typing import NDArray

from ringsim.layout.layout import internal_mobility, layout_of
from ringsim.scene import Scene, load_scene
from ringsim.structures.pantograph_ring import PantographRing, RingGeometry

pytestmark = pytest.mark.quick

Array = NDArray[np.float64]

CLOSED = [3, 4, 5, 6, 18]
OPEN = [1, 2, 3, 7]
OPENINGS = [0.1, 44.0, 90.0, 179.9]


def ring_of(sections: int, *, closed: bool, ratio: float = 0.934) -> Scene:
    """Rods and joints alone."""
    return load_scene("ring18").with_values({
        "structure.sections": sections, "structure.closed": closed,
        "structure.aspect_ratio": ratio, "boom": "none", "net": "none", "loads": "none",
        "record.stress": False,
    })  # fmt: skip


def mobility(scene: Scene, phi: float) -> int:
    return internal_mobility(layout_of(scene, phi))


def bar_angle(opening: float) -> float:
    return 0.5 * float(np.pi - np.radians(opening))


@pytest.mark.parametrize("opening", OPENINGS)
@pytest.mark.parametrize("sections", CLOSED)
def test_closed_ring_can_only_fold(sections: int, opening: float) -> None:
    assert mobility(ring_of(sections, closed=True), bar_angle(opening)) == 1


@pytest.mark.parametrize("opening", OPENINGS)
@pytest.mark.parametrize("sections", OPEN)
def test_open_arc_folds_and_tilts_its_four_end_hinges(sections: int, opening: float) -> None:
    """The end assemblies carry the rods of one section only, all about one axis, so each can
    turn about it; an assembly between two sections cannot, because their axes differ."""
    assert mobility(ring_of(sections, closed=False), bar_angle(opening)) == 1 + 4


@pytest.mark.parametrize("sections", CLOSED)
def test_deployed_ring_is_singular(sections: int) -> None:
    """At 180 deg the width is stationary: the fold is gone, and 2 N V-joints move singly."""
    assert mobility(ring_of(sections, closed=True), 0.0) == 2 * sections


@pytest.mark.parametrize("sections", OPEN)
def test_deployed_arc_is_singular_and_tilts_its_end_hinges(sections: int) -> None:
    assert mobility(ring_of(sections, closed=False), 0.0) == 2 * sections + 4


@pytest.mark.parametrize("ratio", [0.2, 0.6, 1.0])
def test_shape_of_the_ellipse_does_not_matter(ratio: float) -> None:
    assert mobility(ring_of(8, closed=True, ratio=ratio), 0.6) == 1


class StraightRow(PantographRing):
    """Sections in one line."""

    kind: Literal["straight-row"] = "straight-row"  # type: ignore[assignment]

    def geometry(self) -> RingGeometry:
        row = np.array([[float(k), 0.0, 0.0] for k in range(self.sections + 1)])
        return RingGeometry(row, False, self.half_bar, self.half_diagonal, self.hinge_offset)


def test_parallel_sections_would_let_the_hinges_between_them_tilt() -> None:
    """A straight row is no ring: two more freedoms (upper and lower) at every inner corner.

    Per inner corner the two assemblies tilt together and shear the sections against each
    other.  That is why an arc is cut from a polygon and never laid out straight.
    """
    arc = ring_of(2, closed=False)
    straight = arc.model_copy(update={"structure": StraightRow(sections=2, closed=False)})
    assert mobility(straight, 0.6) > mobility(arc, 0.6)


@pytest.mark.parametrize("boom", ["rigid", "flexible"])
def test_a_boom_ties_two_ends_of_an_arc_together(boom: str) -> None:
    arc = ring_of(2, closed=False).with_values({"boom": {"kind": boom}})
    assert mobility(arc, 0.6) == 4
    assert mobility(ring_of(4, closed=True).with_values({"boom": {"kind": boom}}), 0.6) == 1


def test_a_prismatic_joint_on_a_boom_holds_both_of_its_ends() -> None:
    boom = {"boom": {"kind": "rigid", "joint": "prismatic"}}
    assert mobility(ring_of(2, closed=False).with_values(boom), 0.6) == 3
    assert mobility(ring_of(4, closed=True).with_values(boom), 0.6) == 1


def test_the_planar_truss_can_only_fold() -> None:
    assert mobility(load_scene("planar-truss"), 0.8) == 1


@pytest.mark.parametrize(
    ("sections", "closed"), [(3, True), (4, True), (6, True), (1, False), (2, False), (3, False)]
)
def test_same_rank_as_the_whole_jacobian_from_the_fold_state(sections: int, closed: bool) -> None:
    """The whole matrix, from the points that the ring places: no section taken for another."""
    scene = ring_of(sections, closed=closed)
    jacobian = whole_jacobian(scene.structure.geometry(), 0.8)
    kutzbach = -7 * sections - 6 if closed else -7 * sections + 6
    assert jacobian.shape[1] - jacobian.shape[0] - 6 == kutzbach
    rank = np.linalg.matrix_rank(jacobian, tol=1e-9)
    assert jacobian.shape[1] - rank - 6 == mobility(scene, 0.8)


@pytest.mark.parametrize("sections", [3, 6])
def test_the_freedom_left_is_the_fold_rate(sections: int) -> None:
    """Hinge assemblies move as ``fold_rate`` says and do not turn."""
    ring = ring_of(sections, closed=True).structure.geometry()
    jacobian = whole_jacobian(ring, 0.8)
    _, values, rows = np.linalg.svd(jacobian)
    null = rows[int(np.sum(values > 1e-9 * values[0])) :].T
    hinges = null[36 * sections :]
    wanted = np.zeros((2, sections, 6))
    rate = fold_rate(ring, 0.8)
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
