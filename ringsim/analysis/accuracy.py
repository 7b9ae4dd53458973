"""Errors of numerical settings against a reference, their cost, and which are worth it."""

import re
import textwrap
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.engines import GROUPS, OUTPUTS, Errors
from ringsim.analysis.ladder import FRAME, PATHS, STANDING, Rung
from ringsim.outputs import VARIABLES
from ringsim.stepping.instant import Array
from ringsim.tables import Table, markdown_table
from ringsim.variables import Status

# A single error may be small by chance: errors of coarse steps and of few elements have signs and
# may cancel.  The error that a setting is good for is therefore the largest among itself and all
# settings that are finer than it, plus the reference's own uncertainty.


TARGETS = (1e-2, 1e-3, 1e-4)
"""Errors for which the cheapest setting is looked up."""
_COUNTS = ("cpu_time", "steps", "newton_iterations", "jacobians")
WORTH_A_CHANGE = 0.9
"""Cost of another setting over that of the scene's own up to which it is worth a change: smaller
differences are within the fit of the cost and the luck of single steps."""
_OTHER_MODELS = ("formulation", "constant step")
"""Ladders without the scene's own model, rods and step control: they are not recommended.  The
frame engine's model is the scene's own."""
_SAME = ("solver.step_control", "rods.kind")
_SMALLER = (
    "solver.step", "solver.tolerance", "solver.deviation_tolerance", "solver.newton_tolerance",
)  # fmt: skip
NEEDED = (*OUTPUTS, *_COUNTS, "asynchrony_max", "energy_error", "status", "outcome", "final_time")


class Truth(NamedTuple):
    """A value that does not come from the multibody model: a number of ``OUTPUTS`` in its unit."""

    output: str
    source: str
    value: float


