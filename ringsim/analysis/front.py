"""What an optimisation has found: the file of the front, and its tables."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import netCDF4
import numpy as np

from ringsim.analysis.design import placement
from ringsim.analysis.engines import differences, too_far
from ringsim.analysis.intervals import (
    CHECKED,
    LEAST_OF_BOOTSTRAP,
    good,
    numbers,
    quantities,
    share_interval,
)
from ringsim.analysis.optimum import Found, Judged, Objective, Problem
from ringsim.analysis.verdicts import Verdict, judge
from ringsim.files import whole, writing
from ringsim.stepping.instant import Array
from ringsim.tables import (
    Table,
    amount_text,
    bound_text,
    counted,
    interval_text,
    number_text,
    readable,
    unit_behind,
    unit_text,
)
from ringsim.variables import GOALS

if TYPE_CHECKING:
    import xarray as xr


class Axis(NamedTuple):
    """A variable: its name, unit and ends."""

    name: str
    units: str
    low: float
    high: float


def write_front(
    path: Path, problem: Problem, found: Found, axes: Sequence[Axis],
    values: Callable[[Array], Sequence[float]], fresh: Mapping[str, Mapping[str, Any]],
    attributes: Mapping[str, Any],
) -> None:  # fmt: skip
    """Write front.nc; it replaces another one once it is complete.

    ``values`` are those of a design in the unit box; ``fresh`` is what the verdict's samples say,
    by the name of each design, the present one first, with the same keys in all.
    """
    places, aims = [0, *(one.place for one in found.chosen)], problem.objectives
    bounds = problem.bounds
    sizes = {
        "tried": len(found.points), "design": len(places), "variable": len(axes),
        "objective": len(aims), "bound": len(bounds), "requirement": len(problem.requirements),
        "output": len(outputs_of(problem)),
    }  # fmt: skip

    def shown_of(steered: Array) -> Array:
        """Objectives as they are told, shape (designs, objectives)."""
        return np.column_stack([aim.shown(steered[:, k]) for k, aim in enumerate(aims)])

    def shown(ones: Sequence[Judged], more: Array | float = 0.0) -> Array:
        return shown_of(np.array([one.objectives for one in ones]).reshape(-1, len(aims)) + more)

    def beyond(ones: Sequence[Judged]) -> Array:
        return np.array([one.beyond for one in ones]).reshape(-1, len(bounds))

    none = Judged(np.full(len(aims), np.nan), np.full(len(bounds), np.nan), np.nan, np.zeros(0))
    checks = [found.checks.get(k, none) for k in range(len(found.points))]
    few, many = ([every[k] for k in places] for every in (found.judged, checks))
    shift = np.array([b.parts - a.parts for a, b in zip(few, many, strict=True)])
    width = len(places), len(axes)
    without = np.full((*width, len(aims)), np.nan)
    without_beyond, without_lost = np.full((*width, len(bounds)), np.nan), np.full(width, np.nan)
    for k, one in enumerate(found.chosen, start=1):
        without[k] = shown(one.without, shift[k, : len(aims)])
        without_beyond[k] = beyond(one.without) + shift[k, len(aims) :]
        without_lost[k] = [each.lost for each in one.without]
    aimed_at = "quantile aimed at less the bound"
    says: dict[str, tuple[tuple[str, ...], Any, str]] = {
        "tried_value": (("tried", "variable"), [values(p) for p in found.points],
                        "values of all designs that were run: first those of the search, then "
                        "chosen ones with one variable as at present"),
        "tried_objective": (("tried", "objective"), shown(found.judged),
                            "statistic by the few samples of the search"),
        "tried_beyond": (("tried", "bound"), beyond(found.judged),
                         f"{aimed_at}, by the few samples of the search"),
        "tried_lost": (("tried",), [one.lost for one in found.judged],
                       "share of these samples without a value"),
        "tried_estimate": (("tried", "objective"), shown_of(found.corrected[:, : len(aims)]),
                           "the same statistic, corrected by the checks of designs nearby"),
        "tried_estimate_beyond": (("tried", "bound"), found.corrected[:, len(aims) :],
                                  f"{aimed_at}, likewise"),
        "tried_check_objective": (("tried", "objective"), shown(checks),
                                  "statistic by the check samples; NaN without a check"),
        "tried_check_beyond": (("tried", "bound"), beyond(checks), f"{aimed_at}, likewise"),
        "tried_check_lost": (("tried",), [one.lost for one in checks],
                             "share of these samples without a value"),
        "place": (("design",), places, "number among the tried ones, from 0"),
        "value": (("design", "variable"), [values(found.points[k]) for k in places],
                  "values of the present design, and of the chosen ones"),
        "searched": (("design", "objective"), shown(few), "statistic by the few samples"),
        "searched_beyond": (("design", "bound"), beyond(few), f"{aimed_at}, by the few samples"),
        "check_objective": (("design", "objective"), shown(many), "statistic by the check samples"),
        "check_beyond": (("design", "bound"), beyond(many), f"{aimed_at}, by the check samples"),
        "check_lost": (("design",), [one.lost for one in many],
                       "share of the check samples without a value"),
        "shift_objective": (("design", "objective"), shift[:, : len(aims)],
                            "by what the check samples differ from the few, as it is steered: "
                            "largest values with the sign changed, probabilities as normal scores"),
        "shift": (("design", "bound"), shift[:, len(aims) :],
                  "by what the check samples differ from the few"),
        "without": (("design", "variable", "objective"), without,
                    "statistic with the variable as it is at present, by the few samples and the "
                    "shift of the design"),
        "without_beyond": (("design", "variable", "bound"), without_beyond,
                           f"{aimed_at}, likewise"),
        "without_lost": (("design", "variable"), without_lost,
                         "share of the few samples without a value, likewise"),
        "objective_sign": (("objective",), [aim.sign for aim in aims],
                           "1 if small values are wanted, -1 if large ones are"),
        "confidence": (("requirement",), [r.confidence for r in problem.requirements.values()],
                       "confidence of each lower bound of a probability"),
        "low": (("variable",), [axis.low for axis in axes], "least value"),
        "high": (("variable",), [axis.high for axis in axes], "largest value"),
    }  # fmt: skip
    for name, (dims, meaning) in FRESH.items():
        says[name] = ("design", *dims), [each[name] for each in fresh.values()], meaning
    words = {
        "design": list(fresh), "variable": [axis.name for axis in axes],
        "objective": [aim.told for aim in aims], "requirement": list(problem.requirements),
        "bound": [f"{name} {'<=' if s > 0 else '>='} {b:g}" for name, s, b, _ in bounds],
        "variable_units": [axis.units for axis in axes], "objective_units": [a.units for a in aims],
        "bound_units": [quantities()[name].units for name, *_ in bounds],
        "requirement_text": [one.told(name) for name, one in problem.requirements.items()],
        "output": outputs_of(problem),
        "output_units": [quantities()[name].units for name in outputs_of(problem)],
    }  # fmt: skip
    with writing(path), whole(path) as draft, netCDF4.Dataset(draft, "w") as file:
        file.setncatts(dict(attributes) | {"designs": found.searched})
        for name, size in sizes.items():
            file.createDimension(name, size)
        for name, known in words.items():
            along = name if name in sizes else name.partition("_")[0]
            file.createVariable(name, str, (along,))[:] = np.array(known, dtype=object)
        for name, (dims, given, meaning) in says.items():
            array = np.asarray(given)
            made = file.createVariable(name, "i8" if array.dtype.kind == "i" else "f8", dims)
            if array.size:
                made[...] = array
            made.setncatts({"long_name": meaning})


FRESH: dict[str, tuple[tuple[str, ...], str]] = {
    "objective_value": (("objective",), "statistic by the fresh samples of the verdict"),
    "objective_lower": (("objective",), "end of its interval of 95 %"),
    "objective_upper": (("objective",), "end of its interval of 95 %"),
    "gain": (("objective",), "by how much the statistic is better than that of the present design"),
    "gain_lower": (("objective",), "end of its interval of 95 %, over pairs of equal samples"),
    "gain_upper": (("objective",), "end of its interval of 95 %, likewise"),
    "probability": (("requirement",), "share of the fresh samples that keep to the requirement"),
    "probability_lower": (("requirement",), "one-sided lower bound of the probability"),
    "verdict": (("requirement",), "verdict: 0 not met, 1 not yet shown, 2 met"),
    "short": ((), "fresh samples that failed or ended before their goal"),
    "compared": ((), "fresh samples that both engines completed"),
    "difference": (("output",), "largest difference of the engines in these samples; NaN if none"),
}
"""What the verdict's samples say of a design, along these beyond it."""


