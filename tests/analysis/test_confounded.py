"""Inputs that go together in the samples are named, and none is told for the effect of another."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import spearmanr

from made import drawn_campaign
from ringsim.analysis import indices
from ringsim.analysis.influence import pairs
from ringsim.analysis.influence_text import what_matters
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told
from ringsim.sampling.designs.independent import RandomDesign, Sobol

FEW = Sobol(samples=250, replicates=10)
"""25 points a replicate in 40 dimensions: some lie on lines."""


def every(count):
    return ~np.eye(count, dtype=bool)


@pytest.mark.parametrize("samples", [30, pytest.param(200, marks=pytest.mark.slow)])
def test_independent_inputs_make_pairs_in_one_campaign_of_twenty_at_most(samples):
    random = np.random.default_rng(4)
    found = [bool(pairs(random.random((samples, 12)), every(12))) for _ in range(300)]
    # Three standard errors above 5 %.
    assert np.mean(found) < 0.05 + 3 * 0.0126


def test_pairs_are_those_of_scipy_and_bent_ones_are_found_by_their_share():
    random = np.random.default_rng(4)
    columns = random.random((300, 6))
    columns[:, 3] = 0.6 * columns[:, 0] + 0.4 * columns[:, 3]
    columns[:, 5] = np.abs(columns[:, 1] - 0.5) + 0.1 * columns[:, 5]
    straight, bent = sorted(pairs(columns, every(6)), key=lambda pair: pair.first)
    assert (straight.first, straight.second) == (0, 3)
    expected = spearmanr(columns[:, 0], columns[:, 3]).statistic
    assert straight.correlation == pytest.approx(expected, abs=1e-12)
    assert straight.share == pytest.approx(expected**2, abs=0.05)
    assert (bent.first, bent.second) == (1, 5)
    assert abs(bent.correlation) < 0.2
    assert bent.share > 0.8
    held = every(6)
    held[0, 3] = held[3, 0] = False
    assert [(pair.first, pair.second) for pair in pairs(columns, held)] == [(1, 5)]


def test_the_level_of_one_index_is_that_of_normal_outputs():
    random, bins = np.random.default_rng(6), indices.Bins(np.random.default_rng(5).random(120))
    outputs = random.normal(size=(120, 40_000))
    outputs -= outputs.mean(axis=0)
    found = indices.given_data_indices(bins, outputs / np.linalg.norm(outputs, axis=0))
    # A quantile of 40,000 has a standard error of 0.001 in its probability.
    assert np.mean(found > indices.level_of_normal(bins, 0.05)) == pytest.approx(0.05, abs=0.004)
    assert np.isnan(indices.level_of_normal(indices.Bins(np.arange(5.0)), 0.05))


def test_an_input_is_not_told_for_the_effect_of_one_that_it_goes_with():
    factors = [f"x{k + 1}" for k in range(40)]
    points = FEW.points(dict.fromkeys(factors), 1)
    first, second, correlation, _ = max(pairs(points, every(40)), key=lambda p: abs(p.correlation))
    assert abs(correlation) > 0.4
    noise = 0.5 * np.random.default_rng(2).normal(size=250)
    found = analyse(drawn_campaign(FEW, lambda x: noise - 3 * x[:, first], 40, 1))
    index = found.given_data_index.sel(output="asynchrony_max", input=factors[second])
    assert index > found.chance_level.sel(output="asynchrony_max", input=factors[second])
    table = what_matters(found)
    names = [row[1] for row in table.rows]
    assert names[0] == factors[first]
    assert factors[second] not in names
    (note,) = (note for note in table.notes if note.startswith("these inputs are correlated"))
    assert f"r = {correlation:+.2f}" in note
    assert f"asynchrony_max by {factors[second]}" in table.notes[-1]
    assert note.partition(":")[0] in "".join(told(found, full=True))
    both = analyse(drawn_campaign(FEW, lambda x: noise - 3 * x[:, first] + 3 * x[:, second], 40, 1))
    assert {factors[first], factors[second]} <= {row[1] for row in what_matters(both).rows}


def test_a_mean_and_its_places_are_no_pair():
    friction = np.random.default_rng(6).random((200, 16))
    made = drawn_campaign(RandomDesign(samples=200), lambda x: x[:, 0], 1, 1)
    made["friction"] = ("sample", "pulley"), friction, {"role": "input", "path": "friction"}
    words = np.random.default_rng(7).choice(["a", "b", "c"], 200)
    made["end"] = "sample", words, {"role": "input", "path": "end"}
    assert "pair" not in analyse(made).dims
    friction[:, 3] = 0.2 * friction[:, 3] + made["x1"]
    assert set(analyse(made).pair_second.values) >= {
        "pulley 4 of friction",
        "pulleys 1 to 4 of friction",
    }


def test_the_cure_is_of_the_design_and_none_parts_what_is_drawn_so():
    """x1 and x2 are alike but for a tenth of noise, whatever has drawn them."""

    def cure(design, text=""):
        made = drawn_campaign(design, lambda x: x[:, 0], 3, 1).assign_attrs(campaign=text)
        made["x2"][:] = made["x1"] + 0.1 * made["x2"]
        (note,) = (n for n in what_matters(analyse(made)).notes if n.startswith("these inputs are"))
        return note.rpartition(": ")[2]

    assert cure(Sobol(samples=64)) == 'draw more samples, or use design.kind = "random"'
    assert cure(RandomDesign(samples=64)) == "draw more samples"
    text = '[[correlations]]\nbetween = ["x1", "x2"]\ncoefficient = 0.99\n'
    assert cure(RandomDesign(samples=64), text).startswith("they are drawn so")


def test_a_pair_of_few_samples_has_no_share_to_tell():
    """Below the samples that an index takes there is the rank correlation alone."""
    made = drawn_campaign(RandomDesign(kind="random", samples=12), lambda x: x[:, 0], 2, 3)
    made["x2"] = made["x1"].variable ** 2 + 0.1 * made["x2"].variable
    words = " ".join(told(analyse(made)))
    assert "(r = +" in words
    assert "nan" not in words
