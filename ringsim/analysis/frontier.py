"""Which settings are worth their cost.

A single error may be small by chance: that of a coarse step and that of few elements have
signs.  What a setting is good for is therefore the largest error among itself and all settings
that are finer than it, and the reference's own uncertainty on top.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ringsim.analysis.ladder import STANDING, Rung

Array = NDArray[np.float64]
WORTH_A_CHANGE = 0.9
"""Cost of another setting over that of the scene's own from which on it is worth a change: less
is within what the fit of the cost, and the luck of single steps, are good for."""
_SAME = ("solver.step_control", "rods.kind")
_SMALLER = (
    "solver.step",
    "solver.tolerance",
    "solver.deviation_tolerance",
    "solver.newton_tolerance",
)


def bounds(error: Array, rungs: Sequence[Rung], uncertainty: Array) -> Array:
    """Errors that settings are good for, shape (rung, output); NaN where a run failed.

    Parameters
    ----------
    error
        Shape (rung, output), NaN where there is none.
    rungs
        The settings.
    uncertainty
        Of the reference, shape (output,).
    """
    found = np.array(error)
    for k, rung in enumerate(rungs):
        finer = [j for j, other in enumerate(rungs) if _refines(other, rung)]
        if finer:
            worst = np.fmax.reduce(error[finer], axis=0)
            found[k] = np.where(np.isfinite(error[k]), np.fmax(error[k], worst), np.nan)
    return found + uncertainty


def _refines(fine: Rung, coarse: Rung) -> bool:
    """Whether a setting is finer in something and coarser in nothing."""
    if "fidelity" in (fine.ladder, coarse.ladder):
        return False
    a, b = fine.values, coarse.values
    if any(a[path] != b[path] for path in _SAME) or a["rods.elements"] < b["rods.elements"]:
        return False
    moved = [path for path in _SMALLER if a[path] != b[path]]
    if any(a[path] > b[path] for path in moved):
        return False
    return bool(moved) or a["rods.elements"] > b["rods.elements"]


def typical_cost(seconds: Array, work: Array, rungs: Sequence[Rung]) -> Array:
    """Processor time of each setting without the scatter of single timings, shape (rung,), s.

    Every piece of work costs the same within a ladder, but for a factor for the rods' formulation
    and elements: fitted to what was measured.  A fidelity costs what it did.

    Parameters
    ----------
    seconds
        As measured, shape (rung,).
    work
        Counts of what takes time, shape (rung, kinds).
    rungs
        The settings.
    """
    cost = np.array(seconds, dtype=float)
    sizes = [_size(rung) for rung in rungs]
    standing = max(set(sizes), key=sizes.count)
    own = np.array([size == standing for size in sizes]) & np.isfinite(seconds)
    scale = 1.0 / np.maximum(seconds[own], 1e-9)  # relative errors count
    shares, _ = nnls(work[own] * scale[:, None], np.ones(own.sum()))
    plain = work @ shares
    if not (plain[own] > 0.0).all():
        return cost
    for size in set(sizes):
        if size == ("fidelity", 0):
            continue
        members = np.array([each == size for each in sizes]) & np.isfinite(seconds) & (plain > 0.0)
        if members.any():
            cost[members] = plain[members] * np.median(seconds[members] / plain[members])
    return cost


def _size(rung: Rung) -> tuple[str, int]:
    if rung.ladder == "fidelity":
        return "fidelity", 0
    return str(rung.values["rods.kind"]), int(rung.values["rods.elements"])


def frontier(cost: Array, error: Array) -> NDArray[np.bool_]:
    """Settings that no other one beats in both cost and error, per output."""
    best = np.zeros(error.shape, dtype=bool)
    for column in range(error.shape[1]):
        own = np.where(np.isfinite(error[:, column]), error[:, column], np.inf)
        for row in np.flatnonzero(np.isfinite(own)):
            no_worse = (cost <= cost[row]) & (own <= own[row])
            better = no_worse & ((cost < cost[row]) | (own < own[row]))
            best[row, column] = not better.any()
    return best


def eligible(rungs: Sequence[Rung]) -> NDArray[np.bool_]:
    """What may be recommended: the full model with the scene's own rods and step control."""
    others = ("fidelity", "formulation", "constant step")
    return np.array([rung.ladder not in others for rung in rungs])


def in_favour(cost: Array, rungs: Sequence[Rung]) -> Array:
    """Cost by which settings are picked: what a scene has is kept unless another pays."""
    stands = np.array([rung.ladder == STANDING for rung in rungs])
    return np.where(stands, WORTH_A_CHANGE * cost, cost)


def cheapest(cost: Array, error: Array, targets: Sequence[float]) -> NDArray[np.int64]:
    """The cheapest setting within each target, per output; -1 if there is none."""
    found = np.full((len(targets), error.shape[1]), -1, dtype=np.int64)
    for row, target in enumerate(targets):
        for column in range(error.shape[1]):
            fit = np.flatnonzero(error[:, column] <= target)
            if len(fit):
                found[row, column] = fit[np.argmin(cost[fit])]
    return found
