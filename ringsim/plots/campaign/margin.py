"""The margin of the drive: the smallest of each sample by its ending, and its course."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ringsim.analysis.campaign_samples import endings, requirements_of, values_of
from ringsim.outputs.family import Array
from ringsim.plots import style
from ringsim.plots.campaign.by_ending import bands_by_ending, chosen, counted
from ringsim.plots.campaign.frame import FAILED, LOOKS, head

_GOLDEN = 0.618034
"""Multiples of it fill a row evenly, whatever the number of marks."""
_ANGLES = 161


@style.styled
def margin(campaign: xr.Dataset) -> Figure:
    """``least_drive_margin`` (sample) by ending; below, ``drive_margin`` (sample, time) over the
    mean opening angle.
    """
    figure = Figure(figsize=(8.6, 6.2))
    upper, lower = figure.subplots(2, 1, height_ratios=(2, 3))
    samples, values = values_of(campaign, "least_drive_margin")
    _strips(upper, campaign, samples, values)
    read, words = chosen(campaign, ["drive_margin", "opening_angle"])
    angles = read["opening_angle"].mean(("plane", "section")).transpose("sample", "time").to_numpy()
    margins = read["drive_margin"].transpose("sample", "time").to_numpy()
    rows = [_over_angle(*each) for each in zip(angles, margins, strict=True)]
    grid = _grid(rows)
    bands_by_ending(lower, grid, np.array([_laid(grid, *row) for row in rows]), words)
    least = float(values.min())
    lower.set_ylim(min(-0.1, 1.08 * least), max(1.0, 1.5 * abs(least)))
    lower.axhline(0.0, color=style.VERMILLION, linewidth=1.0, linestyle=(0, (4, 3)))
    lower.set_ylabel("Margin of the drive")
    lower.set_xlabel("Mean opening angle (degree)")
    handles, labels = lower.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=max(1, min(4, len(labels))))
    note = f"{counted(campaign, words)} Dashed: the margin of 0 that the standard requires."
    head(figure, campaign, "Drive margin", note)
    return figure


def _strips(axes: Axes, campaign: xr.Dataset, samples: Array, values: Array) -> None:
    """A row an ending, a mark a sample at its smallest margin; limits of the campaign."""
    words = endings(campaign)[np.searchsorted(campaign["sample"].to_numpy(), samples)]
    others = sorted(set(words.tolist()) - LOOKS.keys())
    looks = LOOKS | dict(zip(others, FAILED, strict=False))
    shown = [word for word in looks if (words == word).any()]
    for row, word in enumerate(shown):
        own = values[words == word]
        heights = row + 0.5 * (np.arange(len(own)) * _GOLDEN % 1.0 - 0.5)
        colour, marker = looks[word]
        axes.scatter(own, heights, s=22, color=colour, marker=marker, alpha=0.7, linewidths=0.5,
                     rasterized=len(own) > 500)  # fmt: skip
    axes.set_yticks(range(len(shown)), [f"{word} ({(words == word).sum()})" for word in shown])
    axes.set_ylim(len(shown) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    wanted = requirements_of(campaign).get("least_drive_margin", {})
    for limit in [float(wanted[word]) for word in ("min", "max") if word in wanted]:
        axes.axvline(limit, color=style.VERMILLION, linewidth=1.3)
        axes.annotate(f"required {limit:g}", (limit, 1.0), rotation=0, ha="center", va="bottom",
                      color=style.VERMILLION, fontsize=9,
                      xycoords=axes.get_xaxis_transform())  # fmt: skip
    if values.size and values.min() < 0.0 < values.max():
        axes.axvline(0.0, color=style.VERMILLION, linewidth=1.0, linestyle=(0, (4, 3)))
    axes.set_xlabel(style.label(campaign["least_drive_margin"]))


def _over_angle(angle: Array, margins: Array) -> tuple[Array, Array]:
    """Both as long as the ring opens, the angle growing."""
    known = np.isfinite(angle) & np.isfinite(margins)
    angle, margins = angle[known], margins[known]
    grows = np.append(True, angle[1:] > np.maximum.accumulate(angle)[:-1])[: len(angle)]
    return angle[grows], margins[grows]


def _grid(rows: list[tuple[Array, Array]]) -> Array:
    known = [angle for angle, _ in rows if len(angle)]
    low = min((float(angle[0]) for angle in known), default=0.0)
    return np.linspace(low, max((float(angle[-1]) for angle in known), default=180.0), _ANGLES)


def _laid(grid: Array, angle: Array, margins: Array) -> Array:
    """NaN where a run has not been."""
    if not len(angle):
        return np.full(len(grid), np.nan)
    return np.asarray(np.interp(grid, angle, margins, left=np.nan, right=np.nan))
