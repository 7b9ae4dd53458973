"""Whether samples are missing at random, or where inputs have certain values."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from ringsim.analysis.intervals import Array
from ringsim.analysis.quantities import Mask
from ringsim.analysis.ranks import centred_ranks

LEVEL = 0.05
"""Probability below which samples are taken as missing because of their inputs."""
_SHUFFLES = 999


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
    chances = []
    if columns.shape[1]:
        largest = 0.0
        for column in columns.T:  # one by one, because all at once take much memory
            ranks = centred_ranks(column[:, None])
            for each in (ranks, centred_ranks(np.abs(ranks))):
                spread = float(each.std(ddof=1)) * np.sqrt((1 - gone / count) / gone)
                moved = abs(float(each[missing].mean()))
                largest = max(largest, moved / spread if spread > 0 else 0.0)
        chances.append(2 * columns.shape[1] * float(2 * norm.sf(largest)))
    if block is not None:
        chances.append(_clustered(np.bincount(block[missing], minlength=block[-1] + 1), block))
    return min(1.0, len(chances) * min(chances)) if chances else 1.0


def _clustered(found: NDArray[np.int64], block: NDArray[np.int64]) -> float:
    """Probability of as many pairs in common blocks, by shuffling which samples are missing."""
    shuffled = np.random.default_rng(0).multivariate_hypergeometric(
        np.bincount(block), int(found.sum()), size=_SHUFFLES, method="marginals"
    )
    more = (shuffled**2).sum(axis=1) >= (found**2).sum()
    return float((1 + more.sum()) / (1 + _SHUFFLES))
