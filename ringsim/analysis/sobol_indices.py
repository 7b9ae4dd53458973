"""Sobol' indices from blocks of runs, by SALib's estimators."""

import itertools

import numpy as np
from numpy.typing import NDArray

from ringsim.analysis.intervals import Array
from ringsim.analysis.ranks import replicate_interval


def pairs(groups: int) -> list[tuple[int, int]]:
    """Pairs of groups, in the order of their second-order indices."""
    return list(itertools.combinations(range(groups), 2))


def indices(values: Array, groups: int) -> Array:
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
        lambda rows: indices(values[rows], groups), replicate, np.asarray, np.asarray
    )
    return indices(values, groups), np.stack(ends, axis=1)
