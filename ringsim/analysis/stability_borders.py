"""Where runs of the stability map stop being ok, axis by axis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.stability import OK, WRONG

Array = NDArray[np.float64]


def share_ok(cells: xr.Dataset, axis: str) -> tuple[Array, Array, list[str]]:
    """For every value of an axis of one group: share of ok cells, and the commonest other cause.

    Parameters
    ----------
    cells
        The cells of one group.
    axis
        "x" or "y".
    """
    values, place = np.unique(cells[axis].values, return_inverse=True)
    fine = (cells["verdict"] == OK).values
    shares = np.array([fine[place == k].mean() for k in range(len(values))])
    causes = []
    for k in range(len(values)):
        others = cells["cause"].values[(place == k) & ~fine]
        words, counts = np.unique(others.astype(str), return_counts=True)
        causes.append(str(words[counts.argmax()] or WRONG) if len(words) else "")
    return values, shares, causes


def borders(whole: xr.Dataset) -> xr.Dataset:
    """Between which values of each axis runs are ok, and what lies beyond.

    Returns
    -------
    xr.Dataset
        Over ``border``, one for each axis of each group: ``of_group``, ``axis``, ``lowest_ok`` and
        ``highest_ok`` (end values at which any cell is ok), ``lowest_sure`` and ``highest_sure``
        (the longest range in which all cells are; NaN if there is none), ``below`` and ``above``
        (the commonest cause just beyond that range; empty at the axis' end).
    """
    rows = []
    for number in range(whole.sizes["group"]):
        cells = whole.isel(cell=(whole["of_group"] == number).values)
        for axis in ("x", "y"):
            values, shares, causes = share_ok(cells, axis)
            some = np.flatnonzero(shares > 0.0)
            sure = _longest(shares == 1.0)
            low, high = (some[0], some[-1]) if len(some) else (len(values), -1)
            rows.append(
                {
                    "of_group": number,
                    "axis": axis,
                    "lowest_ok": values[low] if len(some) else np.nan,
                    "highest_ok": values[high] if len(some) else np.nan,
                    "lowest_sure": values[sure[0]] if sure else np.nan,
                    "highest_sure": values[sure[-1]] if sure else np.nan,
                    "below": _beyond(causes, sure[0] - 1) if sure else "",
                    "above": _beyond(causes, sure[-1] + 1) if sure else "",
                }
            )
    return xr.Dataset({key: ("border", [row[key] for row in rows]) for key in rows[0]})


def _beyond(causes: Sequence[str], place: int) -> str:
    return causes[place] if 0 <= place < len(causes) else ""


def _longest(held: NDArray[np.bool_]) -> list[int]:
    """The longest run of neighbours that hold."""
    best: list[int] = []
    now: list[int] = []
    for place, holds in enumerate(held):
        now = [*now, place] if holds else []
        best = now if len(now) > len(best) else best
    return best
