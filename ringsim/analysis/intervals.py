"""Intervals of means, spreads, quantiles and shares."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ringsim.outputs import COORDINATES, OUTPUTS, VARIABLES
from ringsim.outputs.family import Array
from ringsim.variables import GOALS, OF_CAMPAIGNS, Status, Variable

if TYPE_CHECKING:
    import xarray as xr

# Intervals of means, spreads and quantiles of independent samples, and of replicates of designs.
#
# Points of one Sobol or Latin hypercube design depend on each other: what scatters independently is
# its replicates.  All functions take the samples along the last axis.


Interval = tuple[float, float]
"""Lower and upper end; NaN where there is none."""
LEVEL = 0.95
"""Level of all two-sided intervals."""
NONE: Interval = (np.nan, np.nan)
RESAMPLES = 1999
LARGE = 2000
"""Samples from which on the normal limit is taken: there it differs from the bootstrap by less than
the bootstrap from itself with another seed, and resamples of so many take much memory.
"""
LEAST_OF_BOOTSTRAP = 8
"""Samples below which bootstrap intervals are too short, Efron and Tibshirani (1993)."""
_FLAT = 0.5
"""Least fourth moment over the variance's square, less 1, that is believed of a resample: few
samples may be of two values, whose moments tell of no error.  Uniform values have 0.8.
"""


def spread(values: Array, axis: int = -1) -> Array:
    """Standard deviation with n - 1 in the denominator; NaN of a single value."""
    if values.shape[axis] < 2:
        return np.full(np.delete(values.shape, axis), np.nan)
    return np.asarray(np.std(values, axis=axis, ddof=1))


def quantile(values: Array, probability: float | Sequence[float]) -> Array:
    """Quantiles of samples as all tables and figures tell them: numpy's, linear between ranks."""
    return np.asarray(np.quantile(values, probability, axis=-1))


NOTHING = 1e-12
"""Size in SI units below which a number is what rounding leaves: that of numbers of order one,
1e-16, after some thousand operations.  Nothing that a ring's outputs are told in is so small."""
ROUND_OFF = 1e-9
"""Range over the largest value below which values differ by rounding alone: steps are found to no
more digits."""


def all_alike(least: Array | float, most: Array | float) -> Any:
    """Whether values of that range are the same but for rounding, each of them.

    >>> bool(all_alike(19.999999999999996, 20.0)), bool(all_alike(-1e-17, 3e-17))
    (True, True)
    >>> bool(all_alike(0.25, 0.26))
    False
    """
    largest = np.maximum(np.abs(least), np.abs(most))
    with np.errstate(invalid="ignore"):  # of infinite ones
        near = np.subtract(most, least) <= ROUND_OFF * largest
    return np.equal(least, most) | near | (largest < NOTHING)


ALIKE = 1e-3
"""Range of an output over its size below which no digit that tables give of it changes."""


def hardly_apart(least: float, most: float) -> bool:
    """Whether values of that range are the same to all digits that tables give."""
    return bool(most - least < ALIKE * max(abs(least), abs(most))) or bool(all_alike(least, most))


ONE_DECIDES = "one sample decides it"
"""Instead of an interval that says nothing."""


def of_one(deviation: float, farthest: float, count: int) -> bool:
    """Whether one of so many values, the ``farthest`` from their mean, makes more than half of the
    sum of squares: their standard deviation is then a number about that value alone.
    """
    return 2.0 * farthest**2 > (count - 1) * deviation**2


def of_independent(values: Array, statistic: Callable[..., Any]) -> tuple[Array, Array]:
    """Interval of the mean (``np.mean``) or of the ``spread`` of independent samples.

    Of the mean that of ``_of_mean``; of the spread that of ``_of_spread``; from LARGE samples on
    the normal limit.  NaN below 8 samples.
    """
    count = values.shape[-1]
    if count < LEAST_OF_BOOTSTRAP:
        none = np.full(values.shape[:-1], np.nan)
        return none, none
    if count > LARGE:
        return _limit(values, statistic)
    alike = np.asarray(all_alike(values.min(axis=-1), values.max(axis=-1)))
    # Values that are all alike have no bootstrap distribution: they are told as they are.
    told = np.where(alike[..., None], np.arange(count), values)
    known = statistic(values, axis=-1)
    if statistic is np.mean:
        low, high = np.moveaxis(np.apply_along_axis(_of_mean, -1, told), -1, 0)
    else:
        low, high = _of_spread(told)
    return np.where(alike, known, low), np.where(alike, known, high)


