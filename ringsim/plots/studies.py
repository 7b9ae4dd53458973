"""Figures of accuracy and stability studies, and of optimisations."""

import textwrap
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import LogLocator

from ringsim.analysis.engines import OUTPUTS
from ringsim.analysis.stability import AGREE, ENGINES, OK, WRONG, axis_label
from ringsim.plots import style
from ringsim.tables import amount_text, unit_behind

# Error against cost: the work-precision figure of an accuracy study.


_LOOKS = {
    "as it stands": (style.INK, "*"),
    "steps": (style.BLUE, "o"),
    "constant step": (style.SKY, "s"),
    "elements": (style.GREEN, "D"),
    "formulation": (style.ORANGE, "^"),
    "dissipation": (style.PURPLE, "v"),
    "newton": (style.VERMILION, "P"),
    "setting": (style.GREY, "X"),
}

_WIDE = 300.0
"""Ratio of costs from which on there is no room for numbers between powers of ten."""


@style.styled
def accuracy(found: xr.Dataset) -> Figure:
    """One panel an output: relative error over processor time.

    The line is the frontier of both engines: what settings are good for, which is no less than the
    error of any finer one.  Hollow marks are runs of the frame engine.  ``found`` is from
    ``ringsim.analysis.accuracy.judge``.
    """
    titles = OUTPUTS | {"energy": "energy balance"}
    outputs = [name for name in titles if name in found.output.values]
    figure, panels, columns = style.new_panels(len(outputs), 3.6, 3.0, 0.9, sharex=True)
    for k, (panel, name) in enumerate(zip(panels, outputs, strict=True)):
        _panel(panel, found.sel(output=name))
        style.name_panel(panel, titles[name].capitalize())
        if k % columns == 0:
            panel.set_ylabel("Relative error")
        if k + columns >= len(outputs):
            panel.set_xlabel("Processor time of the run (s)")
            panel.tick_params(labelbottom=True)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5)
    style.title(figure, str(found.attrs.get("title", "Accuracy")))
    return figure


def _panel(axes: Axes, found: xr.Dataset) -> None:
    cost, error, ladder = found.cost.values, found.error.values, found.ladder.values
    drawn, frame = np.isfinite(error) & (error > 0.0), found.fidelity.values == "frame"
    axes.loglog()
    wide = np.nanmax(cost) > _WIDE * np.nanmin(cost)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if wide else (1.0, 2.0, 5.0)))
    style.plain_numbers(axes.xaxis)
    for name, (colour, marker) in _LOOKS.items():
        for hollow in (False, True):
            there = (ladder == name) & (frame == hollow)
            if there.any():
                own, (size, order) = there & drawn, (150, 4) if marker == "*" else (34, 3)
                axes.scatter(
                    cost[own], error[own], s=size, marker=marker, edgecolors=colour,
                    facecolors="none" if hollow else colour, linewidths=1.0 if hollow else 0.0,
                    label=f"frame: {name}" if hollow else name, alpha=0.9, zorder=order,
                )  # fmt: skip
    best = found.isel(rung=found.frontier.values & (error > 0.0)).sortby("cost")
    axes.step(
        best.cost, best.bound, where="post", color=style.INK, linewidth=1.1,
        label="most accurate for their cost", zorder=2,
    )  # fmt: skip
    floor, known = float(found.uncertainty), error[drawn]
    if known.size or floor > 0.0:
        lowest = min(known.min(initial=np.inf), 0.5 * floor or np.inf)
        axes.set_ylim(0.4 * lowest, 30.0 * max(known.max(initial=0.0), floor))
    axes.axhspan(
        (low := axes.get_ylim()[0]), max(floor, low), color=style.PALE, zorder=0.5, linewidth=0.0,
        label="uncertainty of the reference",
    )  # fmt: skip
    if "engines_differ" in found:
        axes.axhline(
            float(found.engines_differ), color=style.GREY, linewidth=0.9, linestyle=":", zorder=1,
            label="engines differ by",
        )  # fmt: skip


