"""Campaigns made of formulas, as ringsim merges them."""

from __future__ import annotations

import json

import numpy as np
import xarray as xr

from ringsim.sampling.designs.independent import LatinHypercube, Sobol
from ringsim.sampling.distributions import Uniform
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


UNIT = json.dumps({"kind": "uniform", "low": 0.0, "high": 1.0})


def drawn_campaign(design, output, count, seed, lost=None, **more):
    """A merged campaign of inputs x1, x2, ... in the unit interval; ``lost`` takes them."""
    factors = dict.fromkeys(f"x{k + 1}" for k in range(count))
    law = Uniform(low=0.0, high=1.0)
    factors = dict.fromkeys(factors, law)
    x = design.points(factors, seed)
    gone = np.zeros(len(x), dtype=bool) if lost is None else lost(x)
    made = campaign(
        np.where(gone, np.nan, output(x)), design=json.loads(design.model_dump_json()),
        status=np.where(gone, Status.DIVERGED, Status.OK),
        outcome=np.where(gone, Fate.NONE, Fate.DEPLOYED), **more,
    )  # fmt: skip
    for path, column in zip(factors, x.T, strict=True):
        made[path] = "sample", column, {"role": "input", "path": path, "distribution": UNIT}
    if hasattr(design, "rows"):
        made["block_row"] = "sample", np.array(design.rows(factors, seed)), {"role": "label"}
    return made


def ishigami(points):
    """Ishigami's function of three numbers in the unit interval, with a = 7 and b = 0.1."""
    x = np.pi * (2 * points - 1)
    return np.sin(x[..., 0]) * (1 + 0.1 * x[..., 2] ** 4) + 7 * np.sin(x[..., 1]) ** 2


def ishigami_indices():
    """First-order and total indices in closed form; Ishigami and Homma (1990)."""
    b4, b8 = 0.1 * np.pi**4, 0.01 * np.pi**8
    first = np.array([0.5 * (1 + b4 / 5) ** 2, 49 / 8, 0.0])
    both = b8 * (1 / 18 - 1 / 50)
    total = first + np.array([both, 0.0, both])
    return first / (first.sum() + both), total / (first.sum() + both)


def grouped(points):
    """A function of two groups, x1 with x2 and x3, of variance 1: shares 1/6, 1/3 and 1/2."""
    one, other = points[..., 0] + points[..., 1] - 1, points[..., 2] - 0.5
    return one + 2 * other + 6 * one * other
