"""Designs in blocks of runs: what moves between the runs of a block, and who belongs to whom."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from loops import for_each
from pydantic import TypeAdapter
from SALib.sample import sobol as salib_sobol

from ringsim.campaign.specification import load_campaign
from ringsim.refusal import InputError
from ringsim.sampling.columns import Correlation
from ringsim.sampling.designs.blocks import Morris, Saltelli
from ringsim.sampling.table import AnyDistribution

pytestmark = pytest.mark.quick

UNIFORM = {"kind": "uniform", "low": 0.0, "high": 1.0}
EACH = UNIFORM | {"each_section": True}
PULLEYS = [f"friction[{k}]" for k in range(1, 9)]
FACTORS = TypeAdapter(dict[str, AnyDistribution]).validate_python(
    {"force": UNIFORM, **dict.fromkeys(PULLEYS, EACH), "modulus": UNIFORM}
)
KINDS = [Saltelli, Morris]


def blocks(design, seed=3):
    rows = design.rows(FACTORS, seed)
    size = rows.index(rows[0], 1)
    points = design.points(FACTORS, seed)
    return points.reshape(-1, size, len(FACTORS)), np.array(rows).reshape(-1, size)


def test_a_block_has_each_group_of_b_in_a():
    groups = {"first": ("friction[1..3]", "force")}
    points, rows = blocks(Saltelli(samples=16, groups=groups, second_order=True))
    names = ["first", "rest of friction", "modulus"]
    crossed = [f"{way}: {name}" for way in ("AB", "BA") for name in names]
    assert rows[5].tolist() == ["A", *crossed, "B"]
    first, second = points[:, 0], points[:, -1]
    for k, axes in enumerate(([0, 1, 2, 3], [4, 5, 6, 7, 8], [9])):
        mixed, other = first.copy(), second.copy()
        mixed[:, axes], other[:, axes] = second[:, axes], first[:, axes]
        np.testing.assert_array_equal(points[:, 1 + k], mixed)
        np.testing.assert_array_equal(points[:, 4 + k], other)


def test_one_replicate_is_the_matrix_of_salib():
    """With the same Sobol' sequence: rows of blocks stand where its analysis expects them."""
    design = Saltelli(samples=8, replicates=1, second_order=True)
    factors = dict.fromkeys("abc", FACTORS["force"])
    problem = {"num_vars": 3, "names": list("abc"), "bounds": [[0, 1]] * 3}
    stream = np.random.default_rng(np.random.SeedSequence(3))
    np.testing.assert_allclose(
        design.points(factors, 3), salib_sobol.sample(problem, 8, seed=stream), atol=1e-12
    )


def test_each_half_and_each_replicate_is_balanced():
    points, _ = blocks(Saltelli(samples=64, replicates=4))
    for number in range(4):
        for row in (0, -1):
            halves = np.floor(points[number::4, row] * 16).astype(int)
            assert (np.sort(halves, axis=0) == np.arange(16)[:, None]).all()


def test_a_trajectory_moves_each_group_once_by_half_of_the_levels():
    factors = FACTORS | TypeAdapter(dict[str, AnyDistribution]).validate_python(
        {"fault": {"kind": "discrete", "values": list("abc"), "probabilities": [0.9, 0.05, 0.05]}}
    )
    design = Morris(samples=40, levels=6, groups={"some": ("friction", "force")})
    rows = np.array(design.rows(factors, 1)).reshape(40, -1)
    points = design.points(factors, 1).reshape(40, -1, len(factors))
    axes = {"some": [*range(9)], "modulus": [9], "fault": [10]}
    assert rows.shape == (40, 4)
    moved = np.diff(points, axis=1)
    for number, row in enumerate(rows):
        assert row[0] == "start"
        assert sorted(word.split(": ")[1] for word in row[1:]) == sorted(axes)
        for step, word in zip(moved[number], row[1:], strict=True):
            way, _, group = word.partition(": ")
            assert np.flatnonzero(step).tolist() == axes[group]
            if group != "fault":
                np.testing.assert_allclose(np.abs(step[axes[group]]), 3 / 5)
            if group != "some":
                assert (step[axes[group]] > 0) == (way == "up")
    words = factors["fault"].quantile(points[..., -1].ravel())
    assert set(words.tolist()) == {"a", "b", "c"}
    assert {way.split(":")[0] for way in rows.ravel()} == {"start", "up", "down", "moved"}


