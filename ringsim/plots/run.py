"""Figures of a run: opening angles, asynchrony, energy, the map of its sections."""

import math
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator, MultipleLocator

from ringsim.outputs.family import Array
from ringsim.plots import jointed, picture, style
from ringsim.tables import known_to, number_text, unit_text, with_unit

# The largest value of a run as a point of what is drawn: records stand at fixed times, so that
# campaigns have one time axis, and a peak seldom falls on one.  Its value, time and place are
# numbers of the dataset.  Figures put them into the curve of what is drawn alone; of curves that
# are compared only one would get its peak, and look larger than the others: there it is a mark.


class Peak(NamedTuple):
    """A largest value, in the unit of its variable, when (s) and where along each dimension."""

    value: float
    time: float
    place: dict[str, Any]
    error: float = math.nan
    """Its numerical error bar."""

    def within(self, values: xr.DataArray, factor: float = 1.0) -> tuple[Array, Array]:
        """Times and values of a recorded curve (time,), with the peak as one of its points.

        As they are if the peak stands elsewhere: ``values`` has its place as coordinates.
        """
        times, heights = values["time"].values, factor * values.values
        here = {dim: values[dim].item() for dim in self.place if dim in values.coords}
        own = here.items() <= self.place.items()
        if not own or not math.isfinite(self.value):
            return times, heights
        if factor * self.value in heights[times == self.time]:
            return times, heights
        at = int(np.searchsorted(times, self.time))
        return np.insert(times, at, self.time), np.insert(heights, at, factor * self.value)

    def apart(self, values: xr.DataArray) -> str:
        """What the curve (time,) of its place has instead of it, where records are too seldom."""
        time = values["time"].to_numpy()
        near = float(np.interp(self.time, time, values.to_numpy()))
        if len(time) < 2 or abs(near - self.value) <= _ON_CURVE * abs(self.value):
            return ""
        return f"curves: records every {np.median(np.diff(time)):.3g} s; dot: of all steps"


_ON_CURVE = 0.03
"""Distance of a mark from its curve, over its height, that nobody sees."""


def peak_of(
    dataset: xr.Dataset, series: str, value: str, until: float = math.inf, stem: str = ""
) -> Peak:
    """The largest of a variable over (..., time), at any step of a run up to a time in s.

    ``value`` names the number that holds it; ``STEM_time`` and ``STEM_DIM`` are when and where,
    the stem being its name if none is given.  What a dataset lacks of these is that of the largest
    record nearby.
    """
    stem = stem or value
    records = dataset[series].where(dataset["time"] <= until)
    time = float(dataset.get(f"{stem}_time", math.nan))
    after = int(np.searchsorted(records["time"].values, time))
    near = records.isel(time=slice(max(after - 1, 0), after + 1))
    near = near if math.isfinite(time) and np.isfinite(near).any() else records
    best = near.isel({dim: int(k) for dim, k in near.argmax(...).items()})
    dims = [str(dim) for dim in records.dims if dim != "time"]
    place = {dim: label_of(dataset, f"{stem}_{dim}", best[dim]) for dim in dims}
    stated = float(dataset.get(value, math.nan))
    return Peak(
        stated if math.isfinite(stated) else float(best),
        time if math.isfinite(time) else float(best["time"]), place,
        float(dataset.get(f"{value}_error", math.nan)),
    )  # fmt: skip


def label_of(dataset: xr.Dataset, name: str, nearby: xr.DataArray) -> Any:
    """A label along a dimension that a variable holds; that of ``nearby`` if there is none."""
    held = dataset[name].item() if name in dataset else None
    return held if held in dataset[str(nearby.name)].values else nearby.item()


def mark(
    axes: Axes, peak: Peak, units: str, place: str, factor: float = 1.0,
    curve: xr.DataArray | None = None,
) -> None:  # fmt: skip
    """A dot at a peak, and its value, time and place in words away from it and from curves.

    ``curve`` (time,) is what was recorded at its place, which may have nothing of the peak.
    """
    if not math.isfinite(peak.value):
        return
    height = factor * peak.value
    told = known_to(f"{height:.3g}", factor * peak.error, exact=height)
    units = unit_text(units)
    axes.plot(peak.time, height, "o", color=style.VERMILION, markersize=6, zorder=4, clip_on=False)
    early = peak.time < 0.5 * sum(axes.get_xlim())
    apart = "" if curve is None else peak.apart(curve)
    largest = "largest of all steps" if apart else "largest"
    when = f"{largest}: {told} {units} at {peak.time:.4g} s"
    style.free(axes.text(
        0.98 if early else 0.02, 0.95 if early else 0.82,
        "\n".join(filter(None, [when, place, apart])), transform=axes.transAxes, va="top",
        ha="right" if early else "left", color=style.VERMILION, bbox=style.PAPER, zorder=5,
    ))  # fmt: skip


