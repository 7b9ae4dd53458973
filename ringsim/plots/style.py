"""Style, words, labels and axes shared by all figures."""

import math
import re
import textwrap
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import chain, product
from pathlib import Path
from typing import Any, Literal

import matplotlib
import matplotlib.style
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import LineCollection, PolyCollection, QuadMesh
from matplotlib.colors import Colormap, LinearSegmentedColormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter
from matplotlib.transforms import Bbox

from ringsim.scene import scene_from_toml
from ringsim.tables import counted, known_to, readable, unit_behind
from ringsim.variables import AT_REST, Fate, Status

# Words inside axes, put where they cover no curve.


FREE = "free-label"
"""Gid of the words that may be moved."""
_Side = Literal["left", "right", "center"]
_ACROSS: dict[_Side, float] = {"left": 0.02, "right": 0.98, "center": 0.5}
_HEIGHTS = (0.95, 0.8, 0.65, 0.5, 0.35, 0.2)
"""Upper edges that are tried, in shares of the axes, for lines that leave room in one corner."""
_CENTRES = tuple(k / 20 for k in range(3, 18))
_TOPS = tuple(k / 20 for k in range(19, 2, -1))
"""Centres and upper edges that are tried where none of those does, best for words in few lines."""
_NARROWER = (1.0, 0.7, 0.5)
"""Lengths of their lines then, over what these are."""
_AIR = 4.0
"""Around words, in pixels of the sheet: their background is larger than they are."""


def free(text: Text) -> None:
    """Let these words be moved by :func:`settle`; where they stand now is preferred."""
    text.set_gid(FREE)


def settle(figure: Figure) -> None:
    """Move free words of a drawn figure to where they cover least, best of all nothing."""
    movable = [(a, [t for t in a.texts if t.get_gid() == FREE]) for a in figure.axes]
    if any(texts for _, texts in movable):
        if (engine := figure.get_layout_engine()) is None:
            figure.draw_without_rendering()
        else:  # positions depend on the layout alone
            engine.execute(figure)
    for axes, texts in movable:
        curves = list(_curves(axes))
        fixed = (t for t in axes.texts if t.get_gid() != FREE and t.get_visible() and t.get_text())
        taken = [text.get_window_extent().padded(_AIR) for text in fixed]
        for text in texts:
            words = text.get_text()
            first = words, text.get_position(), text.get_horizontalalignment()
            best = _cost(axes, text, first, curves, taken), first
            corners = ((words, (x, y), ha) for y, (ha, x) in product(_HEIGHTS, _ACROSS.items()))
            others: Iterator[_Place] = (
                (_lines(words, share), place, "center")
                for share in _NARROWER for place in product(_CENTRES, _TOPS)
            )  # fmt: skip
            for place in chain(corners, others):
                if not best[0]:
                    break
                found = _cost(axes, text, place, curves, taken), place
                best = min(best, found, key=lambda each: each[0])
            _move(text, best[1])
            taken.append(text.get_window_extent())


_Place = tuple[str, tuple[float, float], _Side]
"""Words in lines, where they stand, and which side of them stands there."""


def _lines(words: str, share: float) -> str:
    """Words in lines of such a share of the longest; numbers stay with what is beside them."""
    width = math.ceil(share * max(map(len, words.split("\n"))))
    held = re.sub(r"(?<=\d) (?=\D)|(?<=[a-z]) (?=\d)", FIXED, words)
    return "\n".join(textwrap.fill(each, width) for each in held.split("\n")).replace(FIXED, " ")


def _move(text: Text, place: _Place) -> None:
    text.set(text=place[0], position=place[1], horizontalalignment=place[2])


def _cost(
    axes: Axes, text: Text, place: _Place, curves: list[Outline], taken: list[Bbox]
) -> int:  # fmt: skip
    """How many curves words would cover there; other words and the frame count more.

    Words that cannot be moved are among those in the way.
    """
    _move(text, place)
    box, frame = text.get_window_extent(), axes.get_window_extent()
    words = sum(box.overlaps(other) for other in taken)
    outside = box.y0 < frame.y0 or box.x0 < frame.x0 or box.x1 > frame.x1
    covered = sum(bool(one.intersects_bbox(box.padded(_AIR), filled=False)) for one in curves)
    return covered + (len(curves) + 1) * int(words + outside)