# The stability map: a panel for each pair of axes, a square for each cell.


_AGAIN = "ok, after a restart"
_CELLS: dict[str, tuple[str, str]] = {
    OK: ("#cfe6f5", ""),
    _AGAIN: (style.SKY, "r"),
    "cut off": ("#d9d9d9", "t"),
    "energy lost": (style.ORANGE, "L"),
    "energy grew": (style.VERMILION, "G"),
    "blow-up": ("#7f0000", "B"),
    "overloaded": (style.PURPLE, "P"),
    "slackened": ("#b8860b", "k"),
    "stalled": ("#bdbdbd", "s"),
    "partly deployed": ("#b3cde3", "p"),
    "not latched": ("#8c96c6", "l"),
    "few steps": ("#fddbc7", "F"),
    "tension bends": ("#f4a582", "W"),
    "joint gap": ("#9970ab", "J"),
    "Newton": (style.GREEN, "N"),
    "step limit": ("#f0e442", "S"),
    "time limit": ("#8c6d31", "T"),
    "refused": ("#5e5e5e", "X"),
    WRONG: ("black", "!"),
}
"""Colour and letter of each kind of cell; the letter tells what the colour may not."""
_OTHER = ("#5e5e5e", "?")
_OUTLINE: Any = {"facecolor": "none", "edgecolor": style.INK, "linewidth": 2.0}


@style.styled
def stability(whole: xr.Dataset) -> Figure:
    """Panels over the values of two axes, which are listed, not to scale.

    Panels of both engines stand side by side, and cells in which they differ have a frame.
    ``whole`` is a judged map (``ringsim.analysis.stability.joined``).
    """
    most = 2 if ENGINES in whole else 3
    figure, panels, columns = style.new_panels(whole.sizes["group"], 4.5, 3.5, 1.0, most=most)
    seen: set[str] = set()
    for number, axes in enumerate(panels):
        cells = whole.isel(cell=(whole["of_group"] == number).values, group=number)
        seen |= set(kinds := _kinds(cells))
        _map(axes, cells, kinds)
    handles = []
    for word in [*filter(seen.__contains__, _CELLS), *sorted(seen - set(_CELLS))]:
        colour, letter = _CELLS.get(word, _OTHER)
        label = f"{letter}  {word}".strip()
        handles.append(Patch(facecolor=colour, edgecolor=style.GREY, label=label))
    if ENGINES in whole:
        handles.append(Patch(label="the engines differ", **_OUTLINE))
    most = min(len(handles), 2 * columns + 1)
    figure.legend(handles=handles, loc="outside lower center", ncols=most)
    style.title(figure, f"Stability map: {whole.sizes['cell']} runs and how they ended")
    return figure


def _map(axes: Axes, cells: xr.Dataset, kinds: list[str]) -> None:
    x, column = np.unique(cells["x"].values, return_inverse=True)
    y, row = np.unique(cells["y"].values, return_inverse=True)
    for left, below, word in zip(column.tolist(), row.tolist(), kinds, strict=True):
        colour, letter = _CELLS.get(word, _OTHER)
        place = (left - 0.5, below - 0.5)
        axes.add_patch(Rectangle(place, 1.0, 1.0, facecolor=colour, edgecolor="white", zorder=2))
        # Dark by the eye's weights of red, green and blue.
        ink = "white" if np.dot(to_rgb(colour), (0.3, 0.59, 0.11)) < 0.47 else style.INK
        axes.text(left, below, letter, ha="center", va="center", fontsize=8, color=ink, zorder=3)
    differ = ~cells[ENGINES].isin(["", AGREE]).values if ENGINES in cells else np.zeros(len(kinds))
    for k in np.flatnonzero(differ).tolist():
        axes.add_patch(
            Rectangle((column[k] - 0.43, row[k] - 0.43), 0.86, 0.86, zorder=4, **_OUTLINE)
        )
    axes.set(xlim=(-0.5, len(x) - 0.5), ylim=(-0.5, len(y) - 0.5))
    axes.set_xticks(range(len(x)), [_short(v) for v in x], fontsize=8)
    axes.set_yticks(range(len(y)), [_short(v) for v in y], fontsize=8)
    axes.grid(visible=False)
    title = textwrap.fill(str(cells["title"].values), 40)  # as wide as the panel
    axes.set_title(style.plain(title), color=style.INK, weight="bold")
    axes.set_xlabel(_label(cells, "x", 44), fontsize=9)
    axes.set_ylabel(_label(cells, "y", 32), fontsize=9)


