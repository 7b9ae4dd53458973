"""Which V-joints lock first and last, and which never."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from ringsim.analysis.campaign_samples import told
from ringsim.analysis.quantities import good
from ringsim.outputs.family import Array
from ringsim.plots import style
from ringsim.plots.campaign.frame import head


def locks_of(campaign: xr.Dataset) -> Array:
    """Lock times of the samples whose numbers hold, (sample, plane, section), s."""
    times = campaign["lock_time"].transpose("sample", "plane", "section").to_numpy()
    return np.asarray(times[good(campaign)])


def shares(campaign: xr.Dataset) -> tuple[Array, Array, Array]:
    """How often each V-joint locks first, last and not at all, (plane, section), of all used.

    V-joints that lock at one time share it; nobody is last in a sample in which some stay open.
    """
    locks = locks_of(campaign)
    flat = locks.reshape(len(locks), -1)
    none = np.isnan(flat)
    begun, done = ~none.all(axis=1), ~none.any(axis=1)
    first, last = np.zeros(flat.shape[1]), np.zeros(flat.shape[1])
    for rows, total, extreme in ((flat[begun], first, np.nanmin), (flat[done], last, np.nanmax)):
        if len(rows):
            own = rows == extreme(rows, axis=1, keepdims=True)
            total += (own / own.sum(axis=1, keepdims=True)).sum(axis=0)
    count = max(len(flat), 1)
    first, last, never = (
        each.reshape(locks.shape[1:]) / count for each in (first, last, none.sum(axis=0))
    )
    return first, last, never


@style.styled
def lock_order(campaign: xr.Dataset) -> Figure:
    """Bars by plane and section from ``lock_time`` (sample, plane, section)."""
    sections, planes = campaign["section"].values, campaign["plane"].values.tolist()
    figure = Figure(
        figsize=(float(np.clip(0.42 * len(sections) + 2.0, 6.4, 11.0)), 1.9 * len(planes) + 1.4)
    )
    grid = figure.subplots(len(planes), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    looks = (("locks first", style.BLUE, ""), ("locks last", style.ORANGE, "//"),
             ("does not lock", style.GREY, ".."))  # fmt: skip
    drawn = [
        (look, table) for look, table in zip(looks, shares(campaign), strict=True) if table.any()
    ]
    width = 0.8 / max(len(drawn), 1)
    for row, (plane, axes) in enumerate(zip(planes, grid, strict=True)):
        for place, ((label, colour, hatch), table) in enumerate(drawn):
            at = sections + width * (place - 0.5 * (len(drawn) - 1))
            axes.bar(at, table[row], width, color=colour, hatch=hatch, edgecolor="white",
                     linewidth=0.3, label=label)  # fmt: skip
        axes.set_title(f"{plane} plane", fontsize=9.5)
        axes.grid(visible=False, axis="x")
    grid[0].set_xlim(sections[0] - 0.6, sections[-1] + 0.6)
    grid[0].yaxis.set_major_formatter(PercentFormatter(1.0))
    grid[-1].set_xlabel(style.label(campaign["section"]))
    grid[-1].xaxis.set_major_locator(MaxNLocator(20, integer=True, min_n_ticks=1))
    figure.supylabel("Share of the samples", fontsize=10.5)
    handles, labels = grid[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    locks = locks_of(campaign)
    done = int(np.isfinite(locks).all(axis=(1, 2)).sum())
    head(
        figure,
        campaign,
        "Lock order",
        f"{told(campaign, len(locks))}; all V-joints lock in {done}, only these have a last one.",
    )
    return figure