def outputs_of(problem: Problem) -> list[str]:
    """Outputs with a number that are made small, large, or required."""
    aims = (aim.output for aim in problem.objectives)
    return list(dict.fromkeys([*aims, *(name for name, *_ in problem.bounds)]))


def _statistic(aim: Objective, values: Array) -> Any:
    """Mean, quantile or share of known values along the last axis, as it is told."""
    if aim.statistic == "probability":
        return aim.beyond(values).mean(axis=-1)
    if aim.statistic == "quantile":
        return np.quantile(values, aim.probability, axis=-1, method="hazen")
    return values.mean(axis=-1)


def fresh_of(campaign: "xr.Dataset", problem: Problem) -> dict[str, Any]:
    """What the fresh samples of a design say, by the keys of ``FRESH``, but for the gain; the
    values of the objectives, NaN of samples that do not count; and what ``too_far`` says.
    """
    ended = np.isin(campaign["outcome"].to_numpy(), [*map(int, GOALS)])
    placed, used = placement(campaign), good(campaign) & ended
    sample, rows, kept = campaign["sample"].to_numpy(), [], []
    for each in problem.objectives:
        values = numbers(campaign, each.output)
        known = used & np.isfinite(values)
        kept.append(np.where(known, values, np.nan))
        own = values[known]
        if not len(own):
            rows.append((np.nan, np.nan, np.nan))
            continue
        if each.statistic == "probability":
            ends = share_interval(int(each.beyond(own).sum()), len(own))
        else:
            of = np.mean if each.statistic == "mean" else each.probability
            ends = placed.interval(own, sample[known], of)
        rows.append((float(_statistic(each, own)), *ends))
    told = judge(campaign, problem.requirements, placed)
    objective, lower, upper = (np.array(rows)[:, k] for k in range(3))
    checked = f"status{CHECKED}" in campaign
    apart = {one.name: one for one in differences(campaign)} if checked else {}
    return {
        "objective_value": objective, "objective_lower": lower, "objective_upper": upper,
        "values": kept, "too_far": too_far(campaign), "short": int((~used).sum()),
        "compared": max((len(one.samples) for one in apart.values()), default=0),
        "difference": [float(apart[name].apart.max()) if name in apart else np.nan
                       for name in outputs_of(problem)],
        **{name: told[name].to_numpy().astype(int if name == "verdict" else float)
           for name in ("probability", "probability_lower", "verdict")},
    }  # fmt: skip


