"""Stress in the rods over time."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ringsim.plots import style
from ringsim.plots.peaks import mark, peak_of

_COLOURS = (style.INK, "#d00000", style.BLUE, style.GREEN, style.ORANGE, style.PURPLE)
_HALVES: dict[str, Any] = {"left": "-", "right": (0, (4, 1.6))}


@style.styled
def rod_stress(dataset: xr.Dataset, sections: Sequence[int] | None = None) -> Figure:
    """``rod_stress`` (rod, section, time), one axes a rod; its halves as in paper 002, figs 11-13.

    Bands reach from the least to the largest of all sections, full lines are left halves, dashed
    ones right halves.  The half with ``peak_rod_stress`` is drawn whatever its section.
    ``sections`` are at most six section numbers, by default :func:`default_sections`.

    Raises
    ------
    ValueError
        If the run has no such section, or for more than six.
    """
    chosen = default_sections(dataset.sizes["section"]) if sections is None else tuple(sections)
    missing = set(chosen) - set(dataset["section"].values.tolist())
    if missing or not 0 < len(chosen) <= len(_COLOURS):
        raise ValueError(
            f"sections = {list(chosen)} must be one to {len(_COLOURS)} of the sections "
            f"1..{dataset.sizes['section']}"
        )
    stress = dataset["rod_stress"]
    factor, units = style.readable_units(stress, dataset.get("peak_rod_stress", stress))
    peak = peak_of(dataset, "rod_stress", "peak_rod_stress", "peak_stress", np.inf)
    rods = list(dict.fromkeys(rod.rpartition("_")[0] for rod in stress["rod"].values.tolist()))
    figure = Figure(figsize=(11.0, 2.7 * -(-len(rods) // 2) + 1.1))
    grid = figure.subplots(-(-len(rods) // 2), 2, sharex=True, sharey=True)
    coloured = list(zip(chosen, _COLOURS, strict=False))
    style.time_axes(dataset, stress.max("section"), *grid[:, 0])
    style.time_axes(dataset, stress.max("section"), *grid[:, 1], named=False)
    style.span_sizes(grid[0, 0], factor * np.append(stress.values, peak.value))
    for axes, rod in zip(grid.flat, rods, strict=False):
        halves = factor * stress.sel(rod=stress["rod"].str.startswith(f"{rod}_"))
        least, most = (reduced(("rod", "section")) for reduced in (halves.min, halves.max))
        axes.fill_between(halves["time"], least, most, color=style.PALE, linewidth=0.0)
        for section, colour in coloured:
            for half, dashes in _HALVES.items():
                values = halves.sel(rod=f"{rod}_{half}", section=section)
                axes.plot(values["time"], values, color=colour, linestyle=dashes, linewidth=1.2)
        name = " ".join(reversed(rod.split("_")))
        style.name_panel(axes, name)
        if peak.place["rod"].startswith(f"{rod}_"):
            worst = peak.within(stress.sel(peak.place), factor)
            axes.plot(*worst, color=style.VERMILLION, linewidth=1.0, zorder=3)
            half = peak.place["rod"].rpartition("_")[-1]
            place = f"section {peak.place['section']}, {name}, {half} half"
            mark(axes, peak, units, place, factor)
    figure.supylabel(style.label(stress, units), fontsize=10.5)
    entries = [Line2D([], [], color=colour, label=f"section {n}") for n, colour in coloured]
    entries += [
        Line2D([], [], color=style.GREY, linestyle=dashes, linewidth=1.2, label=f"{half} half")
        for half, dashes in _HALVES.items()
    ]
    entries += [
        Line2D([], [], color=style.PALE, linewidth=7.0, label="all sections"),
        Line2D([], [], color=style.VERMILLION, linewidth=1.0, label="half with the largest"),
    ]
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
    style.head(figure, grid[0, 0], dataset, "Rod stress")
    return figure


def default_sections(sections: int) -> tuple[int, ...]:
    """The section at the boom, in black, and the one opposite, in red: 1 and 9 of 18."""
    return tuple(dict.fromkeys((1, max(sections // 2, min(2, sections)))))
