"""Torque and speed of the motors over time, by ending."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.analysis.courses import ends
from ringsim.plots import style
from ringsim.plots.campaign.by_ending import chosen, counted, over_time
from ringsim.plots.campaign.frame import head


@style.styled
def motors(campaign: xr.Dataset) -> Figure:
    """A row a motor, from ``motor_torque`` and ``motor_speed`` (sample, plane, winch, time)."""
    names = ["motor_torque", "motor_speed", "final_time", "deployment_time"]
    read, words = chosen(campaign, names)
    # Motors that have done their work stand still, and would hide those that still wind.
    read = read.where(read["time"] <= xr.DataArray(ends(read), dims="sample"))
    read = read.transpose("sample", "plane", "winch", "time")
    there = np.isfinite(read["motor_torque"].to_numpy()).any(axis=(0, 3))
    places = np.argwhere(there).tolist()
    figure = Figure(figsize=(9.2, 2.2 * len(places) + 1.3))
    grid = figure.subplots(len(places), 2, sharex=True, sharey="col", squeeze=False)
    curves = []
    for row, (plane, winch) in zip(grid, places, strict=True):
        name = f"{read['plane'].values[plane]} cable"
        name += f", winch {read['winch'].values[winch]}" if there.shape[1] > 1 else ""
        for axes, what in zip(row, ("motor_torque", "motor_speed"), strict=True):
            curves.append(read[what].to_numpy()[:, plane, winch])
            axes.set_title(name, fontsize=9.5)
            axes.set_ylabel(style.label(read[what], width=22), fontsize=9)
    over_time(figure, grid.ravel().tolist(), read, curves, words)
    grid[-1, 0].set_xlabel(style.label(read["time"]))
    head(figure, campaign, "Motors", counted(campaign, words))
    return figure
