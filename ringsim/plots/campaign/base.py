"""What the base carries over time, by ending."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style
from ringsim.plots.campaign.by_ending import chosen, counted, over_time
from ringsim.plots.campaign.frame import head

_WORDS = {"base_force": "force at the base", "base_torque": "torque at the base"}


@style.styled
def base_load(campaign: xr.Dataset) -> Figure:
    """Magnitudes of ``base_force`` and ``base_torque`` (sample, axis, time)."""
    read, words = chosen(campaign, [*_WORDS])
    figure = Figure(figsize=(8.4, 5.6))
    panels = figure.subplots(2, 1, sharex=True).tolist()
    curves = []
    for axes, (name, text) in zip(panels, _WORDS.items(), strict=True):
        parts = read[name].transpose("sample", "axis", "time")
        curves.append(np.linalg.norm(parts.to_numpy(), axis=1))
        axes.set_ylabel(style.label(parts.assign_attrs(long_name=text), width=30))
        style.span_sizes(axes, curves[-1])
    over_time(figure, panels, read, curves, words)
    note = f"{counted(campaign, words)} At recorded times: peaks may be higher."
    head(figure, campaign, "What the base carries", note)
    return figure
