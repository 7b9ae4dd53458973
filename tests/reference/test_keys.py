"""The reference of keys says of every key what a file that breaks it is refused for."""

from __future__ import annotations

import functools
import subprocess
import sys
import tomllib

import pytest
from click.testing import CliRunner
from loops import for_each

from ringsim.cli import cli
from ringsim.reference.keys import Key, keys_of
from ringsim.reference.tree import ROOTS, facts, find, known, paths, places
from ringsim.refusal import InputError
from ringsim.scene import builtin_scenes, load_scene
from ringsim.units import Model

pytestmark = pytest.mark.quick

EVERY = [
    pytest.param(root, model, key, id=f"{root}-{model.__name__}.{key.name}")
    for root in ROOTS for model in places(root) for key in keys_of(model)
    if model.__module__.startswith("ringsim.")  # other tests define kinds of their own
]  # fmt: skip


def explain(*names: str) -> str:
    found = CliRunner().invoke(cli, ["explain", *names])
    assert found.exit_code == 0, found.output
    return found.output


@for_each(("root", "model", "key"), EVERY)
def test_every_key_has_a_meaning_a_form_and_a_path(root: str, model: type[Model], key: Key) -> None:
    assert len(key.meaning) > 10, f"{model.__name__}.{key.name} needs a docstring below its field"
    assert key.form != "any value" or key.name == "values"
    for path in places(root)[model]:
        whole = f"{path}.{key.name}".lstrip(".")
        assert (root, key.meaning) in {(each.root, each.key.meaning) for each in find(whole)}


def test_every_key_of_the_built_in_scenes_is_found() -> None:
    def below(table: dict, path: str = ""):
        for name, value in table.items():
            if name == "kind":
                continue
            yield f"{path}{name}"
            if isinstance(value, dict):
                yield from below(value, f"{path}{name}.")

    for text in builtin_scenes().values():
        for path in below(tomllib.loads(text)):
            assert any(each.root == "scene" for each in find(path)), path


@for_each("path", [
    "structure.sections", "rods.young_modulus", "loads.force", "solver.tolerance",
    "cables.upper.axial_stiffness", "cables.upper.winch.start_time", "limits.overrun",
    "stop.stiffness", "structure.opening_angle", "net.stiffness",
])  # fmt: skip
def test_ranges_are_those_at_which_scenes_are_refused(path: str) -> None:
    """Just beyond what the reference says a scene is refused, with the bound in the message."""
    scene = load_scene("ring18-cable")
    # Of the kind that the scene has: those that other tests have defined are known from then on.
    kind = getattr(functools.reduce(getattr, path.split(".")[:-1], scene), "kind", None)
    found = next(
        each for each in find(path)
        if each.root == "scene" and (not each.kinds or kind in each.kinds)
    )  # fmt: skip
    numbers = [
        float(word.strip(",")) for word in found.key.range.split() if word[:1] in "-0123456789"
    ]
    assert numbers
    for bound, beyond in zip(numbers, (-1, 1), strict=False):
        value = bound + beyond * max(abs(bound), 1.0)
        value = int(value) if found.key.form.startswith("whole") else value
        with pytest.raises(InputError, match=f"must be .*{bound:g}".replace("+", r"\+")):
            scene.with_values({path: value})


def test_defaults_are_those_of_a_scene_that_leaves_them_out() -> None:
    scene = load_scene("truss2")
    assert f"default {scene.limits.rope_strain:g}" in explain("limits.rope_strain")
    assert f"default {scene.cables.upper.damping_time:g}" in explain("cables.upper.damping_time")
    assert "left out by default" in explain("cables.upper.slip_speed")
    for name in ("peak_tension", "status"):
        of_check = explain(f"{name}_checked")
        assert of_check == f"{name}_checked, of checks: {explain(name)}"
    assert "must be given" in explain("cables.upper.winch")


