"""Observed orders of convergence along the ladders of an accuracy study."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ringsim.analysis.errors import OUTPUTS, Errors
from ringsim.analysis.ladder import Rung
from ringsim.analysis.reference import limit, order

Array = NDArray[np.float64]
_CLEAR = 1.5
"""An error over the limit's uncertainty from which on it counts."""
_ABOUT = 0.2
"""Share by which an error may rise towards finer steps and still count as falling."""
_MATTERS = 2.0
"""Ratio of the errors along a ladder from which on it shows an order."""


def observed_orders(errors: Errors, rungs: Sequence[Rung]) -> tuple[list[str], Array]:
    """Names of the ladders that may have an order, and those orders, shape (ladder, output).

    NaN where errors are too small to tell, or hardly change.
    """
    outputs = list(errors.of)
    names = list(dict.fromkeys(rung.ladder for rung in rungs if rung.size > 0.0))
    found = np.full((len(names), len(outputs)), np.nan)
    for row, name in enumerate(names):
        own = [k for k, rung in enumerate(rungs) if rung.ladder == name]
        if name == "steps":  # longer ones than the scene's own are not small
            own = [k for k in own if rungs[k].size <= 1.0]
        places = np.array(own)
        sizes = np.log([rungs[k].size for k in places])
        for column, output in enumerate(outputs):
            if output == "energy":
                found[row, column] = _slope(sizes, errors.of[output][places], 0.0)
            elif output in OUTPUTS:
                of = _order_of_changes if name in ("elements", "formulation") else _order_of_steps
                found[row, column] = of(errors, places, sizes, output)
    return names, found


def _order_of_steps(errors: Errors, places: Array, sizes: Array, name: str) -> float:
    """Slope of what steps of a size are wrong by, whatever the elements are."""
    values = errors.until_the_end(name)
    best = limit(values.isel(rung=errors.in_time))
    apart = abs(values - best.value).max([dim for dim in values.dims if dim != "rung"])
    apart = apart.where(errors.good).to_numpy()[places]
    return _slope(sizes, apart, best.uncertainty)


def _order_of_changes(errors: Errors, places: Array, sizes: Array, name: str) -> float:
    """From three levels alone: they share what the steps are wrong by."""
    if not errors.good[places].all():
        return np.nan
    values = errors.until_the_end(name)
    steps = limit(values.isel(rung=errors.in_time))
    return order(values.isel(rung=places), steps.uncertainty)


def _slope(sizes: Array, error: Array, floor: float) -> float:
    """Slope of log error over log size among all that stand clear of the limit's uncertainty.

    All of them, because two may agree by chance.  Errors that rise somewhere towards finer steps,
    or hardly change, show no order.
    """
    clear = np.isfinite(error) & (error > max(_CLEAR * floor, 1e-300))
    finer = error[clear][np.argsort(-sizes[clear])]
    if (
        len(finer) < 3
        or finer[0] < _MATTERS * finer[-1]
        or (np.diff(finer) > _ABOUT * finer[:-1]).any()
    ):
        return np.nan
    return float(np.polyfit(sizes[clear], np.log(error[clear]), 1)[0])
