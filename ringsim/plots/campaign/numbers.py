"""Main numbers of all samples: distributions, convergence, by input, the tail."""

import math
import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from ringsim.analysis.design import (
    Placement,
    called,
    endings,
    inputs,
    judged_by,
    placement,
    scalars,
    told,
    values_of,
)
from ringsim.analysis.indices import centred_ranks
from ringsim.analysis.intervals import good, numbers, quantile, ran, tells_of
from ringsim.analysis.requirements import (
    COUNTS,
    OUTCOME,
    Requirement,
    badness_of,
    required_by,
    violations,
)
from ringsim.analysis.tails import approach, subset_simulation, tail
from ringsim.analysis.verdicts import judge
from ringsim.outputs.family import Array
from ringsim.plots import picture, style
from ringsim.plots.campaign.frame import (
    MOST_PANELS,
    WIDE,
    allowables,
    at_or_below,
    head,
    in_lines,
    legend,
    limits,
    looks_of,
    of_cases,
    shown,
    standing,
)
from ringsim.plots.campaign.tornado import is_one_by_one
from ringsim.tables import amount_text, unit_behind

_LEVELS = [0.05, 0.5, 0.95]
"""Where dots are."""
_STEPS = 2000
"""Steps of a curve at most: more than a figure resolves."""


def reached(campaign: xr.Dataset) -> bool:
    """Whether any level of a rare event has been reached."""
    return any(len(places) for places, _ in approach(campaign))


def _spread(campaign: xr.Dataset) -> bool:
    """Whether main numbers are of samples that no other figure tells better."""
    return bool(scalars(campaign)) and not reached(campaign) and not is_one_by_one(campaign)


@picture(
    "campaign", 30, "Cumulative distribution of each main number, with its limits", applies=_spread
)
def distributions(campaign: xr.Dataset) -> Figure:
    """Share of the samples at or below each value, a step a sample; dots at the quantiles of 5, 50
    and 95 % of those of a population, which are of the values alone, as in tables.

    Samples whose run ended before what a number is about happened count in the curve, too, as they
    do in verdicts: see ``at_or_below``.
    """
    campaign, blocks = standing(campaign)
    names, flat = shown(campaign)
    figure, panels, columns = style.new_panels(len(names), 3.7, 3.0, 0.9)
    short, allowed = False, allowables(campaign)
    titles, rows = list[str](), 0
    for number, (axes, name) in enumerate(zip(panels, names, strict=True)):
        values, share = at_or_below(campaign, name)
        short = short or share[0] > 0.0 or share[-1] < 1.0
        kept = np.unique(np.linspace(0, len(values) - 1, min(len(values), _STEPS)).astype(int))
        axes.step(np.append(values[:1], values[kept]), np.append(share[:1], share[kept + 1]),
                  where="post", color=style.BLUE)  # fmt: skip
        if len(values) > 1 and not of_cases(campaign):
            heights = share[0] + np.array(_LEVELS) * (share[-1] - share[0])
            axes.plot(quantile(values, _LEVELS), heights, "o", color=style.INK, markersize=4,
                      clip_on=False, zorder=4)  # fmt: skip
        words = f"n = {len(values)} of {campaign.sizes['sample']}"
        bounds = list(limits(campaign, name))
        if name in allowed and allowed[name] in [limit for _, limit in bounds]:
            pass  # required as it is allowed: one line, and one name
        elif name in allowed and _FAR * allowed[name] > np.abs(values).max(initial=0.0):
            words += f"; limit {_told(campaign[name], allowed[name])}"
        elif name in allowed:
            bounds.append(("limit", allowed[name]))
        for word, limit in bounds:
            axes.axvline(limit, color=style.VERMILION, linewidth=1.3,
                         linestyle=(0, (5, 2) if word != "limit" else (1.5, 1.5)))  # fmt: skip
        (left, right), row, before = axes.get_xlim(), -1, -1.0
        for word, limit in sorted(bounds, key=lambda bound: bound[1]):
            place = (limit - left) / (right - left)
            row = row + 1 if place - before < _NAME_WIDE and row >= 0 else 0
            rows, before = max(rows, row + 1), place
            side = "left" if place < _NEAR_END else "right" if place > 1.0 - _NEAR_END else "center"
            # Above the frame, where no curve runs, and not beyond its ends.
            axes.annotate(f"{word} {_told(campaign[name], limit)}", (limit, 1.0), ha=side,
                          color=style.VERMILION, xycoords=axes.get_xaxis_transform(), fontsize=9,
                          textcoords="offset points", xytext=(0, 2 + 12 * row))  # fmt: skip
        axes.set_ylim(0.0, 1.02)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
        style.plain_numbers(axes.xaxis)
        axes.set_xlabel(style.label(campaign[name], width=38))
        style.few_ticks(axes, whole=name in COUNTS)
        titles.append(words)
        if number % columns == 0:
            axes.set_ylabel("Samples at or below")
    for axes, words in zip(panels, titles, strict=True):
        axes.set_title(words, fontsize=9, pad=4.0 + 12.0 * rows if rows else None)
    most = max((int(tells_of(campaign, name).sum()) for name in names), default=0)
    dots = "" if of_cases(campaign) else " Dots: quantiles of 5, 50 and 95 % of the values."
    notes = f"{dots}{blocks}{flat}"
    if short:
        notes += (
            " Where a curve begins above 0 % or ends below 100 %, it did not happen in the other "
            "samples: they count as worse than all values, and violate limits."
        )
    head(figure, campaign, "Distributions", f"{told(campaign, most)}.{notes}")
    return figure


