"""Indices of functions that have known ones, behind a test of what is missing."""

from __future__ import annotations

import numpy as np
import pytest
import scipy
from SALib.analyze import morris as salib_morris
from SALib.analyze import sobol as salib_sobol

from made import (
    UNIT,
    campaign,
    drawn_campaign,
    grouped,
    ishigami,
    ishigami_indices,
    points,
    response,
)
from ringsim.analysis import indices
from ringsim.analysis.design import blocks_of, placement
from ringsim.analysis.indices import dependence
from ringsim.analysis.influence_text import sensitivity_tables
from ringsim.analysis.intervals import of_independent, spread
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told
from ringsim.sampling.designs.blocks import Morris, Saltelli
from ringsim.sampling.designs.independent import LatinHypercube, RandomDesign, Sobol
from ringsim.variables import Fate, Status

PAIR = {"pair": ("x1", "x2")}
# Of 1,000 campaigns the share that holds the truth has a standard error of 0.7 %, of 80 2.4 %.
FEW, MANY = (80, 0.87, 1.0), (1000, 0.92, 0.98)
SOME = [pytest.param(FEW, id="few"), pytest.param(MANY, id="many", marks=pytest.mark.slow)]


def covered(ends, true):
    ends = np.array(ends)
    return np.mean((ends[..., 0] <= true) & (true <= ends[..., 1]), axis=0)


def blocked(function, design, seed):
    """Outputs by block, three inputs."""
    factors = dict.fromkeys(("x1", "x2", "x3"), _Plain())
    values = function(design.points(factors, seed))
    return values.reshape(design.samples, -1)


class _Plain:
    each_section = False


