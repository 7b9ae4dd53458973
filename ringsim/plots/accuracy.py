"""Error against cost: the work-precision figure of an accuracy study."""

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from ringsim.analysis.errors import OUTPUTS
from ringsim.plots import style

_LOOKS = {
    "as it stands": (style.INK, "*"),
    "steps": (style.BLUE, "o"),
    "constant step": (style.SKY, "s"),
    "elements": (style.GREEN, "D"),
    "formulation": (style.ORANGE, "^"),
    "dissipation": (style.PURPLE, "v"),
    "newton": (style.VERMILLION, "P"),
    "setting": (style.GREY, "X"),
}

_WIDE = 300.0
"""Ratio of costs from which on there is no room for numbers between powers of ten."""


@style.styled
def accuracy(found: xr.Dataset) -> Figure:
    """One panel an output: relative error over processor time.

    The line is the frontier of both engines: what settings are good for, which is no less than the
    error of any finer one.  Hollow marks are runs of the frame engine.  ``found`` is from
    ``ringsim.analysis.accuracy.judge``.
    """
    titles = OUTPUTS | {"energy": "energy balance"}
    outputs = [name for name in titles if name in found.output.values]
    figure, panels, columns = style.new_panels(len(outputs), 3.6, 3.0, 0.9, sharex=True)
    for k, (panel, name) in enumerate(zip(panels, outputs, strict=True)):
        _panel(panel, found.sel(output=name))
        style.name_panel(panel, titles[name].capitalize())
        if k % columns == 0:
            panel.set_ylabel("Relative error")
        if k + columns >= len(outputs):
            panel.set_xlabel("Processor time of the run (s)")
            panel.tick_params(labelbottom=True)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5)
    style.title(figure, str(found.attrs.get("title", "Accuracy")))
    return figure


def _panel(axes: Axes, found: xr.Dataset) -> None:
    cost, error, ladder = found.cost.values, found.error.values, found.ladder.values
    drawn, frame = np.isfinite(error) & (error > 0.0), found.fidelity.values == "frame"
    axes.loglog()
    wide = np.nanmax(cost) > _WIDE * np.nanmin(cost)
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0,) if wide else (1.0, 2.0, 5.0)))
    style.plain_numbers(axes.xaxis)
    for name, (colour, marker) in _LOOKS.items():
        for hollow in (False, True):
            there = (ladder == name) & (frame == hollow)
            if there.any():
                own, (size, order) = there & drawn, (150, 4) if marker == "*" else (34, 3)
                axes.scatter(
                    cost[own], error[own], s=size, marker=marker, edgecolors=colour,
                    facecolors="none" if hollow else colour, linewidths=1.0 if hollow else 0.0,
                    label=f"frame: {name}" if hollow else name, alpha=0.9, zorder=order,
                )  # fmt: skip
    best = found.isel(rung=found.frontier.values & (error > 0.0)).sortby("cost")
    axes.step(
        best.cost, best.bound, where="post", color=style.INK, linewidth=1.1,
        label="frontier: good for", zorder=2,
    )  # fmt: skip
    floor, known = float(found.uncertainty), error[drawn]
    if known.size or floor > 0.0:
        lowest = min(known.min(initial=np.inf), 0.5 * floor or np.inf)
        axes.set_ylim(0.4 * lowest, 30.0 * max(known.max(initial=0.0), floor))
    axes.axhspan(
        (low := axes.get_ylim()[0]), max(floor, low), color=style.PALE, zorder=0.5, linewidth=0.0,
        label="uncertainty of the reference",
    )  # fmt: skip
    if "engines_differ" in found:
        axes.axhline(
            float(found.engines_differ), color=style.GREY, linewidth=0.9, linestyle=":", zorder=1,
            label="engines differ by",
        )  # fmt: skip
