"""A figure of measured data over the curves of a run."""

import numpy as np
from matplotlib.figure import Figure

from ringsim.analysis.residuals import Residuals
from ringsim.outputs.family import VARIABLES
from ringsim.plots import style
from ringsim.tables import unit_behind

_MOST = 12
"""Sensors that are drawn: those that fit worst."""


@style.styled
def measured_and_computed(found: list[Residuals], title: str) -> Figure:
    """A row a sensor: readings over the run's curve on the left, and on the right the readings less
    the curve in standard deviations of a reading, with a band of two.

    Numbers without a time are left out, and so are sensors beyond twelve: those that fit best.
    """
    over_time = [each for each in found if len(each.times) and np.isfinite(each.times).all()]
    shown = sorted(over_time, key=lambda each: -np.mean(each.in_deviations**2))[:_MOST]
    figure = Figure(figsize=(9.6, 1.8 * max(1, len(shown)) + 1.0))
    rows = figure.subplots(max(1, len(shown)), 2, sharex=True, squeeze=False)
    for (left, right), each in zip(rows, shown, strict=False):
        variable = VARIABLES[each.readings.sensor.variable]
        left.plot(each.times, each.measured, ".", color=style.VERMILLION, markersize=3.0,
                  label="measured", rasterized=len(each.times) > 2000)  # fmt: skip
        left.plot(each.times, each.computed, color=style.BLUE, linewidth=1.3, label="computed")
        left.set_title(each.readings.sensor.name, fontsize=9.5)
        left.set_ylabel(unit_behind("", variable.units).strip(" ()"), fontsize=9)
        right.axhspan(-2.0, 2.0, color=style.SKY, alpha=0.35, linewidth=0.0)
        right.axhline(0.0, color=style.GREY, linewidth=0.9)
        right.plot(each.times, each.in_deviations, ".", color=style.INK, markersize=2.5,
                   rasterized=len(each.times) > 2000)  # fmt: skip
        rms = float(np.sqrt(np.mean(each.in_deviations**2)))
        right.set_title(f"rms {rms:.3g} sigma", fontsize=9.5)
        right.set_ylabel("sigma", fontsize=9)
    for axes in rows[-1]:
        axes.set_xlabel("Time (s)")
    if not shown:
        rows[0][0].text(0.0, 0.5, "no reading over time lies within the run")
    else:
        rows[0][0].legend(loc="best", fontsize=8)
    left_out = len(over_time) - len(shown)
    more = f" ({left_out} sensors that fit better are not drawn)" * bool(left_out)
    style.title(figure, f"Measured and computed: {title}{more}")
    return figure