@lru_cache(maxsize=16)
def _resamples(count: int) -> NDArray[np.int64]:
    """Places of the samples of all resamples, shape (RESAMPLES, count), the same for all outputs
    of so many samples, of which there are LARGE at most.
    """
    return np.random.default_rng(0).integers(0, count, (RESAMPLES, count))


@lru_cache(maxsize=2)
def _times(count: int) -> Array:
    """How often each sample is in each of these, over the count, shape (RESAMPLES, count)."""
    cells = _resamples(count) + np.arange(RESAMPLES)[:, None] * count
    times = np.bincount(cells.ravel(), minlength=RESAMPLES * count).reshape(RESAMPLES, count)
    return times / count


def _of_mean(values: Array) -> Array:
    """Interval of the mean of values, shape (n,), by the bootstrap with bias correction and
    acceleration (BCa), Efron (1987); shape (2,).
    """
    known, means = values.mean(), values[_resamples(len(values))].mean(axis=1)
    below = ((means < known).sum() + (means <= known).sum()) / (2 * RESAMPLES)
    apart, shift = values - known, scipy.special.ndtri(below)
    bend = (apart**3).sum() / (6 * (apart**2).sum() ** 1.5)
    far = shift + scipy.special.ndtri([(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    levels = scipy.special.ndtr(shift + far / (1 - bend * far))
    return np.asarray(np.quantile(means, levels))


def _of_spread(values: Array) -> tuple[Array, Array]:
    """Interval of the spread: of two by the fourth moment the farther ends, bootstrap-t of the
    logarithm, which sees long tails, and Bonett's, which suits few samples.

    NaN where resamples tell nothing, as of values that are alike but for a few.  BCa is shorter,
    and held the spread less often: see docs/guide/requirements.md.
    Sources: Efron and Tibshirani, An introduction to the bootstrap (1993), section 12.5; Bonett,
    Computational Statistics and Data Analysis 50 (2006) 775, equation 3.
    """
    count, known = values.shape[-1], spread(values)
    scaled = (values - values.mean(axis=-1, keepdims=True)) / known[..., None]
    powers = np.stack([scaled**k for k in (1, 2, 3, 4)])
    one, two, three, four = powers @ _times(count).T
    square = (two - one**2) * count / (count - 1)
    fourth = four - 4 * three * one + 6 * two * one**2 - 3 * one**4
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.log(square) / 2 / _log_error(np.sqrt(square), fourth, count)
    ranked = np.sort(np.where(np.isfinite(far), far, -np.inf), axis=-1)
    place = round((1 - LEVEL) / 2 * (RESAMPLES + 1))  # the 50th of 1,999, and as far from above
    error = _log_error(np.ones_like(known), np.mean(powers[3], axis=-1), count)
    normal = float(scipy.special.ndtri(0.5 + LEVEL / 2))
    cut = int(count / (2 * np.sqrt(count - 4)))
    middle = np.sort(scaled, axis=-1)[..., cut : count - cut].mean(axis=-1, keepdims=True)
    fourth = count * ((scaled - middle) ** 4).sum(axis=-1) / (count - 1) ** 2
    fewer = count / (count - normal)
    # Never negative but by round-off, of values that are alike but for that.
    square = np.maximum(fourth - (count - 3) / count, 0.0) / (count - 1)
    half = normal * fewer * np.sqrt(square) / 2
    ends = (
        np.minimum(-ranked[..., RESAMPLES - place] * error, np.log(fewer) / 2 - half),
        np.maximum(-ranked[..., place - 1] * error, np.log(fewer) / 2 + half),
    )
    sound = np.isfinite(ends[0]) & np.isfinite(ends[1])
    low, high = (known * np.exp(np.where(sound, end, np.nan)) for end in ends)
    return low, high


def _log_error(deviation: Array, fourth: Array, count: int) -> Array:
    """Standard error of the logarithm of a spread, by the fourth moment; 0 where there is none."""
    safe = np.where(deviation > 0, deviation, 1.0)
    return np.asarray(np.sqrt(np.maximum(fourth / safe**4 - 1.0, _FLAT) / count) / 2)


def _limit(values: Array, statistic: Callable[..., Any]) -> tuple[Array, Array]:
    """The normal limit; of the spread's logarithm, whose variance the fourth moment gives."""
    count, deviation = values.shape[-1], spread(values)
    wide = scipy.special.stdtrit(count - 1, 0.5 + LEVEL / 2)
    if statistic is np.mean:
        half, mean = wide * deviation / np.sqrt(count), values.mean(axis=-1)
        return mean - half, mean + half
    fourth = np.mean((values - values.mean(axis=-1, keepdims=True)) ** 4, axis=-1)
    log = wide * _log_error(deviation, fourth, count)
    return deviation * np.exp(-log), deviation * np.exp(log)


_FAR = 6.0
"""Standard deviations of a count beyond which no rank is sought: 1e-9 of all counts."""


@cache
def ranks(count: int, probability: float) -> tuple[int, int] | None:
    """Ranks, from 1, between which a quantile lies with at least LEVEL; None if there are none.

    The closest pair of ranks, for any continuous distribution; of those as close the one with the
    most equal tails, and of two alike the lower.  Source: David and Nagaraja, Order Statistics
    (2003), section 7.1.

    >>> ranks(100, 0.5), ranks(58, 0.05), ranks(59, 0.05)
    ((40, 60), None, (1, 10))
    """
    middle, spread = count * probability, math.sqrt(count * probability * (1.0 - probability))
    least = max(1, int(middle - _FAR * spread) - 1)
    most = min(int(middle + _FAR * spread) + 2, count)
    below = scipy.special.bdtr(np.arange(least - 1, most, dtype=float), count, probability)
    # below[k] is the probability that rank least + k lies above the quantile.
    best: tuple[float, ...] | None = None
    for low in range(len(below)):
        high = int(np.searchsorted(below, below[low] + LEVEL))
        if high < len(below):
            # Rounded: around the median pairs come in twos whose tails are each other's mirror.
            tails = round(abs(below[low] - (1.0 - below[high])), 9)
            best = min(filter(None, [best, (high - low, tails, low)]))
    if best is None:
        return None
    return least + int(best[2]), least + int(best[2] + best[0])


def quantile_of_independent(values: Array, probability: float) -> tuple[Array, Array]:
    """Interval of a quantile of independent samples between two of their values."""
    if (found := ranks(values.shape[-1], probability)) is None:
        none = np.full(values.shape[:-1], np.nan)
        return none, none
    ordered = np.sort(values, axis=-1)
    return ordered[..., found[0] - 1], ordered[..., found[1] - 1]


def of_replicates(
    values: Array, replicate: NDArray[np.int64], statistic: Callable[..., Any]
) -> tuple[Array, Array]:
    """Interval of the mean or of the ``spread`` from independent replicates of a design.

    Jackknife that leaves out one replicate at a time, with Student's t; of the spread's logarithm.
    ``replicate``, shape (n,), tells to which one each sample belongs.  NaN for a single one; of
    ``agreeing`` ones the interval of independent samples.
    Source: Shao and Tu, The Jackknife and Bootstrap (1995), section 2.
    """
    centre, scatter, count = _jackknife(values, replicate, statistic)
    half, alike = student(count) * scatter, agreeing(values, scatter)
    low, high = centre - half, centre + half
    if statistic is not np.mean:
        low, high = centre * np.exp(-half), centre * np.exp(half)
    if not alike.any():
        return low, high
    ends = of_independent(values, statistic)
    return np.where(alike, ends[0], low), np.where(alike, ends[1], high)


def _jackknife(
    values: Array, replicate: NDArray[np.int64], statistic: Callable[..., Any]
) -> tuple[Array, Array, int]:
    """Estimate, its standard error (of the logarithm unless it is the mean), and replicates."""
    which = np.unique(replicate)
    centre = np.asarray(statistic(values, axis=-1))
    if len(which) < 2:
        return centre, np.full(centre.shape, np.nan), len(which)
    left_out = np.array([statistic(values[..., replicate != r], axis=-1) for r in which])
    if statistic is not np.mean:
        # Where one replicate has all the spread there is no telling; none at all is no doubt.
        left_out = np.log(np.where(left_out > 0, left_out, np.where(centre > 0, np.nan, 1.0)))
    return centre, jackknife_error(left_out), len(which)


def agreeing(values: Array, error: Array) -> Mask:
    """Where replicates agree but for round-off in an estimate from values, shape (..., n), that
    differ, by its standard error, shape (...): counts do so by chance, and always where a stratum
    decides them, which does not make the estimate exact.
    """
    size, spread = np.abs(values).max(axis=-1), np.ptp(values, axis=-1)
    return np.asarray((spread > ROUND_OFF * size) & (error <= ROUND_OFF * spread))


def jackknife_error(left_out: Array) -> Array:
    """Standard error from the estimates without each of the replicates, shape (replicates, ...)."""
    squares = ((left_out - left_out.mean(axis=0)) ** 2).sum(axis=0)
    return np.asarray(np.sqrt(squares * (len(left_out) - 1) / len(left_out)))


def agree(values: Array, replicate: NDArray[np.int64]) -> bool:
    """Whether all replicates have the same mean of values, shape (n,), that differ."""
    return bool(agreeing(values, _jackknife(values, replicate, np.mean)[1]))


def student(replicates: int) -> float:
    """Half length of an interval over the standard error from so many replicates."""
    if replicates < 2:
        return np.nan
    return float(scipy.special.stdtrit(replicates - 1, 0.5 + LEVEL / 2))


def quantile_of_replicates(
    values: Array, replicate: NDArray[np.int64], probability: float
) -> Interval:
    """Interval of a quantile of values, shape (n,), from independent replicates of a design.

    The shares of the replicates below the quantile scatter; what their interval leaves open is
    read off the distribution of all samples.  NaN if it reaches beyond that.  Where all have the
    same share, as of a quantile that is the largest value, the interval of independent samples.
    Source: Woodruff, J. Am. Statistical Association 47 (1952).
    """
    below = (values <= quantile(values, probability)).astype(float)
    _, scatter, count = _jackknife(below, replicate, np.mean)
    if count > 1 and scatter <= ROUND_OFF:
        low, high = quantile_of_independent(values, probability)
        return float(low), float(high)
    half, least = student(count) * float(scatter), 0.5 / len(values)
    # The k-th of n values stands for the level (k - 1/2) / n: Hazen's definition.
    if not least <= probability - half <= probability + half <= 1.0 - least:
        return NONE
    low, high = np.quantile(values, [probability - half, probability + half], method="hazen")
    return float(low), float(high)


def standard_error(values: Array, replicate: NDArray[np.int64] | None) -> tuple[Array, int]:
    """Standard error of the mean of independent samples, or of independent replicates (given which
    one each sample belongs to; of ``agreeing`` ones as of independent samples), and its degrees of
    freedom; NaN if there is one alone.
    """
    if replicate is not None:
        _, error, count = _jackknife(values, replicate, np.mean)
        if (alike := agreeing(values, error)).any():
            error = np.where(alike, spread(values) / values.shape[-1] ** 0.5, error)
        return error, count - 1
    count = values.shape[-1]
    if count < 2:
        return np.full(values.shape[:-1], np.nan), 0
    return spread(values) / count**0.5, count - 1


def of_difference(
    first: Array, second: Array, replicates: tuple[NDArray[np.int64] | None, ...] = (None, None)
) -> tuple[Array, Array]:
    """Interval of the mean of the second minus that of the first, which are not paired.

    Student's t with the degrees of freedom of Welch, Biometrika 34 (1947).
    """
    apart = second.mean(axis=-1) - first.mean(axis=-1)
    (one, free), (other, more) = (
        standard_error(values, which)
        for values, which in zip((first, second), replicates, strict=True)
    )
    if min(free, more) < 1:
        return apart + np.nan, apart + np.nan
    both = one**2 + other**2
    each = one**4 / free + other**4 / more
    half = np.sqrt(both) * scipy.special.stdtrit(
        both**2 / np.where(each > 0, each, 1.0), 0.5 + LEVEL / 2
    )
    half = np.where(each > 0, half, 0.0)  # no scatter at all leaves no doubt
    return apart - half, apart + half


def by_signs(ends: tuple[Any, Any], apart: Array) -> tuple[Any, Any]:
    """The interval of a mean of pairs' differences, with zero in it where so few make it (above 1 %
    of the largest) that chance may have given them one sign (2 / 2^k), and all signs tell no more.
    """
    made = np.count_nonzero(np.abs(apart) > 0.01 * np.abs(apart).max(initial=0.0))
    signs = scipy.stats.binomtest(np.count_nonzero(apart > 0.0), np.count_nonzero(apart) or 1)
    told = min(2.0 ** (1 - made), signs.pvalue) <= 1.0 - LEVEL or made == len(apart)
    return ends if told or np.isnan(ends).any() else (min(ends[0], 0.0), max(ends[1], 0.0))


# Arithmetic of shares: intervals of one, exact, and of differences; samples that are needed.


def share_interval(count: int, samples: int) -> Interval:
    """Two-sided exact interval of a share."""
    return share_bounds(count, samples, 0.5 + LEVEL / 2)


def share_bounds(count: float, samples: float, confidence: float) -> Interval:
    """The lower and the upper one-sided bound of a share, each with the confidence by itself;
    effective numbers of samples are not whole ones.

    Source: Clopper and Pearson, Biometrika 26 (1934).
    """
    inverse, others = scipy.special.betaincinv, samples - count
    least = float(inverse(count, others + 1, 1 - confidence)) if count > 0 else 0.0
    most = float(inverse(count + 1, others, confidence)) if others > 0 else 1.0
    return least, most


def samples_needed(violations: int, probability: float, confidence: float) -> int:
    """The least number of samples, so many of them violations, that shows a probability.

    It is shown when fewer violations, or as many, would come with a probability of at most
    1 - confidence if the antenna just missed it.

    >>> samples_needed(0, 0.99, 0.9), samples_needed(0, 0.99865, 0.9)
    (230, 1705)
    """
    others = scipy.special.nbdtrik(confidence, violations + 1, 1.0 - probability)
    return violations + 1 + int(np.ceil(others - 1e-9))  # but for round-off a whole number


def _score(count: int, samples: int) -> Interval:
    """The two-sided score interval of a share.  Source: Wilson, J. Am. Stat. Ass. 22 (1927)."""
    share, far = count / samples, scipy.special.ndtri(0.5 + LEVEL / 2) ** 2 / samples
    half = math.sqrt(far * (share * (1.0 - share) + far / 4.0))
    low, high = ((share + far / 2.0 + side * half) / (1.0 + far) for side in (-1.0, 1.0))
    return max(float(low), 0.0), min(float(high), 1.0)


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


# The numbers of a result that statistics are about, and the samples whose numbers hold.


Mask = NDArray[np.bool_]
"""One truth for each sample."""
CHECKED = "_checked"
"""How names of the full engine's answers end in the file of a campaign."""


def quantities() -> dict[str, Variable]:
    """All numbers without dimensions that tell of the antenna, and are no places; all of the user's
    own, whatever their names end with.
    """
    places = COORDINATES.keys() - {"time"}
    return {
        each.name: each
        for output in OUTPUTS if output.of_antenna
        for each in output.variables
        if not each.dims and each.flags is None and each.dtype != "str"
        and (each.name.rpartition("_")[2] not in places or OF_CAMPAIGNS in output.needs)
    }  # fmt: skip


TWIN = "same_as"
"""Attribute of an output that has the values of another one in all samples."""


class Twins:
    """Finds outputs that are the same in all samples, but for round-off."""

    def __init__(self) -> None:
        self._seen: dict[str, list[tuple[str, Array]]] = {}

    def of(self, name: str, values: Array) -> str:
        """The output asked for before that has the same values; empty if none has."""
        others = self._seen.setdefault(quantities()[name].units, [])
        twin = next((other for other, own in others if _equal(own, values)), "")
        if not twin:
            others.append((name, values))
        return twin


def _equal(first: Array, second: Array) -> bool:
    """Cheaply if they are not, as most differ in the first few."""
    return all(
        np.allclose(first[part], second[part], rtol=1e-9, atol=0.0, equal_nan=True)
        for part in (slice(0, 8), slice(None))
    )


def of_both_engines() -> set[str]:
    """Outputs that both engines compute by the same code, so that neither judges the other."""
    return {each.name for output in OUTPUTS if output.of_both for each in output.variables}


def is_moment(output: str) -> bool:
    """Whether it is when a peak was: what it depends on is told at length alone."""
    known = quantities().get(output)
    if known is None or OF_CAMPAIGNS in VARIABLES[output].needs:
        return False
    return output.endswith("_time") and not known.badness


def numbers(campaign: xr.Dataset, name: str) -> Array:
    """A variable over samples as floats, NaN where it is missing, or the variable itself is."""
    if name not in campaign:
        return np.full(campaign.sizes["sample"], np.nan)
    values = campaign.variables[name].to_numpy().astype(float)
    if (known := quantities().get(name.removesuffix(CHECKED))) is None:
        return values
    if known.dtype.startswith("i"):  # missing counts are negative
        return np.where(values < 0, np.nan, values)
    return np.where(np.abs(values) < 0.5 * known.round_off, 0.0, values)


def good(campaign: xr.Dataset) -> Mask:
    """Which samples have numbers that hold."""
    return np.asarray(campaign.variables["status"].to_numpy() == Status.OK)


def varies(campaign: xr.Dataset, name: str) -> bool:
    """Whether an output differs between samples by more than rounding and its numerical error."""
    known = np.isfinite(numbers(campaign, name)[good(campaign)]).any()
    return bool(known) and bool(np.isnan(same_within(campaign, name)))


def same_within(campaign: xr.Dataset, name: str) -> float:
    """The root mean square of the error bars of an output if no sample is farther from the mean
    than that, so that one value suits all; 0 if they differ by rounding alone, NaN if by more.
    """
    own, bars = (numbers(campaign, each)[good(campaign)] for each in (name, f"{name}_error"))
    own, bars = own[np.isfinite(own)], bars[np.isfinite(bars)]
    if not len(own) or all_alike(own.min(), own.max()):
        return 0.0
    if not len(bars):
        return np.nan
    bar = float(np.sqrt(np.mean(bars**2)))
    return bar if np.abs(own - own.mean()).max() <= bar else np.nan


def tells_of(campaign: xr.Dataset, name: str) -> Mask:
    """Which samples tell of a variable: they have a value of it, or ended before what it is about
    happened.  The others reached their goal with a model that does not compute it.
    """
    done = np.zeros(campaign.sizes["sample"], dtype=bool)
    if "outcome" in campaign:
        done = np.isin(campaign.variables["outcome"].to_numpy(), GOALS)
    return np.asarray(good(campaign) & ~(done & np.isnan(numbers(campaign, name))))


def lost(campaign: xr.Dataset) -> Mask:
    """Which samples have run and given no numbers that hold."""
    return np.asarray(campaign.variables["status"].to_numpy() >= Status.SOLVER_FAILED)


def ran(campaign: xr.Dataset) -> Mask:
    """Which samples have run; the others are neither lost nor without a value."""
    return np.asarray(campaign.variables["status"].to_numpy() >= Status.OK)


def used(campaign: xr.Dataset) -> xr.Dataset:
    """The samples whose numbers hold; the others are told, and never counted."""
    return campaign.isel(sample=np.flatnonzero(good(campaign)))


def worst_sample(campaign: xr.Dataset, variable: Variable, badness: int | None = None) -> int:
    """The sample whose numbers hold with the worst value; -1 without a value, or where neither end
    is the worse one.  Of equal ones the first.  ``badness`` is the variable's own by default.
    """
    badness = variable.badness if badness is None else badness
    values = badness * numbers(campaign, variable.name)
    known = good(campaign) & np.isfinite(values)
    if not badness or not known.any():
        return -1
    return int(campaign["sample"].to_numpy()[np.argmax(np.where(known, values, -np.inf))])