def test_a_table_is_told_with_its_keys_and_kinds() -> None:
    words = explain("cables.upper.winch")
    assert "start_time: number in s" in words
    assert "constant, motor, ramp, stall, table, tension-feedback" in words
    words = explain("design")
    for kind in ("grid", "latin-hypercube", "list", "random", "saltelli", "sobol"):
        assert words.count(f'kind = "{kind}"') == 1
    assert "samples: whole number" in words
    assert "standard_deviation" in explain("inputs")
    assert "of kind normal" in explain('inputs."rods.young_modulus".mean')


def test_lists_say_what_they_have_a_value_for() -> None:
    assert "one for each section" in explain("rods.young_modulus")
    assert explain("rods.kind") == explain("rods")
    assert "table with a kind: ancf, geometrically-exact" in explain("rods.kind")
    assert "section (of an open ring corner)" in explain("net.stiffness")
    words = explain("cables.upper.friction.coefficient")
    assert "one for each pulley" in words
    assert 'coefficient["section 6 V"] = VALUE' in words


def test_keys_that_scenes_and_campaigns_share_are_told_of_both() -> None:
    words = explain("limits")
    assert "limits (scene file)" in words
    assert "limits (campaign file)" in words
    assert "timeout" in words
    assert "rope_strain" in words
    assert "structure: table with a kind" in explain("scene")


@for_each(
    ("name", "meant"),
    [
        ("cables.upper.winsh", "did you mean cables.upper.winch?"),
        ("coefficient", "did you mean cables.upper.friction.coefficient or "),
        ("structure.section", "did you mean structure.sections?"),
        ("rods.young_modulos[3]", "did you mean rods.young_modulus?"),
        ("dessign", "did you mean design?"),
        ("optimise", "did you mean optimisation?"),
        ("asynchronie", "did you mean asynchrony?"),
        # A word of the meaning: the ring's diameter is no key, but follows from one.
        ("diameter", "did you mean structure.half_bar or "),
        ("aperture", "did you mean structure.half_bar"),
        ("nosuch", "ringsim explain lists the variables"),
    ],
)
def test_a_misspelt_name_is_refused_with_the_nearest(name: str, meant: str) -> None:
    found = CliRunner().invoke(cli, ["explain", "asynchrony_max", name])
    assert found.exit_code == 2
    assert meant in found.output
    assert len(found.stderr.splitlines()) == 1
    with pytest.raises(InputError):
        known(name, [])


def test_the_end_of_a_path_that_is_the_only_one_is_enough() -> None:
    found = CliRunner().invoke(cli, ["explain", "half_bar"])
    assert found.exit_code == 0
    assert found.output.startswith("structure.half_bar (scene file")
    # Of both cables it is the same key.
    assert explain("initial_slack").startswith("cables.upper.initial_slack (scene file")


@for_each(
    ("kind", "path"),
    [("lognormal", "inputs"), ("jammed-pulley", "faults"), ("capstan", "cables.upper.friction")],
)
def test_a_kind_leads_to_where_it_is_chosen(kind: str, path: str) -> None:
    assert explain(kind).startswith(f"{path} (")
    assert f'kind = "{kind}"' in explain(kind)


def test_paths_are_those_of_files() -> None:
    assert "cables.lower.far_winch.winding.speed" in paths("scene")
    assert "faults[k].time" in paths("scene")
    assert "inputs.*.mean" in paths("campaign")
    assert "requirements.*.is" in paths("campaign")
    assert facts(find("solver.step")[0].key) == "number in s; 1e-09 .. 1e+06; default 0.2"


def test_every_kind_of_design_is_known_to_whoever_reads_a_campaign_file() -> None:
    """In a process of its own: others have imported more than that takes."""
    words = (
        "from ringsim.campaign.specification import Specification; "
        "from ringsim.reference.tree import find; print(find('design')[0].key.form)"
    )
    told = subprocess.run(
        [sys.executable, "-c", words], capture_output=True, text=True, check=True
    ).stdout
    for kind in ("grid", "list", "one-at-a-time", "random", "sobol", "subset-simulation"):
        assert kind in told
