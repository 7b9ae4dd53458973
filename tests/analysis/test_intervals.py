"""Intervals of 95 % hold the truth in 92 to 98 of 100 campaigns, for every design."""

from __future__ import annotations

import numpy as np
import pytest

from made import campaign, points, response
from ringsim.analysis import indices, intervals
from ringsim.analysis.design import Placement
from ringsim.analysis.intervals import samples_needed, share_bounds, share_interval
from ringsim.analysis.study import STATISTICS, interval_of, placed_share_interval

CAMPAIGNS = 1000


@pytest.fixture(scope="module")
def truth():
    grid = (np.arange(160) + 0.5) / 160
    values = response(np.stack(np.meshgrid(grid, grid, grid), axis=-1)).ravel()
    return {
        np.mean: values.mean(), intervals.spread: values.std(),
        **{p: np.quantile(values, p) for p in (0.05, 0.5, 0.95)},
        "share": np.mean(values > 2.3),
    }  # fmt: skip


def share_covered(ends, true):
    low, high = ends
    known = np.isfinite(low + high)
    assert known.mean() > 0.9
    return np.mean((low[known] <= true) & (true <= high[known]))


@pytest.mark.parametrize(
    ("samples", "statistics"),
    [(100, [np.mean, intervals.spread]), (100, [0.05, 0.5, 0.95])],
)
def test_independent_samples_are_covered(samples, statistics, truth):
    values = response(np.random.default_rng(1).random((CAMPAIGNS, samples, 3)))
    for each in statistics:
        if callable(each):
            ends = intervals.of_independent(values, each)
        else:
            ends = intervals.quantile_of_independent(values, each)
        assert 0.92 <= share_covered(ends, truth[each]) <= 0.98


DRAWN = {
    "normal": (lambda rng, shape: rng.standard_normal(shape), 1.0, 0.93),
    "uniform": (lambda rng, shape: rng.random(shape), 12**-0.5, 0.93),
    "exponential": (lambda rng, shape: rng.exponential(size=shape), 1.0, 0.88),
    "lognormal, 0.5": (lambda rng, shape: np.exp(0.5 * rng.standard_normal(shape)), 0.6039, 0.88),
    # The fourth moment of this one is not known from so few: 95 % are out of reach.
    "lognormal, 1": (lambda rng, shape: np.exp(rng.standard_normal(shape)), 2.1612, 0.79),
}
"""Draws, their standard deviation, and what an interval of 95 % of it must hold at least."""


@pytest.mark.parametrize("samples", [20, pytest.param(50, marks=pytest.mark.slow), 200])
@pytest.mark.parametrize("name", DRAWN)
def test_standard_deviations_with_long_tails_are_held_as_told(name, samples):
    """BCa: 0.82 of the exponential with 20 samples, 0.59, 0.71, 0.81 of the last."""
    draw, true, least = DRAWN[name]
    values = draw(np.random.default_rng(5), (CAMPAIGNS, samples))
    low, high = intervals.of_independent(values, intervals.spread)
    held = np.mean((low <= true) & (true <= high))
    assert least - 0.02 * (samples == 20 and least < 0.8) <= held <= 0.98, held


def test_a_spread_that_resamples_do_not_tell_has_no_interval():
    one = np.zeros(100)
    one[0] = 1.0
    assert np.isnan(intervals.of_independent(one, intervals.spread)).all()
    alike = np.full(20, 20 / 3) + 8.9e-16 * (np.arange(20) % 3 == 0)  # but for round-off
    assert np.ptp(alike) > 0
    low, high = intervals.of_independent(alike, intervals.spread)
    assert not high > 1e-13  # or there is none
    assert not low < 0.0


def test_many_independent_samples_are_covered_by_the_normal_limit(truth):
    samples = intervals.LARGE + 1
    values = response(np.random.default_rng(2).random((CAMPAIGNS, samples, 3)))
    for each in (np.mean, intervals.spread):
        assert 0.92 <= share_covered(intervals.of_independent(values, each), truth[each]) <= 0.98


@pytest.mark.parametrize("kind", [pytest.param("sobol", marks=pytest.mark.slow), "latin-hypercube"])
def test_replicates_of_designs_are_covered(kind, truth):
    samples, replicates = 256, 8
    all_points = [points(kind, samples, replicates, seed) for seed in range(CAMPAIGNS)]
    values, which = response(np.array(all_points)), np.arange(samples) % replicates
    for each in (np.mean, intervals.spread):
        ends = intervals.of_replicates(values, which, each)
        assert 0.92 <= share_covered(ends, truth[each]) <= 0.98
    for level in (0.05, 0.5, 0.95):
        rows = [intervals.quantile_of_replicates(row, which, level) for row in values]
        ends = np.transpose(rows)
        assert 0.92 <= share_covered(ends, truth[level]) <= 0.98
    above = (values > 2.3).astype(float)
    ends = intervals.of_replicates(above, which, np.mean)
    assert 0.92 <= share_covered(ends, truth["share"]) <= 0.98


def test_exact_intervals_of_shares_are_covered():
    """200 samples and a share of a third: 95 % at least, by construction."""
    counts = np.random.default_rng(3).binomial(200, 1 / 3, CAMPAIGNS)
    each = {count: share_interval(count, 200) for count in set(counts.tolist())}
    ends = np.array([each[count] for count in counts.tolist()]).T
    assert 0.94 <= share_covered(ends, 1 / 3) <= 0.98


