"""Courses by how samples ended: bands, margins, motors, base, tensions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ringsim.analysis.courses import blocks, ends, names_of_ends
from ringsim.analysis.design import by_path, endings, judged_by, told, values_of
from ringsim.analysis.intervals import good, used
from ringsim.analysis.requirements import MARGINS, required_by
from ringsim.outputs.family import VARIABLES, Array
from ringsim.plots import picture, style
from ringsim.plots.campaign.frame import (
    bands,
    head,
    legend,
    limits,
    lines_told,
    looks_of,
    looks_of_cases,
    middle_told,
    middles,
    of_cases,
    shown_until,
)
from ringsim.plots.drives_and_locks import LEAST, drive_end, least_rate, standard_of
from ringsim.tables import counted as number_of
from ringsim.tables import with_unit
from ringsim.variables import Fate

# Courses of some samples of every ending: bands that tell what those have in common that stall.


MOST = 200
"""Samples of an ending that are read at most, evenly spread over all."""
Looks = list[dict[str, Any]]
"""Of the line of each sample, where samples are cases; else empty."""


def chosen(campaign: xr.Dataset, names: Sequence[str]) -> tuple[xr.Dataset, NDArray[np.str_]]:
    """Some variables of up to ``MOST`` samples of each ending that hold, the one in the middle
    among them, and their endings.
    """
    words, ok = endings(campaign), good(campaign)
    taken = np.isin(campaign["sample"].to_numpy(), [*middles(campaign, words).values()])
    for word in set(words[ok].tolist()):
        own = np.flatnonzero(ok & (words == word))
        taken[own[:: -(-len(own) // MOST)]] = True
    parts, start = [], 0
    for block in blocks(campaign, names):
        size = block.sizes["sample"]
        parts.append(block.isel(sample=np.flatnonzero(taken[start : start + size])))
        start += size
    return xr.concat(parts, "sample", data_vars="all"), words[taken]


def counted(campaign: xr.Dataset, words: NDArray[np.str_], lines: str = "lines are medians") -> str:
    """How many samples hold, how many of them are drawn, and what bands and lines are."""
    count = int(good(campaign).sum())
    drawn = "" if len(words) == count else f" {len(words)} of them are drawn."
    lines = f" Bands span the samples of an outcome{'; ' * bool(lines)}{lines}."
    if of_cases(campaign):
        lines = lines_told(campaign)
    return f"{told(campaign, count)}.{drawn}{lines}"


def over_time_told(campaign: xr.Dataset, words: NDArray[np.str_]) -> str:
    """The same of courses over time, which a sample of each ending stands for."""
    line = f"the line is {middle_told(campaign, 'that outcome')}"
    return counted(campaign, words, line * bool(judged_by(campaign)))


def bands_by_ending(
    axes: Axes, x: Array, values: Array, words: NDArray[np.str_], cases: Looks,
    lines: Mapping[str, tuple[int, int]] | None = None,
) -> None:  # fmt: skip
    """Range of the curves (sample, x) of each ending, as long as any of them lasts, and their
    median, or of ``lines`` the row and sample of each ending; or all curves, of ``cases``.
    """
    for row, look in zip(values, cases, strict=False):
        axes.plot(x, row, **look)
    if cases:
        return
    for number, (word, (colour, _)) in enumerate(looks_of(words).items()):
        own = values[words == word]
        own = own[:, known := np.isfinite(own).any(axis=0)]
        if not own.size:
            continue
        label = f"{word} ({len(own)})"
        # With an edge: of one sample alone the band is a line.
        axes.fill_between(x[known], np.nanmin(own, axis=0), np.nanmax(own, axis=0),
                          facecolor=(colour, 0.22), edgecolor=(colour, 0.5),
                          linewidth=0.6)  # fmt: skip
        middle = np.full(own.shape[1], np.nan)
        if lines is None:
            middle = np.nanmedian(own, axis=0)
        elif word in lines:
            row, sample = lines[word]
            middle, label = values[row, known], f"{label}, line: sample {sample}"
        dashes = ("solid", (0, (5, 2)), (0, (2, 1.5)), (0, (6, 1.5, 1, 1.5)))[number % 4]
        axes.plot(x[known], middle, color=colour, linestyle=dashes, label=label)


def _ends_apart(curves: Array) -> bool:
    """Whether some curves (sample, time) go on when others have ended, so that a band shrinks."""
    known = np.isfinite(curves).sum(axis=0)
    return bool(known.size and 0 < known[np.flatnonzero(known)[-1:]].sum() < known.max())


def over_time(
    figure: Figure, panels: Sequence[Axes], campaign: xr.Dataset, read: xr.Dataset,
    curves: Sequence[Array], words: NDArray[np.str_],
) -> str:  # fmt: skip
    """A panel a set of curves (sample, time) of what was ``read`` of a campaign, up to the last
    time at which any is known, or where nearly all samples are over: sentences on the others.
    """
    time, last = read["time"].to_numpy(), 0
    cases, samples = looks_of_cases(campaign, read["sample"].values), read["sample"].to_numpy()
    lines = {
        word: (int(np.searchsorted(samples, sample)), sample)
        for word, sample in middles(campaign, endings(campaign)).items()
    }
    until, ran_on = shown_until(campaign)
    for axes, values in zip(panels, curves, strict=True):
        bands_by_ending(axes, time, values, words, cases, lines)
        if (known := np.flatnonzero(np.isfinite(values).any(axis=0))).size:
            last = max(last, int(known[-1]))
    panels[0].set_xlim(time[0], min(time[max(last, 1)], until))
    panels[-1].set_xlabel(style.label(read["time"]))
    legend(figure, panels, 4)
    every = [values[words == word] for values in curves for word in looks_of(words)]
    shrinks = not cases and any(map(_ends_apart, every))
    return ran_on + " Bands are of the samples not yet over." * shrinks


_WORDS = {"base_force": "force at the base", "base_torque": "torque at the base"}


@picture(
    "campaign", 120, "Force and torque at the base over time, by outcome",
    ("base_force", "base_torque"), name="base",
)  # fmt: skip
def base_load(campaign: xr.Dataset) -> Figure:
    """Magnitudes of ``base_force`` and ``base_torque`` (sample, axis, time)."""
    read, words = chosen(campaign, [*_WORDS])
    figure = Figure(figsize=(8.4, 5.6))
    panels = figure.subplots(2, 1, sharex=True).tolist()
    curves = []
    for axes, (name, text) in zip(panels, _WORDS.items(), strict=True):
        parts = read[name].transpose("sample", "axis", "time")
        curves.append(np.linalg.norm(parts.to_numpy(), axis=1))
        axes.set_ylabel(style.label(parts.assign_attrs(long_name=text), width=30))
        style.span_sizes(axes, curves[-1])
    ran_on = over_time(figure, panels, campaign, read, curves, words)
    note = f"{over_time_told(campaign, words)}{ran_on} At recorded times: peaks may be higher."
    head(figure, campaign, "What the base carries", note)
    return figure


_ZERO: dict[str, Any] = {"color": style.INK, "linewidth": 1.2, "linestyle": (0, (1, 1.5))}
"""Look of a margin of 0: unlike any median's, whose dashes are longer."""
_GOLDEN = 0.618034
"""Multiples of it fill a row evenly, whatever the number of marks."""
_ANGLES = 161


