"""Errors of all rungs of a ladder against the limit of its finest runs, and their orders.

Three levels tell whether refining pays as it should.  Changes that shrink by r from one level to
the next (4 at second order) leave d / (r - 1) of the last change d to go, Richardson (1911);
changes that do not shrink, or alternate in sign, are not extrapolated.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.ladder import Rung, references
from ringsim.variables import GOALS

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
LEAST_ASYNCHRONY = 1e-3
"""deg: below this the asynchrony of a symmetric ring is round-off, and its error not relative."""
GROUPS = {
    "motion": ("deployment_time", "opening_angle"),
    "loads": ("peak_tension", "peak_rod_stress", "peak_bending_strain"),
}
"""Outputs that are asked for together: the error is the largest of theirs.  The motion contains
the asynchrony as a difference of opening angles; relative to itself it is an output of its own."""
_SECOND_ORDER = 4.0
"""Ratio of successive changes where steps halve and the order is two; no more is believed."""
_SHRINKING = 1.5
"""Ratio from which on changes count as shrinking."""
_CLEAR = 1.5
"""An error over the limit's uncertainty from which on it counts for a slope."""
_ABOUT = 0.2
"""Share by which an error may rise towards finer steps and still count as falling."""
_MATTERS = 2.0
"""Ratio of the errors along a ladder from which on it shows an order."""


class Limit(NamedTuple):
    """A value (of any shape), and its largest uncertainty anywhere, in its own unit."""

    value: xr.DataArray
    uncertainty: float


def limit(values: xr.DataArray) -> Limit:
    """Limit of three levels along ``rung``, each with steps (or elements) half as long.

    The uncertainty is all that was extrapolated, and at least what second order would leave of
    the first change: two fine runs may agree by chance.  Of two levels nothing is extrapolated.
    """
    if values.sizes["rung"] == 2:
        finer = values.isel(rung=1, drop=True)
        return Limit(finer, float(abs(values.diff("rung")).max()))
    coarse, middle, fine = (values.isel(rung=k, drop=True) for k in range(3))
    first, last = middle - coarse, fine - middle
    before, now = float(abs(first).max()), float(abs(last).max())
    if now * _SHRINKING > before or before == 0.0:
        return Limit(fine, max(before, now))
    least = before / _SECOND_ORDER / (_SECOND_ORDER - 1.0)
    if float((first * last).sum()) < 0.0:  # alternating: the limit lies between the last two
        return Limit(fine, max(now, least))
    ratio = min(before / max(now, 1e-300), _SECOND_ORDER)
    return Limit(fine + last / (ratio - 1.0), max(now / (ratio - 1.0), least))


def reference(in_time: xr.DataArray, in_space: xr.DataArray) -> Limit:
    """Limit of three levels of steps, and what levels of elements change, along ``rung``.

    Of the elements the last three levels are extrapolated; the first has those of ``in_time``.
    """
    steps, elements = limit(in_time), limit(in_space.isel(rung=slice(-3, None)))
    more = elements.value - in_space.isel(rung=0, drop=True)
    return Limit(steps.value + more, steps.uncertainty + elements.uncertainty)


def largest(values: xr.DataArray) -> Array:
    """The largest size of each rung's values, shape (rung,)."""
    return np.asarray(abs(values).max([dim for dim in values.dims if dim != "rung"]))


def order(values: xr.DataArray, noise: float) -> float:
    """Observed order of three levels along ``rung``; NaN unless changes shrink above the noise,
    and of fewer levels.

    Each level has half the length of elements of the one before; ``noise`` is the largest effect
    of anything else, in the unit of the values.
    """
    if values.sizes["rung"] < 3:
        return np.nan
    first, last = largest(values.diff("rung")).tolist()
    return float(np.log2(first / last)) if first > last > noise else np.nan


def slope(sizes: Array, error: Array, uncertainty: float) -> float:
    """Slope of log error over log size among all errors above the uncertainty of their limit.

    All of them, because two may agree by chance.  NaN if errors rise somewhere towards finer
    steps, or hardly change.
    """
    clear = np.isfinite(error) & (error > max(_CLEAR * uncertainty, 1e-300))
    finer = error[clear][np.argsort(-sizes[clear])]
    falls = len(finer) >= 3 and (np.diff(finer) <= _ABOUT * finer[:-1]).all()
    if not falls or finer[0] < _MATTERS * finer[-1]:
        return np.nan
    return float(np.polyfit(np.log(sizes[clear]), np.log(error[clear]), 1)[0])


