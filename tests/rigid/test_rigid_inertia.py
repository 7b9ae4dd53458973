"""Inertia of a ring of rigid rods against its rods cut into pieces on the fold's own points."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest
from fold_rates import fold_rate

from ringsim.rigid.statics import OneCoordinate
from ringsim.scene import Scene
from ringsim.structures.pantograph_ring import PantographRing
from small_rings import pulled

pytestmark = pytest.mark.quick

PIECES = 200


def summed(scene: Scene, phi: float, *, fixed: bool) -> float:
    """Sum of m |dr/dphi|^2, with translation and rotation taken out of a ring that floats."""
    shape, rods = scene.structure, scene.rods
    geometry = shape.geometry()
    fold, rate = geometry.fold(phi), fold_rate(geometry, phi)
    parts = [
        (np.full(place[..., 0].size, mass), place, moving)
        for mass, place, moving in (
            (shape.corner_mass, fold.corners, rate.corners),
            (shape.vjoint_mass, fold.vjoints, rate.vjoints),
        )
    ]
    share = (np.arange(PIECES) + 0.5)[:, None, None] / PIECES
    diagonals = [("left", 0, "right", 1), ("left", 1, "right", 0)]
    bars = [(a, k, b, k) for k in (0, 1) for a, b in (("left", "vjoints"), ("vjoints", "right"))]
    for tube, ends in ((rods.diagonal, diagonals), (rods.bar, bars)):
        for a, k, b, other in ends:
            begin, end = getattr(fold, a)[k], getattr(fold, b)[other]
            begin_rate, end_rate = getattr(rate, a)[k], getattr(rate, b)[other]
            length = np.linalg.norm(end - begin, axis=1)[0]
            places = (1 - share) * begin + share * end
            moving = (1 - share) * begin_rate + share * end_rate
            mass = rods.density * tube.area * length / PIECES
            parts.append((np.full(places[..., 0].size, mass), places, moving))
    m = np.concatenate([p[0] for p in parts])
    r = np.concatenate([p[1].reshape(-1, 3) for p in parts])
    v = np.concatenate([p[2].reshape(-1, 3) for p in parts])
    if fixed:
        v = v - rate.corners[0, 0]
        return float(m @ np.sum(v**2, axis=1))
    r, v = r - m @ r / m.sum(), v - m @ v / m.sum()
    spin = np.einsum("i,ia,ib->ab", m, r, r)
    turning = np.linalg.solve(np.trace(spin) * np.eye(3) - spin, np.cross(r, v).T @ m)
    return float(m @ np.sum((v - np.cross(turning, r)) ** 2, axis=1))


@pytest.mark.parametrize("sections", [5, 18])
@pytest.mark.parametrize("base", ["free", "fixed"])
@pytest.mark.parametrize("phi", [0.0, 0.5, 1.4])
def test_inertia_is_that_of_its_pieces(sections, base, phi):
    boom = {"kind": "rigid", "base": "fixed"} if base == "fixed" else "none"
    scene = pulled(sections, boom=boom)
    expected = summed(scene, phi, fixed=base == "fixed")
    # The pieces leave out 1 / PIECES^2 of the rods' own turning, and their cross-sections: I / A
    # over length^2 is 1.6e-4 of it for the bars.
    assert OneCoordinate(scene).motion(phi).inertia == pytest.approx(expected, rel=3e-4)
    wire = {"outer_diameter": 1e-3, "inner_diameter": 0.0}
    heavy = {"rods__diagonal": wire, "rods__bar": wire, "rods__density": 3e4}
    thin = pulled(sections, boom=boom, **heavy)
    # Cross-sections that turn next to nothing, 1e-5, and what the pieces leave out, 1 / PIECES^2.
    assert OneCoordinate(thin).motion(phi).inertia == pytest.approx(
        summed(thin, phi, fixed=base == "fixed"), rel=4e-5
    )


class RingWithoutBasis(PantographRing):
    """Its layout is built anew at every coordinate."""

    kind: Literal["ring-without-basis"] = "ring-without-basis"  # type: ignore[assignment]

    def basis(self, coordinate: float) -> np.ndarray:
        return np.zeros((2, 0))


class RingWithTooSmallBasis(PantographRing):
    """Its basis leaves out the height of its sections."""

    kind: Literal["ring-with-too-small-basis"] = "ring-with-too-small-basis"  # type: ignore[assignment]

    def basis(self, coordinate: float) -> np.ndarray:
        return super().basis(coordinate)[:, :3]


class RingWithRepeatedBasis(PantographRing):
    """Its basis holds twice the first function, too."""

    kind: Literal["ring-with-repeated-basis"] = "ring-with-repeated-basis"  # type: ignore[assignment]

    def basis(self, coordinate: float) -> np.ndarray:
        known = super().basis(coordinate)
        return np.hstack([known, 2.0 * known[:, :1]])


def of_kind(kind: type[PantographRing], scene: Scene) -> Scene:
    fields = scene.structure.model_dump(exclude={"kind"})
    return scene.model_copy(update={"structure": kind(**fields)})


@pytest.mark.parametrize("values", [{}, {"boom__base": "fixed"}, {"structure__closed": False}])
def test_the_basis_gives_what_each_layout_gives(values):
    scene = pulled(5, net__neutral_length=0.2, **values)
    ring, anew = OneCoordinate(scene), OneCoordinate(of_kind(RingWithoutBasis, scene))
    for phi in (0.1, 0.7, 1.5):
        # Coefficients are solved for: their own round-off is a few times that of the places.
        found, expected = ring.motion(phi), anew.motion(phi)
        assert found.inertia == pytest.approx(expected.inertia, rel=1e-12)
        assert found.velocity == pytest.approx(expected.velocity, rel=1e-11, abs=1e-13)
        assert found.rotation == pytest.approx(expected.rotation, rel=1e-11, abs=1e-13)
        assert ring.work_rate(phi) == pytest.approx(anew.work_rate(phi), rel=1e-11)
        assert ring.work(phi) - ring.work(1.0) == pytest.approx(
            anew.work(phi) - anew.work(1.0), rel=1e-10
        )


@pytest.mark.parametrize(
    ("kind", "wanted"),
    [
        (RingWithTooSmallBasis, "list in basis"),
        (RingWithRepeatedBasis, r"basis\(\) has 5 functions, but only 4 can be told apart"),
    ],
)
def test_a_basis_that_leaves_out_or_repeats_a_function_is_refused(kind, wanted):
    with pytest.raises(ValueError, match=wanted):
        OneCoordinate(of_kind(kind, pulled(5)))
