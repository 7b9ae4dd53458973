"""Errors of all rungs of a ladder against the limit of its finest runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.ladder import Rung, references
from ringsim.analysis.reference import Limit, inner, reference

Array = NDArray[np.float64]
OUTPUTS = {
    "deployment_time": "deployment time",
    "opening_angle": "opening angle",
    "asynchrony": "asynchrony",
    "peak_tension": "peak tension",
    "peak_rod_stress": "peak stress",
    "peak_bending_strain": "peak strain",
}
"""What people use of a result, as far as a scene has it, and its name in tables."""
_LARGEST = {"asynchrony": "asynchrony_max"}
"""Series whose largest value counts, too: the grid of output times may miss it."""
LEAST_ASYNCHRONY = 1e-3
"""deg: below this the asynchrony of a symmetric ring is round-off, and its error not relative."""
GROUPS = {
    "motion": ("deployment_time", "opening_angle"),
    "loads": ("peak_tension", "peak_rod_stress", "peak_bending_strain"),
}
"""Outputs that are asked for together: the error is the largest of theirs.  The motion contains
the asynchrony as a difference of opening angles; relative to itself it is an output of its own."""


class Errors:
    """Errors, uncertainties and reference values by output.

    ``of`` has relative errors, shape (rung,) each, by output and group of outputs, NaN where a run
    failed or has none; ``uncertainty`` that of the reference, relative; ``best`` the reference's
    value in the output's unit, where it is a single one; ``good``, shape (rung,), whether a rung
    ended well; ``in_time`` and ``in_space`` are the rungs of the reference.
    """

    def __init__(self, results: xr.Dataset, rungs: Sequence[Rung]) -> None:
        """Compare results over ``rung``; raises ValueError if a reference run did not end well."""
        self.results = results
        self.in_time, self.in_space = references(list(rungs))
        places = sorted({*self.in_time, *self.in_space})
        self.good = (results.status == 0).to_numpy()
        if not self.good[places].all():
            raise ValueError("a reference run did not end well")
        ends = results.deployment_time.isel(rung=places)
        if not np.isfinite(ends).all():
            ends = results.final_time.isel(rung=places)
        self._end = float(ends.min())
        self.of: dict[str, Array] = {}
        self.uncertainty: dict[str, float] = {}
        self.best: dict[str, float] = {}
        for name in OUTPUTS:
            if name in results:
                known = self.until_the_end(name).isel(rung=places).notnull()
                if known.any(inner(known)).all():
                    self._judge(name)
        full = np.array([rung.ladder != "fidelity" for rung in rungs])
        self.of["energy"] = np.where(full & self.good, results.energy_error, np.nan)
        self.uncertainty["energy"] = 0.0
        for group, members in GROUPS.items():
            present = [m for m in members if m in self.of]
            if present:
                self.of[group] = np.max([self.of[m] for m in present], axis=0)
                self.uncertainty[group] = max(self.uncertainty[m] for m in present)

    def until_the_end(self, name: str) -> xr.DataArray:
        """A variable, series only up to the earliest deployment time of the references."""
        values = self.results[name]
        if "time" not in values.dims:
            return values
        return held(values.sel(time=values.time <= self._end))

    def best_of(self, name: str) -> Limit:
        """The reference of a variable, in its unit."""
        values = self.until_the_end(name)
        return reference(values.isel(rung=self.in_time), values.isel(rung=self.in_space))

    def scale(self, name: str, best: xr.DataArray) -> float:
        """What an error is relative to: the value itself, or the extent of a series."""
        if name in _LARGEST or name in _LARGEST.values():
            largest = float(self.results.asynchrony_max.isel(rung=self.in_time[-1]))
            return max(largest, LEAST_ASYNCHRONY)
        if name == "opening_angle":
            return float(best.max() - best.min())
        return float(abs(best).max())

    def _judge(self, name: str) -> None:
        error, own, best = self._against_reference(name)
        if name in _LARGEST:
            largest, uncertain, best = self._against_reference(_LARGEST[name])
            error, own = np.fmax(error, largest), max(own, uncertain)
        self.of[name] = np.where(self.good, error, np.nan)
        self.uncertainty[name] = own
        if best.ndim == 0:
            self.best[name] = float(best)

    def _against_reference(self, name: str) -> tuple[Array, float, xr.DataArray]:
        """Errors over the rungs, the reference's uncertainty (both relative), and its value."""
        values, best = self.until_the_end(name), self.best_of(name)
        scale = self.scale(name, best.value)
        error = abs(values - best.value).max(inner(values)).to_numpy() / scale
        return error, best.uncertainty / scale, best.value


def held(values: xr.DataArray) -> xr.DataArray:
    """Series with their last value kept from the end of a run on: a locked V-joint stays locked.

    What ``DataArray.ffill`` does, which needs bottleneck or numbagg.
    """
    series = values.transpose(..., "time").to_numpy()
    last = np.where(np.isfinite(series), np.arange(series.shape[-1]), 0)
    kept = np.take_along_axis(series, np.maximum.accumulate(last, axis=-1), axis=-1)
    return values.transpose(..., "time").copy(data=kept)
