"""What every single change of a one-at-a-time design does to the main numbers."""

import itertools
import re
import textwrap

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ringsim.analysis.campaign_samples import (
    called,
    endings,
    inputs,
    scalars,
    told,
    values_of,
)
from ringsim.analysis.design import placement
from ringsim.analysis.quantities import ran
from ringsim.plots import style
from ringsim.plots.campaign.frame import FAILED, LOOKS, head

_MOST_NAMED = 72
"""Moves up to which each has its name on the axis."""
_WIDEST = 26


def is_one_by_one(campaign: xr.Dataset) -> bool:
    """Whether inputs were moved one at a time, and something came of it."""
    kind = placement(campaign).kind
    return kind == "one-at-a-time" and bool(scalars(campaign)) and bool(inputs(campaign))


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
    return f"{last} {', '.join(new) or value}"


@style.styled
def one_by_one(campaign: xr.Dataset) -> Figure:
    """A panel a main number, a mark a move in the order of the design; the line is the base case.

    Colour and marker say how the sample ended.
    """
    names, ends = scalars(campaign), endings(campaign)
    words, moved = moves(campaign)
    samples, has_run = campaign["sample"].to_numpy(), ran(campaign)
    figure = Figure(figsize=(9.6, 1.75 * len(names) + 2.4))
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    others = sorted(set(ends.tolist()) - LOOKS.keys())
    looks = LOOKS | dict(zip(others, FAILED, strict=False))
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
            colour, marker = looks.get(word, FAILED[0])
            axes.scatter(at[own], values[own], s=22, color=colour, marker=marker, zorder=3,
                         label=f"{word} ({(ends == word).sum()})")  # fmt: skip
        axes.ticklabel_format(axis="y", useOffset=False)
        axes.yaxis.set_major_locator(MaxNLocator(4))
        text = str(campaign[name].attrs.get("long_name", name))
        units = str(campaign[name].attrs.get("units", "1"))
        axes.set_title(text + ("" if units == "1" else f" ({units})"), fontsize=9.5)
    places = named(len(samples))
    names_shown = [textwrap.shorten(words[k], _WIDEST, placeholder=" ...") for k in places]
    panels[-1].set_xticks(places, names_shown, rotation=90, fontsize=8 if len(places) < 60 else 7)
    panels[-1].set_xlim(-0.7, len(samples) - 0.3)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(labels)))
    counted = max(len(values_of(campaign, name)[0]) for name in names)
    head(
        figure, campaign, "One at a time",
        f"{told(campaign, counted)}. Line: the first sample, the base case.",
    )  # fmt: skip
    return figure
