"""The ring in space: stowed, half-way and deployed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from ringsim.layout.lines import lines_of
from ringsim.layout.of_scene import layout_at_opening, layout_of
from ringsim.plots import style, wording
from ringsim.plots.camera import Camera
from ringsim.scene import Scene, scene_from_toml

Array = NDArray[np.float64]

_ELEVATION = 24.0
_WIDTH, _HIGHEST, _SIDE, _GAP = 10.6, 4.6, 0.3, 0.35
_BELOW, _ABOVE, _BAR, _CAPTION = 1.2, 1.12, 0.46, 2.4
"""Room on the sheet, in inch: the drawing; beside, below and above it; a caption's width."""
_FADE = 0.6
"""Share of white in the farthest line."""


@dataclass(frozen=True)
class _Look:
    colour: str
    width: float
    dashes: Any = "solid"


_LOOKS = {
    "diagonals": _Look(style.BLUE, 1.5),
    "bars": _Look(style.VERMILLION, 1.5),
    "hinge assemblies": _Look(style.INK, 3.0),
    "boom": _Look(style.GREY, 5.0),
    "net, taut": _Look(style.GREEN, 0.9),
    "net, slack": _Look(style.GREEN, 0.9, (0, (1.5, 2.5))),
}

_NAMES = {"bars": "folding bars"}
"""Words of the legend, where they differ from the layout's."""


@style.styled
def ring(dataset: xr.Dataset) -> Figure:
    """Three instants of a run side by side, all to one scale.

    Parameters
    ----------
    dataset
        A run of a pantograph ring with ``opening_angle`` (plane, section, time), its scene as
        TOML in the attribute ``scene``.

    Returns
    -------
    Figure
        Orthographic views with a scale bar in metre; nearer lines are darker.
    """
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    camera = Camera(facing_azimuth(scene), _ELEVATION)
    moments = instants(dataset)
    shots = []
    for _, angles in moments:
        lines = lines_at(scene, np.radians(angles.transpose("plane", "section").values))
        shots.append({name: camera.view(ends) for name, ends in lines.items()})
    return _compose(dataset, moments, shots)


def lines_at(scene: Scene, openings: Array) -> dict[str, Array]:
    """Lines of a scene at opening angles in rad, shape (planes, sections): see ``lines_of``."""
    net = scene.net
    beyond = 0.0 if net is None or net.two_sided else net.neutral_length
    return lines_of(layout_at_opening(scene, float(openings.mean())), openings, taut_beyond=beyond)


def facing_azimuth(scene: Scene) -> float:
    """Direction to look from, degree: the boom to the left in front; an arc from outside."""
    outward = np.mean([rod.start.axes[:, 2] for rod in layout_of(scene).rods], axis=0)
    if scene.structure.closed or np.hypot(*outward[:2]) < 1e-6:
        return 42.0
    return float(np.degrees(np.arctan2(outward[1], outward[0]))) + 35.0


def instants(dataset: xr.Dataset) -> list[tuple[str, xr.DataArray]]:
    """Name and opening angles (plane, section) of the three recorded instants to draw.

    The first time, the time at which the mean opening angle is nearest to the middle between
    the ends, and the deployment, at which every V-joint stands at 180 deg by definition, or the
    last recorded time if it was not reached.
    """
    angle = dataset["opening_angle"].dropna("time", how="any")
    mean = angle.mean(("plane", "section")).values
    deployed = wording.deployment_time(dataset)
    done = math.isfinite(deployed)
    last = int(np.abs(angle["time"].values - deployed).argmin()) if done else len(mean) - 1
    middle = int(np.abs(mean[: last + 1] - 0.5 * (mean[0] + mean[last])).argmin())
    opens = mean[last] >= mean[0]
    names = ("stowed" if opens else "start", "half-way", "deployed" if done else "end of the run")
    moments = [(n, angle.isel(time=i)) for n, i in zip(names, (0, middle, last), strict=True)]
    if done:
        locked = xr.full_like(moments[2][1], 180.0)
        locked["time"] = locked["time"].copy(data=deployed)
        moments[2] = (names[2], locked)
    return moments