@pytest.mark.parametrize("kind", KINDS)
def test_a_sample_depends_on_seed_and_index_alone(kind):
    small, large = kind(samples=16), kind(samples=32)
    count = len(small.rows(FACTORS, 2))
    np.testing.assert_array_equal(small.points(FACTORS, 2), large.points(FACTORS, 2)[:count])
    assert small.rows(FACTORS, 2) == large.rows(FACTORS, 2)[:count]
    assert not np.array_equal(small.points(FACTORS, 2), small.points(FACTORS, 4))


@pytest.mark.parametrize("kind", KINDS)
def test_stretches_of_places_are_groups(kind):
    members = kind(samples=8, stretches={"friction": 4}).members(FACTORS)
    assert [*members] == ["force", *(f"friction[{k}..{k + 1}]" for k in (1, 3, 5, 7)), "modulus"]
    assert members["friction[7..8]"] == [7, 8]
    whole = kind(samples=8).members(FACTORS)
    assert [*whole] == ["force", "friction", "modulus"]


@for_each("kind", KINDS)
@for_each(
    ("wrong", "words"),
    [
        ({"groups": {"a": ("frictoin",)}}, "did you mean friction"),
        ({"groups": {"a": ("friction[9]",)}}, "the places 1 to 8"),
        ({"groups": {"a": ("friction[3..2]",)}}, "the places 1 to 8"),
        ({"groups": {"a": ("force[1..1]", "force")}}, "too: leave it out"),
        ({"groups": {"a": ("force",), "b": ("force",)}}, 'is in the group "a", too'),
        ({"groups": {"a": ()}}, "is empty"),
        ({"groups": {"force": ("modulus",)}}, "choose another name"),
        ({"stretches": {"modulus": 2}}, "at most its 1 places"),
        ({"stretches": {"modulo": 2}}, "did you mean modulus"),
        ({"groups": {"a": ("friction[1]",)}, "stretches": {"friction": 2}}, "leave it out of one"),
        ({"samples": 4_000_000}, "must be at most 10000000: give fewer samples, or join inputs"),
    ],
)
def test_wrong_groups_are_refused(kind, wrong, words):
    with pytest.raises(InputError, match=words):
        kind(**{"samples": 8} | wrong).members(FACTORS)


def test_inputs_that_depend_on_each_other_need_a_common_group():
    pair = [Correlation(between=("force", "modulus"), coefficient=0.9)]
    alone, joined = Saltelli(samples=64), Saltelli(samples=64, groups={"a": ("force", "modulus")})
    with pytest.raises(InputError, match=r"one group of design\.groups"):
        alone.table(FACTORS, pair, seed=1, folder=Path())
    drawn = joined.table(FACTORS, pair, seed=1, folder=Path())
    assert np.corrcoef(drawn["force"], drawn["modulus"])[0, 1] > 0.8
    with pytest.raises(InputError, match=r"a morris design .*cannot have correlations"):
        Morris(samples=4).table(FACTORS, pair, seed=1, folder=Path())
    with pytest.raises(InputError, match="needs inputs"):
        alone.table({}, (), seed=1, folder=Path())


def test_a_campaign_knows_the_row_of_each_sample(tmp_path):
    (tmp_path / "c.toml").write_text(
        """
        name = "c"
        scene = "ring18"
        design = { kind = "saltelli", samples = 16, groups = { rods = ["rods.young_modulus"] } }
        [set]
        "structure.sections" = 6
        boom = "none"
        [inputs]
        "rods.young_modulus" = { kind = "uniform", low = 1e11, high = 1.2e11, each_section = true }
        "loads.force" = { kind = "uniform", low = 0.01, high = 0.02 }
        """
    )
    table = load_campaign(tmp_path / "c.toml").draw()
    assert table.samples == 16 * (2 + 2)
    row = table.columns[-1]
    assert row.name == "block_row"
    assert row.values[:5].tolist() == ["A", "AB: rods", "AB: loads.force", "B", "A"]
    assert set(table.values_of(1)) == {"rods.young_modulus", "loads.force"}
    modulus, force = table.columns[0].values, table.columns[1].values
    assert (modulus[1] == modulus[3]).all()
    assert force[2] == force[3]
    grown = load_campaign(tmp_path / "c.toml", samples=32).draw()
    assert grown.starts_with(table)
