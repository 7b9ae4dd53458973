"""Every design places its samples as it promises, and the same ones each time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from loops import for_each
from pydantic import TypeAdapter

from ringsim.choice import kinds_of
from ringsim.refusal import InputError
from ringsim.sampling.columns import Correlation
from ringsim.sampling.designs import Design
from ringsim.sampling.designs.levels import SubsetSimulation
from ringsim.sampling.table import AnyDesign, AnyDistribution, draw
from ringsim.scene import load_scene

pytestmark = pytest.mark.quick

DESIGN = TypeAdapter(AnyDesign)
INPUTS = TypeAdapter(dict[str, AnyDistribution])

THREE = {
    "rods.young_modulus": {"kind": "normal", "mean": 120e9, "standard_deviation": 5e9},
    "net.stiffness": {"kind": "lognormal", "mean": 1e-3, "standard_deviation": 2e-4},
    "loads.force": {"kind": "uniform", "low": 0.01, "high": 0.02},
}
PROBABILISTIC = ["random", "latin-hypercube", "sobol"]


@pytest.fixture(scope="module")
def base():
    return load_scene("ring18").with_values({"structure.sections": 6, "boom": "none"})


def drawn(base, design, inputs=THREE, *, seed=5, folder=Path(), correlations=()):
    return draw(
        base,
        INPUTS.validate_python(inputs),
        correlations,
        DESIGN.validate_python(design),
        seed=seed,
        folder=folder,
    )


def values(table, path):
    return next(column.values for column in table.columns if column.path == path)


def test_every_kind_is_tested():
    own = {"grid", "list", "one-at-a-time", "saltelli", "morris"}
    levels = str(SubsetSimulation.model_fields["kind"].default)
    assert set(kinds_of(Design)) == {*PROBABILISTIC, *own, levels}


@pytest.mark.parametrize("kind", PROBABILISTIC)
def test_same_seed_gives_the_same_samples_and_another_seed_others(kind, base):
    design = {"kind": kind, "samples": 16}
    once, again = drawn(base, design), drawn(base, design)
    other = drawn(base, design, seed=6)
    assert once.starts_with(again)
    assert again.starts_with(once)
    assert not np.intersect1d(values(once, "loads.force"), values(other, "loads.force")).size


@pytest.mark.parametrize("kind", PROBABILISTIC)
def test_extendable_designs_keep_their_first_samples(kind, base):
    small = drawn(base, {"kind": kind, "samples": 100})
    large = drawn(base, {"kind": kind, "samples": 200})
    assert large.starts_with(small) == (kind != "latin-hypercube")
    assert np.array_equal(large.seeds[:100], small.seeds)


def test_a_sample_depends_on_seed_and_index_alone(base):
    table = drawn(base, {"kind": "random", "samples": 10})
    alone = np.random.default_rng(np.random.SeedSequence(5, spawn_key=(7,))).random(3)
    assert values(table, "loads.force")[7] == pytest.approx(0.01 + 0.01 * alone[2], rel=1e-12)


def test_latin_hypercube_has_one_sample_in_every_interval(base):
    force = values(drawn(base, {"kind": "latin-hypercube", "samples": 40}), "loads.force")
    intervals = np.floor((force - 0.01) / 0.01 * 40).astype(int)
    assert sorted(intervals.tolist()) == list(range(40))


def test_sobol_points_are_balanced_at_powers_of_two(base):
    force = values(drawn(base, {"kind": "sobol", "samples": 64}), "loads.force")
    intervals = np.floor((force - 0.01) / 0.01 * 64).astype(int)
    assert sorted(intervals.tolist()) == list(range(64))


@pytest.mark.parametrize("kind", ["latin-hypercube", "sobol"])
def test_replicates_are_whole_designs_of_their_own(kind, base):
    force = values(drawn(base, {"kind": kind, "samples": 64, "replicates": 4}), "loads.force")
    for number in range(4):
        intervals = np.floor((force[number::4] - 0.01) / 0.01 * 16).astype(int)
        assert sorted(intervals.tolist()) == list(range(16))
    assert len(np.unique(force)) == 64
    alone = values(drawn(base, {"kind": kind, "samples": 16}), "loads.force")
    assert np.array_equal(force[::4], alone)  # the first has the campaign's own seed


def test_a_sobol_design_with_replicates_grows(base):
    small, large = (
        drawn(base, {"kind": "sobol", "samples": count, "replicates": 4}) for count in (32, 64)
    )
    assert large.starts_with(small)


def test_samples_that_replicates_do_not_divide_are_refused():
    with pytest.raises(ValueError, match="multiple of replicates = 8, for example 96"):
        DESIGN.validate_python({"kind": "sobol", "samples": 100, "replicates": 8})


def test_grid_crosses_all_levels(base):
    inputs = THREE | {"rods.elements": {"kind": "discrete", "values": [1, 2, 4]}}
    table = drawn(base, {"kind": "grid", "levels": {"loads.force": 5, "net.stiffness": 2}}, inputs)
    assert table.samples == 3 * 2 * 5 * 3
    combinations = {tuple(c.values[k].item() for c in table.columns) for k in range(table.samples)}
    assert len(combinations) == table.samples
    np.testing.assert_allclose(np.unique(values(table, "loads.force")), np.linspace(0.01, 0.02, 5))
    assert values(table, "rods.elements")[:4].tolist() == [1, 2, 4, 1]


def test_levels_of_an_input_are_those_of_all_its_places_but_one_that_is_named(base):
    law = {"kind": "uniform", "low": 1e11, "high": 2e11, "each_section": True}
    inputs = {"rods.young_modulus": law, "loads.force": {"kind": "discrete", "values": [0.01]}}
    levels = {"rods.young_modulus": 2, "rods.young_modulus[4]": 3}
    modulus, _ = (c.values for c in drawn(base, {"kind": "grid", "levels": levels}, inputs).columns)
    counts = [len(np.unique(each)) for each in modulus.T]
    assert counts == [2, 2, 2, 3, 2, 2]
    assert len(np.unique(modulus, axis=0)) == len(modulus) == np.prod(counts)


def test_one_input_at_a_time_leaves_the_base_case(base):
    inputs = {
        "rods.young_modulus": {"kind": "uniform", "low": 1e11, "high": 2e11, "each_section": True},
        "rods.elements": {"kind": "discrete", "values": [2, 1, 4]},
    }
    design = {"kind": "one-at-a-time"}
    modulus, elements = (column.values for column in drawn(base, design, inputs).columns)
    expected = np.full((6 + 3, 6), 1e11)
    expected[range(1, 7), range(6)] = 2e11
    np.testing.assert_array_equal(modulus, expected)
    assert elements.tolist() == [2] * 7 + [1, 4]
    design |= {"levels": 3, "base": {"rods.young_modulus": 2}}
    modulus, elements = (column.values for column in drawn(base, design, inputs).columns)
    assert modulus.shape == (1 + 6 * 2 + 2, 6)
    assert (modulus == 1.5e11).sum() == modulus.size - 12
    assert modulus[1:3, 0].tolist() == [1e11, 2e11]
    assert (elements == 2).sum() == len(elements) - 2


@pytest.mark.parametrize(
    ("base_level", "words"),
    [(3, "has 2 levels"), ({"loads.forse": 1}, "did you mean loads.force")],
)
def test_base_levels_that_are_not_there_are_refused(base, base_level, words):
    with pytest.raises(InputError, match=words):
        drawn(base, {"kind": "one-at-a-time", "base": base_level})


def test_csv_list_is_taken_as_it_is(base, tmp_path):
    (tmp_path / "cases.csv").write_text(
        "loads.force, rods.young_modulus[3], rods.elements, rods.kind\n"
        "0.01, 1.1e11, 1, ancf\n0.02, 1.3e11, 2, geometrically-exact\n"
    )
    table = drawn(base, {"kind": "list", "file": "cases.csv"}, {}, folder=tmp_path)
    assert table.values_of(0) == {
        "loads.force": 0.01,
        "rods.young_modulus[3]": 1.1e11,
        "rods.elements": 1,
        "rods.kind": "ancf",
    }
    scene = base.with_values(table.values_of(1))
    assert scene.rods.young_modulus == (120e9, 120e9, 1.3e11, 120e9, 120e9, 120e9)


def test_design_file_of_a_campaign_can_be_listed(base, tmp_path):
    from ringsim.storage.netcdf import write_design

    inputs = THREE | {
        "rods.young_modulus": THREE["rods.young_modulus"] | {"each_section": True},
        "rods.kind": {"kind": "discrete", "values": ["ancf", "geometrically-exact"]},
        "net.two_sided": {"kind": "discrete", "values": [True, False]},
    }
    table = drawn(base, {"kind": "random", "samples": 8}, inputs)
    write_design(tmp_path, table, {})
    again = drawn(base, {"kind": "list", "file": "design.nc"}, {}, folder=tmp_path)
    for sample in range(8):
        mine = base.with_values(table.values_of(sample))
        assert base.with_values(again.values_of(sample)) == mine


def test_each_section_gets_a_value_of_its_own(base):
    inputs = {"rods.young_modulus": THREE["rods.young_modulus"] | {"each_section": True}}
    table = drawn(base, {"kind": "random", "samples": 4}, inputs)
    (column,) = table.columns
    assert column.values.shape == (4, 6)
    assert column.dim == "section"
    assert len(np.unique(column.values)) == 24
    scene = base.with_values(table.values_of(2))
    assert scene.rods.young_modulus == tuple(column.values[2])


def test_columns_know_their_unit_and_a_plain_name(base):
    table = drawn(
        base,
        {"kind": "random", "samples": 2},
        {**THREE, "rods.young_modulus[2]": THREE["rods.young_modulus"]},
    )
    found = {column.path: (column.name, column.units) for column in table.columns}
    assert found["rods.young_modulus[2]"] == ("rods_young_modulus_2", "Pa")
    assert found["net.stiffness"] == ("net_stiffness", "N/m")


@pytest.mark.parametrize("kind", PROBABILISTIC)
def test_correlated_inputs_have_the_correlation_that_was_asked_for(kind, base):
    inputs = THREE | {
        "rods.density": {"kind": "normal", "mean": 1800.0, "standard_deviation": 50.0}
    }
    pair = Correlation(between=("rods.young_modulus", "rods.density"), coefficient=0.8)
    plain = drawn(base, {"kind": kind, "samples": 2000}, inputs)
    table = drawn(base, {"kind": kind, "samples": 2000}, inputs, correlations=[pair])
    found = np.corrcoef(values(table, "rods.young_modulus"), values(table, "rods.density"))[0, 1]
    # Standard error of a correlation of 0.8 from 2000 samples: (1 - 0.64) / sqrt(2000) = 0.008.
    assert found == pytest.approx(0.8, abs=0.03)
    assert values(table, "rods.density").std() == pytest.approx(50.0, rel=0.06)
    assert np.array_equal(values(table, "loads.force"), values(plain, "loads.force"))


def test_correlation_of_values_for_each_section_goes_section_by_section(base):
    each = {"each_section": True, "kind": "normal"}
    inputs = {
        "rods.young_modulus": each | {"mean": 120e9, "standard_deviation": 5e9},
        "loads.force": each | {"mean": 0.02, "standard_deviation": 0.001},
    }
    pair = Correlation(between=("rods.young_modulus", "loads.force"), coefficient=-0.9)
    table = drawn(base, {"kind": "random", "samples": 2000}, inputs, correlations=[pair])
    modulus, force = (column.values for column in table.columns)
    matrix = np.corrcoef(modulus.T, force.T)[:6, 6:]
    np.testing.assert_allclose(matrix, -0.9 * np.eye(6), atol=0.1)


@for_each(
    ("inputs", "words"),
    [
        ({"rods.yung_modulus": THREE["rods.young_modulus"]}, "young_modulus"),
        ({"structure.sections": {"kind": "discrete", "values": [6, 8]}}, "same for all samples"),
        ({"record.interval": {"kind": "uniform", "low": 0.1, "high": 0.2}}, "same for all samples"),
        ({"loads.force": {"kind": "discrete", "values": ["much", "more"]}}, "loads.force"),
        ({"rods.density": THREE["loads.force"] | {"low": -1.0, "high": 1.0}}, "rods.density"),
        (
            {"rods.density": {"kind": "uniform", "low": 1e3, "high": 2e3, "each_section": True}},
            "each_section",
        ),
        (
            {"rods.diagonal.outer_diameter": {"kind": "uniform", "low": 0.009, "high": 0.02}},
            "truncate",
        ),
    ],
)
def test_inputs_that_the_scene_refuses_are_refused_before_anything_runs(inputs, words, base):
    with pytest.raises(InputError, match=words):
        drawn(base, {"kind": "random", "samples": 30}, inputs)


@for_each(
    ("pairs", "words"),
    [
        ([("rods.young_modulus", "rods.young_modulus", 0.5)], "two different"),
        ([("rods.young_modulus", "rods.densty", 0.5)], "not an input"),
        (
            [
                ("rods.young_modulus", "net.stiffness", 0.9),
                ("net.stiffness", "loads.force", 0.9),
                ("rods.young_modulus", "loads.force", -0.9),
            ],
            "not compatible",
        ),
    ],
)
def test_senseless_correlations_are_refused(pairs, words, base):
    correlations = [Correlation(between=(a, b), coefficient=c) for a, b, c in pairs]
    with pytest.raises(InputError, match=words):
        drawn(base, {"kind": "random", "samples": 4}, correlations=correlations)


def test_grid_refuses_correlations_and_unknown_levels(base):
    pair = Correlation(between=("loads.force", "net.stiffness"), coefficient=0.5)
    with pytest.raises(InputError, match="another design"):
        drawn(base, {"kind": "grid"}, correlations=[pair])
    with pytest.raises(InputError, match=r"did you mean loads\.force"):
        drawn(base, {"kind": "grid", "levels": {"loads.forc": 3}})


@for_each(
    ("text", "words"),
    [
        (None, "there is no file"),
        ("", "no samples"),
        ("loads.force\n", "no samples"),
        ("loads.force,net.stiffness\n0.1\n", "row 1 has 1 values"),
        ("loads.force,loads.force\n0.1,0.2\n", "once"),
        ("loads.forse\n0.1\n", "force"),
    ],
)
def test_unusable_lists_are_refused(text, words, base, tmp_path):
    if text is not None:
        (tmp_path / "cases.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        drawn(base, {"kind": "list", "file": "cases.csv"}, {}, folder=tmp_path)


@pytest.mark.parametrize(
    ("scene", "shared", "path", "dim", "count"),
    [
        ("ring18", {}, "rods.young_modulus", "section", 6),
        ("ring18", {}, "net.stiffness", "section", 6),
        ("ring18", {"structure.closed": False}, "net.stiffness", "corner", 7),
        ("ring18-cable", {}, "cables.upper.friction.coefficient", "pulley", 17),
        ("planar-truss", None, "cables.upper.friction.coefficient", "pulley", 1),
    ],
)
def test_values_of_a_list_are_named_after_their_places(scene, shared, path, dim, count):
    base = load_scene(scene)
    if shared is not None:
        base = base.with_values({"structure.sections": 6, "boom": "none", **shared})
    if scene == "planar-truss":
        base = base.with_values({"cables.upper.friction": {"kind": "bearing", "coefficient": 1e-4}})
    inputs = {path: {"kind": "uniform", "low": 2e-4, "high": 4e-4, "each_section": True}}
    if path.startswith("rods"):
        inputs[path] = THREE[path] | {"each_section": True}
    (column,) = drawn(base, {"kind": "random", "samples": 3}, inputs).columns
    assert column.dim == dim
    assert column.values.shape == (3, count)


@pytest.mark.parametrize("path", ["structure.beam_length", "rods.elements"])
def test_what_moves_the_stations_of_a_truss_is_the_same_for_all(path):
    inputs = {path: {"kind": "discrete", "values": [4, 5]}}
    with pytest.raises(InputError, match=f"{path} must be the same for all samples"):
        drawn(load_scene("planar-truss"), {"kind": "random", "samples": 2}, inputs)


def test_input_that_is_drawn_twice_is_refused(base):
    modulus = THREE["rods.young_modulus"]
    inputs = {
        "rods.young_modulus": modulus | {"each_section": True},
        "rods.young_modulus[3]": modulus,
    }
    with pytest.raises(InputError, match=r"rods\.young_modulus\[3\] is drawn twice"):
        drawn(base, {"kind": "random", "samples": 2}, inputs)


def test_a_thousand_columns_are_drawn_and_correlated_in_little_memory(base):
    """72 sections with 215 pulleys in either plane: the matrix is that of the correlated ones."""
    large = load_scene("ring18-cable").with_values({"structure.sections": 72, "boom": "none"})
    friction = {"kind": "uniform", "low": 1e-4, "high": 8e-4, "each_section": True}
    inputs = {f"cables.{plane}.friction.coefficient": friction for plane in ("upper", "lower")}
    inputs["rods.young_modulus"] = THREE["rods.young_modulus"] | {"each_section": True}
    pair = Correlation(between=tuple(inputs)[:2], coefficient=0.9)
    design = {"kind": "random", "samples": 40}
    plain, correlated = (drawn(large, design, inputs, correlations=c) for c in ((), (pair,)))
    upper, lower, modulus = (column.values for column in correlated.columns)
    assert upper.shape == lower.shape == (40, 215)
    assert np.corrcoef(upper.ravel(), lower.ravel())[0, 1] > 0.8
    np.testing.assert_array_equal(modulus, plain.columns[2].values)
    large.with_values(correlated.values_of(39))
