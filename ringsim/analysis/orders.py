"""Observed orders of convergence along the ladders of an accuracy study."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ringsim.analysis.errors import OUTPUTS, Errors
from ringsim.analysis.ladder import Rung
from ringsim.analysis.reference import inner, limit, order

Array = NDArray[np.float64]
_CLEAR = 1.5
"""An error over the limit's uncertainty from which on it counts."""
_ABOUT = 0.2
"""Share by which an error may rise towards finer steps and still count as falling."""
_MATTERS = 2.0
"""Ratio of the errors along a ladder from which on it shows an order."""


def observed_orders(errors: Errors, rungs: Sequence[Rung]) -> tuple[list[str], Array]:
    """Names of the ladders that may have an order, and those orders, shape (ladder, output).

    NaN where errors are too small to tell, or hardly change.  Steps show the slope of their
    errors against the limit of the steps, whatever the elements are; elements and formulations
    that of the changes from level to level, which all share the error of their steps.
    """
    outputs = list(errors.of)
    names = list(dict.fromkeys(rung.ladder for rung in rungs if rung.size > 0.0))
    found = np.full((len(names), len(outputs)), np.nan)
    for row, name in enumerate(names):
        # Steps longer than the scene's own (size above 1) are too long to show an order.
        own = [
            k for k, rung in enumerate(rungs)
            if rung.ladder == name and not (name == "steps" and rung.size > 1.0)
        ]  # fmt: skip
        sizes = np.array([rungs[k].size for k in own])
        for column, output in enumerate(outputs):
            if output == "energy":
                found[row, column] = _slope(sizes, errors.of[output][own], 0.0)
            elif output in OUTPUTS:
                values = errors.until_the_end(output)
                steps = limit(values.isel(rung=errors.in_time))
                if name not in ("elements", "formulation"):
                    apart = abs(values - steps.value).max(inner(values)).where(errors.good)
                    found[row, column] = _slope(sizes, apart.to_numpy()[own], steps.uncertainty)
                elif errors.good[own].all():
                    found[row, column] = order(values.isel(rung=own), steps.uncertainty)
    return names, found


def _slope(sizes: Array, error: Array, floor: float) -> float:
    """Slope of log error over log size among all errors above the limit's uncertainty.

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
    return float(np.polyfit(np.log(sizes[clear]), np.log(error[clear]), 1)[0])
