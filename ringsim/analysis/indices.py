"""Measures of how an output goes with inputs: ranks, Sobol' indices, effects, lost runs."""

import itertools
import math
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from statistics import NormalDist
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from ringsim.analysis import intervals
from ringsim.analysis.design import Blocks
from ringsim.analysis.intervals import LEVEL, ROUND_OFF, Mask, jackknife_error, student
from ringsim.stepping.instant import Array

# Rank measures of dependence between columns and an output, with intervals.


_WIDE = NormalDist().inv_cdf(0.5 + LEVEL / 2)
_SPARE = 5
"""Samples beyond the number of inputs, at least, that a partial correlation takes."""
_EACH = 3
"""Samples an input that it takes: of 16 of eight inputs a partial correlation of 0.91 is chance,
where a plain one of 0.76 is none."""
_HALVINGS = 60


def centred_ranks(columns: Array) -> Array:
    """Ranks in every column less their mean; one by one, because all at once take much memory."""
    found = np.empty(columns.shape)
    for k, column in enumerate(columns.T):
        _, place, counts = np.unique(column, return_inverse=True, return_counts=True)
        found[:, k] = _ranks(place, counts) - (len(column) + 1) / 2
    return found


def _ranks(place: NDArray[np.int64], counts: NDArray[np.int64]) -> Array:
    """Ranks from 1, of equal values their mean, from the place of each among the different ones,
    and how often these are there.
    """
    return (np.cumsum(counts) - (counts - 1) / 2)[place]


class Columns:
    """Columns, shape (samples, columns), whose ranks are taken once: of 100,000 samples of 119
    columns that takes two seconds, and each output has several measures.
    """

    def __init__(self, values: Array) -> None:
        self._values = values

    @cached_property
    def _whole(self) -> Array:
        return centred_ranks(self._values)

    def ranks(self, rows: NDArray[np.bool_]) -> Array:
        """Ranks less their mean among some of the rows."""
        return self._whole if rows.all() else centred_ranks(self._values[rows])


def correlations(x: Array, output: Array) -> Array:
    """Rank correlation (Spearman) of every column with the output, from centred ranks ``x``, shape
    (samples, columns).
    """
    y = centred_ranks(output[:, None])[:, 0]
    scale = np.sqrt((x**2).sum(axis=0) * (y**2).sum())
    known = scale > 0
    return np.where(known, (y @ x) / np.where(known, scale, 1.0), np.nan)


def partial_correlations(x: Array, output: Array) -> Array:
    """Rank correlation of each column with the output, the others held, shape (columns,), from
    centred ranks ``x``, shape (samples, columns).

    NaN if samples are too few or columns depend on each other, and of a column that is the same in
    all samples, which has no effect to hold.  Source: Iman and Conover, Technometrics 21 (1979);
    from the inverse of the matrix of correlations.
    """
    moving = (x != 0.0).any(axis=0)
    count, wide = len(x), int(moving.sum())
    found, y = np.full(x.shape[1], np.nan), centred_ranks(output[:, None])
    if count < max(_EACH * wide, wide + 2 + _SPARE) or not wide or not y.any():
        return found
    x = x[:, moving]
    matrix = np.block([[x.T @ x, x.T @ y], [y.T @ x, y.T @ y]])
    scale = np.sqrt(np.diag(matrix))
    matrix = matrix / scale / scale[:, None]
    if np.linalg.cond(matrix) > 1e10:
        return found
    inverse = np.linalg.inv(matrix)
    found[moving] = -inverse[:-1, -1] / np.sqrt(np.diag(inverse)[:-1] * inverse[-1, -1])
    return found


def areas(columns: Array, group: NDArray[np.bool_]) -> Array:
    """Probability that a column is larger in a sample of the group than in another, ties half.

    The area under the receiver's operating curve; 0.5 for what does not separate the group.
    Source: Mann and Whitney, Annals of Mathematical Statistics 18 (1947).
    """
    inside = int(group.sum())
    outside = len(group) - inside
    return np.asarray(0.5 + centred_ranks(columns)[group].sum(axis=0) / (inside * outside))