@picture(
    "campaign", 40, "Smallest margin of the drive by outcome, and its course",
    ("drive_margin", "least_drive_margin", "opening_angle"),
)  # fmt: skip
def margin(campaign: xr.Dataset) -> Figure:
    """``least_drive_margin`` (sample), or the least margin that is required, by ending; below,
    ``drive_margin`` (sample, time) over the mean opening angle, until the last winch has stopped:
    see ``drive_end``.
    """
    figure = Figure(figsize=(8.6, 6.2))
    upper, lower = figure.subplots(2, 1, height_ratios=(2, 3))
    wanted = [name for name in MARGINS if name in required_by(campaign.attrs)]
    name = next((each for each in wanted if values_of(campaign, each)[1].size), MARGINS[0])
    samples, values = values_of(campaign, name)
    _strips(upper, campaign, name, samples, values)
    read, words = chosen(campaign, ["drive_margin", "opening_angle"])
    angles = read["opening_angle"].mean(("plane", "section")).transpose("sample", "time").to_numpy()
    margins = read["drive_margin"].transpose("sample", "time")
    last = np.broadcast_to(drive_end(campaign.sel(sample=read["sample"])), len(words))
    after = margins.notnull() & (read["time"] >= xr.DataArray(last, dims="sample"))
    rows = [_over_angle(*each) for each in zip(angles, margins.where(~after).values, strict=True)]
    grid = angle_grid(rows)
    laid = np.array([laid_on(grid, *row) for row in rows])
    cases = looks_of_cases(campaign, read["sample"].values)
    # Rings that deploy all come to 180 deg, but each has its last record before at another angle:
    # beyond the first of these a band would be of few samples, and shrink to one.
    opened = words == Fate.DEPLOYED.words
    whole = opened & ~after.any("time").to_numpy()
    ends = [rows[k][0][-1] for k in np.flatnonzero(whole) if len(rows[k][0])]
    ended = len(ends) > 1 and not cases and max(ends) - min(ends) > _SAME_ANGLE
    if ended:
        laid[np.ix_(opened, grid > min(ends) + _SAME_ANGLE)] = np.nan
    bands_by_ending(lower, grid, laid, words, cases)
    least = values_of(campaign, MARGINS[0])[1]
    style.margin_axis(lower, np.append(laid, least.min()), f"Margin by {standard_of(campaign)}")
    lower.axhline(0.0, **_ZERO)
    lower.set_xlabel("Mean opening angle (deg)")
    legend(figure, [lower], 4)
    note = f"{counted(campaign, words)} Dotted: the margin of 0 that the standard requires."
    if name != MARGINS[0]:
        note += " Above is the margin that is required; below is that of the whole drive."
    if ended:
        note += " The band of deployed samples ends where the first of them has its last record."
    if cut := int(after.any("time").sum()):
        note += (
            f" Curves end where the last winch stops, in {number_of(cut, 'sample')}: nobody "
            "drives any more."
        )
    head(figure, campaign, "Drive margin", note)
    return figure


