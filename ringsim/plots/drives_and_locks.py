"""Figures of a run's drive, motors, base and locks."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from ringsim.analysis.design import by_path
from ringsim.choice import kind_of
from ringsim.layout.layout import layout_of
from ringsim.layout.points import points_of
from ringsim.outputs.family import Array
from ringsim.plots import picture, style
from ringsim.plots.run import mark, peak_of
from ringsim.scene import Scene, scene_from_toml
from ringsim.tables import thousandths

_SOURCES = (
    style.SKY, style.ORANGE, style.GREEN, style.VERMILION, style.PURPLE, style.BLUE, style.GREY,
)  # fmt: skip
_HATCHES = ("", "//", "..", "\\\\", "xx", "--", "oo")


_FACTORED = (
    "with the factors of the standard and the pulleys' loss, which ringsim check --margin lists"
)


@picture("run", 110, "Drive and resistance", ("drive_margin", "opening_angle"))
def drive(dataset: xr.Dataset) -> Figure:
    """``drive_available``, ``drive_resistance`` and ``drive_margin`` (time) of a run, and
    ``least_drive_margin``.

    Drawn over the mean opening angle of all V-joints, as long as it grows; resistances that drive
    are left out.  The margin is that of a ring which opens as a whole, and ends where the last
    winch stops: see ``drive_end``.
    """
    stopped = float(drive_end(dataset))
    known = dataset.isel(time=np.flatnonzero(np.isfinite(dataset["drive_margin"].values)))
    angle = known["opening_angle"].mean(("plane", "section")).values
    grows = angle >= np.maximum.accumulate(angle)
    angle, known = angle[grows], known.isel(time=grows)
    figure = Figure(figsize=(8.0, 6.8))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(5, 3))
    every = known["resistance"].values.tolist()
    kinds = [k for k in every if (known["drive_resistance"].sel(resistance=k) > 0.0).any()]
    places = [every.index(k) for k in kinds]  # the same colour in all runs of a scene
    heights = [known["drive_resistance"].sel(resistance=k).clip(min=0.0) for k in kinds]
    if kinds:
        upper.stackplot(
            angle, *(each.values for each in heights), labels=kinds,
            colors=[_SOURCES[k % len(_SOURCES)] for k in places], alpha=0.7,
            hatch=[_HATCHES[k % len(_HATCHES)] for k in places], edgecolor=style.INK,
            linewidth=0.3,
        )  # fmt: skip
    upper.plot(
        angle, known["drive_available"], color=style.INK, label="drive without pulleys' loss"
    )
    upper.set_ylim(bottom=0.0)
    upper.set_ylabel(f"Force on the opening angle ({known['drive_available'].attrs['units']})")
    figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    margin = known["drive_margin"].where(known["time"] < stopped).values
    lower.plot(angle, margin, color=style.BLUE)
    lower.axhline(0.0, color=style.VERMILION, linewidth=1.0, linestyle=(0, (4, 3)))
    names = ("least_drive_margin_angle", "least_drive_margin")
    where, least = (float(dataset[name]) for name in names)
    told = []
    if np.isfinite(margin).any():
        lower.plot(where, least, "o", color=style.VERMILION, markersize=6, zorder=4)
        told = [f"least margin {thousandths(least)} at {where:.0f} deg"]
        # By as much as the summary of a run tells it.
        if (plane := float(dataset.get("least_plane_margin", np.nan))) < least - 5e-3:
            told[0] += f", of one plane's own cable {thousandths(plane)}"
    if (known["time"] >= stopped).any():
        told.append(f"no margin from {stopped:.4g} s on: all winches have stopped")
    words = "; ".join(told)  # inside it would lie on the curve
    # Above are the forces as computed: a drive far beyond all that resists would seem to have one.
    lower.set_title(f"{words}\n{_FACTORED}" if np.isfinite(margin).any() else words, fontsize=9.5)
    style.margin_axis(lower, margin, f"Margin by {standard_of(dataset)}")
    lower.set_xlabel("Mean opening angle (deg)")
    style.head(figure, upper, dataset, "Drive and resistance")
    return figure


def standard_of(dataset: xr.Dataset) -> str:
    """The name of the standard by which a scene has its margin, as ECSS-E-ST-33-01C."""
    margin = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene").margin
    return "the standard" if margin is None else kind_of(margin).upper()


def drive_end(dataset: xr.Dataset) -> Array:
    """When the last winch is switched off, s, () of a run, (sample,) of a campaign: nobody drives
    from then on, and there is no margin any more.  Infinity if one never is.

    Not of winches that stop because their plane has locked.
    """
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    drawn = {path: dataset[name].to_numpy() for path, name in by_path(dataset).items()
             if path.endswith("_time")}  # fmt: skip
    last = np.array(-np.inf)
    for plane, cable in [] if scene.cables is None else scene.cables.present():
        for key, winch in zip(("winch", "far_winch"), cable.winches, strict=False):
            own = "winch" if cable.far_winch is None else key
            path = f"cables.{scene.structure.planes[plane]}.{own}"
            begin, stop = (
                _seconds(drawn.get(f"{path}.{name}", np.array(str(getattr(winch, name)).lower())))
                for name in ("start_time", "stop_time")
            )
            # One that starts as it stops never turns.
            last = np.maximum(last, np.where(stop == begin, -np.inf, stop))
    return np.where(np.isfinite(last), last, np.inf)


def _seconds(values: Array) -> Array:
    """Times that may be "none"."""
    return np.where(values.astype(str) == "none", "inf", values.astype(str)).astype(float)


_MOTOR = ("motor_current", "motor_torque", "motor_speed", "motor_power")
_DASHES = ("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (6, 1.5, 1, 1.5)))


@picture(
    "run", 115, "Torque, speed and power of the motors over time", ("motor_torque", "motor_speed")
)
def motors(dataset: xr.Dataset) -> Figure:
    """A panel for each of ``motor_torque``, ``motor_speed``, ``motor_power`` and, where it is
    known, ``motor_current`` (plane, winch, time); a line a motor as recorded, a dot at the largest
    value of all steps, which may lie between two records.
    """
    names = [name for name in _MOTOR if name in dataset and np.isfinite(dataset[name]).any()]
    figure = Figure(figsize=(8.4, 1.9 * len(names) + 1.3))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    there = np.isfinite(dataset["motor_torque"].transpose("plane", "winch", "time").to_numpy())
    places = np.argwhere(there.any(axis=-1)).tolist()
    for axes, name in zip(panels, names, strict=True):
        peak = None
        if f"peak_{name}" in dataset:  # not of the speed
            peak = peak_of(dataset, name, f"peak_{name}")
        for number, (plane, winch) in enumerate(places):
            values = dataset[name].isel(plane=plane, winch=winch)
            called = f"{values['plane'].item()} cable"
            called += f", winch {values['winch'].item()}" if dataset.sizes["winch"] > 1 else ""
            axes.plot(values["time"], values, label=called,
                      color=_LINES[number % len(_LINES)],
                      linestyle=_DASHES[number % len(_DASHES)])  # fmt: skip
        axes.set_ylabel(style.label(dataset[name], width=24), fontsize=9)
        axes.margins(y=0.12)
        if peak is not None:
            mark(axes, peak, str(dataset[name].attrs["units"]), f"{peak.place['plane']} cable",
                 curve=dataset[name].sel(peak.place))  # fmt: skip
    figure.align_ylabels(panels)
    style.time_axes(dataset, dataset["motor_torque"].max(("plane", "winch")), *panels)
    handles, words = panels[0].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=len(words))
    style.head(figure, panels[0], dataset, "Motors")
    return figure


def _moves(dataset: xr.Dataset) -> bool:
    if "base_rotation" not in dataset:
        return False
    return style.largest_magnitude(dataset["base_rotation"]) > _STILL


_STILL = 1e-6
"""Turn of a base that is none, degree."""
_LOADS = ("base_force", "base_torque")


def _loads(dataset: xr.Dataset) -> list[xr.DataArray]:
    return [dataset[name] for name in _LOADS
            if name in dataset and np.isfinite(dataset[name]).any()]  # fmt: skip


@picture(
    "run", 118, "Attitude and place of the base, force and torque on it",
    applies=lambda dataset: _moves(dataset) or bool(_loads(dataset)),
)  # fmt: skip
def base(dataset: xr.Dataset) -> Figure:
    """Of a base that moves ``base_rotation`` (axis, time), of a spacecraft ``base_rate``, too, and,
    where positions are recorded, how far the boom's upper end has moved since the start;
    ``base_force`` and ``base_torque`` where they are recorded.  A line an axis; of loads also their
    magnitude, a dot at its largest value of all steps, which is a point of that curve alone.
    """
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    shown, told, body = [], list[str](), "base"
    if _moves(dataset):
        words = "rotation vector since the start"
        shown, told = [dataset["base_rotation"].assign_attrs(long_name=words)], ["attitude"]
        body = "spacecraft" if scene.spacecraft is not None else "free base"
        if "base_rate" in dataset:
            shown.append(dataset["base_rate"].assign_attrs(long_name="angular velocity"))
            told.append("rate")
        if "position" in dataset:
            shown.append(_way(dataset, scene))
            told.append("place")
    loads = _loads(dataset)
    shown += loads
    told += [str(each.name).removeprefix("base_") for each in loads]
    figure = Figure(figsize=(8.4, 2.5 * len(shown) + 1.3))
    panels = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    for axes, values in zip(panels, shown, strict=True):
        looks = zip(values["axis"].values, _LINES, _DASHES, strict=False)
        for axis, colour, dashes in looks:
            axes.plot(values["time"], values.sel(axis=axis), color=colour, linestyle=dashes,
                      label=f"{axis} axis")  # fmt: skip
        axes.set_ylabel(style.label(values, width=30), fontsize=9)
        axes.margins(y=0.12)
        if values.name in (*_LOADS, "base_rate"):
            # Of readings at output times; the shock of a lock lies between two of them.
            size = (values**2).sum("axis", skipna=False) ** 0.5
            largest = f"peak_{values.name}" if values.name in _LOADS else "base_rate_max"
            peak = peak_of(dataset.assign(size=size), "size", largest)
            axes.plot(*peak.within(size), color=style.GREY, linewidth=0.9, zorder=1.5,
                      label="magnitude")  # fmt: skip
            mark(axes, peak, str(values.attrs["units"]), "", curve=size)
    figure.align_ylabels(panels)
    style.time_axes(dataset, shown[0], *panels)
    handles, words = panels[-1].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=len(words))
    subject = " and ".join(filter(None, [", ".join(told[:-1]), told[-1]]))
    style.head(figure, panels[0], dataset, f"{subject.capitalize()} of the {body}")
    return figure


def _way(dataset: xr.Dataset, scene: Scene) -> xr.DataArray:
    """How far the boom's upper end has moved since the start, (axis, time), m."""
    layout = layout_of(scene)
    assert layout.base is not None
    points = points_of(layout, scene.structure.planes)
    place = dataset["position"].sel(point=points.names[points.of_body(layout.base)])
    words = "way of the boom's upper end since the start"
    return (place - place.isel(time=0)).assign_attrs(units="m", long_name=words)