_NAME_WIDE = 0.6
"""Share of an axis that the names of two bounds take: nearer ones are on two lines."""
_NEAR_END = 0.25
"""Share of an axis from its ends within which a name centred on a limit would overhang."""
_FAR = 0.3
"""Share of an allowable below which values would stand at the edge of an axis that has both."""


def _told(variable: xr.DataArray, limit: float) -> str:
    return amount_text(limit, str(variable.attrs.get("units", "1")), "g")


_POINTS = 400
_MOST_REQUIRED, _LEAST_NUMBERS, _COLUMNS = 9, 3, 3
"""Requirements on a sheet at most, numbers for which they leave room, and panels in a row."""
_TITLE = 42
"""Letters of a title above a panel."""
_INTERVALS = 12
"""Points of the band: each costs a bootstrap."""


def _converges(campaign: xr.Dataset) -> bool:
    """Whether more samples make means and quantiles more certain."""
    return bool(scalars(campaign)) and placement(campaign).population


def _counts(samples: int, most: int) -> NDArray[np.int64]:
    # Bounds bend most where samples are few: a third of the counts grow by a ratio.
    even, early = np.linspace(1, samples, most - most // 3), np.geomspace(1, samples, most // 3)
    return np.unique(np.concatenate([even, early]).astype(int))


def running(values: Array, level: float = 0.95) -> tuple[NDArray[np.int64], Array, Array]:
    """Counts, and mean and a quantile of so many first samples each."""
    counts = _counts(len(values), _POINTS)
    mean = np.array([values[:n].mean() for n in counts])
    return counts, mean, np.array([quantile(values[:n], level) for n in counts])


def band(
    values: Array, samples: NDArray[np.int64], placed: Placement
) -> tuple[NDArray[np.int64], Array]:
    """Counts, and the interval of the mean that the analysis gives for so many first samples,
    shape (counts, 2); only counts that have one, with two samples of each replicate at least.
    """
    counts, replicate = _counts(len(values), _INTERVALS), placed.replicate_of(samples)
    if replicate is not None:
        size = placed.replicates
        told_twice = [np.bincount(replicate[:n], minlength=size).min() >= 2 for n in counts]
        counts = counts[told_twice]
    found = [placed.interval(values[:n], samples[:n], np.mean) for n in counts]
    ends = np.array(found).reshape(-1, 2)
    known = np.isfinite(ends).all(axis=1)
    return counts[known], ends[known]


def judged(
    campaign: xr.Dataset, name: str, wanted: Requirement, placed: Placement
) -> tuple[NDArray[np.int64], Array]:
    """Counts of samples that hold, and the bounds by which the analysis judges a requirement on so
    many first ones, shape (counts, 2).
    """
    place = np.flatnonzero(good(campaign))
    counts = _counts(len(place), _INTERVALS)
    until = [*(place[counts[:-1] - 1] + 1), campaign.sizes["sample"]]
    found = [judge(campaign.isel(sample=slice(n)), {name: wanted}, placed) for n in until]
    ends = [[float(each[f"probability_{end}"][0]) for end in ("lower", "upper")] for each in found]
    return counts, np.array(ends)


def _required(campaign: xr.Dataset) -> Mapping[str, Requirement]:
    """The requirements that samples can be judged by."""
    return {
        name: each for name, each in required_by(campaign.attrs).items()
        if name in campaign and (name == OUTCOME or tells_of(campaign, name)[good(campaign)].all())
    }  # fmt: skip


def _met_most(campaign: xr.Dataset, wanted: Mapping[str, Requirement]) -> list[str]:
    """Names of requirements, those that the largest share of samples meets last."""
    held = good(campaign)
    return sorted(wanted, key=lambda n: -violations(campaign, n, wanted[n])[held].sum())


@picture(
    "campaign", 100,
    "Mean, quantile at the worse end and probability of each requirement as samples come in",
    applies=_converges,
)  # fmt: skip
def convergence(campaign: xr.Dataset) -> Figure:
    """A panel a number, then one a requirement, in the order of the samples.

    Means have their interval where the design allows it, probabilities the bounds of verdicts.
    """
    placed, wanted = placement(campaign), _required(campaign)
    untold = [name for name in required_by(campaign.attrs) if name not in wanted]
    campaign, blocks = standing(campaign)
    others = _met_most(campaign, wanted)[_MOST_REQUIRED:]
    room = max(MOST_PANELS - len(wanted), _LEAST_NUMBERS)
    # Numbers fill the last row, too.
    room += -(room + len(wanted) - len(others)) % _COLUMNS
    names, flat = shown(campaign, room, "mean and quantile of ")
    if others:
        flat += (
            " Not drawn, as at least as many samples meet them as any other: the requirements of "
            f"{', '.join(others)}."
        )
        wanted = {name: each for name, each in wanted.items() if name not in others}
    if untold:
        flat += (
            f" Not drawn, as not all samples tell of them: the requirements of {', '.join(untold)}."
        )
    count = len(names) + len(wanted)
    figure, panels, _ = style.new_panels(count, 3.7, 2.9, 1.3, most=_COLUMNS)
    # The end that an engineer fears; one name for both, which are drawn alike.
    feared = required_by(campaign.attrs)
    levels = [0.05 if badness_of(name, feared) < 0 else 0.95 for name in names]
    worse = "quantile at the worse end (95 %; 5 % where less is worse)"
    if len(set(levels)) == 1:
        worse = f"{100 * levels[0]:.0f} % quantile, at the worse end"
    for axes, name, level in zip(panels, names, levels, strict=False):
        samples, values = values_of(campaign, name)
        counts, mean, far = running(values, level)
        known, ends = band(values, samples, placed)
        if len(known):
            axes.fill_between(known, *ends.T, color=style.SKY, alpha=0.3, linewidth=0.0,
                              label="95 % interval of the mean")  # fmt: skip
        size = 2.5 if len(counts) < 50 else 0.0
        axes.plot(counts, mean, color=style.BLUE, label="mean", marker="o", markersize=size)
        axes.plot(counts, far, color=style.VERMILION, linestyle="dashed", marker="s",
                  markersize=size, label=worse)  # fmt: skip
        axes.ticklabel_format(axis="y", useOffset=False)
        _named(axes, style.label(campaign[name], width=_TITLE), len(values))
    for axes, (name, each) in zip(panels[len(names) :], wanted.items(), strict=True):
        kept = ~violations(campaign, name, each)[good(campaign)]
        counts = _counts(len(kept), _POINTS)
        share = np.cumsum(kept)[counts - 1] / counts
        known, ends = judged(campaign, name, each, placed)
        axes.fill_between(known, *ends.T, color=style.GREEN, alpha=0.2, linewidth=0.0,
                          label="bounds of the probability")  # fmt: skip
        axes.plot(counts, share, color=style.GREEN, label="share that meets it")
        axes.axhline(each.probability, color=style.INK, linewidth=1.1, linestyle=(0, (4, 3)),
                     label="required probability")  # fmt: skip
        # Lines at 0 and 100 % are inside the frame, not on it.
        axes.set_ylim(max(0.0, min(share.min(), ends.min())) - 0.02, 1.02)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
        _named(axes, textwrap.fill(each.told(name), _TITLE), len(kept))
    legend(figure, panels)
    most = max((len(values_of(campaign, name)[0]) for name in names), default=0)
    caption = f"{told(campaign, most)}.{blocks}{flat}"
    if not placed.has_intervals:
        caption += " No interval of the mean: the samples of this design are not independent."
    if wanted:
        caption += " Bounds: each with the confidence of the verdict."
    head(figure, campaign, "Convergence", caption)
    return figure


def _named(axes: Axes, words: str, count: int) -> None:
    axes.set_title(f"{words}\nn = {count}", fontsize=9.5, color=style.INK)
    axes.set_xlabel("Samples")
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True, min_n_ticks=1))


