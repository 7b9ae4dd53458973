"""Where runs of the stability map stop being ok, axis by axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.stability import OK, WRONG

Array = NDArray[np.float64]


class Border(NamedTuple):
    """Between which values of one axis of a group runs are ok, and what lies beyond."""

    group: int
    axis: str
    ok: tuple[float, float] | None
    """First and last value at which any cell is ok."""
    sure: tuple[float, float] | None
    """The longest range of values at which all cells are ok."""
    below: str
    """The commonest cause just below ``sure``; empty at the axis' end."""
    above: str


def borders(whole: xr.Dataset) -> list[Border]:
    """One border for each axis of each group of a judged map."""
    found = []
    for number in range(whole.sizes["group"]):
        cells = whole.isel(cell=(whole["of_group"] == number).values)
        good, causes = (cells["verdict"] == OK).values, cells["cause"].values.astype(str)
        for axis in ("x", "y"):
            values, place = np.unique(cells[axis].values, return_inverse=True)
            shares = np.array([good[place == k].mean() for k in range(len(values))])
            sure = _longest(shares == 1.0)
            below, above = "", ""
            if sure:
                below, above = (
                    _commonest(causes[(place == k) & ~good]) for k in (sure[0] - 1, sure[-1] + 1)
                )
            ranges = (_ends(values, np.flatnonzero(shares > 0.0)), _ends(values, sure))
            found.append(Border(number, axis, *ranges, below, above))
    return found


def _ends(values: Array, places: Sequence[int] | NDArray[np.int64]) -> tuple[float, float] | None:
    return (float(values[places[0]]), float(values[places[-1]])) if len(places) else None


def _commonest(causes: NDArray[np.str_]) -> str:
    """The commonest of some causes; empty if there is none."""
    words, counts = np.unique(causes, return_counts=True)
    return str(words[counts.argmax()] or WRONG) if len(words) else ""


def _longest(held: NDArray[np.bool_]) -> list[int]:
    """The longest run of neighbours that hold."""
    best: list[int] = []
    now: list[int] = []
    for place, holds in enumerate(held):
        now = [*now, place] if holds else []
        best = now if len(now) > len(best) else best
    return best
