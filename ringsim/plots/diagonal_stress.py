"""Stress in the diagonals of chosen sections over time."""

from collections.abc import Sequence
from typing import Any

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ringsim.plots import style

_COLOURS = (style.INK, "#d00000", style.BLUE, style.GREEN, style.ORANGE, style.PURPLE)
_HALVES: dict[str, Any] = {"left": "-", "right": (0, (4, 1.6))}


@style.styled
def diagonal_stress(dataset: xr.Dataset, sections: Sequence[int] | None = None) -> Figure:
    """``rod_stress`` (rod, section, time) of both diagonals, as in figs 11-13 of paper 002.

    One axes a diagonal; full lines are the left halves, dashed ones the right halves.
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
    stress = dataset["rod_stress"].sel(section=list(chosen))
    stress = stress.sel(rod=stress["rod"].str.startswith("diagonal_"))
    factor, units = style.readable_units(stress)
    diagonals = list(dict.fromkeys(rod.split("_")[1] for rod in stress["rod"].values.tolist()))
    figure = Figure(figsize=(8.6, 2.9 * len(diagonals) + 0.9))
    grid = figure.subplots(len(diagonals), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    coloured = list(zip(chosen, _COLOURS, strict=False))
    for axes, diagonal in zip(grid, diagonals, strict=True):
        for section, colour in coloured:
            for half, dashes in _HALVES.items():
                values = factor * stress.sel(rod=f"diagonal_{diagonal}_{half}", section=section)
                axes.plot(values["time"], values, color=colour, linestyle=dashes, linewidth=1.2)
        style.name_panel(axes, f"{diagonal} diagonal")
    style.span_sizes(grid[0], factor * stress.values)
    style.time_axes(dataset, stress, *grid)
    figure.supylabel(style.label(stress, units), fontsize=10.5)
    entries = [Line2D([], [], color=colour, label=f"section {n}") for n, colour in coloured]
    entries += [
        Line2D([], [], color=style.GREY, linestyle=dashes, linewidth=1.2, label=f"{half} half")
        for half, dashes in _HALVES.items()
    ]
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
    style.head(figure, grid[0], dataset, "Diagonal stress")
    return figure


def default_sections(sections: int) -> tuple[int, ...]:
    """The section at the boom, in black, and the one opposite, in red: 1 and 9 of 18."""
    return tuple(dict.fromkeys((1, max(sections // 2, min(2, sections)))))
