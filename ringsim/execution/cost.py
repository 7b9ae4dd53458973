"""Relative cost of samples, as far as their inputs tell: long runs should start first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.overrides import section_of
from ringsim.sampling.columns import Table
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
    """Predicted cost of every sample of the scene ``base``, shape (samples,), with a mean of 1."""
    cost = np.ones(table.samples)
    unused = "tolerance" if base.solver.step_control == "constant" else "step"
    for column in table.columns:
        path = section_of(column.path)[0]
        values = column.values.reshape(table.samples, -1)
        if path == "rods.kind":
            cost *= np.where(values[:, 0] == "ancf", _ANCF, 1.0)
        elif path in _EXPONENTS and path != f"solver.{unused}":
            size = np.abs(values.astype(float)).mean(axis=1)
            cost *= np.maximum(size, 1e-12) ** _EXPONENTS[path]  # no force, no division by it
    relative: Array = cost / cost.mean()
    return relative


def longest_first(samples: NDArray[np.int64], cost: Array) -> list[int]:
    """Samples in the order of falling cost, equal ones by their index.

    >>> longest_first(np.array([0, 2, 3]), np.array([1.0, 9.0, 1.0, 2.0]))
    [3, 0, 2]
    """
    found: list[int] = samples[np.argsort(-cost[samples], kind="stable")].tolist()
    return found
