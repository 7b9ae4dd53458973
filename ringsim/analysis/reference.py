"""The limit of runs with ever finer steps and elements, how uncertain it is, and its order.

Three levels tell whether refining pays as it should.  Changes that shrink by r from one level to
the next (4 at second order) leave d / (r - 1) of the last change d to go, Richardson (1911);
changes that do not shrink, or alternate in sign, are not extrapolated.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SECOND_ORDER = 4.0
"""Ratio of successive changes where steps halve and the order is two; no more is believed."""
_SHRINKING = 1.5
"""Ratio from which on changes count as shrinking."""
_CLEAR = 1.5
"""An error over the limit's uncertainty from which on it counts for a slope."""
_ABOUT = 0.2
"""Share by which an error may rise towards finer steps and still count as falling."""
_MATTERS = 2.0
"""Ratio of the errors along a ladder from which on it shows an order."""


class Limit(NamedTuple):
    """A value (of any shape), and its largest uncertainty anywhere, in its own unit."""

    value: xr.DataArray
    uncertainty: float


def limit(values: xr.DataArray) -> Limit:
    """Limit of three levels along ``rung``, each with steps (or elements) half as long.

    The uncertainty is all that was extrapolated, and at least what second order would leave of
    the first change: two fine runs may agree by chance.
    """
    coarse, middle, fine = (values.isel(rung=k, drop=True) for k in range(3))
    first, last = middle - coarse, fine - middle
    before, now = float(abs(first).max()), float(abs(last).max())
    if now == 0.0 == before:
        return Limit(fine, 0.0)
    if now * _SHRINKING > before:
        return Limit(fine, max(before, now))
    least = before / _SECOND_ORDER / (_SECOND_ORDER - 1.0)
    if float((first * last).sum()) < 0.0:  # alternating: the limit lies between the last two
        return Limit(fine, max(now, least))
    ratio = min(before / max(now, 1e-300), _SECOND_ORDER)
    return Limit(fine + last / (ratio - 1.0), max(now / (ratio - 1.0), least))


def reference(in_time: xr.DataArray, in_space: xr.DataArray) -> Limit:
    """Limit of three levels of steps, and what three levels of elements change, along ``rung``."""
    steps, elements = limit(in_time), limit(in_space)
    more = elements.value - in_space.isel(rung=0, drop=True)
    return Limit(steps.value + more, steps.uncertainty + elements.uncertainty)


def largest(values: xr.DataArray) -> Array:
    """The largest size of each rung's values, shape (rung,)."""
    found: Array = abs(values).max([dim for dim in values.dims if dim != "rung"]).to_numpy()
    return found


def order(values: xr.DataArray, noise: float) -> float:
    """Observed order of three levels along ``rung``; NaN unless changes shrink above the noise.

    Each level has half the length of elements of the one before; ``noise`` is the largest effect
    of anything else, in the unit of the values.
    """
    first, last = largest(values.diff("rung")).tolist()
    return float(np.log2(first / last)) if first > last > noise else np.nan


def slope(sizes: Array, error: Array, uncertainty: float) -> float:
    """Slope of log error over log size among all errors above the uncertainty of their limit.

    All of them, because two may agree by chance.  NaN if errors rise somewhere towards finer
    steps, or hardly change.
    """
    clear = np.isfinite(error) & (error > max(_CLEAR * uncertainty, 1e-300))
    finer = error[clear][np.argsort(-sizes[clear])]
    falls = len(finer) >= 3 and (np.diff(finer) <= _ABOUT * finer[:-1]).all()
    if not falls or finer[0] < _MATTERS * finer[-1]:
        return np.nan
    return float(np.polyfit(np.log(sizes[clear]), np.log(error[clear]), 1)[0])
