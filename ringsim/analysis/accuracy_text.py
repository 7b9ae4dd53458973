"""The tables of an accuracy study, in Markdown."""

import numpy as np
import xarray as xr

from ringsim.analysis.accuracy import settings_at
from ringsim.analysis.errors import GROUPS, OUTPUTS
from ringsim.analysis.ladder import FRAME, STANDING
from ringsim.tables import markdown_table
from ringsim.variables import Status

_NAMES = OUTPUTS | {group: f"all {group}" for group in GROUPS}
_THEORY = 2
"""Order of the integrator, and of the elements."""
_ADVICE = (
    "The cheapest setting that is good for an error. What a setting is good for is the largest "
    "error among itself and all finer settings, plus the reference's uncertainty: a single error "
    "may be small by chance. Errors are relative; for series (opening angle, asynchrony) the "
    "largest difference over the whole run counts. Another setting is named only if it is cheaper "
    "than the scene's own by a tenth."
)
_COSTS = (
    "Errors, bold where no other setting is both cheaper and good for less; a run that two ladders "
    "share is listed in the first. The cost is processor time, fitted to residuals, Jacobians and "
    "steps over all runs, so that the scatter of single timings cancels:"
)
_ORDERS = (
    "Observed orders: for steps the slope of their error (against the limit of fine steps with as "
    "many elements) over the step, among all steps no longer than the scene's own whose error is "
    "clearly above the uncertainty of that limit; for elements that of the changes from one number "
    "of elements to the next, with fine steps. A dash where errors or changes are too small to "
    "tell, or hardly change:"
)
_ENGINES = (
    "How far the engines differ: the distance of the limits of their finest runs, relative, and "
    "how uncertain either limit is (that of the full engine is the reference of all errors). What "
    "is larger than both uncertainties together, bold, is a difference of the engines themselves:"
)
_TRUTHS = (
    "Distance from values that do not come from this model (they hold for rigid rods; the rest is "
    "the effect of the rods' elasticity):"
)


def tables(found: xr.Dataset, title: str) -> str:
    """Recommendation, errors and cost, orders, and distance from independent values.

    ``found`` is from :func:`ringsim.analysis.accuracy.judge`; ``title`` is the heading.
    """
    single = found.drop_sel(output=list(GROUPS), errors="ignore")
    parts = [f"# {title}", *filter(None, [found.attrs.get("remarks")])]
    parts += [_ADVICE, _advice(found), _COSTS, _errors(single)]
    parts += [_ORDERS, _orders(single)]
    if "engines_differ" in found:
        parts += [_ENGINES, _engines(single)]
    if "from_truth" in found:
        parts += [_TRUTHS, _truths(found)]
    failed = [k for k in _distinct(found) if found.status.values[k] != Status.OK]
    if failed and "reason" in found:
        lines = [f"- {_name(found, k)}: {_end(found, k)}: {found.reason.values[k]}" for k in failed]
        parts += ["Settings that did not end well:", "\n".join(lines)]
    return "\n\n".join(parts) + "\n"


def in_words(found: xr.Dataset, rung: int) -> str:
    """A setting as the overrides that give it."""
    standing, fidelity = settings_at(found, _standing(found)), found.fidelity.values[rung]
    picked = {p: v for p, v in settings_at(found, rung).items() if v != standing[p]}
    words = [f"`--fidelity {fidelity}`"] if fidelity == FRAME else []
    words += [f"`--set {path}={value}`" for path, value in picked.items()]
    return " ".join(words) or STANDING


def _advice(found: xr.Dataset) -> str:
    targets, rows = found.target.values.tolist(), []
    for name, column in zip(_names(found), found.output, strict=True):
        of = found.sel(output=column)
        rows.append([name])
        for target, cheapest in zip(targets, of.cheapest.values, strict=True):
            otherwise = "reference too coarse" if of.uncertainty >= target else "none tried"
            words = f"{in_words(of, cheapest)}, {of.cost.values[cheapest]:.3g} s"
            rows[-1].append(words if cheapest >= 0 else otherwise)
    return markdown_table(["error of", *(f"{target:g}" for target in targets)], rows)


def _errors(found: xr.Dataset) -> str:
    """Errors and cost of every setting; what lies on a frontier is bold."""
    rows = []
    for rung in _distinct(found):
        row = found.isel(rung=rung)
        name = _name(found, rung) + (f" ({_end(found, rung)})" if row.status != Status.OK else "")
        counts = [f"{row[n].item():.0f}" for n in ("steps", "residual_evaluations", "jacobians")]
        times = [f"{row[time].item():.3g} s" for time in ("cpu_time", "cost")]
        pairs = zip(row.error.values, row.frontier.values, strict=True)  # no frontier has a NaN
        errors = [f"**{e:.1e}**" if b else f"{e:.1e}" if np.isfinite(e) else "" for e, b in pairs]
        rows.append([name, *counts, *times, *errors])
    own = zip(found.output.values, found.uncertainty.values, strict=True)
    last = ["" if name == "energy" else f"{e:.1e}" for name, e in own]
    rows.append(["uncertainty of the reference", *[""] * 5, *last])
    head = ["setting", "steps", "residuals", "Jacobians", "run", "cost"]
    return markdown_table(head + _names(found), rows)


def _orders(found: xr.Dataset) -> str:
    rows = [
        [name, _THEORY, *(f"{o:.1f}" if np.isfinite(o) else "-" for o in orders)]
        for name, orders in zip(found.graded.values.tolist(), found.order.values, strict=True)
    ]
    return markdown_table(["ladder", "theory", *_names(found)], rows)


def _engines(found: xr.Dataset) -> str:
    apart, full, frame = (
        found[name].values for name in ("engines_differ", "uncertainty", "frame_uncertainty")
    )
    rows = [
        [name, f"**{d:.1e}**" if d > u + v else f"{d:.1e}", f"{u:.1e}", f"{v:.1e}"]
        for name, d, u, v in zip(_names(found), apart, full, frame, strict=True)
        if np.isfinite(d)
    ]
    head = ["output", "engines differ by", "uncertainty, full", "uncertainty, frame"]
    return markdown_table(head, rows)


def _truths(found: xr.Dataset) -> str:
    rows = []
    for of in (found.sel(truth=name) for name in found.truth):
        output, _, source = of.truth.item().partition(": ")
        gaps = (of.reference_from_truth.item(), of.from_truth.values[_standing(found)])
        rows.append([f"{_NAMES.get(output, output)}, {source}", *(f"{gap:.1e}" for gap in gaps)])
    return markdown_table(["value", "reference", STANDING], rows)


def _names(found: xr.Dataset) -> list[str]:
    return [_NAMES.get(name, name) for name in found.output.values.tolist()]


def _distinct(found: xr.Dataset) -> list[int]:
    """The first rung of each setting."""
    seen: dict[tuple[object, ...], int] = {}
    for rung, fidelity in enumerate(found.fidelity.values):
        seen.setdefault((fidelity, *settings_at(found, rung).values()), rung)
    return list(seen.values())


def _name(found: xr.Dataset, rung: int) -> str:
    ladder, label = found.ladder.values[rung], found.label.values[rung]
    engine = f"{FRAME}, " if found.fidelity.values[rung] == FRAME else ""
    return str(label) if ladder == label else f"{engine}{ladder}: {label}"


def _end(found: xr.Dataset, rung: int) -> str:
    return Status(int(found.status.values[rung])).word


def _standing(found: xr.Dataset) -> int:
    return int(np.flatnonzero(found.ladder.values == STANDING)[0])
