"""Head, caption, names and colours that the figures of a campaign share."""

import itertools
import re
import textwrap
from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from numpy.typing import NDArray

from ringsim.analysis.campaign_notes import MARK, NOTE, attributes, doubted, off_counts, off_note
from ringsim.analysis.courses import QUANTILES, ends
from ringsim.analysis.design import (
    by_path,
    called,
    endings,
    inputs,
    judged_by,
    placement,
    population_of,
    scalars,
    values_of,
)
from ringsim.analysis.intervals import (
    ALIKE,
    good,
    hardly_apart,
    is_moment,
    quantities,
    tells_of,
    used,
    varies,
)
from ringsim.analysis.requirements import required_by, without_twins
from ringsim.analysis.worst import labels, limited, one_at_a_time
from ringsim.outputs.base import DOUBT
from ringsim.outputs.family import VARIABLES, Array
from ringsim.plots import style
from ringsim.scene import scene_from_toml
from ringsim.tables import Table

LOOKS = {
    "deployed": (style.BLUE, "o"),
    "unknown": (style.BLUE, "o"),
    "finished": (style.BLUE, "o"),
    "folded": (style.SKY, "o"),
    "not latched": ("#8c6d31", "P"),
    "partly deployed": (style.ORANGE, "D"),
    "stalled": (style.VERMILION, "s"),
    "overloaded": (style.PURPLE, "^"),
    "slackened": ("#b8860b", "<"),
    "cut off": (style.GREEN, "v"),
}
"""Colour and marker of an ending; the marker tells what the colour may not."""
FAILED = tuple((style.INK, marker) for marker in "x+1234")


def looks_of(words: NDArray[np.str_]) -> dict[str, tuple[str, str]]:
    """Colour and marker of the endings that are there, by word, in their order."""
    others = sorted(set(words.tolist()) - LOOKS.keys())
    looks = LOOKS | dict(zip(others, itertools.cycle(FAILED), strict=False))
    return {word: look for word, look in looks.items() if (words == word).any()}


_LINE = 0.16
"""Height of a line of a caption in inch; a sheet has room for two."""


def head(figure: Figure, campaign: xr.Dataset, subject: str, caption: str) -> None:
    """Subject and campaign above the sheet, the number of samples and their fate below it."""
    inches = figure.get_size_inches()[0]
    says = attributes(campaign)
    if note := says[NOTE]:
        subject += MARK
        caption += f"\n{MARK.strip()} {note[0].upper()}{note[1:]}."
    (marked, *_) = doubted(Table((), (), [caption]), says).notes
    if mark_panels(figure, off_counts(says)) or marked != caption:
        caption = f"{marked}\n{off_note(says)}."
    held = caption.replace(" %", f"{style.FIXED}%")
    words = "\n".join(textwrap.fill(each, int(12.0 * inches)) for each in held.split("\n"))
    words = words.replace(style.FIXED, " ")
    figure.set_figheight(figure.get_figheight() + _LINE * max(0, words.count("\n") - 1))
    name = str(campaign.attrs.get("title", "")).strip()
    style.title(figure, textwrap.fill(f"{subject}: {name}".rstrip(": "), int(10.3 * inches)))
    if figure.legends:  # what stands outside of the axes twice would stand on one another
        (legend,) = figure.legends
        legend.set_title(words)
        legend.get_title().set_fontsize(9)
        legend.get_title().set_color(style.GREY)
    else:
        figure.supxlabel(words, x=0.012, ha="left", fontsize=9, color=style.GREY)


_TOLD_APART = 12
"""Letters of a name that is cut from which on it is that of one output."""


def mark_panels(figure: Figure, names: Collection[str]) -> bool:
    """Mark panels and axes that are of outputs which may be off; whether there are any."""
    both = [(VARIABLES[n], VARIABLES.get(VARIABLES[n].largest_of or VARIABLES[n].least_of))
            for n in names]  # fmt: skip
    words = [style.meaning(e.long_name.lower()) for pair in both for e in pair if e is not None]
    texts = [
        text for axes in figure.axes
        for text in (*_titles(axes), axes.xaxis.label, axes.yaxis.label)
    ]  # fmt: skip
    texts += [figure._supylabel] if figure._supylabel else []  # type: ignore[attr-defined]
    found = []
    for text in texts:
        told = " ".join(text.get_text().lower().split())
        begun = told.partition("...")[0].strip() if "..." in told else ""  # words that are cut
        cut = len(begun) >= _TOLD_APART and any(w.startswith(begun) for w in words)
        if cut or any(w in told for w in words) or told.split(" ")[0] in names:
            found.append(text)
    for text in found:
        own, count, more = text.get_text().partition("\nn = ")  # behind the name, not the count
        text.set_text(f"{own}{DOUBT}{count}{more}")
    return bool(found)