_COUNTED, _SMALL, _SMALL_OF_TIES = 200, 20, 500
"""Samples up to which all groups are counted; sizes of groups beyond which sums of ranks are normal
(their tails at 1e-4 are then good to 40 %), and of ranks of which most are one."""
_GRID = 1000
"""Ranks that many samples are told apart by."""


def area_chances(columns: Array, group: Mask) -> Array:
    """Probability that the area of a column differs from a half by as much where the group is drawn
    by lot, shape (columns,), of columns, (samples, columns), and who is in the group, (samples,):
    of few failures all may have what a tenth of the samples has, and no normal distribution says
    how rarely.

    Mann and Whitney's statistic (1947; see ``areas``) with ties, of all groups of the size; of
    columns with two values it is Fisher's exact test.
    """
    inside, samples = int(group.sum()), len(group)
    if 2 * inside > samples:
        return area_chances(columns, ~group)
    found = np.ones(columns.shape[1])
    for k, ranks in enumerate(centred_ranks(columns).T):
        values, place, counts = np.unique(ranks, return_inverse=True, return_counts=True)
        normal = _SMALL_OF_TIES if counts.max() > samples / 2 else _SMALL
        if len(values) < 2:
            continue
        if len(values) == 2:
            hits = np.arange(inside + 1)
            chances = scipy.stats.hypergeom.pmf(hits, samples, int(counts[1]), inside)
            sums, apart = values @ [inside - hits, hits], float(ranks[group].sum())
        elif inside > normal:
            spread = inside * (samples - inside) / (samples - 1) * float(np.mean(ranks**2))
            found[k] = 2.0 * scipy.special.ndtr(-abs(ranks[group].sum()) / np.sqrt(spread))
            continue
        else:
            places, sums, chances = _sums(tuple(counts.tolist()), inside)
            apart = float(sums[places[place[group]].sum()])
        found[k] = chances[np.abs(sums) >= abs(apart) * (1.0 - 1e-9)].sum()
    return np.minimum(found, 1.0)


@lru_cache(maxsize=128)  # most columns have no ties, and most groups are judged again
def _sums(counts: tuple[int, ...], inside: int) -> tuple[NDArray[np.int64], Array, Array]:
    """Places of the different ranks, of which sums are places, too; sums of the ranks of groups of
    a size (less their mean), and their probabilities, from how many samples have each rank.
    """
    alike = np.array(counts)
    samples = int(alike.sum())
    values = np.cumsum(alike) - (alike - 1) / 2 - (samples + 1) / 2
    step = 0.5 if samples <= _COUNTED else float(values[-1] - values[0]) / _GRID
    places = np.rint((values - values[0]) / step).astype(np.int64)
    size = inside * int(places[-1]) + 1
    if samples <= _COUNTED:  # groups of each size by their sum
        ways = np.zeros((inside + 1, size))
        ways[0, 0] = 1.0
        for place in np.repeat(places, alike).tolist():
            ways[1:, place:] += ways[:-1, : size - place].copy()
        chances = ways[-1] / ways[-1].sum()
    else:  # few of many: as if each was drawn from all, which makes no sum look rarer
        one = np.bincount(places, alike / samples)
        whole = 2 ** math.ceil(math.log2(size))
        chances = np.fft.irfft(np.fft.rfft(one, whole) ** inside, whole)[:size]
    middle = float(places @ alike) / samples
    sums = np.asarray(step * (np.arange(size) - inside * middle))
    return places, sums, np.maximum(chances, 0.0)


def correlation_interval(found: Array, samples: int, held: int = 0) -> tuple[Array, Array]:
    """Intervals of rank correlations of independent samples, ``held`` other columns held.

    Source: Bonett and Wright, Psychometrika 65 (2000).
    """
    free = samples - held - 3
    if free < 1:
        return found + np.nan, found + np.nan
    half = _WIDE * np.sqrt((1.0 + found**2 / 2.0) / free)
    middle = to_normal(found)
    return np.tanh(middle - half), np.tanh(middle + half)


