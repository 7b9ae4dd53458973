"""Exact arithmetic of shares: intervals after Clopper and Pearson, and samples that are needed."""

from scipy.stats import binom, binomtest

from ringsim.analysis.intervals import LEVEL, Interval

_MOST = 1 << 40


def share_interval(count: int, samples: int, level: float = LEVEL) -> Interval:
    """Two-sided exact interval of a share.  Source: Clopper and Pearson, Biometrika 26 (1934)."""
    low, high = binomtest(count, samples).proportion_ci(level, method="exact")
    return float(low), float(high)


def share_bounds(count: int, samples: int, confidence: float) -> Interval:
    """The lower and the upper one-sided bound of a share, each with the confidence by itself."""
    low = binomtest(count, samples, alternative="greater").proportion_ci(confidence, "exact").low
    high = binomtest(count, samples, alternative="less").proportion_ci(confidence, "exact").high
    return float(low), float(high)


def samples_needed(violations: int, probability: float, confidence: float) -> int:
    """The least number of samples, so many of them violations, that shows a probability.

    It is shown when fewer violations, or as many, would come with a probability of at most
    1 - confidence if the antenna just missed it.

    >>> samples_needed(0, 0.99, 0.9), samples_needed(0, 0.99865, 0.9)
    (230, 1705)
    """
    low, high = violations, violations + 1
    while not _shows(violations, high, probability, confidence) and high < _MOST:
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        if _shows(violations, middle, probability, confidence):
            high = middle
        else:
            low = middle
    return high


def _shows(violations: int, samples: int, probability: float, confidence: float) -> bool:
    return bool(binom.cdf(violations, samples, 1.0 - probability) <= 1.0 - confidence)
