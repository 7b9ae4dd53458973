"""Which inputs matter for the main numbers: bars with intervals, the longest on top."""

import textwrap
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ringsim.analysis.blocks import population_of
from ringsim.analysis.campaign_samples import scalars, told, values_of
from ringsim.analysis.design import placement
from ringsim.analysis.drawn import drawn
from ringsim.analysis.influence import LEAST, influence
from ringsim.analysis.sensitivity import sensitivity
from ringsim.plots import style
from ringsim.plots.campaign.frame import head

MEASURES = {
    "total_index": "Total Sobol' index",
    "mean_absolute_effect": "Mean absolute effect mu*",
    "given_data_index": "First-order index, from plain samples",
    "partial_rank_correlation": "Partial rank correlation",
    "rank_correlation": "Rank correlation",
}
"""What bars can show, the most telling first; a design allows some of them."""
_INSIDE = {"total_index": ("first_order_index", "first-order index")}
"""What a second, thinner bar shows beside it."""
_MOST = 8
_MOST_PANELS = 9
_WIDE = 34
_NONE = np.empty(0), np.empty((0, 2)), np.empty(0), np.empty((0, 2))


class Bars(NamedTuple):
    """Bars of one output, the longest first, at most 8; intervals NaN where there are none."""

    names: list[str]
    values: NDArray[np.floating]
    ends: NDArray[np.floating]
    """Shape (bars, 2)."""
    inside: NDArray[np.floating]
    inside_ends: NDArray[np.floating]
    chance: float
    """What would be reached by chance; NaN if that is not known."""
    told: str
    """Samples or blocks used and lost, or why there is no bar."""


def analysed(campaign: xr.Dataset) -> xr.Dataset:
    """The indices that the design of a campaign allows of its main numbers."""
    placed = placement(campaign)
    found = sensitivity(campaign, {}, placed, scalars(campaign))
    if any(name in found for name in MEASURES):
        return found
    plain = influence(population_of(campaign), {}, placed)
    return xr.merge([found, plain]) if "output" in found.dims else plain


def measure_of(analysis: xr.Dataset) -> str:
    """The most telling measure that an analysis has; empty if none."""
    for name in MEASURES:
        own = [v for key, v in analysis.items() if _is(str(key), name)]
        if any(bool(np.isfinite(each).any()) for each in own):
            return name
    return ""


def _is(variable: str, measure: str) -> bool:
    """Whether a variable is a measure, of one output or of all."""
    if measure == "rank_correlation" and variable.endswith("partial_rank_correlation"):
        return False
    return variable == measure or variable.endswith(f"_{measure}")


def bars_of(analysis: xr.Dataset, measure: str) -> Iterator[tuple[str, Bars]]:
    """The bars of every output that has some, or that the test of what is missing refuses."""
    if measure in analysis:
        for output in analysis["output"].values.tolist():
            one = analysis.sel(output=output)
            used, lost = one["index_used"].item(), one["index_lost"].item()
            (dim,) = one[measure].dims
            told = f"{'blocks' if dim == 'factor' else 'samples'}: {used} used, {lost} lost"
            if not np.isfinite(one[measure]).any():
                told = f"no index: {one['missing'].item()} samples have no value,\nby their inputs"
                told += f" (p = {max(one['missing_by_inputs'].item(), 1e-4):.1g} at most)"
            yield output, _bars(one, measure, str(dim), told)
        return
    for name in analysis.data_vars:
        output = str(name).removesuffix(f"_{measure}")
        if _is(str(name), measure) and output != name:
            one = analysis[[name, f"{name}_interval"]].rename(
                {name: measure, f"{name}_interval": f"{measure}_interval"}
            )
            yield output, _bars(one, measure, "input", "")


def _bars(one: xr.Dataset, measure: str, dim: str, told: str) -> Bars:
    values = one[measure].values
    order = np.argsort(-np.abs(np.nan_to_num(values)), kind="stable")[:_MOST]
    order = order[np.isfinite(values[order])]
    none = np.full((len(order), 2), np.nan)
    second = _INSIDE.get(measure, ("", ""))[0]
    level = one["chance_level"].values[order] if "chance_level" in one else none[:0, 0]
    return Bars(
        [str(name) for name in one[dim].values[order]], values[order],
        one[f"{measure}_interval"].values[order] if f"{measure}_interval" in one else none,
        one[second].values[order] if second else none[:, 0],
        one[f"{second}_interval"].values[order] if second else none,
        float(np.max(level, initial=0.0)) or np.nan, told,
    )  # fmt: skip