def judge(results: xr.Dataset, rungs: Sequence[Rung], truths: Sequence[Truth]) -> xr.Dataset:
    """Errors, orders, cost and the efficient frontier of a ladder.

    ``results`` are ``NEEDED`` variables over ``rung``, one entry for each of the ``rungs``, those
    of the reference among them.  The reference is the limit of the full engine's runs, for
    all; without any that of the frame engine's.

    Returns
    -------
    xr.Dataset
        Variables over ``rung``, ``output``, ``graded`` (ladders with an order), ``target`` and
        ``truth``, described by their ``long_name`` and ``units``.  ``order`` is NaN where errors
        come near the reference's own, ``reference`` for series (of the asynchrony it is the largest
        value); ``frontier`` and ``cheapest`` are among settings of the scene's own model, of both
        engines.  With rungs of the frame engine ``engines_differ`` says how far its limit is from
        that of the full one, and ``frame_uncertainty`` how well it is known.

    Raises
    ------
    ValueError
        If too few runs were completed for a reference.
    """
    alone = all(rung.fidelity != "full" for rung in rungs)
    errors = Errors(results, rungs, FRAME if alone else "full")
    error = np.array(list(errors.of.values())).T
    own = np.array(list(errors.uncertainty.values()))
    good = bounds(error, rungs, own)
    counts = {name: results[name].to_numpy().astype(float) for name in _COUNTS}
    residuals = counts.pop("newton_iterations") + counts["steps"]
    work = np.column_stack([residuals, counts["jacobians"], counts["steps"]])
    seconds = counts["cpu_time"]
    cost = np.where(errors.good, typical_cost(seconds, work, rungs), seconds)
    ladders = [rung.ladder for rung in rungs]
    choice = np.array([ladder not in _OTHER_MODELS for ladder in ladders])
    ranked = np.where(choice[:, None], good, np.nan)
    graded, orders = errors.orders()
    engines = None if alone else _engines(errors, results, rungs)
    if engines is not None:
        names, more = engines.orders
        graded, orders = [*graded, *names], np.vstack([orders, more])
    within = ranked <= np.array(TARGETS)[:, None, None]
    costs = np.where(within, in_favour(cost, ladders)[:, None], np.inf)
    pick = np.where(within.any(axis=1), costs.argmin(axis=1), -1)
    best = [errors.best.get(name, np.nan) for name in errors.of]
    both, one = ("rung", "output"), ("rung",)
    rows: list[tuple[str, tuple[str, ...], Any, str, str]] = [
        ("error", both, error, "error relative to the reference", "1"),
        ("bound", both, good,
         "largest error of this and all finer settings, plus the reference's uncertainty", "1"),
        ("order", ("graded", "output"), orders, "observed order", "1"),
        ("uncertainty", ("output",), own, "relative uncertainty of the reference", "1"),
        ("reference", ("output",), best, "extrapolated value (SI units and degrees)", ""),
        ("frontier", both, frontier(cost, ranked),
         "whether no setting is both cheaper and better", ""),
        ("cheapest", ("target", "output"), pick,
         "the cheapest setting within the target, -1 if there is none", ""),
        ("cost", one, cost, "processor time, from the fit", "s"),
        ("residual_evaluations", one, residuals,
         "residual evaluations of Newton's method in accepted steps", "1"),
        ("eligible", one, choice, "whether this setting may be recommended", ""),
        ("status", one, results.status.to_numpy(), "how the run ended", ""),
        ("ladder", one, ladders, "what the settings vary", ""),
        ("label", one, [rung.label for rung in rungs], "the setting", ""),
        ("fidelity", one, [rung.fidelity for rung in rungs], "the engine", ""),
        *((v.name, one, counts[v.name], v.long_name, v.units)
          for v in (VARIABLES[name] for name in counts)),
    ]  # fmt: skip
    if engines is not None:
        rows += [
            ("engines_differ", ("output",), engines.apart,
             "relative difference of the limits of both engines", "1"),
            ("frame_uncertainty", ("output",), engines.uncertainty,
             "relative uncertainty of the frame engine's limit", "1"),
        ]  # fmt: skip
    if "reason" in results:
        rows.append(("reason", one, results.reason.to_numpy().astype(str), "why", ""))
    for path in PATHS:
        units = "s" if path == "solver.step" else ""
        values = [rung.values[path] for rung in rungs]
        rows.append((path.replace(".", "_"), one, values, f"setting {path}", units))
    if truths:
        apart = np.array([_distances(errors, truth) for truth in truths])
        text, of_rungs = "relative difference from independent values", apart[:, :-1]
        rows += [
            ("from_truth", ("rung", "truth"), np.where(errors.good, of_rungs, np.nan).T, text, "1"),
            ("reference_from_truth", ("truth",), apart[:, -1], f"reference: {text}", "1"),
        ]
    found = xr.Dataset(
        coords={"output": list(errors.of), "target": list(TARGETS), "graded": graded}
    )
    for name, dims, values, text, units in rows:
        found[name] = (dims, values, {"long_name": text} | ({"units": units} if units else {}))
    if truths:
        found["truth"] = [f"{truth.output}: {truth.source}" for truth in truths]
    return found


class _Engines(NamedTuple):
    """The limit of the frame engine's runs against that of the full one's, shapes (output,)."""

    apart: Array
    uncertainty: Array
    orders: tuple[list[str], Array]