def gains(aim: Objective, present: Array, other: Array) -> tuple[float, float, float]:
    """By how much a design is better than the present one, and the interval of 95 % of that, by the
    bootstrap of pairs; NaN where a sample has no value, and ends of a quantile that less than one
    sample lies beyond.
    """
    known = np.isfinite(present) & np.isfinite(other)
    if (count := int(known.sum())) < LEAST_OF_BOOTSTRAP:
        return np.nan, np.nan, np.nan
    picks = np.random.default_rng(0).integers(0, count, (400, count))
    first, second = present[known], other[known]
    middle = float(aim.sign * (_statistic(aim, first) - _statistic(aim, second)))
    if aim.statistic == "quantile" and min(aim.probability, 1.0 - aim.probability) * count < 1.0:
        return middle, np.nan, np.nan
    every = aim.sign * (_statistic(aim, first[picks]) - _statistic(aim, second[picks]))
    return middle, *np.quantile(every, [0.025, 0.975]).tolist()


def front_tables(found: "xr.Dataset") -> list[Table]:
    """What an optimisation found (the dataset of its front): designs, and what variables buy."""
    return [_designs(found), *_bought(found)]


def _in_units(values: Array, units: str) -> tuple[Array, str]:
    known = values[np.isfinite(values)]
    factor, told = readable(units, float(np.abs(known).max()) if len(known) else 0.0)
    return factor * values, unit_behind("", told)


