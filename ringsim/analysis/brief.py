"""An analysis in short: a row an output, and of what matters only what stands out of chance."""

from collections.abc import Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.intervals import LEVEL, Array
from ringsim.analysis.quantities import quantities
from ringsim.analysis.sensitivity_text import HEADS, SETS, measure_notes
from ringsim.tables import Table, interval_text, number_text

_NORMAL = 1.96
"""Standard deviations that one in twenty leaves out."""
_MOST = 3
"""Inputs that are told for each output."""
_CHANCE = {"given_data_index": "chance_level"}
"""Measures that chance lifts, and how far."""


def output_table(analysis: xr.Dataset, names: list[str]) -> Table:
    """Mean with its interval, scatter, quantiles and range of each output."""
    rows, all_used = [], analysis.attrs["samples"]
    for name in names:
        values, used = analysis[name].values, int(analysis[f"{name}_samples"].values[0])
        mean, deviation, *quantiles, least, most = values
        count = str(used) if used == all_used else f"{used} of {all_used}"
        units = analysis[name].attrs["units"]
        units = "" if units == "1" else units
        if least == most:
            rows.append((name, units, number_text(least), "all alike", *"-----", "-", count))
        elif np.isfinite(least):
            fine = digits_of(least, most)
            ends = _ends(analysis[f"{name}_interval"].values[0], fine)
            others = [number_text(v, fine) for v in (*quantiles, least, most)]
            rows.append(
                (name, units, number_text(mean, fine), ends, number_text(deviation), *others, count)
            )
    head = (
        "output", "unit", "mean", "95 % interval", "std. dev.", "5 %", "median", "95 %", "least",
        "most", "used",
    )  # fmt: skip
    return Table(head, rows)


def digits_of(least: float, most: float) -> int:
    """So many digits that a range has four of its own."""
    larger = max(abs(least), abs(most)) / (most - least) if most > least else 1.0
    return max(4, int(np.log10(larger)) + 4)


def what_matters(analysis: xr.Dataset) -> Table:
    """Inputs (or groups) that go with each output beyond chance, by the measure of the design, and
    in which direction.
    """
    measure = next((first for first, _ in SETS if first in analysis), None)
    if measure is None and "input_is_place" not in analysis:
        return Table((), ())
    rows, quiet = [], []
    told = dict(_indexed(analysis, measure)) if measure else {}
    known = _correlated(analysis)
    groups = [name for name in told if name not in quantities()]
    for output in [n for n in quantities() if n in told or n in known] + groups:
        found = told.get(output) or list(_ranked(analysis, output))
        rows += [(output if k == 0 else "", *row) for k, row in enumerate(found[:_MOST])]
        if not found:
            quiet.append(output)
    notes = measure_notes(analysis)
    if any(row[2] == "-" for row in rows):
        count = analysis.sizes["input"]
        notes.append(
            f"rank correlations alone: by chance about {(1 - LEVEL) * count:.2g} of {count} inputs "
            "would be told"
        )
    if quiet:
        notes.append(f"nothing that chance would not explain: {', '.join(quiet)}")
    index = "index" if measure is None else HEADS[measure]
    head = ("what matters for", "input", index, "95 % interval", "rank correlation")
    return Table(head, rows, notes, left=2)


def _indexed(analysis: xr.Dataset, measure: str) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    """For each output with indices the inputs with more than chance gives, in all their interval
    above zero.
    """
    (dim,) = analysis[measure].dims[1:]
    for output in analysis["output"].values.tolist():
        one = analysis.sel(output=output)
        values = one[measure].values
        known = f"{measure}_interval" in one and np.isfinite(one[f"{measure}_interval"]).any()
        ends = one[f"{measure}_interval"].values if known else np.full((len(values), 2), np.nan)
        chance = one[_CHANCE[measure]].values if measure in _CHANCE else 0.0 * values
        least = np.where(np.isfinite(ends[:, 0]), ends[:, 0], values)
        beyond = (values > chance) & (least > 0.0)
        chosen = [k for k in np.argsort(-np.nan_to_num(values)) if beyond[k]]
        if np.isfinite(values).any():
            yield output, [
                (
                    str(analysis[dim].values[k]), number_text(values[k], 2),
                    _ends(ends[k]),
                    _rank(analysis, output, str(analysis[dim].values[k])),
                )
                for k in chosen
            ]  # fmt: skip


def _correlated(analysis: xr.Dataset) -> list[str]:
    end = "_rank_correlation"
    return [
        str(name).removesuffix(end)
        for name in analysis.data_vars
        if str(name).endswith(end) and not str(name).endswith(f"_partial{end}")
    ]


def _ranked(analysis: xr.Dataset, output: str) -> Iterator[tuple[str, ...]]:
    """Inputs whose rank correlation with an output without index is beyond chance."""
    name = f"{output}_rank_correlation"
    if name not in analysis:
        return
    values, ends = analysis[name].values, analysis[f"{name}_interval"].values
    # Of n independent samples without correlation: variance 1 / (n - 1).
    beyond = _beyond(values, ends, _NORMAL / (analysis[f"{output}_samples"].values[0] - 1) ** 0.5)
    for k in np.argsort(-np.abs(np.nan_to_num(values))):
        if beyond[k]:
            yield str(analysis["input"].values[k]), "-", "-", _signed(values[k], ends[k])


def _rank(analysis: xr.Dataset, output: str, name: str) -> str:
    known = f"{output}_rank_correlation"
    if known not in analysis or name not in analysis["input"].values:
        return "-"
    one = analysis.sel(input=name)
    return _signed(one[known].item(), one[f"{known}_interval"].values)


def _signed(value: float, ends: Array) -> str:
    if not np.isfinite(value):
        return "-"
    interval = _ends(ends)
    return f"{value:+.2f}" + ("" if interval == "-" else f" ({interval})")


def what_separates(analysis: xr.Dataset) -> Table:
    """Inputs that are larger, or smaller, in samples that ended otherwise or violate."""
    if "group" not in analysis.dims:
        return Table((), ())
    rows, samples = [], analysis.attrs["samples"]
    for group in analysis["group"].values:
        one = analysis.sel(group=group)
        middle, ends = one["separation"].values, one["separation_interval"].values
        order = np.argsort(-np.abs(np.nan_to_num(middle - 0.5)))
        own = one["group_samples"].item()
        # Variance of the area under the curve without a difference: Mann and Whitney (1947).
        chance = _NORMAL * ((samples + 1) / (12.0 * own * max(samples - own, 1))) ** 0.5
        beyond = _beyond(middle - 0.5, ends - 0.5, chance)
        chosen = [k for k in order if beyond[k]]
        first = str(group).split("; ")[0]
        rows += [
            (
                f"{first} ({one['group_samples'].item()})" if n == 0 else "",
                str(analysis["input"].values[k]), number_text(middle[k], 2),
                _ends(ends[k]),
            )
            for n, k in enumerate(chosen[:_MOST])
        ]  # fmt: skip
    head = ("what separates", "input", "probability that it is larger", "95 % interval")
    return Table(head, rows, left=2)


def _beyond(values: Array, ends: Array, chance: float) -> NDArray[np.bool_]:
    """Which values stand out of chance: by their intervals, or where there are none because the
    design gives none, by what one in twenty would reach.
    """
    apart = (ends[:, 0] > 0.0) | (ends[:, 1] < 0.0)
    return np.where(np.isfinite(ends).all(axis=1), apart, np.abs(values) > chance)


def _ends(interval: Array, digits: int = 2) -> str:
    return interval_text(float(interval[0]), float(interval[1]), digits)