def _curves(axes: Axes) -> Iterator[Outline]:
    """All curves and edges of bands, on the sheet."""
    for line in axes.lines:
        yield line.get_transform().transform_path(line.get_path()).cleaned(remove_nans=True)
    for collection in axes.collections:
        if isinstance(collection, (LineCollection, PolyCollection)):
            for path in collection.get_paths():
                yield collection.get_transform().transform_path(path).cleaned(remove_nans=True)


# Style, words and axes shared by all figures.


INK, GREY, PALE = "#222222", "#6e6e6e", "#e4e4e4"
BLUE, SKY, GREEN, ORANGE, VERMILION, PURPLE = (
    "#0072b2", "#56b4e9", "#009e73", "#e69f00", "#d55e00", "#cc79a7",
)  # fmt: skip
"""Colour-blind safe palette (Okabe and Ito 2008)."""

PAPER: Any = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5}
"""Background of text on a grid."""
_FLAT = 0.05
"""Median over largest value below which the axis becomes logarithmic."""
_PREFIXES = {-4: "p", -3: "n", -2: "µ", -1: "m", 0: "", 1: "k", 2: "M", 3: "G"}
_PREFIXED = ("J", "Pa", "N", "W")

styled = matplotlib.style.context(Path(__file__).with_name("figures.mplstyle"))
"""Decorator: draw with the shared style, and leave matplotlib's global settings as they were."""


