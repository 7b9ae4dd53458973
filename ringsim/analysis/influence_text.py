"""What matters, as lines for people."""

from collections.abc import Collection, Iterator

import numpy as np
import xarray as xr

from ringsim.analysis.indices import UNLIKELY
from ringsim.analysis.influence import confounding_notes
from ringsim.analysis.intervals import LEVEL, quantities
from ringsim.analysis.worst import marked
from ringsim.stepping.instant import Array
from ringsim.tables import Table, counted, interval_text, number_text

# What matters, as lines for people.


_NAMED = {False: 5, True: 3}
"""Inputs that are told for each output and group, and single places of such that have many."""


def influence_tables(
    analysis: xr.Dataset, outputs: Collection[str] | None = None
) -> tuple[Table, ...]:
    """The inputs that go with each output most (of ``outputs``, by default of all), and that
    separate each group best.
    """
    if "input_is_place" not in analysis:  # too few samples
        return ()
    found = [_correlated(analysis, quantities() if outputs is None else outputs)]
    return (*found, _separated(analysis)) if "group" in analysis.dims else (*found,)


def _correlated(analysis: xr.Dataset, outputs: Collection[str]) -> Table:
    names, place = analysis["input"].values, analysis["input_is_place"].values
    rows, notes, certain, least, lacking = [], list[str](), False, 0, list[str]()
    named = set[str]()
    for output in outputs:
        if f"{output}_rank_correlation" not in analysis:
            continue
        plain, partial = (
            (
                analysis[f"{output}_{word}rank_correlation"].values,
                analysis[f"{output}_{word}rank_correlation_interval"].values,
            )
            for word in ("", "partial_")
        )
        certain = certain or bool(np.isfinite(plain[1]).any())
        used = int(analysis[f"{output}_samples"].values[0])
        least = min(least or used, used)
        chosen = _largest(plain[0], place)
        named |= {str(names[k]) for k in chosen}
        rows += [
            (
                f"{output} with {names[k]}",
                *_with_interval(*plain, k), *_with_interval(*partial, k), str(used),
            )
            for k in chosen
        ]  # fmt: skip
        if np.isnan(partial[0][chosen]).any():
            alike = [str(names[k]) for k in chosen if np.isnan(plain[0][k])]
            why = f"{alike[0]} is the same in all samples used" if alike else (
                "they are too few, or inputs depend on each other"
            )  # fmt: skip
            lacking.append(f"{output} ({used} samples used: {why})")
    if lacking:
        notes.append(f"no partial correlation, which holds the other inputs: {', '.join(lacking)}")
    if rows:
        chance = (
            f"the intervals of about {(1 - LEVEL) * len(names):.2g} of them leave out zero"
            if certain else f"one in twenty reaches {1.96 / (least - 1) ** 0.5:.2g}"
        )  # fmt: skip
        notes.append(f"told are the largest of {len(names)} inputs: by chance alone {chance}")
        notes += confounding_notes(analysis, named)
    head = ("rank correlation", "correlation", "95 % interval", "partial", "95 % interval")
    return marked(Table((*head, "used"), rows, notes), analysis)


def _separated(analysis: xr.Dataset) -> Table:
    names, place = analysis["input"].values, analysis["input_is_place"].values
    rows, notes = [], list[str]()
    for group in analysis["group"].values:
        one = analysis.sel(group=group)
        first, *others = str(group).split("; ")
        if others:
            notes.append(f"{first}: the same samples as {', '.join(others)}")
        middle, ends = one["separation"].values, one["separation_interval"].values
        rows += [
            (f"{first}: {names[k]}", *directed(middle, ends, k), str(one["group_samples"].item()))
            for k in _largest(middle - 0.5, place)
        ]  # fmt: skip
    head = ("what separates", *DIRECTED, "samples")
    return marked(Table(head, rows, notes), analysis)


DIRECTED = ("it is", "with probability", "95 % interval")
"""Heads of ``directed``."""


def directed(middle: Array, ends: Array, k: int) -> tuple[str, str, str]:
    """Whether an input is larger or smaller in a group than in the rest, with which probability (of
    a sample of each), and its interval.
    """
    if middle[k] >= 0.5:
        return "larger", *_with_interval(middle, ends, k)
    return "smaller", *_with_interval(1.0 - middle, 1.0 - ends[:, ::-1], k)