def _designs(found: "xr.Dataset") -> Table:
    """A column a design: values, then what the fresh samples say."""
    names = [str(name) for name in found["design"].values]
    rows = []
    for k, variable in enumerate(found["variable"].values):
        values, unit = _in_units(
            found["value"].values[:, k], str(found["variable_units"].values[k])
        )
        rows.append((f"{variable}{unit}", *(number_text(v, 4) for v in values)))
    for k, objective in enumerate(found["objective"].values):
        units = str(found["objective_units"].values[k])
        middle, low, high = (
            found[f"objective_{end}"].values[:, k] for end in ("value", "lower", "upper")
        )
        factor, told = readable(units, float(np.nanmax(np.abs(middle), initial=0.0)))
        own = (number_text(factor * v, 4) for v in middle)
        rows.append((unit_behind(str(objective), told), *own))
        rows.append(("95 %", *(
            interval_text(factor * a, factor * b) for a, b in zip(low, high, strict=True)
        )))  # fmt: skip
        low, high = (found[f"gain_{end}"].values[1:, k] for end in ("lower", "upper"))
        rows.append(("better by, 95 %", "", *(
            interval_text(factor * a, factor * b) for a, b in zip(low, high, strict=True)
        )))  # fmt: skip
    for k, words in enumerate(found["requirement_text"].values):
        share, least = (found[f"probability{end}"].values[:, k] for end in ("", "_lower"))
        rows.append((f"{words}: share that meets it", *(number_text(v, 4) for v in share)))
        sure = f"at least, with confidence {float(found['confidence'].values[k]):g}"
        rows.append((sure, *(bound_text(v, upper=False) for v in least)))
        name = found["requirement"].values[k]
        verdict = (Verdict(int(v)).words for v in found["verdict"].values[:, k])
        rows.append((f"verdict on {name}", *verdict))
    both = found["compared"].values
    for k, name in enumerate(found["output"].values if both.any() else ()):
        values, unit = _in_units(
            found["difference"].values[:, k], str(found["output_units"].values[k])
        )
        what = f"{name}{unit}: largest difference of the engines"
        rows.append((what, *("-" if np.isnan(v) else f"{v:.2g}" for v in values)))
    return Table(("", *names), rows, _notes(found, names))


