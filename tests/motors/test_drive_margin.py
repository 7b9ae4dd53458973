"""The margin of a drive: virtual work on the rigid ring, factors, and what a run tells of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from loops import for_each
from pydantic import ValidationError

from motor_rings import MOTOR, PLAIN, STALL, ring
from ringsim.layout.layout import layout_of
from ringsim.parts.margin import EcssMechanisms, MarginStandard, NasaMechanisms
from ringsim.refusal import InputError
from ringsim.rigid.margin import PULLEYS, DriveMargin, PlaneMargin
from ringsim.scene import Scene, load_scene

ANGLES = np.radians([62.0, 90.0, 130.0, 170.0, 179.0])
STEP = 1e-4


def by_differences(read, angle):
    """Derivative of what is read after the opening angle, of fourth order."""
    far = [read(angle + by * STEP) for by in (-2, -1, 1, 2)]
    return (far[0] - 8.0 * far[1] + 8.0 * far[2] - far[3]) / (12.0 * STEP)


def spans(scene: Scene, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Lengths of the spans of all cables, and angles at their pulleys, from the layout alone."""
    layout = layout_of(scene, 0.5 * (math.pi - angle))
    lengths, turns = [], []
    for path in layout.paths:
        places = np.array([layout.sheave(each)[0] for each in path])
        along = np.diff(places, axis=0)
        lengths.append(np.linalg.norm(along, axis=1))
        units = along / lengths[-1][:, None]
        turns.append(np.pi - np.arccos(np.einsum("ij,ij->i", units[:-1], units[1:])))
    return np.array(lengths), np.array(turns)


def driven(scene: Scene, angle: float, ratio: float) -> float:
    """Virtual work of both cables with f / R at every pulley (paper 000, eq. 19)."""
    shortening = -by_differences(lambda at: spans(scene, at)[0], angle)
    cosine = np.cos(0.5 * spans(scene, angle)[1])
    eta = (1.0 - ratio * cosine) / (1.0 + ratio * cosine)
    tension = STALL * np.cumprod(np.insert(eta, 0, 1.0, axis=1), axis=1)
    return float(np.sum(tension * shortening))


@pytest.mark.parametrize("standard", [PLAIN, EcssMechanisms(), NasaMechanisms()])
def test_the_margin_of_known_friction_is_that_of_virtual_work(standard: MarginStandard) -> None:
    scene = ring(
        joints__vjoint={"coulomb": 0.01, "viscous": 0.5}, joints__pivot={"coulomb": 0.02},
        net__stiffness=5.0, net__neutral_length=0.3,
    )  # fmt: skip
    found = DriveMargin(scene, standard)
    for angle in ANGLES:
        now = found.at(angle)
        # Diagonals cross at twice the angle theta with d cos(theta) = l cos(phi).
        pivot = by_differences(
            lambda at: 2.0 * np.arccos(0.2889 / 0.4275 * np.sin(0.5 * at)), angle
        )
        friction = 12 * 0.01 + 6 * 0.02 * abs(pivot)
        radius = 2.0 * (0.2889 * np.sin(0.5 * angle) + 0.006554)
        net = 6 * 5.0 * max(radius - 0.3, 0.0) * 0.2889 * np.cos(0.5 * angle)
        assert now.resisting["joint friction"] == pytest.approx(friction, rel=1e-6)
        assert now.resisting["net"] == pytest.approx(net, rel=1e-6)
        assert now.resisting["inertia"] == 0.0
        frictionless, usual = driven(scene, angle, 0.0), driven(scene, angle, 0.04)
        assert now.available == pytest.approx(frictionless, rel=1e-6)
        assert now.resisting[PULLEYS] == pytest.approx(frictionless - usual, rel=1e-6)
        required = standard.motorisation * (standard.friction * friction + standard.spring * net)
        gear = 1.0 / (1.0 + standard.friction * (1.0 / 0.6 - 1.0))
        drive = driven(scene, angle, 0.04 * standard.friction) * gear / 0.6
        assert now.margin == pytest.approx(drive / required - 1.0, rel=1e-6)


