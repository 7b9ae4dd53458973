"""How far each section is ahead or behind, over all samples."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from ringsim.analysis.campaign_samples import median_and_worst, told
from ringsim.analysis.courses import Courses, course, courses
from ringsim.plots import style
from ringsim.plots.campaign.frame import head
from ringsim.plots.opening_angles import LEAST_SPAN

_LOOKS = ((style.BLUE, "solid", 1.9), (style.ORANGE, (0, (3, 1.5)), 1.2))
"""Colour, dashes and width of each plane's median: alike ones are both seen, one on the other."""
_WIDEST = 6


@style.styled
def fan(campaign: xr.Dataset, read: Courses | None = None) -> Figure:
    """A panel a section: median, 5-95 % and 0-100 % of its deviation, in each plane; a row of
    panels has one scale.

    ``campaign`` has ``opening_angle`` (sample, plane, section, time).  The sample with the largest
    asynchrony is drawn on its own.  ``read`` is what ``courses`` gives, if it is there already.
    """
    read = courses(campaign) if read is None else read
    found = read.bands
    planes, sections = found["plane"].values.tolist(), found["section"].values.tolist()
    looks = dict(zip(planes, _LOOKS, strict=False))
    chosen = median_and_worst(campaign)
    worst = chosen[1] if chosen is not None and chosen[1] in read.samples else None
    one = None if worst is None else course(campaign, worst, found)
    columns = min(_WIDEST, len(sections))
    rows = -(-len(sections) // columns)
    figure = Figure(figsize=(max(1.75 * columns, 7.0), max(1.75 * rows, 2.4) + 1.7))
    grid = figure.subplots(rows, columns, sharex=True, sharey="row", squeeze=False)
    for number, axes in enumerate(grid.ravel()):
        if number >= len(sections):
            axes.set_visible(False)
            continue
        for plane in planes:
            own = found.sel(plane=plane, section=sections[number])
            low, lower, middle, upper, high = own.values
            colour, dashes, width = looks[plane]
            for ends, alpha, edge in (((low, high), 0.08, 0.5), ((lower, upper), 0.2, 0.0)):
                axes.fill_between(own["time"], *ends, facecolor=(colour, alpha), linewidth=edge,
                                  edgecolor=colour)  # fmt: skip
            axes.plot(own["time"], middle, color=colour, linewidth=width, linestyle=dashes,
                      label="median", zorder=4)  # fmt: skip
            if one is not None:
                single = one.sel(plane=plane, section=sections[number])
                axes.plot(single["time"], single, color=style.INK, linewidth=0.8, linestyle=dashes,
                          zorder=3)  # fmt: skip
        axes.set_title(f"section {sections[number]}", fontsize=9, pad=3)
        if number + columns >= len(sections):
            axes.tick_params(labelbottom=True)
            axes.set_xlabel(style.label(found["time"], width=24), fontsize=8)
    drawn = [each for each in (found, one) if each is not None]
    for row, axes_of in enumerate(grid):
        axes_of[0].set_ylim(*_limits(drawn, slice(row * columns, (row + 1) * columns)))
    grid[0, 0].set_xlim(0.0, float(found["time"][-1]) or 1.0)
    grid[0, 0].xaxis.set_major_locator(MaxNLocator(3))
    figure.supylabel(style.label(found, width=26), fontsize=10)
    words = [
        Line2D([], [], color=colour, linestyle=dashes, linewidth=width, label=f"{plane} plane")
        for plane, (colour, dashes, width) in looks.items()
    ]
    shades = (("5-95 %", 0.28, 0.0), ("0-100 %", 0.08, 0.5))
    bands = [
        Patch(facecolor=(style.GREY, alpha), edgecolor=style.GREY, linewidth=edge, label=word)
        for word, alpha, edge in shades
    ]
    lines = [Line2D([], [], color=style.GREY, linewidth=1.8, label="median")]
    if one is not None:
        lines += [Line2D([], [], color=style.INK, linewidth=0.9, label=f"worst: sample {worst}")]
    figure.legend(handles=[*words, *bands, *lines], loc="outside lower center", ncols=3)
    note = "Runs that are over count on: deployed without deviation, others as they ended."
    head(figure, campaign, "Ahead and behind", f"{told(campaign, len(read.samples))}. {note}")
    return figure


def _limits(drawn: list[xr.DataArray], sections: slice) -> tuple[float, float]:
    """What the curves of these sections need, and some air."""
    ends = [np.nan_to_num(each.isel(section=sections).values) for each in drawn]
    low, high = min(float(each.min()) for each in ends), max(float(each.max()) for each in ends)
    air = max(0.06 * (high - low), LEAST_SPAN)
    return low - air, high + air
