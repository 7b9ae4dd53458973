"""The structure as it moves, as a GIF: coloured by lag or by stress, with its time."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import (
    Colormap,
    FuncNorm,
    LinearSegmentedColormap,
    LogNorm,
    Normalize,
    to_rgb,
)  # fmt: skip
from matplotlib.figure import Figure
from PIL import Image

from ringsim.dataset import as_in_scene
from ringsim.files import whole, writing
from ringsim.plots import style
from ringsim.plots.ring import LOOKS, OTHER, facing_azimuth, view
from ringsim.plots.run import LEAST_SPAN
from ringsim.refusal import InputError
from ringsim.scene import scene_from_toml
from ringsim.shapes import ByLine, Shape, shape_of
from ringsim.tables import unit_text

FRAMES, RATE, HELD = 120, 15, 1.5
"""Frames of the motion, frames a second, and how long (s) the last one stays."""
_SAMPLED = 8
"""Frames whose colours are the palette of all."""
_SIZE, _DPI = (7.6, 6.4), 100
_ELEVATION = 24.0
_FADE = 0.55
"""Share of white in the farthest line."""
_MUTED = "#bdbdbd"
"""Rods that the colour does not tell of."""
_DECADES = 3.0
"""Of the stresses that colours tell apart: peaks at locking are hundreds of times the rest."""
_DIVERGING = LinearSegmentedColormap.from_list("lag", ["#542788", "#b0b0b0", "#c85a00"])
"""Purple behind, grey with the mean, orange ahead, as in the report."""


class _Paint(NamedTuple):
    """How lines are coloured; NaN leaves a line its own colour."""

    values: ByLine
    factor: float
    """What values are multiplied by for the unit of ``label``."""
    colours: Colormap
    norm: Normalize
    ticks: list[float] | None
    label: str
    course: xr.DataArray
    """The largest value over time, in that unit."""


def animate(run: xr.Dataset, path: Path, colour: str = "lag") -> Path:
    """Write a run as a GIF of about ten seconds, whatever it took; returns the file.

    ``run`` is a run, or one sample of a campaign, with ``opening_angle``, and ``position`` if the
    drawing is to be what was computed; ``colour`` is "lag" (deviation from the mean opening angle)
    or "stress", which needs ``rod_stress``.

    InputError if it recorded nothing to draw, or no stress, or not all planes and sections of its
    scene are there, or the file cannot be written.
    """
    run = as_in_scene(run)
    try:
        shape = shape_of(run, scene_from_toml(str(run.attrs["scene"]), source="attribute scene"))
    except ValueError as error:
        raise InputError(f"{path}: {error}: there is nothing to draw") from error
    run = style.legible(run)
    paint = by_stress(run, shape) if colour == "stress" else by_lag(run, shape)
    frames = _frames(run, shape, paint)
    lasts = [1000 // RATE] * (len(frames) - 1) + [int(1000 * HELD)]
    with writing(path), whole(path, lasting=False) as draft:
        frames[0].save(
            draft, format="GIF", save_all=True, append_images=frames[1:], duration=lasts, loop=0,
        )  # fmt: skip
    return path


@style.styled
def _frames(run: xr.Dataset, shape: Shape, paint: _Paint) -> list[Image.Image]:
    """All frames, with one palette: each with its own would flicker."""
    figure, show = stage(run, shape, paint)
    canvas: Any = FigureCanvasAgg(figure)

    def drawn(time: float) -> Image.Image:
        show(time)
        canvas.draw()
        return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")

    times = np.linspace(shape.times[0], shape.times[-1], FRAMES).tolist()
    few = [np.asarray(drawn(time)) for time in times[:: max(1, FRAMES // _SAMPLED)] + times[-1:]]
    palette = Image.fromarray(np.concatenate(few)).quantize(256)
    return [drawn(time).quantize(palette=palette, dither=Image.Dither.NONE) for time in times]


def stage(run: xr.Dataset, shape: Shape, paint: _Paint) -> tuple[Figure, Callable[[float], None]]:
    """The figure, and what shows a time (s) in it."""
    azimuth = facing_azimuth(shape.scene)
    figure = Figure(figsize=_SIZE, dpi=_DPI)
    figure.set_layout_engine("none")
    style.title(figure, style.scene_title(run))
    axes = figure.add_axes((0.02, 0.26, 0.96, 0.61))
    axes.set_axis_off()
    few = np.linspace(shape.times[0], shape.times[-1], 16)
    papers = np.concatenate([view(shape.at(float(time)), azimuth, _ELEVATION)[0] for time in few])
    low, high = papers.min(axis=0), papers.max(axis=0)
    room = 0.02 * (high - low).max()
    axes.set(
        aspect="equal", xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room)
    )
    lines = LineCollection([], capstyle="round", clip_on=False, snap=False)
    axes.add_collection(lines, autolim=False)
    clock = figure.text(0.012, 0.9, "", fontsize=12, family="monospace", color=style.INK)
    figure.text(0.988, 0.012, shape.words, ha="right", fontsize=8, color=style.GREY)
    bar = figure.colorbar(
        ScalarMappable(paint.norm, paint.colours), cax=figure.add_axes((0.64, 0.925, 0.32, 0.018)),
        orientation="horizontal", ticks=paint.ticks, format="%.3g",
    )  # fmt: skip
    bar.set_label(paint.label, fontsize=9, labelpad=1)
    bar.ax.tick_params(labelsize=8)
    bar.ax.minorticks_off()
    cursor = _course(figure, run, paint)
    mean = run["opening_angle"].mean(("plane", "section")).dropna("time")

    def show(time: float) -> None:
        _draw(lines, shape, paint, time, azimuth)
        opened = float(np.interp(time, mean["time"], mean))
        clock.set_text(f"{time:6.2f} s  {opened:6.1f} deg open")
        cursor.set_xdata([time, time])

    return figure, show


def _draw(lines: LineCollection, shape: Shape, paint: _Paint, time: float, azimuth: float) -> None:
    """Lines at a time, the far ones paler and behind the others."""
    values, parts = paint.values(time), shape.lines(shape.at(time))
    names = np.array([name for name, ends in parts.items() for _ in ends])
    unknown = {name: np.full(len(ends), np.nan) for name, ends in parts.items()}
    known = {name: each for name, each in values.items() if name in parts}
    told = paint.factor * np.concatenate([*(unknown | known).values()])
    looks = [LOOKS.get(name, OTHER) for name in names]
    colours = np.array([to_rgb(look["color"]) for look in looks])
    widths = np.array([look["linewidth"] for look in looks])
    colours[np.isin(names, ("diagonals", "bars"))] = to_rgb(_MUTED)
    painted, joints = np.isfinite(told), names == "V-joints"
    colours[painted] = paint.colours(paint.norm(told[painted]))[:, :3]
    widths[painted] = 2.6
    widths[joints] = 6.5 if painted[joints].any() else 3.5
    paper, depths = view(np.concatenate([*parts.values()]), azimuth, _ELEVATION)
    near = depths.mean(axis=-1) + 1e-6 * joints  # a joint stands before the rods that it joins
    fade = (_FADE * (near.max() - near) / max(float(np.ptp(near)), 1e-9))[:, None]
    paper[joints, 1, 1] += 1e-3  # m: a line without a length is not drawn
    order = np.argsort(near, kind="stable")
    lines.set_segments(list(paper[order]))
    lines.set_color([*(colours + fade * (1.0 - colours))[order]])
    lines.set_linewidth(widths[order].tolist())


def _course(figure: Figure, run: xr.Dataset, paint: _Paint) -> Any:
    """What is coloured over the whole run, with a cursor at the time that is shown."""
    axes: Axes = figure.add_axes((0.11, 0.095, 0.86, 0.13))
    known = paint.course.dropna("time")
    axes.plot(known["time"], known, color=style.INK, linewidth=1.2)
    axes.set_xlim(float(known["time"][0]), max(float(known["time"][-1]), 1e-9))
    style.span_sizes(axes, known.to_numpy())
    axes.set_xlabel(style.label(run["time"]), fontsize=9)
    axes.set_ylabel(str(paint.course.attrs["units"]), fontsize=9)
    axes.set_title(str(paint.course.attrs["long_name"]), fontsize=9, pad=3)
    return axes.axvline(0.0, color=style.VERMILION, linewidth=1.6)


def by_lag(run: xr.Dataset, shape: Shape) -> _Paint:
    """Colours of sections by how far each V-joint is from the mean angle, InputError without."""
    if "opening_angle" not in run:
        raise InputError("--colour lag: the run holds no opening angles to draw it by")
    angle = run["opening_angle"]
    apart = abs(angle - angle.mean(["plane", "section"])).max(["plane", "section"])
    span = max(float(apart.max()), LEAST_SPAN)
    units = unit_text(str(angle.attrs.get("units", "degree")))
    words = "largest deviation of an opening angle from the mean"
    # Deviations are small until the first joints lock: colours go with their square roots.
    bent = FuncNorm(
        (lambda x: np.sign(x) * np.sqrt(np.abs(x)), lambda y: np.sign(y) * y**2), -span, span
    )
    return _Paint(
        shape.lags(run), 1.0, _DIVERGING, bent, [-span, -span / 4.0, 0.0, span / 4.0, span],
        f"behind and ahead of the mean ({units})",
        apart.assign_attrs({"units": units, "long_name": words}),
    )  # fmt: skip


def by_stress(run: xr.Dataset, shape: Shape) -> _Paint:
    """Colours of rods by their stress, InputError without."""
    if "rod_stress" not in run or not bool(np.isfinite(run["rod_stress"]).any()):
        raise InputError(
            "--colour stress: the run recorded no stress: run it with --set record.stress=true, or "
            "colour by lag"
        )
    stress = run["rod_stress"]
    factor, units = style.readable_units(stress)
    largest = max(factor * style.largest_magnitude(stress), 1e-300)
    course = (factor * stress.max(["rod", "section"])).assign_attrs(
        {"units": units, "long_name": "largest stress of a rod"}
    )
    return _Paint(
        shape.stresses(run), factor, style.section_colours(256),
        LogNorm(largest / 10.0**_DECADES, largest, clip=True), None, f"stress ({units})", course,
    )  # fmt: skip
