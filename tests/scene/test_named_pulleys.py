"""Pulleys and spans have names: ``section 6 V`` stands where section 6 has its V-joint."""

from __future__ import annotations

import numpy as np
import pytest
from click.testing import CliRunner
from loops import for_each

from ringsim.cable.records import BlockSheave
from ringsim.cli import cli
from ringsim.layout.bodies import pose_of
from ringsim.layout.layout import layout_of
from ringsim.overrides import field_at, with_names
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene, scene_from_toml

pytestmark = pytest.mark.quick

TRUSS = load_scene("truss2")
COEFFICIENT = "cables.upper.friction.coefficient"
NAMES = ("section 1 first hinge", "section 1 V", "section 1 second hinge",
         "section 2 first hinge", "section 2 V", "section 2 second hinge")  # fmt: skip


def with_fault(**fault: object) -> Scene:
    return TRUSS.with_values({"faults": [{"time": 1.0, **fault}]})


@for_each("end", ["first", "last", "both"])
def test_names_are_those_of_the_places(end) -> None:
    """V pulleys are the blocks at the section's V-joint; a section's first hinge is the one on
    the hinge assembly that it shares with the section before, also where the winch is last."""
    scene = load_scene("ring18-cable").with_values(
        {"structure.sections": 6, "cables.upper.end": end, "structure.aspect_ratio": 1.0}
    )
    layout = layout_of(scene)
    assert scene.cables is not None
    assert scene.cables.upper is not None
    path, names = layout.paths[0], scene.path_of(scene.cables.upper)
    assert len(path) == len(names) == scene.pulleys_of(scene.cables.upper) + 2
    assert names[0] == "winch"
    place = {}
    for sheave, name in zip(path, names, strict=True):
        word, number, *what = [*name.split(), "", ""]
        if word != "section":
            continue
        assert isinstance(sheave, BlockSheave) == (what[0] == "V")
        if isinstance(sheave, BlockSheave):
            # The joint of the upper plane that opens, in the section of that number.
            opening = layout.openings[0][int(number) - 1]
            joint = layout.joints[opening.joint]
            assert sheave.nodes == (joint.first, joint.second)
        else:
            frame = pose_of(sheave.node, layout.bodies, layout.rods)
            place[name] = frame.at(sheave.arm)[0]
    for k in range(1, 6):
        # Next to each other on one hinge assembly: apart by less than the two of any section.
        near = np.linalg.norm(place[f"section {k} second hinge"]
                              - place[f"section {k + 1} first hinge"])  # fmt: skip
        far = np.linalg.norm(place[f"section {k} second hinge"] - place[f"section {k} first hinge"])
        assert near < 0.5 * far


@for_each("end", ["first", "last", "both"])
def test_a_name_changes_its_own_value(end) -> None:
    base = TRUSS.with_values({"cables.upper.end": end})
    # As the docstring of Cables tells the path; seen from the last section it is reversed.
    order = NAMES[::-1] if end == "last" else NAMES
    for number, name in enumerate(order[:6] if end == "both" else order[:5], 1):
        named = base.with_values({f'{COEFFICIENT}["{name}"]': 0.002})
        assert named == base.with_values({f"{COEFFICIENT}[{number}]": 0.002})
        assert field_at(named, f"{COEFFICIENT}[{name}]") == 0.002


def test_shells_may_take_the_quotes_away() -> None:
    values = {f"{COEFFICIENT}[section 2 V]": 0.002}
    assert TRUSS.with_values(values).cables.upper.friction.coefficient[4] == 0.002
    settings = [f"--set={path}={value}" for path, value in values.items()]
    assert CliRunner().invoke(cli, ["check", "truss2", *settings]).exit_code == 0


def test_a_scene_names_them_in_a_table() -> None:
    text = TRUSS.to_toml().replace(
        "coefficient = 0.0004", 'coefficient = { default = 0.0004, "section 2 V" = 0.002 }', 1
    )
    scene = scene_from_toml(text, source="named")
    assert scene == TRUSS.with_values({f"{COEFFICIENT}[5]": 0.002})
    assert scene_from_toml(scene.to_toml(), source="written") == scene


def test_faults_name_them() -> None:
    jammed = with_fault(kind="jammed-pulley", cable=2, pulley="section 2 V")
    assert jammed == with_fault(kind="jammed-pulley", cable=2, pulley=5)
    for number, name in enumerate(TRUSS.span_names["upper"], 1):
        assert with_fault(kind="cut-cable", span=name) == with_fault(kind="cut-cable", span=number)
    assert "section 2 second hinge to section 3 first hinge" in load_scene(
        "ring18-cable"
    ).span_names["upper"]  # fmt: skip


