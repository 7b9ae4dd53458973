"""Figures of two campaigns, or runs, beside each other, and of either beside measured data."""

import textwrap
from collections.abc import Iterator

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from ringsim.analysis.comparison import paired, samples_of
from ringsim.analysis.comparison_text import below_a_thousandth, differing, doubtful, names_of
from ringsim.analysis.courses import blocks, deployed, names_of_ends
from ringsim.analysis.design import endings, judged_by, median_and_worst, values_of
from ringsim.analysis.intervals import ALIKE, good, hardly_apart, numbers, tells_of, used
from ringsim.analysis.posterior import UNEXPLAINED
from ringsim.analysis.residuals import BAND, Residuals
from ringsim.outputs.family import VARIABLES, Array
from ringsim.plots import style
from ringsim.plots.campaign.frame import (
    at_or_below,
    base_of,
    drawable,
    legend,
    limits,
    mark_panels,
    middle_told,
    of_cases,
    shown_until,
)
from ringsim.tables import (
    estimate_text,
    interval_text,
    number_text,
    readable,
    unit_behind,
    unit_text,
    with_unit,
)

_LOOKS = ((style.BLUE, "-"), (style.ORANGE, (0, (5, 1.5))))
"""Colour and dashes of either: dashes tell them apart in grey."""
_WIDE = 40
"""Letters of a title above a panel."""
_PANELS = 12
"""Numbers with a panel of their own at most, those with requirements first: more do not fit a page
in the size in which they are read."""
_RECORDS = 301
"""Times of a course at most: more than a figure resolves, and all samples are read at each."""
_COURSES = {
    "opening_angle": ("mean", "mean opening angle"),
    "asynchrony": ("max", ""),
    "cable_tension": ("max", "largest cable tension"),
    "rod_stress": ("max", "largest rod stress"),
    "motor_current": ("max", "largest motor current"),
}
"""Courses that are drawn where both have them: what becomes of places, and what that is called."""
Both = tuple[xr.Dataset, xr.Dataset]


def figures_of_both(
    found: xr.Dataset, first: xr.Dataset, second: xr.Dataset
) -> Iterator[tuple[str, str, Figure]]:
    """Name, what it shows in words, and figure, of what ``compare`` has found of two datasets."""
    found, first, second = map(style.legible, (found, first, second))
    for name, words, figure in _figures(found, first, second):
        style.in_readable_units(figure)
        mark_panels(figure, doubtful(found))
        yield name, words, figure


def _figures(
    found: xr.Dataset, first: xr.Dataset, second: xr.Dataset
) -> Iterator[tuple[str, str, Figure]]:
    both = first, second
    if "sample" in first.dims:
        both, _ = samples_of(first, second)
        known = {name for each in both for name in drawable(each)}
        every = [n for n in differing(found) if n in known]
        moved = [n for n in every if not _still(both, n)] or every
        unmoved = [n for n in every if n not in moved]
        required = [n for n in moved if any(limits(each, n) for each in both)]
        names = [*required, *(n for n in moved if n not in required)][:_PANELS]
        flat = below_a_thousandth(found)
        left = [n for n in moved if n not in {*names, *flat}]
        unmoved += [n for n in moved if n in flat and n not in names]
        if names and found.attrs["pairs"]:
            words = "How far the samples of each pair differ"
            yield "differences", words, _noted(pairs(found, both, names), unmoved, left)
        if names:
            words = "Distribution of each main number in both"
            yield "values", words, _noted(values(found, both, names), unmoved, left)
    names = [n for n in _COURSES if all(n in each and "time" in each[n].dims for each in both)]
    if not names:
        return
    until, lines = _until(both)[0], _lines_of(both)
    drawn = {
        name: [_course(*each, name) for each in zip(both, until, lines, strict=True)]
        for name in names
    }
    read = {n: rows for n, rows in drawn.items() if all(np.isfinite(r).any() for _, r in rows)}
    if read:
        yield "courses", "Courses over time in both", courses(found, both, read)