_LINES = (style.BLUE, style.ORANGE, style.GREEN, style.PURPLE)
_LOCKS = ("lock_time", "latch_rate", "lock_impulse")
LEAST: dict[str, Any] = {"color": style.INK, "linewidth": 1.2, "linestyle": (0, (1.5, 1.5))}
"""Look of the least rate at which latches catch, which nobody requires: limits are dashed."""
_BESIDE = 0.12
"""Half the distance of the marks of two planes, which mostly lock alike, in sections."""
_MARKS = (("o", style.BLUE), ("D", style.ORANGE), ("s", style.GREEN))


@picture("run", 35, "When and how hard each V-joint locks", ("lock_time",))
def locks(dataset: xr.Dataset) -> Figure:
    """A panel for ``lock_time`` and, where they are known, ``latch_rate`` and ``lock_impulse``
    (plane, section); a mark a V-joint.  A dotted line is the least rate at which a latch catches.
    """
    names = [name for name in _LOCKS if name in dataset and np.isfinite(dataset[name]).any()]
    figure = Figure(figsize=(8.4, 2.1 * len(names) + 1.3))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    sections, planes = dataset["section"].values, dataset["plane"].values.tolist()
    for axes, name in zip(panels, names, strict=True):
        for number, (plane, (marker, colour)) in enumerate(zip(planes, _MARKS, strict=False)):
            values = dataset[name].sel(plane=plane).values
            beside = _BESIDE * (2.0 * number - len(planes) + 1.0)
            axes.plot(sections + beside, values, marker, color=colour, markersize=5, alpha=0.85)
        about = dataset[name].assign_attrs(long_name=_SAID[name])
        axes.set_ylabel(style.label(about, width=20), fontsize=9)
        axes.margins(y=0.15)
        if name != "lock_time":
            style.from_zero(axes)
    entries = [
        Line2D([], [], linestyle="none", marker=marker, color=colour, label=f"{plane} plane")
        for plane, (marker, colour) in zip(planes, _MARKS, strict=False)
    ]
    least = least_rate(dataset)
    if "latch_rate" in names and least > 0.0:
        axes = panels[names.index("latch_rate")]
        axes.axhline(least, **LEAST)
        entries.append(Line2D([], [], label=f"latches catch from {least:g} rad/s on", **LEAST))
    figure.align_ylabels(panels)
    panels[-1].xaxis.set_major_locator(MaxNLocator(20, integer=True, min_n_ticks=1))
    panels[-1].set_xlim(sections[0] - 0.6, sections[-1] + 0.6)
    panels[-1].set_xlabel(style.label(dataset["section"]))
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
    style.head(figure, panels[0], dataset, "Locks")
    return figure


_SAID = {
    "lock_time": "time of the lock", "latch_rate": "opening rate at the latch",
    "lock_impulse": "impulse of the stop",
}  # fmt: skip


def least_rate(dataset: xr.Dataset) -> float:
    """The opening rate at which latches catch, rad/s; NaN where they differ, or are not known."""
    if not dataset.attrs.get("scene"):
        return np.nan
    latch = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene").latch
    rates = np.unique([] if latch is None else latch.min_rate)
    return float(rates[0]) if len(rates) == 1 else np.nan
