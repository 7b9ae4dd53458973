"""What ``--set PATH=VALUE`` means."""

import pytest
from click.testing import CliRunner
from loops import for_each

from ringsim.cli import cli
from ringsim.overrides import parse_assignment
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene

pytestmark = pytest.mark.quick

RING18 = load_scene("ring18")
BARE = Scene(name="bare")


def changed(scene: Scene, *assignments: str) -> Scene:
    return scene.with_values(dict(parse_assignment(text) for text in assignments))


@for_each(
    ("text", "value"),
    [
        ("a=3", 3), ("a=3.0", 3.0), ("a=-1e-3", -1e-3), ("a = 0.5 ", 0.5), ("a=true", True),
        ("a=[1.0, 2.0]", [1.0, 2.0]), ('a="word"', "word"), ("a='word'", "word"),
        ("a=word", "word"),
        ("a=geometrically-exact", "geometrically-exact"), ("a=none", "none"), ("a=x=y", "x=y"),
        ("a={ kind = 'rigid' }", {"kind": "rigid"}), ("a=1 2", "1 2"), ("a=1\nb=2", "1\nb=2"),
    ],
)  # fmt: skip
def test_value_is_toml_or_a_bare_word(text: str, value: object) -> None:
    path, parsed = parse_assignment(text)
    assert path == "a"
    assert parsed == value
    assert type(parsed) is type(value)


def test_one_value_is_replaced_and_nothing_else() -> None:
    scene = changed(RING18, "loads.force=0.02")
    assert scene.loads is not None
    assert scene.loads.force == 0.02
    assert scene.with_values({"loads.force": 0.015}) == RING18


def test_original_scene_stays_as_it_was() -> None:
    before = RING18.to_toml()
    changed(RING18, "loads.force=0.02", "boom=none", "rods.young_modulus[1]=1e11")
    assert RING18.to_toml() == before


def test_tables_that_are_given_stay_as_they_were() -> None:
    values = {"structure": {"kind": "pantograph-ring"}, "structure.sections": 6}
    assert RING18.with_values(values).structure.sections == 6
    assert values == {"structure": {"kind": "pantograph-ring"}, "structure.sections": 6}


@for_each("section", [1, 2, 18])
def test_sections_are_counted_from_one(section: int) -> None:
    scene = changed(RING18, f"rods.young_modulus[{section}]=1e11")
    expected = [120e9] * 18
    expected[section - 1] = 1e11
    assert scene.rods.young_modulus == tuple(expected)


def test_values_of_sections_add_up() -> None:
    scene = changed(RING18, "loads.force=0.01", "loads.force[1]=0.02", "loads.force[3]=0.03")
    assert scene.loads is not None
    assert scene.loads.force == (0.02, 0.01, 0.03) + (0.01,) * 15


def test_number_of_sections_set_before_counts() -> None:
    scene = changed(RING18, "structure.sections=6", "loads.force[6]=0.02")
    assert scene.loads is not None
    assert scene.loads.force == (0.015,) * 5 + (0.02,)
    with pytest.raises(InputError, match="from 1 to 6"):
        changed(RING18, "structure.sections=6", "loads.force[7]=0.02")


def test_net_of_an_open_arc_has_a_value_for_each_corner() -> None:
    scene = changed(
        RING18, "structure.closed=false", "structure.sections=2", "net.stiffness[3]=0.5"
    )
    assert scene.net is not None
    assert scene.net.stiffness == (0.001, 0.001, 0.5)


@for_each("part", ["boom", "net", "loads", "stop"])
def test_none_removes_a_part(part: str) -> None:
    assert getattr(changed(RING18, f"{part}=none"), part) is None
    assert getattr(RING18.with_values({part: None}), part) is None


def test_none_removes_a_part_that_is_not_there() -> None:
    assert changed(BARE, "boom=none") == BARE


def test_none_puts_the_default_of_a_plain_field_back() -> None:
    assert changed(RING18, "rods.damping=none").rods.damping == BARE.rods.damping
    assert RING18.rods.damping != BARE.rods.damping


def test_removed_part_comes_back_with_a_field() -> None:
    stop = changed(RING18, "stop=none", "stop.latch=true").stop
    assert stop is not None
    assert stop.latch


