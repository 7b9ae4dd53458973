"""Estimates from samples with weights, and their intervals."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta, t

from ringsim.analysis.intervals import LEVEL, NONE, Array, Interval
from ringsim.analysis.quantities import Mask
from ringsim.analysis.ranks import replicate_interval

_FEW = 10
"""Samples of a kind, and of the others, below which replicates do not tell its share."""
LEAST_OF_SHARE = 10.0
"""Effective samples on either side below which the scatter of weights tells no interval of a share
or a quantile: what matters may be where there is hardly a sample.
"""
LEAST_OF_MEAN = 50.0
"""Effective samples that decide a mean below which its interval is too short: with 300 samples and
weights exp(0.6 x) it holds the mean of x in 94 of 100 campaigns (110 decide), that of exp(x) in 86
(43), and with exp(1.2 x) in 85 (42) and 71 (18).
"""
Replicate = NDArray[np.int64] | None
"""The replicate that each sample belongs to; None if all are independent."""


def effective(weights: Array) -> float:
    """Number of samples of equal weight that would tell as much; Kish, Survey Sampling (1965)."""
    if not len(weights) or weights.max() == 0.0:
        return 0.0
    own = weights / weights.max()  # squares of large ones would overflow
    return float(own.sum() ** 2 / (own**2).sum())


def mean(values: Array, weights: Array) -> float:
    """Weighted mean."""
    return float(weights @ values / weights.sum())


def mean_interval(
    values: Array, weights: Array, replicate: Replicate, level: float = LEVEL
) -> Interval:
    """Interval of the weighted mean, with Student's t.

    Of independent samples by the linearised variance of a ratio, with one degree of freedom less
    than effective samples; else by the jackknife over replicates.
    Source: Owen, Monte Carlo theory, methods and examples (2013), section 9.2.
    """
    centre = mean(values, weights)
    if replicate is not None:
        low, high = replicate_interval(
            lambda rows: np.array(mean(values[rows], weights[rows])), replicate,
            np.asarray, np.asarray, level,
        )  # fmt: skip
        return float(low), float(high)
    free = effective(weights) - 1
    if free < 1:
        return NONE
    half = float(t.ppf(0.5 + level / 2, free)) * _error(values, weights, centre)
    return centre - half, centre + half


def _error(values: Array, weights: Array, centre: float) -> float:
    """Standard error of a weighted mean of independent samples."""
    free = effective(weights) - 1
    squares = float((weights**2) @ (values - centre) ** 2)
    return float(np.sqrt(squares * (1 + 1 / free)) / weights.sum())


def share_interval(
    own: Mask, weights: Array, replicate: Replicate, level: float = LEVEL
) -> Interval:
    """Interval of the weighted share of some samples.

    The exact one for as many samples as would have that standard error; where none or all are of
    the kind, for the effective ones.  Source: Korn and Graubard, Survey Methodology 24 (1998).
    """
    share, few = mean(own.astype(float), weights), min(own.sum(), (~own).sum()) < _FEW
    share = 1.0 if own.all() else share  # not a bit less by round-off
    if replicate is not None and not few:
        low, high = mean_interval(own.astype(float), weights, replicate, level)
        return max(0.0, low), min(1.0, high)
    count = effective(weights)
    if count <= 2:
        return NONE
    if 0 < share < 1:
        error = _error(own.astype(float), weights, share)
        count = share * (1 - share) / error**2
        # Fewer degrees of freedom than the count tells: t instead of the normal distribution.
        wide = t.ppf(0.5 + level / 2, [len(own) - 1, max(effective(weights) - 1, 1)])
        count *= float(wide[0] / wide[1]) ** 2
    hits, tail = share * count, (1 - level) / 2
    low = beta.ppf(tail, hits, count - hits + 1) if share > 0 else 0.0
    high = beta.ppf(1 - tail, hits + 1, count - hits) if share < 1 else 1.0
    return float(low), float(high)


def decisive_of_mean(values: Array, weights: Array) -> float:
    """Effective number of samples that decide the error of a weighted mean."""
    return effective(np.abs(weights * (values - mean(values, weights))))


def decisive_of_share(own: Mask, weights: Array) -> float:
    """Effective number of samples of the kind, or of the others where these are fewer."""
    return min(effective(weights[own]), effective(weights[~own]))


def quantile(values: Array, weights: Array, probability: float) -> float:
    """Quantile of the weighted distribution; NaN beyond the middles of the outermost weights."""
    order = np.argsort(values)
    level = (np.cumsum(weights[order]) - 0.5 * weights[order]) / weights.sum()
    if not level[0] <= probability <= level[-1]:
        return np.nan
    return float(np.interp(probability, level, values[order]))


def quantile_interval(
    values: Array, weights: Array, probability: float, replicate: Replicate
) -> Interval:
    """Interval of a weighted quantile: where the interval of the share below it reaches to.

    Source: Woodruff, J. Am. Statistical Association 47 (1952).
    """
    middle = quantile(values, weights, probability)
    if np.isnan(middle) or decisive_of_share(values <= middle, weights) < LEAST_OF_SHARE:
        return NONE
    low, high = share_interval(values <= middle, weights, replicate)
    found = quantile(values, weights, low), quantile(values, weights, high)
    return NONE if np.isnan(sum(found)) else found
