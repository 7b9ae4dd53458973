"""Cumulative distribution of the main numbers, with the limits that the campaign sets them."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from ringsim.analysis.campaign_samples import requirements_of, scalars, told, values_of
from ringsim.analysis.intervals import quantile
from ringsim.plots import style
from ringsim.plots.campaign.frame import head

_LEVELS = [0.05, 0.5, 0.95]
"""Where dots are."""
_STEPS = 2000
"""Steps of a curve at most: more than a figure resolves."""


def limits(campaign: xr.Dataset, name: str) -> list[tuple[str, float]]:
    """The least and the largest value of a number that ``[requirements]`` of the campaign allow."""
    wanted = requirements_of(campaign).get(name, {})
    return [(word, float(wanted[word])) for word in ("min", "max") if word in wanted]


@style.styled
def distributions(campaign: xr.Dataset) -> Figure:
    """Share of the samples at or below each value, a step a sample; dots at 5, 50 and 95 %."""
    names = scalars(campaign)
    figure, panels, columns = style.new_panels(len(names), 3.7, 3.0, 0.9)
    for number, (axes, name) in enumerate(zip(panels, names, strict=True)):
        values = np.sort(values_of(campaign, name)[1])
        share = np.arange(1, len(values) + 1) / len(values)
        shown = np.unique(np.linspace(0, len(values) - 1, min(len(values), _STEPS)).astype(int))
        axes.step(np.append(values[:1], values[shown]), np.append(0.0, share[shown]), where="post",
                  color=style.BLUE)  # fmt: skip
        if len(values) > 1:
            axes.plot(quantile(values, _LEVELS), _LEVELS, "o", color=style.INK, markersize=4,
                      clip_on=False, zorder=4)  # fmt: skip
        for word, limit in limits(campaign, name):
            axes.axvline(limit, color=style.VERMILLION, linestyle=(0, (5, 2)), linewidth=1.3)
            axes.annotate(f"{word} {limit:g}", (limit, 0.03), rotation=90, ha="right",
                          color=style.VERMILLION, xycoords=axes.get_xaxis_transform(),
                          fontsize=9)  # fmt: skip
        axes.set_ylim(0.0, 1.02)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
        style.plain_numbers(axes.xaxis)
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_xlabel(style.label(campaign[name], width=38))
        axes.set_title(f"n = {len(values)} of {campaign.sizes['sample']}", fontsize=9)
        if number % columns == 0:
            axes.set_ylabel("Samples at or below")
    most = max((len(values_of(campaign, name)[0]) for name in names), default=0)
    head(
        figure,
        campaign,
        "Distributions",
        f"{told(campaign, most)}. Dots: quantiles of 5, 50 and 95 %, as in tables.",
    )
    return figure
