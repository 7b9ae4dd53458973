"""Style shared by all figures."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
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

_Arguments = ParamSpec("_Arguments")


def styled(draw: Callable[_Arguments, Figure]) -> Callable[_Arguments, Figure]:
    """Draw with the shared style, and leave matplotlib's global settings as they were."""

    @functools.wraps(draw)
    def drawn(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> Figure:
        with mpl.rc_context(_SETTINGS):
            return draw(*args, **kwargs)

    return drawn


def new_figure(width: float, height: float) -> Figure:
    """An empty figure (size in inch) with constrained layout; needs no display."""
    layout = ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.08)
    figure = Figure(figsize=(width, height), layout=layout, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def section_colours(sections: int) -> Colormap:
    """One colour a section, perceptually uniform, without the light yellow end."""
    viridis = mpl.colormaps["viridis"]
    steps = max(sections - 1, 1)
    return ListedColormap([viridis(0.88 * k / steps) for k in range(sections)])


def span_time(axes: Axes, values: xr.DataArray) -> None:
    """From the first to the last time (s) at which something was recorded, without margins."""
    time = values.dropna("time", how="all")["time"].values
    if len(time) > 1:
        axes.set_xlim(float(time[0]), float(time[-1]))


def span_sizes(axes: Axes, sizes: np.ndarray) -> None:
    """Value axis from zero; logarithmic where most of the run would be a flat line.

    Peaks at locking are hundreds of times larger than values before, so a linear axis
    would show nothing else.

    Parameters
    ----------
    axes
        Where the values were drawn.
    sizes
        What was drawn, any shape, not negative, NaN where nothing was recorded.
    """
    known = sizes[np.isfinite(sizes) & (sizes > 0.0)]
    largest = float(known.max()) if known.size else 1.0
    typical = float(np.median(known)) if known.size else 1.0
    if typical > _FLAT * largest:
        axes.set_ylim(0.0, 1.2 * largest)
        return
    lowest = max(float(np.quantile(known, 0.02)), 1e-5 * largest)
    axes.set_yscale("log", nonpositive="clip")
    axes.set_ylim(10.0 ** np.floor(np.log10(lowest)), 4.0 * largest)
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def name_panel(axes: Axes, text: str, height: float = 0.95) -> None:
    """A bold name in the upper left corner of the frame."""
    axes.text(
        0.02, height, text, transform=axes.transAxes, va="top", weight="bold", zorder=5,
        bbox=PAPER,
    )  # fmt: skip


def mark_moment(axes: Axes, moment: float, text: str = "") -> None:
    """A dashed vertical line at a time (s), with a label above the frame."""
    axes.axvline(moment, color=INK, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1.5)
    if text:
        first, last = axes.get_xlim()
        side = "right" if moment > 0.5 * (first + last) else "left"
        axes.annotate(
            text, (moment, 1.0), xycoords=axes.get_xaxis_transform(), xytext=(0, 3),
            textcoords="offset points", ha=side, va="bottom", fontsize=9.5,
        )  # fmt: skip


def write(figure: Figure, path: Path) -> None:
    """Write a PNG."""
    with mpl.rc_context(_SETTINGS):
        figure.savefig(path, dpi=DPI, format="png")