def _titles(axes: Axes) -> list[Text]:
    """The titles of a panel on the left and in the middle."""
    own = [axes.get_title(loc=side) for side in ("left", "center")]
    return [text for text in axes.findobj(Text) if text.get_text() and text.get_text() in own]


def standing(campaign: xr.Dataset) -> tuple[xr.Dataset, str]:
    """The samples that stand for the population, as statistics take them, and a word on others."""
    found = population_of(campaign)
    left = found.sizes["sample"] < campaign.sizes["sample"]
    return found, " Only the samples A and B of each block are used." if left else ""


def limits(campaign: xr.Dataset, name: str) -> list[tuple[str, float]]:
    """The least and the largest value of a number that ``[requirements]`` of the campaign allow."""
    wanted = required_by(campaign.attrs)
    return wanted[name].limits if name in wanted else []


def allowables(campaign: xr.Dataset) -> dict[str, float]:
    """What limits of the scene allow of the largest values of loads, by output; not of limits that
    are drawn, and differ from sample to sample.
    """
    if not (text := str(campaign.attrs.get("scene", ""))):
        return {}
    scene = scene_from_toml(text, source="attribute scene")
    drawn = by_path(campaign)
    found = {
        name: getattr(scene.limits, limit) for limit, name, _ in limited()
        if name in campaign and f"limits.{limit}" not in drawn
    }  # fmt: skip
    return {name: float(limit) for name, limit in found.items() if limit is not None}


def at_or_below(campaign: xr.Dataset, name: str) -> tuple[Array, Array]:
    """Values of a number in order, and the share of samples at or below none of them, the first,
    the second, ..., one more than there are values.

    Samples that ended before what it is about happened count as worse than all values: below them
    where small ones are bad, or a requirement forbids these alone.
    """
    values = np.sort(values_of(campaign, name)[1])
    of = int(tells_of(campaign, name).sum())
    forbidden = [word for word, _ in limits(campaign, name)]
    small_is_bad = forbidden == ["min"] if forbidden else VARIABLES[name].badness < 0
    below = (of - len(values)) * small_is_bad
    return values, (below + np.arange(len(values) + 1)) / max(of, 1)


MOST_PANELS = 9
"""Of a sheet: more could not be read."""


def drawable(campaign: xr.Dataset) -> list[str]:
    """Main numbers, and whatever else tables have that differs between samples, or is limited;
    nothing twice.
    """
    limited, names = required_by(campaign.attrs), scalars(campaign)
    return without_twins(campaign, names + [
        name for name, variable in quantities().items()
        if name not in names and name in campaign and len(values_of(campaign, name)[1])
        and (name in limited or (
            variable.dtype != "str" and not is_moment(name) and varies(campaign, name)
        ))
    ], limited)  # fmt: skip


def shown(campaign: xr.Dataset, most: int = MOST_PANELS, what: str = "") -> tuple[list[str], str]:
    """So many numbers that differ between samples or have limits, and a word on others.

    ``what`` is what the figure draws of each, where that is not all.

    All count if none differs.  Those with limits, of the campaign or of the scene, go first; if
    there are more, then what every campaign is asked for, and those that differ most for their
    size.
    """
    limited, names = required_by(campaign.attrs) | allowables(campaign), drawable(campaign)
    flat, told = still(campaign, names)
    names = [name for name in names if name not in flat]
    names.sort(key=lambda name: name not in limited)
    if len(names) > most:
        order = sorted(names, key=lambda name: (
            name not in limited, name not in _ASKED, -_spread(campaign, name)
        ))  # fmt: skip
        others = [name for name in names if name in order[most:]]
        told += f" Not drawn for want of room: {what}{', '.join(others)}."
        names = [name for name in names if name not in others]
    return names, told


_ASKED = ("deployment_time", "asynchrony_max", "peak_tension")
"""How long, how far out of step, how hard."""


def _spread(campaign: xr.Dataset, name: str) -> float:
    """Range of a number over its size."""
    values = values_of(campaign, name)[1]
    return float(np.ptp(values) / np.abs(values).max()) if values.any() else 0.0


