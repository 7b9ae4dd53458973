"""Pairs of inputs that go together, so that the effect of one may be told as the other's."""

from collections.abc import Collection
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis import given_data
from ringsim.analysis.drawn import Drawn
from ringsim.analysis.intervals import Array
from ringsim.analysis.ranks import centred_ranks, chance_of_each, largest_by_chance
from ringsim.tables import counted

_NAMED = 3
"""Pairs that a note names at most."""


class Pair(NamedTuple):
    """Two columns of which one tells something about the other."""

    first: int
    second: int
    correlation: float
    """Their rank correlation."""
    share: float
    """Given-data index of the ranks of one by the other, the larger one; NaN of few samples."""

    @property
    def strength(self) -> float:
        """Share of the variance of one that goes with the other, about."""
        return float(np.fmax(self.correlation**2, self.share))


def pairs(columns: Array, which: NDArray[np.bool_]) -> list[Pair]:
    """Pairs of columns, shape (samples, columns), that go together more than the largest pair does
    by chance in one case of 20, the strongest first: by rank correlation, or by given-data index,
    since points of few samples in many dimensions may lie on lines that are not straight.

    ``which``, shape (columns, columns), tells which pairs count.
    """
    samples, wide = columns.shape
    which = np.triu(which | which.T, 1)
    if samples < 3 or not which.any():
        return []
    # Three tests of each: the correlation, and the index in both directions.
    among = 3 * int(which.sum())
    ranks = centred_ranks(columns)
    scale = np.sqrt((ranks**2).sum(axis=0))
    ranks /= np.where(scale > 0, scale, 1.0)
    matrix = ranks.T @ ranks
    beyond = np.abs(matrix) > largest_by_chance(samples, np.zeros(()), among)
    share = np.full((wide, wide), np.nan)
    if samples >= given_data.LEAST:
        chance = chance_of_each(among)
        for k, column in enumerate(columns.T):
            bins = given_data.Bins(column)
            share[k] = given_data.indices(bins, ranks)
            beyond[k] |= share[k] > given_data.level_of_normal(bins, chance)
        share = np.fmax(share, share.T)
    first, second = np.nonzero(which & (beyond | beyond.T))
    found = [
        Pair(int(j), int(k), float(matrix[j, k]), float(share[j, k]))
        for j, k in zip(first, second, strict=True)
    ]
    return sorted(found, key=lambda pair: -pair.strength)


def _apart(inputs: Drawn) -> NDArray[np.bool_]:
    """Which pairs of inputs nothing but the design makes correlate, shape (input, input): not a
    mean with its own places, nor words of one input.
    """
    own, place = np.array(inputs.input), np.array(inputs.level) == "place"
    return np.asarray((own[:, None] != own) | (place[:, None] & place))


def confounded(inputs: Drawn, used: NDArray[np.bool_]) -> dict[str, Any]:
    """Variables along ``pair``: the names of both inputs and their correlation; none without a
    pair.  ``used``, shape (samples,), are the samples that count.
    """
    found = pairs(inputs.values[used], _apart(inputs))
    if not found:
        return {}
    names = np.array(inputs.names, dtype=object)
    about = {
        "correlation": "rank correlation of the two inputs",
        "share": "share of the variance of one of them, in ranks, that the other explains",
    }
    sides = {"first": "one input of the pair", "second": "the other input of the pair"}
    told = {"units": "1"}
    return {
        f"pair_{name}": (
            "pair",
            names[[getattr(each, name) for each in found]],
            {"long_name": word},
        )
        for name, word in sides.items()
    } | {
        f"pair_{name}": (
            "pair",
            [getattr(each, name) for each in found],
            {"long_name": word} | told,
        )
        for name, word in about.items()
    }


def partners(analysis: xr.Dataset) -> dict[str, set[str]]:
    """Of every input that goes with others in the samples, their names."""
    found: dict[str, set[str]] = {}
    for first, second, *_ in _pairs_in(analysis):
        found.setdefault(first, set()).add(second)
        found.setdefault(second, set()).add(first)
    return found


def confounding_notes(analysis: xr.Dataset, told: Collection[str]) -> list[str]:
    """Which inputs among those that are told go with others, and what that means."""
    found = [each for each in _pairs_in(analysis) if not {each[0], each[1]}.isdisjoint(told)]
    if not found:
        return []
    named = ", ".join(
        f"{first} with {second} ({share:.0%}, r = {correlation:+.2f})"
        for first, second, correlation, share in found[:_NAMED]
    )
    more = f" and {counted(len(found) - _NAMED, 'other pair')}" * (len(found) > _NAMED)
    return [
        "inputs are not independent in these samples, which chance does not explain (share of the "
        f"variance of one that the other explains, rank correlation): {named}{more}; the effect of "
        "one may be told as the other's: draw more samples, or a design of kind random"
    ]


def _pairs_in(analysis: xr.Dataset) -> list[tuple[str, str, float, float]]:
    if "pair" not in analysis.dims:
        return []
    names = ("pair_first", "pair_second", "pair_correlation", "pair_share")
    columns = [analysis[name].values.tolist() for name in names]
    return list(zip(*columns, strict=True))
