"""Ground tests: what a suspension carries, in both engines."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from numeric_tangent import Probe, error
from ringsim.exudyn.integrate import solve as by_exudyn
from ringsim.frame.integrate import solve as by_frames
from ringsim.layout.layout import layout_of
from ringsim.parts.ground import Offload
from ringsim.rigid.statics import OneCoordinate
from ringsim.scene import Scene
from test_base_reaction import ring

DOWN = {"gravity.vector": [0.0, 0.0, -9.81]}
EVERYTHING = {
    "stiffness": 2.0, "residual": 0.02, "friction": 0.01, "friction_speed": 0.02,
    "trolley_mass": 0.05,
}  # fmt: skip


def ground(offload: dict[str, Any], **values: Any) -> Scene:
    return ring(**values).with_values(DOWN | {"offload": offload})


def points(**values: Any) -> dict[str, Any]:
    """All mass in the corners: 7e-9 kg are left in rods of the least density."""
    return {"boom": "none", "rods__density": 1e-3, "structure__vjoint_mass": 0.0, **values}


def test_a_suspension_of_every_mass_point_is_flight() -> None:
    """Uneven forces, so that sections deviate, and a weight of many times the loads.  What is left
    is that of the rods, a millionth, between the corners.
    """
    uneven = points(loads__force=[0.05, 0.06, 0.04, 0.055], solver__end_time=0.5)
    flight = by_frames(ring(**uneven)).values
    tested = by_frames(ground({"planes": "both"}, **uneven)).values
    bounds = {"opening_angle": 1e-7, "asynchrony": 3e-4, "kinetic_energy": 1e-6, "work": 1e-6}
    for name, bound in bounds.items():
        largest = np.nanmax(np.abs(flight[name]))
        assert np.nanmax(np.abs(tested[name] - flight[name])) < bound * largest, name


def test_lines_carry_the_whole_weight() -> None:
    """All of it on a free ring; on a held one all but the share of the base's corner."""
    for planes, base, kind in (
        ("upper", "free", "rigid"), ("both", "free", "rigid"), ("both", "fixed", "rigid"),
        ("both", "free", "flexible"),
    ):  # fmt: skip
        layout = layout_of(ground({"planes": planes}, boom={"kind": kind, "base": base}))
        assert layout.hung is not None
        whole = 9.81 * sum(layout.masses().values())
        own = 9.81 * layout.bodies[0].mass
        hung = layout.corners if planes == "both" else layout.corners[:1]
        rest = whole - sum(9.81 * layout.bodies[k].mass for plane in hung for k in plane)
        lines = 4 if planes == "upper" else 8
        expected = whole if base == "free" else whole - own - rest / lines
        assert layout.hung.lifts.sum() == pytest.approx(expected, rel=1e-12)
        assert len(layout.hung.bodies) == (lines if base == "free" else lines - 1)


def test_a_balanced_ring_starts_as_in_flight() -> None:
    """Upper corners keep their height; the weight of the others sinks or rises, by hand."""
    scene = ground({"planes": "both"}, **points())
    flight = ring(**points())
    q = scene.structure.coordinate
    assert OneCoordinate(scene).work_rate(q) == pytest.approx(
        OneCoordinate(flight).work_rate(q), rel=1e-6
    )


@pytest.mark.parametrize("base", ["fixed", "free"])
def test_engines_agree(base: str) -> None:
    """With equal steps and rods."""
    scene = ground(
        EVERYTHING | {"planes": "both", "corners": [2, 3, 4]} if base == "fixed" else EVERYTHING,
        boom__base=base, solver__newton_tolerance=1e-7, solver__end_time=0.5,
    )  # fmt: skip
    here, there = by_frames(scene), by_exudyn(scene)
    assert not here.status.failed, here.reason
    assert not there.status.failed, there.reason
    for name in ("opening_angle", "work", "kinetic_energy", "dissipation", "base_rotation"):
        one, other = here.values[name], there.values[name]
        largest = np.nanmax(np.abs(other))
        assert np.nanmax(np.abs(one - other)) <= 2e-3 * largest, name
    # Rods that are let go under their weight ring, which steps of 10 ms damp in both alike.
    errors = [float(each.values["energy_error"]) for each in (here, there)]
    assert errors[0] == pytest.approx(errors[1], rel=1e-2)
    assert errors[0] < 0.05


def test_tangent() -> None:
    """Lines, springs, trolleys and their friction, and weight on arms."""
    for base in ("free", "fixed"):
        scene = ground(EVERYTHING | {"planes": "both", "friction": 0.5}, boom__base=base)
        assert error(Probe(scene, 1e-9, time=1e-2, step=1e-2)) < 1e-5


def test_a_trolley_rubs_along_the_grid() -> None:
    """friction * tension against a motion far faster than friction_speed; none up and down."""
    law = Offload.model_validate({"friction": 0.1, "stiffness": 5.0, "friction_speed": 1e-6})
    up, lifts = np.array([0.0, 0.0, 1.0]), np.array([3.0])
    hold = law.hold(up, lifts, np.array([[0.2, 0.0, -0.1]]), np.array([[0.3, -0.4, 2.0]]))
    tension = 3.0 + 5.0 * 0.1
    assert hold.friction[0] == pytest.approx(-0.1 * tension * np.array([0.6, -0.8, 0.0]), rel=1e-9)
    assert hold.force[0, 2] == pytest.approx(tension)
    assert hold.stored == pytest.approx(0.5 * 5.0 * 0.1**2)


@pytest.mark.parametrize("lift", [30.0, -0.77])
def test_a_trolley_brakes_whichever_way_its_line_pulls(lift: float) -> None:
    """A line with a stiffness may push; its trolley takes energy all the same, and the tangent is
    that of differences.
    """
    law, up = Offload(stiffness=10.0, friction=0.2, friction_speed=0.05), np.array([0.0, 0.0, 1.0])
    lifts, rate_by_place, step = np.array([lift]), 200.0, 1e-6
    moved, rates = np.array([[0.01, 0.02, 0.03]]), np.array([[0.03, -0.04, 0.1]])
    hold = law.hold(up, lifts, moved, rates)
    assert float(hold.friction[0] @ rates[0]) < 0.0
    found = law.slopes(up, lifts, moved, rates, rate_by_place)[0]
    for axis in range(3):
        by = step * np.eye(3)[axis]
        ahead, behind = (
            law.hold(up, lifts, moved + s * by, rates + s * rate_by_place * by).force[0]
            for s in (1.0, -1.0)
        )
        np.testing.assert_allclose(
            found[:, axis], (ahead - behind) / (2.0 * step), rtol=1e-5, atol=1e-5
        )