def chance_of_each(among: int) -> float:
    """Probability that each of ``among`` tests may have if any one is to err in one case of 20.

    Source: Sidak, J. Am. Statistical Association 62 (1967), for independent ones.
    """
    return float(-np.expm1(np.log(LEVEL) / among))


def largest_by_chance(samples: int, held: Array, among: int) -> Array:
    """Size of a rank correlation that the largest of ``among`` ones, without any correlation in
    truth, exceeds in one case of 20; ``held`` are the numbers of other columns held.

    Student's t for correlations of normal numbers, which those of ranks are close to, with Sidak's
    correction; infinite if too few samples are left.
    """
    free = np.maximum(samples - 2.0 - held, 0.0)
    beyond = -scipy.special.stdtrit(np.maximum(free, 1.0), chance_of_each(among) / 2)
    return np.asarray(np.where(free > 0, beyond / np.sqrt(free + beyond**2), np.inf))


def to_normal(correlation: Array) -> Array:
    """Fisher's transform; NaN for a perfect correlation, whose error is not known."""
    known = np.abs(correlation) < 1 - 1e-9
    return np.where(known, np.arctanh(np.where(known, correlation, 0.0)), np.nan)


def area_interval(found: Array, inside: int, outside: int) -> tuple[Array, Array]:
    """Intervals of areas of independent samples.

    Where an area differs from what was found by as much as its own error allows; source: Newcombe,
    Statistics in Medicine 25 (2006), method 5.
    """
    more = (inside + outside) / 2 - 1

    def apart(area: Array) -> Array:
        spread = 1 + more * ((1 - area) / (2 - area) + area / (1 + area))
        allowed = _WIDE * np.sqrt(area * (1 - area) * spread / (inside * outside))
        return np.asarray(np.abs(found - area) - allowed)

    ends = []
    for far in (np.zeros_like(found), np.ones_like(found)):
        near = found.copy()
        for _ in range(_HALVINGS):
            middle = (near + far) / 2
            beyond = apart(middle) > 0
            far, near = np.where(beyond, middle, far), np.where(beyond, near, middle)
        ends.append(near)
    return ends[0], ends[1]


def replicate_interval(
    measure: Callable[[NDArray[np.bool_]], Array], replicate: NDArray[np.int64],
    to: Callable[[Array], Array], back: Callable[[Array], Array], *, doubt: bool = False,
) -> tuple[Array, Array]:  # fmt: skip
    """Intervals of a measure from independent replicates of a design, see ``of_replicates``.

    ``measure`` takes which samples to use, ``to`` and ``back`` change to a scale on which it is
    nearly normal.  NaN where a measure without some replicate is not known, and with ``doubt``
    where all agree: ranks do so by chance.
    """
    which = np.unique(replicate)
    centre = to(measure(np.ones(len(replicate), dtype=bool)))
    if len(which) < 2:
        return centre + np.nan, centre + np.nan
    error = jackknife_error(np.array([to(measure(replicate != each)) for each in which]))
    if doubt:
        error = np.where(error > ROUND_OFF * (1.0 + np.abs(centre)), error, np.nan)
    half = student(len(which)) * error
    return back(centre - half), back(centre + half)


# Sobol' indices from blocks of runs, by SALib's estimators.


def pairs(groups: int) -> list[tuple[int, int]]:
    """Pairs of groups, in the order of their second-order indices."""
    return list(itertools.combinations(range(groups), 2))


