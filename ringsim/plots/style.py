"""Style shared by all figures."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, NullFormatter

INK, GREY, PALE = "#222222", "#6e6e6e", "#e4e4e4"
BLUE, SKY, GREEN, ORANGE, VERMILLION, PURPLE = (
    "#0072b2", "#56b4e9", "#009e73", "#e69f00", "#d55e00", "#cc79a7",
)  # fmt: skip
"""Colour-blind safe palette (Okabe and Ito 2008)."""

PAPER: Any = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5}
"""Background of text on a grid."""

DPI = 150
_FLAT = 0.05
"""Median over largest value below which the axis becomes logarithmic."""
_SETTINGS: Any = {
    "axes.axisbelow": True,
    "axes.edgecolor": GREY,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 10.5,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 10,
    "axes.titlecolor": GREY,
    "figure.titlesize": 11,
    "figure.titleweight": "bold",
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "grid.color": PALE,
    "grid.linewidth": 0.7,
    "legend.fontsize": 9.5,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "lines.solid_joinstyle": "round",
    "text.color": INK,
    "xtick.color": GREY,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 9.5,
    "ytick.color": GREY,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 9.5,
}

styled = mpl.rc_context(_SETTINGS)
"""Decorator: draw with the shared style, and leave matplotlib's global settings as they were."""


def new_figure(width: float, height: float) -> Figure:
    """An empty figure (size in inch) with constrained layout; needs no display."""
    layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08)
    return Figure(figsize=(width, height), layout=layout, facecolor="white")


def new_panels(
    count: int, width: float, height: float, legend: float, *, sharex: bool = False
) -> tuple[Figure, list[Axes], int]:
    """A figure of ``count`` panels in rows of three, and its number of columns; sizes in inch."""
    columns = min(3, count)
    rows = -(-count // columns)
    figure = new_figure(width * columns, height * rows + legend)
    panels = figure.subplots(rows, columns, sharex=sharex, squeeze=False).ravel().tolist()
    for panel in panels[count:]:
        panel.set_visible(False)
    return figure, panels[:count], columns


def title(figure: Figure, text: str) -> None:
    """A bold title in the upper left corner of the sheet."""
    figure.suptitle(text, x=0.012, ha="left")


def section_colours(sections: int) -> Colormap:
    """One colour a section, perceptually uniform, without the light yellow end."""
    return ListedColormap(mpl.colormaps["viridis"](np.linspace(0.0, 0.88, sections)))


def span_time(axes: Axes, values: xr.DataArray) -> None:
    """From the first to the last time (s) at which something was recorded, without margins."""
    time = values.dropna("time", how="all")["time"].values
    if len(time) > 1:
        axes.set_xlim(float(time[0]), float(time[-1]))


def span_sizes(axes: Axes, sizes: np.ndarray) -> None:
    """Value axis from zero; logarithmic where most of the run would be a flat line.

    Peaks at locking are hundreds of times larger than values before, so a linear axis would show
    nothing else.  ``sizes`` is what was drawn, of any shape, NaN where nothing was recorded.
    """
    known = sizes[np.isfinite(sizes) & (sizes > 0.0)]
    largest = float(known.max()) if known.size else 1.0
    if not known.size or np.median(known) > _FLAT * largest:
        axes.set_ylim(0.0, 1.2 * largest)
        return
    lowest = max(float(np.quantile(known, 0.02)), 1e-5 * largest)
    axes.set_yscale("log", nonpositive="clip")
    axes.set_ylim(10.0 ** np.floor(np.log10(lowest)), 4.0 * largest)
    plain_numbers(axes.yaxis)


def plain_numbers(axis: Axis) -> None:
    """Ticks of a logarithmic axis as 0.01 instead of a power of ten, and only the major ones."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def name_panel(axes: Axes, text: str, height: float = 0.95) -> None:
    """A bold name in the upper left corner of the frame."""
    axes.text(
        0.02, height, text, transform=axes.transAxes, va="top", weight="bold", zorder=5,
        bbox=PAPER,
    )  # fmt: skip


def deployment_time(dataset: xr.Dataset) -> float:
    """Time at which the last V-joint locked (s), NaN if it did not."""
    return float(dataset.get("deployment_time", math.nan))


def mark_deployment(dataset: xr.Dataset, *panels: Axes, named: bool = True) -> None:
    """A dashed line where the last V-joint locked, if it did; its time above the first panel."""
    moment = deployment_time(dataset)
    if math.isnan(moment):
        return
    for axes in panels:
        axes.axvline(moment, color=INK, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1.5)
    if named:
        side = "right" if moment > 0.5 * sum(panels[0].get_xlim()) else "left"
        panels[0].annotate(
            f"all locked at {moment:.2f} s", (moment, 1.0),
            xycoords=panels[0].get_xaxis_transform(), xytext=(0, 3),
            textcoords="offset points", ha=side, va="bottom", fontsize=9.5,
        )  # fmt: skip


@styled
def write(figure: Figure, path: Path) -> None:
    """Write a PNG."""
    figure.savefig(path, dpi=DPI, format="png")
