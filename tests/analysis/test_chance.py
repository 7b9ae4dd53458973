"""What chance alone makes stand out of many inputs is told in one case of twenty at most."""

from __future__ import annotations

import numpy as np
import pytest

from made import drawn_campaign
from ringsim.analysis import indices
from ringsim.analysis.influence_text import what_matters, what_separates
from ringsim.analysis.study import analyse
from ringsim.sampling.designs.independent import RandomDesign, Sobol

NOISE = 400
# The share of 400 campaigns has a standard error of 1.1 %.
LEAST, MOST = 0.05 - 3 * 0.011, 0.05 + 3 * 0.011


def test_the_level_is_that_of_the_largest_index_of_all_columns_by_chance():
    random, none, found = np.random.default_rng(5), np.zeros(100, dtype=int), []
    for _ in range(NOISE // 2):
        columns, output = random.random((20, 100)), random.random(100)
        columns[10:] = (columns[10:] > 0.5) + 0.0
        columns[1] = columns[0] + 0.1 * columns[1]  # alike: no two chances
        bins = [indices.Bins(column) for column in columns]
        largest = max(indices.index(each, output, none)[0] for each in bins)
        found.append(largest > indices.chance_levels(bins, output[None])[0])
    assert LEAST <= np.mean(found) <= MOST


def test_shuffles_of_all_columns_at_once_are_those_one_by_one():
    random, none = np.random.default_rng(6), np.zeros(80, dtype=int)
    columns, output = random.random((4, 80)), random.random(80)
    columns[3] = columns[3] > 0.3
    bins = [indices.Bins(column) for column in columns]
    shuffle = np.random.default_rng(0)
    each = [shuffle.permutation(output) for _ in range(199)]
    largest = [max(indices.index(one, y, none)[0] for one in bins) for y in each]
    assert indices.chance_levels(bins, output[None])[0] == pytest.approx(np.quantile(largest, 0.95))


@pytest.mark.parametrize("measure", [indices.correlations, indices.partial_correlations])
@pytest.mark.parametrize("samples", [12, 60])
def test_the_largest_rank_correlation_by_chance(measure, samples):
    random, among = np.random.default_rng(7), 30 if samples > 40 else 4
    held = among - 1 if measure is indices.partial_correlations else 0
    level, found = indices.largest_by_chance(samples, np.array(held), among), []
    for _ in range(NOISE):
        columns, output = random.random((samples, among)), random.random(samples)
        found.append(np.abs(measure(indices.centred_ranks(columns), output)).max() > level)
    assert LEAST <= np.mean(found) <= MOST
    assert indices.largest_by_chance(5, np.array(3), 3) == np.inf


@pytest.mark.parametrize("design", [pytest.param(RandomDesign(samples=100), marks=pytest.mark.slow),
                                    pytest.param(Sobol(samples=128, replicates=8),
                                                 marks=pytest.mark.slow),
                                    RandomDesign(samples=30)])  # fmt: skip
def test_of_noise_by_many_inputs_nothing_is_told_and_what_matters_still_is(design):
    random, told = np.random.default_rng(8), 0
    for seed in range(20):
        noise = random.random(design.samples)
        made = drawn_campaign(design, lambda _, y=noise: y, 30, seed)
        found = analyse(made)
        told += bool(what_matters(found).rows)
    assert told <= 4  # 5 or more of 20 have a probability of 0.3 % where each has 5 %
    made = drawn_campaign(design, lambda x: x[:, 6] + 0.3 * noise, 30, 1)
    assert what_matters(analyse(made)).rows[0][1] == "x7"


def test_inputs_separate_no_samples_that_are_lost_at_random():
    random, design, told = np.random.default_rng(9), RandomDesign(samples=60), 0
    for seed in range(20):
        gone = random.random(60) < 0.3
        made = drawn_campaign(design, lambda x: x[:, 0], 30, seed, lost=lambda _, g=gone: g)
        told += bool(what_separates(analyse(made)).rows)
    assert told <= 4
    made = drawn_campaign(design, lambda x: x[:, 0], 30, 1, lost=lambda x: x[:, 4] > 0.7)
    assert what_separates(analyse(made)).rows[0][1] == "x5"


def test_inputs_are_chosen_by_the_correlation_that_holds_the_others():
    """A switch beside a strong input: 22 samples hardly show it, unless the latter is held."""

    def output(x):
        return x[:, 0] + 0.3 * (x[:, 1] > 0.5)

    found = analyse(drawn_campaign(RandomDesign(samples=22), output, 3, 4))
    plain = found.asynchrony_max_rank_correlation.sel(input="x2").item()
    partial = found.asynchrony_max_partial_rank_correlation.sel(input="x2").item()
    assert abs(plain) < indices.largest_by_chance(22, np.array(0), 3) < partial
    table = what_matters(found)
    assert [row[1] for row in table.rows] == ["x1", "x2"]
    place = table.head.index("partial rank correlation")
    assert float(table.rows[1][place].split()[0]) == pytest.approx(partial, abs=0.005)


@pytest.mark.parametrize("rare", [0.5, 0.02])
def test_of_many_samples_the_distribution_tells_what_shuffles_do(
    rare: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """39 shuffles give the level with a scatter of some 3 % of itself."""
    random = np.random.default_rng(8)
    columns = [indices.Bins(column) for column in random.random((30, 20_000))]
    output = (random.random(20_000) < rare).astype(float)
    quick = indices.chance_levels(columns, output[None])[0]
    monkeypatch.setattr(indices, "_MANY", 10**9)
    shuffled = indices.chance_levels(columns, output[None])[0]
    assert quick != shuffled
    assert quick == pytest.approx(shuffled, rel=0.1)
