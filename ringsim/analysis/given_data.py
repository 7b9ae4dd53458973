"""First-order indices from samples of any design, without blocks of runs."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.stats import f, rankdata

from ringsim.analysis.intervals import Array, jackknife_error, student
from ringsim.analysis.ranks import chance_of_each

LEAST = 40
"""Samples below which no index is given."""
PARTS = 20
"""Parts of independent samples, each of which the jackknife leaves out once."""
_FEW_VALUES = 12
"""Different values of a column up to which each is a bin of its own."""
_LEVEL = 0.95
_SHUFFLES = 199
_NUMBERS = 4_000_000
"""Numbers that all shuffles of an output may take, about."""
_MANY = 20_000
"""Samples from which on indices by chance are those of a normal output."""


class Bins:
    """The bins of one column: about n^(1/3) with as many samples each, or one for each value."""

    def __init__(self, column: Array) -> None:
        values, codes = np.unique(column, return_inverse=True)
        count = len(column)
        self.lined = len(values) > _FEW_VALUES
        """Whether a line is fitted in each bin, along the ranks; else a mean."""
        if self.lined:
            bins = max(2, round(count ** (1 / 3)))
            rank = rankdata(column) - 0.5
            self.bin = np.minimum((rank * bins / count).astype(np.int64), bins - 1)
            self.place = rank * bins / count - self.bin - 0.5
        else:
            self.bin, self.place = codes.astype(np.int64), np.zeros(count)
        self.count = int(self.bin.max()) + 1


def index(bins: Bins, output: Array, part: NDArray[np.int64]) -> tuple[float, Array]:
    """First-order index of a column, and the estimates that leave out each part.

    The share of the output's variance that a line in each bin explains, less what it would explain
    by chance, as in the adjusted coefficient of determination.  What is left is a bias downwards
    by the bend of the mean output within bins, of the order n^(-4/3) for smooth outputs.
    Sources: Plischke, Borgonovo and Smith, European Journal of Operational Research 226 (2013),
    for binning; Ezekiel, Methods of Correlation Analysis (1930), for the correction.
    """
    parts = int(part.max()) + 1
    y, x = output - output.mean(), bins.place
    cell = bins.bin * parts + part

    def summed(weight: Array | None) -> Array:
        """By bin and by what is left out: nothing, then each part; shape (1 + parts, bins)."""
        cells = np.bincount(cell, weight, minlength=bins.count * parts).reshape(-1, parts)
        whole = cells.sum(axis=1, keepdims=True)
        return np.asarray(np.hstack([whole, whole - cells]).T, dtype=float)

    n, sx, sxx = summed(None), summed(x), summed(x * x)
    found = _adjusted(bins.lined, (n, sx, sxx), summed(y), summed(x * y), summed(y * y).sum(axis=1))
    return float(found[0]), found[1:]


def _adjusted(
    lined: bool, columns: tuple[Array, Array, Array], sy: Array, sxy: Array, syy: Array
) -> Array:
    """Indices from sums over bins, along the last axis: ``columns`` are those of 1, x and x^2."""
    n, sx, sxx = columns
    full = np.maximum(n, 1.0)
    explained = sy**2 / full
    free = (n > 0).sum(axis=-1) - 1.0
    if lined:
        spread = sxx - sx**2 / full
        sloped = spread > 1e-12
        along = (sxy - sx * sy / full) ** 2
        explained = explained + np.where(sloped, along / np.where(sloped, spread, 1.0), 0.0)
        free = free + sloped.sum(axis=-1)
    samples = n.sum(axis=-1)
    total = syy - sy.sum(axis=-1) ** 2 / np.maximum(samples, 1.0)
    left = syy - explained.sum(axis=-1)
    known = (total > 0) & (samples - 1 > free)
    spare = np.where(known, samples - 1 - free, 1.0)
    found = 1 - left / np.where(known, total, 1.0) * (samples - 1) / spare
    return np.asarray(np.where(known, found, np.nan))


def interval(estimate: float, left_out: Array) -> tuple[float, float]:
    """Interval from the estimates that leave out independent parts, with Student's t.

    Delete-a-group jackknife: Kott, Journal of Official Statistics 17 (2001).
    """
    half = student(len(left_out)) * float(jackknife_error(left_out))
    return estimate - half, estimate + half


def indices(bins: Bins, centred: Array) -> Array:
    """Indices of a column with many outputs less their means, shape (samples, outputs), of which
    none is missing.
    """
    count, samples = len(centred), np.arange(len(centred))

    def by_bin(weight: Array) -> csr_array:
        return csr_array((weight, (bins.bin, samples)), shape=(bins.count, count))

    one, along = by_bin(np.ones(count)), by_bin(bins.place)
    sums = one.sum(axis=1), along.sum(axis=1), by_bin(bins.place**2).sum(axis=1)
    squares = np.einsum("ij,ij->j", centred, centred)
    return _adjusted(bins.lined, sums, (one @ centred).T, (along @ centred).T, squares)


def chance_level(columns: Sequence[Bins], output: Array) -> float:
    """The largest index of all columns that an output of chance reaches in one case of 20.

    From the same shuffles of the output, shape (samples,), for all columns, so that what these have
    in common counts; NaN if no column has an index.
    Source: Westfall and Young, Resampling-Based Multiple Testing (1993), the largest statistic.
    Of many samples the distribution F tells the same, with Sidak's correction: within 7 % of the
    shuffles where the kurtosis is below a hundredth of the samples.
    """
    scatter = output - output.mean()
    if len(output) >= _MANY and (scatter**4).mean() < 0.01 * len(output) * scatter.var() ** 2:
        each = chance_of_each(len(columns))
        return float(np.fmax.reduce([level_of_normal(bins, each) for bins in columns]))
    random = np.random.default_rng(0)
    shuffles = int(np.clip(_NUMBERS // len(output), 39, _SHUFFLES))
    y = output - output.mean()
    shuffled = np.stack([random.permutation(y) for _ in range(shuffles)], axis=1)
    largest = np.full(shuffles, np.nan)
    for bins in columns:
        largest = np.fmax(largest, indices(bins, shuffled))
    return float(np.quantile(largest, _LEVEL))


def level_of_normal(bins: Bins, chance: float) -> float:
    """The index that a normal output without influence exceeds with so small a probability.

    By the distribution F of explained over other variance; NaN if too few samples are left.
    """
    count, terms = len(bins.bin), bins.count * (1 + bins.lined) - 1
    spare = count - 1 - terms
    if spare < 1:
        return np.nan
    explained = terms * float(f.isf(chance, terms, spare)) / spare
    return 1 - (count - 1) / spare / (1 + explained)
