"""The largest value of a run as a point of what is drawn.

Records stand at fixed times, so that campaigns have one time axis; a peak seldom falls on one.
Its value, time and place are numbers of the dataset, and figures put them into the curve.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from ringsim.outputs.family import Array
from ringsim.plots import style
from ringsim.tables import known_to


class Peak(NamedTuple):
    """A largest value, in the unit of its variable, when (s) and where along each dimension."""

    value: float
    time: float
    place: dict[str, Any]
    error: float = math.nan
    """Its numerical error bar."""

    def within(self, values: xr.DataArray, factor: float = 1.0) -> tuple[Array, Array]:
        """Times and values of a recorded curve (time,), with the peak as one of its points.

        As they are if the peak stands elsewhere: ``values`` has its place as coordinates.
        """
        times, heights = values["time"].values, factor * values.values
        here = {dim: values[dim].item() for dim in self.place if dim in values.coords}
        own = here.items() <= self.place.items()
        if not own or not math.isfinite(self.value):
            return times, heights
        if factor * self.value in heights[times == self.time]:
            return times, heights
        at = int(np.searchsorted(times, self.time))
        return np.insert(times, at, self.time), np.insert(heights, at, factor * self.value)


def peak_of(
    dataset: xr.Dataset, series: str, value: str, until: float = math.inf, stem: str = ""
) -> Peak:
    """The largest of a variable over (..., time), at any step of a run up to a time in s.

    ``value`` names the number that holds it; ``STEM_time`` and ``STEM_DIM`` are when and where,
    the stem being its name if none is given.  What a dataset lacks of these is that of the largest
    record nearby.
    """
    stem = stem or value
    records = dataset[series].where(dataset["time"] <= until)
    time = float(dataset.get(f"{stem}_time", math.nan))
    after = int(np.searchsorted(records["time"].values, time))
    near = records.isel(time=slice(max(after - 1, 0), after + 1))
    near = near if math.isfinite(time) and np.isfinite(near).any() else records
    best = near.isel({dim: int(k) for dim, k in near.argmax(...).items()})
    dims = [str(dim) for dim in records.dims if dim != "time"]
    place = {dim: label_of(dataset, f"{stem}_{dim}", best[dim]) for dim in dims}
    stated = float(dataset.get(value, math.nan))
    return Peak(
        stated if math.isfinite(stated) else float(best),
        time if math.isfinite(time) else float(best["time"]), place,
        float(dataset.get(f"{value}_error", math.nan)),
    )  # fmt: skip


def label_of(dataset: xr.Dataset, name: str, nearby: xr.DataArray) -> Any:
    """A label along a dimension that a variable holds; that of ``nearby`` if there is none."""
    held = dataset[name].item() if name in dataset else None
    return held if held in dataset[str(nearby.name)].values else nearby.item()


def mark(axes: Axes, peak: Peak, units: str, place: str, factor: float = 1.0) -> None:
    """A dot at a peak, and its value, time and place in words away from it and from curves."""
    if not math.isfinite(peak.value):
        return
    height = factor * peak.value
    told = known_to(f"{height:.3g}", factor * peak.error, exact=height)
    axes.plot(peak.time, height, "o", color=style.VERMILLION, markersize=6, zorder=4, clip_on=False)
    early = peak.time < 0.5 * sum(axes.get_xlim())
    style.free(axes.text(
        0.98 if early else 0.02, 0.95 if early else 0.82,
        f"largest: {told} {units} at {peak.time:.4g} s\n{place}", transform=axes.transAxes,
        va="top", ha="right" if early else "left", color=style.VERMILLION, bbox=style.PAPER,
        zorder=5,
    ))  # fmt: skip