def test_factors_are_those_of_the_clauses() -> None:
    """ECSS-E-ST-33-01C 4.7.5.3 and, second-hand, NASA-STD-5017B, as the project has noted them."""
    ecss, nasa = EcssMechanisms(), NasaMechanisms()
    assert (ecss.motorisation, ecss.inertia, ecss.spring, ecss.friction) == (2.0, 1.25, 1.2, 3.0)
    assert ecss.driving_spring == 0.8
    assert (nasa.motorisation, nasa.inertia, nasa.spring, nasa.friction) == (1.0, 1.25, 1.5, 3.0)


def test_pulleys_that_hold_any_tension_leave_no_drive() -> None:
    """Three times f = 0.4 R is more than R: the bearings lock where the rope turns round."""
    rough = {"kind": "bearing", "coefficient": 0.004}
    scene = ring(cables__upper__friction=rough, cables__lower__friction=rough,
                 joints__vjoint__coulomb=0.01)  # fmt: skip
    now = DriveMargin(scene, NasaMechanisms()).at(math.radians(62.0))
    assert now.margin == pytest.approx(-1.0, abs=0.1)


def test_two_winches_pull_each_its_half() -> None:
    """The rope rests in the middle: each half is a chain of its own, of 9 of the 19 spans."""
    scene = ring(cables__upper__end="both", cables__lower__end="both", joints__vjoint__coulomb=0.01)
    angle = ANGLES[1]
    shortening = -by_differences(lambda at: spans(scene, at)[0], angle)
    ratio = 0.04 * np.cos(0.5 * spans(scene, angle)[1])
    eta = np.insert((1.0 - ratio) / (1.0 + ratio), 0, 1.0, axis=1)
    one = np.cumprod(eta, axis=1)
    other = np.cumprod(np.insert(eta[:, :0:-1], 0, 1.0, axis=1), axis=1)[:, ::-1]
    drive = STALL * np.sum(np.maximum(one, other) * shortening)
    found = DriveMargin(scene, PLAIN).at(angle)
    assert found.available - found.resisting[PULLEYS] == pytest.approx(drive, rel=1e-6)


def test_a_commanded_speed_leaves_less_torque_and_counts_viscous_friction() -> None:
    quick = {f"cables.{plane}.winch.winding": MOTOR | {"speed": 300.0} for plane in
             ("upper", "lower")}  # fmt: skip
    scene = ring(joints__vjoint={"viscous": 0.5}).with_values(quick)
    angle = ANGLES[2]
    slow = DriveMargin(scene, PLAIN).at(angle)
    assert slow.resisting["joint friction"] == 0.0
    assert slow.available == pytest.approx(driven(scene, angle, 0.0), rel=1e-6)
    assert slow.margin == np.inf
    found = DriveMargin(scene, PLAIN.model_copy(update={"keep_speed": True})).at(angle)
    shortening = -by_differences(lambda at: spans(scene, at)[0][0].sum(), angle)
    rate = 300.0 * 1e-4 / shortening
    assert found.resisting["joint friction"] == pytest.approx(12 * 0.5 * rate, rel=1e-6)
    assert found.available == pytest.approx(0.5 * driven(scene, angle, 0.0), rel=1e-6)


def test_each_plane_has_its_own_cable_against_half_of_all_that_resists() -> None:
    weak = {"cables.lower.winch.winding": MOTOR | {"stall_torque": 0.0005}}
    scene = ring(joints__vjoint={"coulomb": 0.05}, loads__force=0.1).with_values(weak)
    planes = [PlaneMargin(DriveMargin(scene, PLAIN), number) for number in (0, 1)]
    for angle in ANGLES[1:3]:
        shortening = -by_differences(lambda at: spans(scene, at)[0], angle)
        cosine = 0.04 * np.cos(0.5 * spans(scene, angle)[1])
        eta = np.insert((1.0 - cosine) / (1.0 + cosine), 0, 1.0, axis=1)
        pulls = STALL * np.array([1.0, 0.25])
        drives = pulls * np.sum(np.cumprod(eta, axis=1) * shortening, axis=1)
        whole = DriveMargin(scene, PLAIN).at(angle)
        loads = whole.available - float(pulls @ shortening.sum(axis=1))
        assert loads > 0.05
        for plane, drive in zip(planes, drives, strict=True):
            found = plane.at(angle)
            expected = (drive + 0.5 * loads) / (0.5 * 12 * 0.05) - 1.0
            assert found.margin == pytest.approx(expected, rel=1e-6)
        halves = [plane.at(angle) for plane in planes]
        assert sum(half.available for half in halves) == pytest.approx(whole.available)
        assert np.mean([half.margin for half in halves]) == pytest.approx(whole.margin)


