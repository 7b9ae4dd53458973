"""How a campaign of subset simulation came to its rare event."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.analysis.campaign_samples import told
from ringsim.analysis.quantities import good
from ringsim.analysis.tails import approach, subset_simulation, tail
from ringsim.plots import style
from ringsim.plots.campaign.frame import head


def reached(campaign: xr.Dataset) -> bool:
    """Whether any level of a rare event has been reached."""
    return any(len(places) for places, _ in approach(campaign))


@style.styled
def rare_event(campaign: xr.Dataset) -> Figure:
    """Probability to be at or beyond the values that levels reached, a line a replicate; the
    event's own with its interval.
    """
    design, found = subset_simulation(campaign), tail(campaign)
    assert design is not None
    figure = Figure(figsize=(8.0, 4.6))
    axes = figure.subplots()
    lines = [each for each in approach(campaign) if len(each[0])]
    for number, (places, shares) in enumerate(lines):
        axes.plot(places, shares, color=style.BLUE, marker="o", markersize=4, linewidth=1.0,
                  alpha=0.7, label="" if number else "levels, a line a replicate")  # fmt: skip
    target = design.sign * design.target
    axes.axvline(target, color=style.VERMILLION, linestyle=(0, (5, 2)), linewidth=1.3)
    probability, (low, high) = found["tail_probability"][1], found["tail_probability_interval"][1]
    if probability > 0.0 and np.isfinite([low, high]).all():
        axes.errorbar(target, probability, [[probability - low], [high - probability]],
                      color=style.INK, marker="s", markersize=6, capsize=4, zorder=4,
                      label=f"event: {probability:.2g}, 95 % {low:.2g} .. {high:.2g}")  # fmt: skip
    axes.set_yscale("log")
    axes.set_xlabel(style.label(campaign[design.of]))
    axes.set_ylabel("Probability of this or beyond")
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    head(figure, campaign, "Rare event", f"{told(campaign, int(good(campaign).sum()))}.")
    return figure
