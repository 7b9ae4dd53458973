"""Whatever a table holds, only InputError may come out, and its text is one line."""

import string
from datetime import UTC, date, datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from loops import for_each

from ringsim.overrides import parse_assignment
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene, scene_from_table, scene_from_toml

RING18 = load_scene("ring18")

VALUES = st.recursive(
    st.one_of(
        st.none(),
        st.booleans(),
        st.integers(),
        st.sampled_from([10**400, -(10**400), 2**63, 0, 1, 18]),
        st.floats(),
        st.text(max_size=20),
        st.sampled_from(["none", "rigid", "flexible", "ancf", "pantograph-ring", "nan", ""]),
        st.just(date(2026, 11, 21)),
        st.just(datetime(2026, 11, 21, tzinfo=UTC)),
    ),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.text(max_size=8) | st.sampled_from(["kind", "tube"]), inner, max_size=4
        )
    ),
    max_leaves=12,
)


def paths_of(table: dict[str, Any], prefix: str = "") -> list[str]:
    found = []
    for key, value in table.items():
        found.append(prefix + key)
        if isinstance(value, dict):
            found += paths_of(value, f"{prefix}{key}.")
    return found


KNOWN = [
    *paths_of(RING18.to_table()),
    "joints.hinge.coulomb",
    "joints.pivot",
    "rods.elements[2]",
]


def accepted_or_refused(build: Any) -> Scene | None:
    """The scene, or None if it was refused; a refusal is one non-empty line."""
    try:
        scene = build()
    except InputError as refused:
        line = str(refused)
    else:
        assert isinstance(scene, Scene)
        return scene
    assert line
    assert line.isprintable()  # so it has no line break either
    return None


@given(st.dictionaries(st.sampled_from(list(Scene.model_fields)) | st.text(), VALUES, max_size=6))
def test_arbitrary_tables(table: dict[str, Any]) -> None:
    accepted_or_refused(lambda: scene_from_table(table, source="fuzz"))


@given(st.sampled_from(KNOWN), VALUES)
def test_arbitrary_values_at_known_paths(path: str, value: Any) -> None:
    accepted_or_refused(lambda: RING18.with_values({path: value}))


@given(st.dictionaries(st.sampled_from(KNOWN), VALUES, min_size=2, max_size=5))
def test_several_arbitrary_values_at_once(values: dict[str, Any]) -> None:
    accepted_or_refused(lambda: RING18.with_values(values))


@given(st.text(alphabet=string.ascii_lowercase + ".[]0123456789_ \n=é٣", max_size=30), VALUES)
def test_arbitrary_paths(path: str, value: Any) -> None:
    accepted_or_refused(lambda: RING18.with_values({path: value}))


@given(st.text(max_size=60))
def test_arbitrary_assignments(text: str) -> None:
    accepted_or_refused(lambda: RING18.with_values(dict([parse_assignment(text)])))


@given(st.sampled_from(KNOWN), st.text(max_size=30))
def test_arbitrary_text_assigned_to_known_paths(path: str, text: str) -> None:
    accepted_or_refused(lambda: RING18.with_values(dict([parse_assignment(f"{path}={text}")])))


@given(st.text(max_size=200))
def test_arbitrary_text_as_a_file(text: str) -> None:
    accepted_or_refused(lambda: scene_from_toml(text, source="fuzz"))


@given(st.integers(0, len(RING18.to_toml())), st.integers(0, 40), st.text(max_size=6))
def test_damaged_scene_files(start: int, length: int, insert: str) -> None:
    text = RING18.to_toml()
    damaged = text[:start] + insert + text[start + length :]
    accepted_or_refused(lambda: scene_from_toml(damaged, source="fuzz"))


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_any_accepted_number_is_kept_as_it_is(number: float) -> None:
    scene = accepted_or_refused(lambda: RING18.with_values({"loads.force": number}))
    assert (scene is not None) == (abs(number) <= 1e6)
    if scene is not None:
        assert scene.loads is not None
        assert scene.loads.force == number


@for_each("path", KNOWN)
def test_a_wrong_type_at_every_path_names_that_path(path: str) -> None:
    with pytest.raises(InputError) as refused:
        RING18.with_values({path: date(2026, 11, 21)})
    assert path.partition("[")[0] in str(refused.value)
