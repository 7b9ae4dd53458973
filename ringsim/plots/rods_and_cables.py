"""Figures of a run's rods, cables, pulleys and drive."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ringsim.cable.records import Cable
from ringsim.layout.bodies import JointOpening, OnRod
from ringsim.layout.layout import layout_of
from ringsim.plots import barred, jointed, picture, style
from ringsim.plots.run import mark, peak_of
from ringsim.scene import Scene, scene_from_toml

_LOOKS: tuple[tuple[str, Any], ...] = (
    (style.INK, "-"), ("#d00000", (0, (5, 1.5))), (style.BLUE, (0, (1.2, 1.2))),
    (style.GREEN, (0, (6, 1.5, 1, 1.5))), (style.ORANGE, (0, (2.5, 1.5))),
    (style.PURPLE, (0, (6, 1.5, 1, 1.5, 1, 1.5))),
)  # fmt: skip
"""Colour and dashes of a section; dashes tell them apart in grey."""
_HALVES = {"left": 1.8, "right": 0.8}
"""Width of the line of a half."""
_LARGEST: dict[str, Any] = {
    "color": style.VERMILION, "linewidth": 1.0, "linestyle": (0, (8, 1.5, 1, 1.5)),
}  # fmt: skip


@picture("run", 40, "Stress in the rods over time", ("rod_stress",), jointed)
def rod_stress(dataset: xr.Dataset, sections: Sequence[int] | None = None) -> Figure:
    """``rod_stress`` (rod, section, time), one axes a rod; its halves as in paper 002, figs 11-13.

    Bands reach from the least to the largest of all sections, wide lines are left halves, narrow
    ones right halves.  The half with ``peak_rod_stress`` is drawn whatever its section.
    ``sections`` are at most six section numbers, by default :func:`default_sections`.

    Raises
    ------
    ValueError
        If the run has no such section, or for more than six.
    """
    chosen = default_sections(dataset.sizes["section"]) if sections is None else tuple(sections)
    missing = set(chosen) - set(dataset["section"].values.tolist())
    if missing or not 0 < len(chosen) <= len(_LOOKS):
        raise ValueError(
            f"sections = {list(chosen)} must be one to {len(_LOOKS)} of the sections "
            f"1..{dataset.sizes['section']}"
        )
    stress = dataset["rod_stress"]
    factor, units = style.readable_units(stress, dataset.get("peak_rod_stress", stress))
    peak = peak_of(dataset, "rod_stress", "peak_rod_stress", stem="peak_stress")
    rods = list(dict.fromkeys(rod.rpartition("_")[0] for rod in stress["rod"].values.tolist()))
    figure = Figure(figsize=(11.0, 2.7 * -(-len(rods) // 2) + 1.1))
    grid = figure.subplots(-(-len(rods) // 2), 2, sharex=True, sharey=True)
    looks = list(zip(chosen, _LOOKS, strict=False))
    style.time_axes(dataset, stress.max("section"), *grid[:, 0])
    style.time_axes(dataset, stress.max("section"), *grid[:, 1], named=False)
    limit = style.limit_of(dataset, "rod_stress")
    style.span_sizes(grid[0, 0], factor * np.append(stress.values, [peak.value, limit]))
    for axes, rod in zip(grid.flat, rods, strict=False):
        halves = factor * stress.sel(rod=stress["rod"].str.startswith(f"{rod}_"))
        least, most = (reduced(("rod", "section")) for reduced in (halves.min, halves.max))
        axes.fill_between(halves["time"], least, most, color=style.PALE, linewidth=0.0)
        for section, (colour, dashes) in looks:
            for half, width in _HALVES.items():
                values = halves.sel(rod=f"{rod}_{half}", section=section)
                axes.plot(values["time"], values, color=colour, linestyle=dashes, linewidth=width)
        name = " ".join(reversed(rod.split("_")))
        style.name_panel(axes, name)
        style.draw_limit([axes], factor * limit, f"limits.rod_stress = {factor * limit:g} {units}")
        if peak.place["rod"].startswith(f"{rod}_"):
            worst = stress.sel(peak.place)
            axes.plot(worst["time"], factor * worst, zorder=3, **_LARGEST)
            half = peak.place["rod"].rpartition("_")[-1]
            place = f"section {peak.place['section']}, {name}, {half} half"
            mark(axes, peak, units, place, factor, worst)
    figure.supylabel(style.label(stress, units), fontsize=10.5)
    entries = [
        Line2D([], [], color=colour, linestyle=dashes, label=f"section {n}")
        for n, (colour, dashes) in looks
    ]
    entries += [
        Line2D([], [], color=style.GREY, linewidth=width, label=f"{half} half")
        for half, width in _HALVES.items()
    ]
    entries += [
        Line2D([], [], color=style.PALE, linewidth=7.0, label="all sections"),
        Line2D([], [], label="half with the largest", **_LARGEST),
    ]
    figure.legend(handles=entries, loc="outside lower center", ncols=len(entries))
    style.head(figure, grid[0, 0], dataset, "Rod stress")
    return figure


def default_sections(sections: int) -> tuple[int, ...]:
    """The section at the boom, in black, and the one opposite, in red: 1 and 9 of 18."""
    return tuple(dict.fromkeys((1, max(sections // 2, min(2, sections)))))


# Spans and pulleys of a cable section by section, on the ideal geometry of a section.


Array = NDArray[np.floating[Any]]
NODES = ("first hinge", "V", "second hinge")
"""Where a section has pulleys, from the winch on."""
COMPONENTS = ("along", "inwards", "across")
"""Of forces: away from the winch along the section's bars, from its plane towards the other one,
and to the right of someone who goes that way and has z above (in a ring away from its middle, if it
is run through counter-clockwise)."""


@dataclass(frozen=True)
class SectionSpans:
    """Of one cable, sections in the order from its winch; arrays have the shape (section, time).

    Between its hinge pulleys a section has an entry span to its V pulley and a span behind that.
    """

    cable: Cable
    pulleys: int
    """Of the whole cable."""
    arriving: Array
    entry: Array
    behind: Array
    after: Array
    """Tensions in N: in the span to the first hinge pulley, in both spans of the section, in the
    next span; where the cable ends at the second hinge, again the one behind the V pulley."""
    lengths: tuple[Array, Array]
    """Of the spans before and behind the V pulley, m."""
    level: tuple[Array, Array]
    """The part of each that is along the section, m."""
    drop: Array
    """How far inwards of the hinge pulleys the V pulley stands, m."""
    half_turns: tuple[Array, Array]
    """Angles (rad) by which the spans on the hinge assemblies before and behind a section are
    turned from its direction, to the right positive, shape (section,); NaN where there is none."""


def section_spans(dataset: xr.Dataset, plane: str) -> SectionSpans:
    """What the opening angles and tensions of a recorded run of a ring say of a cable's sections.

    Nothing else is taken from the run: hinge pulleys stand in one line along each section, and its
    V pulley where ``ringsim.cable.records`` puts it at the section's opening angle.  ``dataset``
    has ``cable_tension`` and ``opening_angle``; ``plane`` is one with a cable.
    """
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    half_bar, along = _sections(scene, plane)
    cable = getattr(scene.cables, plane)
    backwards = cable.end == "last"
    order = slice(None, None, -1 if backwards else 1)
    own = dataset.sel(plane=plane)
    opening = np.radians(own["opening_angle"].transpose("section", "time").values[order])
    pulleys = scene.pulleys_of(cable)
    spans = own["cable_tension"].transpose("span", "time").values[: pulleys + 1]
    arriving, entry, behind = (spans[first::3][: len(opening)] for first in range(3))
    fold = 0.5 * (np.pi - opening)
    aside, inward = cable.bracket.place(fold, cable.block_offset)
    aside = -aside if backwards else aside
    reach = half_bar * np.cos(fold)
    lengths = cable.bracket.spans(half_bar, cable.block_offset, opening)[order]
    directions = along[order] * (-1.0 if backwards else 1.0)
    turned = np.array([
        np.arctan2(np.cross(one, other)[2], one @ other)
        for one, other in pairwise(directions)
    ])  # fmt: skip
    # Halfway between both sections' directions: behind the one, before the other.
    return SectionSpans(
        cable, pulleys, arriving, entry, behind, np.concatenate([arriving[1:], spans[-1:]]),
        lengths, (reach + aside, reach - aside), half_bar * np.sin(fold) + inward,
        (np.append(np.nan, 0.5 * turned), np.append(-0.5 * turned, np.nan)),
    )  # fmt: skip


def _sections(scene: Scene, plane: str) -> tuple[float, Array]:
    """Length of a folding bar's half, m, and directions of the sections, shape (sections, 3), by
    the layout.
    """
    layout, halves, along = layout_of(scene), [], []
    for opening in layout.openings[scene.structure.planes.index(plane)]:
        assert isinstance(opening, JointOpening)
        joint = layout.joints[opening.joint]
        assert isinstance(joint.first, OnRod)
        assert isinstance(joint.second, OnRod)
        rod, other = layout.rods[joint.first.rod], layout.rods[joint.second.rod]
        chord = other.end.place - rod.start.place
        halves.append(rod.length)
        along.append(chord / np.linalg.norm(chord))
    return float(np.mean(halves)), np.array(along)


def pulley_forces(dataset: xr.Dataset, plane: str) -> xr.DataArray:
    """Forces of a cable on its pulleys, from measured angles and tensions alone.

    The sum of the two pulls on a pulley, T_behind u_behind - T_before u_before: with the
    inclination gamma of the spans of eq. 20 they are paper 000's eqs 28 to 31 with the signs of
    docs/theory/truss2.md.  The rope comes to the first pulley, and goes to a winch at its other
    end, along the boom; where it ends at the last hinge, the force is on its end.

    Returns
    -------
    xr.DataArray
        In N, over (section, node, component, time), sections in the order from the winch; see
        ``NODES`` and ``COMPONENTS``.
    """
    at = section_spans(dataset, plane)
    cos_entry, cos_behind = (np.divide(*each) for each in zip(at.level, at.lengths, strict=True))
    sin_entry, sin_behind = (at.drop / length for length in at.lengths)
    found = np.zeros((len(at.entry), len(NODES), len(COMPONENTS), at.entry.shape[1]))
    found[:, 0, 0], found[:, 0, 1] = at.entry * cos_entry, at.entry * sin_entry
    found[:, 1, 0] = at.behind * cos_behind - at.entry * cos_entry
    found[:, 1, 1] = -at.behind * sin_behind - at.entry * sin_entry
    found[:, 2, 0], found[:, 2, 1] = -at.behind * cos_behind, at.behind * sin_behind
    turn = [angle[:, None] for angle in at.half_turns]
    found[1:, 0, 0] -= (at.arriving * np.cos(turn[0]))[1:]
    found[1:, 0, 2] -= (at.arriving * np.sin(turn[0]))[1:]
    found[:-1, 2, 0] += (at.after * np.cos(turn[1]))[:-1]
    found[:-1, 2, 2] += (at.after * np.sin(turn[1]))[:-1]
    found[0, 0, 1] += at.arriving[0]
    if at.cable.end == "both":
        found[-1, 2, 1] += at.after[-1]
    coordinates = {
        "node": list(NODES), "component": list(COMPONENTS), "time": dataset["time"]
    }  # fmt: skip
    words = {"long_name": "force of the cable on a pulley", "units": "N"}
    dims = ("section", "node", "component", "time")
    return xr.DataArray(found, coordinates, dims, "nodal_force", words)


def section_series(dataset: xr.Dataset, plane: str) -> xr.Dataset:
    """A cable's quantities by section over time from a recorded run of a ring.

    Tensions and the rope's strain are recorded; span lengths are recomputed from the opening angles
    on the ideal geometry of one section (see ``ringsim.plots.rods_and_cables``).

    ``dataset`` has ``cable_tension``, ``rope_strain`` and ``opening_angle``; ``plane`` is one with
    a cable, whose rope no fault has split.

    Returns
    -------
    xr.Dataset
        Over (section, time), sections in the order from the winch: ``neutral_length`` (m, rope
        without tension: a slack rope has more of it than length), ``elongation`` (mm) and
        ``tension`` (N) of the span between the section's first hinge pulley and its V pulley;
        ``decay``, the tension behind the section over that before it, NaN while the rope is slack.
    """
    at = section_spans(dataset, plane)
    taut = at.arriving > at.cable.slack_width
    strain = at.entry / at.cable.axial_stiffness
    loose = np.minimum(dataset["rope_strain"].sel(plane=plane).values, 0.0)
    neutral = at.lengths[0] / (1.0 + np.where(loose < 0.0, loose, strain))
    decay = np.where(taut, at.after / np.where(taut, at.arriving, 1.0), np.nan)
    found = xr.Dataset(coords={"time": dataset["time"]})
    for name, values, words, units in (
        ("neutral_length", neutral, "neutral length of a span", "m"),
        ("elongation", 1e3 * strain * neutral, "span elongation", "mm"),
        ("decay", decay, "tension behind a section over that before it", "1"),
        ("tension", at.entry, "tension at section start", "N"),
    ):
        found[name] = (("section", "time"), values, {"long_name": words, "units": units})
    return found


def _by_plane(
    dataset: xr.Dataset, planes: list[str], rows: int, size: tuple[float, float],
    sharey: bool | Literal["row"] = "row",
) -> tuple[Figure, NDArray[Any]]:  # fmt: skip
    """A figure with a column of axes over time for each plane with a cable; ``size`` is the height
    (inch) of a row, and of what stands above and below all rows.
    """
    figure = Figure(figsize=(5.4 * len(planes) + 0.4, size[0] * rows + size[1]))
    grid = figure.subplots(rows, len(planes), sharex=True, sharey=sharey, squeeze=False)
    for number, column in enumerate(grid.T):
        style.time_axes(dataset, dataset["opening_angle"], *column, named=number == 0)
    return figure, grid


def _draw_sections(axes: Axes, time: xr.DataArray, rows: Array) -> None:
    """A line a section, (section, time), counted from the winch."""
    colours = style.section_colours(len(rows))
    for section, row in enumerate(rows):
        named = f"section {section + 1}"
        axes.plot(time, row, color=colours(section), linewidth=1.2, label=named)


_SLACK = "no line where the rope before it is slack."


@picture("run", 60, "Spans and tensions of the cables", ("cable_tension", "rope_strain"), barred)
def cables(dataset: xr.Dataset) -> Figure:
    """Neutral lengths, elongations, decays and tensions, section by section.

    One column for each plane with a cable; colour counts the sections from the winch.  Bands hold
    the tensions of all spans, and the span with ``peak_tension`` is drawn beside the sections', in
    each column; curves are as recorded, and a dot is ``peak_tension``.
    """
    tension = dataset["cable_tension"]
    planes = tension.dropna("plane", how="all")["plane"].values.tolist()
    series = {plane: section_series(dataset, plane) for plane in planes}
    names = list(series[planes[0]])
    until = style.locked_time(dataset)
    until = until if math.isfinite(until) else math.inf
    peak = peak_of(dataset, "cable_tension", "peak_tension", until)
    limit = style.limit_of(dataset, "tension")
    figure, grid = _by_plane(dataset, planes, len(names), (2.1, 0.8))
    for column, plane in zip(grid.T, planes, strict=True):
        for axes, name in zip(column, names, strict=True):
            _draw_sections(axes, dataset["time"], series[plane][name].values)
        style.name_panel(column[0], f"{plane} cable", height=0.2)
    for row, name in zip(grid, names, strict=True):
        drawn = np.concatenate([series[plane][name].values for plane in planes])
        if name == "tension":
            drawn = np.append(tension.values, [peak.value, limit])
        row[0].set_ylabel(style.label(series[planes[0]][name], width=26))
        if name not in ("neutral_length", "decay"):
            style.span_sizes(row[0], np.where(drawn > 1e-6, drawn, np.nan))
    style.draw_limit(grid[names.index("tension")], limit, f"limits.tension = {limit:g} N")
    for axes, plane in zip(grid[names.index("tension")], planes, strict=True):
        spans = tension.sel(plane=plane)
        least, most = spans.min("span"), spans.max("span")
        axes.fill_between(dataset["time"], least, most, color=style.PALE, linewidth=0.0)
        worst = spans.sel(span=peak.place["span"])
        axes.plot(worst["time"], worst, color=style.VERMILION, linewidth=1.0, zorder=3)
        if plane == peak.place["plane"]:
            later = " until all have locked" if float(tension.max()) > peak.value else ""
            name = worst.coords.get("span_name")
            place = f"span {peak.place['span']}" + (f", {name.item()}" if name is not None else "")
            mark(axes, peak, str(tension.attrs["units"]), place + later, curve=worst)
    gaps = any(np.isnan(each["decay"]).any() for each in series.values())
    style.name_sections(figure, grid[0, 0], f"Third row: {_SLACK}" * bool(gaps))
    style.head(figure, grid[0, 0], dataset, "Cables")
    return figure


_SECTIONS = 4
_LINES: tuple[dict[str, Any], ...] = (
    {"color": style.SKY, "linewidth": 3.6},
    {"color": style.ORANGE, "linewidth": 1.5},
    {"color": style.INK, "linewidth": 1.2, "linestyle": (0, (4, 3))},
)
"""Both hinge pulleys of a section between others are alike: one is seen beside the other."""


@picture("run", 70, "What the pulleys pass on", ("pulley_ratio", "opening_angle"), barred)
def pulleys(dataset: xr.Dataset) -> Figure:
    """``pulley_ratio`` (plane, pulley, time), three curves a section (paper 000, figs 6 and 7).

    One column for each plane with a cable; rows are sections in the order from the winch, of many
    the first, the last and two between.
    """
    ratio = dataset["pulley_ratio"].dropna("plane", how="all")
    planes, sections = ratio["plane"].values.tolist(), dataset.sizes["section"]
    shown = style.some_sections(sections, _SECTIONS)
    figure, grid = _by_plane(dataset, planes, len(shown), (2.3, 1.0), sharey=True)
    for column, plane in zip(grid.T, planes, strict=True):
        own = ratio.sel(plane=plane).transpose("pulley", "time").values
        for axes, section in zip(column, shown, strict=True):
            for node, look, row in zip(NODES, _LINES, own[3 * section :], strict=False):
                axes.plot(dataset["time"], row, label=f"{node} pulley", **look)
            style.name_panel(axes, f"{plane} cable, section {section + 1} from the winch")
    known = ratio.values[np.isfinite(ratio.values)]
    for axes in grid[:, 0]:
        axes.set_ylabel("Tension behind\nover before")
    # Above 1 where rope runs away from the winch.
    low, high = (float(known.min()), max(1.0, float(known.max()))) if known.size else (0.0, 1.0)
    air = 0.1 * (high - low) or 0.05  # of a run that was over before anything moved
    grid[0, 0].set_ylim(low - air, high + air)
    lines = grid[0, 0].get_legend_handles_labels()[0]
    # Spans that a plane does not have are missing all the time.
    gaps = ratio.isnull() & ratio.notnull().any("time")
    figure.legend(handles=lines, loc="outside lower center", ncols=len(lines), title_fontsize=9.5,
                  title=_SLACK.capitalize() if gaps.any() else None)  # fmt: skip
    style.head(figure, grid[0, 0], dataset, "Pulleys")
    return figure


_DRAWN = ("along", "inwards")
_MEANT = (
    "Force of the cable on a pulley.  Along: in the direction of the section's bars, away from the "
    "winch.\nInwards: from the plane of the cable towards the other plane."
)


@picture("run", 80, "Forces on the pulleys", ("cable_tension", "opening_angle"), barred)
def nodal_forces(dataset: xr.Dataset) -> Figure:
    """Two components of the force on the pulleys of every section (paper 000, figs 9 and 10).

    One column for each plane with a cable; colour counts the sections from the winch.
    """
    tension = dataset["cable_tension"]
    planes = tension.dropna("plane", how="all")["plane"].values.tolist()
    forces = {plane: pulley_forces(dataset, plane) for plane in planes}
    rows = [(node, component) for node in NODES for component in _DRAWN]
    figure, grid = _by_plane(dataset, planes, len(rows), (1.9, 0.8))
    for column, plane in zip(grid.T, planes, strict=True):
        for axes, (node, component) in zip(column, rows, strict=True):
            own = forces[plane].sel(node=node, component=component)
            _draw_sections(axes, dataset["time"], own.values)
            axes.axhline(0.0, color=style.GREY, linewidth=0.8, zorder=1.4)
        style.name_panel(column[0], f"{plane} cable", height=0.2)
    for row, (node, component) in zip(grid, rows, strict=True):
        drawn = np.stack(
            [one.sel(node=node, component=component).values for one in forces.values()]
        )
        row[0].set_ylabel(f"{node[:1].upper()}{node[1:]},\n{component} (N)")
        style.signed_sizes(row[0], drawn)
    style.name_sections(figure, grid[0, 0], _MEANT)
    style.head(figure, grid[0, 0], dataset, "Forces on the pulleys")
    return figure