def new_panels(
    count: int, width: float, height: float | Sequence[float], more: float, *,
    sharex: bool = False, most: int = 3,
) -> tuple[Figure, list[Axes], int]:  # fmt: skip
    """A figure of ``count`` panels, ``most`` in a row, and its number of columns; sizes in inch,
    ``height`` of all rows or of each, ``more`` of what stands beside them.
    """
    columns = min(most, count)
    rows = -(-count // columns)
    heights = [height] * rows if isinstance(height, float) else height
    figure = Figure(figsize=(width * columns, sum(heights) + more))
    panels = figure.subplots(
        rows, columns, sharex=sharex, squeeze=False, height_ratios=heights
    ).ravel().tolist()  # fmt: skip
    for panel in panels[count:]:
        panel.set_visible(False)
    return figure, panels[:count], columns


def title(figure: Figure, text: str) -> None:
    """A bold title in the upper left corner of the sheet, in lines that fit it."""
    width = int(10.3 * figure.get_size_inches()[0])
    lines = (textwrap.fill(line, width) for line in text.split("\n"))
    figure.suptitle(plain("\n".join(lines)), x=0.012, ha="left")


def plain(text: str) -> str:
    r"""Words that users give, with dollars as they are, and not as the ends of a formula.

    >>> plain("between $5 and $6"), plain(r"known \$")
    ('between \\$5 and \\$6', 'known \\\\$')
    """
    return text.replace("$", r"\$")


def legible(dataset: xr.Dataset) -> xr.Dataset:
    """The dataset with attributes that can be drawn, whoever wrote its file: no formulas in names
    and in the words of axes, which matplotlib may not understand, no control characters, no endless
    texts.
    """
    texts = {key: dataset.attrs[key] for key in _TEXTS & dataset.attrs.keys()}
    found = dataset.assign_attrs({key: _drawn(text, _LONGEST_TITLE) for key, text in texts.items()})
    names = {key: _drawn(found.attrs[key]) for key in _NAMES & found.attrs.keys()}
    found = found.assign_attrs({key: plain(str(name)) for key, name in names.items()})
    for variable in found.variables.values():
        for key in variable.attrs.keys() & {"long_name", "units"}:
            words = _drawn(variable.attrs[key], _LONGEST_UNIT if key == "units" else _LONGEST_WORDS)
            variable.attrs[key] = plain(words) if isinstance(words, str) else words
    return found


_TEXTS = {"title", "name", "reason"}
_NAMES = {"first_name", "second_name"}
"""Attributes with what a comparison calls its two, in legends and axes."""
_LONGEST_WORDS, _LONGEST_UNIT, _LONGEST_TITLE = 200, 24, 400
"""Letters of the words and units of axes and of titles; longer ones would leave no room for curves.
"""


def _drawn(words: Any, most: int = _LONGEST_WORDS) -> Any:
    if not isinstance(words, str):
        return words
    words = re.sub(r"\S{48,}", lambda word: f"{word[0][:45]}...", words)  # no line could hold it
    if words.isprintable() and len(words) <= most:
        return words
    kept = "".join(each if each.isprintable() or each == "\n" else " " for each in words[:most])
    return kept if len(words) <= most else f"{kept} ..."


FIXED = "\u00a0"
"""A blank at which no line is broken."""


def meaning(words: str) -> str:
    """The words of a variable without what follows on values that are missing.

    >>> meaning("largest rate at a latch; missing if none caught")
    'largest rate at a latch'
    """
    return words.partition(";")[0]


def label(
    variable: xr.DataArray, units: str | None = None, width: int = 60, behind: str = ""
) -> str:  # fmt: skip
    r"""Meaning and unit of a variable, as on an axis: "Time since the start of the run (s)".

    ``units`` replaces the variable's own where its values were scaled, ``behind`` follows them;
    lines longer than ``width`` characters are broken, never within the unit.

    >>> impulse = xr.DataArray(0.0, attrs={"long_name": "impulse of the stop", "units": "N m s"})
    >>> label(impulse, width=24)
    'Impulse of the stop\n(N m s)'
    """
    words = str(variable.attrs.get("long_name", variable.name))
    units = str(variable.attrs.get("units", "1")) if units is None else units
    if words.startswith(f"{variable.name} = "):  # by an expression: few blanks, wide letters
        words, width = words.replace("(", "( "), int(0.9 * width)
    else:
        words = _NUMBER.sub(FIXED, meaning(words[:1].upper() + words[1:]))
    held = unit_behind(words, units.replace(" ", FIXED)) + behind
    return textwrap.fill(held, width).replace("( ", "(").replace(FIXED, " ")


_NUMBER = re.compile(r"(?<=\d) (?=deg\b)")
"""The blank before a unit in words."""


def unit_label(variable: xr.DataArray) -> str:
    """The unit of a variable as an axis says it that is named elsewhere: "(s)", or nothing."""
    return unit_behind("", str(variable.attrs.get("units", "1"))).strip()


def readable_units(*variables: xr.DataArray) -> tuple[float, str]:
    """Factor and prefixed unit that scale the largest value to between 0.5 and 500.

    The variables share one unit; only J, Pa, N and W get a prefix.
    """
    units = str(variables[0].attrs.get("units", "1"))
    largest = max(largest_magnitude(v) for v in variables)
    if units not in _PREFIXED or largest == 0.0:
        return 1.0, units
    power = min(max(math.floor(math.log10(2.0 * largest) / 3.0), -4), 3)
    return 1000.0**-power, _PREFIXES[power] + units


def in_readable_units(figure: Figure) -> None:
    """Let the axes and words of a figure of SI values give stress as people read it.

    An axis of stress is one that its label names so, or the figure's for all axes, or, where the
    vertical axis has no label, the title of its panel.
    """
    told = ""
    for axes, side in product(figure.axes, ("x", "y")):
        axis: Axis = getattr(axes, f"{side}axis")
        words = axis.get_label_text() + getattr(figure, f"get_sup{side}label")()
        if side == "y" and not words:
            words = axes.get_title("left") + axes.get_title("center") + axes.get_title("right")
        if _PASCAL in words:
            factor, units = readable("Pa", max(map(abs, axis.get_view_interval())))
            axis.set_major_formatter(FuncFormatter(partial(_scaled, factor)))
            axis.set_minor_formatter(NullFormatter())
            told = f"({units})"
            axis.set_label_text(axis.get_label_text().replace(_PASCAL, told))
    for text in figure.findobj(Text) if told else ():
        text.set_text(text.get_text().replace(_PASCAL, told))


_PASCAL = "(Pa)"


def _scaled(factor: float, value: float, _: int) -> str:
    return f"{factor * value:g}"


def largest_magnitude(variable: xr.DataArray) -> float:
    """Largest finite absolute value, 0 if there is none."""
    values = variable.values
    return float(np.abs(values[np.isfinite(values)]).max(initial=0.0))


def deployment_time(dataset: xr.Dataset) -> float:
    """Time at which the last V-joint locked (s), NaN if it did not."""
    return float(dataset.get("deployment_time", math.nan))


def locked_time(dataset: xr.Dataset) -> float:
    """Time at which all V-joints were locked (s), NaN if a latch missed or one did not open."""
    missed = int(dataset.get("outcome", Fate.NONE)) == Fate.NOT_LATCHED
    if "latched_joints" in dataset and "locked_joints" in dataset:
        missed |= bool(dataset["latched_joints"] < dataset["locked_joints"])
    return math.nan if missed else deployment_time(dataset)


def ending(dataset: xr.Dataset) -> str:
    """How the run ended, in one sentence."""
    status, fate = Status(int(dataset["status"])), Fate(int(dataset.get("outcome", Fate.NONE)))
    word = (status if status.failed else fate).words
    if fate == Fate.DEPLOYED and math.isfinite(deployed := deployment_time(dataset)):
        return f"Deployed after {_moment(dataset, deployed)}"
    final = float(dataset.get("final_time", math.nan))
    reason = str(dataset.attrs.get("reason", "")).strip()
    start = "Ended" if word == "none" else word.capitalize()
    # What rests is known to do so some time later: then the time is that of the run.
    rests = not status.failed and fate in AT_REST
    start += f" {'by' if rests else 'after'} {final:.4g} s" if math.isfinite(final) else ""
    return f"{start}: {reason}" if reason else start


def _moment(dataset: xr.Dataset, deployed: float) -> str:
    """The deployment time as far as its error bar, if there is one, lets it be known."""
    error = float(dataset.get("deployment_time_error", math.nan))
    return f"{known_to(f'{deployed:.2f}', error, exact=deployed)} s"


def head(figure: Figure, axes: Axes, dataset: xr.Dataset, subject: str, pad: float = 8.0) -> None:
    """Subject and scene above the figure, how the run ended above its first axes.

    Called when all is drawn: words inside the axes then move away from the curves.
    """
    above, end = heading(dataset, subject, figure.get_size_inches()[0])
    title(figure, above)
    # The second of two lines reaches to what stands above the axes at their right end.
    axes.set_title(plain(end), pad=pad + _RAISED * end.count("\n"))
    settle(figure)


_RAISED = 12.0
"""How much higher than one line two stand above axes, in points."""
_HEAD_LINES = 0.19, 0.17 + _RAISED / 72.0
"""Height on the sheet of each further line of a subject, and of an ending, in inch."""


def heading(dataset: xr.Dataset, subject: str, inches: float) -> tuple[str, str]:
    """Subject and scene, and how the run ended, each in lines that fit a sheet so wide."""
    words, width = f"{subject}: {scene_title(dataset)}".rstrip(": "), int(10.3 * inches)
    lines = len(textwrap.wrap(words, width))
    # The narrowest text with as few lines: all are about equally long.
    fitting = (w for w in range(1, width) if len(textwrap.wrap(words, w)) <= lines)
    told, wide = ending(dataset), int(11.5 * inches)
    while len(textwrap.wrap(told, wide)) > 2 and "; " in told:
        told = told.rpartition("; ")[0]  # what follows from it, which tables tell
    end = textwrap.wrap(told, wide, max_lines=2, placeholder=" ...")
    return textwrap.fill(words, next(fitting, width)), "\n".join(end)


def further_lines(dataset: xr.Dataset, subject: str, inches: float) -> float:
    """Height in inch that the lines of a heading need beyond one of the subject and one of how
    the run ended.
    """
    texts = heading(dataset, subject, inches)
    return sum(each * text.count("\n") for each, text in zip(_HEAD_LINES, texts, strict=True))


def scene_title(dataset: xr.Dataset) -> str:
    """The scene's title with the number of sections that the run had, whatever the title says.

    >>> run = xr.Dataset(coords={"section": [1, 2]}, attrs={"title": "18-section ring"})
    >>> scene_title(run)
    '2-section ring'
    """
    text, count = str(dataset.attrs.get("title", "")).strip(), dataset.sizes.get("section")
    if count is None:
        return text
    true, told = re.subn(r"\b\d+([- ])section(s?)\b", rf"{count}\1section\2", text)
    return true if told else f"{text}, {counted(count, 'section')}".removeprefix(", ")


def section_colours(sections: int) -> Colormap:
    """One colour a section, perceptually uniform, without the light yellow end."""
    return ListedColormap(matplotlib.colormaps["viridis"](np.linspace(0.0, 0.88, sections)))


def some_sections(sections: int, most: int) -> list[int]:
    """Numbers from 0 of a few sections, the first and the last among them.

    >>> some_sections(18, 4)
    [0, 6, 11, 17]
    """
    return [int(k) for k in np.unique(np.linspace(0, sections - 1, most).round())]


def name_sections(figure: Figure, axes: Axes, words: str = "") -> None:
    """Below the figure a legend of axes that have a named line for each section; six at most.

    Above it stands what the ``words`` of the figure mean.
    """
    named = axes.get_legend_handles_labels()[0]
    lines = [named[section] for section in some_sections(len(named), 6)]
    figure.legend(handles=lines, loc="outside lower center", ncols=len(lines), title=words or None,
                  title_fontsize=9.5)  # fmt: skip


_LAGS = LinearSegmentedColormap.from_list(
    "lags", ["#2d004b", "#64449c", "#9a9a9a", "#f4a63c", "#fff0c8"]
)
"""Lightness grows with the deviation: with two dark ends a print in grey would hide its sign."""


def lag_image(axes: Axes, lags: xr.DataArray, span: float) -> QuadMesh:
    """Deviations (section, time) as a colour, at most ``span``: ahead orange, behind purple."""
    time, sections = lags["time"].values, lags["section"].values
    edges = np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])
    axes.grid(visible=False)
    return axes.pcolormesh(
        edges, np.append(sections, sections[-1] + 1) - 0.5,
        lags.transpose("section", "time").values,
        cmap=_LAGS, vmin=-span, vmax=span, rasterized=True,
    )  # fmt: skip


