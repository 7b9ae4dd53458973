"""Spans and tensions of a cable over time."""

import math

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style
from ringsim.plots.peaks import mark, peak_of
from ringsim.plots.section_spans import section_spans


def section_series(dataset: xr.Dataset, plane: str) -> xr.Dataset:
    """A cable's quantities by section over time from a recorded run of a ring.

    Tensions and the rope's strain are recorded; span lengths are recomputed from the opening angles
    on the ideal geometry of one section (see ``ringsim.plots.section_spans``).

    ``dataset`` has ``cable_tension``, ``rope_strain`` and ``opening_angle``; ``plane`` is one with
    a cable, whose rope no fault has split.

    Returns
    -------
    xr.Dataset
        Over (section, time), sections in the order from the winch: ``neutral_length`` (m, rope
        without tension: a slack rope has more of it than length), ``elongation`` (mm) and
        ``tension`` (N) of the span between the section's first hinge pulley and its V pulley;
        ``decay``, the tension behind the section over that before it, NaN while the rope is slack.
    """
    at = section_spans(dataset, plane)
    taut = at.arriving > at.cable.slack_width
    strain = at.entry / at.cable.axial_stiffness
    loose = np.minimum(dataset["rope_strain"].sel(plane=plane).values, 0.0)
    neutral = at.lengths[0] / (1.0 + np.where(loose < 0.0, loose, strain))
    decay = np.where(taut, at.after / np.where(taut, at.arriving, 1.0), np.nan)
    found = xr.Dataset(coords={"time": dataset["time"]})
    for name, values, words, units in (
        ("neutral_length", neutral, "neutral length of a span", "m"),
        ("elongation", 1e3 * strain * neutral, "span elongation", "mm"),
        ("decay", decay, "decay factor of a section", "1"),
        ("tension", at.entry, "tension at section start", "N"),
    ):
        found[name] = (("section", "time"), values, {"long_name": words, "units": units})
    return found


@style.styled
def cables(dataset: xr.Dataset) -> Figure:
    """Neutral lengths, elongations, decays and tensions, section by section.

    One column for each plane with a cable; colour counts the sections from the winch.  Bands hold
    the tensions of all spans, and the span with ``peak_tension`` is drawn beside the sections'.
    """
    tension = dataset["cable_tension"]
    planes = tension.dropna("plane", how="all")["plane"].values.tolist()
    series = {plane: section_series(dataset, plane) for plane in planes}
    names = list(series[planes[0]])
    sections = dataset.sizes["section"]
    colours = style.section_colours(sections)
    until = style.deployment_time(dataset)
    until = until if math.isfinite(until) else math.inf
    peak = peak_of(dataset, "cable_tension", "peak_tension", "peak_tension", until)
    figure = Figure(figsize=(5.4 * len(planes) + 0.4, 2.1 * len(names) + 0.8))
    grid = figure.subplots(len(names), len(planes), sharex=True, sharey="row", squeeze=False)
    for number, (column, plane) in enumerate(zip(grid.T, planes, strict=True)):
        style.time_axes(dataset, dataset["opening_angle"], *column, named=number == 0)
        for axes, name in zip(column, names, strict=True):
            for section, row in enumerate(series[plane][name].values):
                axes.plot(
                    dataset["time"], row, color=colours(section), linewidth=1.2,
                    label=f"section {section + 1}",
                )  # fmt: skip
        style.name_panel(column[0], f"{plane} cable", height=0.2)
    for row, name in zip(grid, names, strict=True):
        drawn = np.concatenate([series[plane][name].values for plane in planes])
        if name == "tension":
            drawn = np.append(tension.values, peak.value)
        row[0].set_ylabel(style.label(series[planes[0]][name], width=26))
        if name not in ("neutral_length", "decay"):
            style.span_sizes(row[0], np.where(drawn > 1e-6, drawn, np.nan))
    for axes, plane in zip(grid[names.index("tension")], planes, strict=True):
        spans = tension.sel(plane=plane)
        least, most = spans.min("span"), spans.max("span")
        axes.fill_between(dataset["time"], least, most, color=style.PALE, linewidth=0.0)
        if plane == peak.place["plane"]:
            worst = peak.within(spans.sel(span=peak.place["span"]))
            axes.plot(*worst, color=style.VERMILLION, linewidth=1.0, zorder=3)
            later = " until all have locked" if float(tension.max()) > peak.value else ""
            name = spans.sel(span=peak.place["span"]).coords.get("span_name")
            place = f"span {peak.place['span']}" + (f", {name.item()}" if name is not None else "")
            mark(axes, peak, str(tension.attrs["units"]), place + later)
    style.name_sections(figure, grid[0, 0], sections)
    style.head(figure, grid[0, 0], dataset, "Cables")
    return figure
