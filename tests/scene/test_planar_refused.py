"""What does not go with a planar truss is refused in one line that names field and cure."""

from __future__ import annotations

from typing import Any

import pytest
from loops import for_each

from ringsim.refusal import InputError
from ringsim.scene import load_scene

pytestmark = pytest.mark.quick

SCENE = load_scene("planar-truss")
BAD: list[tuple[dict[str, Any], tuple[str, ...]]] = [
    ({"structure.strut_head": 0.7}, ("strut_head = 0.7 m", "beam_length = 0.627 m")),
    ({"structure.strut_foot": 0.8}, ("strut_foot = 0.8 m", "axis_length = 0.72 m")),
    ({"structure.cable_length": 0.09}, ("cable_length = 0.09 m", "at the rest")),
    ({"structure.cable_length": 1.4}, ("cable_length = 1.4 m", "1.347 m")),
    ({"structure.rest.buffer": 0.7}, ("rest.buffer = 0.7 m",)),
    ({"structure.strut_tube_length": 0.15}, ("strut_tube_length = 0.15 m", "part")),
    ({"structure.strut_tube_length": 0.45}, ("strut_tube_length = 0.45 m", "at most 0.2636 m")),
    ({"structure.strut_inner.outer_diameter": 0.0301}, ("strut_inner", "rods.diagonal")),
    ({"structure.sections": 2}, ("sections",)),
    ({"stop.stiffness": 100.0}, ("stop", "none")),
    ({"boom.kind": "rigid"}, ("boom", "none")),
    ({"net.stiffness": 0.1}, ("net", "none")),
    ({"loads.force": 0.1}, ("loads", "none")),
    ({"joints.hinge.viscous": 0.1}, ("joints",)),
    ({"cables": "none"}, ("cables.upper",)),
    ({"cables.upper.end": "last"}, ("cables.upper.end", '"first"')),
    ({"cables.upper.block_offset": 0.3}, ("cables.upper.block_offset", "leave it out")),
    ({"cables.upper.bracket": {"kind": "bar-half", "angle": 100.0}}, ("cables.upper.bracket",)),
    ({"cables.upper.winch.after_lock": "hold"}, ("cables.upper.winch.after_lock",)),
    ({"hinge_spring": {"kind": "linear", "stiffness": 0.1}}, ("hinge_spring", "none")),
    ({"solver.step_control": "motion"}, ("solver.step_control", '"constant"')),
    ({"faults": [{"kind": "cut-cable", "time": 1.0, "span": 1}]}, ("faults",)),
    ({"rods.kind": "ancf"}, ("rods.kind", '"geometrically-exact"')),
    (
        {"cables.upper.friction": {"kind": "bearing", "coefficient": [1e-4, 1e-4]}},
        ("coefficient has 2 values", "needs 1"),
    ),
]


@for_each(("values", "named"), BAD, ids=[next(iter(v)) + str(k) for k, (v, _) in enumerate(BAD)])
def test_refused_in_one_line(values: dict[str, Any], named: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as refused:
        SCENE.with_values(values)
    line = str(refused.value)
    assert line.isprintable()
    for word in named:
        assert word in line


def test_a_second_cable_is_refused() -> None:
    lower = SCENE.to_table()["cables"]["upper"]
    with pytest.raises(InputError, match=r"cables\.upper"):
        SCENE.with_values({"cables.lower": lower})


def test_the_scene_survives_being_written() -> None:
    assert SCENE.with_values({}) == SCENE
