"""A scene written as TOML and read back is the same scene, to the last bit."""

import struct
import tomllib
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from loops import for_each

from ringsim.scene import Scene, builtin_scenes, scene_from_table, scene_from_toml


def maybe(part: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    return st.none() | part


def tube(thickest: float) -> st.SearchStrategy[dict[str, float]]:
    return st.floats(1e-3, thickest).flatmap(
        lambda outer: st.fixed_dictionaries(
            {"outer_diameter": st.just(outer), "inner_diameter": st.floats(0.0, 0.99 * outer)}
        )
    )


@st.composite
def scene_tables(draw: st.DrawFn) -> dict[str, Any]:
    """Tables of valid scenes, with and without each part."""
    closed = draw(st.booleans())
    sections = draw(st.integers(3, 20) if closed else st.integers(1, 20))
    half_diagonal = draw(st.floats(0.1, 10.0))
    half_bar = half_diagonal * draw(st.floats(0.3, 0.99))

    def each(low: float, high: float, count: int = sections) -> Any:
        value = st.floats(low, high)
        return draw(value | st.lists(value, min_size=count, max_size=count))

    def friction() -> Any:
        return draw(
            maybe(
                st.fixed_dictionaries(
                    {},
                    optional={
                        "viscous": st.floats(0.0, 10.0),
                        "coulomb": st.lists(st.floats(0.0, 1.0), min_size=sections,
                                            max_size=sections),
                        "rate": st.floats(1e-6, 1.0),
                    },
                )
            )
        )  # fmt: skip

    opening = draw(st.floats(1.0, 179.0))
    table: dict[str, Any] = {
        "name": draw(st.from_regex(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,20}", fullmatch=True)),
        "title": draw(st.text(st.characters(codec="utf-8"), max_size=40)),
        "structure": {
            "kind": "pantograph-ring",
            "sections": sections,
            "closed": closed,
            "polygon_sections": draw(st.integers(21, 60)),
            "aspect_ratio": draw(st.floats(0.3, 1.0)),
            "half_diagonal": half_diagonal,
            "half_bar": half_bar,
            "hinge_offset": half_bar * draw(st.floats(0.0, 0.99)),
            "opening_angle": opening,
        },
        "rods": {
            "kind": draw(st.sampled_from(["ancf", "geometrically-exact"])),
            "young_modulus": each(1e9, 1e12),
            "diagonal": draw(tube(0.02)),
            "elements": draw(st.integers(1, 8)),
        },
        "joints": {"pivot": friction(), "hinge": friction(), "vjoint": friction()},
        "stop": draw(
            st.just("none")
            | st.fixed_dictionaries(
                {"latch": st.booleans(), "stowed_angle": st.floats(0.0, 0.99 * opening)}
            )
        ),
        "boom": draw(
            maybe(
                st.fixed_dictionaries(
                    {
                        "kind": st.sampled_from(["rigid", "flexible"]),
                        "base": st.sampled_from(["free", "fixed"]),
                        "length": st.floats(20.0, 100.0),
                    }
                )
            )
        ),
        "net": draw(maybe(st.fixed_dictionaries({"neutral_length": st.floats(0.1, 5.0)}))),
        "loads": {"force": each(-1e3, 1e3)} if draw(st.booleans()) else None,
        "record": {"stress": draw(st.booleans()), "interval": draw(st.floats(0.01, 1.0))},
    }
    if table["rods"]["kind"] == "ancf":
        table["record"]["stress"] = False
    if table["net"] is not None:
        table["net"]["stiffness"] = each(0.0, 1e3, sections if closed else sections + 1)
    return without_none(table)


def without_none(table: dict[str, Any]) -> dict[str, Any]:
    return {
        key: without_none(value) if isinstance(value, dict) else value
        for key, value in table.items()
        if value is not None
    }


def bits(value: Any) -> Any:
    """The value with every float as its bytes, so that -0.0 and 0.0 differ."""
    match value:
        case dict():
            return {key: bits(each) for key, each in value.items()}
        case list() | tuple():
            return [bits(each) for each in value]
        case float():
            return struct.pack("<d", value)
        case _:
            return value


@given(scene_tables())
def test_any_scene_survives_toml(table: dict[str, Any]) -> None:
    """What was given is in it, what was left out stays out, and replacing nothing changes nothing.

    All of it of the same scenes: to draw and to read one takes longer than to look at it.
    """
    scene = scene_from_table(table, source="drawn")
    text = scene.to_toml()
    again = scene_from_toml(text, source="written")
    assert again == scene
    assert bits(again.to_table()) == bits(scene.to_table())
    assert again.to_toml() == text

    def inside(part: dict[str, Any], whole: dict[str, Any]) -> None:
        for key, value in part.items():
            if isinstance(value, dict):
                inside(value, whole[key])
            else:
                assert bits(whole[key]) == bits(value)

    inside(table, tomllib.loads(text))
    for part in ("boom", "net", "loads"):
        assert (getattr(again, part) is None) == (part not in table)
    assert (again.stop is None) == (table["stop"] == "none")
    for family in ("pivot", "hinge", "vjoint"):
        assert (getattr(again.joints, family) is None) == (family not in table["joints"])
    assert scene.with_values({}) == scene


@for_each("name", builtin_scenes())
def test_built_in_scenes_are_named_after_their_file_and_survive_toml(name: str) -> None:
    scene = scene_from_toml(builtin_scenes()[name], source=name)
    assert scene.name == name
    assert scene.title
    assert scene_from_toml(scene.to_toml(), source=name) == scene


@for_each("name", builtin_scenes())
def test_kind_is_the_first_line_of_its_table(name: str) -> None:
    table = scene_from_toml(builtin_scenes()[name], source=name).to_table()
    assert next(iter(table["structure"])) == next(iter(table["rods"])) == "kind"


def test_smallest_scene_is_a_name() -> None:
    scene = Scene(name="bare")
    assert (scene.boom, scene.net, scene.loads) == (None, None, None)
    assert scene.stop is not None