_MANY = 500
"""Samples from which on marks are drawn as dots: as shapes they would make a page too large."""


def drawn(variable: xr.DataArray) -> tuple[NDArray[np.floating], list[str]]:
    """An input as one number a sample: the mean of its places, or the place of its word in the
    list that comes second, which is empty for numbers: numbers by size, then words.
    """
    values = variable.to_numpy()
    if values.dtype.kind not in "OU":
        numbers = values.astype(float)
        return (numbers if numbers.ndim == 1 else numbers.mean(axis=1)), []
    rows = values.reshape(len(values), -1).astype(str)
    texts = np.array([", ".join(dict.fromkeys(row.tolist())) for row in rows])
    place = {word: k for k, word in enumerate(sorted(set(texts.tolist()), key=_size))}
    return np.array([place[text] for text in texts.tolist()], dtype=float), [*place]


def _size(text: str) -> tuple[float, str]:
    """By what the texts of an input that may be a word are ordered."""
    try:
        return float(text), text
    except ValueError:
        return math.inf, text


_NAMED = 4
"""Inputs without a panel that are named."""


@picture(
    "campaign", 80, "The main number of each sample and its outcome, by each drawn input",
    applies=lambda c: inputs(c) and ran(c).any() and not is_one_by_one(c),
)  # fmt: skip
def by_input(campaign: xr.Dataset) -> Figure:
    """A panel an input: the main number of each sample that has run over the value drawn for it;
    of more inputs than a sheet has room for those of words and those that go with it most.

    Colour and marker say how the sample ended; samples without the number stand below the line at
    the foot of each panel.
    """
    every = campaign.sizes["sample"]
    campaign = campaign.isel(sample=np.flatnonzero(ran(campaign)))
    every_input, name = inputs(campaign), judged_by(campaign)
    names = [each for each in every_input if _of_antenna(campaign[each])] or every_input
    words = endings(campaign)
    height = np.where(good(campaign), numbers(campaign, name), np.nan)
    known = height[np.isfinite(height)]
    low, high = (known.min(), known.max()) if known.size else (0.0, 1.0)
    size = high - low or max(abs(high), 1.0)
    foot = low - 0.16 * size
    height = np.where(np.isfinite(height), height, foot)
    others = list[str]()
    if len(names) > MOST_PANELS:
        names = sorted(names, key=lambda each: -_together(drawn(campaign[each]), height))
        names, others = names[:MOST_PANELS], [called(campaign[n]) for n in names[MOST_PANELS:]]
    figure, panels, _ = style.new_panels(len(names), 3.5, 2.8, 1.4)
    for axes, each in zip(panels, names, strict=True):
        places, labels = drawn(campaign[each])
        _scatter(axes, places, height, words)
        if not known.size or (height == foot).any():
            axes.axhline(low - 0.08 * size, color=style.GREY, linewidth=0.8)
        if labels:
            _name_words(axes, labels)
        else:
            axes.ticklabel_format(axis="x", style="sci", scilimits=(-3, 4))
            axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_ylim(low - 0.24 * size, high + 0.1 * size)
        axes.set_xlabel(_label(campaign[each]), fontsize=9, labelpad=15)
    if name:
        wide = int(9.0 * figure.get_size_inches()[1])  # letters that fit beside all rows
        figure.supylabel(style.label(campaign[name], width=wide), fontsize=9)
    legend(figure, panels[:1], 4)
    lost = int((height == foot).sum())
    below = f"; the {lost} without this output are below the line" if lost else ""
    note = (
        " Inputs with many values (one a section, pulley, ...) by their mean."
        if any(campaign[n].ndim > 1 for n in names)
        else ""
    )
    if others:
        more = f" and {len(others) - _NAMED} more" * (len(others) > _NAMED)
        without = " (it counts as least where there is none)" if lost else ""
        note += (
            " Not drawn, since their rank correlation with this output is the smallest"
            f"{without}: {', '.join(others[:_NAMED])}{more}."
        )
    count = f"{len(words)} of {every} samples run" if len(words) < every else f"All {every} samples"
    # asynchrony_max, deployment_time
    judged = f"{name.removesuffix('_max').replace('_', ' ')} and outcome by input"
    subject = f"{judged[0].upper()}{judged[1:]}" if name else "Outcome by input"
    head(figure, campaign, subject, f"{count}{below}.{note}")
    return figure