def sobol_indices(values: Array, groups: int) -> Array:
    """First-order and total indices of each group, then second-order ones of each pair, if any.

    ``values`` are the outputs of blocks, shape (blocks, rows): A, AB of each group, BA of each
    group for second order, B.  NaN if A and B are all alike.  The first-order index of a group
    holds the interactions inside of it.
    Source: Saltelli et al., Computer Physics Communications 181 (2010), equations b and f of
    table 2; second order: Saltelli, Computer Physics Communications 145 (2002).
    """
    from SALib.analyze.sobol import first_order, second_order, total_order

    second = values.shape[1] == 2 * groups + 2
    one, other = values[:, 0], values[:, -1]
    if len(values) < 2 or np.ptp(values[:, [0, -1]]) == 0:
        return np.full(2 * groups + (len(pairs(groups)) if second else 0), np.nan)
    # Centred and scaled: the estimators depend on the mean, and SALib takes small numbers as equal.
    values = (values - values[:, [0, -1]].mean()) / values[:, [0, -1]].std()
    one, other = values[:, 0], values[:, -1]
    mixed, crossed = values[:, 1 : groups + 1].T, values[:, groups + 1 : -1].T
    found = [first_order(one, each, other) for each in mixed]
    found += [total_order(one, each, other) for each in mixed]
    if second:
        found += [
            second_order(one, mixed[j], mixed[k], crossed[j], other) for j, k in pairs(groups)
        ]
    return np.array(found)


def indices_with_intervals(
    values: Array, groups: int, replicate: NDArray[np.int64]
) -> tuple[Array, Array]:
    """Indices, and their intervals from the replicate of each block, shape (indices, 2).

    NaN for a single replicate: its blocks are points of one Sobol' sequence, and a bootstrap over
    them is several times too long where the output is smooth.
    """
    ends = replicate_interval(
        lambda rows: sobol_indices(values[rows], groups), replicate, np.asarray, np.asarray
    )
    return sobol_indices(values, groups), np.stack(ends, axis=1)


# First-order indices from samples of any design, without blocks of runs.


LEAST_SAMPLES = 40
"""Samples below which no index is given."""
JACKKNIFE_PARTS = 20
"""Parts of independent samples, each of which the jackknife leaves out once."""
_NO_LINE = 1e-12
"""Scatter of places in a bin, as a sum of squares, from which on no line is fitted there."""
_FEW_VALUES = 12
"""Different values of a column up to which each is a bin of its own."""
_SHUFFLES = 199
_NUMBERS = 4_000_000
"""Numbers that all shuffles of an output may take, about."""
_AT_ONCE = 4
"""Outputs that are shuffled at once."""
_MANY = 20_000
"""Samples from which on indices by chance are those of a normal output."""


class Bins:
    """The bins of one column: about n^(1/3) with as many samples each, or one for each value."""

    def __init__(self, column: Array) -> None:
        values, codes, counts = np.unique(column, return_inverse=True, return_counts=True)
        count = len(column)
        self.lined = len(values) > _FEW_VALUES
        """Whether a line is fitted in each bin, along the ranks; else a mean."""
        if self.lined:
            bins = max(2, round(count ** (1 / 3)))
            rank = _ranks(codes, counts) - 0.5
            self.bin = np.minimum((rank * bins / count).astype(np.int64), bins - 1)
            self.place = rank * bins / count - self.bin - 0.5
        else:
            self.bin, self.place = codes.astype(np.int64), np.zeros(count)
        self.count = int(self.bin.max()) + 1


