"""Section by time: the lag of the median over the samples, and of the worst sample."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ringsim.analysis.campaign_samples import median_and_worst, told
from ringsim.analysis.courses import Courses, course, courses
from ringsim.plots import style
from ringsim.plots.campaign.frame import head
from ringsim.plots.opening_angles import LEAST_SPAN


@style.styled
def lag_map(campaign: xr.Dataset, read: Courses | None = None) -> Figure:
    """Deviation from the mean opening angle as a colour: at each place the median of all samples,
    beside the sample with the largest asynchrony, with one colour scale.  ``read`` is what
    ``courses`` gives, if it is there already.
    """
    read = courses(campaign) if read is None else read
    found = read.bands
    chosen = median_and_worst(campaign)
    columns = [("median of all samples", read.median)]
    if chosen is not None and chosen[1] in read.samples:
        one = course(campaign, chosen[1], found)
        columns.append((f"worst: sample {chosen[1]}", one))
    planes, sections = found["plane"].values.tolist(), found["section"].values
    figure = Figure(figsize=(4.9 * len(columns), 2.2 * len(planes) + 1.3))
    grid = figure.subplots(len(planes), len(columns), sharex=True, sharey=True, squeeze=False)
    time = found["time"].values
    edges = np.concatenate([time[:1], 0.5 * (time[1:] + time[:-1]), time[-1:]])
    span = max(LEAST_SPAN, *(style.largest_magnitude(values) for _, values in columns))
    for (name, values), axes_of in zip(columns, grid.T, strict=True):
        for plane, axes in zip(planes, axes_of, strict=True):
            image = axes.pcolormesh(
                edges, np.append(sections, sections[-1] + 1) - 0.5,
                values.sel(plane=plane).transpose("section", "time").values,
                cmap="PuOr_r", vmin=-span, vmax=span, rasterized=True,
            )  # fmt: skip
            axes.grid(visible=False)
            axes.set_title(f"{plane} plane, {name}", fontsize=9.5)
        axes_of[-1].set_xlabel(style.label(found["time"], width=44))
    bar = figure.colorbar(image, ax=grid.ravel().tolist(), pad=0.015)
    bar.outline.set_visible(False)
    bar.set_label(style.label(found, width=30), fontsize=9)
    grid[0, 0].yaxis.set_major_locator(MaxNLocator(10, integer=True, min_n_ticks=1))
    figure.supylabel(style.label(campaign["section"]), fontsize=10.5)
    head(figure, campaign, "Lag map", f"{told(campaign, len(read.samples))}.")
    return figure
