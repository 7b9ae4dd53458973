"""Asynchrony of the sections over time."""

import math

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style
from ringsim.plots.peaks import label_of, mark, peak_of

_CLOSE = (0.02, 0.5)
"""Least and largest share of the run that the enlarged end shows: fewer records are a few straight
lines, and more is what the whole run shows as well."""


@style.styled
def asynchrony(dataset: xr.Dataset) -> Figure:
    """``asynchrony`` (time) of a run up to the deployment: the whole run and its last seconds.

    ``asynchrony_max``, which also counts the steps between the records, is a point of the curve.
    """
    values = dataset["asynchrony"].dropna("time")
    moving = values[~(values["time"].values > style.deployment_time(dataset))]
    end = float(moving["time"][-1])
    peak = peak_of(dataset, "asynchrony", "asynchrony_max", "asynchrony_max", end)
    times, heights = peak.within(moving)
    figure = Figure(figsize=(10.2, 4.3))
    whole, close = figure.subplots(1, 2, width_ratios=(3, 2))
    for axes in (whole, close):
        axes.fill_between(times, heights, color=style.SKY, alpha=0.25, linewidth=0.0)
        axes.plot(times, heights, color=style.BLUE)
        style.time_axes(dataset, values, axes, named=axes is whole)
    whole.set_ylim(0.0, 1.25 * max(float(np.max(heights)), 1e-9))
    whole.set_ylabel(style.label(values, width=40))
    begin, last = _last_seconds(dataset, end, peak.time)
    if begin < last:
        close.set_xlim(begin, last)
    close.set_ylim(0.0, 1.25 * max(float(np.max(heights[times >= begin])), 1e-9))
    leader, laggard = ("{} {}".format(*joint) for joint in apart(dataset, peak.time))
    mark(whole, peak, str(values.attrs.get("units", "")), f"{laggard} behind {leader}")
    if peak.time >= begin:
        close.plot(peak.time, peak.value, "o", color=style.VERMILLION, markersize=6, zorder=4)
    style.name_panel(close, "the end, enlarged")
    style.head(figure, whole, dataset, "Asynchrony")
    return figure


def apart(dataset: xr.Dataset, time: float) -> tuple[tuple[str, int], tuple[str, int]]:
    """Plane and section of the V-joint that is farthest open at a time (s), and of the least."""
    angles = dataset["opening_angle"].dropna("time", how="all").sel(time=time, method="nearest")
    found = []
    for who, place in (("leader", angles.argmax(...)), ("laggard", angles.argmin(...))):
        plane, section = (
            label_of(dataset, f"asynchrony_{who}_{dim}", angles.isel(place)[dim])
            for dim in ("plane", "section")
        )
        found.append((str(plane), int(section)))
    return found[0], found[1]


def _last_seconds(dataset: xr.Dataset, end: float, peak: float) -> tuple[float, float]:
    """From before the largest value or the first lock to the end, within bounds."""
    locks = dataset["lock_time"].values if "lock_time" in dataset else np.array(math.nan)
    first = float(np.nanmin(np.append(locks, peak)))
    least, most = (share * end for share in _CLOSE)
    length = min(max(1.5 * (end - first), least), most)
    return end - length, max(end, np.nan_to_num(style.deployment_time(dataset))) + 0.05 * length