class Errors:
    """Errors, uncertainties and reference values by output.

    ``of`` has relative errors, shape (rung,) each, by output and group of outputs, NaN where a run
    failed or has none; ``uncertainty`` that of the reference, relative; ``best`` the reference
    where it is one number, in the output's unit; ``good``, shape (rung,): which rungs ended well.
    """

    def __init__(self, results: xr.Dataset, rungs: Sequence[Rung], fidelity: str = "full") -> None:
        """Compare results over ``rung`` with the limit of a fidelity's.

        Raises
        ------
        ValueError
            If too few of its references ended well.
        """
        self.results, self._rungs, self._fidelity = results, rungs, fidelity
        self.good = ((results.status == 0) & results.outcome.isin(GOALS)).to_numpy()
        self._in_time, self._in_space = references(rungs, self.good, fidelity)
        places = self._in_time + self._in_space
        ends = results[["deployment_time", "final_time"]].isel(rung=places).min(skipna=False)
        deployed = float(ends.deployment_time)
        self._end = float(ends.final_time) if np.isnan(deployed) else deployed
        self.of: dict[str, Array] = {}
        self.uncertainty: dict[str, float] = {}
        self.best: dict[str, float] = {}
        for name in (name for name in OUTPUTS if name in results):
            if np.isfinite(largest(self.until_the_end(name).isel(rung=places))).all():
                self._judge(name)
        self.of["energy"] = np.where(self.good, results.energy_error, np.nan)
        self.uncertainty["energy"] = 0.0
        for group, members in GROUPS.items():
            if present := [m for m in members if m in self.of]:
                self.of[group] = np.max([self.of[m] for m in present], axis=0)
                self.uncertainty[group] = max(self.uncertainty[m] for m in present)

    def until_the_end(self, name: str) -> xr.DataArray:
        """A variable, series only up to the earliest deployment time of the references."""
        values = self.results[name]
        return held(values.sel(time=values.time <= self._end)) if "time" in values.dims else values

    def best_of(self, name: str) -> Limit:
        """The reference of a variable, in its unit."""
        values = self.until_the_end(name)
        return reference(values.isel(rung=self._in_time), values.isel(rung=self._in_space))

    def scale(self, name: str, best: xr.DataArray) -> float:
        """What an error is relative to: the value itself, or the extent of a series."""
        if name.startswith("asynchrony"):
            return max(float(self.results.asynchrony_max[self._in_time[-1]]), LEAST_ASYNCHRONY)
        return float(best.max() - best.min() if name == "opening_angle" else abs(best).max())

    def _judge(self, name: str) -> None:
        error, own = np.full(len(self.good), np.nan), 0.0
        # Of the asynchrony the largest value counts, too: the grid of output times may miss it.
        for each in (name, "asynchrony_max") if name == "asynchrony" else (name,):
            values, best = self.until_the_end(each), self.best_of(each)
            scale = self.scale(each, best.value)
            error = np.fmax(error, largest(values - best.value) / scale)
            own = max(own, best.uncertainty / scale)
        self.of[name] = np.where(self.good, error, np.nan)
        self.uncertainty[name] = own
        if best.value.ndim == 0:
            self.best[name] = float(best.value)

    def orders(self) -> tuple[list[str], Array]:
        """Names of the fidelity's ladders that may have an order, and those orders, shape (ladder,
        output).

        Steps show the slope of their errors against the limit of the steps, whatever the elements
        are; elements and formulations that of the changes from level to level, which all share the
        error of their steps.
        """
        ladders: dict[str, list[int]] = {}
        for k, rung in enumerate(self._rungs):
            # Longer steps than the scene's own are too long to show an order.
            too_long = rung.ladder == "steps" and rung.size > 1.0
            if rung.size > 0.0 and not too_long and rung.fidelity == self._fidelity:
                ladders.setdefault(rung.ladder, []).append(k)
        found = np.full((len(ladders), len(self.of)), np.nan)
        for row, (name, own) in enumerate(ladders.items()):
            sizes = np.array([self._rungs[k].size for k in own])
            for column, output in enumerate(self.of):
                if output == "energy":
                    found[row, column] = slope(sizes, self.of[output][own], 0.0)
                elif output in OUTPUTS:
                    values = self.until_the_end(output)
                    steps = limit(values.isel(rung=self._in_time))
                    if name not in ("elements", "formulation"):
                        error = np.where(self.good, largest(values - steps.value), np.nan)
                        found[row, column] = slope(sizes, error[own], steps.uncertainty)
                    elif self.good[own[-3:]].all():
                        found[row, column] = order(values.isel(rung=own[-3:]), steps.uncertainty)
        return list(ladders), found


def held(values: xr.DataArray) -> xr.DataArray:
    """Series with their last value kept from the end of a run on: a locked V-joint stays locked."""
    # What DataArray.ffill does, which needs bottleneck or numbagg.
    values = values.transpose(..., "time")
    series = values.to_numpy()
    last = np.where(np.isfinite(series), np.arange(series.shape[-1]), 0)
    kept = np.take_along_axis(series, np.maximum.accumulate(last, axis=-1), axis=-1)
    return values.copy(data=kept)
