"""Mean and 95 % quantile of the main numbers, as samples come in."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ringsim.analysis.campaign_samples import campaign_file, scalars, told, values_of
from ringsim.outputs.family import Array
from ringsim.plots import style
from ringsim.plots.campaign.frame import head

_POINTS = 400
_NORMAL = 1.96
"""Half width of a 95 % interval in standard errors."""


def running(values: Array) -> tuple[Array, Array, Array, Array]:
    """Counts, and mean, its standard error and 95 % quantile of so many first samples each."""
    counts = np.unique(np.linspace(1, len(values), min(_POINTS, len(values))).astype(int))
    mean = np.array([values[:n].mean() for n in counts])
    error = np.array([values[:n].std(ddof=1) / n**0.5 if n > 1 else np.nan for n in counts])
    quantile = np.array([np.quantile(values[:n], 0.95) for n in counts])
    return counts, mean, error, quantile


@style.styled
def convergence(campaign: xr.Dataset) -> Figure:
    """A panel a number, in the order of the samples.

    The band of two standard errors is drawn for random designs only: points of the others are
    not independent, and the formula would be wrong for them.
    """
    names = scalars(campaign)
    random = campaign_file(campaign).get("design", {}).get("kind") == "random"
    figure, panels, columns = style.new_panels(len(names), 3.7, 2.9, 1.3)
    for number, (axes, name) in enumerate(zip(panels, names, strict=True)):
        counts, mean, error, quantile = running(values_of(campaign, name)[1])
        if random:
            axes.fill_between(counts, mean - _NORMAL * error, mean + _NORMAL * error,
                              color=style.SKY, alpha=0.3, linewidth=0.0,
                              label="95 % interval of the mean")  # fmt: skip
        size = 2.5 if len(counts) < 50 else 0.0
        axes.plot(counts, mean, color=style.BLUE, label="mean", marker="o", markersize=size)
        axes.plot(counts, quantile, color=style.VERMILLION, linestyle="dashed", marker="s",
                  markersize=size, label="95 % quantile")  # fmt: skip
        axes.ticklabel_format(axis="y", useOffset=False)
        axes.set_title(style.label(campaign[name], width=42), fontsize=9.5, color=style.INK)
        if number + columns >= len(names):
            axes.set_xlabel("Samples")
        axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    most = max((len(values_of(campaign, name)[0]) for name in names), default=0)
    caption = f"{told(campaign, most)}."
    head(
        figure,
        campaign,
        "Convergence",
        caption
        if random
        else f"{caption} No interval of the mean: the points of this design are not independent.",
    )
    return figure
