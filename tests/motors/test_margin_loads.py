"""Forces on the V-joints that fold the ring are resistances, with a standard's factor; those that
open it drive.
"""

from __future__ import annotations

import math

import pytest

from motor_rings import PLAIN, ring
from ringsim.layout.layout import layout_of
from ringsim.parts.margin import EcssMechanisms, MarginStandard, NasaMechanisms
from ringsim.rigid.margin import DriveMargin
from ringsim.scene import Scene

pytestmark = pytest.mark.quick

DRY = {"coulomb": 0.05}


def heights(scene: Scene, angle: float) -> float:
    """By how much the V-joints of a section part with the opening angle, m/rad.

    A V-joint stands l sin(fold) inside the ends of its bars, and these d sin(theta) from the
    middle, where d cos(theta) = l cos(fold).
    """
    bar, diagonal, fold = 0.2889, 0.4275, 0.5 * (math.pi - angle)
    theta = math.acos(bar * math.cos(fold) / diagonal)
    # d(theta) / d(fold) = l sin(fold) / (d sin(theta)).
    ends = diagonal * math.cos(theta) * bar * math.sin(fold) / (diagonal * math.sin(theta))
    return -0.5 * 2.0 * (ends - bar * math.cos(fold))


@pytest.mark.parametrize("standard", [PLAIN, EcssMechanisms(), NasaMechanisms()])
@pytest.mark.parametrize("degrees", [62.0, 100.0, 170.0])
def test_a_load_that_folds_is_factored(standard: MarginStandard, degrees: float) -> None:
    angle, force = math.radians(degrees), 0.3
    scene = ring(joints__vjoint=DRY, loads__force=-force)
    layout = [layout_of(scene, 0.5 * (math.pi - angle - by)) for by in (-1e-5, 1e-5)]
    pairs = [[each.pose(each.joints[joint].first).place[2] for joint, _ in each.forces]
             for each in layout]  # fmt: skip
    work = sum(push[2] * (z - y) / 2e-5 for (_, push), y, z in zip(
        layout[0].forces, *pairs, strict=True))  # fmt: skip
    expected = 6 * force * heights(scene, angle)
    assert -work == pytest.approx(expected, rel=1e-6)
    free = DriveMargin(scene.with_values({"loads": "none"}), standard).at(angle)
    found = DriveMargin(scene, standard).at(angle)
    assert found.resisting["loads"] == pytest.approx(expected, rel=1e-9)
    assert found.available == pytest.approx(free.available, rel=1e-12)
    friction = found.resisting["joint friction"]
    required = standard.motorisation * (standard.friction * friction + standard.load * expected)
    drive = (free.margin + 1.0) * standard.motorisation * standard.friction * friction
    assert found.margin == pytest.approx(drive / required - 1.0, rel=1e-9)


def test_the_factors_of_loads() -> None:
    """Those of prescribed forces: ECSS-E-ST-33-01C as of inertia, NASA-STD-5017B fixed."""
    assert (EcssMechanisms().load, NasaMechanisms().load) == (1.1, 1.5)


def test_what_opens_drives_and_what_folds_resists_section_by_section() -> None:
    angle = math.radians(80.0)
    forces = [0.2, -0.5, 0.2, 0.0, -0.1, 0.2]
    mixed = DriveMargin(ring(joints__vjoint=DRY, loads__force=forces), PLAIN).at(angle)
    free = DriveMargin(ring(joints__vjoint=DRY), PLAIN).at(angle)
    by_force = heights(ring(), angle)
    assert mixed.available - free.available == pytest.approx(0.6 * by_force, rel=1e-9)
    assert mixed.resisting["loads"] == pytest.approx(0.6 * by_force, rel=1e-9)
    drive = DriveMargin(ring(joints__vjoint=DRY, loads__force=0.3), PLAIN).at(angle)
    assert drive.resisting["loads"] == 0.0
    assert drive.available - free.available == pytest.approx(6 * 0.3 * by_force, rel=1e-9)


def test_a_ring_that_is_only_folded_has_no_drive() -> None:
    scene = ring(cables="none", loads__force=-0.3, joints__vjoint=DRY)
    assert DriveMargin(scene, PLAIN).at(1.5).margin == -1.0
