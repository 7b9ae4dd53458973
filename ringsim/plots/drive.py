"""Resistance by kind against the drive, and the margin, over the opening angle."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from ringsim.plots import style

_COLOURS = (
    style.SKY, style.ORANGE, style.GREEN, style.VERMILLION, style.PURPLE, style.BLUE, style.GREY,
)  # fmt: skip


@style.styled
def drive(dataset: xr.Dataset) -> Figure:
    """``drive_available``, ``drive_resistance`` and ``drive_margin`` (time) of a run, and
    ``least_drive_margin``.

    Drawn over the mean opening angle of all V-joints, as long as it grows; resistances that drive
    are left out.
    """
    known = dataset.isel(time=np.flatnonzero(np.isfinite(dataset["drive_margin"].values)))
    angle = known["opening_angle"].mean(("plane", "section")).values
    grows = angle >= np.maximum.accumulate(angle)
    angle, known = angle[grows], known.isel(time=grows)
    figure = Figure(figsize=(8.0, 6.8))
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(5, 3))
    kinds = [k for k in known["resistance"].values if (known["drive_resistance"].sel(
        resistance=k) > 0.0).any()]  # fmt: skip
    heights = [known["drive_resistance"].sel(resistance=k).clip(min=0.0) for k in kinds]
    if kinds:
        upper.stackplot(
            angle, *(each.values for each in heights), labels=kinds,
            colors=[_COLOURS[k % len(_COLOURS)] for k in range(len(kinds))], alpha=0.7,
        )  # fmt: skip
    upper.plot(
        angle, known["drive_available"], color=style.INK, label="drive without pulleys' loss"
    )
    upper.set_ylim(bottom=0.0)
    upper.set_ylabel(f"Force on the opening angle ({known['drive_available'].attrs['units']})")
    figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    margin = known["drive_margin"].values
    lower.plot(angle, margin, color=style.BLUE)
    lower.axhline(0.0, color=style.VERMILLION, linewidth=1.0, linestyle=(0, (4, 3)))
    names = ("least_drive_margin_angle", "least_drive_margin")
    where, least = (float(dataset[name]) for name in names)
    lower.plot(where, least, "o", color=style.VERMILLION, markersize=6, zorder=4)
    lower.annotate(
        f"least margin {least:.2f} at {where:.0f} deg", (0.98, 0.95),
        xycoords="axes fraction", ha="right", va="top",
    )  # fmt: skip
    lower.set_ylim(min(-0.2, 1.1 * least), _roof(margin))
    lower.set_ylabel("Margin by the standard")
    lower.set_xlabel("Mean opening angle (deg)")
    style.head(figure, upper, dataset, "Drive and resistance")
    return figure


def _roof(margin: np.ndarray) -> float:
    """Where the axis of the margin ends: a margin without resistance has no bound."""
    return float(max(1.3 * np.median(margin), 2.0 * margin.min(), 0.5))
