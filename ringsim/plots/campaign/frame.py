"""Head, caption, names and colours that the figures of a campaign share."""

import itertools
import re
import textwrap
from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ringsim.analysis.courses import QUANTILES
from ringsim.analysis.design import population_of, scalars, values_of
from ringsim.analysis.intervals import quantities, varies
from ringsim.analysis.requirements import required_by
from ringsim.analysis.worst import losses
from ringsim.plots import style

LOOKS = {
    "deployed": (style.BLUE, "o"),
    "unknown": (style.BLUE, "o"),
    "finished": (style.BLUE, "o"),
    "folded": (style.SKY, "o"),
    "not latched": ("#8c6d31", "P"),
    "partly deployed": (style.ORANGE, "D"),
    "stalled": (style.VERMILLION, "s"),
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
    if (lost := losses(campaign)).note:
        subject += lost.mark
        caption += f"\n{lost.mark.strip()} {lost.note[0].upper()}{lost.note[1:]}."
    words = "\n".join(textwrap.fill(each, int(12.0 * inches)) for each in caption.split("\n"))
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


def standing(campaign: xr.Dataset) -> tuple[xr.Dataset, str]:
    """The samples that stand for the population, as statistics take them, and a word on others."""
    found = population_of(campaign)
    left = found.sizes["sample"] < campaign.sizes["sample"]
    return found, " Only the samples A and B of each block are used." if left else ""


def limits(campaign: xr.Dataset, name: str) -> list[tuple[str, float]]:
    """The least and the largest value of a number that ``[requirements]`` of the campaign allow."""
    wanted = required_by(campaign.attrs)
    return wanted[name].limits if name in wanted else []


MOST_PANELS = 9
"""Of a sheet: more could not be read."""
_APART = 1e-3
"""Range of a number over its size below which a panel of its own shows nothing: no digit of it that
tables give changes."""


def shown(campaign: xr.Dataset, most: int = MOST_PANELS, what: str = "") -> tuple[list[str], str]:
    """So many main numbers that differ between samples or have limits, and a word on others.

    ``what`` is what the figure draws of each, where that is not all.

    All count if none differs.  Those with limits go first if there are more.
    """
    limited = required_by(campaign.attrs)
    names = scalars(campaign)
    names += [
        name for name in limited
        if name in campaign and name in quantities() and name not in names
        and len(values_of(campaign, name)[1])
    ]  # fmt: skip
    known = {name: values_of(campaign, name)[1] for name in names}
    several = [name for name in names if name not in limited and len(known[name]) > 1]
    flat = [
        name for name in several
        if np.ptp(known[name]) < _APART * np.abs(known[name]).max() or not varies(campaign, name)
    ]  # fmt: skip
    told = ""
    if flat and len(flat) < len(names):
        within = f"by less than {100 * _APART:g} %, or than their numerical error"
        told = f" Not drawn, because samples differ {within}: {', '.join(flat)}."
        names = [name for name in names if name not in flat]
    if len(names) > most:
        names.sort(key=lambda name: name not in limited)
        told += f" Not drawn for want of room: {what}{', '.join(names[most:])}."
    return names[:most], told


def legend(figure: Figure, panels: Sequence[Axes], columns: int = 3) -> None:
    """One legend for all panels, each word once: not every panel has all kinds of marks."""
    words = {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    columns = max(1, min(columns, len(words)))
    figure.legend(words.values(), words.keys(), loc="outside lower center", ncols=columns)


def bands(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """``QUANTILES`` over the first axis, NaN left out; shape (5, ...)."""
    return np.asarray(np.nanquantile(values, QUANTILES, axis=0))


# Names of inputs in the width that figures have for them.


WIDE = 34
"""Letters of a line, about."""


def in_lines(name: str) -> str:
    """A name on two lines of bearable length, the path on one of its own; three would overlap."""
    name = style.plain(name)
    if len(name) <= WIDE:
        return name
    # "mean of PATH", "section 3 of PATH", and "sections 5 to 8 of PATH".
    if whole := re.fullmatch(r"(\w[\w ]* of) (\S+)", name):
        return f"{whole[1]}\n{whole[2]}"
    path, bracket, place = name.partition("[")
    # Between the parts of a path rather than within a word.
    apart = textwrap.fill(path.replace(".", ". "), WIDE).replace(". ", ".")
    return (apart if len(path) > WIDE else path) + ("\n" if bracket else "") + bracket + place
