"""Which section is ahead and which behind, over time."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from ringsim.plots import style
from ringsim.plots.asynchrony import apart
from ringsim.plots.opening_angles import LEAST_SPAN, deviations
from ringsim.plots.peaks import peak_of

_TRIANGLE: dict[str, Any] = {
    "color": style.VERMILLION, "markersize": 9, "markeredgecolor": "white", "clip_on": False,
}  # fmt: skip
_DOT: dict[str, Any] = {"color": style.INK, "markersize": 4, "clip_on": False}


@style.styled
def section_map(dataset: xr.Dataset) -> Figure:
    """Deviation of each ``opening_angle`` (plane, section, time) from the mean of all, as a colour.

    One axes a plane, one colour scale; dots are where V-joints lock, triangles the two that are
    farthest apart when ``asynchrony`` is largest, which may be between two records.
    """
    found = deviations(dataset).transpose("plane", "section", "time")
    times, sections = found["time"].values, found["section"].values
    planes = found["plane"].values.tolist()
    span = max(style.largest_magnitude(found), LEAST_SPAN)
    peak = peak_of(dataset, "asynchrony", "asynchrony_max", "asynchrony_max", times[-1])
    leader, laggard = apart(dataset, peak.time)
    locked = "lock_time" in dataset and bool(np.isfinite(dataset["lock_time"]).any())
    figure = Figure(figsize=(8.8, 2.7 * len(planes) + 0.9))
    grid = figure.subplots(len(planes), 1, sharex=True, squeeze=False)[:, 0]
    middles = 0.5 * (times[1:] + times[:-1])
    edges = np.concatenate([times[:1], middles, times[-1:]])
    for axes, plane in zip(grid, planes, strict=True):
        image = axes.pcolormesh(
            edges, np.append(sections, sections[-1] + 1) - 0.5, found.sel(plane=plane).values,
            cmap="PuOr_r", vmin=-span, vmax=span, rasterized=True,
        )  # fmt: skip
        marks = [(leader, "^"), (laggard, "v")]
        for section, marker in ((one[1], marker) for one, marker in marks if one[0] == plane):
            axes.plot(peak.time, section, marker, **_TRIANGLE)
        locks = dataset["lock_time"].sel(plane=plane).dropna("section") if locked else found[:0]
        if locks.size:  # a line without points would stand in the corner of the sheet
            axes.plot(locks, locks["section"], "o", **_DOT)
        axes.grid(visible=False)
        axes.yaxis.set_major_locator(MaxNLocator(10, integer=True, min_n_ticks=1))
        axes.set_ylim(sections[0] - 0.5, sections[-1] + 0.5)
        axes.set_ylabel(f"{plane} plane")
    style.time_axes(dataset, dataset["opening_angle"], *grid)
    label = style.label(found, width=34)
    figure.colorbar(image, ax=grid, pad=0.015, label=label).outline.set_visible(False)
    figure.supylabel(style.label(dataset["section"]), fontsize=10.5)
    size = f"{peak.value:.3g} {found.attrs.get('units', '')}"
    words = {"^": f"leader at the largest asynchrony, {size}", "v": "laggard"}
    looks = [{"marker": marker, "label": word} | _TRIANGLE for marker, word in words.items()]
    looks += [{"marker": "o", "label": "locks"} | _DOT] if locked else []
    entries = [Line2D([], [], linestyle="none", **look) for look in looks]
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
    style.head(figure, grid[0], dataset, "Ahead and behind")
    return figure