def _strips(axes: Axes, campaign: xr.Dataset, name: str, samples: Array, values: Array) -> None:
    """A row an ending, a mark a sample at its smallest margin of a kind; limits of the campaign."""
    words = endings(campaign)[np.searchsorted(campaign["sample"].to_numpy(), samples)]
    shown = looks_of(words)
    for row, (word, (colour, marker)) in enumerate(shown.items()):
        own = values[words == word]
        heights = row + 0.5 * (np.arange(len(own)) * _GOLDEN % 1.0 - 0.5)
        axes.scatter(own, heights, s=22, color=colour, marker=marker, alpha=0.7, linewidths=0.5,
                     rasterized=len(own) > 500)  # fmt: skip
    axes.set_yticks(range(len(shown)), [f"{word} ({(words == word).sum()})" for word in shown])
    axes.set_ylim(len(shown) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    for _, limit in limits(campaign, name):
        axes.axvline(limit, color=style.VERMILION, linewidth=1.3)
        axes.annotate(f"required {limit:g}", (limit, 1.0), rotation=0, ha="center", va="bottom",
                      color=style.VERMILION, fontsize=9,
                      xycoords=axes.get_xaxis_transform())  # fmt: skip
    if values.size and values.min() < 0.0 < values.max():
        axes.axvline(0.0, **_ZERO)
    axes.set_xlabel(style.label(campaign[name]))


def _over_angle(angle: Array, margins: Array) -> tuple[Array, Array]:
    """Both as long as the ring opens, the angle growing."""
    known = np.isfinite(angle) & np.isfinite(margins)
    angle, margins = angle[known], margins[known]
    grows = np.append(True, angle[1:] > np.maximum.accumulate(angle)[:-1])[: len(angle)]
    return angle[grows], margins[grows]


def angle_grid(rows: list[tuple[Array, Array]]) -> Array:
    """Angles from the least to the largest of all runs, deg; rows are angles and margins."""
    known = [angle for angle, _ in rows if len(angle)]
    low = min((float(angle[0]) for angle in known), default=0.0)
    return np.linspace(low, max((float(angle[-1]) for angle in known), default=180.0), _ANGLES)


_SAME_ANGLE = 1e-6
"""Difference of angles that is none, deg: round-off is 1e-13, a run's step 1e-2."""


def laid_on(grid: Array, angle: Array, margins: Array) -> Array:
    """Margins over angle on a grid of angles; NaN where a run has not been."""
    if not len(angle):
        return np.full(len(grid), np.nan)
    # Runs begin at one angle but for round-off, there where margins often are least.
    for end in angle[0], angle[-1]:
        grid = np.where(np.abs(grid - end) < _SAME_ANGLE, end, grid)
    return np.asarray(np.interp(grid, angle, margins, left=np.nan, right=np.nan))


@picture(
    "campaign", 110, "Torque and speed of the motors over time, by outcome",
    ("motor_torque", "motor_speed"),
)  # fmt: skip
def motors(campaign: xr.Dataset) -> Figure:
    """A row a motor, from ``motor_torque`` and ``motor_speed`` (sample, plane, winch, time)."""
    names = ["motor_torque", "motor_speed", *names_of_ends(campaign)]
    read, words = chosen(campaign, names)
    # Motors that have done their work stand still, and would hide those that still wind.
    read = read.where(read["time"] <= xr.DataArray(ends(read), dims="sample"))
    read = read.transpose("sample", "plane", "winch", "time")
    there = np.isfinite(read["motor_torque"].to_numpy()).any(axis=(0, 3))
    places = np.argwhere(there).tolist()
    figure = Figure(figsize=(9.2, 2.2 * len(places) + 1.3))
    grid = figure.subplots(len(places), 2, sharex=True, sharey="col", squeeze=False)
    curves = []
    for row, (plane, winch) in zip(grid, places, strict=True):
        name = f"{read['plane'].values[plane]} cable"
        name += f", winch {read['winch'].values[winch]}" if there.shape[1] > 1 else ""
        for axes, what in zip(row, ("motor_torque", "motor_speed"), strict=True):
            curves.append(read[what].to_numpy()[:, plane, winch])
            axes.set_title(name, fontsize=9.5)
            axes.set_ylabel(style.label(read[what], width=22), fontsize=9)
    ran_on = over_time(figure, grid.ravel().tolist(), campaign, read, curves, words)
    grid[-1, 0].set_xlabel(style.label(read["time"]))
    note = f"{over_time_told(campaign, words)}{ran_on} At recorded times: peaks may be higher."
    head(figure, campaign, "Motors", note)
    return figure


@picture("campaign", 72, "Opening rate of each V-joint at its latch", ("latch_rate",))
def latch_rate(campaign: xr.Dataset) -> Figure:
    """Bands of ``latch_rate`` (sample, plane, section); the least rate at which latches catch, and
    what is required of the least and the largest rate.
    """
    paths = by_path(campaign)
    drawn = any(path.startswith(("latch.min_rate", "latch[")) or path == "latch" for path in paths)
    least = np.nan if drawn else least_rate(campaign)
    return _by_joint(campaign, "latch_rate", "Latch rates", least)


@picture("campaign", 74, "Impulse of each stop at the lock of its V-joint", ("lock_impulse",))
def lock_impulse(campaign: xr.Dataset) -> Figure:
    """Bands of ``lock_impulse`` (sample, plane, section); what is required of the largest."""
    return _by_joint(campaign, "lock_impulse", "Latch shock")


def _by_joint(campaign: xr.Dataset, name: str, subject: str, least: float = np.nan) -> Figure:
    """A panel a plane, a place a section: median, 5-95 % and 0-100 % over the samples, or the
    samples themselves where they are cases.
    """
    held = used(campaign)[name].transpose("sample", "plane", "section")
    units = str(held.attrs.get("units", "1"))
    required = [
        bound for each in VARIABLES.values() if name in (each.largest_of, each.least_of)
        for bound in limits(campaign, each.name)
    ]  # fmt: skip
    planes, sections = held["plane"].values.tolist(), held["section"].values
    cases = looks_of_cases(campaign, held["sample"].values)
    figure = Figure(figsize=(8.4, 2.1 * len(planes) + 1.4))
    grid = figure.subplots(len(planes), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for plane, axes in zip(planes, grid, strict=True):
        own = held.sel(plane=plane).to_numpy()
        for row, look in zip(own, cases, strict=False):
            axes.plot(sections, row, marker="o", markersize=3, **look)
        known = np.isfinite(own).any(axis=0)
        if not cases and known.any():
            low, lower, middle, upper, high = bands(own[:, known])
            at = sections[known]
            axes.vlines(at, low, high, color=style.BLUE, linewidth=1.0, label="0-100 %")
            axes.vlines(at, lower, upper, color=style.SKY, linewidth=5.0, label="5-95 %")
            axes.plot(at, middle, "o", color=style.INK, markersize=4, label="median")
        for word, limit in required:
            axes.axhline(limit, color=style.VERMILION, linewidth=1.3, linestyle=(0, (5, 2)))
            # Beside the frame, where nothing is drawn.
            axes.annotate(f"{word} {with_unit(f'{limit:g}', units)}", (1.0, limit), va="center",
                          color=style.VERMILION, xycoords=axes.get_yaxis_transform(), fontsize=9,
                          textcoords="offset points", xytext=(4, 0))  # fmt: skip
        if least > 0.0:
            axes.axhline(least, label=f"latches catch from {least:.3g} rad/s on", **LEAST)
        axes.set_title(f"{plane} plane", fontsize=9.5)
        axes.grid(visible=False, axis="x")
    style.from_zero(grid[0])
    grid[0].set_xlim(sections[0] - 0.6, sections[-1] + 0.6)
    grid[-1].xaxis.set_major_locator(MaxNLocator(20, integer=True, min_n_ticks=1))
    grid[-1].set_xlabel(style.label(campaign["section"]))
    figure.supylabel(style.label(held, width=30), fontsize=10.5)
    legend(figure, [grid[0]], 4)
    values = held.to_numpy()
    some = int(np.isfinite(values).any(axis=(1, 2)).sum())
    missing = int(np.isnan(values).sum())
    note = f"{told(campaign, some)}.{lines_told(campaign) * bool(cases)}"
    if missing:
        note += f" {missing} of {values.size} V-joints of all samples have none."
    head(figure, campaign, subject, note)
    return figure


def peaks(campaign: xr.Dataset) -> xr.DataArray:
    """Largest recorded tension of each span until the last lock, (sample, plane, span), N."""
    found = []
    for block in blocks(campaign, ["cable_tension", "status", *names_of_ends(campaign)]):
        own = used(block)
        until = xr.DataArray(ends(own), dims="sample")
        found.append(own["cable_tension"].where(own["time"] <= until).max("time", keep_attrs=True))
    return xr.concat(found, "sample")


@picture(
    "campaign", 130, "Largest tension of each span along the cables",
    ("cable_tension", "final_time", "deployment_time"),
)  # fmt: skip
def tension(campaign: xr.Dataset) -> Figure:
    """A panel a cable, from the winch on: median, 5-95 % and 0-100 % over the samples, or the
    samples themselves where they are cases.
    """
    found = peaks(campaign)
    planes = [p for p in found["plane"].values.tolist() if found.sel(plane=p).notnull().any()]
    figure = Figure(figsize=(8.4, 2.3 * len(planes) + 1.3))
    grid = figure.subplots(len(planes), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    worst, names, limit = _worst(campaign), "", style.limit_of(campaign, "tension")
    for plane, axes in zip(planes, grid, strict=True):
        own = found.sel(plane=plane).transpose("sample", "span")
        own = own.dropna("span", how="all").dropna("sample", how="all")
        cases = looks_of_cases(campaign, own["sample"].values)
        for row, case in zip(own.values, cases, strict=False):
            axes.plot(own["span"], row, marker="o", markersize=3, **case)
        if not cases:
            low, lower, middle, upper, high = bands(own.values)
            look = {"color": style.BLUE, "linewidth": 0.0}
            axes.fill_between(own["span"], low, high, alpha=0.18, label="0-100 %", **look)
            axes.fill_between(own["span"], lower, upper, alpha=0.35, label="5-95 %", **look)
            axes.plot(own["span"], middle, color=style.BLUE, marker="o", markersize=3,
                      label="median")  # fmt: skip
        if worst in own["sample"]:
            names = f"largest tension: sample {worst}"
            axes.plot(own["span"], own.sel(sample=worst), color=style.INK, linewidth=0.9,
                      linestyle=(0, (3, 1.5)), label=names)  # fmt: skip
        axes.set_title(f"{plane} cable", fontsize=9.5)
        axes.xaxis.set_major_locator(MaxNLocator(20, integer=True, min_n_ticks=1))
    required = limits(campaign, "peak_tension")
    also = ", as required" * any(most == limit for _, most in required)
    style.draw_limit([*grid], limit, f"limits.tension = {limit:g} N{also}")
    for word, most in required:
        if most != limit:
            style.draw_limit([*grid], most, f"required: {word} {most:g} N", right=True)
    style.from_zero(grid[0])  # all panels share it
    spans = found["span"].values
    grid[0].set_xlim(spans[0] - 0.6, spans[-1] + 0.6)  # there is no span 0
    grid[-1].set_xlabel(style.label(campaign["span"]))
    figure.supylabel(style.label(found.assign_attrs(long_name="largest recorded tension")),
                     fontsize=10.5)  # fmt: skip
    legend(figure, [grid[0]], 4)
    counted = int(np.isfinite(found.to_numpy()).any(axis=(1, 2)).sum())
    note = f"{told(campaign, counted)}.{lines_told(campaign) * bool(cases)}"
    note += " At recorded times until the last lock, or to the end where latches do not catch: "
    note += "peaks may be higher."
    head(figure, campaign, "Tension along the cables", note)
    return figure


def _worst(campaign: xr.Dataset) -> int:
    if "peak_tension" not in campaign:
        return -1
    samples, values = values_of(campaign, "peak_tension")
    return int(samples[np.argmax(values)]) if len(samples) else -1
