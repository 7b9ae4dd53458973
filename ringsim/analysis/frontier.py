"""Which settings are worth their cost.

A single error may be small by chance: errors of coarse steps and of few elements have signs and
may cancel.  The error that a setting is good for is therefore the largest among itself and all
settings that are finer than it, plus the reference's own uncertainty.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ringsim.analysis.ladder import STANDING, Rung

Array = NDArray[np.float64]
WORTH_A_CHANGE = 0.9
"""Cost of another setting over that of the scene's own up to which it is worth a change: smaller
differences are within the fit of the cost and the luck of single steps."""
_SAME = ("solver.step_control", "rods.kind")
_SMALLER = (
    "solver.step", "solver.tolerance", "solver.deviation_tolerance", "solver.newton_tolerance",
)  # fmt: skip


def bounds(error: Array, rungs: Sequence[Rung], uncertainty: Array) -> Array:
    """Errors that settings are good for, shape (rung, output); NaN where a run failed.

    ``error`` has that shape, too, and ``uncertainty``, of the reference, shape (output,).
    """
    found = np.array(error)
    for k, rung in enumerate(rungs):
        finer = [j for j, other in enumerate(rungs) if _refines(other, rung)]
        worst = np.fmax.reduce(error[[k, *finer]], axis=0)
        found[k] = np.where(np.isfinite(error[k]), worst, np.nan)
    return found + uncertainty


def _refines(fine: Rung, coarse: Rung) -> bool:
    """Whether a setting is finer in something and coarser in nothing."""
    if "fidelity" in (fine.ladder, coarse.ladder):
        return False
    a, b = fine.values, coarse.values
    if any(a[path] != b[path] for path in _SAME):
        return False
    finer = [b[path] - a[path] for path in _SMALLER] + [a["rods.elements"] - b["rods.elements"]]
    return bool(min(finer) >= 0.0 and max(finer) > 0.0)


def typical_cost(seconds: Array, work: Array, rungs: Sequence[Rung]) -> Array:
    """Processor time of each setting without the scatter of single timings, shape (rung,), s.

    Every piece of work costs the same within a ladder, but for a factor for the rods' formulation
    and elements: fitted to the measured ``seconds``, shape (rung,), and the counts of ``work``,
    shape (rung, kinds).  A fidelity keeps its own time.
    """
    cost, measured = np.array(seconds, dtype=float), np.isfinite(seconds)
    sizes = [
        () if r.ladder == "fidelity" else (r.values["rods.kind"], r.values["rods.elements"])
        for r in rungs
    ]
    commonest = max(set(sizes), key=sizes.count)
    own = np.array([size == commonest for size in sizes]) & measured
    scale = 1.0 / np.maximum(seconds[own], 1e-9)  # relative errors count
    shares, _ = nnls(work[own] * scale[:, None], np.ones(own.sum()))
    plain = work @ shares
    if not (plain[own] > 0.0).all():
        return cost
    for size in set(sizes) - {()}:
        members = np.array([each == size for each in sizes]) & measured & (plain > 0.0)
        if members.any():
            cost[members] = plain[members] * np.median(seconds[members] / plain[members])
    return cost


def frontier(cost: Array, error: Array) -> NDArray[np.bool_]:
    """Settings that no other one beats in both cost and error, shape (rung, output)."""
    costs, errors = cost[:, None, None], error[:, None, :]  # of the other one
    no_worse = (costs <= cost[:, None]) & (errors <= error)
    better = no_worse & ((costs < cost[:, None]) | (errors < error))
    best: NDArray[np.bool_] = np.isfinite(error) & ~better.any(axis=0)
    return best


def eligible(rungs: Sequence[Rung]) -> NDArray[np.bool_]:
    """What may be recommended: the full model with the scene's own rods and step control."""
    others = ("fidelity", "formulation", "constant step")
    return np.array([rung.ladder not in others for rung in rungs])


def in_favour(cost: Array, ladders: Sequence[str]) -> Array:
    """Cost by which settings are picked: the scene's own is kept unless another one pays."""
    return cost * np.where(np.array(ladders) == STANDING, WORTH_A_CHANGE, 1.0)


def cheapest(cost: Array, error: Array, targets: Sequence[float]) -> NDArray[np.int64]:
    """The cheapest setting within each target, shape (target, output); -1 if there is none."""
    within = error <= np.array(targets)[:, None, None]
    costs = np.where(within, cost[:, None], np.inf)
    return np.where(within.any(axis=1), costs.argmin(axis=1), -1)