def still(
    campaign: xr.Dataset, names: Sequence[str], others: Sequence[str] = ()
) -> tuple[list[str], str]:  # fmt: skip
    """Those of some numbers that differ so little between samples that no figure shows it, and a
    sentence that says so of them and of ``others``; none if all do, or where something is required
    of them.
    """
    limited = required_by(campaign.attrs) | allowables(campaign)
    known = {name: values_of(campaign, name)[1] for name in names if name not in limited}
    flat = [
        name for name, values in known.items() if len(values) > 1
        and (hardly_apart(values.min(), values.max()) or not varies(campaign, name))
    ]  # fmt: skip
    flat = [] if len(flat) == len(names) else flat
    told = dict.fromkeys([*flat, *others])
    return flat, f" Not drawn, because {ALL_ALIKE}: {', '.join(told)}." * bool(told)


ALL_ALIKE = (
    f"samples differ by less than {100 * ALIKE:g} %, or are no farther from the mean than the "
    "numerical error"
)


def legend(figure: Figure, panels: Sequence[Axes], columns: int = 3) -> None:
    """One legend for all panels, each word once: not every panel has all kinds of marks."""
    words = {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    entries(figure, [*words.values()], [*words], columns)


def entries(figure: Figure, handles: Sequence[Any], words: Sequence[str], columns: int = 3) -> None:
    """A legend below the panels, in so many columns at most as the sheet has room for."""
    longest = max(map(len, words), default=0)
    fitting = int(figure.get_size_inches()[0] / (_LETTER * longest + _HANDLE))
    columns = max(1, min(columns, len(words), fitting))
    figure.legend(handles, words, loc="outside lower center", ncols=columns)


_LETTER, _HANDLE = 0.085, 0.65
"""Widths in inch of a letter of a legend, and of its line and the blanks around it."""


_NEARLY_ALL, _FURTHER = 0.95, 1.25
"""Share of the samples that are over where time axes may end, and how much later they do."""


def shown_until(campaign: xr.Dataset) -> tuple[float, str]:
    """Time (s) up to which courses are drawn, and a sentence on samples that ran on: a few that
    stall need not squeeze all others.  Infinity and nothing where no sample does.
    """
    if not {"final_time", "deployment_time"} <= set(campaign.data_vars):
        return np.inf, ""
    over = ends(campaign)[good(campaign)]
    until = _FURTHER * np.quantile(over, _NEARLY_ALL, method="higher") if over.size else np.inf
    if not (later := int((over > until).sum())):
        return np.inf, ""
    left = "1 sample goes" if later == 1 else f"{later} samples go"
    return float(until), f" Time ends at {until:.3g} s: {left} on, until {over.max():.4g} s."


def bands(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """``QUANTILES`` over the first axis, NaN left out; shape (5, ...)."""
    return np.asarray(np.nanquantile(values, QUANTILES, axis=0))


# The sample in the middle: of runs that last for 28 to 42 s the medians at each time are of no
# ring, and lie far below what every one of them has.


def middles(campaign: xr.Dataset, words: NDArray[np.str_]) -> dict[str, int]:
    """By word the sample in the middle of those that have it, by what samples are judged by; of
    words without a value none.  ``words`` has one of each sample.
    """
    if not (name := judged_by(campaign)):
        return {}
    samples, values = values_of(campaign, name)
    samples = samples[np.argsort(VARIABLES[name].badness * values, kind="stable")]
    sorts = words[np.searchsorted(campaign["sample"].to_numpy(), samples)]
    found = {word: samples[sorts == word] for word in dict.fromkeys(sorts.tolist())}
    return {word: int(own[(len(own) - 1) // 2]) for word, own in found.items()}


def middle_told(campaign: xr.Dataset, of: str) -> str:
    """What the line of a sample in the middle ``of`` some is, as the end of a sentence."""
    return f"the sample whose {judged_by(campaign)} is the median of {of}"


# Cases that stand for no population: each is drawn, and nothing is told of all of them together.


_FEW = 8
"""Cases up to which each has a colour and a name of its own."""
_OWN = (style.BLUE, style.ORANGE, style.GREEN, style.VERMILION, style.PURPLE, style.SKY, "#8c6d31")
_LONGEST = 26
"""Letters of the name of a move."""


def of_cases(campaign: xr.Dataset) -> bool:
    """Whether a design chose the samples, which have neither a median nor quantiles then."""
    placed = placement(campaign)
    return bool(placed.kind) and not placed.population


def base_of(campaign: xr.Dataset) -> int | None:
    """The base case of a design that changes one input at a time, if it is there and holds."""
    return 0 if one_at_a_time(campaign) and 0 in used(campaign)["sample"] else None


def looks_of_cases(campaign: xr.Dataset, samples: NDArray[np.int64]) -> list[dict[str, Any]]:
    """How the line of each of some samples looks: heavy that of the base case, thin all others.

    The label is the ending; of few cases the case with its ending.  Empty if the samples stand for
    a population.
    """
    if not of_cases(campaign):
        return []
    at = np.searchsorted(campaign["sample"].to_numpy(), samples)
    ends, base, few = endings(campaign)[at], base_of(campaign), len(samples) <= _FEW
    shown, own, found = looks_of(ends), itertools.cycle(_OWN), list[dict[str, Any]]()
    single = one_at_a_time(campaign)
    every = campaign["sample"].values.tolist()
    told = zip(*(v.values for v in labels(campaign)), strict=True)
    names = [", ".join(map(str, own)) for own in told]
    words = moves(campaign)[0] if few and single else names or [f"sample {k}" for k in every]
    for place, sample, end in zip(at.tolist(), samples.tolist(), ends.tolist(), strict=True):
        if sample == base:
            look = {"color": style.INK, "linewidth": 2.4, "zorder": 3.5}
            found.append(look | {"label": f"base case ({end})"})
        elif few:
            name = short(words[place])
            look = {"color": next(own), "linewidth": 1.2, "zorder": 3}
            found.append(look | {"label": f"{style.plain(name)} ({end})"})
        else:
            look = {"color": shown[end][0], "linewidth": 0.7, "alpha": 0.7, "zorder": 3}
            found.append(look | {"label": f"{end} ({(ends == end).sum()})"})
    return found


def lines_told(campaign: xr.Dataset) -> str:
    """What the lines of cases are, as a sentence."""
    heavy = ", the heavy one the base case" if base_of(campaign) is not None else ""
    return f" Each line is one sample{heavy}."


def moves(campaign: xr.Dataset) -> tuple[list[str], list[str]]:
    """Of each sample what it has other than the first one, in words, and the input that moved;
    "base" and "" of the first.
    """
    count = campaign.sizes["sample"]
    found, moved = [list[str]() for _ in range(count)], [""] * count
    for name in inputs(campaign):
        values = campaign[name].to_numpy()
        rows = values.reshape(len(values), -1)
        for sample, place in zip(*np.nonzero(rows != rows[0]), strict=True):
            one, base = rows[sample, place], rows[0, place]
            found[sample].append(_word(campaign[name], one, base, int(place)))
            moved[sample] = name
    return [", ".join(words) or "base" for words in found], moved


def _word(variable: xr.DataArray, value: object, base: object, place: int) -> str:
    """The place of an input of many; of a single one the last part of its path with the value, of
    a table with what in it is new.
    """
    if variable.ndim > 1:
        dim = str(variable.dims[1])
        named = f"{dim}_name" if f"{dim}_name" in variable.coords else dim
        if named in variable.coords:
            return str(variable[named].values[place])
        return f"{dim} {place + 1}"
    last = called(variable).rpartition(".")[2]
    if isinstance(value, float):
        return f"{last} {value:.4g}"
    old = set(re.split(r"[(),]+ ?", str(base)))
    new = [word for word in re.split(r"[(),]+ ?", str(value)) if word and word not in old]
    told = ", ".join(new).replace("=", " ") or str(value)
    return told if new and last == "faults" else f"{last} {told}"  # its kind says what it is


def short(name: str) -> str:
    """A name without its middle if it is long: moves of one input differ at the end."""
    half = (_LONGEST - 3) // 2
    return name if len(name) <= _LONGEST else f"{name[:half]}...{name[-half:]}"


# Names of inputs in the width that figures have for them.


WIDE = 34
"""Letters of a line, about."""


def in_lines(name: str) -> str:
    r"""A name on two lines of bearable length, the path on one of its own; three would overlap.

    >>> in_lines("difference of cables.upper/lower.winch.winding.stall_torque")
    'difference of cables.upper/lower.\nwinch.winding.stall_torque'
    """
    name = style.plain(name)
    if len(name) <= WIDE:
        return name
    # "mean of PATH", "section 3 of PATH", and "sections 5 to 8 of PATH".
    if whole := re.fullmatch(r"(\w[\w ]* of) (\S+)", name):
        if len(whole[2]) <= WIDE:
            return f"{whole[1]}\n{whole[2]}"
        breaks = [each.end() for each in re.finditer(r" of |\.", name)]
        at = min(breaks, key=lambda at: max(at, len(name) - at))
        return f"{name[:at].rstrip()}\n{name[at:]}"
    path, bracket, place = name.partition("[")
    # Between the parts of a path rather than within a word.
    apart = textwrap.fill(path.replace(".", ". "), WIDE).replace(". ", ".")
    return (apart if len(path) > WIDE else path) + ("\n" if bracket else "") + bracket + place
