"""The structure in space: stowed, half-way and deployed."""

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray
from scipy.constants import kilogram_force
from scipy.spatial.transform import Rotation

from ringsim.layout.layout import layout_of
from ringsim.layout.points import Points, points_of
from ringsim.plots import jointed, picture, style
from ringsim.plots.run import Peak, peak_of
from ringsim.scene import Scene, scene_from_toml
from ringsim.shapes import Shape, Track, places_at, shape_of
from ringsim.tables import unit_text

Array = NDArray[np.float64]

_ELEVATION = 24.0
_WIDTH, _HIGHEST, _SIDE, _GAP = 10.6, 4.6, 0.3, 0.35
_BELOW, _ABOVE, _BAR, _CAPTION = 1.2, 1.12, 0.46, 2.4
"""Room on the sheet, in inch: the drawing; beside, below and above it; a caption's width."""
_MOST_ENTRIES, _ROW = 7, 0.22
"""Of a row of the legend; its height in inch."""
_FADE = 0.6
"""Share of white in the farthest line."""
_POINT = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1e-3]])
"""Ends of the line, m, that stands for a point: one without a length is not drawn."""
LOOKS: dict[str, dict[str, Any]] = {
    "diagonals": {"color": style.BLUE, "linewidth": 1.5},
    "bars": {"color": style.VERMILION, "linewidth": 1.5, "label": "folding bars"},
    "hinge assemblies": {"color": style.INK, "linewidth": 3.0},
    "boom": {"color": style.GREY, "linewidth": 5.0},
    "spacecraft": {"color": style.PURPLE, "linewidth": 11.0, "marker": "o"},
    "from the boom's upper end to it": {"color": style.PURPLE, "linewidth": 2.0},
    "V-joints, locked": {"color": style.INK, "linewidth": 5.0, "marker": "o"},
    "V-joints, free": {"color": style.ORANGE, "linewidth": 5.0, "marker": "o"},
    "net, taut": {"color": style.GREEN, "linewidth": 0.9},
    "net, slack": {"color": style.GREEN, "linewidth": 0.9, "linestyle": (0, (1.5, 2.5))},
}
OTHER: dict[str, Any] = {"color": style.GREY, "linewidth": 1.2}
"""Parts of structures that have more than the ring."""


