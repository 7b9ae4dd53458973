"""The stability map in words: counts, borders, and every cell that is wrong."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ringsim.analysis.stability import (
    ANGLE_PROMISE,
    OK,
    TENSION_PROMISE,
    TIME_PROMISE,
    WRONG,
)
from ringsim.analysis.stability_borders import borders
from ringsim.tables import markdown_table

_LONGEST_REASON = 300
"""Characters of an example's reason that are shown."""


def to_markdown(whole: xr.Dataset) -> str:
    """The map as a Markdown text."""
    parts = ["# Stability map", summary(whole)]
    if "check" in whole:
        parts += _checks(whole)
    parts += ["![How each cell ended](stability.png)", "## Borders", _borders(whole)]
    parts += ["## What lies beyond", _causes(whole)]
    suspects = np.flatnonzero((whole["verdict"] == WRONG).values)
    if len(suspects):
        parts += ["## Wrong cells", "\n".join(_cell(whole, int(k)) for k in suspects)]
    return "\n\n".join(parts) + "\n"


def summary(whole: xr.Dataset) -> str:
    """The counts in one line."""
    verdict = whole["verdict"].values
    words = [f"{np.sum(verdict == word)} {word}" for word in np.unique(verdict)]
    anew = int(np.sum((whole["restarts"].values > 0) & (verdict == OK)))
    minutes = float(np.nansum(whole["cpu_time"].values)) / 60.0
    return (
        f"{len(verdict)} cells in {whole.sizes['group']} groups: {', '.join(words)}; "
        f"{anew} of the ok ones after a new start with smaller steps; "
        f"{minutes:.1f} minutes of processor time"
    )


def _checks(whole: xr.Dataset) -> list[str]:
    check = whole["check"].values
    counts = {word: int(np.sum(check == word)) for word in ("holds", "differs", "unproven")}
    text = (
        f"{np.sum(check != '')} random ok cells were run again with a quarter of the step and a "
        f"sixteenth of the tolerance: {counts['holds']} held what ok promises "
        f"({100 * TIME_PROMISE:g} % of the deployment time, {ANGLE_PROMISE:g} deg of the mean "
        f"angle of runs that end before, {100 * TENSION_PROMISE:g} % of the largest tension), "
        f"{counts['differs']} did not, {counts['unproven']} stayed unproven because the finer run "
        "did not end or was hardly finer."
    )
    lines = []
    for name, label, factor, unit in (
        ("time_difference", "deployment time", 100.0, "%"),
        ("angle_difference", "mean angle", 1.0, "deg"),
        ("tension_difference", "largest tension", 100.0, "%"),
    ):
        values = whole[name].values[np.isfinite(whole[name].values)] * factor
        if len(values):
            lines.append(
                f"- {label}: {np.median(values):.2g} {unit} in the median, "
                f"{values.max():.2g} {unit} at most ({len(values)} cells)"
            )
    return [text, "\n".join(lines)] if lines else [text]


def _borders(whole: xr.Dataset) -> str:
    rows = []
    for border in borders(whole):
        group = whole.isel(group=border.group)
        units = str(group[f"{border.axis}_units"].values)
        label = str(group[f"{border.axis}_label"].values) + (f" ({units})" if units != "1" else "")
        ranges = (f"{r[0]:g} .. {r[1]:g}" if r else "none" for r in (border.sure, border.ok))
        beyond = (border.below or "-", border.above or "-")
        rows.append([group["title"].values, label, *ranges, *beyond])
    return markdown_table(["group", "axis", "all cells ok", "any cell ok", "below", "above"], rows)


def _causes(whole: xr.Dataset) -> str:
    """Each cause with its number of cells and one reason as it was given."""
    others = whole.isel(cell=(whole["verdict"] != OK).values)
    words, first, counts = np.unique(
        others["cause"].values.astype(str), return_index=True, return_counts=True
    )
    rows = [
        [words[k] or WRONG, counts[k], str(others["reason"].values[first[k]])[:_LONGEST_REASON]]
        for k in np.argsort(-counts, kind="stable")
    ]
    return markdown_table(["cause", "cells", "for example"], rows)


def _cell(whole: xr.Dataset, number: int) -> str:
    cell = whole.isel(cell=number)
    group = whole.isel(group=int(cell["of_group"]))
    differences = ", ".join(
        f"{name.replace('_', ' ')} {float(cell[name]):.2g}"
        for name in ("time_difference", "angle_difference", "tension_difference")
        if name in cell and np.isfinite(float(cell[name]))
    )
    return (
        f"- {group['name'].values}: {group['x_label'].values} = {float(cell['x']):g}, "
        f"{group['y_label'].values} = {float(cell['y']):g}: {cell['reason'].values} "
        f"({differences or 'no cause named'})"
    )
