"""Asynchrony of the sections over time."""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ringsim.plots import style


@style.styled
def asynchrony(dataset: xr.Dataset) -> Figure:
    """``asynchrony`` (time) of a run, with its largest value up to the deployment.

    ``asynchrony_max`` also counts the steps between the recorded times: a dotted line marks it
    where it is not among them.
    """
    values = dataset["asynchrony"].dropna("time")
    figure = Figure(figsize=(8.0, 4.3))
    axes = figure.subplots()
    axes.fill_between(values["time"], values, color=style.SKY, alpha=0.25, linewidth=0.0)
    axes.plot(values["time"], values, color=style.BLUE)
    stated = float(dataset.get("asynchrony_max", math.nan))
    style.span_sizes(axes, np.append(values.values, stated))
    axes.set_ylabel(style.label(values, width=40))
    style.time_axes(dataset, values, axes)
    moving = values[~(values["time"].values > style.deployment_time(dataset))]
    if moving.size:
        _mark_largest(axes, moving, stated)
    style.head(figure, axes, dataset, "Asynchrony")
    return figure


def _mark_largest(axes: Axes, values: xr.DataArray, stated: float) -> None:
    at, largest, hint = float(values.idxmax()), float(values.max()), ""
    if stated > 1.01 * largest:
        axes.axhline(stated, color=style.VERMILLION, linewidth=1.0, linestyle=(0, (1, 2)))
        hint = ", between two recorded times"
    else:
        axes.plot(at, largest, "o", color=style.VERMILLION, markersize=7, zorder=4, clip_on=False)
    number = f"{stated if math.isfinite(stated) else largest:.3g}"
    left = at > 0.5 * axes.get_xlim()[1]
    axes.annotate(
        f"largest: {number} {values.attrs.get('units', '')}{hint}",
        (at, stated if hint else largest),
        xytext=(-9 if left else 9, 5), textcoords="offset points", va="bottom",
        ha="right" if left else "left", color=style.VERMILLION, bbox=style.PAPER,
    )  # fmt: skip