def _engines(full: Errors, results: xr.Dataset, rungs: Sequence[Rung]) -> _Engines | None:
    """How far the engines' limits are apart; None without enough runs of the frame engine."""
    try:
        frame = Errors(results, rungs, FRAME)
    except ValueError:
        return None
    apart = {}
    for name in (name for name in full.of if name in OUTPUTS and name in frame.of):
        both = (name, "asynchrony_max") if name == "asynchrony" else (name,)
        pairs = [(full.best_of(each).value, frame.best_of(each).value) for each in both]
        # Of series what both have: each ends with its own engine's deployment.
        apart[name] = max(float(abs(a - b).max()) / full.scale(name, a) for a, b in pairs)
    for group, members in GROUPS.items():
        if present := [m for m in members if m in apart]:
            apart[group] = max(apart[m] for m in present)
    names, orders = frame.orders()
    columns = [list(frame.of).index(name) if name in frame.of else -1 for name in full.of]
    orders = np.column_stack([orders, np.full(len(orders), np.nan)])[:, columns]
    return _Engines(
        np.array([apart.get(name, np.nan) for name in full.of]),
        np.array([frame.uncertainty.get(name, np.nan) for name in full.of]),
        ([f"{FRAME}, {name}" for name in names], orders),
    )


def settings_at(found: xr.Dataset, rung: int) -> dict[str, Any]:
    """The settings of a rung of a study by scene path."""
    return {path: found[path.replace(".", "_")].values.tolist()[rung] for path in PATHS}


def _distances(errors: Errors, truth: Truth) -> Array:
    """How far every rung, and last the reference, is from a value of other origin, relative."""
    values, best = errors.until_the_end(truth.output), errors.best_of(truth.output).value
    both = xr.concat([values, best.expand_dims("rung")], "rung")
    return np.asarray(np.abs(both.to_numpy() / truth.value - 1.0))


def bounds(error: Array, rungs: Sequence[Rung], uncertainty: Array) -> Array:
    """Errors that settings are good for, shape (rung, output); NaN where a run failed.

    ``error`` has that shape, too, and ``uncertainty``, of the reference, shape (output,).
    """
    as_fine = [[a is b or _refines(a, b) for a in rungs] for b in rungs]
    worst = np.array([np.fmax.reduce(error[finer]) for finer in as_fine])
    # Settings that differ by what changes nothing are one: what is finer than one of them counts.
    _, same = np.unique(np.nan_to_num(error, nan=-1.0), axis=0, return_inverse=True)
    worst = np.array([np.fmax.reduce(worst[same.ravel() == own]) for own in same.ravel()])
    return np.where(np.isfinite(error), worst, np.nan) + uncertainty


def _refines(fine: Rung, coarse: Rung) -> bool:
    """Whether a setting is finer in something and coarser in nothing."""
    if fine.fidelity != coarse.fidelity:
        return False
    a, b = fine.values, coarse.values
    if any(a[path] != b[path] for path in _SAME):
        return False
    finer = [b[path] - a[path] for path in _SMALLER] + [a["rods.elements"] - b["rods.elements"]]
    return bool(min(finer) >= 0.0 and max(finer) > 0.0)


def typical_cost(seconds: Array, work: Array, rungs: Sequence[Rung]) -> Array:
    """Processor time of each setting without the scatter of single timings, shape (rung,), s.

    Every piece of work costs the same within an engine, but for a factor for the rods' formulation
    and elements: fitted to the measured ``seconds``, shape (rung,), and the counts of ``work``,
    shape (rung, kinds).
    """
    cost, measured = seconds.copy(), np.isfinite(seconds)
    sizes = [(r.fidelity, r.values["rods.kind"], r.values["rods.elements"]) for r in rungs]
    for engine in {rung.fidelity for rung in rungs}:
        mine = [size for size in sizes if size[0] == engine]
        commonest = max(mine, key=mine.count)
        own = np.array([size == commonest for size in sizes]) & measured
        scale = 1.0 / np.maximum(seconds[own], 1e-9)  # relative errors count
        shares, _ = scipy.optimize.nnls(work[own] * scale[:, None], np.ones(own.sum()))
        plain = work @ shares
        for size in set(mine) if (plain[own] > 0.0).all() else ():
            members = np.array([each == size for each in sizes]) & measured & (plain > 0.0)
            if members.any():
                cost[members] = plain[members] * np.median(seconds[members] / plain[members])
    return cost


