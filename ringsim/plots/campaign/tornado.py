"""Which inputs matter for the main numbers: tornado, and single changes."""

import itertools
import re
import textwrap
from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ringsim.analysis.design import (
    drawn,
    endings,
    inputs,
    placement,
    population_of,
    scalars,
    told,
    values_of,
)
from ringsim.analysis.indices import UNLIKELY, largest_by_chance
from ringsim.analysis.influence import LEAST, influence
from ringsim.analysis.influence_text import mattering
from ringsim.analysis.intervals import good, quantities, ran, varies
from ringsim.analysis.requirements import OUTCOME, required_by
from ringsim.analysis.sensitivity import sensitivity
from ringsim.analysis.tails import subset_simulation
from ringsim.analysis.worst import one_at_a_time
from ringsim.plots import picture, style
from ringsim.plots.campaign.frame import (
    drawable,
    head,
    in_lines,
    legend,
    looks_of,
    moves,
    short,
    shown,
    still,
)
from ringsim.stepping.instant import Array
from ringsim.tables import chance_text, counted, unit_behind

MEASURES = {
    "total_index": "Total Sobol' index",
    "mean_absolute_effect": "Mean absolute effect mu*",
    "given_data_index": "First-order index",
    "partial_rank_correlation": "Partial rank correlation",
    "rank_correlation": "Rank correlation",
}
"""What bars can show, the most telling first; a design allows some of them."""
_COLOURS = {"partial_rank_correlation": style.GREEN, "rank_correlation": style.PURPLE}
"""Of measures that stand beside indices, which are of another colour."""
_INSIDE = {
    "total_index": ("first_order_index", "first-order index"),
    "given_data_index": ("partial_rank_correlation", "partial rank correlation"),
}
"""What a second, thinner bar shows beside it."""
_BY_CHANCE = "exceeded by chance in one case of 20"
_MOST, _MOST_PANELS = 8, 10
"""Bars of a panel, and panels of a sheet: its two columns are full."""
_BAR = 0.4
"""Height of what is told of an input, inch."""
_NONE = 3 * (np.empty(0), np.empty((0, 2)))


class Bars(NamedTuple):
    """Bars of one output in the order of tables, at most 8; intervals NaN where there are none.

    What chance would explain has no bar, nor what shares places with a longer bar.
    """

    measure: str
    """A key of ``MEASURES``; empty if there is none, and so no bar."""
    names: list[str]
    values: NDArray[np.floating]
    ends: NDArray[np.floating]
    """Shape (bars, 2)."""
    inside: NDArray[np.floating]
    inside_ends: NDArray[np.floating]
    plain: NDArray[np.floating]
    """Rank correlations of what has no partial one to stand inside."""
    plain_ends: NDArray[np.floating]
    chance: float
    """What would be reached by chance; NaN if that is not known."""
    told: str
    """Samples or blocks used and lost, or why there is no bar."""


def analysed(campaign: xr.Dataset) -> xr.Dataset:
    """The indices that the design of a campaign allows of its main numbers, and rank correlations
    but of blocks, which need none.
    """
    names, placed = drawable(campaign), placement(campaign)
    found = sensitivity(campaign, {}, placed, names)
    if "factor" in found.dims and all(_measure(found, name) for name in names):
        return found
    stand = population_of(campaign)
    known = [name for name in quantities() if name in campaign]
    counts = {f"{n}_samples": ("counted", [len(values_of(stand, n)[0])]) for n in known}
    return xr.merge([found, influence(stand, {}, placed), xr.Dataset(counts)])


def _measure(analysis: xr.Dataset, output: str) -> str:
    """The most telling measure that an analysis has of an output; empty if none."""
    held = (name for name in MEASURES if (one := _values(analysis, name, output)) is not None
            and bool(np.isfinite(one).any()))  # fmt: skip
    return next(held, "")


