"""Errors of numerical settings against a reference, their orders and their cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.ladder import PATHS, Rung

Array = NDArray[np.float64]
TARGETS = (1e-2, 1e-3, 1e-4)
"""Errors for which the cheapest setting is looked up."""
REFERENCES = 3
"""Rungs at the end of a ladder that the reference is made of."""
_RICHARDSON = 4.0 / 3.0
"""Change from h to h / 2 times this is the change to h = 0, at second order."""
_MATTERS = 2.0
"""Ratio of the errors along a ladder from which on it shows an order."""

OUTPUTS = {
    "deployment_time": "deployment time",
    "opening_angle": "opening angle, largest difference over the travel",
    "asynchrony": "asynchrony and its largest value, over its largest value",
    "peak_tension": "peak tension",
    "peak_rod_stress": "peak rod stress",
    "peak_bending_strain": "peak bending strain",
}
"""What people use of a result, as far as a scene has it."""
_SCALAR_OF = {"asynchrony": "asynchrony_max"}
GROUPS = {
    "motion": ("deployment_time", "opening_angle", "asynchrony"),
    "loads": ("peak_tension", "peak_rod_stress", "peak_bending_strain"),
}
"""Outputs that are asked for together: the error is the largest of theirs."""
NEEDED = (
    *OUTPUTS, "asynchrony_max", "energy_error", "cpu_time", "newton_iterations", "steps", "status",
    "final_time",
)  # fmt: skip


@dataclass(frozen=True)
class Truth:
    """A value that does not come from the multibody model.

    Attributes
    ----------
    output
        Which of ``OUTPUTS``.
    source
        Where it comes from, in words.
    value
        In the unit of the output; for the opening angle the mean one over time, shape (time,).
    """

    output: str
    source: str
    value: Any


def judge(results: xr.Dataset, rungs: Sequence[Rung], truths: Sequence[Truth]) -> xr.Dataset:
    """Errors, orders, cost and the efficient frontier of a ladder.

    Parameters
    ----------
    results
        ``NEEDED`` variables over the dimension ``rung``, one entry per rung, the three
        references last (see :func:`ringsim.analysis.ladder.ladder`).
    rungs
        The settings.
    truths
        Independent values, if the scene has any.

    Returns
    -------
    xr.Dataset
        ``error`` (rung, output): relative; ``order`` (graded, output): observed along a ladder of
        steps or elements, NaN where errors come near the reference's own; ``uncertainty``
        (output): of the reference, relative; ``reference`` (output): its value, in the output's
        unit, NaN for series (of the asynchrony the largest value); ``frontier`` (rung, output):
        whether no other setting is both cheaper and better; ``cheapest`` (target, output): the
        rung, -1 if none will do;
        ``cpu_time``, ``residual_evaluations``, ``steps``, ``status`` (rung); and for each truth
        its distance from the reference and from every rung.

    Raises
    ------
    ValueError
        If one of the references did not end well.
    """
    good = (results.status == 0).to_numpy()
    if not good[-REFERENCES:].all():
        raise ValueError("a reference run did not end well")
    errors: dict[str, Array] = {}
    floors: dict[str, float] = {}
    best: dict[str, float] = {}
    for name in OUTPUTS:
        if name in results and np.isfinite(results[name].isel(rung=slice(-3, None))).any():
            errors[name], floors[name] = _against_reference(results, name)
            scalar = _SCALAR_OF.get(name, name)
            if results[scalar].dims == ("rung",):
                best[name] = float(_extrapolated(results[scalar]))
    full = np.array([rung.ladder != "fidelity" for rung in rungs])
    errors["energy"] = np.where(full, results.energy_error.to_numpy(), np.nan)
    floors["energy"] = 0.0
    for group, members in GROUPS.items():
        present = [m for m in members if m in errors]
        if present:
            errors[group] = np.max([errors[m] for m in present], axis=0)
            floors[group] = max(floors[m] for m in present)
    outputs = list(errors)
    error = np.array([np.where(good, errors[name], np.nan) for name in outputs]).T
    floor = np.array([floors[name] for name in outputs])
    tried = error[:-REFERENCES]
    cost = results.cpu_time.to_numpy()[:-REFERENCES]
    work = results.newton_iterations.to_numpy() + results.steps.to_numpy()
    own = rungs[:-REFERENCES]
    graded, orders = _orders(tried, floor, own, results.steps.to_numpy())
    found = xr.Dataset(
        {
            "error": (("rung", "output"), tried, _words("error relative to the reference", "1")),
            "order": (("graded", "output"), orders, _words("observed order", "1")),
            "uncertainty": ("output", floor, _words("uncertainty of the reference", "1")),
            "reference": ("output", [best.get(name, np.nan) for name in outputs]),
            "frontier": (("rung", "output"), _frontier(cost, tried)),
            "cheapest": (("target", "output"), _cheapest(cost, tried)),
            "cpu_time": ("rung", cost, _words("processor time of the run", "s")),
            "residual_evaluations": (
                "rung", work[:-REFERENCES], _words("residuals that Newton evaluated", "1"),
            ),
            "steps": ("rung", results.steps.to_numpy()[:-REFERENCES], _words("time steps", "1")),
            "status": ("rung", results.status.to_numpy()[:-REFERENCES]),
            "ladder": ("rung", [rung.ladder for rung in own]),
            "label": ("rung", [rung.label for rung in own]),
        },
        coords={"output": outputs, "target": list(TARGETS), "graded": graded},
    )  # fmt: skip
    for path in PATHS:
        found[path.replace(".", "_")] = ("rung", [rung.values[path] for rung in own])
    return _add_truths(found, results, truths)


def _words(long_name: str, units: str) -> Mapping[str, str]:
    return {"long_name": long_name, "units": units}


def _against_reference(results: xr.Dataset, name: str) -> tuple[Array, float]:
    """Relative errors over the rungs, and the reference's own uncertainty."""
    values = _before_the_end(results, name)
    fine, halved, doubled = (values.isel(rung=k) for k in (-3, -2, -1))
    in_time, in_space = halved - fine, doubled - fine
    best = _extrapolated(values)
    scale = _scale(results, name, best)
    inner = [dim for dim in values.dims if dim != "rung"]
    error = abs(values - best).max(inner).to_numpy() / scale
    own = float((abs(in_time) + abs(in_space)).max(inner) * (_RICHARDSON - 1.0)) / scale
    if name == "asynchrony":
        # The grid of output times may miss the largest value, which the run itself knows.
        largest, uncertain = _against_reference(results, "asynchrony_max")
        return np.maximum(error, largest), max(own, uncertain)
    return error, own