def index(bins: Bins, output: Array, part: NDArray[np.int64]) -> tuple[Array, Array]:
    """First-order indices of a column for outputs, shape (..., samples), and the estimates that
    leave out each part, shape (..., parts).

    The share of the output's variance that a line in each bin explains, less what it would explain
    by chance, as in the adjusted coefficient of determination.  What is left is a bias downwards
    by the bend of the mean output within bins, of the order n^(-4/3) for smooth outputs.
    Sources: Plischke, Borgonovo and Smith, European Journal of Operational Research 226 (2013),
    for binning; Ezekiel, Methods of Correlation Analysis (1930), for the correction.
    """
    parts = int(part.max()) + 1
    y, x = output - output.mean(axis=-1, keepdims=True), bins.place
    cell, size = bins.bin * parts + part, bins.count * parts

    def summed(weights: Array) -> Array:
        """By what is left out (nothing, each part) and by bin, shape (..., 1 + parts, bins)."""
        rows = weights.reshape(-1, weights.shape[-1])
        places = cell + size * np.arange(len(rows))[:, None]
        cells = np.bincount(places.ravel(), rows.ravel(), minlength=size * len(rows))
        cells = cells.reshape(*weights.shape[:-1], bins.count, parts).swapaxes(-1, -2)
        whole = cells.sum(axis=-2, keepdims=True)
        return np.concatenate([whole, whole - cells], axis=-2)

    n, sx, sxx = summed(np.ones(len(x))), summed(x), summed(x * x)
    sy, sxy, syy = summed(y), summed(x * y), summed(y * y).sum(axis=-1)
    full = np.maximum(n, 1.0)
    spread = sxx - sx**2 / full  # none where no line is fitted
    sloped = spread > _NO_LINE
    along = np.where(sloped, (sxy - sx * sy / full) ** 2 / np.where(sloped, spread, 1.0), 0.0)
    free = (n > 0).sum(axis=-1) - 1.0 + sloped.sum(axis=-1)
    samples = n.sum(axis=-1)
    total = syy - sy.sum(axis=-1) ** 2 / np.maximum(samples, 1.0)
    left = syy - (sy**2 / full + along).sum(axis=-1)
    known = (total > 0) & (samples - 1 > free)
    spare = np.where(known, samples - 1 - free, 1.0)
    found = 1 - left / np.where(known, total, 1.0) * (samples - 1) / spare
    found = np.where(known, found, np.nan)
    return found[..., 0], found[..., 1:]


def interval(estimate: Array, left_out: Array) -> tuple[Array, Array]:
    """Intervals, shape (...), from the estimates that leave out independent parts, shape (...,
    parts), with Student's t.

    Delete-a-group jackknife: Kott, Journal of Official Statistics 17 (2001).
    """
    half = student(left_out.shape[-1]) * jackknife_error(np.moveaxis(left_out, -1, 0))
    return estimate - half, estimate + half


def given_data_indices(bins: Bins, outputs: Array) -> Array:
    """Indices of a column with many outputs, shape (samples, outputs), of which none is missing;
    each less its mean, and the sum of its squares is 1.
    """
    order = np.argsort(bins.bin, kind="stable")
    number = np.unique(bins.bin, return_counts=True)[1]
    starts, y, x = np.cumsum(number) - number, outputs[order], bins.place[order]
    x = x - np.repeat(np.add.reduceat(x, starts) / number, number)
    spread = np.add.reduceat(x * x, starts)
    sloped = spread > _NO_LINE
    spare = len(outputs) - len(number) - int(sloped.sum())
    if spare < 1:
        return np.full(outputs.shape[1], np.nan)
    # A step and a line a bin, none of which tells anything of another.
    means = np.add.reduceat(y, starts) ** 2 / number[:, None]
    slopes = np.add.reduceat(x[:, None] * y, starts)[sloped] ** 2 / spread[sloped, None]
    explained = means.sum(axis=0) + slopes.sum(axis=0)
    return np.asarray(1 - (1 - explained) * (len(outputs) - 1) / spare)