def _values(analysis: xr.Dataset, variable: str, output: str) -> xr.DataArray | None:
    """A variable of one output, or None: of indices along ``output``, of correlations by name."""
    if f"{output}_{variable}" in analysis:
        return analysis[f"{output}_{variable}"]
    if variable in analysis and output in analysis["output"]:
        return analysis[variable].sel(output=output)
    return None


def bars_of(campaign: xr.Dataset) -> Iterator[tuple[str, Bars]]:
    """The bars of every main number, then those of failures, by the most telling measure of each;
    what has none only if samples without a value are why.
    """
    analysis, names = analysed(campaign), drawable(campaign)
    others = analysis["output"].values.tolist() if "output" in analysis.dims else []
    stand = population_of(campaign)
    matter = {output: chosen for output, chosen, _ in mattering(analysis)}
    for output in [*names, *(name for name in others if name not in names)]:
        measure, told = _measure(analysis, output), ""
        count = len(values_of(stand, output)[0])
        if output in others:
            told = _counted(analysis.sel(output=output), blocks="factor" in analysis.dims)
        if measure.endswith("rank_correlation"):
            told = "\n".join(filter(None, [f"samples: {count}", told]))
        if measure or told:
            chance = _chance(analysis, measure, output, count)
            yield output, _bars(analysis, measure, output, told, chance, matter.get(output, []))


def _counted(one: xr.Dataset, *, blocks: bool) -> str:
    """Samples or blocks that indices of an output are from, or why it has none."""
    if one["missing_by_inputs"].item() < UNLIKELY:
        chance = chance_text(one["missing_by_inputs"].item())
        why = (
            f"{counted(one['missing'].item(), 'sample')} without a value,\nwhich depends on inputs"
        )
        return f"no index: {why} ({chance})"
    if not MEASURES.keys() & set(one):
        return ""
    of = "blocks" if blocks else "samples"
    return f"{of}: {one['index_used'].item()} used, {one['index_lost'].item()} left out"


def _chance(analysis: xr.Dataset, measure: str, output: str, samples: int) -> Array | None:
    """What the largest of all inputs reaches by chance in one case of 20; None if not known."""
    if measure == "given_data_index":
        found = _values(analysis, "chance_level", output)
        return None if found is None else found.values
    if not measure.endswith("rank_correlation"):
        return None
    held = analysis["inputs_held"].values * (measure == "partial_rank_correlation")
    return largest_by_chance(samples, held, analysis.sizes["input"])


def _bars(
    analysis: xr.Dataset, measure: str, output: str, told: str, chance: Array | None,
    matter: list[str],
) -> Bars:  # fmt: skip
    if not measure:
        return Bars("", [], *_NONE, np.nan, told)
    known = _values(analysis, measure, output)
    assert known is not None
    values, (dim,) = known.values, known.dims
    names = analysis[dim].values.astype(str)
    order = np.argsort(-np.abs(np.nan_to_num(values)), kind="stable")
    if chance is not None:
        at = {name: k for k, name in enumerate(names.tolist())}
        order = np.array([at[name] for name in matter if name in at], dtype=np.int64)
    order = order[np.isfinite(values[order])][:_MOST]

    def of(variable: str, shape: tuple[int, ...]) -> NDArray[np.floating]:
        found = _values(analysis, variable, output)
        return np.full((len(order), *shape), np.nan) if found is None else found.values[order]

    second, _ = _INSIDE.get(measure, ("-", ""))
    inside = of(second, ())
    held = np.isfinite(inside)
    # What alone goes with an output may be a place of an input whose mean is held: see influence.
    plain = "rank_correlation" if second == "partial_rank_correlation" else "-"

    def ends_of(name: str) -> tuple[NDArray[np.floating], NDArray[np.bool_]]:
        """Intervals; of an index none that is longer than all of the variance, as tables say it."""
        ends = of(f"{name}_interval", (2,))
        far = (np.diff(ends)[:, 0] > 1.0) & name.endswith("_index")
        return np.where(far[:, None], np.nan, ends), far

    ends, far = ends_of(measure)
    each = zip(names[order].tolist(), far.tolist(), strict=True)
    called = [name + " (few decide it)" * few for name, few in each]
    return Bars(
        measure, called, values[order], ends, inside, ends_of(second)[0],
        np.where(held, np.nan, of(plain, ())),
        np.where(held[:, None], np.nan, of(f"{plain}_interval", (2,))),
        np.nan if chance is None or not len(order) else float(np.min(chance[order])), told,
    )  # fmt: skip


