"""Whole analyses of synthetic campaigns hold the truth as often as they say, for every design."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from made import campaign, points, response
from ringsim.analysis.design import placement
from ringsim.analysis.intervals import ranks, share_bounds
from ringsim.analysis.study import QUANTILES, STATISTICS, interval_of, placed_share_interval
from ringsim.analysis.verdicts import bounds

LIMIT = 2.3
DESIGNS = [("random", 1), ("sobol", 8), ("latin-hypercube", 8)]


@pytest.fixture(scope="module")
def truth():
    grid = (np.arange(160) + 0.5) / 160
    values = response(np.stack(np.meshgrid(grid, grid, grid), axis=-1)).ravel()
    found = {"mean": values.mean(), "standard_deviation": values.std()}
    found |= {name: np.quantile(values, level) for name, level in QUANTILES.items()}
    return found | {"share": np.mean(values > LIMIT)}


def least_and_most(campaigns):
    """Counts beyond which an interval of 95 % is found wanting: 92 to 98 %, and chance once in a
    thousand times of those who keep to that.
    """
    return binom.ppf(5e-4, campaigns, 0.92), binom.ppf(1 - 5e-4, campaigns, 0.98)


@pytest.mark.parametrize("campaigns", [40, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("kind", "replicates"), DESIGNS)
def test_intervals_of_an_analysis_cover(kind, replicates, campaigns, truth):
    """Mean, deviation, quantiles, share as ``ringsim analyse`` gives them; one-sided bounds."""
    samples = 256
    inside, below, above = dict.fromkeys([*truth], 0), 0, 0
    low_wanted = high_wanted = 0.9
    for seed in range(campaigns):
        values = response(points(kind, samples, replicates, seed))
        design = {"kind": kind, "samples": samples, "replicates": replicates}
        made = campaign(values, design=design)
        placed, index = placement(made), made["sample"].to_numpy()
        ends = interval_of(values, index, placed)
        own = values > LIMIT
        rows = dict(zip(STATISTICS, ends, strict=True)) | {
            "share": placed_share_interval(own, index, placed)
        }
        for name, true in truth.items():
            low, high = rows[name]
            inside[name] += low <= true <= high
        low, high = bounds(own, index, (low_wanted, high_wanted), placed)
        below += low <= truth["share"]
        above += high >= truth["share"]
    least, most = least_and_most(campaigns)
    for name, count in inside.items():
        assert least <= count <= most, (name, count)
    # Bounds are never less sure than asked for; those of replicates are the wider of two.
    assert min(below, above) >= binom.ppf(5e-4, campaigns, 0.9)


def test_openturns_agrees_with_exact_bounds_and_ranks():
    ot = pytest.importorskip("openturns", reason="extra oracle")
    for count, samples, confidence in ((3, 50, 0.9), (97, 100, 0.95), (230, 231, 0.99)):
        low, high = share_bounds(count, samples, confidence)
        beyond = ot.Binomial(samples, low).computeComplementaryCDF(count - 1)
        assert beyond == pytest.approx(1 - confidence, rel=1e-6)
        assert ot.Binomial(samples, high).computeCDF(count) == pytest.approx(1 - confidence)
    for samples, level in ((100, 0.5), (200, 0.95), (59, 0.05)):
        low, high = ranks(samples, level)
        own = ot.Binomial(samples, level)
        assert own.computeCDF(high - 1) - own.computeCDF(low - 1) >= 0.95


def test_openturns_agrees_with_rank_correlations():
    ot = pytest.importorskip("openturns", reason="extra oracle")
    from ringsim.analysis.indices import centred_ranks, correlations, partial_correlations

    columns = points("random", 300, 1, 7)
    output = response(columns)
    theirs = ot.CorrelationAnalysis(ot.Sample(columns), ot.Sample(output[:, None]))
    np.testing.assert_allclose(
        correlations(centred_ranks(columns), output), theirs.computeSpearmanCorrelation(), rtol=1e-9
    )
    np.testing.assert_allclose(
        partial_correlations(centred_ranks(columns), output), theirs.computePRCC(), rtol=1e-9
    )
