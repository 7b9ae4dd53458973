"""The stability map in words: counts, borders, and every cell that is wrong."""

from __future__ import annotations

import itertools

import numpy as np
import xarray as xr

from ringsim.analysis.stability import OK, PROMISES, WRONG
from ringsim.tables import markdown_table

_LONGEST_REASON = 300
"""Characters of an example's reason that are shown."""


def to_markdown(whole: xr.Dataset) -> str:
    """A judged map as a Markdown text."""
    head = ["panel", "axis", "all cells ok", "any cell ok", "below", "above"]
    parts = ["# Stability map", summary(whole)]
    if "check" in whole:
        parts += _checks(whole)
    parts += ["![How each cell ended](stability.png)"]
    parts += ["## Borders", markdown_table(head, borders(whole))]
    parts += ["## What lies beyond", _causes(whole)]
    if suspects := np.flatnonzero((whole["verdict"] == WRONG).values).tolist():
        parts += ["## Wrong cells", "\n".join(_cell(whole, k) for k in suspects)]
    return "\n\n".join(parts) + "\n"


def summary(whole: xr.Dataset) -> str:
    """The counts in one line."""
    verdict = whole["verdict"].values
    words = [f"{np.sum(verdict == word)} {word}" for word in np.unique(verdict)]
    anew = int(np.sum((whole["restarts"].values > 0) & (verdict == OK)))
    minutes = float(np.nansum(whole["cpu_time"].values)) / 60.0
    panels = f"{whole.sizes['group']} panel{'s' if whole.sizes['group'] > 1 else ''}"
    return (
        f"{len(verdict)} cells in {panels}: {', '.join(words)}; "
        f"{anew} of the ok ones after a new start with smaller steps; "
        f"{minutes:.1f} minutes of processor time"
    )


def _checks(whole: xr.Dataset) -> list[str]:
    check = whole["check"].values
    holds, differs, unproven = (np.sum(check == w) for w in ("holds", "differs", "unproven"))
    time, angle, tension = PROMISES.values()
    text = (
        f"{np.sum(check != '')} random ok cells were run again with a quarter of the step and a "
        f"sixteenth of the tolerance: {holds} held what ok promises ({100 * time:g} % of the "
        f"deployment time, {angle:g} deg of the mean angle of runs that end before, "
        f"{100 * tension:g} % of the largest tension), {differs} did not, {unproven} stayed "
        "unproven because the finer run did not end or was hardly finer."
    )
    labels = ("deployment time", "mean angle", "largest tension")
    lines = []
    for name, label, unit in zip(PROMISES, labels, ("%", "deg", "%"), strict=True):
        values = whole[name].dropna("cell").values * (100.0 if unit == "%" else 1.0)
        if len(values):
            lines.append(
                f"- {label}: {np.median(values):.2g} {unit} in the median, "
                f"{values.max():.2g} {unit} at most ({len(values)} cells)"
            )
    return [text, "\n".join(lines)] if lines else [text]


def borders(whole: xr.Dataset) -> list[list[str]]:
    """Between which values of each axis runs are ok, as rows of words.

    Title, axis, the longest range of values at which all cells are ok, the range of those at which
    any cell is, and the commonest causes just below and above the first range.
    """
    rows = []
    for number in range(whole.sizes["group"]):
        group = whole.isel(group=number, cell=(whole["of_group"] == number).values)
        good = (group["verdict"] == OK).values
        for axis in ("x", "y"):
            values, place = np.unique(group[axis].values, return_inverse=True)
            columns = [place == k for k in range(len(values))]
            sure = [bool(good[column].all()) for column in columns]
            runs = itertools.groupby(range(len(values)), key=sure.__getitem__)
            longest = max((list(run) for all_ok, run in runs if all_ok), key=len, default=[])
            beyond = ["-", "-"]
            for side, k in enumerate((longest[0] - 1, longest[-1] + 1) if longest else ()):
                if 0 <= k < len(values):
                    causes = group["cause"].values[columns[k] & ~good].astype(str)
                    words, counts = np.unique(causes, return_counts=True)
                    beyond[side] = str(words[counts.argmax()]) or WRONG
            some = [k for k, column in enumerate(columns) if good[column].any()]
            ranges = [
                f"{values[r[0]]:g} .. {values[r[-1]]:g}" if r else "none" for r in (longest, some)
            ]
            label, units = (str(group[f"{axis}_{word}"].values) for word in ("label", "units"))
            label += "" if units == "1" else f" ({units})"
            rows.append([str(group["title"].values), label, *ranges, *beyond])
    return rows


def _causes(whole: xr.Dataset) -> str:
    """Each cause with its number of cells and one reason as it was given."""
    others = whole.isel(cell=(whole["verdict"] != OK).values)
    causes, reasons = (others[name].values.astype(str) for name in ("cause", "reason"))
    words, first, counts = np.unique(causes, return_index=True, return_counts=True)
    rows = [
        [words[k] or WRONG, counts[k], reasons[first[k]][:_LONGEST_REASON]]
        for k in np.argsort(-counts, kind="stable")
    ]
    return markdown_table(["cause", "cells", "for example"], rows)


def _cell(whole: xr.Dataset, number: int) -> str:
    cell = whole.isel(cell=number, group=int(whole["of_group"][number]))
    differences = ", ".join(
        f"{name.replace('_', ' ')} {float(cell[name]):.2g}"
        for name in PROMISES
        if name in cell and np.isfinite(float(cell[name]))
    )
    return (
        f"- {cell['name'].values}: {cell['x_label'].values} = {float(cell['x']):g}, "
        f"{cell['y_label'].values} = {float(cell['y']):g}: {cell['reason'].values} "
        f"({differences or 'no cause named'})"
    )