def _kinds(cells: xr.Dataset) -> list[str]:
    restarted = cells["restarts"].values > 0.0
    words = zip(cells["verdict"].values, cells["cause"].values, restarted, strict=True)
    alone = {OK: OK, WRONG: WRONG}
    return [_AGAIN if again and end == OK else alone.get(end, cause) for end, cause, again in words]


def _label(group: xr.Dataset, axis: str, width: int) -> str:
    label = axis_label(group, axis)
    if "." not in label.split()[0]:  # a path stays as it is typed
        label = label[:1].upper() + label[1:]
    return textwrap.fill(label, width)


def _short(value: float) -> str:
    """A number as short as it is clear: 1e5, 0.03, 179.9."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e4:
        return f"{value:.4g}"
    digits, power = f"{value:.1e}".split("e")
    return f"{digits.removesuffix('.0')}e{int(power)}"


# The front of an optimisation.


@style.styled
def front(found: xr.Dataset) -> Figure:
    """On the left what designs reach: those that were tried by few samples and the checks (blue
    where nothing that is required is broken), and the present and the chosen ones by fresh samples
    with their intervals; over the second objective, or in the order in which they were tried.  On
    the right where the variables of the chosen designs lie between their bounds, and how far the
    checked quantiles lie on either side of what is required.
    """
    variables, bounds = found.sizes["variable"], found.sizes["bound"]
    figure = Figure(figsize=(12.0, max(4.2, 0.5 * (variables + bounds) + 2.2)))
    heights = (variables, bounds + 0.5) if bounds else (1,)
    grid = figure.add_gridspec(len(heights), 2, width_ratios=(3, 2), height_ratios=heights)
    _reached(figure.add_subplot(grid[:, 0]), found)
    _variables(figure.add_subplot(grid[0, 1]), found)
    if bounds:
        _bounds(figure.add_subplot(grid[1, 1]), found)
    style.title(figure, f"Designs: {found.attrs['title'] or found.attrs['name']}")
    return figure


def _look(k: int) -> dict[str, Any]:
    """Of the present design, the first one, and of the chosen ones."""
    return {"color": style.VERMILION if k else style.INK, "marker": "D" if k else "s",
            "markersize": 4.5, "linestyle": ""}  # fmt: skip


def _reached(axes: Axes, found: xr.Dataset) -> None:
    two, names = found.sizes["objective"] == 2, [str(name) for name in found["design"].values]
    lost, beyond = found["tried_lost"].values, found["tried_estimate_beyond"].values
    count = int(found.attrs["designs"])
    kept = ((lost == 0.0) & (beyond <= 0.0).all(axis=1))[:count]
    tried = found["tried_estimate"].values[:count]
    across = tried[:, 1] if two else np.arange(1, count + 1)
    axes.scatter(across[~kept], tried[~kept, 0], s=14, facecolors="none", edgecolors=style.GREY,
                 label="tried, breaks a constraint")  # fmt: skip
    axes.scatter(across[kept], tried[kept, 0], s=14, color=style.SKY, label="tried, keeps to all")
    middle, low, high = (found[f"objective_{end}"].values for end in ("value", "lower", "upper"))
    wide = 0.15 * count + 1.0
    for k, name in enumerate(names):
        x = middle[k, 1] if two else count + wide * (k + 1)
        ends = [np.abs([[end[k, i]] for end in (low, high)] - middle[k, i]) for i in range(1 + two)]
        axes.errorbar(x, middle[k, 0], yerr=ends[0], xerr=ends[1] if two else None, capsize=4,
                      **_look(k))  # fmt: skip
        if two:
            axes.annotate(name, (x, middle[k, 0]), textcoords="offset points", xytext=(7, 7),
                          fontsize=8.5, color=_look(k)["color"])  # fmt: skip
    units = [str(unit) for unit in found["objective_units"].values]
    words = [
        f"{name}, {'small' if sign > 0 else 'large'} is better" for name, sign in zip(
            found["objective"].values, found["objective_sign"].values, strict=True
        )
    ]  # fmt: skip
    axes.set_ylabel(textwrap.fill(unit_behind(words[0], units[0]), 36))
    if two:
        axes.set_xlabel(textwrap.fill(unit_behind(words[1], units[1]), 60))
    else:
        some = sorted({1, *np.linspace(1, count, 5).round().astype(int).tolist()})
        places = [count + wide * (k + 1) for k in range(len(names))]
        axes.set_xticks([*some, *places], [*map(str, some), *names])
        axes.axvline(count + 0.5 * wide, color=style.PALE)
        axes.set_xlabel("Designs in the order in which they were tried; present and chosen")
    axes.margins(x=0.14 if two else 0.08, y=0.12)
    axes.legend(loc="best", fontsize=8)
    axes.set_title("Tried (estimates), present and chosen (fresh samples, 95 %)", fontsize=10)


def _variables(axes: Axes, found: xr.Dataset) -> None:
    low, high = found["low"].values, found["high"].values
    places = (found["value"].values - low) / (high - low)
    told = [[f"{v:.4g}" for v in row] for row in found["value"].values]
    _rows(axes, _labels(found, "variable"), places, told)
    axes.set_xlim(-0.06, 1.06)
    axes.set_xticks([0.0, 1.0], ["low", "high"])
    axes.set_title("Variables: present (black) and chosen", fontsize=10)


def _bounds(axes: Axes, found: xr.Dataset) -> None:
    far = found["check_beyond"].values
    size = np.nanmax(np.abs(far), axis=0, initial=0.0)
    units = found["bound_units"].values
    told = [[amount_text(v, u, "+.3g") for v, u in zip(row, units, strict=True)] for row in far]
    _rows(axes, _labels(found, "bound"), far / np.where(size > 0.0, size, 1.0), told)
    axes.axvline(0.0, color=style.INK, linewidth=1.1)
    axes.set_xlim(-1.25, 1.25)
    axes.set_xticks([-0.6, 0.0, 0.6], ["keeps to it", "bound", "breaks it"])
    axes.tick_params(axis="x", length=0)
    axes.set_title("Quantiles aimed at less the bounds (check samples)", fontsize=10)


def _labels(found: xr.Dataset, dim: str) -> list[str]:
    """Names along a dimension, each with its unit."""
    both = zip(found[dim].values, found[f"{dim}_units"].values, strict=True)
    return [unit_behind(str(name), str(unit)) for name, unit in both]


def _rows(axes: Axes, labels: list[str], places: Any, told: list[list[str]]) -> None:
    """A row for each label, a mark for each design, with its value if there are few."""
    for k in range(len(labels)):
        axes.axhline(k, color=style.GREY, linewidth=0.9, zorder=1)
        for j in range(len(places)):
            axes.plot(places[j, k], k, **_look(j))
            if len(places) < _MANY:
                axes.annotate(
                    told[j][k],
                    (places[j, k], k),
                    textcoords="offset points",
                    ha="center",
                    xytext=(0, (6, -13, -22)[j]),
                    fontsize=8,
                    bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
                )
    axes.set_yticks(range(len(labels)), labels)
    axes.tick_params(axis="y", labelsize=8.5, length=0)
    axes.set_ylim(len(labels) - 0.4, -0.7)
    axes.grid(visible=False)


_MANY = 4
"""Designs from which on their values are not written at the marks."""
