"""Courses of some samples of every ending: bands that tell what those have in common that stall."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ringsim.analysis.campaign_samples import endings, told
from ringsim.analysis.quantities import good
from ringsim.analysis.reading import blocks
from ringsim.outputs.family import Array
from ringsim.plots import style
from ringsim.plots.campaign.frame import FAILED, LOOKS

MOST = 200
"""Samples of an ending that are read at most, evenly spread over all."""


def chosen(campaign: xr.Dataset, names: Sequence[str]) -> tuple[xr.Dataset, NDArray[np.str_]]:
    """Some variables of up to ``MOST`` samples of each ending that hold, and their endings."""
    words, ok = endings(campaign), good(campaign)
    taken = np.zeros(len(words), dtype=bool)
    for word in set(words[ok].tolist()):
        own = np.flatnonzero(ok & (words == word))
        taken[own[:: -(-len(own) // MOST)]] = True
    parts, start = [], 0
    for block in blocks(campaign, names):
        size = block.sizes["sample"]
        parts.append(block.isel(sample=np.flatnonzero(taken[start : start + size])))
        start += size
    return xr.concat(parts, "sample", data_vars="all"), words[taken]


def counted(campaign: xr.Dataset, words: NDArray[np.str_]) -> str:
    """How many samples hold, how many of them are drawn, and what bands and lines are."""
    count = int(good(campaign).sum())
    drawn = "" if len(words) == count else f" {len(words)} of them are drawn."
    return f"{told(campaign, count)}.{drawn} Bands: all of an ending, lines: their median."


def bands_by_ending(axes: Axes, x: Array, values: Array, words: NDArray[np.str_]) -> None:
    """Range and median of the curves (sample, x) of each ending, as long as any of them lasts."""
    others = sorted(set(words.tolist()) - LOOKS.keys())
    looks = LOOKS | dict(zip(others, FAILED, strict=False))
    for number, word in enumerate(filter(set(words.tolist()).__contains__, looks)):
        own = values[words == word]
        own = own[:, known := np.isfinite(own).any(axis=0)]
        if not own.size:
            continue
        colour = looks[word][0]
        axes.fill_between(x[known], np.nanmin(own, axis=0), np.nanmax(own, axis=0), color=colour,
                          alpha=0.22, linewidth=0.0)  # fmt: skip
        dashes = ("solid", (0, (5, 2)), (0, (2, 1.5)), (0, (6, 1.5, 1, 1.5)))[number % 4]
        axes.plot(x[known], np.nanmedian(own, axis=0), color=colour, linestyle=dashes,
                  label=f"{word} ({len(own)})")  # fmt: skip


def legend(figure: Figure, panels: Sequence[Axes]) -> None:
    """One legend of all panels below the figure."""
    found = dict[str, Any]()
    for axes in panels:
        handles, labels = axes.get_legend_handles_labels()
        found |= dict(zip(labels, handles, strict=True))
    figure.legend(
        [*found.values()], [*found], loc="outside lower center", ncols=max(1, min(4, len(found)))
    )


def over_time(
    figure: Figure, panels: Sequence[Axes], campaign: xr.Dataset, curves: Sequence[Array],
    words: NDArray[np.str_],
) -> None:  # fmt: skip
    """A panel a set of curves (sample, time), up to the last time at which any is known."""
    time = campaign["time"].to_numpy()
    last = 0
    for axes, values in zip(panels, curves, strict=True):
        bands_by_ending(axes, time, values, words)
        if (known := np.flatnonzero(np.isfinite(values).any(axis=0))).size:
            last = max(last, int(known[-1]))
    panels[0].set_xlim(time[0], time[max(last, 1)])
    panels[-1].set_xlabel(style.label(campaign["time"]))
    legend(figure, panels)