@for_each(
    ("values", "words"),
    [
        ({f'{COEFFICIENT}["section 2 W"]': 0.002},
         f'{COEFFICIENT}["section 2 W"]: there is no pulley or span of that name (did you mean '
         '"section 2 V"?)'),
        # Its end, which holds the cable.
        ({f'{COEFFICIENT}["section 2 second hinge"]': 0.002},
         f'{COEFFICIENT}["section 2 second hinge"]: the cable is fixed there and has no pulley: '
         'the last pulley is "section 2 V"'),
        ({COEFFICIENT: {"default": 1e-4, "section 2 second hinge": 0.002}},
         f'{COEFFICIENT}."section 2 second hinge": the cable is fixed there'),
        ({"cables.upper.end": "last", f'{COEFFICIENT}["section 1 first hinge"]': 0.002},
         'fixed there and has no pulley: the last pulley is "section 1 V"'),
        ({"faults": [{"kind": "jammed-pulley", "time": 1.0, "pulley": "section 2 second hinge"}]},
         'faults[1].pulley = "section 2 second hinge": the cable is fixed there'),
        ({"faults": [{"kind": "cut", "time": 1.0}]},
         'faults[1].kind = "cut" is not an available kind (did you mean cut-cable?)'),
        ({f'{COEFFICIENT}["drum"]': 0.002}, 'the first is "section 1 first hinge"'),
        ({'rods.young_modulus["section 1"]': 1e11}, "or one with its section: name[1]"),
        ({COEFFICIENT: {"section 2 V": 0.002}},
            "coefficient.default is missing: give the value for all"),
        ({COEFFICIENT: {"default": 1e-4, "section 3 V": 0.002}},
         f'{COEFFICIENT}."section 3 V": there is no pulley or span of that name (did you mean'),
        ({COEFFICIENT: {"default": "x"}}, "must be a finite number in m"),
        ({"faults": [{"kind": "jammed-pulley", "time": 1.0, "pulley": "section 2 w"}]},
         'faults[1].pulley = "section 2 w": there is no pulley or span of that name (did you '
         'mean "section 2 V"?)'),
        ({"faults": [{"kind": "cut-cable", "time": 1.0, "span": "section 2 V"}]},
         'did you mean "section 2 V to second hinge"?'),
        ({"faults": [{"kind": "cut-cable", "time": 1.0, "cable": 3, "span": "section 2 V"}]},
         "faults[1].cable = 3 must be at most 2"),
        ({"faults": [{"kind": "cut-cable", "time": 1.0, "cable": "middle", "span": 2}]},
         'faults[1].cable = "middle" must be "upper", "lower", 1 or 2'),
        ({"cables": "none", "faults": [{"kind": "cut-cable", "time": 1.0, "span": "x"}]},
         "is a fault of a cable, but the scene has none"),
    ],
)  # fmt: skip
def test_unknown_names_are_refused(values, words) -> None:
    with pytest.raises(InputError) as refused:
        TRUSS.with_values(values)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@for_each("end", ["first", "last", "both"])
def test_faults_are_told_by_the_names_that_files_give_them(end) -> None:
    whole = TRUSS.with_values({"cables.lower.end": end})
    faults = [
        {"kind": "cut-cable", "cable": "lower", "span": whole.span_names["lower"][3]},
        {"kind": "jammed-pulley", "cable": "upper", "pulley": "section 1 V"},
        {"kind": "off-sheave", "cable": "lower", "pulley": "section 2 V"},
        {"kind": "stuck-vjoint", "plane": "lower", "section": 2},
    ]  # fmt: skip
    given = [{"time": 1.0, **fault} for fault in faults]
    scene = whole.with_values({"faults": given})
    table = scene.to_table()
    told = with_names(table)["faults"]
    for fault, words in zip(faults, told, strict=True):
        assert {key: words[key] for key in fault} == fault
    assert whole.with_values({"faults": told}) == scene
    for key, value in (("cable", 3), ("pulley", 99)):
        unknown = table["faults"][1] | {key: value}
        assert with_names(table | {"faults": [unknown]})["faults"][0][key] == value
    assert with_names({}) == {}


def test_a_key_of_another_fault_is_refused_with_the_keys_that_there_are() -> None:
    """A plane is that of a joint: of a rope its cable, which is the upper one if nobody says so."""
    wanted = r'leave it out.*; "jammed-pulley" has time, cable, pulley\)'
    with pytest.raises(InputError, match=wanted):
        with_fault(kind="jammed-pulley", plane="lower", pulley=2)


def test_explain_tells_the_names() -> None:
    told = CliRunner().invoke(cli, ["explain", "cables.lower.friction.coefficient"])
    assert told.exit_code == 0
    assert 'cables.lower.friction.coefficient["section 6 V"] = VALUE' in told.output


def test_names_do_not_depend_on_the_order_in_which_values_are_given() -> None:
    named = 'cables.upper.friction.coefficient["section 2 V"]'
    one, other = (
        {named: 0.003, "cables.upper.end": "last"},
        {"cables.upper.end": "last", named: 0.003},
    )
    scene = load_scene("truss2").with_values(one)
    assert scene == load_scene("truss2").with_values(other)
    # 5 pulleys from the winch at section 2: its second hinge is the first of them.
    assert scene.cables.upper.friction.coefficient.index(0.003) == 1


@pytest.mark.parametrize(
    ("values", "what"),
    [
        ({'cables.upper.friction.coefficient["section 2 V"]': 0.003}, "friction.coefficient"),
        ({"faults": [{"kind": "jammed-pulley", "time": 1.0, "pulley": "section 2 V"}]}, "faults"),
    ],
)
def test_pulleys_that_would_become_others_are_refused(values: dict, what: str) -> None:
    scene = load_scene("truss2").with_values(values)
    with pytest.raises(InputError, match=f"the values of .*{what} would move to other pulleys"):
        scene.with_values({"cables.upper.end": "last"})
    assert scene.with_values(
        {"cables.upper.end": "last"} | {"faults": [], "cables.upper.friction.coefficient": 0.001}
    )


def test_a_fault_of_the_other_cable_stays_where_it_is() -> None:
    fault = {"kind": "jammed-pulley", "cable": "lower", "time": 1.0, "pulley": "section 2 V"}
    scene = load_scene("truss2").with_values({"faults": [fault]})
    turned = scene.with_values({"cables.upper.end": "last"})
    assert turned.faults == scene.faults