@picture("run", 50, "The structure stowed, half-way and deployed", ("opening_angle",), jointed)
def ring(dataset: xr.Dataset, states: int = 3) -> Figure:
    """Instants of a run side by side, all to one scale, with a scale bar in metre.

    Orthographic views in which nearer lines are darker.  ``dataset`` is a run with
    ``opening_angle`` (plane, section, time), its scene as TOML in the attribute ``scene``; where it
    has ``position`` (point, axis, time) this is drawn.  ``states`` is the number of instants, as
    for :func:`instants`; four are those of paper 002, fig. 9.
    """
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    azimuth = facing_azimuth(scene)
    moments = instants(dataset, states)
    shape = shape_of(dataset, scene)
    shots = [
        _shot(shape, angles, _locked(dataset, angles), azimuth, _turn(dataset, angles))
        for _, angles in moments
    ]
    drawn = {name for names, _, _ in shots for name in names}
    known = LOOKS | dict.fromkeys(sorted(drawn - LOOKS.keys()), OTHER)
    looks = [{"label": name} | look for name, look in known.items() if name in drawn]
    looks = [look | {"linestyle": "none"} if "marker" in look else look for look in looks]
    entries = [Line2D([], [], **look) for look in looks]
    rows = -(-len(entries) // _MOST_ENTRIES)
    below = _BELOW + _ROW * (rows - 1)
    low = np.array([lines.min(axis=(0, 1)) for _, lines, _ in shots])
    sizes = np.array([lines.max(axis=(0, 1)) for _, lines, _ in shots]) - low
    height = float(sizes[:, 1].max())
    scale, cells = _fit(sizes[:, 0], height)
    turns = any(_turn(dataset, angles).any() for _, angles in moments)
    subject = f"Deployment{', seen from the base' * turns}"  # whose turn angles alone do not show
    subject = "Deployment as computed" if shape.computed else subject
    wide, high = _WIDTH + 2 * _SIDE, below + height * scale + _ABOVE
    high += style.further_lines(dataset, subject, wide)
    figure = Figure(figsize=(wide, high))
    figure.set_layout_engine("none")
    # Axes in metre whose frame is the drawing, between room for words above and below.
    axes = figure.add_axes((_SIDE / wide, below / high, _WIDTH / wide, height * scale / high))
    axes.set_axis_off()
    axes.set(aspect="equal", xlim=(0.0, _WIDTH / scale), ylim=(0.0, height))
    middles = (np.cumsum(cells + _GAP) - 0.5 * cells - _GAP) / scale
    lefts = np.column_stack([middles - 0.5 * sizes[:, 0], np.zeros(len(shots))])
    for number, (names, lines, near) in enumerate(shots):
        _draw(axes, names, lines + (lefts - low)[number], near, scale)
        _caption(axes, middles[number], *moments[number])
    _scale_bar(axes, _WIDTH / scale, height)
    figure.legend(handles=entries, loc="lower center", ncols=-(-len(entries) // rows))
    style.head(figure, axes, dataset, subject, pad=72.0 * _BAR)
    return figure


def lines_at(scene: Scene, openings: Array) -> dict[str, Array]:
    """Lines of a scene at opening angles in rad, shape (planes, sections): see ``Points.drawn``."""
    points = points_of(layout_of(scene))
    shape = Shape(scene, points, computed=False, track=Track(np.zeros(1), openings[None]))
    return shape.lines(places_at(scene, points, openings))


def facing_azimuth(scene: Scene) -> float:
    """Direction to look from, degree: the boom to the left in front; an arc from outside."""
    outward = np.mean([rod.start.axes[:, 2] for rod in layout_of(scene).rods], axis=0)
    if scene.structure.closed or np.hypot(*outward[:2]) < 1e-6:
        return 42.0
    return float(np.degrees(np.arctan2(outward[1], outward[0]))) + 35.0


def view(points: Array, azimuth: float, elevation: float) -> tuple[Array, Array]:
    """Orthographic projection for a far observer, true to scale.

    ``points`` are positions, shape (..., 3), m, z up; the observer stands at ``azimuth`` (from +x
    towards +y) and ``elevation`` (above the horizon), degree.  Returns right and up on the paper,
    shape (..., 2), and nearness to the observer, shape (...,), m.
    """
    a, e = np.radians([azimuth, elevation])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    up = np.cross(towards, right)
    return points @ np.stack([right, up], axis=-1), points @ towards


def instants(dataset: xr.Dataset, states: int = 3) -> list[tuple[str, xr.DataArray]]:
    """Name and opening angles (plane, section) of the recorded instants to draw, at least two.

    The first, those whose mean opening angles are nearest to equal steps between the ends, and the
    deployment, or else the last.  ValueError for fewer than two.
    """
    if states < 2:
        raise ValueError(f"states = {states} must be at least 2: the start and the end")
    angle = dataset["opening_angle"].dropna("time", how="any")
    mean = angle.mean(("plane", "section")).values
    deployed = style.deployment_time(dataset)
    done = math.isfinite(deployed)
    last = int(np.abs(angle["time"].values - deployed).argmin()) if done else len(mean) - 1
    wanted = np.linspace(mean[0], mean[last], states)[1:-1]
    between = [int(np.abs(mean[: last + 1] - each).argmin()) for each in wanted]
    opens = mean[last] >= mean[0]
    names = ["half-way"] if states == 3 else [f"stage {k}" for k in range(1, states - 1)]
    names = ["stowed" if opens else "start", *names, "deployed" if done else "end of the run"]
    angles = [angle.isel(time=k) for k in (0, *between, last)]
    if done:
        angles[-1] = _at_deployment(dataset, angle, deployed)
    return list(zip(names, angles, strict=True))


def _at_deployment(dataset: xr.Dataset, angle: xr.DataArray, moment: float) -> xr.DataArray:
    """Opening angles (plane, section) at a moment in s: between records, and 180 deg at a lock."""
    found, times = angle.isel(time=0).copy(deep=True), angle["time"].values
    for number, lock in np.ndenumerate(dataset["lock_time"].transpose(*found.dims).values):
        at = int(np.searchsorted(times, lock))
        course = np.insert(angle.transpose(*found.dims, "time").values[number], at, 180.0)
        found.values[number] = np.interp(moment, np.insert(times, at, lock), course)
    return found.assign_coords(time=angle["time"][0].copy(data=moment))


def _locked(dataset: xr.Dataset, angles: xr.DataArray) -> NDArray[np.bool_]:
    """Which V-joints have locked by the time of some angles, shape (planes, sections)."""
    if "lock_time" not in dataset:
        return np.zeros((dataset.sizes["plane"], dataset.sizes["section"]), dtype=bool)
    locks = dataset["lock_time"].transpose("plane", "section").values
    return np.asarray(locks <= float(angles["time"]))


def _turn(dataset: xr.Dataset, angles: xr.DataArray) -> Array:
    """How the base has turned by the time of some angles: a rotation vector, rad."""
    if "base_rotation" not in dataset or not np.isfinite(dataset["base_rotation"]).any():
        return np.zeros(3)
    known = dataset["base_rotation"].transpose("time", "axis").dropna("time")
    rows, times = np.radians(known.values), known["time"].values
    return np.array([np.interp(float(angles["time"]), times, row) for row in rows.T])


def _fit(widths: Array, height: float) -> tuple[float, Array]:
    """Scale (inch a metre) and widths of the columns (inch): each holds its caption too."""
    room = _WIDTH - _GAP * (len(widths) - 1)
    narrow = np.zeros(len(widths), dtype=bool)
    scale = room / widths.sum()
    for _ in widths:
        narrow |= widths * scale < _CAPTION
        if narrow.all():
            break
        scale = (room - _CAPTION * narrow.sum()) / widths[~narrow].sum()
    scale = min(float(scale), _HIGHEST / height)
    cells = np.maximum(widths * scale, _CAPTION)
    return scale, cells + (room - cells.sum()) / len(cells)


def _caption(axes: Axes, middle: float, name: str, angles: xr.DataArray) -> None:
    time = angles["time"]
    numbers = (
        f"{float(time):.2f} {time.attrs['units']}\n"
        f"mean opening angle {float(angles.mean()):.1f} {unit_text(angles.attrs['units'])}"
    )
    for text, drop, weight in ((name, 12, "bold"), (numbers, 28, "normal")):
        axes.annotate(
            text, (middle, 0.0), xytext=(0, -drop), textcoords="offset points", ha="center",
            va="top", weight=weight, linespacing=1.4,
        )  # fmt: skip


def _shot(
    shape: Shape, angles: xr.DataArray, locked: NDArray[np.bool_], azimuth: float, turn: Array
) -> tuple[list[str], Array, Array]:
    """Parts, ends on the paper and nearness of all lines at one instant, the farthest first."""
    openings = np.radians(angles.transpose("plane", "section").values)
    places = (
        shape.at(float(angles["time"])) if shape.computed
        else places_at(shape.scene, shape.points, openings)
    )  # fmt: skip
    turned = turn * shape.computed
    parts = shape.lines(places) | _spacecraft(shape.scene, shape.points, places, turned)
    joints = parts.pop("V-joints") + _POINT
    for name, own in (("V-joints, locked", locked.ravel()), ("V-joints, free", ~locked.ravel())):
        parts |= {name: joints[own]} if own.any() else {}
    names = [name for name, ends in parts.items() for _ in ends]
    lines, depths = view(np.concatenate(list(parts.values())), azimuth, _ELEVATION)
    near = depths.mean(axis=-1)
    # A joint stands before the rods that it joins.
    near += [1e-6 * name.startswith("V-joints") for name in names]
    order = np.argsort(near, kind="stable")
    return [names[k] for k in order], lines[order], near[order]


def _spacecraft(scene: Scene, points: Points, places: Array, turn: Array) -> dict[str, Array]:
    """Where the spacecraft's centre of mass is, as a point, and the line that leads to it from the
    boom's upper end, which it is fixed to, and has turned with by the rotation vector ``turn``,
    rad.
    """
    craft, base = scene.spacecraft, layout_of(scene).base
    if craft is None or base is None:
        return {}
    top = places[points.of_body(base)]
    centre = top + Rotation.from_rotvec(turn).apply(np.array(craft.centre))
    found = {"spacecraft": (centre + _POINT)[None]}
    if any(craft.centre):
        found["from the boom's upper end to it"] = np.array([[top, centre]])
    return found


def _draw(axes: Axes, names: list[str], lines: Array, near: Array, scale: float) -> None:
    """Lines, the far ones paler; thinner where a metre is short."""
    thin = float(np.clip(scale / 1.3, 0.45, 1.0))
    looks = [LOOKS.get(name, OTHER) for name in names]
    depth = max(float(np.ptp(near)), 0.8 * float(np.ptp(lines[..., 0])))
    fade = (_FADE * (near.max() - near) / depth)[:, None]
    colours = np.array([to_rgb(look["color"]) for look in looks])
    drawn = LineCollection(
        list(lines), colors=colours + fade * (1.0 - colours), capstyle="round",
        linewidths=[thin * look["linewidth"] for look in looks],
        linestyles=[look.get("linestyle", "solid") for look in looks], clip_on=False,
        snap=False,
    )  # fmt: skip
    axes.add_collection(drawn, autolim=False)


def _scale_bar(axes: Axes, length: float, top: float) -> None:
    raw, above = 0.12 * length, top + 0.08 * length / _WIDTH
    power = 10.0 ** math.floor(math.log10(raw))
    metres = power * max(step for step in (1, 2, 5) if step * power <= raw)
    axes.plot(
        [0.0, metres], [above, above], color=style.INK, linewidth=2.5, solid_capstyle="butt",
        clip_on=False,
    )  # fmt: skip
    axes.annotate(
        f"{metres:g} m", (0.5 * metres, above), xytext=(0, 4), textcoords="offset points",
        ha="center", va="bottom", annotation_clip=False,
    )  # fmt: skip


# Natural frequencies along the opening, and shapes at the last angle.


_SHAPES, _BENT = 4, 0.14
"""Shapes that are drawn at most; their largest displacement over the size of the ring."""


@style.styled
def modes(found: xr.Dataset) -> Figure:
    """Frequencies over the opening angle, and the first shapes at the last angle, enlarged.

    ``found`` is from ``ringsim.vibration.modes``.  What is unstable is marked at zero.
    """
    scene = scene_from_toml(str(found.attrs["scene"]), source="attribute scene")
    count = min(_SHAPES, found.sizes["mode"])
    figure = Figure(figsize=(10.2, 6.3))
    # By hand: panels of equal scales leave matplotlib's layout no height for the others.
    figure.set_layout_engine("none")
    grid = figure.add_gridspec(
        2, count, height_ratios=(1.0, 0.62),
        left=0.07, right=0.98, bottom=0.05, top=0.86, hspace=0.48, wspace=0.15,
    )  # fmt: skip
    axes = figure.add_subplot(grid[0, :])
    colours = style.section_colours(found.sizes["mode"])
    latched = found["latched"].values == 1
    for k, mode in enumerate(found["mode"].values):
        each = found["frequency"].sel(mode=mode)
        # Held V-joints make another structure: no line leads there.
        for held, face in ((False, colours(k)), (True, "white")):
            axes.plot(
                found["angle"],
                each.where(latched == held),
                "o-",
                color=colours(k),
                markerfacecolor=face,
                markersize=4.5,
                label="_" if held else f"mode {mode}",
            )
    if latched.any():
        axes.plot([], [], "o", color=style.INK, markerfacecolor="white", label="V-joints latched")
    lost = found["angle"].values[(found["growth_rate"] > 0.0).any("mode").values]
    axes.plot(lost, np.zeros(len(lost)), "X", color=style.VERMILION, clip_on=False, zorder=4,
              label="unstable" if len(lost) else "_")  # fmt: skip
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel(style.label(found["angle"]))
    axes.set_ylabel("Natural frequency (Hz)")
    named = len(axes.get_legend_handles_labels()[1])
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=min(named, 9), fontsize=8)
    last, azimuth = found.isel(angle=-1), facing_azimuth(scene)
    points = points_of(layout_of(scene), scene.structure.planes)
    rest = last["position"].transpose("point", "axis").values
    size = float(np.ptp(rest, axis=0).max())
    for k in range(count):
        own = last.isel(mode=k)
        moved = rest + _BENT * size * own["shape"].transpose("point", "axis").values
        panel = figure.add_subplot(grid[1, k])
        panel.set_axis_off()
        for places, there in ((rest, False), (moved, True)):
            parts = {n: ends for n, ends in points.drawn(places).items() if n != "V-joints"}
            # Shapes have ways and no turns: the centre goes as far as the boom's upper end.
            parts |= _spacecraft(scene, points, places, np.zeros(3))
            names = [name for name, ends in parts.items() for _ in ends]
            lines, depths = view(np.concatenate(list(parts.values())), azimuth, _ELEVATION)
            order = np.argsort(near := depths.mean(axis=-1), kind="stable")
            if there:
                _draw(panel, [names[n] for n in order], lines[order], near[order], 0.8)
                panel.update_datalim(lines.reshape(-1, 2))  # room below the words above
            else:
                panel.add_collection(LineCollection(list(lines), colors=style.PALE, linewidths=0.8))
        panel.set_aspect("equal")
        panel.autoscale_view()
        hertz = own["frequency"].item()
        told = "unstable" if math.isnan(hertz) else f"{hertz:.4g} Hz"
        part = str(found["part"].values[int(np.abs(own["energy_share"].values).argmax())])
        panel.set_title(f"mode {k + 1}: {told}\n{part}", fontsize=9)
    joints = "latched" if last["latched"] else "free"
    craft = "; dot: the spacecraft's centre of mass" if scene.spacecraft is not None else ""
    figure.text(0.01, 0.005, f"shapes at {last['angle'].item():.4g} deg, V-joints {joints}; the "
                f"largest displacement is drawn as {_BENT * size:.3g} m, {100 * _BENT:g} % of the "
                f"structure's size{craft}",
                fontsize=8, color=style.GREY)  # fmt: skip
    style.title(figure, str(found.attrs["title"]))
    return figure


# A planar truss over the length of its driving cable: tension, and strain of the upper beam.


_PASSAGES = (("reeled in", style.BLUE, "-"), ("reeled out", style.ORANGE, (0, (5, 1.5))))
_SHOWN = (0.1, 0.3, 0.5, 0.7, 0.9)
"""Shares of the cable's longest length at which the strain is drawn along the beam."""


@picture("run", 90, "Tension along the cables", ("cable_tension", "cable_length"), name="tension")
def tension_over_length(dataset: xr.Dataset) -> Figure:
    """``cable_tension`` (plane, span, time) over ``cable_length`` (plane, time).

    As paper 001's fig. 8: in N and kgf, of the span whose length changes, while reeled in and out.
    """
    tension = dataset["cable_tension"].isel(plane=0, span=-1)
    figure = Figure(figsize=(8.0, 4.8))
    axes = figure.subplots()
    parts = zip(_split(dataset, tension), _PASSAGES, strict=True)
    for (lengths, values), (name, colour, dashes) in parts:
        axes.plot(lengths, values, color=colour, linestyle=dashes, label=name)
    top = peak_of(dataset, "cable_tension", "peak_tension")
    _mark(axes, dataset, top, str(tension.attrs["units"]))
    _length_axis(axes, dataset)
    axes.set_ylim(0.0, 1.12 * (peak := top.value))
    axes.set_ylabel(style.label(tension))
    both_ways = (lambda n: np.divide(n, kilogram_force), lambda w: np.multiply(w, kilogram_force))
    weight = axes.secondary_yaxis("right", functions=both_ways)
    weight.set_ylabel("Tension (kgf)")
    weight.spines["right"].set_visible(True)
    weight.yaxis.set_major_locator(MultipleLocator(0.5))
    length = 1e3 * dataset["cable_length"].isel(plane=0)
    if float(tension.isel(time=int(np.nanargmin(length.values)))) >= 0.9 * peak:
        axes.annotate(
            "contraction ends:\nwinding only stretches\nthe cable",
            (float(length.min()), 0.9 * peak), xytext=(10, 0), textcoords="offset points",
            va="center", color=style.GREY, bbox=style.PAPER,
        )  # fmt: skip
    axes.legend(loc="upper right")
    style.head(figure, axes, dataset, "Cable tension")
    return figure


@picture("run", 100, "Bending strain", ("bending_strain", "cable_length"), name="bending_strain")
def strain_over_length(dataset: xr.Dataset) -> Figure:
    """``bending_strain`` (station, time) of the upper beam, as paper 001's fig. 9.

    Left over ``cable_length`` (plane, time), at the station with the largest strain and in the
    middle of the beam; right along the beam at some lengths while reeled in.
    """
    strain = dataset["bending_strain"]
    figure = Figure(figsize=(11.0, 4.8))
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(3, 2))
    station = strain["station"].values
    middle = int(np.abs(station - 0.5 * (station[0] + station[-1])).argmin())
    largest = int(np.nanargmax(strain.max("time").values))
    passages = list(zip(_split(dataset, strain), _PASSAGES, strict=True))
    for place, colour in {largest: style.VERMILION, middle: style.GREEN}.items():
        for (lengths, values), (_, _, dashes) in passages:
            left.plot(lengths, values.isel(station=place), color=colour, linestyle=dashes)
        left.plot([], [], color=colour, label=f"{1e3 * station[place]:.0f} mm along the beam")
    for name, _, dashes in _PASSAGES:
        left.plot([], [], color=style.GREY, linestyle=dashes, label=name)
    _mark(left, dataset, peak_of(dataset, "bending_strain", "peak_bending_strain"), "")
    _length_axis(left, dataset)
    left.set_ylabel(style.label(strain))
    left.set_ylim(0.0, 1.35 * float(strain.max()))
    left.legend(loc="upper left", ncols=2)
    left.ticklabel_format(axis="y", scilimits=(0, 0), useMathText=True)
    _draw_along(right, *passages[0][0])
    style.head(figure, left, dataset, "Bending of the upper beam", pad=18.0)
    return figure


def _draw_along(axes: Axes, lengths: xr.DataArray, strain: xr.DataArray) -> None:
    colours = style.section_colours(len(_SHOWN))
    for number, share in enumerate(_SHOWN):
        wanted = share / _SHOWN[-1] * float(lengths.max())
        moment = int(np.abs(lengths.values - wanted).argmin())
        axes.plot(
            1e3 * strain["station"], strain.isel(time=moment), "o-", markersize=3.5,
            color=colours(number), label=f"{float(lengths[moment]):.0f} mm of cable",
        )  # fmt: skip
    axes.set_xlim(left=0.0)
    axes.set_xlabel(style.label(strain["station"], "mm", width=40))
    axes.legend(loc="upper left")


def _mark(axes: Axes, dataset: xr.Dataset, peak: Peak, units: str) -> None:
    """A dot at the largest value, at the cable's length at that time."""
    lengths = 1e3 * dataset["cable_length"].isel(plane=0).dropna("time")
    axes.plot(
        np.interp(peak.time, lengths["time"], lengths), peak.value, "o", color=style.VERMILION,
        label=f"largest: {peak.value:.3g} {units}".rstrip(), clip_on=False, zorder=4,
    )  # fmt: skip


def _split(dataset: xr.Dataset, values: xr.DataArray) -> list[tuple[xr.DataArray, xr.DataArray]]:
    """Cable lengths in mm and values until most rope was wound, and from then on."""
    wound = dataset["wound_length"].isel(plane=0).dropna("time")
    lengths, turn = 1e3 * dataset["cable_length"].isel(plane=0), wound.idxmax("time").item()
    passages = (wound.time.sel(time=part) for part in (slice(None, turn), slice(turn, None)))
    return [(lengths.sel(time=times), values.sel(time=times)) for times in passages]


def _length_axis(axes: Axes, dataset: xr.Dataset) -> None:
    axes.set_xlim(0.0, 1100.0 * float(dataset["cable_length"].max()))
    axes.set_xlabel(style.label(dataset["cable_length"], "mm"))
