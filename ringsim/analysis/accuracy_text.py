"""The tables of an accuracy study, in Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from ringsim.analysis.errors import GROUPS, OUTPUTS
from ringsim.analysis.ladder import PATHS, STANDING
from ringsim.variables import Status

_SHORT = {
    "deployment_time": "deployment time",
    "opening_angle": "opening angle",
    "asynchrony": "asynchrony",
    "peak_tension": "peak tension",
    "peak_rod_stress": "peak stress",
    "peak_bending_strain": "peak strain",
    "energy": "energy",
    "motion": "all motion",
    "loads": "all loads",
}
_THEORY = {"steps": "2", "constant step": "2", "elements": "2", "formulation": "2"}


def tables(found: xr.Dataset, title: str) -> str:
    """Recommendation, errors and cost, orders, and distance from independent values.

    Parameters
    ----------
    found
        From :func:`ringsim.analysis.accuracy.judge`.
    title
        Heading.
    """
    outputs = [str(name) for name in found.output.values]
    single = [name for name in outputs if name not in GROUPS]
    parts = [f"# {title}", "", *_advice(found, outputs), "", *_errors(found, single)]
    parts += ["", *_orders(found, single)]
    if "from_truth" in found:
        parts += ["", *_truths(found)]
    if (found.status.values != Status.OK).any() and "reason" in found:
        parts += ["", *_failures(found)]
    return "\n".join(parts) + "\n"


def changes(found: xr.Dataset, rung: int) -> dict[str, object]:
    """Settings of a rung that differ from how the scene stands."""
    standing = int(np.flatnonzero(found.ladder.values == STANDING)[0])
    picked = {}
    for path in PATHS:
        values = found[path.replace(".", "_")].values
        if values[rung] != values[standing]:
            picked[path] = values[rung].item() if hasattr(values[rung], "item") else values[rung]
    return picked


def in_words(found: xr.Dataset, rung: int) -> str:
    """A setting as the overrides that give it."""
    if str(found.ladder.values[rung]) == "fidelity":
        return "`--fidelity ideal`"
    picked = changes(found, rung)
    if not picked:
        return "as it stands"
    return " ".join(f"`--set {path}={value}`" for path, value in picked.items())


def _advice(found: xr.Dataset, outputs: Sequence[str]) -> list[str]:
    lines = [
        "The cheapest setting that is good for an error. What a setting is good for is the "
        "largest error among itself and all finer settings, and the reference's uncertainty on "
        "top: a single error may be small by chance. Errors are relative; of series (opening "
        "angle, asynchrony) the largest difference over the whole run counts. Another setting is "
        "named only if it is cheaper than the scene's own by a tenth.",
        "",
        "| error of | " + " | ".join(f"{t:g}" for t in found.target.values) + " |",
        "|---|" + "---|" * len(found.target),
    ]
    ideal = np.flatnonzero(found.ladder.values == "fidelity")
    for column, name in enumerate(outputs):
        cells = []
        for row, target in enumerate(found.target.values):
            picked = [int(found.cheapest.values[row, column])]
            picked += list(ideal[found.bound.values[ideal, column] <= target])
            words = [
                f"{in_words(found, k)}, {found.cost.values[k]:.3g} s" for k in picked if k >= 0
            ]
            if words:
                cells.append("; or ".join(words))
            elif found.uncertainty.values[column] >= target:
                cells.append("reference too coarse")
            else:
                cells.append("none tried")
        lines.append(f"| {_SHORT.get(name, name)} | " + " | ".join(cells) + " |")
    return lines


def _errors(found: xr.Dataset, outputs: Sequence[str]) -> list[str]:
    """Errors and cost of every setting; what lies on a frontier is bold."""
    head = " | ".join(_SHORT.get(name, name) for name in outputs)
    lines = [
        "Errors, bold where no other setting is both cheaper and good for less; runs that two "
        "ladders share stand in the first. The cost is processor time, fitted to residuals, "
        "Jacobians and steps over all runs, so that the scatter of single timings cancels:",
        "",
        f"| setting | steps | residuals | Jacobians | run | cost | {head} |",
        "|---|---|---|---|---|---|" + "---|" * len(outputs),
    ]
    for rung in _distinct(found):
        name = f"{found.ladder.values[rung]}: {found.label.values[rung]}"
        if found.ladder.values[rung] == found.label.values[rung]:
            name = str(found.label.values[rung])
        ended = Status(int(found.status.values[rung]))
        if ended != Status.OK:
            name += f" ({ended.word})"
        counts = [
            f"{found[count].values[rung]:.0f}"
            for count in ("steps", "residual_evaluations", "jacobians")
        ]
        times = [f"{found[t].values[rung]:.3g} s" for t in ("cpu_time", "cost")]
        cells = [_cell(found, rung, output) for output in outputs]
        lines.append(f"| {' | '.join([name, *counts, *times, *cells])} |")
    own = [f"{float(found.uncertainty.sel(output=name)):.1e}" for name in outputs]
    own = ["" if name == "energy" else text for name, text in zip(outputs, own, strict=True)]
    return [*lines, f"| uncertainty of the reference | | | | | | {' | '.join(own)} |"]


def _distinct(found: xr.Dataset) -> list[int]:
    """The first rung of each setting."""
    names = ["ladder", *(path.replace(".", "_") for path in PATHS)]
    columns = [found[name].values for name in names]
    seen: dict[tuple[object, ...], int] = {}
    for rung in range(found.sizes["rung"]):
        ideal = columns[0][rung] == "fidelity"
        seen.setdefault((ideal, *(column[rung] for column in columns[1:])), rung)
    return list(seen.values())


def _cell(found: xr.Dataset, rung: int, output: str) -> str:
    at = {"rung": rung, "output": list(found.output.values).index(output)}
    error = float(found.error.isel(at))
    if not np.isfinite(error):
        return ""
    return f"**{error:.1e}**" if bool(found.frontier.isel(at)) else f"{error:.1e}"


def _orders(found: xr.Dataset, outputs: Sequence[str]) -> list[str]:
    head = " | ".join(_SHORT.get(name, name) for name in outputs)
    lines = [
        "Observed orders: of steps the slope of their error (against the limit of fine steps with "
        "as many elements) over the step, among all no longer than the scene's own that stand "
        "clear of that limit's uncertainty; of elements that of the changes from one number of "
        "elements to the next, with fine steps. A dash where errors or changes are too small to "
        "tell, or hardly change:",
        "",
        f"| ladder | theory | {head} |",
        "|---|---|" + "---|" * len(outputs),
    ]
    for name in found.graded.values:
        orders = [float(found.order.sel(graded=name, output=output)) for output in outputs]
        cells = [f"{order:.1f}" if np.isfinite(order) else "-" for order in orders]
        lines.append(f"| {name} | {_THEORY.get(str(name), '')} | {' | '.join(cells)} |")
    return lines


def _failures(found: xr.Dataset) -> list[str]:
    lines = ["Settings that did not end well:", ""]
    for rung in _distinct(found):
        ended = Status(int(found.status.values[rung]))
        if ended != Status.OK:
            name = f"{found.ladder.values[rung]}: {found.label.values[rung]}"
            lines.append(f"- {name}: {ended.word}: {found.reason.values[rung]}")
    return lines


def _truths(found: xr.Dataset) -> list[str]:
    standing = int(np.flatnonzero(found.ladder.values == STANDING)[0])
    lines = [
        "Distance from values that do not come from this model (rigid rods; the rest is what the "
        "rods' elasticity does):",
        "",
        "| value | reference | as it stands |",
        "|---|---|---|",
    ]
    for k, name in enumerate(found.truth.values):
        output, _, source = str(name).partition(": ")
        lines.append(
            f"| {_SHORT.get(output, OUTPUTS.get(output, output))}, {source} | "
            f"{float(found.reference_from_truth.values[k]):.1e} | "
            f"{float(found.from_truth.values[standing, k]):.1e} |"
        )
    return lines
