"""Campaigns made of formulas, as ringsim merges them."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr

from ringsim.sampling.designs.latin_hypercube import LatinHypercube
from ringsim.sampling.designs.sobol import Sobol
from ringsim.variables import Fate, Status

AXES = dict.fromkeys("abc")
"""Stand for three inputs: designs ask only how many there are."""


def response(points):
    """A smooth skewed function with interactions on the unit cube, skewness 0.35."""
    a, b, c = np.moveaxis(points, -1, 0)
    return np.exp(0.5 * a) + b**2 + 0.5 * np.sin(3 * c) * a + 0.3 * b * c


def points(kind, samples, replicates, seed):
    if kind == "random":
        return np.random.default_rng(seed).random((samples, 3))
    design = {"sobol": Sobol, "latin-hypercube": LatinHypercube}[kind]
    return design(samples=samples, replicates=replicates).points(AXES, seed)


def campaign(values, *, design=None, status=None, outcome=None, **more):
    """A merged campaign with values of asynchrony_max, by default all runs deployed."""
    count = len(values)
    status = np.full(count, Status.OK) if status is None else np.asarray(status)
    outcome = np.full(count, Fate.DEPLOYED) if outcome is None else np.asarray(outcome)
    arrays = {"status": status.astype("i1"), "outcome": outcome.astype("i1")}
    arrays |= {"asynchrony_max": np.asarray(values, dtype=float)} | more
    design = {"kind": "random", "samples": count} if design is None else design
    return xr.Dataset(
        {name: (("sample", "pulley")[: np.ndim(v)], v) for name, v in arrays.items()},
        coords={"sample": np.arange(count)},
        attrs={"design": json.dumps(design), "title": "made", "identity": "made"},
    )
