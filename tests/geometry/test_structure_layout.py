"""The layout: what a structure says of itself, against hand counts, differences and exudyn."""

from __future__ import annotations

from typing import Any, Literal

import exudyn as exu
import numpy as np
import pytest
from loops import for_each

from ringsim.cable.records import BarHalfBracket
from ringsim.exudyn.build import build
from ringsim.layout.bodies import InSpace, Lump, OnBody, Pose
from ringsim.layout.draft import Draft
from ringsim.layout.layout import Layout, layout_at_opening, layout_of
from ringsim.rigid.statics import OneCoordinate
from ringsim.scene import Scene, builtin_scenes, load_scene
from ringsim.structures.family import Structure

pytestmark = pytest.mark.quick

STEP = 1e-6
CLOSE = 1e-9
"""Central differences of places of the order of 1 m: STEP^2 and round-off over STEP."""


def poses(layout: Layout) -> list[Pose]:
    ends = [pose for rod in layout.rods for pose in (rod.start, rod.end)]
    return [*(body.pose for body in layout.bodies), *ends]


@pytest.mark.parametrize("name", builtin_scenes())
def test_rates_are_the_derivatives_of_places_and_axes(name: str) -> None:
    scene, q = load_scene(name), 0.9
    ahead, here, behind = (poses(layout_of(scene, q + by)) for by in (STEP, 0.0, -STEP))
    for after, pose, before in zip(ahead, here, behind, strict=True):
        np.testing.assert_allclose(pose.rate, (after.place - before.place) / 2 / STEP, atol=CLOSE)
        turned = (after.axes - before.axes) / 2.0 / STEP
        np.testing.assert_allclose(np.cross(pose.turn, pose.axes.T).T, turned, atol=CLOSE)


@pytest.mark.parametrize("name", builtin_scenes())
def test_joints_hold_together_at_every_coordinate(name: str) -> None:
    scene = load_scene(name)
    for q in (0.3, 0.8, 1.3):
        layout = layout_of(scene, q)
        for joint in layout.joints:
            if joint.kind == "revolute":
                one, other = layout.pose(joint.first), layout.pose(joint.second)
                np.testing.assert_allclose(one.place, other.place, atol=1e-14)
                np.testing.assert_allclose(one.rate, other.rate, atol=1e-14)
                np.testing.assert_allclose(one.axes[:, 2], other.axes[:, 2], atol=1e-14)


@pytest.mark.parametrize("name", builtin_scenes())
def test_opening_angles_follow_the_coordinate(name: str) -> None:
    scene = load_scene(name)
    for target in (0.5, 1.2):
        layout = layout_at_opening(scene, target)
        angles, rates = layout.opening_angles()
        np.testing.assert_allclose(angles, target, atol=1e-12)
        assert np.ptp(rates) < 1e-12
    if name != "planar-truss":  # delta = pi - 2 phi
        start = np.radians(scene.structure.opening_angle)  # type: ignore[attr-defined]
        np.testing.assert_allclose(layout_of(scene).opening_angles()[0], start, atol=1e-12)
        assert rates[0, 0] == pytest.approx(-2.0, abs=1e-12)


@pytest.mark.parametrize("name", builtin_scenes())
def test_mass_and_inertia_are_those_that_exudyn_integrates(name: str) -> None:
    """Kinetic energy of exudyn's own bodies and beams, moved as the layout says."""
    left_out = {"net": "none", "offload": "none"} if name.startswith("ring") else {}
    scene = load_scene(name).with_values(left_out)
    built = build(scene)
    model, layout = built.model, built.model.layout
    assembly = model.assembly
    q = scene.structure.coordinate
    motion = OneCoordinate(scene).motion(q)
    rates = np.zeros(assembly.system.systemData.ODE2Size())
    nodes = [(model.bodies[k][1], body.pose) for k, body in enumerate(layout.bodies)]
    for rod, built_rod in zip(layout.rods, model.rods, strict=True):
        stations = zip(rod.stations, built_rod.nodes, strict=True)
        nodes += [(node, rod.station(share)) for share, node in stations]
    for node, pose in nodes:
        moving = pose.rate - motion.velocity - np.cross(motion.rotation, pose.place)
        spin = pose.turn - motion.rotation
        own = assembly.coordinates_of(node)
        w, v = turn_of(pose.axes)
        rates[own[:3]] = moving
        rates[own[3:7]] = 0.5 * np.array([-spin @ v, *(w * spin + np.cross(spin, v))])
    data = assembly.system.systemData
    data.SetODE2Coordinates_t(rates, exu.ConfigurationType.Current)
    kinetic = sum(
        assembly.system.GetObjectOutputBody(body, exu.OutputVariableType.KineticEnergy)
        for body in assembly.bodies
    )
    # One linear element carries a rod's mass exactly; V-joints turn with no inertia of their own.
    assert kinetic == pytest.approx(0.5 * motion.inertia, rel=1e-6)


def turn_of(axes: Any) -> tuple[float, Any]:
    """Euler parameters (w, v) of axes that turn by less than half a turn."""
    w = 0.5 * np.sqrt(1.0 + np.trace(axes))
    skew = np.array([axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1]])
    return float(w), 0.25 * skew / w


