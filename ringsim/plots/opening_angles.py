"""Opening angles of all V-joints over time."""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, MultipleLocator

from ringsim.plots import style

LEAST_SPAN = 0.01
"""Smallest range (degree) of the axis of deviations, so that round-off is not magnified."""


@style.styled
def opening_angles(dataset: xr.Dataset) -> Figure:
    """``opening_angle`` (plane, section, time) and, until all have locked, its deviation from the
    mean of all.

    Each plane has a column, and colour counts the sections; ``lock_time`` and ``deployment_time``
    are marked where they are known.
    """
    angle = dataset["opening_angle"].dropna("time", how="all")
    deviation = deviations(dataset)
    planes, sections = dataset["plane"].values.tolist(), dataset["section"]
    figure = Figure(figsize=(5.2 * len(planes) + 0.6, 6.4))
    grid = figure.subplots(
        2, len(planes), sharex=True, sharey="row", squeeze=False, height_ratios=(3, 2)
    )
    for (upper, lower), plane in zip(grid.T, planes, strict=True):
        _draw_lines(upper, angle.sel(plane=plane))
        lines = _draw_lines(lower, deviation.sel(plane=plane))
        _mark_locks(upper, dataset, plane)
        style.name_panel(upper, f"{plane} plane", height=0.91)
        style.time_axes(dataset, angle, upper, lower)
    _limits(grid, angle, deviation)
    grid[0, 0].set_ylabel(style.label(angle))
    grid[1, 0].set_ylabel(f"Deviation from\nthe mean ({angle.attrs.get('units', '')})")
    figure.align_ylabels(grid[:, 0])
    if sections.size > 1:
        bar = figure.colorbar(lines, ax=grid, aspect=40, pad=0.015, label=style.label(sections))
        bar.set_ticks(MaxNLocator(12, integer=True))
        bar.minorticks_off()
        bar.outline.set_visible(False)
    style.head(figure, grid[0, 0], dataset, "Opening angles")
    return figure


def deviations(dataset: xr.Dataset) -> xr.DataArray:
    """Opening angles less their mean over all V-joints, (plane, section, time), degree.

    As recorded up to the deployment, or the end of a run without: what locked joints do when they
    rebound is no deviation.
    """
    angle = dataset["opening_angle"].dropna("time", how="all")
    angle = angle[..., ~(angle["time"].values > style.deployment_time(dataset))]
    found = angle - angle.mean(("plane", "section"), skipna=True)
    return found.assign_attrs(angle.attrs, long_name="deviation from the mean opening angle")


def _draw_lines(axes: Axes, values: xr.DataArray) -> LineCollection:
    sections, rows = values["section"].values, values.transpose("section", "time").values
    lines = LineCollection(
        [np.column_stack([values["time"], row]) for row in rows],
        array=sections,
        cmap=style.section_colours(len(sections)),
        norm=BoundaryNorm(np.arange(len(sections) + 1) + sections[0] - 0.5, len(sections)),
        linewidths=1.3 if len(sections) <= 24 else 0.9,
    )
    axes.add_collection(lines)
    return lines


def _mark_locks(axes: Axes, dataset: xr.Dataset, plane: str) -> None:
    axes.axhline(180.0, color=style.GREY, linewidth=0.8, zorder=1.4)
    if "lock_time" not in dataset:
        return
    moments = dataset["lock_time"].sel(plane=plane).values
    locked = np.flatnonzero(np.isfinite(moments))
    axes.scatter(
        moments[locked], np.full(len(locked), 180.0), s=22, zorder=3, edgecolors="white",
        c=style.section_colours(len(moments))(locked), linewidths=0.5, clip_on=False,
    )  # fmt: skip


def _limits(grid: np.ndarray, angle: xr.DataArray, deviation: xr.DataArray) -> None:
    """Room for all that is drawn."""
    lowest, highest = (float(angle.min()), float(angle.max())) if angle.size else (0.0, 180.0)
    grid[0, 0].set_ylim(30.0 * math.floor(lowest / 30.0), max(188.0, highest + 4.0))
    for axes in grid[0]:
        axes.yaxis.set_major_locator(MultipleLocator(30.0))
    span = max(1.15 * style.largest_magnitude(deviation), LEAST_SPAN)
    grid[1, 0].set_ylim(-span, span)
