"""Arithmetic of shares: intervals of one, exact, and of differences; samples that are needed."""

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


def _score(count: int, samples: int) -> Interval:
    """The two-sided score interval of a share.  Source: Wilson, J. Am. Stat. Ass. 22 (1927)."""
    low, high = binomtest(count, samples).proportion_ci(LEVEL, method="wilson")
    return float(low), float(high)


def difference_of_shares(first: tuple[int, int], second: tuple[int, int]) -> Interval:
    """Interval of 95 % of the second share minus the first, of independent samples; each is a count
    and the samples it is of.

    Source: Newcombe, Statistics in Medicine 17 (1998) 873, method 10.

    >>> [round(end, 4) for end in difference_of_shares((48, 80), (56, 70))]
    [0.0524, 0.3339]
    """
    return _apart(first[0] / first[1], second[0] / second[1], _score(*first), _score(*second), 0.0)


def difference_of_pairs(both: int, first: int, second: int, neither: int) -> Interval:
    """Interval of 95 % of the second share minus the first among pairs, by how many pairs are of
    the kind in both, in the first alone, in the second alone and in neither.

    Source: Newcombe, Statistics in Medicine 17 (1998) 2635, method 10.
    """
    count, product = both + first + second + neither, float(both * neither - first * second)
    margins = (both + first) * (second + neither) * (both + second) * (first + neither)
    if product > 0:  # corrected for continuity
        product = max(product - count / 2, 0.0)
    one, other = both + first, both + second
    return _apart(
        one / count, other / count, _score(one, count), _score(other, count),
        product / margins**0.5 if margins else 0.0,
    )  # fmt: skip


def _apart(one: float, other: float, ends: Interval, others: Interval, together: float) -> Interval:
    """The second minus the first from the interval of each and their correlation."""

    def half(mine: float, its: float) -> float:
        square = mine**2 - 2 * together * mine * its + its**2
        return float(max(square, 0.0) ** 0.5)

    middle = other - one
    return (
        middle - half(other - others[0], ends[1] - one),
        middle + half(others[1] - other, one - ends[0]),
    )
