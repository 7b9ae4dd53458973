"""Relative cost of samples, as far as their inputs tell: long runs should start first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.overrides import section_of
from ringsim.sampling.columns import Column, Table
from ringsim.scene import Scene

Array = NDArray[np.float64]
_EXPONENTS = {
    "rods.elements": 0.7,
    "loads.force": -0.5,
    "solver.step": -1.0,
    "solver.tolerance": -1.0 / 3.0,
}
"""Cost grows like the input to this power: time per step measured over elements, duration of
the motion under a constant force, number of steps over the step or its tolerance."""

_ANCF = 2.7
"""Time of a run with rods of kind "ancf" over that of "geometrically-exact"."""


def relative_cost(table: Table, base: Scene) -> Array:
    """Predicted cost of every sample, shape (samples,), with a mean of 1.

    Parameters
    ----------
    table
        Inputs of the samples.
    base
        Scene that they vary.
    """
    cost = np.ones(table.samples)
    for column in table.columns:
        cost *= _factor(column, base)
    relative: Array = cost / cost.mean()
    return relative


def longest_first(samples: NDArray[np.int64], cost: Array) -> list[int]:
    """Samples in the order of falling cost, equal ones by their index."""
    found: list[int] = samples[np.argsort(-cost[samples], kind="stable")].tolist()
    return found


def _factor(column: Column, base: Scene) -> Array:
    path = section_of(column.path)[0]
    values = column.values
    flat = values.reshape(len(values), -1)
    if path == "rods.kind":
        return np.where(flat[:, 0] == "ancf", _ANCF, 1.0)
    constant = base.solver.step_control == "constant"
    if path not in _EXPONENTS or (
        path.startswith("solver.") and constant != (path == "solver.step")
    ):
        return np.ones(len(values))
    size = np.abs(flat.astype(float)).mean(axis=1)
    factor: Array = np.maximum(size, 1e-12) ** _EXPONENTS[path]
    return factor
