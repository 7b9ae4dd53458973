"""Spans, tensions and pulley forces of a cable over time."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style
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

    Of a ring's upper cable, or the lower where there is no other; colour counts the sections from
    the winch.
    """
    tension = dataset["cable_tension"]
    plane = next(str(p) for p in dataset["plane"].values if np.isfinite(tension.sel(plane=p)).any())
    series = section_series(dataset, plane)
    colours = style.section_colours(sections := series.sizes["section"])
    figure = Figure(figsize=(11.0, 8.4))
    grid = figure.subplots(3, 2, sharex=True)
    for axes, (name, values) in zip(grid.ravel(), series.items(), strict=True):
        for number, row in enumerate(values.values):
            (line,) = axes.plot(series["time"], row, color=colours(number), linewidth=1.2)
            line.set_label(f"section {number + 1}")
        axes.set_ylabel(style.label(values))
        if name not in ("length", "decay"):
            style.span_sizes(axes, values.where(values > 1e-6).values)
    for column in grid.T:
        style.time_axes(dataset, dataset["opening_angle"], *column, named=False)
    if 1 < sections <= 6:
        grid[0, 0].legend(loc="best")
    style.head(figure, grid[0, 0], dataset, f"{plane.capitalize()} cable")
    return figure
