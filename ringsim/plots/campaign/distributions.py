"""Cumulative distribution of the main numbers, with the limits that the campaign sets them."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from ringsim.analysis.campaign_samples import requirements_of, scalars, told, values_of
from ringsim.analysis.intervals import quantile
from ringsim.analysis.quantities import tells_of
from ringsim.outputs.family import Array
from ringsim.plots import style
from ringsim.plots.campaign.frame import head, standing

_LEVELS = [0.05, 0.5, 0.95]
"""Where dots are."""
_STEPS = 2000
"""Steps of a curve at most: more than a figure resolves."""


def limits(campaign: xr.Dataset, name: str) -> list[tuple[str, float]]:
    """The least and the largest value of a number that ``[requirements]`` of the campaign allow."""
    wanted = requirements_of(campaign).get(name, {})
    return [(word, float(wanted[word])) for word in ("min", "max") if word in wanted]


def points(values: Array, of: int) -> tuple[Array, Array]:
    """Quantiles of ``_LEVELS`` and their levels, of so many samples of which some have no value.

    Those count as beyond all values; quantiles that lie among them are left out.
    """
    # Places among all, as places among those that have a value.
    places = np.array(_LEVELS) * (of - 1) / max(len(values) - 1, 1)
    known = places <= 1.0
    return quantile(values, places[known].tolist()), np.array(_LEVELS)[known]


@style.styled
def distributions(campaign: xr.Dataset) -> Figure:
    """Share of the samples at or below each value, a step a sample; dots at 5, 50 and 95 %.

    Samples whose run ended before what a number is about happened count, too, as they do in
    verdicts: their curve ends below 100 %.
    """
    campaign, blocks = standing(campaign)
    names = scalars(campaign)
    figure, panels, columns = style.new_panels(len(names), 3.7, 3.0, 0.9)
    short, limited = False, any(limits(campaign, name) for name in names)
    for number, (axes, name) in enumerate(zip(panels, names, strict=True)):
        values = np.sort(values_of(campaign, name)[1])
        of = int(tells_of(campaign, name).sum())
        short = short or len(values) < of
        share = np.arange(1, len(values) + 1) / of
        shown = np.unique(np.linspace(0, len(values) - 1, min(len(values), _STEPS)).astype(int))
        axes.step(np.append(values[:1], values[shown]), np.append(0.0, share[shown]), where="post",
                  color=style.BLUE)  # fmt: skip
        if len(values) > 1:
            axes.plot(*points(values, of), "o", color=style.INK, markersize=4, clip_on=False,
                      zorder=4)  # fmt: skip
        for word, limit in limits(campaign, name):
            axes.axvline(limit, color=style.VERMILLION, linestyle=(0, (5, 2)), linewidth=1.3)
            # Above the frame, where no curve runs.
            axes.annotate(f"{word} {limit:g}", (limit, 1.0), xytext=(0, 2), ha="center",
                          color=style.VERMILLION, xycoords=axes.get_xaxis_transform(),
                          textcoords="offset points", fontsize=9)  # fmt: skip
        axes.set_ylim(0.0, 1.02)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
        style.plain_numbers(axes.xaxis)
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_xlabel(style.label(campaign[name], width=38))
        words = f"n = {len(values)} of {campaign.sizes['sample']}"
        axes.set_title(words, fontsize=9, pad=16.0 if limited else None)
        if number % columns == 0:
            axes.set_ylabel("Samples at or below")
    most = max((int(tells_of(campaign, name).sum()) for name in names), default=0)
    notes = f" Dots: quantiles of 5, 50 and 95 %.{blocks}"
    ends = (
        " Where a curve ends below 100 %, it did not happen in the other samples: they count in "
        "shares and dots, and violate limits."
    )
    head(
        figure,
        campaign,
        "Distributions",
        f"{told(campaign, most)}.{notes}{ends if short else ''}",
    )
    return figure