def _notes(found: "xr.Dataset", names: list[str]) -> list[str]:
    """What the table of designs does not say by itself."""
    about, both = found.attrs, int(found["compared"].values.max())
    checks = int(np.isfinite(found["tried_check_lost"].values).sum())
    notes = [
        f"statistics, shares and verdicts are of {int(about['verdict_samples'])} fresh samples of "
        f"each design, which have chosen none; the search has tried {int(about['designs'])} "
        f"designs with {int(about['samples'])} samples each, and checked {checks} of them with "
        f"{int(about['check_samples'])} others"
    ]
    if more := found.sizes["tried"] - int(about["designs"]):
        notes[0] += f"; {counted(more, 'further design')} with one variable as at present"
    if both:
        notes.append(f"the full engine has run {both} of the fresh samples of each design, too")
    far, lost = found["check_beyond"].values, found["check_lost"].values
    keeps = (lost == 0.0) & (far <= 0.0).all(axis=1)
    best = names[-1] if len(names) == 1 else " and ".join(names[1:])
    if len(names) == 1:
        notes.append("the present design is the best one found")
    if not keeps.any():
        amounts = [f"{share:.2g} of its check samples fail" for share in lost[-1:] if share > 0.0]
        amounts += [
            f"{bound} by {amount_text(v, units)}" for bound, v, units in zip(
                found["bound"].values, far[-1], found["bound_units"].values, strict=True
            ) if v > 0.0
        ]  # fmt: skip
        told = f" ({', '.join(amounts)})" if len(names) <= 2 else ""
        notes.append(
            "no design that was tried surely keeps to all constraints, by the quantiles that are "
            f"aimed at: {best} {'are' if len(names) > 2 else 'is'} least beyond{told}"
        )
    for k, name in enumerate(names[1:], start=1):
        # Over pairs: runs that fail in one of both alone would shift its statistic.
        if (found["gain"].values[k] < 0.0).all():
            why = "which keeps to all constraints: keep that one" if keeps[0] else (
                "which does not keep to all constraints" if keeps[k]
                else "and neither keeps to all constraints")  # fmt: skip
            aims = " and ".join(str(each) for each in found["objective"].values)
            notes.append(f"in {aims} {name} is worse than the present design, {why}")
    short = {n: int(v) for n, v in zip(names, found["short"].values, strict=True) if v}
    if short:
        told = ", ".join(f"{v} of {n}" for n, v in short.items())
        notes.append(f"failed, or ended before their goal, and not in the statistics: {told}")
    at_edge = _at_bounds(found)
    if at_edge:
        notes.append(f"at a bound, beyond which there may be better ones: {', '.join(at_edge)}")
    return notes


def _at_bounds(found: "xr.Dataset") -> list[str]:
    """Variables that some chosen design has at an end of their range."""
    low, high = found["low"].values, found["high"].values
    values = found["value"].values[1:]
    near = 0.01 * (high - low)
    lowest, highest = (values <= low + near).any(axis=0), (values >= high - near).any(axis=0)
    return [
        f"{name} ({' and '.join(['low'] * int(a) + ['high'] * int(b))})"
        for name, a, b in zip(found["variable"].values, lowest, highest, strict=True) if a or b
    ]  # fmt: skip


def _bought(found: "xr.Dataset") -> list[Table]:
    """For each chosen design what it loses with one variable as it is at present."""
    tables = []
    bounds = [str(v) for v in found["bound"].values]
    for k, name in enumerate(found["design"].values[1:], start=1):
        own, rows = found["check_beyond"].values[k], []
        for j, variable in enumerate(found["variable"].values):
            cells = []
            for i, units in enumerate(found["objective_units"].values):
                before = float(found["check_objective"][k, i])
                change = float(found["without"][k, j, i]) - before
                factor, told = readable(str(units), abs(before))
                cells.append(f"{factor * change:+.3g} {unit_text(told)}".rstrip())
            lost = float(found["without_lost"][k, j])
            broken = [f"{lost:.2g} of the samples fail"] if lost > 0.0 else []
            each = zip(bounds, found["without_beyond"].values[k, j], own,
                       found["bound_units"].values, strict=True)  # fmt: skip
            for bound, far, mine, units in each:
                if far > 0.0:
                    itself = f" ({name} itself by {amount_text(mine, units)})" if mine > 0.0 else ""
                    broken.append(f"{bound} by {amount_text(far, units)}{itself}")
            rows.append((str(variable), *cells, ", ".join(broken) or "-"))
        last = k == found.sizes["design"] - 1
        changes = (f"change of {each}" for each in found["objective"].values)
        notes = [
            f"by the {counted(int(found.attrs['samples']), 'sample')} of the search, the same in "
            "all designs, and what the check of the design has corrected; beyond: of the quantile "
            "that is aimed at, so that the verdict can show the one required"
        ] * last
        head = f"{name} with the present", *changes, "is then beyond"
        tables.append(Table(head, rows, notes))
    return tables