# Figures.


LEAST_SPAN = 0.01
"""Smallest range (degree) of the axis of deviations, so that round-off is not magnified."""


@picture("run", 10, "Opening angles over time", ("opening_angle",), jointed)
def opening_angles(dataset: xr.Dataset) -> Figure:
    """``opening_angle`` (plane, section, time) and, until all have locked, its deviation from the
    mean of all.

    Each plane has a column, and colour counts the sections; ``lock_time`` and ``deployment_time``
    are marked where they are known.
    """
    final = float(dataset.get("final_time", math.nan))
    angle = _locked(dataset, dataset["opening_angle"].dropna("time", how="all"), 180.0, final)
    deviation = _locked(dataset, deviations(dataset), 0.0)
    planes, sections = dataset["plane"].values.tolist(), dataset["section"]
    figure = Figure(figsize=(5.2 * len(planes) + 0.6, 6.4))
    grid = figure.subplots(
        2, len(planes), sharex=True, sharey="row", squeeze=False, height_ratios=(3, 2)
    )
    for (upper, lower), plane in zip(grid.T, planes, strict=True):
        _draw_lines(upper, angle.sel(plane=plane))
        lines = _draw_lines(lower, deviation.sel(plane=plane))
        _mark_locks(upper, dataset, plane)
        style.name_panel(upper, f"{plane} plane", height=0.91)
        style.time_axes(dataset, angle, upper, lower)
    _limits(grid, angle, deviation)
    grid[0, 0].set_ylabel(style.label(angle))
    grid[1, 0].set_ylabel(f"Deviation from\nthe mean {style.unit_label(angle)}")
    figure.align_ylabels(grid[:, 0])
    if sections.size > 1:
        bar = figure.colorbar(lines, ax=grid, aspect=40, pad=0.015, label=style.label(sections))
        bar.set_ticks(MaxNLocator(12, integer=True))
        bar.minorticks_off()
        bar.outline.set_visible(False)
    style.head(figure, grid[0, 0], dataset, "Opening angles")
    return figure


def _locked(
    dataset: xr.Dataset, values: xr.DataArray, last: float, *later: float
) -> xr.DataArray:  # fmt: skip
    """A course with what a deployed ring has behind the last record: at its deployment time, and
    at later ones.
    """
    deployed = style.locked_time(dataset)
    times = (deployed, *later) if math.isfinite(deployed) else ()
    times = tuple(t for t in times if t > float(values["time"][-1]))
    more = [xr.full_like(values[..., -1:], last).assign_coords(time=[t]) for t in times]
    return xr.concat([values, *more], "time") if more else values


def deviations(dataset: xr.Dataset) -> xr.DataArray:
    """Opening angles less their mean over all V-joints, (plane, section, time), degree.

    As recorded up to the deployment, or the end of a run without: what locked joints do when they
    rebound is no deviation.
    """
    angle = dataset["opening_angle"].dropna("time", how="all")
    angle = angle[..., ~(angle["time"].values > style.deployment_time(dataset))]
    found = angle - angle.mean(("plane", "section"), skipna=True)
    return found.assign_attrs(angle.attrs, long_name="deviation from the mean opening angle")


def _draw_lines(axes: Axes, values: xr.DataArray) -> LineCollection:
    sections, rows = values["section"].values, values.transpose("section", "time").values
    lines = LineCollection(
        [np.column_stack([values["time"], row]) for row in rows],
        array=sections,
        cmap=style.section_colours(len(sections)),
        norm=BoundaryNorm(np.arange(len(sections) + 1) + sections[0] - 0.5, len(sections)),
        linewidths=1.3 if len(sections) <= 24 else 0.9,
    )
    axes.add_collection(lines)
    return lines


def _mark_locks(axes: Axes, dataset: xr.Dataset, plane: str) -> None:
    axes.axhline(180.0, color=style.GREY, linewidth=0.8, zorder=1.4)
    if "lock_time" not in dataset:
        return
    moments = dataset["lock_time"].sel(plane=plane).values
    locked = np.flatnonzero(np.isfinite(moments))
    axes.scatter(
        moments[locked], np.full(len(locked), 180.0), s=22, zorder=3, edgecolors="white",
        c=style.section_colours(len(moments))(locked), linewidths=0.5, clip_on=False,
    )  # fmt: skip


