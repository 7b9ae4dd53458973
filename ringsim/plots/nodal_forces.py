"""Forces of the cables on the pulleys of every section over time."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style
from ringsim.plots.section_spans import NODES, pulley_forces

_DRAWN = ("along", "inwards")


@style.styled
def nodal_forces(dataset: xr.Dataset) -> Figure:
    """Components of the force on the pulleys of every section (paper 000, figs 9 and 10).

    One column for each plane with a cable; colour counts the sections from the winch.
    """
    tension = dataset["cable_tension"]
    planes = tension.dropna("plane", how="all")["plane"].values.tolist()
    forces = {plane: pulley_forces(dataset, plane) for plane in planes}
    rows = [(node, component) for node in NODES for component in _DRAWN]
    sections = dataset.sizes["section"]
    colours = style.section_colours(sections)
    figure = Figure(figsize=(5.4 * len(planes) + 0.4, 1.9 * len(rows) + 0.8))
    grid = figure.subplots(len(rows), len(planes), sharex=True, sharey="row", squeeze=False)
    for number, (column, plane) in enumerate(zip(grid.T, planes, strict=True)):
        style.time_axes(dataset, dataset["opening_angle"], *column, named=number == 0)
        for axes, (node, component) in zip(column, rows, strict=True):
            for section, row in enumerate(forces[plane].sel(node=node, component=component).values):
                axes.plot(
                    dataset["time"], row, color=colours(section), linewidth=1.2,
                    label=f"section {section + 1}",
                )  # fmt: skip
            axes.axhline(0.0, color=style.GREY, linewidth=0.8, zorder=1.4)
        style.name_panel(column[0], f"{plane} cable", height=0.2)
    for row, (node, component) in zip(grid, rows, strict=True):
        drawn = np.stack(
            [one.sel(node=node, component=component).values for one in forces.values()]
        )
        row[0].set_ylabel(f"{node[:1].upper()}{node[1:]},\n{component} (N)")
        style.signed_sizes(row[0], drawn)
    style.name_sections(figure, grid[0, 0], sections)
    style.head(figure, grid[0, 0], dataset, "Forces on the pulleys")
    return figure