def test_field_of_a_missing_part_creates_it() -> None:
    scene = changed(BARE, "net.stiffness=0.5", "joints.hinge.viscous=0.1", "loads.force=1")
    assert scene.net is not None
    assert scene.joints.hinge is not None
    assert scene.loads is not None
    assert (scene.net.stiffness, scene.joints.hinge.viscous, scene.loads.force) == (0.5, 0.1, 1.0)


def test_missing_part_with_kinds_needs_its_kind() -> None:
    with pytest.raises(InputError, match=r"boom\.kind is missing"):
        changed(BARE, "boom.length=1.0")
    boom = changed(BARE, "boom.length=1.0", "boom.kind=rigid").boom
    assert boom is not None
    assert boom.length == 1.0


def test_kind_changes_and_keeps_the_common_fields() -> None:
    scene = changed(RING18, "rods.kind=ancf", "rods.elements=3")
    assert scene.rods.kind == "ancf"
    assert scene.rods.young_modulus == RING18.rods.young_modulus


def test_kind_changes_and_leaves_out_what_only_the_old_one_has() -> None:
    ring = load_scene("ring18-cable")
    path = "cables.upper.winch.winding"
    scene = changed(ring, f"{path}.kind=stall", f"{path}.max_tension=20.0")
    assert scene.cables is not None
    assert scene.cables.upper is not None
    winding = scene.cables.upper.winch.winding
    assert winding.model_dump(exclude_defaults=True) == {"speed": 0.12, "max_tension": 20.0}
    # In the other order it is the same, but what is given is never left out.
    assert changed(ring, f"{path}.max_tension=20.0", f"{path}.kind=stall") == scene
    with pytest.raises(InputError, match=r"winding\.duration is not a known"):
        changed(ring, f"{path}.duration=2.0", f"{path}.kind=stall", f"{path}.max_tension=20.0")


def test_table_takes_the_place_of_the_whole_part() -> None:
    scene = changed(RING18, 'stop={ kind = "spring-damper", stiffness = 50.0 }', "faults=[]")
    assert scene.stop is not None
    assert scene.stop.model_dump(exclude_defaults=True) == {"stiffness": 50.0}


@for_each("value", ["{ kind = 'rigid'", "[1.0, 2.0", "{ kind = rigid }"])
def test_broken_table_is_refused_as_such(value: str) -> None:
    with pytest.raises(InputError, match=r"--set boom = .*not a valid TOML table or list"):
        parse_assignment(f"boom={value}")


def test_what_is_long_is_told_short() -> None:
    with pytest.raises(InputError, match=r"^a\.a\.a.*\.\.\.: a path of more than 100 parts$"):
        changed(RING18, f"{'a.' * 5000}a=1")
    for text in ("x" * 9000, f"boom={'[' * 9000}"):
        with pytest.raises(InputError) as caught:
            parse_assignment(text)
        assert len(str(caught.value)) < 300


def test_a_misspelt_list_is_told_the_nearest() -> None:
    with pytest.raises(InputError, match=r"yuong_modulus yet: did you mean young_modulus\?"):
        changed(RING18, "rods.yuong_modulus[3]=1e11")


@for_each(
    "path",
    ["structure.sections", "structure.closed", "structure.opening_angle", "loads.force",
     "net.stiffness", "rods.kind", "rods.elements", "solver.step", "boom.base"],
)  # fmt: skip
def test_public_paths_exist(path: str) -> None:
    value: object = RING18
    for step in path.split("."):
        value = getattr(value, step)
    assert value is not None
    assert RING18.with_values({path: value}) == RING18


def test_command_line_applies_assignments_in_their_order() -> None:
    result = CliRunner().invoke(
        cli, ["check", "ring18", "--set", "structure.sections=6", "--set", "loads.force[6]=0.02"]
    )
    assert result.exit_code == 0, result.output
    assert "6 sections" in result.stdout


def test_two_parts_may_be_given_the_same_table() -> None:
    law = {"kind": "stall", "speed": 0.1, "max_tension": 5.0}
    values = {f"cables.{plane}.winch.winding": law for plane in ("upper", "lower")}
    scene = load_scene("truss2").with_values(values | {"cables.upper.winch.winding.speed": 0.2})
    assert scene.cables.upper.winch.winding.speed == 0.2
    assert scene.cables.lower.winch.winding.speed == 0.1
    assert law["speed"] == 0.1
