"""Rank measures of dependence between columns and an output, with intervals."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm, rankdata, t

from ringsim.analysis.intervals import LEVEL, Array, jackknife_error, student

_WIDE = float(norm.ppf(0.5 + LEVEL / 2))
_SPARE = 5
"""Samples beyond the number of inputs, at least, that a partial correlation takes."""
_HALVINGS = 60


def centred_ranks(columns: Array) -> Array:
    """Ranks in every column less their mean; one by one, because all at once take much memory."""
    found = np.empty(columns.shape)
    for k, column in enumerate(columns.T):
        found[:, k] = rankdata(column) - (len(column) + 1) / 2
    return found


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

    NaN if samples are too few or columns depend on each other.  Source: Iman and Conover,
    Technometrics 21 (1979); from the inverse of the matrix of correlations.
    """
    count, wide = x.shape
    none = np.full(wide, np.nan)
    if count < wide + 2 + _SPARE or not wide:
        return none
    y = centred_ranks(output[:, None])
    matrix = np.block([[x.T @ x, x.T @ y], [y.T @ x, y.T @ y]])
    scale = np.sqrt(np.diag(matrix))
    if (scale == 0).any():
        return none
    matrix = matrix / scale / scale[:, None]
    if np.linalg.cond(matrix) > 1e10:
        return none
    inverse = np.linalg.inv(matrix)
    found: Array = -inverse[:-1, -1] / np.sqrt(np.diag(inverse)[:-1] * inverse[-1, -1])
    return found


def areas(columns: Array, group: NDArray[np.bool_]) -> Array:
    """Probability that a column is larger in a sample of the group than in another, ties half.

    The area under the receiver's operating curve; 0.5 for what does not separate the group.
    Source: Mann and Whitney, Annals of Mathematical Statistics 18 (1947).
    """
    inside = int(group.sum())
    outside = len(group) - inside
    found: Array = 0.5 + centred_ranks(columns)[group].sum(axis=0) / (inside * outside)
    return found


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
    beyond = t.isf(chance_of_each(among) / 2, np.maximum(free, 1.0))
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
    to: Callable[[Array], Array], back: Callable[[Array], Array], level: float = LEVEL,
) -> tuple[Array, Array]:  # fmt: skip
    """Intervals of a measure from independent replicates of a design, see ``of_replicates``.

    ``measure`` takes which samples to use, ``to`` and ``back`` change to a scale on which it is
    nearly normal.  NaN where a measure without some replicate is not known.
    """
    which = np.unique(replicate)
    centre = to(measure(np.ones(len(replicate), dtype=bool)))
    if len(which) < 2:
        return centre + np.nan, centre + np.nan
    error = jackknife_error(np.array([to(measure(replicate != each)) for each in which]))
    half = student(len(which), level) * error
    return back(centre - half), back(centre + half)
