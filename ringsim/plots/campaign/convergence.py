"""Mean and 95 % quantile of the main numbers, as samples come in."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from ringsim.analysis.campaign_samples import scalars, told, values_of
from ringsim.analysis.design import placement
from ringsim.analysis.intervals import of_independent, quantile
from ringsim.outputs.family import Array
from ringsim.plots import style
from ringsim.plots.campaign.frame import head, legend

_POINTS = 400
_INTERVALS = 20
"""Points of the band: each costs a bootstrap."""


def _counts(samples: int, most: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(1, samples, min(most, samples)).astype(int))


def running(values: Array) -> tuple[NDArray[np.int64], Array, Array]:
    """Counts, and mean and 95 % quantile of so many first samples each."""
    counts = _counts(len(values), _POINTS)
    mean = np.array([values[:n].mean() for n in counts])
    return counts, mean, np.array([quantile(values[:n], 0.95) for n in counts])


def band(values: Array) -> tuple[NDArray[np.int64], Array]:
    """Counts, and the interval of the mean that the analysis gives for so many first samples,
    shape (counts, 2); only counts that have one.
    """
    counts = _counts(len(values), _INTERVALS)
    ends = np.array([of_independent(values[:n], np.mean) for n in counts])
    known = np.isfinite(ends).all(axis=1)
    return counts[known], ends[known]


@style.styled
def convergence(campaign: xr.Dataset) -> Figure:
    """A panel a number, in the order of the samples.

    The interval of the mean is drawn for random designs only: points of the others are not
    independent, and it would be wrong for their first ones.
    """
    names = scalars(campaign)
    random = placement(campaign).independent
    figure, panels, columns = style.new_panels(len(names), 3.7, 2.9, 1.3)
    for number, (axes, name) in enumerate(zip(panels, names, strict=True)):
        values = values_of(campaign, name)[1]
        counts, mean, upper = running(values)
        if random and len((known := band(values))[0]):
            axes.fill_between(known[0], *known[1].T, color=style.SKY, alpha=0.3, linewidth=0.0,
                              label="95 % interval of the mean")  # fmt: skip
        size = 2.5 if len(counts) < 50 else 0.0
        axes.plot(counts, mean, color=style.BLUE, label="mean", marker="o", markersize=size)
        axes.plot(counts, upper, color=style.VERMILLION, linestyle="dashed", marker="s",
                  markersize=size, label="95 % quantile")  # fmt: skip
        axes.ticklabel_format(axis="y", useOffset=False)
        words = f"{style.label(campaign[name], width=42)}\nn = {len(values)}"
        axes.set_title(words, fontsize=9.5, color=style.INK)
        if number + columns >= len(names):
            axes.set_xlabel("Samples")
        axes.xaxis.set_major_locator(MaxNLocator(5, integer=True, min_n_ticks=1))
    legend(figure, panels)
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
