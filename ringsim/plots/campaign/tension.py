"""The largest tension of each span along the cables, over all samples."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ringsim.analysis.campaign_samples import told, values_of
from ringsim.analysis.courses import ends
from ringsim.analysis.quantities import used
from ringsim.analysis.reading import blocks
from ringsim.plots import style
from ringsim.plots.campaign.frame import bands, head


def peaks(campaign: xr.Dataset) -> xr.DataArray:
    """Largest recorded tension of each span until the last lock, (sample, plane, span), N."""
    found = []
    for block in blocks(campaign, ["cable_tension", "status", "final_time", "deployment_time"]):
        own = used(block)
        until = xr.DataArray(ends(own), dims="sample")
        found.append(own["cable_tension"].where(own["time"] <= until).max("time", keep_attrs=True))
    return xr.concat(found, "sample")


@style.styled
def tension(campaign: xr.Dataset) -> Figure:
    """A panel a cable: median, 5-95 % and 0-100 % over the samples, from the winch on."""
    found = peaks(campaign)
    planes = [p for p in found["plane"].values.tolist() if found.sel(plane=p).notnull().any()]
    figure = Figure(figsize=(8.4, 2.3 * len(planes) + 1.3))
    grid = figure.subplots(len(planes), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    worst, names = _worst(campaign), ""
    for plane, axes in zip(planes, grid, strict=True):
        own = found.sel(plane=plane).transpose("sample", "span")
        own = own.dropna("span", how="all").dropna("sample", how="all")
        low, lower, middle, upper, high = bands(own.values)
        look = {"color": style.BLUE, "linewidth": 0.0}
        axes.fill_between(own["span"], low, high, alpha=0.18, label="0-100 %", **look)
        axes.fill_between(own["span"], lower, upper, alpha=0.35, label="5-95 %", **look)
        axes.plot(own["span"], middle, color=style.BLUE, marker="o", markersize=3, label="median")
        if worst in own["sample"]:
            names = f"largest tension: sample {worst}"
            axes.plot(own["span"], own.sel(sample=worst), color=style.INK, linewidth=0.9,
                      linestyle=(0, (3, 1.5)), label=names)  # fmt: skip
        axes.set_title(f"{plane} cable", fontsize=9.5)
        axes.xaxis.set_major_locator(MaxNLocator(20, integer=True, min_n_ticks=1))
    grid[0].set_ylim(bottom=0.0)  # all panels share it
    grid[-1].set_xlabel(style.label(campaign["span"]))
    figure.supylabel(style.label(found.assign_attrs(long_name="largest recorded tension")),
                     fontsize=10.5)  # fmt: skip
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    counted = int(np.isfinite(found.to_numpy()).any(axis=(1, 2)).sum())
    head(
        figure,
        campaign,
        "Tension along the cables",
        f"{told(campaign, counted)}. At recorded times until the last lock.",
    )
    return figure


def _worst(campaign: xr.Dataset) -> int:
    if "peak_tension" not in campaign:
        return -1
    samples, values = values_of(campaign, "peak_tension")
    return int(samples[np.argmax(values)]) if len(samples) else -1
