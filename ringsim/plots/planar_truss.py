"""A planar truss over the length of its driving cable: tension, and strain of the upper beam."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator
from scipy.constants import kilogram_force

from ringsim.plots import style
from ringsim.plots.peaks import Peak, peak_of

_PASSAGES = (("reeled in", style.BLUE, "-"), ("reeled out", style.ORANGE, (0, (5, 1.5))))
_SHOWN = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Shares of the cable's longest length at which the strain is drawn along the beam."""


@style.styled
def tension_over_length(dataset: xr.Dataset) -> Figure:
    """``cable_tension`` (plane, span, time) over ``cable_length`` (plane, time).

    As paper 001's fig. 8: in N and kgf, of the span whose length changes, while reeled in and out.
    """
    tension = dataset["cable_tension"].isel(plane=0, span=-1)
    figure = Figure(figsize=(8.0, 4.8))
    axes = figure.subplots()
    parts = zip(_split(dataset, tension), _PASSAGES, strict=True)
    for (lengths, values), (name, colour, dashes) in parts:
        axes.plot(lengths, values, color=colour, linestyle=dashes, label=name)
    top = peak_of(dataset, "cable_tension", "peak_tension", "peak_tension", np.inf)
    _mark(axes, dataset, top, str(tension.attrs["units"]))
    _length_axis(axes, dataset)
    axes.set_ylim(0.0, 1.12 * (peak := top.value))
    axes.set_ylabel(style.label(tension))
    both_ways = (lambda n: np.divide(n, kilogram_force), lambda w: np.multiply(w, kilogram_force))
    weight = axes.secondary_yaxis("right", functions=both_ways)
    weight.set_ylabel("Tension (kgf)")
    weight.spines["right"].set_visible(True)
    weight.yaxis.set_major_locator(MultipleLocator(0.5))
    length = 1e3 * dataset["cable_length"].isel(plane=0)
    if float(tension.isel(time=int(np.nanargmin(length.values)))) >= 0.9 * peak:
        axes.annotate(
            "contraction ends:\nwinding only stretches\nthe cable",
            (float(length.min()), 0.9 * peak), xytext=(10, 0), textcoords="offset points",
            va="center", color=style.GREY, bbox=style.PAPER,
        )  # fmt: skip
    axes.legend(loc="upper right")
    style.head(figure, axes, dataset, "Cable tension")
    return figure


@style.styled
def strain_over_length(dataset: xr.Dataset) -> Figure:
    """``bending_strain`` (station, time) of the upper beam, as paper 001's fig. 9.

    Left over ``cable_length`` (plane, time), at the station with the largest strain and in the
    middle of the beam; right along the beam at some lengths while reeled in.
    """
    strain = dataset["bending_strain"]
    figure = Figure(figsize=(11.0, 4.8))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
    station = strain["station"].values
    middle = int(np.abs(station - 0.5 * (station[0] + station[-1])).argmin())
    largest = int(np.nanargmax(strain.max("time").values))
    passages = list(zip(_split(dataset, strain), _PASSAGES, strict=True))
    for place, colour in {largest: style.VERMILLION, middle: style.GREEN}.items():
        for (lengths, values), (_, _, dashes) in passages:
            left.plot(lengths, values.isel(station=place), color=colour, linestyle=dashes)
        left.plot([], [], color=colour, label=f"{1e3 * station[place]:.0f} mm along the beam")
    for name, _, dashes in _PASSAGES:
        left.plot([], [], color=style.GREY, linestyle=dashes, label=name)
    peak = "peak_bending_strain"
    _mark(left, dataset, peak_of(dataset, "bending_strain", peak, peak, np.inf), "")
    _length_axis(left, dataset)
    left.set_ylabel(style.label(strain))
    left.set_ylim(0.0, 1.35 * float(strain.max()))
    left.legend(loc="upper left", ncols=2)
    left.ticklabel_format(axis="y", scilimits=(0, 0), useMathText=True)
    _draw_along(right, *passages[0][0])
    style.head(figure, left, dataset, "Bending of the upper beam", pad=18.0)
    return figure


def _draw_along(axes: Axes, lengths: xr.DataArray, strain: xr.DataArray) -> None:
    colours = style.section_colours(len(_SHOWN))
    for number, share in enumerate(_SHOWN):
        wanted = share / _SHOWN[-1] * float(lengths.max())
        moment = int(np.abs(lengths.values - wanted).argmin())
        axes.plot(
            1e3 * strain["station"], strain.isel(time=moment), "o-", markersize=3.5,
            color=colours(number), label=f"{float(lengths[moment]):.0f} mm of cable",
        )  # fmt: skip
    axes.set_xlim(left=0.0)
    axes.set_xlabel(style.label(strain["station"], "mm", width=40))
    axes.legend(loc="upper left")


def _mark(axes: Axes, dataset: xr.Dataset, peak: Peak, units: str) -> None:
    """A dot at the largest value, at the cable's length at that time."""
    lengths = 1e3 * dataset["cable_length"].isel(plane=0).dropna("time")
    axes.plot(
        np.interp(peak.time, lengths["time"], lengths), peak.value, "o", color=style.VERMILLION,
        label=f"largest: {peak.value:.3g} {units}".rstrip(), clip_on=False, zorder=4,
    )  # fmt: skip


def _split(dataset: xr.Dataset, values: xr.DataArray) -> list[tuple[xr.DataArray, xr.DataArray]]:
    """Cable lengths in mm and values until most rope was wound, and from then on."""
    wound = dataset["wound_length"].isel(plane=0).dropna("time")
    lengths, turn = 1e3 * dataset["cable_length"].isel(plane=0), wound.idxmax("time").item()
    passages = (wound.time.sel(time=part) for part in (slice(None, turn), slice(turn, None)))
    return [(lengths.sel(time=times), values.sel(time=times)) for times in passages]


def _length_axis(axes: Axes, dataset: xr.Dataset) -> None:
    axes.set_xlim(0.0, 1100.0 * float(dataset["cable_length"].max()))
    axes.set_xlabel(style.label(dataset["cable_length"], "mm"))
