"""How much of the tension every pulley passes on, over time."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style
from ringsim.plots.section_spans import NODES

_SECTIONS = 4
_LINES = ((style.BLUE, "-"), (style.ORANGE, "-"), (style.GREEN, (0, (5, 3))))
"""Both hinge pulleys of a section between others are alike."""


@style.styled
def pulleys(dataset: xr.Dataset) -> Figure:
    """``pulley_ratio`` (plane, pulley, time), three curves a section (paper 000, figs 6 and 7).

    One column for each plane with a cable; rows are sections in the order from the winch, of many
    the first, the last and two between.
    """
    ratio = dataset["pulley_ratio"].dropna("plane", how="all")
    planes, sections = ratio["plane"].values.tolist(), dataset.sizes["section"]
    shown = style.some_sections(sections, _SECTIONS)
    figure = Figure(figsize=(5.4 * len(planes) + 0.4, 2.3 * len(shown) + 1.0))
    grid = figure.subplots(len(shown), len(planes), sharex=True, sharey=True, squeeze=False)
    for number, (column, plane) in enumerate(zip(grid.T, planes, strict=True)):
        style.time_axes(dataset, dataset["opening_angle"], *column, named=number == 0)
        own = ratio.sel(plane=plane).transpose("pulley", "time").values
        for axes, section in zip(column, shown, strict=True):
            for node, (colour, dash), row in zip(NODES, _LINES, own[3 * section :], strict=False):
                line = {"color": colour, "linestyle": dash, "label": f"{node} pulley"}
                axes.plot(dataset["time"], row, linewidth=1.5, **line)
            style.name_panel(axes, f"{plane} cable, section {section + 1} from the winch")
    known = own[np.isfinite(own)]
    for axes in grid[:, 0]:
        axes.set_ylabel("Tension behind\nover before")
    low = float(known.min()) if known.size else 0.0
    grid[0, 0].set_ylim(low - 0.1 * (1.0 - low), 1.0 + 0.1 * (1.0 - low))
    lines = grid[0, 0].get_legend_handles_labels()[0]
    figure.legend(handles=lines, loc="outside lower center", ncols=len(lines))
    style.head(figure, grid[0, 0], dataset, "Pulleys")
    return figure
