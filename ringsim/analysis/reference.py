"""The limit of runs with ever finer steps and elements, how uncertain it is, and its order.

Three levels tell whether refining pays as it should.  Changes that shrink by r from one level to
the next (4 at second order) leave d / (r - 1) of the last change d to go, Richardson (1911);
changes that do not shrink, or alternate in sign, are not extrapolated.
"""

from __future__ import annotations

from collections.abc import Hashable
from typing import NamedTuple

import numpy as np
import xarray as xr

_SECOND_ORDER = 4.0
"""Ratio of successive changes where steps halve and the order is two; no more is believed."""
_SHRINKING = 1.5
"""Ratio from which on changes count as shrinking."""


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
    step = last / (ratio - 1.0)
    return Limit(fine + step, max(now / (ratio - 1.0), least))


def reference(in_time: xr.DataArray, in_space: xr.DataArray) -> Limit:
    """Limit of three levels of steps, and what three levels of elements change, along ``rung``."""
    steps, elements = limit(in_time), limit(in_space)
    more = elements.value - in_space.isel(rung=0, drop=True)
    return Limit(steps.value + more, steps.uncertainty + elements.uncertainty)


def order(values: xr.DataArray, noise: float) -> float:
    """Observed order of three levels along ``rung``; NaN unless changes shrink above the noise.

    Each level has half the length of elements of the one before; ``noise`` is the largest effect
    of anything else, in the unit of the values.
    """
    first, last = (float(c) for c in abs(values.diff("rung")).max(inner(values)))
    if not first > last > noise:
        return np.nan
    return float(np.log2(first / last))


def inner(values: xr.DataArray) -> list[Hashable]:
    """All dimensions but ``rung``."""
    return [dim for dim in values.dims if dim != "rung"]
