"""Courses of all samples of a campaign: the fan, lags by section, the order of locks."""

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator, PercentFormatter

from ringsim.analysis.courses import Courses, course, courses
from ringsim.analysis.design import judged_by, median_and_worst, told
from ringsim.analysis.intervals import good
from ringsim.outputs.family import Array
from ringsim.plots import picture, style
from ringsim.plots.campaign.frame import (
    base_of,
    entries,
    head,
    legend,
    lines_told,
    looks_of_cases,
    middle_told,
    of_cases,
    shown_until,
)
from ringsim.plots.run import LEAST_SPAN
from ringsim.tables import number_text

_NEEDS = ("asynchrony", "opening_angle", "final_time", "deployment_time")
"""Asynchrony first: without a value of it there is nothing to draw."""
_LOOKS = style.BLUE, style.VERMILION
"""Colour of each plane, dark enough for print in grey; words beside its panels name it."""
_WORST: dict[str, Any] = {
    "color": style.INK, "linewidth": 1.0, "linestyle": (0, (6, 1.2, 1, 1.2)),
}  # fmt: skip
"""The worst sample: dashes like those of no plane, also in grey."""
_WIDEST = 6
_MOST_CASES = 60
"""Lines of a panel at most."""


@picture(
    "campaign", 50, "Deviation of each section from the mean opening angle, over all samples",
    _NEEDS, judged_by, courses,
)  # fmt: skip
def fan(campaign: xr.Dataset, read: Courses | None = None) -> Figure:
    """A panel a section and plane, one below the other: the deviations of the samples whose
    asynchrony is the median and the largest, and the range of all, or each sample where they are
    cases, with one scale.  Where most of the time little happens, they are enlarged on the rest
    (``_eventful``), and a row above them has the whole run.

    ``campaign`` has ``opening_angle`` (sample, plane, section, time).  ``read`` is what ``courses``
    gives, if it is there already.
    """
    read, ran_on = _shown(campaign, courses(campaign) if read is None else read)
    found = read.bands
    planes, sections = found["plane"].values.tolist(), found["section"].values.tolist()
    looks = dict(zip(planes, _LOOKS, strict=False))
    (middle, line), (worst, one) = _median_and_worst(campaign, read)
    cases = _cases(campaign, read, worst)
    columns = min(_WIDEST, len(sections))
    blocks = -(-len(sections) // columns)
    rows = blocks * len(planes)
    begin, end = _eventful(found)
    wide, heights = max(1.75 * columns, 7.0), [max(1.3, 2.4 / rows)] * rows
    limits = _limits([each for each in (found, one) if each is not None])
    if begin > 0.0 or end < float(found["time"][-1]):
        figure = Figure(figsize=(wide, sum(heights) + _WHOLE + 2.4))
        places = figure.add_gridspec(rows + 1, columns, height_ratios=[_WHOLE, *heights])
        grid = places[1:, :].subgridspec(rows, columns).subplots(squeeze=False)
        _whole(figure.add_subplot(places[0, :]), found, (begin, end), limits)
    else:
        figure = Figure(figsize=(wide, sum(heights) + 2.0))
        grid = figure.subplots(rows, columns, squeeze=False)
    axes: Axes
    for place, axes in enumerate(grid.ravel()):
        # By itself, and before its curves: axes that are shared ask each other for limits.
        axes.set(xlim=(begin, end or 1.0), ylim=limits)
        axes.xaxis.set_major_locator(MaxNLocator(3))
        axes.label_outer()
        row, column = divmod(place, columns)
        number, plane = row // len(planes) * columns + column, planes[row % len(planes)]
        if number >= len(sections):
            axes.set_visible(False)
            continue
        own = found.sel(plane=plane, section=sections[number])
        colour = looks[plane]
        for look, case in cases:
            axes.plot(case["time"], case.sel(plane=plane, section=sections[number]), **look)
        if not cases:
            ends = own.sel(quantile=0.0), own.sel(quantile=1.0)
            axes.fill_between(own["time"], *ends, facecolor=(colour, _BAND), linewidth=0.5,
                              edgecolor=colour)  # fmt: skip
        if line is not None and not cases:
            axes.plot(line["time"], line.sel(plane=plane, section=sections[number]), color=colour,
                      label="median", zorder=4)  # fmt: skip
        if one is not None:
            single = one.sel(plane=plane, section=sections[number])
            axes.plot(single["time"], single, zorder=3, **_WORST)
        if not column:
            axes.set_ylabel(f"{plane}\nplane", fontsize=8)
        if plane == planes[0]:
            axes.set_title(f"section {sections[number]}", fontsize=9, pad=3)
        if plane == planes[-1] and number + columns >= len(sections):
            axes.tick_params(labelbottom=True)
            axes.set_xlabel(style.label(found["time"], width=24), fontsize=8)
    figure.supylabel(style.label(found, width=26), fontsize=10)
    words: list[Line2D | Patch] = [
        Patch(facecolor=(style.GREY, _BAND), edgecolor=style.GREY, linewidth=0.5,
              label="all samples"),
    ]  # fmt: skip
    if line is not None:
        words.append(Line2D([], [], color=style.GREY, label=f"median: sample {middle}"))
    lines = [] if one is None else [Line2D([], [], label=f"worst: sample {worst}", **_WORST)]
    handles: list[Line2D | Patch] = [*words, *lines]
    if cases:
        alike = {look["label"]: look for look, _ in cases}
        handles = [*(Line2D([], [], **look) for look in alike.values()), *lines]
    entries(figure, handles, [str(each.get_label()) for each in handles])
    note = "After its end a deployed ring counts as in step, any other keeps its last deviation."
    if cases:
        some = f" {len(cases)} of them are drawn." * (len(cases) < len(read.samples))
        note = f"{(some + lines_told(campaign)).strip()} {note}"
    elif line is not None:
        note = f"Median: {middle_told(campaign, 'all')}. {note}"
    note = f"{told(campaign, len(read.samples))}. {note}{ran_on}"
    head(figure, campaign, "Ahead and behind", note)
    return figure


_BAND = 0.2
"""How far bands cover what is behind them."""
_WHOLE = 1.3
"""Height of the row that has the whole run, inch."""
_LITTLE, _SHORT, _AROUND = 0.25, 0.5, 0.15
"""Share of the largest deviation that is little; share of the time below which what happens is
enlarged, and what of its length is drawn before and behind it."""


def _eventful(found: xr.DataArray) -> tuple[float, float]:
    """Begin and end (s) of the time in which any V-joint of any sample deviates by more than a
    quarter of the largest; the whole time where that is more than half of it.
    """
    time, size = found["time"].to_numpy(), abs(found).max(("quantile", "plane", "section"))
    far = time[size.to_numpy() > _LITTLE * float(size.max())]
    if not len(far):
        return 0.0, float(time[-1])
    around = _AROUND * (far[-1] - far[0])
    begin, end = max(0.0, far[0] - around), min(float(time[-1]), far[-1] + around)
    short = 0.0 < end - begin < _SHORT * time[-1]
    return (float(begin), float(end)) if short else (0.0, float(time[-1]))


def _whole(
    axes: Axes, found: xr.DataArray, part: tuple[float, float], limits: tuple[float, float]
) -> None:
    """The range of all sections of both planes over the whole time, and the enlarged part of it."""
    ends = found.min(("quantile", "plane", "section")), found.max(("quantile", "plane", "section"))
    axes.fill_between(found["time"], *ends, facecolor=(style.GREY, 0.3), linewidth=0.5,
                      edgecolor=style.GREY)  # fmt: skip
    axes.axvspan(*part, color=style.ORANGE, alpha=0.2, linewidth=0.0)
    axes.set(xlim=(0.0, float(found["time"][-1])), ylim=limits)
    low, high = part
    words = f"all sections; below: {number_text(low)} to {number_text(high)} s, enlarged"
    axes.set_title(words, fontsize=9, pad=3)


def _shown(campaign: xr.Dataset, read: Courses) -> tuple[Courses, str]:
    """Courses up to where nearly all samples are over, and a sentence on the others."""
    until, ran_on = shown_until(campaign)
    return replace(read, bands=read.bands.sel(time=read.bands["time"] <= until)), ran_on


def _cases(
    campaign: xr.Dataset, read: Courses, worst: int
) -> list[tuple[dict[str, Any], xr.DataArray]]:
    """Looks and course of each case, evenly spread over all where they are many, with the worst
    one; empty for samples of a population.
    """
    some = read.samples[:: -(-len(read.samples) // _MOST_CASES) or 1]
    some = np.union1d(some, read.samples[read.samples == worst])
    looks = looks_of_cases(campaign, some)
    return [
        (look, course(campaign, int(sample), read.bands))
        for look, sample in zip(looks, some, strict=False)
    ]


def _median_and_worst(
    campaign: xr.Dataset, read: Courses
) -> tuple[tuple[int, xr.DataArray | None], tuple[int, xr.DataArray | None]]:
    """The sample whose asynchrony is the median, and that with the largest, with their courses;
    none of what was not recorded, and one only if both are the same.
    """
    found = median_and_worst(campaign)
    if found is None or found[1] not in read.samples:
        return (-1, None), (-1, None)
    middle, worst = found
    apart = middle != worst and middle in read.samples
    line = course(campaign, middle, read.bands) if apart else None
    return (middle, line), (worst, course(campaign, worst, read.bands))


def _limits(drawn: list[xr.DataArray]) -> tuple[float, float]:
    """What the curves need, and some air."""
    ends = [np.nan_to_num(each.values) for each in drawn]
    low, high = min(float(each.min()) for each in ends), max(float(each.max()) for each in ends)
    air = max(0.06 * (high - low), LEAST_SPAN)
    return low - air, high + air


@picture(
    "campaign", 60,
    "Lag of each section over time: the median sample or base case, and the worst sample",
    _NEEDS, judged_by, courses,
)  # fmt: skip
def lag_map(campaign: xr.Dataset, read: Courses | None = None) -> Figure:
    """Deviation from the mean opening angle as a colour: the sample whose asynchrony is the median,
    or the base case of single changes, beside the sample with the largest asynchrony, with one
    colour scale.  ``read`` is what ``courses`` gives, if it is there already.
    """
    read, ran_on = _shown(campaign, courses(campaign) if read is None else read)
    found = read.bands
    (middle, line), (worst, one) = _median_and_worst(campaign, read)
    columns = [] if line is None else [(f"median: sample {middle}", line)]
    note = f" Median: {middle_told(campaign, 'all')}." * bool(columns)
    if of_cases(campaign):
        note = ""
        base = base_of(campaign)
        known = base in read.samples and base != worst
        columns = [("base case", course(campaign, base or 0, found))] if known else []
    if one is not None:
        columns.append((f"worst: sample {worst}", one))
        over = (
            float(campaign["final_time"].sel(sample=worst)) if "final_time" in campaign else np.inf
        )
        times = campaign.get("deployment_time", campaign["sample"] * np.nan)
        locked = np.isfinite(float(times.sel(sample=worst)))
        if over < float(found["time"][-1]) and not locked:
            note += f" Sample {worst} was over at {over:.4g} s, and is drawn on as it ended."
    planes = found["plane"].values.tolist()
    figure = Figure(figsize=(4.9 * len(columns), 2.2 * len(planes) + 1.3))
    grid = figure.subplots(len(planes), len(columns), sharex=True, sharey=True, squeeze=False)
    span = max(LEAST_SPAN, *(style.largest_magnitude(values) for _, values in columns))
    for (name, values), axes_of in zip(columns, grid.T, strict=True):
        for plane, axes in zip(planes, axes_of, strict=True):
            image = style.lag_image(axes, values.sel(plane=plane), span)
            axes.set_title(f"{plane} plane, {name}", fontsize=9.5)
        axes_of[-1].set_xlabel(style.label(found["time"], width=44))
    bar = figure.colorbar(image, ax=grid.ravel().tolist(), pad=0.015)
    bar.outline.set_visible(False)
    bar.set_label(style.label(found, width=30), fontsize=9)
    grid[0, 0].yaxis.set_major_locator(MaxNLocator(10, integer=True, min_n_ticks=1))
    figure.supylabel(style.label(campaign["section"]), fontsize=10.5)
    head(figure, campaign, "Lag map", f"{told(campaign, len(read.samples))}.{note}{ran_on}")
    return figure


def locks_of(campaign: xr.Dataset) -> Array:
    """Lock times of the samples whose numbers hold, (sample, plane, section), s."""
    times = campaign["lock_time"].transpose("sample", "plane", "section").to_numpy()
    return np.asarray(times[good(campaign)])


def shares(campaign: xr.Dataset) -> tuple[Array, Array, Array]:
    """How often each V-joint locks first, last and not at all, (plane, section), of all used.

    V-joints that lock at one time share it; nobody is last in a sample in which some stay open.
    """
    locks = locks_of(campaign)
    flat = locks.reshape(len(locks), -1)
    none = np.isnan(flat)
    begun, done = ~none.all(axis=1), ~none.any(axis=1)
    first, last = np.zeros(flat.shape[1]), np.zeros(flat.shape[1])
    for rows, total, extreme in ((flat[begun], first, np.nanmin), (flat[done], last, np.nanmax)):
        if len(rows):
            own = rows == extreme(rows, axis=1, keepdims=True)
            total += (own / own.sum(axis=1, keepdims=True)).sum(axis=0)
    count = max(len(flat), 1)
    first, last, never = (
        each.reshape(locks.shape[1:]) / count for each in (first, last, none.sum(axis=0))
    )
    return first, last, never


_SMALL = 0.05
"""Share up to which a bar is hardly seen, or how high it is."""


def _name_small(axes: Axes, sections: Array, shares: list[tuple[str, Array]]) -> None:
    """Above each stack of bars the shares in it that are too small to be read off, in the colour of
    their bars: they are not that of the stack.
    """
    for number, section in enumerate(sections):
        height = sum(each[number] for _, each in shares)
        small = [(c, each[number]) for c, each in shares if 0.0 < each[number] < _SMALL]
        for k, (colour, share) in enumerate(small):
            axes.annotate(f"{100.0 * share:.2g}%", (section, height), xytext=(0, 2 + 9 * k),
                          textcoords="offset points", ha="center", fontsize=8, color=colour,
                          fontweight="bold")  # fmt: skip


@picture(
    "campaign", 70, "How often each V-joint comes to 180 deg first, last or not at all",
    ("lock_time",),
)  # fmt: skip
def lock_order(campaign: xr.Dataset) -> Figure:
    """Bars by plane and section from ``lock_time`` (sample, plane, section), on one another."""
    sections, planes = campaign["section"].values, campaign["plane"].values.tolist()
    figure = Figure(
        figsize=(float(np.clip(0.42 * len(sections) + 2.0, 6.4, 11.0)), 1.9 * len(planes) + 1.4)
    )
    grid = figure.subplots(len(planes), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    looks = (("first at 180 deg", style.BLUE, ""), ("last", style.ORANGE, "//"),
             ("not at all", style.GREY, ".."))  # fmt: skip
    drawn = [
        (look, table) for look, table in zip(looks, shares(campaign), strict=True) if table.any()
    ]
    for row, (plane, axes) in enumerate(zip(planes, grid, strict=True)):
        below = np.zeros(len(sections))
        for (label, colour, hatch), table in drawn:
            axes.bar(sections, table[row], 0.6, below, color=colour, hatch=hatch,
                     edgecolor="white", linewidth=0.3, label=label)  # fmt: skip
            below += table[row]
        _name_small(axes, sections, [(colour, table[row]) for (_, colour, _), table in drawn])
        axes.set_title(f"{plane} plane", fontsize=9.5)
        axes.grid(visible=False, axis="x")
    grid[0].set_xlim(sections[0] - 0.6, sections[-1] + 0.6)
    grid[0].set_ylim(0.0, 1.04)  # bars of all samples do not end with the axis
    grid[0].yaxis.set_major_formatter(PercentFormatter(1.0))
    grid[-1].set_xlabel(style.label(campaign["section"]))
    grid[-1].xaxis.set_major_locator(MaxNLocator(20, integer=True, min_n_ticks=1))
    figure.supylabel("Share of the samples", fontsize=10.5)
    legend(figure, [grid[0]])
    locks = locks_of(campaign)
    done = int(np.isfinite(locks).all(axis=(1, 2)).sum())
    note = "shares are of all of them; the last joint is counted in the "
    note += f"{done} samples in which all have come to 180 deg"
    head(figure, campaign, "Lock order", f"{told(campaign, len(locks))}; {note}")
    return figure