def time_axes(
    dataset: xr.Dataset, recorded: xr.DataArray, *panels: Axes, named: bool = True
) -> None:
    """Time axis of a run, shared by panels above each other, without margins.

    It spans the times at which something was ``recorded``, and the run's end.  A dashed line marks
    where the last V-joint locked, if it did, with its time above the first panel where that is
    ``named``.
    """
    panels[-1].set_xlabel(label(dataset["time"]))
    time = recorded.dropna("time", how="all")["time"].values
    if len(time) > 1:
        # A peak may lie between the last record and the end of the run.
        final = float(np.nan_to_num(dataset.get("final_time", math.nan)))
        panels[0].set_xlim(float(time[0]), max(float(time[-1]), final))
    moment = deployment_time(dataset)
    if math.isnan(moment):
        return
    for axes in panels:
        axes.axvline(moment, color=INK, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1.5)
    if named:
        side = "right" if moment > 0.5 * sum(panels[0].get_xlim()) else "left"
        done = "all locked" if math.isfinite(locked_time(dataset)) else "all at 180 deg"
        panels[0].annotate(
            f"{done} at {_moment(dataset, moment)}", (moment, 1.0),
            xycoords=panels[0].get_xaxis_transform(), xytext=(0, 3),
            textcoords="offset points", ha=side, va="bottom", fontsize=9.5,
        )  # fmt: skip