def test_the_least_margin_is_least() -> None:
    scene = ring(joints__vjoint={"coulomb": 0.01}, net__stiffness=40.0, net__neutral_length=0.4)
    drive = DriveMargin(scene, PLAIN)
    least = drive.least()
    fine = min(drive.course(400), key=lambda each: each.margin)
    assert least.margin <= fine.margin
    assert least.angle == pytest.approx(fine.angle, abs=math.radians(120.0 / 400))
    assert least.margin == pytest.approx(fine.margin, rel=1e-4)


@for_each(
    ("values", "text"),
    [
        ({"cables.upper.winch.winding": {"kind": "constant", "speed": 0.1}},
         r"cables.upper.winch.winding.kind = .constant.: its force is not limited.* leave margin"),
        ({"cables": "none"}, "nothing drives the ring"),
        ({"margin": {"kind": "ecss"}}, "margin.kind"),
        ({"margin.friction": -1.0}, "margin.friction"),
        ({"margin.motorisation": 0.5}, "margin.motorisation"),
    ],
)  # fmt: skip
def test_a_margin_that_cannot_be_told_is_refused(values: dict[str, object], text: str) -> None:
    scene = ring(margin=PLAIN.model_dump())
    with pytest.raises((InputError, ValidationError), match=text):
        scene.with_values(values)


def test_other_structures_have_no_margin() -> None:
    scene = load_scene("planar-truss")
    with pytest.raises(InputError, match=r"structure.kind = .planar-truss."):
        DriveMargin(scene, PLAIN)
    with pytest.raises(InputError, match=r"margin: structure.kind = .planar-truss. has"):
        scene.with_values({"margin": PLAIN.model_dump(), "cables.upper.winch.winding": MOTOR})


@pytest.mark.parametrize(("standard", "factor"), [(EcssMechanisms(), 3.0), (PLAIN, 1.0)])
def test_losses_of_gears_take_the_factor_of_friction(
    standard: EcssMechanisms, factor: float
) -> None:
    """A gear of efficiency e takes T (1 / e - 1) of what comes in for T that goes out."""
    margins = []
    for efficiency in (1.0, 0.6):
        winding = MOTOR | {"efficiency": efficiency}
        scene = ring(
            cables__upper__friction={"kind": "none"}, cables__lower__friction={"kind": "none"},
            cables__upper__winch__winding=winding, cables__lower__winch__winding=winding,
            joints__vjoint={"coulomb": 0.01},
        )  # fmt: skip
        margins.append(DriveMargin(scene, standard).at(1.5).margin)
    left = 1.0 / (1.0 + factor * (1.0 / 0.6 - 1.0))
    assert (margins[1] + 1.0) / (margins[0] + 1.0) == pytest.approx(left, rel=1e-12)


def test_inertia_at_a_commanded_speed_is_no_part_of_what_motorisation_multiplies() -> None:
    """ECSS-E-ST-33-01C: 2 (3 F_R) + 1.25 F_D."""
    standard = EcssMechanisms(keep_speed=True)
    winding = MOTOR | {"speed": 300.0}
    scene = ring(
        cables__upper__friction={"kind": "none"}, cables__lower__friction={"kind": "none"},
        cables__upper__winch__winding=winding, cables__lower__winch__winding=winding,
        joints__vjoint={"viscous": 1e-3},
    )  # fmt: skip
    drive = DriveMargin(scene, standard)
    rows = [drive.at(angle) for angle in (1.2, 1.8, 2.4, 3.0)]
    assert max(now.resisting["inertia"] for now in rows) > 0.0
    for now in rows:
        friction, inertia = now.resisting["joint friction"], now.resisting["inertia"]
        assert now.required == pytest.approx(2.0 * 3.0 * friction + 1.25 * inertia, rel=1e-12)