def _still(both: Both, name: str) -> bool:
    """Whether all values of both are the same to a thousandth, and nothing is required of them."""
    every = np.concatenate([values_of(each, name)[1] for each in both])
    wanted = any(limits(each, name) for each in both)
    return bool(every.size) and not wanted and hardly_apart(every.min(), every.max())


def _noted(figure: Figure, unmoved: list[str], left: list[str]) -> Figure:
    """A figure that says below its panels which numbers have none."""
    words = []
    if unmoved:
        still = f"Not drawn, because samples differ by less than {100 * ALIKE:g} %: "
        words.append(still + ", ".join(unmoved))
    if left:
        words.append(f"In the table alone: {', '.join(left)}")
    if words:
        wide = int(12.0 * figure.get_figwidth())
        figure.legends[0].set_title("\n".join(textwrap.fill(each, wide) for each in words))
        figure.legends[0].get_title().set_fontsize(9)
    return figure


@style.styled
def pairs(found: xr.Dataset, both: Both, names: list[str]) -> Figure:
    """A panel a number: second less first of each pair, over the value of the first.

    The line is the mean of the differences, its band the interval; crosses are pairs whose outcome
    is another one.
    """
    matched = paired(*both)
    figure, panels, _ = style.new_panels(len(names), 3.7, 3.0, 0.9)
    other = endings(both[0])[matched.first] != endings(both[1])[matched.second]
    first, second = names_of(found)
    for axes, name in zip(panels, names, strict=True):
        one, two = (
            np.where(good(each), numbers(each, name), np.nan)[k]
            for each, k in zip(both, (matched.first, matched.second), strict=True)
        )
        apart, known = two - one, np.isfinite(two - one)
        axes.axhline(0.0, color=style.GREY, linewidth=0.9, zorder=1.4)
        low, high = found[f"{name}_difference_interval"].values.tolist()
        if np.isfinite(low + high):
            axes.axhspan(low, high, color=style.SKY, alpha=0.35, linewidth=0.0,
                         label="mean difference, and its interval of 95 %")  # fmt: skip
        axes.axhline(found[f"{name}_difference"].item(), color=style.BLUE, linewidth=1.2)
        for own, marker, colour, word in (
            (known & ~other, "o", style.BLUE, "pair"),
            (known & other, "x", style.VERMILION, "pair whose outcome differs"),
        ):
            if own.any():
                axes.plot(one[own], apart[own], marker, color=colour, markersize=4.5, alpha=0.8,
                          linestyle="none", label=word, rasterized=own.sum() > 500)  # fmt: skip
        units = str(both[0][name].attrs.get("units", "1"))
        mean = found[f"{name}_difference"].item()
        factor, units = readable(units, np.nanmax(np.abs(one)))
        mean, low, high = factor * mean, factor * low, factor * high
        axes.set_title(textwrap.fill(
            f"mean {estimate_text(mean, low, high, 3)} {unit_text(units)}".rstrip()
            + (f" ({interval_text(low, high, 3)})" if np.isfinite(low + high) else "")
            + f", n\u00a0=\u00a0{int(known.sum())}", _WIDE).replace("\u00a0", " "), fontsize=9,
        )  # fmt: skip
        axes.set_xlabel(style.label(both[0][name], width=38, behind=f", {first}"), fontsize=9)
        axes.set_ylabel(style.unit_label(both[0][name]), fontsize=9)
        axes.ticklabel_format(useOffset=False)
        style.few_ticks(axes)
    figure.supylabel(f"Difference: {second} less {first}", fontsize=10.5)
    legend(figure, panels)
    style.title(figure, f"Differences of {found.attrs['pairs']} pairs: {second} less {first}")
    return figure