def _largest(values: Array, place: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[int]:
    """The largest ones of inputs, then of places, among which chance has more."""
    size = np.abs(np.where(np.isnan(values), 0.0, values))
    order = np.argsort(-size, kind="stable")
    return [int(k) for kind, most in _NAMED.items() for k in order[place[order] == kind][:most]]


def _with_interval(middle: Array, ends: Array, k: int) -> tuple[str, str]:
    return number_text(middle[k], 2), interval_text(float(ends[k, 0]), float(ends[k, 1]), 2)


# Indices of sensitivity as lines for people.


Outputs = Collection[str] | None
"""Names of outputs to tell of beside failures; None for all."""
_MOST = 5
"""Groups or inputs that are told for each output."""
_MOST_PLACES = 3
_SLACK = 0.05
"""How far Sobol' indices may lie above what is possible before that is told."""
_LEAST = -0.1
"""Below zero they lie more often: the errors of first-order indices are those of the larger ones.
"""
_WIDE = 0.5
"""Length from which on an interval of a Sobol' index says next to nothing."""
SETS = (
    ("total_index", "first_order_index"),
    ("mean_absolute_effect", "effect_deviation"),
    ("given_data_index", "chance_level"),
)
"""Measures of each kind of design, the first of which orders the groups."""
HEADS = {
    "total_index": "total index", "first_order_index": "first-order index",
    "mean_absolute_effect": "mu*", "effect_deviation": "sigma",
    "given_data_index": "first-order index", "chance_level": "by chance up to",
    "second_order_index": "second-order index",
}  # fmt: skip


def _ends(interval: Array) -> str:
    return interval_text(float(interval[0]), float(interval[1]), 2)


def _told(analysis: xr.Dataset, names: tuple[str, ...], outputs: Outputs) -> Table:
    """The groups, or inputs, that matter most for each output."""
    (dim,) = analysis[names[0]].dims[1:]
    place = (
        analysis["input_is_place"].values
        if dim == "input" and "input_is_place" in analysis
        else np.zeros(analysis.sizes[dim], dtype=bool)
    )
    of = "samples" if dim == "input" else "blocks"
    head = ["what explains"]
    for name in names:
        head += [HEADS[name]] + ["95 % interval"] * (f"{name}_interval" in analysis)
    rows, named = [], set[str]()
    for output in chosen_of(analysis, outputs):
        one = analysis.sel(output=output)
        size = np.nan_to_num(one[names[0]].values, nan=-np.inf)
        order = np.argsort(-size, kind="stable")
        chosen = [k for k in order[~place[order]][:_MOST] if np.isfinite(size[k])]
        chosen += [k for k in order[place[order]][:_MOST_PLACES] if np.isfinite(size[k])]
        named |= {str(analysis[dim].values[k]) for k in chosen}
        for k in chosen:
            row = [f"{output} by {analysis[dim].values[k]}"]
            for name in names:
                row.append(number_text(one[name].values[k], 2))
                if f"{name}_interval" in one:
                    row.append(_ends(one[f"{name}_interval"].values[k]))
            rows.append([*row, str(one["index_used"].item()), str(one["index_lost"].item())])
    notes = measure_notes(analysis)
    notes += confounding_notes(analysis, named) if dim == "input" else []
    return marked(Table([*head, f"{of} used", "lost"], rows, notes), analysis)


def _gate(analysis: xr.Dataset, only: Outputs) -> Iterator[str]:
    """What became of outputs that samples lack: why there is no index, or why there is one."""
    if "missing_by_inputs" not in analysis:
        return
    outputs: dict[tuple[int, int, float], list[str]] = {}
    blocks = ", and the rest of their blocks," if "factor" in analysis.dims else ""
    for output in chosen_of(analysis, only):
        one = analysis.sel(output=output)
        if count := one["missing"].item():
            chance = round(one["missing_by_inputs"].item(), 4)
            failed = one["missing_lost"].item()
            outputs.setdefault((count, failed, chance), []).append(output)
    for (count, failed, chance), names in outputs.items():
        who = ", ".join(names[:_MOST]) + (f" and {len(names) - _MOST} more" * (len(names) > _MOST))
        p = f"p = {chance:.2g}" if chance else "p < 0.0001"
        if chance < UNLIKELY:
            cures = ["require or analyse the outcome instead"] * (failed < count)
            if failed:  # what did not fail has no value because of what the antenna did
                cures.append(f"mend the {failed} that failed (ringsim campaign --retry-failed)")
            yield (
                f"no index of {who}: {counted(count, 'sample')} without a value, and which ones "
                f"depends on inputs ({p}), so that the others are another population: see what "
                f"separates them, {', '.join(cures)}, or narrow the inputs"
            )
        else:
            yield (
                f"{who}: {counted(count, 'sample')} without a value, as far as one can tell "
                f"whatever their inputs are ({p}); they{blocks} are left out"
            )


def sensitivity_tables(analysis: xr.Dataset, outputs: Outputs = None) -> list[Table]:
    """Indices of failures and of ``outputs``, by default of all, and what they leave out."""
    found = []
    if names := next((names for names in SETS if names[0] in analysis), ()):
        found.append(_told(analysis, names, outputs))
    if "second_order_index" in analysis:
        found.append(_second(analysis, outputs))
    return found + refusals(analysis, outputs)


def measure_notes(analysis: xr.Dataset) -> list[str]:
    """What the measure of the design means, or lacks."""
    if "mean_absolute_effect" in analysis:
        return [
            "mu*: mean absolute change of the output, in its unit, when the group moves by half of "
            "its levels; sigma: scatter of that change"
        ]
    if "total_index" in analysis:
        none = analysis["total_index_interval"].isnull().all()
        cure = "no intervals: give design.replicates = 8, or more, for independent replicates"
        return [cure] * bool(none) + _unsure(analysis)
    if "given_data_index" in analysis:
        return [
            "shares of the variance by one input alone, from bins: corrected for chance, too small "
            "where the output bends within a bin"
        ]
    return []


def _unsure(analysis: xr.Dataset) -> list[str]:
    """A note if Sobol' indices are what none can be, or intervals too long to tell anything."""
    first, total = (analysis[f"{each}_index"].values for each in ("first_order", "total"))
    ends = [analysis[f"{each}_index_interval"].values for each in ("first_order", "total")]
    # Without intervals, what the estimators leave open is not known.
    low, high = (
        np.where(np.isnan(end), value + side, end)
        for end, value, side in (
            (ends[0][..., 0], first, -_SLACK),
            (ends[1][..., 1], total, _SLACK),
        )
    )
    both, wide = np.stack([first, total]), np.stack([np.ptp(each, axis=-1) for each in ends])
    signs = {
        f"indices outside of 0 .. 1 ({number_text(_farthest(both), 2)})": (
            (both < _LEAST) | (both > 1.0 + _SLACK)
        ).any(axis=(0, 2)),
        "first-order indices above total ones": (low > high).any(axis=1),
        f"intervals longer than {_WIDE}": (wide > _WIDE).any(axis=(0, 2)),
    }  # fmt: skip
    outputs = analysis["output"].values
    found = [f"{sign} of {', '.join(outputs[own])}" for sign, own in signs.items() if own.any()]
    if not found:
        return []
    return [f"too few base samples: {'; '.join(found)}: give more of them (design.samples)"]


def _farthest(values: Array) -> float:
    """The value that is farthest from what lies between 0 and 1."""
    known = values[np.isfinite(values)]
    return float(known[np.argmax(np.abs(known - 0.5))]) if len(known) else np.nan


def refusals(analysis: xr.Dataset, outputs: Outputs = None) -> list[Table]:
    """What became of outputs that samples lack, as notes."""
    lines = list(_gate(analysis, outputs))
    return [Table((), (), lines)] if lines else []


def chosen_of(analysis: xr.Dataset, outputs: Outputs) -> list[str]:
    """Of the outputs with indices those to tell of: failures are no quantities."""
    known = analysis["output"].values.tolist()
    return [n for n in known if outputs is None or n in outputs or n not in quantities()]


def _second(analysis: xr.Dataset, outputs: Outputs) -> Table:
    rows, factors = [], analysis["factor"].values
    for output in chosen_of(analysis, outputs):
        one = analysis.sel(output=output)
        values = one["second_order_index"].values
        found = [(j, k) for j in range(len(factors)) for k in range(j) if np.isfinite(values[j, k])]
        for j, k in sorted(found, key=lambda pair: -values[pair])[:_MOST_PLACES]:
            ends = one["second_order_index_interval"].values[j, k]
            rows.append((f"{output} by {factors[k]} with {factors[j]}",
                         number_text(values[j, k], 2), _ends(ends)))  # fmt: skip
    head = ("what explains", "second-order index", "95 % interval")
    return marked(Table(head, rows), analysis)