@pytest.mark.parametrize(
    ("name", "lost"),
    [
        ("ishigami", 0.0),
        ("grouped", 0.05),
        pytest.param("ishigami", 0.05, marks=pytest.mark.slow),
        pytest.param("grouped", 0.0, marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("case", SOME)
def test_intervals_of_sobol_indices_cover(name, case, lost):
    """Also with 5 % of the rows lost at random, and with them a quarter of the blocks."""
    campaigns, least, most = case
    design, function = Saltelli(samples=256), ishigami
    true = np.concatenate(ishigami_indices())
    if name == "grouped":
        design, function = Saltelli(samples=256, groups=PAIR), grouped
        true = np.array([1 / 6, 1 / 3, 2 / 3, 5 / 6])
    ends, which = [], np.arange(256) % 8
    for seed in range(campaigns):
        values = blocked(function, design, seed)
        kept = ~(np.random.default_rng(seed).random(values.shape) < lost).any(axis=1)
        ends.append(indices.indices_with_intervals(values[kept], len(true) // 2, which[kept])[1])
    share = covered(ends, true)
    assert ((share >= least) & (share <= most)).all(), share


@pytest.mark.parametrize("case", SOME)
def test_intervals_of_indices_of_failures_cover(case):
    """Of exceeding 8, 9 % of all samples; truth from 2^19 blocks."""
    campaigns, least, most = case

    def beyond(x):
        return (ishigami(x) > 8.0).astype(float)

    true = [0.158, 0.071, 0.133, 0.725, 0.517, 0.675]
    ends = [
        indices.indices_with_intervals(
            blocked(beyond, Saltelli(samples=1024), seed), 3, np.arange(1024) % 8
        )[1]
        for seed in range(campaigns)
    ]
    share = covered(ends, np.array(true))
    assert ((share >= least) & (share <= most)).all(), share


def test_indices_are_those_of_salib_s_own_analysis():
    design = Saltelli(samples=64, second_order=True)
    values = blocked(ishigami, design, 3)
    problem = {"num_vars": 3, "names": list("abc"), "bounds": [[0, 1]] * 3}
    known = salib_sobol.analyze(problem, values.ravel(), num_resamples=2, seed=1)
    found = indices.sobol_indices(values, 3)
    # It scales by the spread of all rows, and centres by their mean; ours by those of A and B.
    np.testing.assert_allclose(found[3:6], known["ST"], rtol=1e-9)
    np.testing.assert_allclose(found[:3], known["S1"], atol=0.02)
    second = [known["S2"][j, k] for j, k in indices.pairs(3)]
    np.testing.assert_allclose(found[6:], second, atol=0.04)


def test_a_bootstrap_over_the_blocks_of_one_sequence_would_be_too_long():
    """Why one replicate has no intervals: 60 campaigns of 60 would hold the truth."""
    true, random = ishigami_indices()[1][1], np.random.default_rng(0)
    hits = 0
    for seed in range(60):
        values = blocked(ishigami, Saltelli(samples=512, replicates=1), seed)
        chosen = random.integers(512, size=(30, 512))
        again = [indices.sobol_indices(values[each], 3) for each in chosen]
        centre, scatter = indices.sobol_indices(values, 3)[4], np.std(again, axis=0, ddof=1)[4]
        hits += abs(centre - true) < 1.96 * scatter
    assert hits == 60
    found = analyse(drawn_campaign(Saltelli(samples=64, replicates=1), ishigami, 3, 0))
    assert np.isnan(found.total_index_interval).all()
    assert any("no intervals: set design.replicates = 8" in line for line in told(found))


@pytest.mark.parametrize("function", [ishigami, lambda x: x[:, 0] - 0.3 * x[:, 1]])
def test_too_few_base_samples_are_told_by_what_no_index_can_be(function):
    for design, few in ((Saltelli(samples=16), True), (Saltelli(samples=8, replicates=1), True),
                        (Saltelli(samples=512), False)):  # fmt: skip
        found = analyse(drawn_campaign(design, function, 3, 1))
        lines = [line for line in told(found) if line.startswith("too few base samples: ")]
        assert len(lines) == few


def test_a_first_order_index_above_the_total_one_is_told_if_their_intervals_are_apart():
    found = analyse(drawn_campaign(Saltelli(samples=2048), lambda x: x[:, 0], 3, 1))
    assert not sensitivity_tables(found)[0].notes
    found.first_order_index_interval[0, 0] = found.total_index_interval[0, 0] + 0.02
    (note,) = sensitivity_tables(found)[0].notes
    assert "first-order indices above total indices of asynchrony_max" in note


@pytest.mark.quick
def test_a_part_of_the_runs_has_the_replicates_of_the_design():
    """The interval of a mean, by hand from the means of replicates; all rows and A and B alone."""
    made = drawn_campaign(Saltelli(samples=64, replicates=4), ishigami, 3, 2)
    rows, number = made["block_row"].values, made["sample"].values
    drawn = np.isin(rows, ["A", "B"])
    stream = np.random.default_rng(5)
    every = {"but the last": number[:-1], "mixed": stream.permutation(number)[:250],
             "A and B": number[drawn], "every other": number[number // 5 % 2 == 0]}  # fmt: skip
    for name, chosen in every.items():
        part = made.isel(sample=chosen)
        assert placement(part).block == 5, name
        own = chosen[drawn[chosen]]
        values = made["asynchrony_max"].values[own]
        means = [values[own // 5 % 4 == k].mean() for k in np.unique(own // 5 % 4)]
        low, high = analyse(part)["asynchrony_max_interval"].sel(statistic="mean").values
        half = scipy.stats.t.ppf(0.975, len(means) - 1) * np.std(means, ddof=1) / len(means) ** 0.5
        assert (high - low) / 2 == pytest.approx(half, rel=0.1), name


def test_samples_lost_at_random_cost_whole_blocks_and_are_told():
    random = np.random.default_rng(5)
    made = drawn_campaign(
        Saltelli(samples=512), ishigami, 3, 2, lost=lambda x: random.random(len(x)) < 0.05
    )
    found = analyse(made).sel(output="asynchrony_max")
    assert found.index_used + found.index_lost == 512
    assert 80 < found.index_lost < 160  # 1 - 0.95^5 = 23 %
    assert found.missing == (made.status != 0).sum()
    assert found.missing_by_inputs > 0.05
    for name, true in zip(("first_order_index", "total_index"), ishigami_indices(), strict=True):
        np.testing.assert_allclose(found[name], true, atol=0.12)
    assert any("this does not seem to depend on any input" in line for line in told(analyse(made)))


def test_samples_that_have_not_run_are_not_lost():
    """Also where those that have run first have small inputs."""
    whole = drawn_campaign(RandomDesign(samples=400), ishigami, 3, 2)
    late = np.flatnonzero(whole["x1"].values > np.quantile(whole["x1"].values, 0.75))
    part = whole.copy(deep=True)
    part["status"][late], part["asynchrony_max"][late] = -1, np.nan
    found, alone = analyse(part), analyse(whole.drop_isel(sample=late))
    assert found.index_used.values.tolist() == [300]
    assert found.index_lost.values.tolist() == found.missing.values.tolist() == [0]
    np.testing.assert_allclose(found.given_data_index, alone.given_data_index)
    blocks = drawn_campaign(Saltelli(samples=64), ishigami, 3, 2)
    blocks["status"][52:], blocks["asynchrony_max"][52:] = -1, np.nan
    blocks["status"][7], blocks["asynchrony_max"][7] = Status.TIMEOUT, np.nan
    found = analyse(blocks).sel(output="asynchrony_max")
    # Blocks of five; the eleventh is not complete.
    assert [int(found[f"index_{word}"]) for word in ("used", "lost")] == [9, 1]
    assert (int(found.missing), int(found.missing_lost)) == (1, 1)


@pytest.mark.parametrize("design", [Saltelli(samples=512), RandomDesign(samples=2000)])
def test_samples_lost_by_an_input_close_the_gate_and_are_analysed_themselves(design):
    """Lost beyond a value of x2: a function of x2 alone, whose indices are 1."""
    found = analyse(drawn_campaign(design, ishigami, 3, 2, lost=lambda x: x[:, 1] > 0.95))
    name, dim = ("total_index", "factor") if "factor" in found.dims else (
        "given_data_index", "input")  # fmt: skip
    values = found[name].sel({"output": "asynchrony_max"})
    assert np.isnan(values).all()
    assert found.missing_by_inputs.sel(output="asynchrony_max") < 1e-6
    assert found.missing_by_inputs.isel(output=found.output == "failed runs").isnull().all()
    lost = found[name].sel({"output": "failed runs"}).to_series()
    # Bins are not steps: the last one of 13 holds part of the jump.
    assert lost["x2"] == pytest.approx(1.0, abs=0.12)
    assert abs(lost.drop("x2")).max() < 0.02
    if dim == "factor":
        # About 50 of the samples A and B fail: too few for intervals of first-order indices.
        own = found.sel(output="failed runs", factor="x2")
        assert np.isnan(own.first_order_index_interval).all()
        assert own.total_index_interval[0] < 1.0 < own.total_index_interval[1]
    lines = [
        line for line in told(found) if line.startswith("no sensitivity index for asynchrony_max")
    ]
    assert len(lines) == 1
    assert dim in found.dims


def test_the_gate_shuts_by_chance_in_one_case_of_twenty_at_most():
    random, block = np.random.default_rng(8), np.arange(320) // 5
    columns = np.repeat(random.random((64, 3)), 5, axis=0)
    shut = [dependence(random.random(320) < 0.05, columns, block) < 0.05 for _ in range(100)]
    # Three standard errors above 5 %.
    assert np.mean(shut) < 0.05 + 3 * 0.022


def test_one_lost_sample_is_by_chance_where_no_other_has_its_value():
    """One of n is lost, and one has a rare value: they meet in one case of n, and each of two tests
    (ranks and their distance from the middle) of each input may err.  Shuffles know that to 2 %."""
    random, lost = np.random.default_rng(11), np.arange(40) == 15
    odd = np.where(lost, 8.0, 99.0)[:, None]
    assert dependence(lost, odd) == pytest.approx(2 / 40, rel=0.1)
    assert dependence(lost, np.hstack([odd, random.random((40, 84))])) == 1.0


@pytest.mark.parametrize(("both", "lost", "rare"), [(4, 5, 6), (3, 3, 4), (12, 30, 14)])
def test_the_gate_of_an_input_of_two_values_is_fishers_exact_test(both, lost, rare):
    missing, column = np.zeros((2, 60), dtype=bool)
    missing[:lost] = column[lost - both : lost - both + rare] = True
    rest = [[both, lost - both], [rare - both, 60 - lost - rare + both]]
    exact = scipy.stats.fisher_exact(rest).pvalue
    found = dependence(missing, column[:, None] + 0.0)
    assert found == pytest.approx(2 * exact, rel=0.1 if exact > 1e-3 else 0.4)


def test_the_gate_of_an_input_of_many_values_is_the_rank_sum_test():
    """Of few that are missing, and of few that are not; 999 shuffles or more."""
    random = np.random.default_rng(3)
    x = np.sort(random.random(60))
    for own in ([0, 1, 3, 9, 20], [2, 5, 8, 11, 30, 31, 40]):
        missing = np.isin(np.arange(60), own)
        exact = scipy.stats.mannwhitneyu(x[missing], x[~missing], method="exact").pvalue
        for lost in (missing, ~missing):
            found = indices._as_far(indices.centred_ranks(x[:, None])[:, 0], lost)
            assert found == pytest.approx(exact, abs=4 * np.sqrt(exact / 16_000))


def test_the_gate_shuts_by_chance_as_seldom_where_inputs_are_seldom_other_than_usual():
    random = np.random.default_rng(12)
    shut = []
    for _ in range(300):
        columns = (random.random((40, 10)) < 0.05) + 0.0
        missing = np.isin(np.arange(40), random.choice(40, 2, replace=False))
        shut.append(dependence(missing, columns) < 0.05)
    assert np.mean(shut) < 0.05 + 3 * 0.0126  # three standard errors


def test_one_lost_sample_leaves_the_others_their_index():
    """The sample with the largest x1 has no value, as one that alone has a motor stopped."""
    made = drawn_campaign(
        RandomDesign(samples=60), lambda x: x[:, 0] + 0.1 * x[:, 1], 5, 3,
        lost=lambda x: x[:, 0] == x[:, 0].max(),
    )  # fmt: skip
    made["x2"] = made["x2"].copy(data=np.where(made.status == 0, 99.0, 8.0))
    found = analyse(made)
    assert found.given_data_index.sel(output="asynchrony_max", input="x1") > 0.9
    lines = [line for line in told(found) if "without a value" in line]
    assert len(lines) == 1
    assert "too few to tell whether that depends on an input" in lines[0]


def test_the_gate_sees_an_interaction_by_its_blocks():
    """Lost where x1 and x2 are on the same side: no input by itself has anything to do with it."""
    factors = dict.fromkeys(("x1", "x2", "x3", "x4"), _Plain())
    x = Saltelli(samples=64).points(factors, 4)
    lost = ((x[:, 0] > 0.5) == (x[:, 1] > 0.5)) & (x[:, 2] > 0.8)
    block = np.arange(len(x)) // 6
    assert dependence(lost, x[:, [0, 1, 3]], None) > 0.05
    assert dependence(lost, x[:, [0, 1, 3]], block) < 0.01
    assert np.isnan(dependence(np.zeros(10, dtype=bool), x[:10], block[:10]))
    assert dependence(lost, np.empty((len(lost), 0))) == 1.0  # no input: nothing to go with


def test_statistics_are_of_the_samples_that_stand_for_the_population():
    made = drawn_campaign(Saltelli(samples=256), ishigami, 3, 0)
    found = analyse(made, {"asynchrony_max": {"max": 9.0, "probability": 0.5, "confidence": 0.9}})
    alone = made.isel(sample=made.block_row.isin(["A", "B"]))
    assert found.asynchrony_max_samples.values[0] == found.samples_used.item() == 512
    assert found.asynchrony_max.sel(statistic="mean") == pytest.approx(
        alone.asynchrony_max.mean().item()
    )
    low, high = found.asynchrony_max_interval.sel(statistic="mean").values
    assert low < 3.5 < high


def test_a_part_of_the_blocks_counts_those_of_the_population_alone():
    """Also samples that are no whole blocks: the others repeat most of their values."""
    made = drawn_campaign(Saltelli(samples=16), response, 3, 1)
    rows = made.block_row.values
    for part in (made.isel(sample=slice(0, 43)), made.isel(sample=rows == "A"), made):
        own = np.isin(part.block_row.values, ["A", "B"])
        expected = part.asynchrony_max.values[own].mean()
        found = analyse(part)
        assert found.asynchrony_max.sel(statistic="mean").item() == pytest.approx(expected)
        assert found.asynchrony_max_samples.values[0] == own.sum()


def moved(design, function, seed):
    made = drawn_campaign(design, function, 3, seed)
    blocks = blocks_of(made)
    values = made.asynchrony_max.values.reshape(blocks.rows.shape)
    return made, blocks, indices.effects(values, blocks, ("x1", "x2", "x3"))


def test_effects_are_those_of_salib():
    made, _, found = moved(Morris(samples=30), response, 1)
    x = np.stack([made[f"x{k}"] for k in (1, 2, 3)], axis=1)
    problem = {"num_vars": 3, "names": ["x1", "x2", "x3"], "bounds": [[0, 1]] * 3}
    known = salib_morris.analyze(problem, x, made.asynchrony_max.values, num_levels=4)
    rows = indices.measured(found, np.zeros(3, dtype=bool))[..., 0]
    # A move crosses 2/3 of the range.
    for row, name in zip(rows, ("mu_star", "mu", "sigma"), strict=True):
        np.testing.assert_allclose(row, np.asarray(known[name]) * 2 / 3, rtol=1e-9)


def test_effects_of_a_linear_function_have_no_scatter():
    made, _, found = moved(Morris(samples=10), lambda x: x @ [3.0, -1.5, 0.0], 1)
    np.testing.assert_allclose(found, np.tile([2.0, -1.0, 0.0], (10, 1)), atol=1e-12)
    analysis = analyse(made).sel(output="asynchrony_max")
    np.testing.assert_allclose(analysis.mean_absolute_effect.sel(factor="x2"), 1.0)
    np.testing.assert_allclose(analysis.effect_deviation, 0.0, atol=1e-12)
    assert any(line.startswith("asynchrony_max by x1") for line in told(analyse(made), full=True))


def test_groups_of_many_inputs_have_absolute_effects_alone():
    made = drawn_campaign(Morris(samples=20, groups=PAIR), grouped, 3, 1)
    found = analyse(made).sel(output="asynchrony_max")
    assert np.isnan(found.effect_deviation.sel(factor="pair"))
    assert found.mean_absolute_effect.sel(factor="pair") > 0
    assert found.effect_deviation.sel(factor="x3") > 0


@pytest.mark.parametrize("case", SOME)
def test_intervals_of_effects_cover(case):
    """Truth of x2 from all moves on the grid of 4 levels, each as probable as any other."""
    campaigns, least, most = case
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 4)] * 3, indexing="ij"), axis=-1)
    moves = (ishigami_like(grid)[:, 2:] - ishigami_like(grid)[:, :2]).ravel()
    true = np.abs(moves).mean(), moves.std()
    found = np.array(
        [moved(Morris(samples=60), ishigami_like, seed)[2][:, 1] for seed in range(campaigns)]
    )
    for values, statistic, value in (
        (np.abs(found), np.mean, true[0]), (found, spread, true[1])
    ):  # fmt: skip
        ends = np.stack(of_independent(values, statistic), axis=-1)
        assert least <= covered(ends, value) <= most
    # The mean effect has intervals from 20 trajectories on.
    ends = np.stack(of_independent(np.abs(found[:, :20]), np.mean), axis=-1)
    assert least <= covered(ends, true[0]) <= most


def test_few_trajectories_have_no_intervals():
    for count, known in ((19, [False] * 3), (20, [True, True, False]), (60, [True] * 3)):
        found = moved(Morris(samples=count), ishigami_like, 1)[2]
        ends = indices.measured(found, np.zeros(3, dtype=bool))[..., 1:]
        assert np.isfinite(ends).all(axis=(1, 2)).tolist() == known


def ishigami_like(x):
    """What has no equal moves on a grid, unlike Ishigami's function."""
    return np.exp(x[..., 0] + 0.5 * x[..., 1]) + 2 * x[..., 1] ** 2 * (x[..., 2] - 0.3)


PLAIN = {
    "random": lambda n: RandomDesign(samples=n),
    "latin-hypercube": lambda n: LatinHypercube(samples=n, replicates=8),
}


@pytest.mark.parametrize("kind", PLAIN)
@pytest.mark.parametrize("case", SOME)
def test_intervals_of_given_data_indices_cover(kind, case):
    """Of inputs that matter; those of the third, whose index is 0, are too long."""
    campaigns, least, most = case
    true = ishigami_indices()[0]
    ends = []
    for seed in range(campaigns):
        x = points(kind, 400, 8, seed)
        y = ishigami(x)
        part = np.arange(400) % (indices.JACKKNIFE_PARTS if kind == "random" else 8)
        bins = [indices.Bins(column) for column in x.T]
        ends.append([indices.interval(*indices.index(each, y, part)) for each in bins])
    share = covered(ends, true)
    assert ((share[:2] >= least) & (share[:2] <= most)).all(), share
    assert share[2] >= least


def test_given_data_indices_are_corrected_for_chance():
    """Without the correction an input without influence would have 0.02 at n = 1000."""
    random, found = np.random.default_rng(3), []
    for _ in range(100):
        x, y = random.random((2, 1000))
        found.append(indices.index(indices.Bins(x), y, np.zeros(1000, dtype=int))[0])
    # Standard error of the mean of 100: sqrt(2 * 19) / 1000 / 10 = 0.0006.
    assert abs(np.mean(found)) < 0.002
    levels = [indices.chance_levels([indices.Bins(x)], y[None])[0]]
    assert 0.02 < np.mean(np.array(found) > levels) * 2 < 0.2
    assert levels[0] == pytest.approx(np.quantile(found, 0.95), abs=0.006)


def test_words_are_bins_of_their_own():
    random = np.random.default_rng(3)
    word, noise = random.integers(0, 2, 4000), random.normal(size=4000)
    index, _ = indices.index(indices.Bins(word.astype(float)), 2 * word + noise, word * 0)
    assert index == pytest.approx(0.5, abs=0.03)  # variances 1 and 1


def test_plain_designs_have_first_order_indices_with_intervals_where_parts_are_independent():
    for design in (RandomDesign(samples=800), LatinHypercube(samples=800, replicates=8)):
        found = analyse(drawn_campaign(design, ishigami, 3, 1)).sel(output="asynchrony_max")
        low, high = found.given_data_index_interval.values.T
        assert (low[:2] < ishigami_indices()[0][:2]).all()
        assert (ishigami_indices()[0][:2] < high[:2]).all()
        assert found.chance_level.values == pytest.approx(0.02, abs=0.01)
    sobol = analyse(drawn_campaign(Sobol(samples=1024, replicates=8), ishigami, 3, 1))
    np.testing.assert_allclose(
        sobol.given_data_index.sel(output="asynchrony_max"), ishigami_indices()[0], atol=0.02
    )
    assert np.isnan(sobol.given_data_index_interval).all()
    assert any("asynchrony_max by x2" in line for line in sensitivity_tables(sobol)[0].lines())


def test_pulleys_matter_by_mean_by_quarter_and_by_place():
    random = np.random.default_rng(6)
    friction = random.random((600, 16))
    made = drawn_campaign(RandomDesign(samples=600), lambda x: x[:, 0], 1, 1)
    made["asynchrony_max"] = "sample", friction[:, 4:8].sum(axis=1) + 0.5 * friction[:, 12]
    made["friction"] = ("sample", "pulley"), friction, {"role": "input", "path": "friction"}
    found = analyse(made)
    index = found.given_data_index.sel(output="asynchrony_max").to_series()
    # Variances 4/12 and 0.25/12: quarter 2 has 16/17, its places a quarter of that.
    assert index["pulleys 5 to 8 of friction"] == pytest.approx(16 / 17, abs=0.03)
    assert index["pulley 6 of friction"] == pytest.approx(4 / 17, abs=0.12)
    assert index.filter(regex=r"^pulley \d+ of friction").sum() == pytest.approx(1.0, abs=0.4)
    assert index["mean of friction"] == pytest.approx(4.5**2 / 16 / 4.25, abs=0.08)
    partial = found.asynchrony_max_partial_rank_correlation.to_series()
    assert partial["pulleys 5 to 8 of friction"] > 0.9 > partial["mean of friction"] > 0.3


def test_runs_are_to_be_mended_only_if_they_failed() -> None:
    for status, words in (
        (Status.OK, "set a requirement on the outcome"),
        (Status.TIMEOUT, "run the"),
    ):
        x = np.random.default_rng(4).random((60, 1))
        gone = x[:, 0] > 0.7
        made = campaign(
            np.where(gone, np.nan, x[:, 0]), status=np.where(gone, status, Status.OK),
            outcome=np.where(gone, Fate.PARTLY_DEPLOYED, Fate.DEPLOYED),
        )  # fmt: skip
        made["x1"] = "sample", x[:, 0], {"role": "input", "path": "x1", "distribution": UNIT}
        (line,) = (
            s
            for s in told(analyse(made))
            if s.startswith("no sensitivity index for asynchrony_max")
        )
        assert words in line
        assert ("--retry-failed" in line) == (status == Status.TIMEOUT)


def test_no_cure_is_told_for_the_time_of_what_did_not_happen() -> None:
    """Samples without slack have no time of it, as one wants it; at length it is told."""
    x = np.random.default_rng(4).random((60, 1))
    slack = x[:, 0] > 0.6
    made = campaign(x[:, 0], longest_slack_time=np.where(slack, 2.0 + x[:, 0], np.nan))
    made["x1"] = "sample", x[:, 0], {"role": "input", "path": "x1", "distribution": UNIT}
    found = analyse(made)
    words = "no sensitivity index for longest_slack_time"
    assert not any(words in line for line in told(found))
    assert any(words in line for line in told(found, full=True))