_LETTERS, _LINES = 42, 22
"""Letters, 7.5 points high, side by side along an axis of inputs; lines of upright ones."""
_NARROWEST, _UPRIGHT = 10, 22
"""Letters in a line of words side by side, below which they stand upright; of upright ones."""


def _name_words(axes: Axes, labels: list[str]) -> None:
    """Ticks at words: in lines below each other where they are long, upright where many."""
    axes.set_xlim(-0.5, len(labels) - 0.5)
    width, lines = _LETTERS // len(labels) - 1, 6
    longest = max(map(len, labels))
    if upright := width < min(longest, _NARROWEST):
        width, lines = _UPRIGHT, max(1, _LINES // len(labels))
    texts = [_broken(each, width, lines) for each in labels]
    size = 9.5 if longest < 0.8 * width and not upright else 7.5
    axes.set_xticks(range(len(labels)), [style.plain(text) for text in texts],
                    rotation="vertical" if upright else "horizontal", fontsize=size)  # fmt: skip


def _broken(word: str, width: int, most: int) -> str:
    """A word in so many lines of some width: broken at a bracket, hyphens, and signs in between."""
    pieces = word.replace("(", " (", 1).split(" ")
    pieces = [each if len(each) <= width else each.replace("=", "= ") for each in pieces]
    return "\n".join(textwrap.wrap(" ".join(pieces), width, max_lines=most, placeholder=" ..."))


def _together(column: tuple[NDArray[np.floating], list[str]], height: Array) -> float:
    """Size of an input's rank correlation with a number; words have none, and come first."""
    if column[1]:
        return np.inf
    ranks = centred_ranks(np.stack([column[0], height], axis=1))
    size = np.linalg.norm(ranks, axis=0).prod()
    return float(abs(ranks[:, 0] @ ranks[:, 1]) / size) if size else 0.0


def _of_antenna(variable: xr.DataArray) -> bool:
    """Whether an input is the antenna's, not one of how it is computed."""
    return not str(variable.attrs.get("path", "")).startswith("solver.")


def _scatter(axes: Axes, x: Any, y: Any, words: NDArray[np.str_]) -> None:
    for word, (colour, marker) in looks_of(words).items():
        own = words == word
        axes.scatter(x[own], y[own], s=26, color=colour, marker=marker, alpha=0.8,
                     linewidths=1.2 if marker in "x+1234|" else 0.0,
                     label=f"{word} ({own.sum()})", zorder=3,
                     rasterized=len(words) > _MANY)  # fmt: skip


def _label(variable: xr.DataArray) -> str:
    units = str(variable.attrs.get("units", "1"))
    words = in_lines(called(variable))
    what = unit_behind(", mean" if variable.ndim > 1 else "", units)
    if len(words.rpartition("\n")[2]) + len(what) > WIDE:
        what = "\n" + what.lstrip(", ")
    return words + what


@picture(
    "campaign", 10, "Probability of what levels reached, up to the rare event", applies=reached
)
def rare_event(campaign: xr.Dataset) -> Figure:
    """Probability to be at or beyond the values that levels reached, a line a replicate; the
    event's own with its interval.
    """
    design, found = subset_simulation(campaign.attrs), tail(campaign)
    assert design is not None
    figure = Figure(figsize=(8.0, 4.6))
    axes = figure.subplots()
    lines = [each for each in approach(campaign) if len(each[0])]
    for number, (places, shares) in enumerate(lines):
        axes.plot(places, shares, color=style.BLUE, marker="o", markersize=4, linewidth=1.0,
                  alpha=0.7, label="" if number else "levels, one line per replicate")  # fmt: skip
    target = design.sign * design.target
    axes.axvline(target, color=style.VERMILION, linestyle=(0, (5, 2)), linewidth=1.3)
    probability, (low, high) = found["tail_probability"][1], found["tail_probability_interval"][1]
    if probability > 0.0 and np.isfinite([low, high]).all():
        axes.errorbar(target, probability, [[probability - low], [high - probability]],
                      color=style.INK, marker="s", markersize=6, capsize=4, zorder=4,
                      label=f"event: {probability:.2g}, 95 % {low:.2g} .. {high:.2g}")  # fmt: skip
    axes.set_yscale("log")
    axes.set_xlabel(style.label(campaign[design.of]))
    axes.set_ylabel("Probability of this or beyond")
    legend(figure, [axes], 2)
    head(figure, campaign, "Rare event", f"{told(campaign, int(good(campaign).sum()))}.")
    return figure