@style.styled
def values(found: xr.Dataset, both: Both, names: list[str]) -> Figure:
    """Share of the samples of either at or below each value; limits that one of them has."""
    figure, panels, columns = style.new_panels(len(names), 3.7, 3.0, 0.9)
    for number, (axes, name) in enumerate(zip(panels, names, strict=True)):
        counts = []
        for each, called, (colour, dashes) in zip(both, names_of(found), _LOOKS, strict=True):
            ordered, share = at_or_below(each, name)
            counts.append(f"{len(ordered)} of {int(tells_of(each, name).sum())}")
            axes.step(np.append(ordered[:1], ordered), share, where="post", color=colour,
                      linestyle=dashes, label=called)  # fmt: skip
        wanted = dict.fromkeys(limit for each in both for limit in limits(each, name))
        for word, limit in wanted:
            axes.axvline(limit, color=style.VERMILION, linestyle=(0, (1, 1.5)), linewidth=1.3)
            units = str(both[0][name].attrs.get("units", "1"))
            axes.annotate(f"{word} {with_unit(f'{limit:g}', units)}", (limit, 1.0), ha="center",
                          color=style.VERMILION, xycoords=axes.get_xaxis_transform(),
                          textcoords="offset points", xytext=(0, 2), fontsize=9)  # fmt: skip
        axes.set_title(f"n = {', '.join(counts)}", fontsize=9, pad=16.0 if wanted else None)
        axes.set_ylim(0.0, 1.02)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
        style.plain_numbers(axes.xaxis)
        axes.set_xlabel(style.label(both[0][name], width=38), fontsize=9)
        style.few_ticks(axes)
        if number % columns == 0:
            axes.set_ylabel("Samples at or below")
    legend(figure, panels)
    style.title(figure, "Distributions: {} and {}".format(*names_of(found)))
    return figure