def chance_levels(columns: Sequence[Bins], outputs: Array) -> Array:
    """Of each output the largest index of all columns that chance reaches in one case of 20.

    From the same shuffles of the outputs, shape (outputs, samples), for all columns, so that what
    these have in common counts; NaN if no column has an index.
    Source: Westfall and Young, Resampling-Based Multiple Testing (1993), the largest statistic.
    Of many samples the distribution F tells the same, with Sidak's correction: within 7 % of the
    shuffles where the kurtosis is below a hundredth of the samples.
    """
    samples, found = outputs.shape[1], np.full(len(outputs), np.nan)
    scatter = outputs - outputs.mean(axis=1, keepdims=True)
    varied = (square := (scatter**2).sum(axis=1)) > 0
    normal = (scatter**4).mean(axis=1) < 0.01 * square**2 / samples
    if (normal := varied & normal & (samples >= _MANY)).any():
        each = chance_of_each(len(columns))
        found[normal] = np.fmax.reduce([level_of_normal(bins, each) for bins in columns])
    random, count = np.random.default_rng(0), int(np.clip(_NUMBERS // samples, 39, _SHUFFLES))
    shuffles = np.stack([random.permutation(samples) for _ in range(count)], axis=1)
    left = np.flatnonzero(varied & ~normal)
    for first in range(0, len(left), _AT_ONCE):
        some = left[first : first + _AT_ONCE]
        scaled = scatter[some] / np.sqrt(square[some, None])
        shuffled = np.hstack([each[shuffles] for each in scaled])
        largest = np.fmax.reduce([given_data_indices(bins, shuffled) for bins in columns])
        found[some] = np.quantile(largest.reshape(-1, count), LEVEL, axis=1)
    return found


def level_of_normal(bins: Bins, chance: float) -> float:
    """The index that a normal output without influence exceeds with so small a probability.

    By the distribution F of explained over other variance; NaN if too few samples are left.
    """
    count, terms = len(bins.bin), bins.count * (1 + bins.lined) - 1
    spare = count - 1 - terms
    if spare < 1:
        return np.nan
    explained = terms * float(scipy.special.fdtri(terms, spare, 1 - chance)) / spare
    return 1 - (count - 1) / spare / (1 + explained)


# Elementary effects of trajectories, for screening.


MEASURES = ("mean_absolute_effect", "mean_effect", "effect_deviation")
"""Morris' mu*, mu and sigma."""
LEAST_TRAJECTORIES = {"mean_absolute_effect": 20, "mean_effect": 20, "effect_deviation": 60}
"""Trajectories below which there is no interval: of 10 those of mu* held the truth in 88 of 100
campaigns, of 20 in 93; those of sigma of 30 in 90.
"""


def effects(values: Array, blocks: Blocks, groups: tuple[str, ...]) -> Array:
    """Change of the output by the move of each group, shape (trajectories, groups).

    ``values`` are outputs of all runs, shape (trajectories, runs).  The sign is that of a move
    upwards; of groups of many inputs, which move up and down at once, that of the move made.
    """
    steps = np.diff(values, axis=1)
    found = np.full((len(values), len(groups)), np.nan)
    for number, group in enumerate(groups):
        for way, sign in {"up": 1.0, "down": -1.0, "moved": 1.0}.items():
            block, row = np.nonzero(blocks.rows[:, 1:] == f"{way}: {group}")
            found[block, number] = sign * steps[block, row]
    return found


def measured(found: Array, joint: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Array:
    """Measures of effects (trajectories, groups) with intervals, shape (measure, group, 3).

    The last axis is estimate, lower and upper end.  Trajectories are independent of each other:
    bootstrap over them (BCa).  NaN of the mean effect and of the deviation for groups of many
    inputs (``joint``), whose effects have no sign.
    """
    rows = found.T
    results = []
    for name in MEASURES:
        with_sign = name != "mean_absolute_effect"
        values = rows if with_sign else np.abs(rows)
        statistic: Callable[..., Any] = intervals.spread if name == "effect_deviation" else np.mean
        if len(found) < 2:
            results.append(np.full((len(rows), 3), np.nan))
            continue
        middle = np.asarray(statistic(values, axis=-1))
        told = np.stack([middle, *intervals.of_independent(values, statistic)], axis=-1)
        if len(found) < LEAST_TRAJECTORIES[name]:
            told[:, 1:] = np.nan
        results.append(np.where(joint[:, None] & with_sign, np.nan, told))
    return np.array(results)


# Whether samples are missing at random, or where inputs have certain values.


UNLIKELY = 0.05
"""Probability below which samples are taken as missing because of their inputs."""
_SHUFFLES_OF_LOSSES = 999
_MOST_SHUFFLES = 100_000
"""Shuffles of a column of few values, at most: they tell a probability of 0.05 over 170 tests to a
fifth of itself."""
_FEW_SHUFFLES = 5_000
"""Shuffles up to which they may be drawn one by one, which takes 20 us each."""
_DRAWN = 1_000_000
"""Numbers that all shuffles of a column of many values draw, about."""


def dependence(missing: Mask, columns: Array, block: NDArray[np.int64] | None = None) -> float:
    """Probability that samples which are missing at random would look as unlike the others.

    NaN if none is missing, 1 if there is nothing to compare by.  Of every column, shape (samples,
    columns), the mean rank of the missing samples is compared with that of all, and that of the
    distance from the middle, which sees both ends; with ``block``, the block of each sample, also
    how many pairs of missing samples are in one block, since samples of a block share most inputs:
    that sees interactions, too.  Bonferroni's correction joins them.
    Source: Lehmann, Nonparametrics (1975), section 1.
    """
    count, gone = len(missing), int(missing.sum())
    if gone in (0, count):
        return np.nan
    chances, least, tests = [], 1.0, 2 * columns.shape[1]
    normal = list[tuple[float, int, bool]]()
    for place in range(columns.shape[1]):  # one by one, because all at once take much memory
        for ends in (False, True):
            each = _looked_at(columns, place, ends=ends)
            spread = float(each.std(ddof=1)) * np.sqrt((1 - gone / count) / gone)
            if spread == 0.0:
                continue
            chance = float(2 * scipy.special.ndtr(-abs(float(each[missing].mean())) / spread))
            normal.append((chance, place, ends))
    for chance, place, ends in sorted(normal):
        # Shuffles, of which those of many values take long, can only make a chance larger.
        if chance >= least:
            break
        if tests * chance < UNLIKELY:
            chance = max(chance, _as_far(_looked_at(columns, place, ends=ends), missing))
        least = min(least, chance)
    if tests:
        chances.append(tests * least)
    if block is not None:
        chances.append(_clustered(np.bincount(block[missing], minlength=block[-1] + 1), block))
    return min(1.0, len(chances) * min(chances)) if chances else 1.0


def _looked_at(columns: Array, place: int, *, ends: bool) -> Array:
    """Centred ranks of a column, or of the distance from its middle."""
    ranks = centred_ranks(columns[:, [place]])
    return (centred_ranks(np.abs(ranks)) if ends else ranks)[:, 0]


def _as_far(ranks: Array, missing: Mask) -> float:
    """Share of shuffles in which the missing samples are as far from the middle, of centred ranks.

    Of few missing samples, and of inputs that are seldom other than usual, the normal limit is far
    off: one sample of n that alone has some value is missing by chance in one case of n.
    """
    values, counts = np.unique(ranks, return_counts=True)
    random, far = np.random.default_rng(0), abs(float(ranks[missing].sum())) * (1.0 - 1e-9)
    shuffles = int(np.clip(_DRAWN // len(values), 999, _MOST_SHUFFLES))
    few = min(int(missing.sum()), len(missing) - int(missing.sum()))
    if len(values) > few and shuffles <= _FEW_SHUFFLES:
        # Centred ranks of all add up to 0: those that are left are as far, to the other side.
        drawn = (random.choice(len(ranks), few, replace=False, shuffle=False)
                 for _ in range(shuffles))  # fmt: skip
        return sum(abs(float(ranks[own].sum())) >= far for own in drawn) / shuffles
    at_once, found = max(1, _DRAWN // len(values)), 0
    for start in range(0, shuffles, at_once):
        shuffled = random.multivariate_hypergeometric(
            counts, int(missing.sum()), size=min(at_once, shuffles - start), method="marginals"
        )
        found += int((np.abs(shuffled @ values) >= far).sum())
    return found / shuffles


def _clustered(found: NDArray[np.int64], block: NDArray[np.int64]) -> float:
    """Probability of as many pairs in common blocks, by shuffling which samples are missing."""
    shuffled = np.random.default_rng(0).multivariate_hypergeometric(
        np.bincount(block), int(found.sum()), size=_SHUFFLES_OF_LOSSES, method="marginals"
    )
    more = (shuffled**2).sum(axis=1) >= (found**2).sum()
    return float((1 + more.sum()) / (1 + _SHUFFLES_OF_LOSSES))
