"""How far each section is ahead or behind, over all samples."""

from typing import Any

import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ringsim.analysis.campaign_samples import median_and_worst, told
from ringsim.analysis.courses import Courses, course, courses
from ringsim.plots import style
from ringsim.plots.campaign.frame import head
from ringsim.plots.opening_angles import LEAST_SPAN

_COLOURS = (style.BLUE, style.ORANGE)
_WIDEST = 6


@style.styled
def fan(campaign: xr.Dataset, read: Courses | None = None) -> Figure:
    """A panel a section: median, 5-95 % and 0-100 % of its deviation, in each plane.

    ``campaign`` has ``opening_angle`` (sample, plane, section, time).  The sample with the largest
    asynchrony is drawn on its own.  ``read`` is what ``courses`` gives, if it is there already.
    """
    read = courses(campaign) if read is None else read
    found = read.bands
    planes, sections = found["plane"].values.tolist(), found["section"].values.tolist()
    colours = dict(zip(planes, _COLOURS, strict=False))
    chosen = median_and_worst(campaign)
    worst = chosen[1] if chosen is not None and chosen[1] in read.samples else None
    one = None if worst is None else course(campaign, worst, found["share"].to_numpy())
    columns = min(_WIDEST, len(sections))
    rows = -(-len(sections) // columns)
    figure = Figure(figsize=(max(1.75 * columns, 7.0), max(1.55 * rows, 2.4) + 1.7))
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for number, axes in enumerate(grid):
        if number >= len(sections):
            axes.set_visible(False)
            continue
        for plane in planes:
            own = found.sel(plane=plane, section=sections[number])
            low, lower, middle, upper, high = own.values
            look: dict[str, Any] = {"color": colours[plane], "linewidth": 0.0}
            axes.fill_between(own["share"], low, high, alpha=0.18, **look)
            axes.fill_between(own["share"], lower, upper, alpha=0.35, **look)
            axes.plot(own["share"], middle, color=colours[plane], linewidth=1.3, label="median")
            if one is not None:
                dashes = "solid" if plane == planes[0] else (0, (3, 1.5))
                single = one.sel(plane=plane, section=sections[number])
                axes.plot(single["share"], single, color=style.INK, linewidth=0.8, linestyle=dashes)
        axes.set_title(f"section {sections[number]}", fontsize=9, pad=3)
        if number + columns >= len(sections):
            axes.tick_params(labelbottom=True)
            axes.set_xlabel(style.label(found["share"], width=24), fontsize=8)
    largest = [style.largest_magnitude(each) for each in (found, one) if each is not None]
    span = max(1.05 * max(largest), LEAST_SPAN)
    grid[0].set(xlim=(0.0, 1.0), ylim=(-span, span), xticks=(0.0, 0.5, 1.0))
    figure.supylabel(style.label(found, width=26), fontsize=10)
    words = [Patch(color=c, label=f"{plane} plane") for plane, c in colours.items()]
    shades = (("5-95 %", 0.5), ("0-100 %", 0.2))
    words += [Patch(color=style.GREY, alpha=alpha, label=word) for word, alpha in shades]
    lines = [Line2D([], [], color=style.GREY, label="median")]
    if one is not None:
        lines += [Line2D([], [], color=style.INK, linewidth=0.9, label=f"worst: sample {worst}")]
    figure.legend(handles=words + lines, loc="outside lower center", ncols=3)
    head(figure, campaign, "Ahead and behind", f"{told(campaign, len(read.samples))}.")
    return figure
