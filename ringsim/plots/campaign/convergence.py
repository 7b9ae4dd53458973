"""Main numbers and probabilities of requirements, as samples come in."""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter
from numpy.typing import NDArray

from ringsim.analysis.campaign_samples import requirements_of, scalars, told, values_of
from ringsim.analysis.design import Placement, placement
from ringsim.analysis.intervals import of_independent, of_replicates, quantile
from ringsim.analysis.quantities import good, tells_of
from ringsim.analysis.requirements import OUTCOME, Requirement, read_requirements
from ringsim.analysis.verdicts import judge, violations
from ringsim.outputs.family import Array
from ringsim.plots import style
from ringsim.plots.campaign.frame import head, legend, standing

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


def band(
    values: Array, samples: NDArray[np.int64], placed: Placement
) -> tuple[NDArray[np.int64], Array]:
    """Counts, and the interval of the mean that the analysis gives for so many first samples,
    shape (counts, 2); only counts that have one, with two samples of each replicate at least.
    """
    counts, replicate = _counts(len(values), _INTERVALS), placed.replicate_of(samples)
    if not placed.has_intervals:
        return counts[:0], np.empty((0, 2))
    if replicate is None:
        ends = np.array([of_independent(values[:n], np.mean) for n in counts])
    else:
        size = placed.replicates
        told_twice = [np.bincount(replicate[:n], minlength=size).min() >= 2 for n in counts]
        counts = counts[told_twice]
        ends = np.array([of_replicates(values[:n], replicate[:n], np.mean) for n in counts])
    ends = ends.reshape(-1, 2)
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
    wanted = read_requirements(requirements_of(campaign), "requirements")
    return {
        name: each for name, each in wanted.items()
        if name in campaign and (name == OUTCOME or tells_of(campaign, name)[good(campaign)].all())
    }  # fmt: skip


@style.styled
def convergence(campaign: xr.Dataset) -> Figure:
    """A panel a number, then one a requirement, in the order of the samples.

    Means have their interval where the design allows it, probabilities the bounds of verdicts.
    """
    names, placed, wanted = scalars(campaign), placement(campaign), _required(campaign)
    campaign, blocks = standing(campaign)
    count = len(names) + len(wanted)
    figure, panels, _ = style.new_panels(count, 3.7, 2.9, 1.3)
    for axes, name in zip(panels, names, strict=False):
        samples, values = values_of(campaign, name)
        counts, mean, upper = running(values)
        known, ends = band(values, samples, placed)
        if len(known):
            axes.fill_between(known, *ends.T, color=style.SKY, alpha=0.3, linewidth=0.0,
                              label="95 % interval of the mean")  # fmt: skip
        size = 2.5 if len(counts) < 50 else 0.0
        axes.plot(counts, mean, color=style.BLUE, label="mean", marker="o", markersize=size)
        axes.plot(counts, upper, color=style.VERMILLION, linestyle="dashed", marker="s",
                  markersize=size, label="95 % quantile")  # fmt: skip
        axes.ticklabel_format(axis="y", useOffset=False)
        _named(axes, style.label(campaign[name], width=42), len(values))
    for axes, (name, each) in zip(panels[len(names) :], wanted.items(), strict=True):
        kept = ~violations(campaign, name, each)[good(campaign)]
        counts = _counts(len(kept), _POINTS)
        share = np.cumsum(kept)[counts - 1] / counts
        known, ends = judged(campaign, name, each, placed)
        axes.fill_between(known, *ends.T, color=style.GREEN, alpha=0.2, linewidth=0.0,
                          label="bounds of the probability")  # fmt: skip
        axes.plot(counts, share, color=style.GREEN, label="share that keeps to it")
        axes.axhline(each.probability, color=style.INK, linewidth=1.1, linestyle=(0, (4, 3)),
                     label="required probability")  # fmt: skip
        axes.set_ylim(max(0.0, min(share.min(), ends.min()) - 0.02), 1.02)
        axes.yaxis.set_major_formatter(PercentFormatter(1.0))
        _named(axes, each.told(name), len(kept))
    legend(figure, panels)
    most = max((len(values_of(campaign, name)[0]) for name in names), default=0)
    caption = f"{told(campaign, most)}.{blocks}"
    if not placed.has_intervals:
        caption += " No interval of the mean: the points of this design are not independent."
    if wanted:
        caption += " Bounds: each with the confidence that the verdict takes."
    head(figure, campaign, "Convergence", caption)
    return figure


def _named(axes: Axes, words: str, count: int) -> None:
    axes.set_title(f"{words}\nn = {count}", fontsize=9.5, color=style.INK)
    axes.set_xlabel("Samples")
    axes.xaxis.set_major_locator(MaxNLocator(5, integer=True, min_n_ticks=1))
