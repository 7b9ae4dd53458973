"""What chance alone makes stand out of many inputs is told in one case of twenty at most."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import scipy.stats

from made import drawn_campaign
from ringsim.analysis import indices
from ringsim.analysis.influence_text import what_matters, what_separates
from ringsim.analysis.study import analyse
from ringsim.analysis.worst import worst_tables
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
@pytest.mark.parametrize("samples", [12, 90])
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


def _group(samples: int, inside: int) -> np.ndarray:
    group = np.zeros(samples, dtype=bool)
    group[np.random.default_rng(samples).choice(samples, inside, replace=False)] = True
    return group


@pytest.mark.parametrize("inside", [2, 4, 9])
def test_the_chance_of_a_separation_is_that_of_all_groups(inside: int) -> None:
    """Of columns with ties, with two values and with none; also of most of the samples."""
    random, samples = np.random.default_rng(inside), 12
    kinds = [random.random(samples), random.integers(0, 4, samples), random.random(samples) > 0.6]
    columns, group = np.stack(kinds, axis=1).astype(float), _group(samples, inside)
    ranks = indices.centred_ranks(columns)
    groups = itertools.combinations(range(samples), inside)
    sums = np.abs([ranks[list(each)].sum(axis=0) for each in groups])
    truth = (sums >= np.abs(ranks[group].sum(axis=0)) - 1e-9).mean(axis=0)
    assert indices.area_chances(columns, group) == pytest.approx(truth)


@pytest.mark.parametrize(("samples", "inside"), [(60, 15), (1000, 4), (1000, 15), (300, 40)])
def test_the_chance_of_a_separation_of_many_samples(samples: int, inside: int) -> None:
    """scipy counts all groups of columns without ties."""
    group = _group(samples, inside)
    for shift in (0.0, 0.1, 0.3):
        column = np.random.default_rng(5).random(samples) + shift * group
        truth = scipy.stats.mannwhitneyu(column[group], column[~group], method="exact").pvalue
        found = indices.area_chances(column[:, None], group)[0]
        assert found == pytest.approx(truth, rel=0.05 if truth > 1e-3 else 0.6)
        # A word that 30 samples have is Fisher's exact test.
        word = (column > np.sort(column)[-31]) + 0.0
        hits = int(word[group].sum())
        law = scipy.stats.hypergeom(samples, 30, inside)
        every = np.arange(inside + 1)
        far = np.abs(every - law.mean()) >= abs(hits - law.mean()) - 1e-9
        found = indices.area_chances(word[:, None], group)[0]
        assert found == pytest.approx(law.pmf(every)[far].sum())


def test_small_groups_of_many_inputs_are_separated_by_chance_in_one_case_of_20() -> None:
    random, told = np.random.default_rng(3), []
    for _ in range(NOISE):
        columns = random.random((32, 60))
        columns[:, 40:] = columns[:, 40:] > 0.87
        chances = indices.area_chances(columns, _group(32, int(random.integers(3, 8))))
        told.append(chances.min() < indices.chance_of_each(60))
    assert np.mean(told) <= MOST  # few groups are rare enough: less than one in 20


def test_what_all_failures_have_is_named_among_many_inputs() -> None:
    """4 of 32 rings whose motor stops, and they alone, are lost, among 80 inputs."""

    def lost(x: np.ndarray) -> np.ndarray:
        return x[:, 4] >= np.sort(x[:, 4])[-4]

    made = drawn_campaign(RandomDesign(samples=32), lambda x: x[:, 0], 80, 1, lost=lost)
    column = made["x5"].values
    made["x5"] = "sample", (column >= np.sort(column)[-4]) + 0.0, made["x5"].attrs
    found = analyse(made)
    assert [row[1] for row in what_separates(found).rows] == ["x5"]
    (table,) = worst_tables(found, "made")
    assert all(row[2].startswith("x5 1") for row in table.rows)
    assert found.separation_chance.sel(input="x5").item() == pytest.approx(1 / math.comb(32, 4))


def test_few_samples_of_many_inputs_are_judged_by_plain_correlations() -> None:
    """Of 16 samples that hold seven others even 0.9 is chance: what decides would not be told."""

    def output(x: np.ndarray) -> np.ndarray:
        return x[:, 1] + 0.1 * x[:, 0]

    found = analyse(drawn_campaign(RandomDesign(samples=16), output, 8, 2))
    assert not np.isfinite(found.asynchrony_max_partial_rank_correlation).any()
    assert [row[1] for row in what_matters(found).rows] == ["x2"]
    more = analyse(drawn_campaign(RandomDesign(samples=24), output, 8, 2))
    assert np.isfinite(more.asynchrony_max_partial_rank_correlation).all()


@pytest.mark.parametrize(("samples", "inside"), [(256, 4), (500, 12), (300, 20), (400, 25)])
def test_the_chance_of_a_separation_by_columns_with_ties_is_no_less_than_it_is(
    samples: int, inside: int
) -> None:
    """Of many samples: mostly zeros, counts, three values."""
    random = np.random.default_rng(samples)
    zeros = np.where(random.random(samples) < 0.97, 0.0, random.random(samples))
    three = random.choice([0.0, 1.0, 2.0], samples, p=[0.05, 0.9, 0.05])
    columns = np.stack([zeros, random.poisson(2.0, samples) + 0.0, three], axis=1)
    chances = []
    for _ in range(2000):
        group = np.zeros(samples, dtype=bool)
        group[random.choice(samples, inside, replace=False)] = True
        chances.append(indices.area_chances(columns, group))
    told = np.array(chances)
    for level in (0.05, 0.01):
        most = level + 3.0 * (level * (1.0 - level) / 2000) ** 0.5
        assert (told < level).mean(axis=0).max() <= most
    # None of the few that differ: the commonest group is no surprise.
    group = np.zeros(samples, dtype=bool)
    group[np.flatnonzero(zeros == 0.0)[:inside]] = True
    assert indices.area_chances(columns[:, :1], group)[0] > 0.3