def _extrapolated(values: xr.DataArray) -> xr.DataArray:
    """Richardson's limit of the three reference runs, in time and in space."""
    fine, halved, doubled = (values.isel(rung=k) for k in (-3, -2, -1))
    return fine + _RICHARDSON * ((halved - fine) + (doubled - fine))


def _before_the_end(results: xr.Dataset, name: str) -> xr.DataArray:
    """A variable, series only up to the earliest deployment time of the references."""
    values = results[name]
    if "time" in values.dims:
        last = results.deployment_time if "deployment_time" in results else results.final_time
        ends = last.isel(rung=slice(-REFERENCES, None)).min()
        if not np.isfinite(ends):
            ends = results.final_time.isel(rung=slice(-REFERENCES, None)).min()
        values = values.sel(time=values.time <= ends)
    return values


def _scale(results: xr.Dataset, name: str, best: xr.DataArray) -> float:
    """What makes an error relative: the value itself, or the extent of a series."""
    if name == "asynchrony":
        return float(results.asynchrony_max.isel(rung=-2))
    if name == "opening_angle":
        return float(best.max() - best.min())
    return float(abs(best).max())


def _orders(
    error: Array, floor: Array, rungs: Sequence[Rung], steps: Array
) -> tuple[list[str], Array]:
    """Observed order of each ladder that has one: the slope of log error over log size.

    The three finest errors that stand clear of the reference's own count: coarser ones are not
    small enough to show an order.  Errors that come from elsewhere and hardly change along the
    ladder show none either.
    """
    names = list(dict.fromkeys(rung.ladder for rung in rungs if rung.size > 0.0))
    found = np.full((len(names), error.shape[1]), np.nan)
    for row, name in enumerate(names):
        places = np.array([k for k, rung in enumerate(rungs) if rung.ladder == name])
        # What a tolerance gives is steps, as many as the motion needs and the largest allows.
        moving = name == "tolerance"
        sizes = np.log([1.0 / steps[k] if moving else rungs[k].size for k in places])
        for column in range(error.shape[1]):
            own = error[places, column]
            clear = np.isfinite(own) & (own > max(3.0 * floor[column], 1e-15))
            last = np.flatnonzero(clear)[np.argsort(sizes[clear])][:3]
            if len(last) == 3 and own[last].max() > _MATTERS * own[last].min():
                found[row, column] = np.polyfit(sizes[last], np.log(own[last]), 1)[0]
    return names, found


def _frontier(cost: Array, error: Array) -> NDArray[np.bool_]:
    """Settings that no other one beats in both cost and error, per output."""
    best = np.zeros(error.shape, dtype=bool)
    for column in range(error.shape[1]):
        own = np.where(np.isfinite(error[:, column]), error[:, column], np.inf)
        for row in np.flatnonzero(np.isfinite(own)):
            no_dearer = (cost <= cost[row]) & (own <= own[row])
            better = no_dearer & ((cost < cost[row]) | (own < own[row]))
            best[row, column] = not better.any()
    return best


def _cheapest(cost: Array, error: Array) -> NDArray[np.int64]:
    """The cheapest setting within each target, per output; -1 if there is none."""
    found = np.full((len(TARGETS), error.shape[1]), -1, dtype=np.int64)
    for row, target in enumerate(TARGETS):
        for column in range(error.shape[1]):
            fit = np.flatnonzero(error[:, column] <= target)
            if len(fit):
                found[row, column] = fit[np.argmin(cost[fit])]
    return found


def _add_truths(found: xr.Dataset, results: xr.Dataset, truths: Sequence[Truth]) -> xr.Dataset:
    """How far every rung and the finest reference are from values of other origin, relative."""
    if not truths:
        return found
    rows, distance = [], []
    for truth in truths:
        values = _before_the_end(results, truth.output)
        if truth.output == "opening_angle":
            mean = values.mean(("plane", "section"))
            expected = xr.DataArray(truth.value, dims="time", coords={"time": results.time})
            gap = abs(mean - expected).max("time")
            apart = (gap / _scale(results, truth.output, values.isel(rung=-2))).to_numpy()
        else:
            apart = np.abs(values.to_numpy() / truth.value - 1.0)
        rows.append(f"{truth.output}: {truth.source}")
        distance.append(apart)
    whole = np.array(distance).T
    long_name = "distance from values of other origin, relative"
    found["from_truth"] = (("rung", "truth"), whole[:-REFERENCES], _words(long_name, "1"))
    found["reference_from_truth"] = ("truth", whole[-2], _words(f"reference: {long_name}", "1"))
    return found.assign_coords(truth=rows)