def span_sizes(axes: Axes, sizes: np.ndarray) -> None:
    """Value axis from zero; logarithmic where most of the run would be a flat line.

    Peaks at locking are hundreds of times larger than values before, so a linear axis would show
    nothing else.  ``sizes`` is what was drawn, of any shape, NaN where nothing was recorded.
    """
    known = sizes[np.isfinite(sizes) & (sizes > 0.0)]
    largest = float(known.max()) if known.size else 1.0
    if not known.size or np.median(known) > _FLAT * largest:
        axes.set_ylim(0.0, 1.2 * largest)
        return
    lowest = max(float(np.quantile(known, 0.02)), 1e-5 * largest)
    axes.set_yscale("log", nonpositive="clip")
    axes.set_ylim(10.0 ** np.floor(np.log10(lowest)), 4.0 * largest)
    plain_numbers(axes.yaxis)


def from_zero(axes: Axes) -> None:
    """Value axis from zero with room above for whole markers, however alike the values are."""
    axes.set_ylim(0.0, 1.08 * axes.get_ylim()[1])


_NOTHING = 1e-6
"""Share of the largest value below which a force is that of a slack rope, 1e-89 N."""


def signed_sizes(axes: Axes, sizes: np.ndarray) -> None:
    """Value axis of both signs; logarithmic on either side where most would be a flat line.

    ``sizes`` is what was drawn, of any shape, NaN where nothing was recorded; see ``span_sizes``.
    """
    known = np.abs(sizes[np.isfinite(sizes)])
    largest = float(known.max(initial=0.0)) or 1.0
    known = known[known > _NOTHING * largest]
    least, most = np.nanmin(sizes, initial=0.0), np.nanmax(sizes, initial=0.0)
    room = 0.05 * largest
    if not known.size or np.median(known) > _FLAT * largest:
        axes.set_ylim(least - room, most + room)
        return
    linear = 10.0 ** math.floor(math.log10(max(float(np.quantile(known, 0.02)), 1e-4 * largest)))
    axes.set_yscale("symlog", linthresh=linear, linscale=0.3)
    axes.set_ylim(2.0 * min(least, -0.5 * linear), 2.0 * max(most, 0.5 * linear))
    plain_numbers(axes.yaxis)
    beside = 1.01 * linear  # labels there would lie on that of zero
    axes.yaxis.set_major_formatter(
        FuncFormatter(lambda value, _: "" if 0.0 < abs(value) < beside else f"{value:g}")
    )