def explained(campaign: xr.Dataset) -> bool:
    """Whether there is something to draw: drawn inputs, enough samples for a correlation, and
    neither chains of them nor single changes, which are told case by case.

    Told without the analysis itself, which takes a while for many samples.
    """
    stand = population_of(campaign)
    varied = any(
        len(values_of(stand, name)[1]) >= LEAST and varies(stand, name)
        for name in drawable(campaign)
    )
    told_apart = one_at_a_time(campaign) or subset_simulation(campaign.attrs) is not None
    return varied and bool(drawn(campaign).names) and not told_apart


@picture("campaign", 90, "Which inputs matter for each main number", applies=explained)
def tornado(campaign: xr.Dataset) -> Figure:
    """A panel a main number, a bar an input or group; whiskers are 95 % intervals."""
    # Those that something is required of first: a page has no room for all.
    wanted = required_by(campaign.attrs)
    every = sorted(bars_of(campaign), key=lambda each: each[0] not in wanted)
    stand = population_of(campaign)
    untold = [n for n in wanted if n in stand and not (varies(stand, n) or _alike(stand, n))]
    flat, unmoved = still(stand, drawable(campaign), untold)
    every = [each for each in every if each[0] not in flat]
    quiet = [name for name, bars in every if bars.measure and not bars.names]
    every = [each for each in every if each[0] not in quiet]
    found = every[:_MOST_PANELS]
    found = found or [("", Bars("", [], *_NONE, np.nan, "no significant input" if quiet else
                                "no sensitivity measure"))]  # fmt: skip
    # A row is as high as its bars need, and has 0.75 inch of words: of three lines.
    counts = [max(1, len(bars.names)) for _, bars in found]
    rows = [max(counts[k : k + 2]) for k in range(0, len(found), 2)]
    heights = [_BAR * (most + 0.4) for most in rows]
    words_of_rows = 1.1 + 0.75 * len(heights)
    figure, panels, _ = style.new_panels(len(found), 5.2, heights, words_of_rows, most=2)
    alike = {bars.told for _, bars in found if bars.names}
    shared = alike.pop() if len(alike) == 1 and len(found) > 1 else ""
    certain, uncertain, titles = False, False, list[Text]()
    for number, (axes, (output, bars)) in enumerate(zip(panels, found, strict=True)):
        _draw(axes, bars)
        # Bars of one height, whatever their number.
        beside = 0.5 * (heights[number // 2] / _BAR - counts[number])
        axes.set_ylim(-0.5 - beside, counts[number] - 0.5 + beside)
        known = np.isfinite(bars.ends).all(axis=1)
        certain, uncertain = certain or bool(known.any()), uncertain or not known.all()
        titles.append(_name(axes, campaign, output, bars, shared))
    if (engine := figure.get_layout_engine()) is not None:
        engine.execute(figure)
    for axes, title, (output, bars) in zip(panels, titles, found, strict=True):
        _name(axes, campaign, output, bars, shared, *_fitting(figure, axes, title))
    lines = [axes.get_title("left").count("\n") + axes.get_xlabel().count("\n") for axes in panels]
    more = sum(max(0, max(lines[k : k + 2]) - 1) for k in range(0, len(panels), 2))
    figure.set_figheight(figure.get_figheight() + _LINE * more)
    if any(len(axes.get_legend_handles_labels()[1]) > 1 for axes in panels):
        legend(figure, panels)
    whiskers = "Whiskers: 95 % intervals." if certain else ""
    if uncertain and not certain:
        whiskers = "The design allows no intervals."
    if certain and uncertain:
        whiskers += " Bars without whiskers: interval not known."
    most = max((len(values_of(campaign, name)[0]) for name in drawable(campaign)), default=0)
    beyond = any(np.isfinite(bars.chance) for _, bars in found)
    of = f"The longest {_MOST} bars at most."
    if beyond:
        of = f"Significant inputs only, {_MOST} at most, in the order of the table."
    if any((np.abs(bars.values) < bars.chance).any() for _, bars in found):
        of += " An index that ends before the dashed line is drawn for the correlation below it."
    each = f"{shared[0].upper()}{shared[1:]} in each panel." if shared else ""
    caption = " ".join(filter(None, [f"{told(campaign, most)}.", each, whiskers, of]))
    if quiet:
        caption += f" No significant input for {', '.join(quiet)}."
    if others := [name for name, _ in every[_MOST_PANELS:]]:
        caption += f" Not drawn for want of room: {', '.join(others)}."
    head(figure, campaign, "What matters", caption + unmoved)
    return figure


def _alike(campaign: xr.Dataset, name: str) -> bool:
    """Whether all samples have the same: then no input can matter, which needs no word."""
    every = endings(campaign)[good(campaign)] if name == OUTCOME else values_of(campaign, name)[1]
    return len(np.unique(every)) < 2


_TITLE, _LABEL, _SHORTEST = 40, 48, 16
"""Letters of a line above a panel and below its axis, at most, and of either at least."""
_LINE = 0.155
"""Height of a further one, inch."""
_AIR, _MARK, _HINTED = 0.08, 2, 1.05
"""Blank edge of a sheet, inch; letters of the mark that may follow a title; and how much wider the
same words are at another resolution, whose letters begin at its dots."""


def _name(
    axes: Axes, campaign: xr.Dataset, output: str, bars: Bars, shared: str,
    title: int = _TITLE, label: int = _LABEL,
) -> Text:  # fmt: skip
    """Put words above and below a panel, in lines of so many letters; those above it."""
    # Without its unit, which is not that of the bars.
    words, units = textwrap.fill(output, title), "1"
    if output in campaign:
        words = style.label(campaign[output], "1", title)
        units = campaign[output].attrs.get("units", "1")
    above = axes.set_title(words, fontsize=9.5, color=style.INK)
    unit = unit_behind("", units) if bars.measure == "mean_absolute_effect" else ""
    below = f"\n{bars.told}" if bars.told and bars.told != shared else ""
    if bars.names:
        words = textwrap.fill(f"{MEASURES[bars.measure]}{unit}{_beside(bars)}", label)
        axes.set_xlabel(f"{words}{below}", fontsize=9)
    return above


def _fitting(figure: Figure, axes: Axes, above: Text) -> tuple[int, int]:
    """Letters of a line above a panel and below its axis that the sheet has room for: names of
    inputs leave axes narrow, and the layout knows how high words are, not how wide.
    """
    box, air = axes.get_window_extent(), _AIR * figure.dpi
    last, middle = figure.bbox.width - air, 0.5 * (box.x0 + box.x1)

    def fitting(text: Text, most: int, more: int, room: float) -> int:
        longest = max(1, *map(len, text.get_text().split("\n")))
        letter = _HINTED * text.get_window_extent().width / longest
        if letter * (longest + more) <= room:
            return most
        return max(_SHORTEST, int(room / letter) - more)

    beside = 2.0 * min(middle - air, last - middle)
    label = axes.xaxis.label
    return fitting(above, _TITLE, _MARK, last - box.x0), fitting(label, _LABEL, 0, beside)


def _beside(bars: Bars) -> str:
    """What the thinner bars are, as the end of an axis label."""
    second, word = _INSIDE.get(bars.measure, ("", ""))
    words = [word] * bool(second and np.isfinite(bars.inside).any())
    words += ["rank correlation"] * bool(np.isfinite(bars.plain).any())
    return f", and {' or '.join(words)}" * bool(words)


def _draw(axes: Axes, bars: Bars) -> None:
    height = np.arange(len(bars.names))[::-1].astype(float)
    if not bars.names:
        axes.text(0.5, 0.5, bars.told, ha="center", va="center", transform=axes.transAxes,
                  fontsize=9, color=style.VERMILION)  # fmt: skip
        axes.set_xticks([])
        axes.set_yticks([])
        return
    measure = bars.measure
    word = MEASURES[measure][0].lower() + MEASURES[measure][1:]
    second = bool(np.isfinite([bars.inside, bars.plain]).any())
    shift = 0.17 if second else 0.0
    colour = _COLOURS.get(measure, style.SKY)
    _row(axes, height + shift, bars.values, bars.ends, colour, word, 0.34 if second else 0.6)
    if second:
        # As where it is the main measure, of outputs without an index.
        inside, told_inside = _INSIDE[measure]
        _row(axes, height - shift, bars.inside, bars.inside_ends,
             _COLOURS.get(inside, style.ORANGE), told_inside, 0.34)  # fmt: skip
    if np.isfinite(bars.plain).any():
        _row(axes, height - shift, bars.plain, bars.plain_ends, style.PURPLE, "rank correlation",
             0.34)  # fmt: skip
    if np.isfinite(bars.chance):
        # An index is a share: what it has below zero is its own error.
        signed = measure.endswith("rank_correlation")
        for side in np.unique(np.sign(bars.values)) if signed else (1.0,):
            look: Any = {"color": style.VERMILION, "linestyle": "dashed", "linewidth": 1.2}
            if second:  # chance gives bars of the other measure something else
                axes.vlines([side * bars.chance] * len(height), height + shift - 0.17,
                            height + shift + 0.17, label=_BY_CHANCE, **look)  # fmt: skip
            else:
                axes.axvline(side * bars.chance, label=_BY_CHANCE, **look)
    axes.axvline(0.0, color=style.INK, linewidth=0.8)
    axes.locator_params(axis="x", nbins=5)
    # What a fault breaks, and when, has no room here: "faults = jammed-pulley".
    short = [re.sub(r"(?<= = )([\w-]+)\(.*\)$", r"\1", name) for name in bars.names]
    names = short if len(set(short)) == len(short) else bars.names
    axes.set_yticks(height, [in_lines(name) for name in names], fontsize=8)
    axes.grid(axis="y", visible=False)


def _row(
    axes: Axes, height: NDArray[np.floating], values: NDArray[np.floating],
    ends: NDArray[np.floating], colour: str, label: str, thick: float,
) -> None:  # fmt: skip
    if not len(values):
        return
    # Hatched, so that they are told apart in grey.
    hatch = {style.ORANGE: "////", style.GREEN: "////", style.PURPLE: "...."}.get(colour, "")
    axes.barh(height, values, height=thick, color=colour, label=label, linewidth=0.0,
              hatch=hatch, edgecolor="white")  # fmt: skip
    known = np.isfinite(ends).all(axis=1)
    # By their ends, since an interval need not hold the estimate.
    middle, half = ends[known].mean(axis=1), np.ptp(ends[known], axis=1) / 2
    axes.errorbar(middle, height[known], xerr=half, fmt="none", ecolor=style.INK,
                  elinewidth=1.1, capsize=2.5)  # fmt: skip


_MOST_NAMED = 72
"""Moves up to which each has its name on the axis."""
_MOST_MOVED, _FEW_MOVES, _LOW_SHEET = 18, 24, 6
"""Panels of a sheet; moves that half its width can name, and panels up to which it needs no two
columns."""
_ROOM, _LETTER = 0.8, 0.07
"""Share of a figure's width that panels have; length of a letter below them, inch."""
_LEAST_SPAN = 0.02
"""Of its largest value: axes of smaller ranges are made to span twice as much."""


def is_one_by_one(campaign: xr.Dataset) -> bool:
    """Whether inputs were moved one at a time, and something came of it."""
    return one_at_a_time(campaign) and bool(scalars(campaign)) and bool(inputs(campaign))


def _scaled(campaign: xr.Dataset, name: str, samples: NDArray[np.int64]) -> bool:
    """Whether an input moved along a scale in these samples, so that a line may join them."""
    if campaign[name].ndim > 1:
        return False
    try:
        campaign[name].to_numpy()[samples].astype(float)
    except ValueError:
        return False
    return True


def named(count: int) -> list[int]:
    """Places of so many that have their names on the axis: at equal steps, and the last one."""
    step = -(-(count - 1) // (_MOST_NAMED - 1)) or 1
    return [*range(0, count - 1 - step // 2, step), count - 1]


@picture("campaign", 20, "Main numbers after each single change", applies=is_one_by_one)
def one_by_one(campaign: xr.Dataset) -> Figure:
    """A panel a main number, a mark a move in the order of the design; the line is the base case.

    Colour and marker say how the sample ended.
    """
    (names, others), ends = shown(campaign, _MOST_MOVED), endings(campaign)
    words, moved = moves(campaign)
    samples, has_run = campaign["sample"].to_numpy(), ran(campaign)
    places, few = named(len(samples)), len(samples) <= _FEW_MOVES
    columns = 2 if few and len(names) > _LOW_SHEET else 1
    # As many lines as find room between two marks.
    most = min(3, max(1, int(_ROOM * 9.6 / columns / len(samples) / _LINE)))
    wrapped = partial(textwrap.fill, width=52 - 8 * most, max_lines=most, placeholder=" ...")
    fit = wrapped if few else short
    names_shown = [fit(words[k]) for k in places]
    # Below both columns, of which the second may end a row before the first.
    below = _LETTER * max(len(line) for each in names_shown for line in each.splitlines())
    below *= 1 + len(names) % columns
    figure, panels, columns = style.new_panels(
        len(names), 9.6 / columns, 1.5, 1.6 + below, sharex=True, most=columns
    )
    looks = looks_of(ends)
    for axes, name in zip(panels, names, strict=True):
        known, values = values_of(campaign, name)
        at = np.searchsorted(samples, known)
        if 0 in at:
            axes.axhline(values[0], color=style.GREY, linewidth=0.9)
        # A sample without a value leaves a gap.
        lines = itertools.groupby(range(len(at)), key=lambda k: (moved[at[k]], at[k] - k))
        for (name_moved, _), found in lines:
            line = list(found)
            if name_moved and _scaled(campaign, name_moved, at[line]):
                axes.plot(at[line], values[line], color=style.PALE, linewidth=1.0, zorder=1)
        for word in dict.fromkeys(ends[has_run].tolist()):
            own = ends[at] == word
            colour, marker = looks[word]
            axes.scatter(at[own], values[own], s=22, color=colour, marker=marker, zorder=3,
                         label=f"{word} ({(ends == word).sum()})")  # fmt: skip
        # Moves that change next to nothing must not look as if they changed much.
        middle, least = np.mean(values), _LEAST_SPAN * np.abs(values).max(initial=0.0)
        if np.ptp(values) < least:
            axes.set_ylim(middle - least, middle + least)
        axes.ticklabel_format(axis="y", useOffset=False)
        axes.yaxis.set_major_locator(MaxNLocator(4))
        axes.set_title(style.label(campaign[name], width=120 // columns), fontsize=9.5)
    for axes in panels[-columns:]:
        axes.set_xticks(places, names_shown, rotation=90, fontsize=8 if len(places) < 60 else 7)
        axes.tick_params(axis="x", labelbottom=True)
    panels[-1].set_xlim(-0.7, len(samples) - 0.3)
    legend(figure, [panels[0]], 4)
    counted = max(len(values_of(campaign, name)[0]) for name in names)
    note = f"{told(campaign, counted)}. Line: the first sample, the base case.{others}"
    head(figure, campaign, "One at a time", note)
    return figure