@style.styled
def courses(found: xr.Dataset, both: Both, read: dict[str, list[tuple[Array, Array]]]) -> Figure:
    """A panel a quantity over time: of runs their course, of campaigns that of ``_lines_of``, with
    the range of all samples, also of those that are over; ``read`` has times and rows of both by
    quantity.  Each over its own time where one, as a fast test beside a slow flight, takes much
    longer.
    """
    single, lines = "sample" not in both[0].dims, _lines_of(both)
    names = [
        called if sample is None else f"{called}, line: sample {sample}"
        for called, sample in zip(names_of(found), lines, strict=True)
    ]
    figure = Figure(figsize=(8.2, 2.3 * len(read) + 1.2))
    grid = figure.subplots(len(read), 1, sharex=True, squeeze=False)[:, 0]
    ends, apart = _until(both)
    for axes, (name, rows_of) in zip(grid, read.items(), strict=True):
        drawn = []
        for each, called, (colour, dashes), end in zip(rows_of, names, _LOOKS, ends, strict=True):
            (time, rows), most = each, end if apart else 1.0
            time = time / most
            drawn.append(rows)
            if len(rows) > 1:
                axes.fill_between(time, rows[0], rows[-1], color=colour, alpha=0.2, linewidth=0.0)
            axes.plot(time, rows[len(rows) // 2], color=colour, linestyle=dashes, label=called)
        variable = both[0][name]
        if _COURSES[name][1]:
            variable = variable.assign_attrs(long_name=_COURSES[name][1])
        axes.set_ylabel(style.label(variable, width=26), fontsize=9)
        if name != "opening_angle":
            style.span_sizes(axes, np.concatenate([each.ravel() for each in drawn]))
    grid[-1].set_xlabel(style.label(both[0]["time"]))
    grid[0].set_xlim(0.0, 1.0 if apart else ends[0])
    if apart:
        first, second = map("{} s in {}".format, (number_text(e, 3) for e in ends), names_of(found))
        when = ", when the last ring had opened" * all(_opened(both))
        grid[-1].set_xlabel(f"Share of {first} and of {second}{when}")
        grid[-1].xaxis.set_major_formatter(PercentFormatter(1.0))
    legend(figure, [*grid])
    style.title(figure, "Over time: {} and {}".format(*names_of(found)))
    if not single:
        together = found.attrs["pairs"] > 0 and not any(map(of_cases, both))
        told = dict.fromkeys(
            [_bands_told(both[0], names_of(found)[0])] if together else map(_bands_told, both)
        )
        cut = [
            f"{called}: {ran_on.partition(': ')[2]}"
            for each, called, end in zip(both, names_of(found), ends, strict=True)
            if (ran_on := shown_until(each)[1]) and _last(each) > end
        ]  # fmt: skip
        figure.legends[0].set_title("\n".join([*told, _OVER, *cut]))
        figure.legends[0].get_title().set_fontsize(9)
    return figure


def _lines_of(both: Both) -> list[int | None]:
    """The samples whose courses are drawn, none of runs: of pairs both of the same."""
    if "sample" not in both[0].dims:
        return [None, None]
    pairs = paired(*both)
    held = good(both[0])[pairs.first] & good(both[1])[pairs.second]
    if not held.any() or any(map(of_cases, both)):
        return [_line_of(each) for each in both]
    first = _line_of(both[0].isel(sample=pairs.first[held]))
    places = pairs.second[both[0]["sample"].to_numpy()[pairs.first] == first]
    return [first, int(both[1]["sample"].to_numpy()[places][0])]


def _line_of(campaign: xr.Dataset) -> int | None:
    """The sample whose courses are drawn: the base case of cases, else that in the middle."""
    if of_cases(campaign):
        return base_of(campaign)
    # Medians at each time would be of no sample, and lie far below all that lag late in turn.
    chosen = median_and_worst(campaign)
    return None if chosen is None else chosen[0]


def _bands_told(campaign: xr.Dataset, name: str = "") -> str:
    """What is drawn of a campaign; of pairs, by the ``name`` of the first."""
    if of_cases(campaign):
        return "Lines are the base case, if there is one; bands span all samples."
    if not judged_by(campaign):
        return "Bands span all samples."
    if name:
        return f"Both lines are {middle_told(campaign, name)};\nbands span all samples."
    return f"Each line is {middle_told(campaign, 'its campaign')};\nbands span all samples."


_OVER = (
    "A run that has ended still counts: a deployed ring with 180 deg and in step, everything else\n"
    "with its last value."
)
_DEPLOYED = {"opening_angle": 180.0, "asynchrony": 0.0}
"""What a deployed ring has: its last record may be before its last lock."""


_APART = 3.0
"""How many times as long as the other one has to take for each to have an axis of its own: the
shorter one would have less than a third of it."""


def _until(both: Both) -> tuple[list[float], bool]:
    """Times up to which the courses of either are drawn, s, and whether each has its own axis."""
    ends = [
        min(_last(each), shown_until(each)[0]) if "sample" in each.dims else _last(each)
        for each in both
    ]
    # Rings that do not open run on for long: the others' courses would lie beside each other.
    opened = _opened(both)
    marks = opened if all(opened) else ends
    if not max(marks) > _APART * min(marks) > 0.0:
        return [max(ends)] * 2, False
    return marks, True


def _opened(both: Both) -> list[float]:
    """When the last ring of either had opened, s; 0 if none has."""
    times = (np.append(each.get("deployment_time", np.nan), 0.0) for each in both)
    return [float(np.nanmax(each)) for each in times]


def _last(dataset: xr.Dataset) -> float:
    """When the last of the runs was over, s."""
    if "final_time" not in dataset:
        return float(dataset["time"][-1])
    return float(np.nanmax(np.append(dataset["final_time"].to_numpy(), 0.0)))


def _course(
    dataset: xr.Dataset, until: float, line: int | None, name: str
) -> tuple[Array, Array]:  # fmt: skip
    """Times and rows of a quantity up to a time (s): of a run itself, of a campaign the least, that
    of the sample whose line is drawn, and the largest.
    """
    time = dataset["time"].to_numpy()
    last = int(np.clip(np.searchsorted(time, until), 1, len(time) - 1))
    at = np.unique(np.linspace(0, last, min(last + 1, _RECORDS)).round().astype(int))
    if "sample" not in dataset.dims:
        return time[at], _over_places(dataset[name], name).isel(time=at).to_numpy()[None]
    about = ["status"] if "status" in dataset else []
    parts, samples = [], [np.empty(0, dtype=np.int64)]
    for block in blocks(dataset, [name, *about, *names_of_ends(dataset)]):
        own = used(block)
        parts.append(_held(own, name)[:, at])
        samples.append(own["sample"].to_numpy())
    held, kept = np.concatenate(parts), np.concatenate(samples)
    rows = np.full((3, len(at)), np.nan)
    known = np.isfinite(held).any(axis=0)
    if not known.any():  # all runs have failed
        return time[at], rows
    rows[0, known], rows[2, known] = np.nanmin(held[:, known], 0), np.nanmax(held[:, known], 0)
    if (own := held[kept == line]).size:
        rows[1] = own[0]
    return time[at], rows


def _held(block: xr.Dataset, name: str) -> Array:
    """A quantity of samples that stays what it was when they were over, (sample, time)."""
    rows: Array = _over_places(block[name], name).transpose("sample", "time").to_numpy()
    known = np.where(np.isfinite(rows), np.arange(rows.shape[1]), -1)
    last = np.maximum.accumulate(known, axis=1)
    rows = np.where(last < 0, np.nan, np.take_along_axis(rows, last.clip(0), axis=1))
    if name in _DEPLOYED and "deployment_time" in block:
        over = np.arange(rows.shape[1]) > known.max(axis=1, keepdims=True)
        rows[over & deployed(block)[:, None]] = _DEPLOYED[name]
    return rows


def _over_places(values: xr.DataArray, name: str) -> xr.DataArray:
    """The mean, or the largest, of a quantity over its planes, sections and so on."""
    places = [dim for dim in values.dims if dim not in ("sample", "time")]
    return getattr(values, _COURSES[name][0])(places) if places else values


# Measured data over the curves of a run.


_MOST_SENSORS = 12
"""Sensors that are drawn: those that fit worst."""


@style.styled
def measured_and_computed(found: list[Residuals], title: str) -> Figure:
    """A row a sensor: readings over the run's curve on the left, and on the right the readings less
    the curve in standard deviations of a reading, with a band of two.

    Beside a campaign the curve is the samples' median, and both bands hold 90 % of the samples with
    the scatter of a reading.  Numbers without a time are left out, and so are sensors beyond
    twelve: those that fit best.
    """
    over_time = [each for each in found if len(each.times) and np.isfinite(each.times).all()]
    shown = sorted(over_time, key=lambda each: -np.mean(each.in_deviations**2))[:_MOST_SENSORS]
    figure = Figure(figsize=(9.6, 1.8 * max(1, len(shown)) + 1.0))
    rows = figure.subplots(max(1, len(shown)), 2, sharex=True, squeeze=False)
    for (left, right), each in zip(rows, shown, strict=False):
        variable = VARIABLES[each.readings.sensor.variable]
        left.plot(each.times, each.measured, ".", color=style.VERMILION, markersize=3.0, zorder=3,
                  label="measured", rasterized=len(each.times) > 2000)  # fmt: skip
        words, band = "computed", np.broadcast_to([[-2.0], [2.0]], (2, len(each.times)))
        if each.band is not None:
            words, band = "median of samples", (each.band - each.computed) / each.readings.deviation
            left.fill_between(each.times, *each.band, color=style.SKY, alpha=0.35, linewidth=0.0,
                              label="90 % of samples")  # fmt: skip
        left.plot(each.times, each.computed, color=style.BLUE, linewidth=1.3, label=words)
        left.set_title(each.readings.sensor.name, fontsize=9.5)
        left.set_ylabel(unit_behind("", variable.units).strip(" ()"), fontsize=9)
        right.fill_between(each.times, *band, color=style.SKY, alpha=0.35, linewidth=0.0)
        right.axhline(0.0, color=style.GREY, linewidth=0.9)
        right.plot(each.times, each.in_deviations, ".", color=style.INK, markersize=2.5,
                   rasterized=len(each.times) > 2000)  # fmt: skip
        fits = f"rms {float(np.sqrt(np.mean(each.in_deviations**2))):.3g} sigma"
        if each.band is not None:
            fits = f"{each.within.mean():.0%} of readings in the band"
        right.set_title(fits, fontsize=9.5)
        right.set_ylabel("sigma", fontsize=9)
    for axes in rows[-1]:
        axes.set_xlabel("Time (s)")
    if not shown:
        rows[0][0].text(0.0, 0.5, "no reading over time lies within the run")
    else:
        rows[0][0].legend(loc="best", fontsize=8)
    left_out = len(over_time) - len(shown)
    more = f" ({left_out} sensors that fit better are not drawn)" * bool(left_out)
    style.title(figure, f"Measured and computed: {title}{more}")
    style.in_readable_units(figure)
    return figure


@style.styled
def learnt(posterior: xr.Dataset) -> Figure:
    """What a calibration has found: on the left each unknown before the data (grey, 90 %) and after
    them, in sigmas of the prior, with its median; on the right how far each sensor is off.
    """
    unknowns, sensors = posterior.sizes["unknown"], posterior.sizes["sensor"]
    figure = Figure(figsize=(12.0, max(0.42 * unknowns, 0.24 * sensors, 2.0) + 1.6))
    left, right = figure.subplots(1, 2, width_ratios=(3, 2))
    names = []
    for k in range(unknowns):
        one = posterior.isel(unknown=k)
        quantiles = one["posterior_quantile"].values
        factor, units = readable(str(one["unknown_units"].item()), float(np.abs(quantiles).max()))
        half = BAND * float(one["learnt"])
        left.barh(k, 2.0 * BAND, left=-BAND, height=0.62, color=style.GREY, alpha=0.3)
        left.errorbar(float(one["shift"]), k, xerr=half, fmt="o", color=style.BLUE, markersize=5,
                      capsize=3, linewidth=1.8)  # fmt: skip
        told = f"{number_text(factor * quantiles[1], 4)} {unit_text(units)}".rstrip()
        names.append(f"{one['unknown'].item()}\n{told}")
    left.set_yticks(range(unknowns), names)
    shifts, halves = posterior["shift"].values, BAND * posterior["learnt"].values
    ends = np.concatenate([shifts - halves, shifts + halves, [-BAND, BAND]])
    left.set_xlim(1.05 * ends.min(), 1.05 * ends.max())
    left.set_xlabel("Sigmas of the prior from its median")
    left.set_title("Unknowns before (grey) and after the data: 90 %, median", fontsize=10)
    far = posterior["chance"].values < UNEXPLAINED
    right.axvline(1.0, color=style.GREY, linewidth=0.9)
    right.scatter(posterior["rms_in_deviations"], range(sensors), s=22, zorder=3,
                  color=np.where(far, style.VERMILION, style.BLUE))  # fmt: skip
    right.set_yticks(range(sensors), [str(name) for name in posterior["sensor"].values])
    right.set_xlim(0.0, 1.08 * max(1.2, float(posterior["rms_in_deviations"].max())))
    right.set_xlabel("rms of misfits (1: scatter alone)")
    right.set_title("Sensors" + ", in red those not explained" * bool(far.any()), fontsize=10)
    for axes, count in ((left, unknowns), (right, sensors)):
        axes.set_ylim(count - 0.4, -0.6)
        axes.tick_params(axis="y", labelsize=8.5, length=0)
    style.title(figure, f"Learnt from the test: {posterior.attrs['title']}")
    return figure
