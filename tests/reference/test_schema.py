"""The JSON Schemas accept what is built in, and refuse what a reader refuses key by key."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from click.testing import CliRunner
from loops import for_each

from ringsim.cli import cli
from ringsim.reference.tree import schema_of
from ringsim.refusal import EXIT_BAD_INPUT
from ringsim.scene import builtin_scenes, load_scene

pytestmark = pytest.mark.quick

ROOT = Path(__file__).parents[2]
CAMPAIGNS = sorted((ROOT / "campaigns").glob("*.toml"))
CAMPAIGNS += sorted((ROOT / "campaigns" / "stand").glob("flight_*.toml"))
SCENE = tomllib.loads(builtin_scenes()["ring18-cable"])
CAMPAIGN = tomllib.loads((ROOT / "campaigns" / "faults.toml").read_text(encoding="utf-8"))

SPAN = "section 1 first hinge to V"
SURELY = {"probability": 0.9, "confidence": 0.9}


@pytest.fixture(scope="module")
def scene() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(schema_of("scene"))


@pytest.fixture(scope="module")
def campaign() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(schema_of("campaign"))


def changed(table: dict[str, Any], path: str, value: Any) -> dict[str, Any]:
    made = inner = json.loads(json.dumps(table))
    *steps, name = path.split("/")
    for step in steps:
        inner = inner.setdefault(step, {})
    inner[name] = value
    return made


@pytest.mark.parametrize("kind", ["scene", "campaign"])
def test_the_command_prints_a_valid_schema(kind: str) -> None:
    printed = CliRunner().invoke(cli, ["explain", "--schema", kind])
    assert printed.exit_code == 0
    jsonschema.Draft202012Validator.check_schema(json.loads(printed.stdout))


@for_each("name", builtin_scenes())
def test_built_in_scenes_are_accepted(name: str, scene: jsonschema.Draft202012Validator) -> None:
    scene.validate(tomllib.loads(builtin_scenes()[name]))
    scene.validate(load_scene(name).to_table())  # with every default written out


@for_each("file", CAMPAIGNS, ids=lambda path: path.stem)
def test_shipped_campaigns_are_accepted(
    file: Path, campaign: jsonschema.Draft202012Validator
) -> None:
    campaign.validate(tomllib.loads(file.read_text(encoding="utf-8")))


GOOD_SCENES = [
    ("cables/upper/friction/coefficient", {"default": 4e-4, "section 6 V": 0.002}),
    ("rods/young_modulus", [1.2e11] * 18),
    ("stop", "none"),
    ("boom", "none"),
    ("cables/upper/slip_speed", "none"),
    ("faults", [{"kind": "cut-cable", "cable": "lower", "span": SPAN, "time": 1}]),
    ("stop", {"stiffness": 100}),  # its only kind is the default
    ("rods", {"elements": 2}),  # of the default kind
]  # fmt: skip
BAD_SCENES = [
    ("structure/sectoins", 3),
    ("structure/sections", "six"),
    ("structure/sections", 0),
    ("structure/kind", "pantograph"),
    ("cables/upper/winch/winding/speed", "fast"),
    ("cables/upper/winch/winding/kind", "constant"),  # which has no duration
    ("cables/upper/end", "middle"),
    ("rods/density", 1e6),
    ("cables/upper/friction/coefficient", {"section 6 V": 0.002}),
    ("solver", "none"),
    ("boom", {"length": 0.9}),  # of no kind
]


@for_each(("path", "value"), GOOD_SCENES, ids=str)
def test_what_scenes_may_hold_is_accepted(
    path: str, value: Any, scene: jsonschema.Draft202012Validator
) -> None:
    table = changed(SCENE, path, value)
    scene.validate(table)
    load_scene("ring18-cable").with_values({path.replace("/", "."): value})


@for_each(("path", "value"), BAD_SCENES, ids=str)
def test_what_scenes_must_not_hold_is_refused(
    path: str, value: Any, scene: jsonschema.Draft202012Validator
) -> None:
    assert not scene.is_valid(changed(SCENE, path, value))


@for_each(
    ("path", "value", "good"),
    [
        ("inputs/rods", {"young_modulus": {"kind": "uniform", "low": 1e11, "high": 2e11}}, True),
        ("inputs/rods", {"young_modulus": {"kind": "uniform", "low": 1e11}}, False),
        ("set/solver", {"end_time": 3.0}, True),
        ("design", {"kind": "grid", "levels": {"rods.young_modulus": 4}}, True),
        ("design", {"kind": "sobol", "samples": 8, "replicates": 0}, False),
        ("design", {"kind": "random"}, False),
        ("fidelity", "exact", False),
        ("requirements", {"outcome": {"is": "deployed"} | SURELY}, True),
        ("requirements", {"outcome": {"is_": "deployed"} | SURELY}, False),
        ("max_difference", {"asynchrony_max": 0.05}, True),
        ("correlations", [{"between": ["a", "b"], "coefficient": 1.5}], False),
        ("seeds", 3, False),
    ],
)  # fmt: skip
def test_campaign_keys(
    path: str, value: Any, good: bool, campaign: jsonschema.Draft202012Validator
) -> None:
    assert campaign.is_valid(changed(CAMPAIGN, path, value)) == good


def test_every_key_says_what_it_means(scene: jsonschema.Draft202012Validator) -> None:
    tables = [*scene.schema["$defs"].values(), scene.schema]
    for table in tables:
        for name, key in table["properties"].items():
            assert name == "kind" or key["description"], (table["title"], name)


def test_a_printed_scene_stands_beside_the_schema_that_it_names(tmp_path: Path) -> None:
    out = tmp_path / "my.toml"
    done = CliRunner().invoke(cli, ["scenes", "ring18", "--out", str(out)])
    assert done.exit_code == 0, done.output
    directive, text = out.read_text(encoding="utf-8").split("\n", 1)
    assert text == builtin_scenes()["ring18"]
    beside = tmp_path / directive.removeprefix("#:schema ")
    assert json.loads(beside.read_text(encoding="utf-8")) == schema_of("scene")
    assert load_scene(out) == load_scene("ring18")
    edited = out.read_text(encoding="utf-8") + "# mine\n"
    out.write_text(edited, encoding="utf-8")
    done = CliRunner().invoke(cli, ["scenes", "ring18", "--out", str(out)])
    assert done.exit_code == EXIT_BAD_INPUT
    assert "with other content: remove it first" in done.stderr
    assert out.read_text(encoding="utf-8") == edited


@for_each(
    ("arguments", "words"),
    [
        (["explain", "--schema", "scenes"], "did you mean scene?"),
        (["explain", "--schema", "scene", "asynchrony"], "give one of the two"),
        (["scenes", "--out", "my.toml"], "needs the name of a scene"),
        (["scenes", "ring18", "--out", "absent/my.toml"], "create it first"),
    ],
)
def test_senseless_requests_are_refused(arguments: list[str], words: str) -> None:
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 2
    assert words in done.output