def explained(campaign: xr.Dataset) -> bool:
    """Whether there is something to draw: drawn inputs, and enough samples for a correlation.

    Told without the analysis itself, which takes a while for many samples.
    """
    known = [values_of(campaign, name)[1] for name in scalars(campaign)]
    varied = any(len(values) >= LEAST and np.ptp(values) > 0 for values in known)
    return varied and bool(drawn(campaign).names)


@style.styled
def tornado(campaign: xr.Dataset, measure: str = "") -> Figure:
    """A panel a main number, a bar an input or group; whiskers are intervals of 95 %.

    ``measure`` is a key of ``MEASURES``; by default the most telling one that the design allows.
    """
    analysis = analysed(campaign)
    measure = measure or measure_of(analysis)
    found = list(bars_of(analysis, measure))[:_MOST_PANELS] if measure else []
    found = found or [("", Bars([], *_NONE, np.nan, "no measure is known"))]
    rows = max(len(bars.names) for _, bars in found)
    figure, panels, _ = style.new_panels(len(found), 5.2, 0.9 + 0.34 * rows, 1.1, most=2)
    certain = False
    for axes, (output, bars) in zip(panels, found, strict=True):
        _draw(axes, bars, measure)
        certain = certain or bool(np.isfinite(bars.ends).any())
        words = style.label(campaign[output], width=42) if output in campaign else output
        axes.set_title(words, fontsize=9.5, color=style.INK)
        units = campaign[output].attrs.get("units", "1") if output in campaign else "1"
        unit = f" ({units})" if measure == "mean_absolute_effect" and units != "1" else ""
        below = f"\n{bars.told}" if bars.told and bars.names else ""
        axes.set_xlabel(f"{MEASURES.get(measure, '')}{unit}{below}", fontsize=9)
    legends = [axes.get_legend_handles_labels() for axes in panels]
    handles, labels = max(legends, key=lambda each: len(each[1]))
    if len(labels) > 1:
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
    whiskers = "Whiskers: intervals of 95 %." if certain else "The design allows no intervals."
    most = max((len(values_of(campaign, name)[0]) for name in scalars(campaign)), default=0)
    caption = f"{told(campaign, most)}. {whiskers} The longest {_MOST} bars at most."
    head(figure, campaign, "What matters", caption)
    return figure


def _draw(axes: Axes, bars: Bars, measure: str) -> None:
    height = np.arange(len(bars.names))[::-1].astype(float)
    if not bars.names:
        axes.text(0.5, 0.5, bars.told, ha="center", va="center", transform=axes.transAxes,
                  fontsize=9, color=style.VERMILLION)  # fmt: skip
        axes.set_xticks([])
        return
    word = MEASURES[measure][0].lower() + MEASURES[measure][1:]
    second = bool(np.isfinite(bars.inside).any())
    shift = 0.17 if second else 0.0
    _row(axes, height + shift, bars.values, bars.ends, style.SKY, word, 0.34 if second else 0.6)
    if second:
        _row(axes, height - shift, bars.inside, bars.inside_ends, style.ORANGE,
             _INSIDE[measure][1], 0.34)  # fmt: skip
    if np.isfinite(bars.chance):
        axes.axvline(bars.chance, color=style.VERMILLION, linestyle="dashed", linewidth=1.2,
                     label="by chance in one case of 20")  # fmt: skip
    axes.axvline(0.0, color=style.INK, linewidth=0.8)
    axes.locator_params(axis="x", nbins=5)
    axes.set_yticks(height, [_short(name) for name in bars.names], fontsize=8)
    axes.grid(axis="y", visible=False)


def _short(name: str) -> str:
    """A name on two lines of bearable length, the path on one of its own; three would overlap."""
    if len(name) <= _WIDE:
        return name
    mean, path = (
        ("mean of", name.removeprefix("mean of ")) if name.startswith("mean") else ("", name)
    )
    path, bracket, place = path.partition("[")
    if not mean:
        # Between the parts of a path rather than within a word.
        apart = textwrap.fill(path.replace(".", ". "), _WIDE).replace(". ", ".")
        return (apart if len(path) > _WIDE else path) + ("\n" if bracket else "") + bracket + place
    part = f" {bracket}{place} of" if bracket else ""
    return f"{mean}{part}\n{path}"


def _row(
    axes: Axes, height: NDArray[np.floating], values: NDArray[np.floating],
    ends: NDArray[np.floating], colour: str, label: str, thick: float,
) -> None:  # fmt: skip
    if not len(values):
        return
    axes.barh(height, values, height=thick, color=colour, label=label)
    known = np.isfinite(ends).all(axis=1)
    # By their ends, since an interval need not hold the estimate.
    middle, half = ends[known].mean(axis=1), np.ptp(ends[known], axis=1) / 2
    axes.errorbar(middle, height[known], xerr=half, fmt="none", ecolor=style.INK,
                  elinewidth=1.1, capsize=2.5)  # fmt: skip
