"""The stability map in words: counts, borders, and every cell that is wrong."""

from __future__ import annotations

from collections.abc import Sequence

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


def to_markdown(whole: xr.Dataset) -> str:
    """The map as a Markdown text."""
    lines = ["# Stability map", "", *_counts(whole), "", *_checks(whole), ""]
    lines += ["![How each cell ended](stability.png)", ""]
    lines += ["## Borders", "", *_borders(whole), "", "## What lies beyond", "", *_causes(whole)]
    suspects = np.flatnonzero((whole["verdict"] == WRONG).values)
    if len(suspects):
        lines += ["", "## Wrong cells", "", *(_cell(whole, int(k)) for k in suspects)]
    return "\n".join(lines) + "\n"


def summary(whole: xr.Dataset) -> str:
    """The counts in one line."""
    return "; ".join(_counts(whole))


def _counts(whole: xr.Dataset) -> list[str]:
    verdict = whole["verdict"].values
    words = [f"{np.sum(verdict == word)} {word}" for word in np.unique(verdict)]
    anew = int(np.sum((whole["restarts"].values > 0) & (verdict == OK)))
    minutes = float(np.nansum(whole["cpu_time"].values)) / 60.0
    return [
        f"{len(verdict)} cells in {whole.sizes['group']} groups: {', '.join(words)}; "
        f"{anew} of the ok ones after a new start with smaller steps; "
        f"{minutes:.1f} minutes of processor time"
    ]


def _checks(whole: xr.Dataset) -> list[str]:
    if "check" not in whole:
        return []
    check = whole["check"].values
    held = int(np.sum(check == "holds"))
    done = [
        f"{np.sum(check != '')} random ok cells were run again with a quarter of the step and a "
        f"sixteenth of the tolerance: {held} held what ok promises ({100 * TIME_PROMISE:g} % of "
        f"the deployment time, {ANGLE_PROMISE:g} deg of the mean angle of runs that end before, "
        f"{100 * TENSION_PROMISE:g} % of the largest tension), {np.sum(check == 'differs')} did "
        f"not, {np.sum(check == 'unproven')} stayed unproven because the finer run did not end or "
        "was hardly finer.",
        "",
    ]
    for name, label, factor, unit in (
        ("time_difference", "deployment time", 100.0, "%"),
        ("angle_difference", "mean angle", 1.0, "deg"),
        ("tension_difference", "largest tension", 100.0, "%"),
    ):
        values = whole[name].values[np.isfinite(whole[name].values)] * factor
        if len(values):
            done.append(
                f"- {label}: {np.median(values):.2g} {unit} in the middle, "
                f"{values.max():.2g} {unit} at most ({len(values)} cells)"
            )
    return done


def _borders(whole: xr.Dataset) -> list[str]:
    lines = [
        "| group | axis | all cells ok | any cell ok | below | above |",
        "|---|---|---|---|---|---|",
    ]
    table = borders(whole)
    for k in range(table.sizes["border"]):
        row = table.isel(border=k)
        group = whole.isel(group=int(row["of_group"]))
        axis = str(row["axis"].values)
        units = str(group[f"{axis}_units"].values)
        label = str(group[f"{axis}_label"].values) + (f" ({units})" if units != "1" else "")
        sure, some = (
            _range(float(row[f"lowest_{word}"]), float(row[f"highest_{word}"]))
            for word in ("sure", "ok")
        )
        beyond = [str(row[side].values) or "-" for side in ("below", "above")]
        lines.append(
            f"| {group['title'].values} | {label} | {sure} | {some} | {' | '.join(beyond)} |"
        )
    return lines


def _range(low: float, high: float) -> str:
    return "none" if not np.isfinite(low) else f"{low:g} .. {high:g}"


def _causes(whole: xr.Dataset) -> list[str]:
    """Each cause with its number of cells and one reason as it was given."""
    lines = ["| cause | cells | for example |", "|---|---|---|"]
    others = whole.isel(cell=(whole["verdict"] != OK).values)
    words, first, counts = np.unique(
        others["cause"].values.astype(str), return_index=True, return_counts=True
    )
    for k in np.argsort(-counts, kind="stable"):
        reason = str(others["reason"].values[first[k]]).replace("|", "/")
        lines.append(f"| {words[k] or WRONG} | {counts[k]} | {reason[:300]} |")
    return lines


def _cell(whole: xr.Dataset, number: int) -> str:
    cell = whole.isel(cell=number)
    group = whole.isel(group=int(cell["of_group"]))
    differences: Sequence[str] = [
        f"{name.replace('_', ' ')} {float(cell[name]):.2g}"
        for name in ("time_difference", "angle_difference", "tension_difference")
        if name in cell and np.isfinite(float(cell[name]))
    ]
    return (
        f"- {group['name'].values}: {group['x_label'].values} = {float(cell['x']):g}, "
        f"{group['y_label'].values} = {float(cell['y']):g}: {cell['reason'].values} "
        f"({', '.join(differences) or 'no cause named'})"
    )