def frontier(cost: Array, error: Array) -> NDArray[np.bool_]:
    """Settings that no other one beats in both cost and error, shape (rung, output)."""
    costs, errors = cost[:, None, None], error[:, None, :]  # of the other one
    no_worse = (costs <= cost[:, None]) & (errors <= error)
    better = no_worse & ((costs < cost[:, None]) | (errors < error))
    return np.asarray(np.isfinite(error) & ~better.any(axis=0))


def in_favour(cost: Array, ladders: Sequence[str]) -> Array:
    """Cost by which settings are picked: the scene's own is kept unless another one pays."""
    return cost * np.where(np.array(ladders) == STANDING, WORTH_A_CHANGE, 1.0)


# The tables of an accuracy study, in Markdown and for terminals.


_NAMES = OUTPUTS | {group: f"all {group}" for group in GROUPS}
_BOLD = re.compile(r"\*\*(.*?)\*\*")
_WIDTH = 100
"""Of texts in a terminal."""
_THEORY = 2
"""Order of the integrator, and of the elements."""
_ADVICE = (
    "The cheapest setting for each error. The error of a setting is the largest one among this "
    "and all finer settings, plus the uncertainty of the reference: a single error may be small "
    "by chance. Errors are relative; for time series (opening angle, asynchrony) the largest "
    "difference over the run counts. Where the scene's own setting is good for an error, another "
    "one is named only if it is at least a tenth cheaper."
)
_COSTS = (
    "Errors of all settings, marked (bold or *) where no other setting is both cheaper and more "
    "accurate, by the largest error of a setting and all finer ones, as above. The cost is "
    "processor time from a fit over all runs (to residuals, Jacobians and steps), so that scatter "
    "of single timings averages out. The uncertainty of the reference is "
    "not in these errors; one that is far below it belongs to a setting that the reference is "
    "made of:"
)
_ORDERS = (
    "Observed orders: for steps the slope of their error (against the limit of fine steps with "
    "as many elements) over the step, among all steps no longer than the scene's own whose error "
    "is clearly above the uncertainty of that limit; for elements that of the changes from one "
    "number of elements to the next, with fine steps. A dash: errors or changes are too small, "
    "or hardly change:"
)
_ENGINES = (
    "How far the engines differ: the distance of the limits of their finest runs, relative, and "
    "how uncertain either limit is (that of the full engine is the reference of all errors). A "
    "difference larger than both uncertainties together, marked (bold or *), is one of the engines "
    "themselves:"
)
_TRUTHS = (
    "Difference from values that do not come from this model (they are for rigid rods; part of "
    "the difference is the rods' elasticity):"
)


def tables(found: xr.Dataset, title: str) -> str:
    """Recommendation, errors and cost, orders, and distance from independent values in Markdown.

    ``found`` is from :func:`ringsim.analysis.accuracy.judge`; ``title`` is the heading.
    """
    texts = (
        markdown_table(each.head, each.rows) if isinstance(each, Table) else each
        for each in _parts(found)
    )
    return "\n\n".join([f"# {title}", *texts]) + "\n"


def lines(found: xr.Dataset, title: str) -> list[str]:
    """The same for a terminal: what is bold there has a star."""
    told = [title]
    for each in _parts(found):
        told.append("")
        if isinstance(each, Table):
            rows = [[_BOLD.sub(r"\1 *", str(cell)) for cell in row] for row in each.rows]
            told += Table(each.head, rows).lines()
        else:
            # An override stays on its line: at what is no blank to textwrap it does not break.
            for line in re.sub(r"(--\w+) ", "\\1\u00a0", each).splitlines():
                told += textwrap.wrap(line, _WIDTH, subsequent_indent="  " * line.startswith("- "),
                                      break_on_hyphens=False, break_long_words=False)  # fmt: skip
    return [line.replace("`", "").replace("\u00a0", " ") for line in told]


