"""What becomes of a sample, by each of its drawn inputs."""

import itertools
import textwrap
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ringsim.analysis.campaign_samples import called, endings, inputs, judged_by
from ringsim.analysis.quantities import good, numbers, ran
from ringsim.plots import style
from ringsim.plots.campaign.frame import FAILED, LOOKS, head
from ringsim.plots.campaign.names import WIDE, in_lines

_MANY = 500
"""Samples from which on marks are drawn as dots: as shapes they would make a page too large."""


def drawn(variable: xr.DataArray) -> tuple[NDArray[np.floating], list[str]]:
    """An input as one number a sample: the mean of its places, or the place of its word in the
    list that comes second, which is empty for numbers.
    """
    values = variable.to_numpy()
    if values.dtype.kind not in "OU":
        numbers = values.astype(float)
        return (numbers if numbers.ndim == 1 else numbers.mean(axis=1)), []
    rows = values.reshape(len(values), -1).astype(str)
    texts = np.array([", ".join(dict.fromkeys(row.tolist())) for row in rows])
    words, places = np.unique(texts, return_inverse=True)
    return places.astype(float), words.tolist()


@style.styled
def by_input(campaign: xr.Dataset) -> Figure:
    """A panel an input: the main number of each sample that has run over the value drawn for it.

    Colour and marker say how the sample ended; samples without the number stand below the line at
    the foot of each panel.
    """
    every = campaign.sizes["sample"]
    campaign = campaign.isel(sample=np.flatnonzero(ran(campaign)))
    names, name = inputs(campaign), judged_by(campaign)
    words = endings(campaign)
    height = np.where(good(campaign), numbers(campaign, name), np.nan)
    known = height[np.isfinite(height)]
    low, high = (known.min(), known.max()) if known.size else (0.0, 1.0)
    size = high - low or max(abs(high), 1.0)
    foot = low - 0.16 * size
    height = np.where(np.isfinite(height), height, foot)
    figure, panels, columns = style.new_panels(len(names), 3.5, 2.8, 1.4)
    for number, (axes, each) in enumerate(zip(panels, names, strict=True)):
        places, labels = drawn(campaign[each])
        _scatter(axes, places, height, words)
        if not known.size or (height == foot).any():
            axes.axhline(low - 0.08 * size, color=style.GREY, linewidth=0.8)
        if labels:
            axes.set_xticks(range(len(labels)), [textwrap.shorten(w, 18) for w in labels])
            axes.set_xlim(-0.5, len(labels) - 0.5)
        else:
            axes.ticklabel_format(axis="x", style="sci", scilimits=(-3, 4))
            axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_ylim(low - 0.24 * size, high + 0.1 * size)
        axes.set_xlabel(_label(campaign[each]), fontsize=9, labelpad=15)
        if number % columns == 0 and name:
            axes.set_ylabel(style.label(campaign[name], width=30), fontsize=9)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(labels)))
    lost = int((height == foot).sum())
    below = f"; {lost} without the number stand below the line" if lost else ""
    note = (
        " Inputs of many places by their mean." if any(campaign[n].ndim > 1 for n in names) else ""
    )
    count = f"{len(words)} of {every} samples run" if len(words) < every else f"All {every} samples"
    head(figure, campaign, "Outcome by input", f"{count}{below}.{note}")
    return figure


def _scatter(axes: Axes, x: Any, y: Any, words: NDArray[np.str_]) -> None:
    others = sorted(set(words.tolist()) - LOOKS.keys())
    looks = LOOKS | dict(zip(others, itertools.cycle(FAILED), strict=False))
    for word in filter(set(words.tolist()).__contains__, looks):
        own = words == word
        colour, marker = looks[word]
        axes.scatter(x[own], y[own], s=26, color=colour, marker=marker, alpha=0.8,
                     linewidths=1.2 if marker in "x+1234|" else 0.0,
                     label=f"{word} ({own.sum()})", zorder=3,
                     rasterized=len(words) > _MANY)  # fmt: skip


def _label(variable: xr.DataArray) -> str:
    units = str(variable.attrs.get("units", "1"))
    words = called(variable)
    what = ", mean" if variable.ndim > 1 else ""
    what += "" if units == "1" else f" ({units})"
    words = in_lines(words)
    if len(words.rpartition("\n")[2]) + len(what) > WIDE:
        what = "\n" + what.lstrip(", ")
    return words + what