def limit_of(dataset: xr.Dataset, name: str) -> float:
    """What ``limits`` of the scene allow for a load, in its unit; NaN without a limit."""
    scene = scene_from_toml(str(dataset.attrs["scene"]), source="attribute scene")
    limit = getattr(scene.limits, name)
    return math.nan if limit is None else float(limit)


_FAR_ABOVE = 4.0
"""Limit over the upper end of an axis from which on it is named and not drawn."""


def draw_limit(panels: Sequence[Axes], limit: float, words: str, right: bool = False) -> None:
    """A dashed line at a limit, with its name at its left end, or its ``right``; nothing at NaN.

    Of one far above what was drawn before in all panels the name alone: curves would be a strip.
    """
    most = max((each.get_ylim()[1] for each in panels if each.has_data()), default=math.inf)
    for axes in () if math.isnan(limit) else panels:
        if limit > _FAR_ABOVE * most:
            axes.annotate(f"{words}, far above", (float(right), 1.0), xytext=(4 - 8 * right, -11),
                          xycoords="axes fraction", textcoords="offset points", color=VERMILION,
                          fontsize=9, ha="right" if right else "left")  # fmt: skip
            continue
        axes.axhline(limit, color=VERMILION, linewidth=1.2, linestyle=(0, (5, 2)))
        axes.annotate(words, (float(right), limit), xytext=(4 - 8 * right, 2),
                      xycoords=axes.get_yaxis_transform(), textcoords="offset points", fontsize=9,
                      color=VERMILION, ha="right" if right else "left")  # fmt: skip


_MOST_MARGIN = 1e3
"""Beyond it next to nothing resists, and how little says nothing."""


def margin_axis(axes: Axes, margins: np.ndarray, words: str) -> None:
    """Value axis of margins with its name, linear up to 1 and logarithmic from there on.

    Where little resists, margins are a hundred times what they are where it counts.
    """
    known = margins[np.isfinite(margins)]
    least, most = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    most = min(most, _MOST_MARGIN)
    axes.set_yscale("symlog", linthresh=1.0, linscale=1.0)
    axes.set_ylim(min(-0.1, least - 0.1), 1.3 * max(most, 1.0))
    powers = (10.0**k for k in range(4) if 10.0**k < 1.3 * most)
    below = (-0.5 * k for k in range(1, int(max(0.0, -2.0 * least)) + 1))
    axes.set_yticks(sorted({0.0, 0.5, 1.0, 2.0, 5.0, *powers, *below}))
    plain_numbers(axes.yaxis)
    axes.set_ylabel(f"{words}\n(linear to 1,\nlogarithmic above)", fontsize=9.5)


_LETTER, _APART = 6.2, 6.0
"""Width of a letter of a tick's label, and the least between two labels, in points."""


def few_ticks(axes: Axes, most: int = 5, *, whole: bool = False) -> None:
    """Ticks along x, fewer where their labels are long: these do not run into each other.

    Called when the axis has its name: stress gets the labels of ``in_readable_units``.
    """
    axis, points = axes.xaxis, 72.0 * axes.bbox.width / axes.figure.dpi
    low, high = sorted(axis.get_view_interval())
    told = axis.get_major_formatter()
    if _PASCAL in axis.get_label_text():
        told = FuncFormatter(partial(_scaled, readable("Pa", max(abs(low), abs(high)))[0]))
    for count in range(most, 1, -1):
        axis.set_major_locator(MaxNLocator(count, integer=whole, min_n_ticks=1 if whole else 2))
        places = axis.get_majorticklocs()
        words = told.format_ticks(places.tolist())
        longest = max(map(len, words), default=0)
        step = np.diff(places).min(initial=high - low)
        if points * step >= (high - low) * (_LETTER * longest + _APART):
            break


def plain_numbers(axis: Axis) -> None:
    """Ticks with all of their number, no power of ten beside the axis, and only the major ones."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def name_panel(axes: Axes, text: str, height: float = 0.95) -> None:
    """A bold name in the upper left corner of the frame, or where it covers no curve."""
    free(axes.text(
        0.02, height, text, transform=axes.transAxes, va="top", weight="bold", zorder=5, bbox=PAPER
    ))  # fmt: skip