def _parts(found: xr.Dataset) -> list[str | Table]:
    """Texts and tables in their order."""
    single = found.drop_sel(output=list(GROUPS), errors="ignore")
    parts: list[str | Table] = [*filter(None, [found.attrs.get("remarks")])]
    advised, letters = _advice(found)
    parts += [_ADVICE, advised, *filter(None, [letters]), _COSTS, _errors(single)]
    parts += [_ORDERS, _orders(single)]
    if "engines_differ" in found:
        parts += [_ENGINES, _engines_text(single)]
    if "from_truth" in found:
        parts += [_TRUTHS, _truths(found)]
    failed = [k for k in _distinct(found) if found.status.values[k] != Status.OK]
    if failed and "reason" in found:
        ends = [f"- {_name(found, k)}: {_end(found, k)}: {found.reason.values[k]}" for k in failed]
        parts += ["Settings whose runs failed:", "\n".join(ends)]
    return parts


def in_words(found: xr.Dataset, rung: int) -> str:
    """A setting as the overrides that give it."""
    standing, fidelity = settings_at(found, _standing(found)), found.fidelity.values[rung]
    picked = {p: v for p, v in settings_at(found, rung).items() if v != standing[p]}
    words = [f"`--fidelity {fidelity}`"] if fidelity == FRAME else []
    words += [f"`--set {path}={value}`" for path, value in picked.items()]
    return " ".join(words) or STANDING


def _advice(found: xr.Dataset) -> tuple[Table, str]:
    """The cheapest setting for each error by its letter, and what the letters are: in the table
    itself overrides would take five lines of a terminal.
    """
    targets, rows, letters = found.target.values.tolist(), [], dict[str, str]()
    for name, column in zip(_names(found), found.output, strict=True):
        of = found.sel(output=column)
        rows.append([name])
        for target, cheapest in zip(targets, of.cheapest.values, strict=True):
            if cheapest < 0:
                least = float(of.bound.where(of.eligible).min())
                coarse = of.uncertainty >= target
                rows[-1].append(
                    "reference too coarse" if coarse else f"none tried: {least:.2g} at best"
                )
                continue
            if (word := in_words(of, cheapest)) != STANDING:
                word = letters.setdefault(word, chr(ord("A") + len(letters)))
            rows[-1].append(f"{word}, {of.cost.values[cheapest]:.3g} s")
    table = Table(["error of", *(f"{target:g}" for target in targets)], rows)
    return table, "\n".join(f"- {letter}: {words}" for words, letter in letters.items())


def _errors(found: xr.Dataset) -> Table:
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
    return Table(head + _names(found), rows)


def _orders(found: xr.Dataset) -> Table:
    rows = [
        [name, str(_THEORY), *(f"{o:.1f}" if np.isfinite(o) else "-" for o in orders)]
        for name, orders in zip(found.graded.values.tolist(), found.order.values, strict=True)
    ]
    return Table(["ladder", "theory", *_names(found)], rows)


def _engines_text(found: xr.Dataset) -> Table:
    apart, full, frame = (
        found[name].values for name in ("engines_differ", "uncertainty", "frame_uncertainty")
    )
    rows = [
        [name, f"**{d:.1e}**" if d > u + v else f"{d:.1e}", f"{u:.1e}", f"{v:.1e}"]
        for name, d, u, v in zip(_names(found), apart, full, frame, strict=True)
        if np.isfinite(d)
    ]
    head = ["output", "engines differ by", "uncertainty, full", "uncertainty, frame"]
    return Table(head, rows)


def _truths(found: xr.Dataset) -> Table:
    rows = []
    for of in (found.sel(truth=name) for name in found.truth):
        output, _, source = of.truth.item().partition(": ")
        gaps = (of.reference_from_truth.item(), of.from_truth.values[_standing(found)])
        rows.append([f"{_NAMES.get(output, output)}, {source}", *(f"{gap:.1e}" for gap in gaps)])
    return Table(["value", "reference", STANDING], rows)


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
