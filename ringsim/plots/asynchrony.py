"""Asynchrony of the sections over time."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ringsim.plots import style, wording


@style.styled
def asynchrony(dataset: xr.Dataset) -> Figure:
    """Asynchrony over time, with its largest value up to the deployment.

    Parameters
    ----------
    dataset
        A run with ``asynchrony`` (time); ``asynchrony_max`` also counts the steps between
        the recorded times: a dotted line marks it where it is not among them.

    Returns
    -------
    Figure
        One axes.
    """
    values = dataset["asynchrony"].dropna("time")
    moment = wording.deployment_time(dataset)
    figure = style.new_figure(8.0, 4.3)
    axes = figure.subplots()
    axes.fill_between(values["time"], values, color=style.SKY, alpha=0.25, linewidth=0.0)
    axes.plot(values["time"], values, color=style.BLUE)
    style.span_time(axes, values)
    style.span_sizes(axes, np.append(values.values, dataset.get("asynchrony_max", math.nan)))
    axes.set_xlabel(wording.label(dataset["time"]))
    axes.set_ylabel(wording.label(values, width=40))
    if math.isfinite(moment):
        style.mark_moment(axes, moment, f"all locked at {moment:.2f} s")
    _mark_largest(axes, dataset, values)
    wording.head(figure, axes, dataset, "Asynchrony")
    return figure


def _mark_largest(axes: Axes, dataset: xr.Dataset, values: xr.DataArray) -> None:
    moment = wording.deployment_time(dataset)
    until = values.where(values["time"] <= moment, drop=True) if math.isfinite(moment) else values
    if not until.size:
        return
    at, largest = float(until["time"].values[until.values.argmax()]), float(until.max())
    stated = float(dataset["asynchrony_max"]) if "asynchrony_max" in dataset else math.nan
    units = values.attrs.get("units", "")
    left = at > 0.5 * axes.get_xlim()[1]
    place, hint = (at, largest), ""
    if stated > 1.01 * largest:
        axes.axhline(stated, color=style.VERMILLION, linewidth=1.0, linestyle=(0, (1, 2)))
        place, hint = (at, stated), ", between two recorded times"
    else:
        axes.plot(*place, "o", color=style.VERMILLION, markersize=7, zorder=4, clip_on=False)
    axes.annotate(
        f"largest: {stated if math.isfinite(stated) else largest:.3g} {units}{hint}",
        place,
        xytext=(-9 if left else 9, 5),
        textcoords="offset points",
        ha="right" if left else "left",
        va="bottom",
        color=style.VERMILLION,
        bbox=style.PAPER,
    )