def test_sheaves_of_both_brackets_stand_where_their_formulas_say() -> None:
    plain = load_scene("ring18-cable")
    held = {"kind": "bar-half", "angle": 100.0}
    scene = plain.with_values({"cables.upper.bracket": held})
    geometry, q = scene.structure.geometry(), scene.structure.coordinate  # type: ignore[attr-defined]
    for phi in (q, 0.7):
        layout, fold = layout_of(scene, phi), geometry.fold(phi)
        upper, lower = layout.paths
        assert (len(upper), len(lower)) == (1 + 3 * 18, 1 + 3 * 18)
        winch, first = layout.sheave(upper[0])[0], layout.sheave(upper[1])[0]
        np.testing.assert_allclose(winch - first, [0.0, 0.0, -0.3], atol=1e-14)
        bracket = BarHalfBracket(angle=100.0)
        aside, inward = bracket.place(phi, 0.105)
        for k, direction in enumerate(geometry.directions):
            place = fold.vjoints[0, k] + aside * direction - inward * np.array([0.0, 0.0, 1.0])
            np.testing.assert_allclose(layout.sheave(upper[2 + 3 * k])[0], place, atol=1e-13)
            block = fold.vjoints[1, k] + 0.105 * np.array([0.0, 0.0, 1.0])
            np.testing.assert_allclose(layout.sheave(lower[2 + 3 * k])[0], block, atol=1e-13)


class Stretching(Structure):
    """Its rod would have to grow."""

    kind: Literal["stretching"] = "stretching"

    def layout(self, scene: Any, coordinate: Any) -> Layout:
        draft = Draft(scene)
        ends = np.zeros(3), np.array([1.0 + coordinate, 0.0, 0.0])
        draft.rod("rod", 0, "rods", ends, np.array([0.0, 0.0, 1.0]), scene.rods.bar, [0, 1], 1e9)
        return draft.finish()


class Parting(Structure):
    """Its joint stands on a body that does not come along."""

    kind: Literal["parting"] = "parting"

    def layout(self, scene: Any, coordinate: Any) -> Layout:
        draft = Draft(scene)
        lump = Lump("mass", 1.0, np.zeros(3), np.eye(3))
        one = draft.body(np.zeros(3), [lump])
        place = np.array([coordinate, 0.0, 0.0])
        other = draft.body(place, [lump])
        draft.joint("revolute", "hinge", 0, (one, other), place)
        return draft.finish()


class Skewed(Structure):
    """Its body's axes are no unit vectors."""

    kind: Literal["skewed"] = "skewed"

    def layout(self, scene: Any, coordinate: Any) -> Layout:
        draft = Draft(scene)
        lump = Lump("mass", 1.0, np.zeros(3), np.eye(3))
        one = draft.body(np.zeros(3), [lump])
        other = draft.body(np.zeros(3), [lump], 2.0 * np.eye(3))
        draft.joint("revolute", "hinge", 0, (one, other), np.array([1.0, 0.0, 0.0]))
        return draft.finish()


@pytest.mark.parametrize(
    ("structure", "wanted"),
    [
        (Stretching(), "rod of section 1 changes its length"),
        (Parting(), "a hinge is 1 m away"),
        (Skewed(), "a hinge is 3 m away"),
    ],
)
def test_a_structure_that_cannot_be_is_refused(structure: Structure, wanted: str) -> None:
    plain = load_scene("ring18").with_values(
        {"boom": "none", "net": "none", "loads": "none", "stop": "none"}
    )
    scene: Scene = plain.model_copy(update={"structure": structure})
    with pytest.raises(ValueError, match=wanted):
        layout_of(scene, 0.5)


class Bare(Structure):
    """One body on a support: no corners, no track."""

    kind: Literal["bare"] = "bare"
    sections: int = 1
    swapped: bool = False

    def layout(self, scene: Any, coordinate: Any) -> Layout:
        draft = Draft(scene)
        body = draft.body(np.zeros(3), [Lump("mass", 1.0, np.zeros(3), np.eye(3))])
        parts = (body, None) if self.swapped else (None, body)
        draft.joint("weld", "", 0, parts, np.zeros(3))
        return draft.finish()


def with_bare(parts: dict[str, Any], *, swapped: bool = False) -> Layout:
    scene = load_scene("ring18").with_values(
        {"boom": "none", "net": "none", "loads": "none", "stop": "none"}
    )
    update = {"structure": Bare(swapped=swapped), **parts}
    return layout_of(scene.model_copy(update=update), 0.5)


@for_each(
    ("part", "wanted"),
    [
        ("boom", r'boom: this structure has no corners .* 2 of its planes.*\(boom = "none"\)'),
        ("net", r'net: this structure has no corners .* 1 of its planes.*\(net = "none"\)'),
        ("cables", r"no cable path in plane 1: leave the cable out, or add a path to Draft.tracks"),
    ],
)
def test_what_a_structure_cannot_hold_is_refused(part: str, wanted: str) -> None:
    given = getattr(load_scene("ring18-cable" if part == "cables" else "ring18"), part)
    assert given is not None
    with pytest.raises(ValueError, match=wanted):
        with_bare({part: given})


@pytest.mark.parametrize("swapped", [False, True])
def test_space_comes_first_however_a_support_is_named(swapped: bool) -> None:
    (support,) = with_bare({}, swapped=swapped).supports
    assert isinstance(support.first, InSpace)
    assert isinstance(support.second, OnBody)
