"""Spans, tensions and pulley forces of a cable over time."""

import math

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style
from ringsim.plots.peaks import mark, peak_of
from ringsim.scene import scene_from_toml
from ringsim.structures.pantograph_ring import PantographRing


def section_series(dataset: xr.Dataset, plane: str) -> xr.Dataset:
    """A cable's quantities by section over time from a recorded run of a ring.

    Tensions are recorded; span lengths and angles are recomputed from the opening angles on the
    ideal geometry of one section (see ``ringsim.cable.bracket``).

    ``dataset`` has ``cable_tension`` and ``opening_angle``; ``plane`` is one with a cable.

    Returns
    -------
    xr.Dataset
        Over (section, time), sections in the order from the winch: ``length`` (m), ``elongation``
        (mm) and ``tension`` (N) of the span between the section's first hinge pulley and its V
        pulley; ``decay``, the tension behind the section over that before it, NaN while the rope
        is slack; ``hinge_force`` on the first hinge pulley, ``block_force`` on the V pulley (N).
    """
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    ring = scene.structure
    assert isinstance(ring, PantographRing)
    cable = getattr(scene.cables, plane)
    backwards = cable.end == "last"
    order = slice(None, None, -1 if backwards else 1)
    own = dataset.sel(plane=plane)
    opening = np.radians(own["opening_angle"].transpose("section", "time").values[order])
    spans = own["cable_tension"].transpose("span", "time").values[: scene.pulleys_of(cable) + 1]
    # Before the first hinge pulley, between it and the V pulley, and behind that.
    arriving, entry, behind = (spans[first::3][: len(opening)] for first in range(3))
    after = np.concatenate([arriving[1:], spans[-1:]])
    taut = arriving > cable.slack_width
    fold = 0.5 * (np.pi - opening)
    aside, inward = cable.bracket.place(fold, cable.block_offset)
    drop = ring.half_bar * np.sin(fold) + inward
    before_v, behind_v = cable.bracket.spans(ring.half_bar, cable.block_offset, opening)[order]
    # The rope arrives at the first hinge pulley along the boom, and at all others from the section
    # before, normal to the boom and turned by half the angle between both sections in the plan.
    # Paper 000, eqs 28, 29, with T1 + T2 sin gamma in the first.
    directions = ring.geometry().directions
    following = np.einsum("ki,ki->k", directions[:-1], directions[1:])[order]
    half_turns = np.sqrt(0.5 * (1.0 + following))[:, None]
    level = (ring.half_bar * np.cos(fold) + (-aside if backwards else aside)) / before_v
    cosine = np.concatenate([(drop / before_v)[:1], -level[1:] * half_turns])
    square = entry**2 + arriving**2 + 2.0 * entry * arriving * cosine
    elongation = 1e3 * (entry * before_v / cable.axial_stiffness)
    decay = np.where(taut, after / np.where(taut, arriving, 1.0), np.nan)
    # (T2 + T3) sin gamma; paper 000, eq. 30, prints their difference (see docs/cables.md).
    block_force = drop * (entry / before_v + behind / behind_v)
    found = xr.Dataset(coords={"time": dataset["time"]})
    for name, values, words, units in (
        ("length", before_v, "span length", "m"),
        ("elongation", elongation, "span elongation", "mm"),
        ("decay", decay, "decay factor of a section", "1"),
        ("tension", entry, "tension at section start", "N"),
        ("hinge_force", np.sqrt(np.maximum(square, 0.0)), "force on hinge pulley", "N"),
        ("block_force", block_force, "force on V pulley", "N"),
    ):
        found[name] = (("section", "time"), values, {"long_name": words, "units": units})
    return found


@style.styled
def cables(dataset: xr.Dataset) -> Figure:
    """Span lengths, elongations, decays, tensions and forces on the pulleys, section by section.

    One column for each plane with a cable; colour counts the sections from the winch.  Bands hold
    the tensions of all spans, and the span with ``peak_tension`` is drawn beside the sections'.
    """
    tension = dataset["cable_tension"]
    planes = tension.dropna("plane", how="all")["plane"].values.tolist()
    series = {plane: section_series(dataset, plane) for plane in planes}
    names = list(series[planes[0]])
    sections = dataset.sizes["section"]
    colours = style.section_colours(sections)
    until = style.deployment_time(dataset)
    until = until if math.isfinite(until) else math.inf
    peak = peak_of(dataset, "cable_tension", "peak_tension", "peak_tension", until)
    figure = Figure(figsize=(5.4 * len(planes) + 0.4, 2.1 * len(names) + 0.8))
    grid = figure.subplots(len(names), len(planes), sharex=True, sharey="row", squeeze=False)
    for number, (column, plane) in enumerate(zip(grid.T, planes, strict=True)):
        style.time_axes(dataset, dataset["opening_angle"], *column, named=number == 0)
        for axes, name in zip(column, names, strict=True):
            for section, row in enumerate(series[plane][name].values):
                axes.plot(
                    dataset["time"], row, color=colours(section), linewidth=1.2,
                    label=f"section {section + 1}",
                )  # fmt: skip
        style.name_panel(column[0], f"{plane} cable", height=0.2)
    for row, name in zip(grid, names, strict=True):
        drawn = np.concatenate([series[plane][name].values for plane in planes])
        if name == "tension":
            drawn = np.append(tension.values, peak.value)
        row[0].set_ylabel(style.label(series[planes[0]][name], width=26))
        if name not in ("length", "decay"):
            style.span_sizes(row[0], np.where(drawn > 1e-6, drawn, np.nan))
    for axes, plane in zip(grid[names.index("tension")], planes, strict=True):
        spans = tension.sel(plane=plane)
        least, most = spans.min("span"), spans.max("span")
        axes.fill_between(dataset["time"], least, most, color=style.PALE, linewidth=0.0)
        if plane == peak.place["plane"]:
            worst = peak.within(spans.sel(span=peak.place["span"]))
            axes.plot(*worst, color=style.VERMILLION, linewidth=1.0, zorder=3)
            later = " until all have locked" if float(tension.max()) > peak.value else ""
            name = spans.sel(span=peak.place["span"]).coords.get("span_name")
            place = f"span {peak.place['span']}" + (f", {name.item()}" if name is not None else "")
            mark(axes, peak, str(tension.attrs["units"]), place + later)
    shown = np.unique(np.linspace(0, sections - 1, 6).round().astype(int))
    lines = [grid[0, 0].get_legend_handles_labels()[0][section] for section in shown]
    figure.legend(handles=lines, loc="outside lower center", ncols=len(lines))
    style.head(figure, grid[0, 0], dataset, "Cables")
    return figure
