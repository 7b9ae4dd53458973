"""The tables of an accuracy study, in Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from ringsim.analysis.accuracy import GROUPS, OUTPUTS
from ringsim.analysis.ladder import PATHS
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
_THEORY = {"constant step": "2", "tolerance": "2", "elements": "2", "formulation": "2"}


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
    return "\n".join(parts) + "\n"


def changes(found: xr.Dataset, rung: int) -> dict[str, object]:
    """Settings of a rung that differ from how the scene stands."""
    standing = int(np.flatnonzero(found.ladder.values == "as it stands")[0])
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
        "The cheapest setting within an error (relative to the reference; of series the largest "
        "difference over the whole run):",
        "",
        "| error of | " + " | ".join(f"{t:g}" for t in found.target.values) + " |",
        "|---|" + "---|" * len(found.target),
    ]
    for column, name in enumerate(outputs):
        cells = []
        for row in range(len(found.target)):
            rung = int(found.cheapest.values[row, column])
            seconds = found.cpu_time.values[rung]
            cells.append("none tried" if rung < 0 else f"{in_words(found, rung)}, {seconds:.3g} s")
        lines.append(f"| {_SHORT.get(name, name)} | " + " | ".join(cells) + " |")
    return lines


def _errors(found: xr.Dataset, outputs: Sequence[str]) -> list[str]:
    """Errors and cost of every setting; what lies on a frontier is bold."""
    head = " | ".join(_SHORT.get(name, name) for name in outputs)
    lines = [
        "Errors, bold where no other setting is both cheaper and better:",
        "",
        f"| setting | steps | residuals | processor time | {head} |",
        "|---|---|---|---|" + "---|" * len(outputs),
    ]
    for rung in range(found.sizes["rung"]):
        name = f"{found.ladder.values[rung]}: {found.label.values[rung]}"
        if found.ladder.values[rung] == found.label.values[rung]:
            name = str(found.label.values[rung])
        ended = Status(int(found.status.values[rung]))
        if ended != Status.OK:
            name += f" ({ended.word})"
        cells = [_cell(found, rung, output) for output in outputs]
        lines.append(
            f"| {name} | {found.steps.values[rung]:.0f} | "
            f"{found.residual_evaluations.values[rung]:.0f} | "
            f"{found.cpu_time.values[rung]:.3g} s | {' | '.join(cells)} |"
        )
    own = [f"{float(found.uncertainty.sel(output=name)):.1e}" for name in outputs]
    own = ["" if name == "energy" else text for name, text in zip(outputs, own, strict=True)]
    return [*lines, f"| uncertainty of the reference | | | | {' | '.join(own)} |"]


def _cell(found: xr.Dataset, rung: int, output: str) -> str:
    at = {"rung": rung, "output": list(found.output.values).index(output)}
    error = float(found.error.isel(at))
    if not np.isfinite(error):
        return ""
    return f"**{error:.1e}**" if bool(found.frontier.isel(at)) else f"{error:.1e}"


def _orders(found: xr.Dataset, outputs: Sequence[str]) -> list[str]:
    head = " | ".join(_SHORT.get(name, name) for name in outputs)
    lines = [
        "Observed orders (slope of the error over the step, over one by the number of steps, or "
        "over the length of an element, where it stands clear of the reference's own; a dash "
        "where it does not, or where the ladder hardly matters):",
        "",
        f"| ladder | theory | {head} |",
        "|---|---|" + "---|" * len(outputs),
    ]
    for name in found.graded.values:
        orders = [float(found.order.sel(graded=name, output=output)) for output in outputs]
        cells = [f"{order:.1f}" if np.isfinite(order) else "-" for order in orders]
        lines.append(f"| {name} | {_THEORY.get(str(name), '')} | {' | '.join(cells)} |")
    return lines


def _truths(found: xr.Dataset) -> list[str]:
    standing = int(np.flatnonzero(found.ladder.values == "as it stands")[0])
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
            f"{float(found.reference_from_truth[k]):.1e} | "
            f"{float(found.from_truth[standing, k]):.1e} |"
        )
    return lines