def _limits(grid: np.ndarray, angle: xr.DataArray, deviation: xr.DataArray) -> None:
    """Room for all that is drawn."""
    lowest, highest = (float(angle.min()), float(angle.max())) if angle.size else (0.0, 180.0)
    grid[0, 0].set_ylim(30.0 * math.floor(lowest / 30.0), max(188.0, highest + 4.0))
    for axes in grid[0]:
        axes.yaxis.set_major_locator(MultipleLocator(30.0))
    span = max(1.15 * style.largest_magnitude(deviation), LEAST_SPAN)
    grid[1, 0].set_ylim(-span, span)


_CLOSE = (0.02, 0.5)
"""Least and largest share of the run that the enlarged end shows: fewer records are a few straight
lines, and more is what the whole run shows as well."""


@picture("run", 20, "Asynchrony over time", ("asynchrony", "opening_angle"))
def asynchrony(dataset: xr.Dataset) -> Figure:
    """``asynchrony`` (time) of a run up to the deployment: the whole run and its last seconds.

    ``asynchrony_max``, which also counts the steps between the records, is a point of the curve.
    """
    values = dataset["asynchrony"].dropna("time")
    moving = values[~(values["time"].values > style.deployment_time(dataset))]
    end = float(moving["time"][-1])
    moving = _locked(dataset, moving, 0.0)
    peak = peak_of(dataset, "asynchrony", "asynchrony_max", end)
    times, heights = peak.within(moving)
    figure = Figure(figsize=(10.2, 4.3))
    whole, close = figure.subplots(1, 2, width_ratios=(3, 2))
    for axes in (whole, close):
        axes.fill_between(times, heights, color=style.SKY, alpha=0.25, linewidth=0.0)
        axes.plot(times, heights, color=style.BLUE)
        style.time_axes(dataset, values, axes, named=axes is whole)
    whole.set_ylim(0.0, 1.25 * max(float(np.max(heights)), 1e-9))
    whole.set_ylabel(style.label(values, width=40))
    begin, last = _last_seconds(dataset, end, peak.time)
    if begin < last:
        close.set_xlim(begin, last)
    close.set_ylim(0.0, 1.25 * max(float(np.max(heights[times >= begin])), 1e-9))
    leader, laggard = ("{} {}".format(*joint) for joint in apart(dataset, peak.time))
    mark(whole, peak, str(values.attrs.get("units", "")), f"{laggard} behind {leader}")
    if peak.time >= begin:
        close.plot(peak.time, peak.value, "o", color=style.VERMILION, markersize=6, zorder=4)
    # Of runs whose joints wait for each other it may be half of the whole.
    style.name_panel(close, f"from {number_text(begin, 3)} s on, enlarged")
    style.head(figure, whole, dataset, "Asynchrony")
    return figure


def apart(dataset: xr.Dataset, time: float) -> tuple[tuple[str, int], tuple[str, int]]:
    """Plane and section of the V-joint that is farthest open at a time (s), and of the least."""
    angles = dataset["opening_angle"].dropna("time", how="all").sel(time=time, method="nearest")
    found = []
    for who, place in (("leader", angles.argmax(...)), ("laggard", angles.argmin(...))):
        plane, section = (
            label_of(dataset, f"asynchrony_{who}_{dim}", angles.isel(place)[dim])
            for dim in ("plane", "section")
        )
        found.append((str(plane), int(section)))
    return found[0], found[1]


def _last_seconds(dataset: xr.Dataset, end: float, peak: float) -> tuple[float, float]:
    """From before the largest value or the first lock to the end, within bounds."""
    locks = dataset["lock_time"].values if "lock_time" in dataset else np.array(math.nan)
    first = float(np.nanmin(np.append(locks, peak)))
    least, most = (share * end for share in _CLOSE)
    length = min(max(1.5 * (end - first), least), most)
    return end - length, max(end, np.nan_to_num(style.deployment_time(dataset))) + 0.05 * length


_LOOKS = {
    "work": (style.INK, "-"),
    "kinetic_energy": (style.BLUE, "-"),
    "elastic_energy": (style.ORANGE, (0, (5, 1.5))),
    "dissipation": (style.VERMILION, (0, (1.2, 1.2))),
}