def _compose(
    dataset: xr.Dataset,
    moments: list[tuple[str, xr.DataArray]],
    shots: list[dict[str, tuple[Array, Array]]],
) -> Figure:
    points = [np.concatenate([xy.reshape(-1, 2) for xy, _ in shot.values()]) for shot in shots]
    low = np.array([p.min(axis=0) for p in points])
    sizes = np.array([p.max(axis=0) for p in points]) - low
    height = float(sizes[:, 1].max())
    scale, cells = _fit(sizes[:, 0], height)
    figure, axes = _sheet(scale, height)
    middles = (np.cumsum(cells + _GAP) - 0.5 * cells - _GAP) / scale
    for (name, angles), shot, corner, size, middle in zip(
        moments, shots, low, sizes, middles, strict=True
    ):
        _draw(axes, shot, np.array([middle - 0.5 * size[0], 0.0]) - corner, scale)
        _caption(axes, middle, name, angles)
    _scale_bar(axes, _WIDTH / scale, height)
    _legend(figure, {name for shot in shots for name, (xy, _) in shot.items() if len(xy)})
    wording.head(figure, axes, dataset, "Deployment", pad=72.0 * _BAR)
    return figure


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


def _sheet(scale: float, height: float) -> tuple[Figure, Axes]:
    """Axes in metre whose frame is the drawing, between room for words above and below."""
    sheet = height * scale
    wide, high = _WIDTH + 2 * _SIDE, _BELOW + sheet + _ABOVE
    figure = style.new_figure(wide, high)
    figure.set_layout_engine("none")
    axes = figure.add_axes((_SIDE / wide, _BELOW / high, _WIDTH / wide, sheet / high))
    axes.set_axis_off()
    axes.set_aspect("equal")
    axes.set_xlim(0.0, _WIDTH / scale)
    axes.set_ylim(0.0, height)
    return figure, axes


def _caption(axes: Axes, middle: float, name: str, angles: xr.DataArray) -> None:
    time = angles["time"]
    numbers = (
        f"{float(time):.2f} {time.attrs['units']}\n"
        f"mean opening angle {float(angles.mean()):.1f} {angles.attrs['units']}"
    )
    for text, drop, weight in ((name, 12, "bold"), (numbers, 28, "normal")):
        axes.annotate(
            text, (middle, 0.0), xytext=(0, -drop), textcoords="offset points", ha="center",
            va="top", weight=weight, linespacing=1.4,
        )  # fmt: skip


def _draw(axes: Axes, shot: dict[str, tuple[Array, Array]], shift: Array, scale: float) -> None:
    """Lines from far to near, the far ones paler; thinner where a metre is short."""
    thin = float(np.clip(scale / 1.3, 0.45, 1.0))
    looks = [_LOOKS[name] for name, (xy, _) in shot.items() for _ in xy]
    lines = np.concatenate([xy for xy, _ in shot.values()]) + shift
    near = np.concatenate([depth.mean(axis=-1) for _, depth in shot.values()])
    order = np.argsort(near, kind="stable")
    depth = max(float(np.ptp(near)), 0.8 * float(np.ptp(lines[..., 0])))
    fade = _FADE * (near.max() - near) / depth
    colours = np.array([to_rgb(look.colour) for look in looks])
    colours += fade[:, None] * (1.0 - colours)
    axes.add_collection(
        LineCollection(
            list(lines[order]),
            colors=colours[order],
            linewidths=[thin * looks[k].width for k in order],
            linestyles=[looks[k].dashes for k in order],
            capstyle="round",
            clip_on=False,
        ),
        autolim=False,
    )


def _scale_bar(axes: Axes, length: float, top: float) -> None:
    raw, above = 0.12 * length, top + 0.08 * length / _WIDTH
    power = 10.0 ** math.floor(math.log10(raw))
    metres = power * max(step for step in (1, 2, 5) if step * power <= raw)
    axes.plot(
        [0.0, metres],
        [above, above],
        color=style.INK,
        linewidth=2.5,
        solid_capstyle="butt",
        clip_on=False,
    )
    axes.annotate(
        f"{metres:g} m", (0.5 * metres, above), xytext=(0, 4), textcoords="offset points",
        ha="center", va="bottom", annotation_clip=False,
    )  # fmt: skip


def _legend(figure: Figure, drawn: set[str]) -> None:
    entries = [
        Line2D(
            [],
            [],
            color=look.colour,
            linewidth=look.width,
            linestyle=look.dashes,
            label=_NAMES.get(name, name),
        )
        for name, look in _LOOKS.items()
        if name in drawn
    ]
    figure.legend(handles=entries, loc="lower center", ncols=len(entries))