def test_a_bootstrap_of_one_latin_hypercube_would_be_wrong(truth):
    """Why it has no intervals: they would be several times too long."""
    values = response(np.array([points("latin-hypercube", 64, 1, seed) for seed in range(200)]))
    assert share_covered(intervals.of_independent(values, np.mean), truth[np.mean]) == 1.0


@pytest.mark.parametrize("kind", ["grid", "list", ""])
def test_designs_without_a_population_have_no_intervals(kind):
    placed = Placement(kind, population=False, independent=False)
    assert not placed.has_intervals
    ends = interval_of(np.arange(50.0), np.arange(50), placed)
    assert ends.shape == (len(STATISTICS), 2)
    assert np.isnan(ends).all()


def test_values_that_are_all_alike_have_an_interval_of_no_length():
    low, high = intervals.of_independent(np.full((2, 20), 3.0), np.mean)
    assert low.tolist() == high.tolist() == [3.0, 3.0]


def test_round_off_is_no_spread() -> None:
    """Sections that are all alike run apart by it: the same in all samples; as soon as one of them
    is told as more than 0.0000 deg, they differ.
    """
    noise = 1e-11 * np.random.default_rng(5).random(40)
    assert intervals.numbers(campaign(noise), "asynchrony_max").tolist() == 40 * [0.0]
    assert not intervals.varies(campaign(noise), "asynchrony_max")
    assert intervals.varies(campaign(np.append(noise, 1e-4)), "asynchrony_max")


def test_few_samples_have_no_interval():
    assert np.isnan(intervals.of_independent(np.arange(7.0), np.mean)[0])
    assert intervals.ranks(58, 0.95) is None
    assert np.isnan(intervals.quantile_of_independent(np.arange(58.0), 0.95)).all()
    one = np.zeros(16, dtype=int)
    assert np.isnan(intervals.of_replicates(np.arange(16.0), one, np.mean)).all()


def test_ranks_of_a_large_campaign_hold_the_level():
    from scipy.stats import binom

    low, high = intervals.ranks(100_000, 0.05)
    held = binom.cdf(high - 1, 100_000, 0.05) - binom.cdf(low - 1, 100_000, 0.05)
    assert 0.95 <= held <= 0.951
    assert low < 5000 < high


@pytest.mark.parametrize(
    ("violations", "probability", "confidence", "samples"),
    [(0, 0.99, 0.9, 230), (0, 0.99865, 0.9, 1705), (0, 0.9, 0.95, 29), (1, 0.99, 0.9, 388)],
)
def test_samples_that_show_a_probability(violations, probability, confidence, samples):
    assert samples_needed(violations, probability, confidence) == samples
    for count, shown in ((samples, True), (samples - 1, False)):
        low, _ = share_bounds(count - violations, count, confidence)
        assert (low >= probability) == shown


def test_replicates_that_agree_by_chance_make_no_estimate_exact() -> None:
    """Four replicates of eight have the same share, median, correlation: counts are few."""
    values = np.tile(np.arange(8.0), 4)
    replicate = np.repeat(np.arange(4), 8)
    for statistic in (np.mean, intervals.spread):
        found = intervals.of_replicates(values, replicate, statistic)
        assert np.array(found) == pytest.approx(
            np.array(intervals.of_independent(values, statistic))
        )
        assert found[0] < found[1]
    # A constant shift, but for round-off, is no scatter.
    shifts = (values + 0.1) - values
    assert np.ptp(shifts) > 0.0
    found = intervals.of_replicates(shifts, replicate, np.mean)
    assert np.array(found) == pytest.approx([0.1, 0.1])
    assert np.isnan(intervals.quantile_of_replicates(values, replicate, 0.95)).all()
    median = intervals.quantile_of_replicates(values, replicate, 0.5)
    assert median == tuple(float(e) for e in intervals.quantile_of_independent(values, 0.5))
    assert median[1] > median[0]
    # All samples alike leave no doubt, and replicates that scatter tell by how much.
    assert intervals.of_replicates(np.ones(32), replicate, np.mean) == (1.0, 1.0)
    scattered = values + 0.01 * replicate
    low, high = intervals.of_replicates(scattered, replicate, np.mean)
    assert low < high
    both = replicate, replicate
    ends = intervals.of_difference(values, values + 1.0, both)
    assert ends[1] - ends[0] > 2.0 * values.std() / 32**0.5

    def measure(rows: np.ndarray) -> np.ndarray:
        return np.array([values[rows].mean(), scattered[rows].mean()])

    given = measure, replicate, np.asarray, np.asarray
    lows, highs = indices.replicate_interval(*given, doubt=True)
    assert np.isnan([lows[0], highs[0]]).all()
    assert lows[1] < highs[1]
    lows, highs = indices.replicate_interval(*given)  # as of an index that is none
    assert lows[0] == highs[0]


def test_shares_of_replicates_that_agree_have_the_exact_interval() -> None:
    own, index = np.arange(320) // 4 < 20, np.arange(320)  # twenty of eighty in each of four
    placed = Placement("latin-hypercube", population=True, independent=False, replicates=4)
    assert placed_share_interval(own, index, placed) == share_interval(80, 320)
    own[0] = False
    assert placed_share_interval(own, index, placed) != share_interval(79, 320)