@picture(
    "run", 120, "Work, energies and their balance",
    ("work", "kinetic_energy", "elastic_energy", "dissipation"),
)  # fmt: skip
def energy(dataset: xr.Dataset) -> Figure:
    """``work``, ``kinetic_energy``, ``elastic_energy`` and ``dissipation`` (time) of a run.

    Below them is their imbalance, each in a unit of its own size; ``energy_error`` is stated where
    it is known.
    """
    figure = Figure(figsize=(8.4, 6.3))  # as wide as the names beside each other at any resolution
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(5, 2))
    factor, units = style.readable_units(*(dataset[name] for name in _LOOKS))
    for name, (colour, dashes) in _LOOKS.items():
        (line,) = upper.plot(dataset["time"], factor * dataset[name], color=colour)
        line.set(linestyle=dashes, label=dataset[name].attrs["long_name"])
    upper.margins(y=0.08)
    upper.set_ylabel(f"Energy ({units})")
    # Beside the curves: between them there need not be room.
    figure.legend(handles=upper.lines, loc="outside lower center", ncols=2)
    lack = imbalance(dataset)
    factor, units = style.readable_units(lack)
    lower.axhline(0.0, color=style.GREY, linewidth=0.7, zorder=1.2)
    lower.plot(lack["time"], factor * lack, color=style.PURPLE)
    lower.set_ylabel(f"Imbalance ({units})")
    if math.isfinite(error := float(dataset.get("energy_error", math.nan))):
        # The curve is of outputs, which lie between steps and are interpolated.
        lower.set_title(f"{style.label(dataset['energy_error'])}: {error:.1e} (at the steps)")
    style.time_axes(dataset, dataset["work"], upper, lower)
    style.head(figure, upper, dataset, "Energy")
    return figure


def imbalance(dataset: xr.Dataset) -> xr.DataArray:
    """Work - dissipation - kinetic - elastic energy since the start, (time,), J; ideally 0."""
    stored = dataset["kinetic_energy"] + dataset["elastic_energy"]
    lack = dataset["work"] - dataset["dissipation"] - stored
    first = lack.dropna("time")[:1].sum()
    return (lack - first).assign_attrs(units=dataset["work"].attrs["units"])


_TRIANGLE: dict[str, Any] = {
    "color": style.VERMILION, "markersize": 9, "markeredgecolor": "white", "clip_on": False,
    "zorder": 4,
}  # fmt: skip
_DOT: dict[str, Any] = {"color": style.INK, "markersize": 4, "clip_on": False}


@picture("run", 30, "Section by time: who is ahead", ("opening_angle", "asynchrony"), jointed)
def section_map(dataset: xr.Dataset) -> Figure:
    """Deviation of each ``opening_angle`` (plane, section, time) from the mean of all, as a colour.

    One axes a plane, one colour scale; dots are where V-joints lock, triangles the two that are
    farthest apart when ``asynchrony`` is largest, which may be between two records.
    """
    found = deviations(dataset).transpose("plane", "section", "time")
    sections, planes = found["section"].values, found["plane"].values.tolist()
    span = max(style.largest_magnitude(found), LEAST_SPAN)
    peak = peak_of(dataset, "asynchrony", "asynchrony_max", found["time"].values[-1])
    leader, laggard = apart(dataset, peak.time)
    locked = "lock_time" in dataset and bool(np.isfinite(dataset["lock_time"]).any())
    figure = Figure(figsize=(8.8, 2.7 * len(planes) + 0.9))
    grid = figure.subplots(len(planes), 1, sharex=True, squeeze=False)[:, 0]
    for axes, plane in zip(grid, planes, strict=True):
        image = style.lag_image(axes, found.sel(plane=plane), span)
        marks = [(leader, "^"), (laggard, "v")]
        for section, marker in ((one[1], marker) for one, marker in marks if one[0] == plane):
            axes.plot(peak.time, section, marker, **_TRIANGLE)
        locks = dataset["lock_time"].sel(plane=plane).dropna("section") if locked else found[:0]
        if locks.size:  # a line without points would stand in the corner of the sheet
            axes.plot(locks, locks["section"], "o", **_DOT)
        axes.yaxis.set_major_locator(MaxNLocator(10, integer=True, min_n_ticks=1))
        axes.set_ylim(sections[0] - 0.5, sections[-1] + 0.5)
        axes.set_ylabel(f"{plane} plane")
    style.time_axes(dataset, dataset["opening_angle"], *grid)
    label = style.label(found, width=34)
    figure.colorbar(image, ax=grid, pad=0.015, label=label).outline.set_visible(False)
    figure.supylabel(style.label(dataset["section"]), fontsize=10.5)
    size = with_unit(f"{peak.value:.3g}", str(found.attrs.get("units", "1")))
    words = {"^": f"leader at the largest asynchrony, {size}", "v": "laggard"}
    looks = [{"marker": marker, "label": word} | _TRIANGLE for marker, word in words.items()]
    looks += [{"marker": "o", "label": "locks"} | _DOT] if locked else []
    entries = [Line2D([], [], linestyle="none", **look) for look in looks]
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
    style.head(figure, grid[0], dataset, "Ahead and behind")
    return figure
