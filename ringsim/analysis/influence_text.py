"""What matters, as tables: in short only what stands out of chance, then every measure."""

from collections.abc import Iterator, Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.campaign_notes import marked
from ringsim.analysis.design import DIFFERENCE
from ringsim.analysis.influence import (
    RANKS,
    apart,
    confounding_notes,
    partners,
    places_in,
    separating,
    standing_out,
    strongest,
)
from ringsim.analysis.intervals import ALIKE, LEVEL, hardly_apart, is_moment, quantities
from ringsim.analysis.sensitivity import refusals
from ringsim.stepping.instant import Array
from ringsim.tables import Table, counted, interval_text, number_text

# Every measure: the largest rank correlations, indices and areas of each output.


_ALONE = 0.999
"""Rank correlation from which on what is left of the ranks tells nothing of the other inputs."""
_NAMED = {False: 5, True: 3}
"""Inputs that are told for each output and group, and single places of such that have many."""


def influence_tables(analysis: xr.Dataset) -> tuple[Table, ...]:
    """The inputs that go with each output most, and that separate each group best."""
    if "input_is_place" not in analysis:  # too few samples
        return ()
    found = [_correlations_table(analysis)]
    return (*found, _separated(analysis)) if "group" in analysis.dims else (*found,)


def _correlations_table(analysis: xr.Dataset) -> Table:
    names, place = analysis["input"].values, analysis["input_is_place"].values
    within = places_in(analysis)
    rows, notes, certain, least, lacking = [], list[str](), False, 0, list[str]()
    lonely, alike = False, dict[str, list[str]]()
    named = set[str]()
    for output in _correlated(analysis):
        plain, partial = (
            (
                analysis.variables[f"{output}_{word}rank_correlation"].values,
                analysis.variables[f"{output}_{word}rank_correlation_interval"].values,
            )
            for word in ("", "partial_")
        )
        certain = certain or bool(np.isfinite(plain[1]).any())
        used = int(analysis[f"{output}_samples"].values[0])
        least = min(least or used, used)
        for k in np.flatnonzero(np.isnan(plain[0])).tolist():
            alike.setdefault(str(names[k]), []).append(output)
        chosen = [k for k in _largest(plain[0], place, names, within) if np.isfinite(plain[0][k])]
        named |= {str(names[k]) for k in chosen}
        rows += [
            (
                f"{output} with {names[k]}",
                *_with_interval(*plain, k), *_with_interval(*partial, k), str(used),
            )
            for k in chosen
        ]  # fmt: skip
        some = np.isnan(partial[0][chosen])
        lonely |= bool(some.any() and not some.all())
        if some.all() and len(chosen):
            alone = np.nanmax(np.abs(plain[0][chosen])) > _ALONE
            why = "one input determines the ranks" if alone else (
                "too few samples, or correlated inputs"
            )  # fmt: skip
            lacking.append(f"{output} ({counted(used, 'sample')} used: {why})")
    if lonely:
        notes.append(
            "partial: effect of one input with the others removed; none for single places, of "
            "which there are too many for so few samples"
        )
    if lacking:
        notes.append(
            "no partial correlation (effect of one input with the others removed): "
            f"{', '.join(lacking)}"
        )
    notes += [
        f"{name} is the same in all samples used for {', '.join(each)}: no correlation with it"
        for name, each in alike.items()
    ]
    if rows:
        chance = (
            f"about {(1 - LEVEL) * len(names):.2g} of their intervals exclude zero"
            if certain else f"one in twenty reaches {1.96 / (least - 1) ** 0.5:.2g}"
        )  # fmt: skip
        notes.append(f"the strongest of {len(names)} inputs are listed; by chance alone {chance}")
        notes += confounding_notes(analysis, named)
    head = ("rank correlation", "correlation", "95 % interval", "partial", "95 % interval")
    return marked(Table((*head, "samples used"), rows, notes), analysis)


def _separated(analysis: xr.Dataset) -> Table:
    names, place = analysis["input"].values, analysis["input_is_place"].values
    within = places_in(analysis)
    rows, notes = [], list[str]()
    for group in analysis["group"].values:
        one = analysis.sel(group=group)
        first, *others = str(group).split("; ")
        if others:
            notes.append(f"{first}: these are also the samples of {', '.join(others)}")
        middle, ends = one["separation"].values, one["separation_interval"].values
        rows += [
            (
                f"{first}: {names[k]}", *directed(middle, ends, k, word=is_word(names[k], within)),
                str(one["group_samples"].item()),
            )
            for k in _largest(middle - 0.5, place, names, within)
        ]  # fmt: skip
    head = ("what separates", *DIRECTED, "samples")
    return marked(Table(head, rows, notes), analysis)


DIRECTED = ("compared with other samples", "95 % interval")
"""Heads of ``directed``."""


def directed(middle: Array, ends: Array, k: int, *, word: bool) -> tuple[str, str]:
    """In what share of pairs, of a sample of the group and one of the rest, an input is larger (or
    smaller) in that of the group, as "larger in 98 % of pairs", and the interval in percent.

    Of a ``word`` that is there or not by how much its share is larger in the group: twice as far
    from a half, since pairs that are alike count half.
    """
    less = middle[k] < 0.5
    share, (low, high) = middle[k], ends[k]
    if less:
        share, low, high = 1.0 - share, 1.0 - high, 1.0 - low
    # Three digits: two would make 1e+02 of 99.6.
    if word:
        points = f"{200.0 * share - 100.0:.3g} percentage points"
        told = f"{'less' if less else 'more'} often by {points}"
        return told, interval_text(200.0 * low - 100.0, 200.0 * high - 100.0, 3)
    told = f"{'smaller' if less else 'larger'} in {100.0 * share:.3g} % of pairs"
    return told, interval_text(100.0 * low, 100.0 * high, 3)


def is_word(name: str, within: Mapping[str, tuple[str, int, int]]) -> bool:
    """Whether a column says if an input has a certain word, as "net = none"."""
    own, *span = within.get(name, (name, 0, 0))
    return span == [0, 0] and name.startswith(f"{own} = ")


def _largest(
    values: Array,
    place: NDArray[np.bool_],
    names: Array,
    within: Mapping[str, tuple[str, int, int]],
) -> list[int]:
    """The largest ones of inputs, then of places, among which chance has more; of those that share
    places the largest alone.
    """
    size = np.abs(np.where(np.isnan(values), 0.0, values))
    order = np.argsort(-size, kind="stable")
    kept = strongest(names[order].tolist(), within)
    order = order[np.isin(names[order], kept)]
    return [int(k) for kind, most in _NAMED.items() for k in order[place[order] == kind][:most]]


def _with_interval(middle: Array, ends: Array, k: int) -> tuple[str, str]:
    return number_text(middle[k], 2), interval_text(float(ends[k, 0]), float(ends[k, 1]), 2)


# Indices of sensitivity as lines for people.


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


FEW_DECIDE = "not known: few samples decide it"
"""Instead of an interval that is longer than all that is possible, or leaves it."""


def _ends(interval: Array, measure: str = "") -> str:
    """An interval; of a share of a variance none that is longer than the whole of it."""
    low, high = interval.tolist()
    return FEW_DECIDE if measure.endswith("_index") and high - low > 1.0 else interval_text(
        low, high, 2
    )  # fmt: skip


def _told(analysis: xr.Dataset, names: tuple[str, ...]) -> Table:
    """The groups, or inputs, that matter most for each output."""
    (dim,) = analysis[names[0]].dims[1:]
    place = (
        analysis["input_is_place"].values
        if dim == "input" and "input_is_place" in analysis
        else np.zeros(analysis.sizes[dim], dtype=bool)
    )
    within = places_in(analysis) if dim == "input" else {}
    of = "samples" if dim == "input" else "blocks"
    head = ["what explains"]
    for name in names:
        head += [HEADS[name]] + ["95 % interval"] * (f"{name}_interval" in analysis)
    rows, named, every = [], set[str](), analysis[dim].values
    wanted = [*names, *(f"{name}_interval" for name in names), "index_used", "index_lost"]
    known = analysis[[name for name in wanted if name in analysis]]
    for output in analysis["output"].values.tolist():
        one = known.sel(output=output)
        size = np.nan_to_num(one[names[0]].values, nan=-np.inf)
        order = np.argsort(-size, kind="stable")
        kept = strongest(every[order].tolist(), within)
        order = order[np.isin(every[order], kept)]
        chosen = [k for k in order[~place[order]][:_MOST] if np.isfinite(size[k])]
        chosen += [k for k in order[place[order]][:_MOST_PLACES] if np.isfinite(size[k])]
        named |= {str(every[k]) for k in chosen}
        for k in chosen:
            row = [f"{output} by {every[k]}"]
            for name in names:
                row.append(number_text(one[name].values[k], 2))
                if f"{name}_interval" in one:
                    row.append(_ends(one[f"{name}_interval"].values[k], name))
            rows.append([*row, str(one["index_used"].item()), str(one["index_lost"].item())])
    notes = measure_notes(analysis)
    notes += confounding_notes(analysis, named) if dim == "input" else []
    return marked(Table([*head, f"{of} used", "left out"], rows, notes), analysis)


def sensitivity_tables(analysis: xr.Dataset) -> list[Table]:
    """Indices of outputs and failures, and what they leave out."""
    found = []
    if names := next((names for names in SETS if names[0] in analysis), ()):
        found.append(_told(analysis, names))
    if "second_order_index" in analysis:
        found.append(_second(analysis))
    return found + refusals(analysis, every=True)


def measure_notes(analysis: xr.Dataset) -> list[str]:
    """What the measure of the design means, or lacks."""
    if "mean_absolute_effect" in analysis:
        return [
            "mu*: mean absolute change of the output, in its unit, when the inputs of a group "
            "move across half of their levels (of 4, two thirds of a uniform range); sigma: "
            "standard deviation of that change"
        ]
    if "total_index" in analysis:
        none = analysis["total_index_interval"].isnull().all()
        cure = "no intervals: set design.replicates = 8 or more (independent replicates)"
        return [cure] * bool(none) + _unsure(analysis)
    if "given_data_index" in analysis:
        within = places_in(analysis)
        words = any(is_word(str(name), within) for name in analysis["input"].values)
        told = ", and so is each word of an input" * words
        return [
            "first-order index: share of the variance that one input alone explains, estimated "
            "from bins of its values and corrected for chance, so that one of about 0 may be below "
            "zero; too small if the output is strongly nonlinear within a bin; each is estimated "
            f"by itself{told}, so that they may add up to more than 1"
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
        f"indices outside 0 .. 1 ({number_text(_farthest(both), 2)})": (
            (both < _LEAST) | (both > 1.0 + _SLACK)
        ).any(axis=(0, 2)),
        "first-order indices above total indices": (low > high).any(axis=1),
        f"intervals longer than {_WIDE}": (wide > _WIDE).any(axis=(0, 2)),
    }  # fmt: skip
    outputs = analysis["output"].values
    found = [f"{sign} of {', '.join(outputs[own])}" for sign, own in signs.items() if own.any()]
    if not found:
        return []
    return [f"too few base samples: {'; '.join(found)}: increase design.samples"]


def _farthest(values: Array) -> float:
    """The value that is farthest from what lies between 0 and 1."""
    known = values[np.isfinite(values)]
    return float(known[np.argmax(np.abs(known - 0.5))]) if len(known) else np.nan


def _second(analysis: xr.Dataset) -> Table:
    rows, factors = [], analysis["factor"].values
    for output in analysis["output"].values.tolist():
        one = analysis.sel(output=output)
        values = one["second_order_index"].values
        found = [(j, k) for j in range(len(factors)) for k in range(j) if np.isfinite(values[j, k])]
        for j, k in sorted(found, key=lambda pair: -values[pair])[:_MOST_PLACES]:
            ends = _ends(one["second_order_index_interval"].values[j, k], "second_order_index")
            rows.append((f"{output} by {factors[k]} with {factors[j]}",
                         number_text(values[j, k], 2), ends))  # fmt: skip
    head = ("what explains", "second-order index", "95 % interval")
    return marked(Table(head, rows), analysis)


# In short: of what matters only what stands out of chance.


_MOST_IN_SHORT = 3
"""Inputs that are told for each output."""
_CHANCE = {"given_data_index": "chance_level"}
"""Measures that chance lifts, and how far."""


def what_matters(analysis: xr.Dataset) -> Table:
    """Inputs (or groups) that go with each output beyond chance, by the measure of the design, and
    in which direction.
    """
    measure = _measure(analysis)
    if measure is None and "input_is_place" not in analysis:
        return Table((), ())
    rows, quiet, doubtful = list[tuple[str, ...]](), list[str](), list[str]()
    more, alone, open_ = list[str](), list[str](), list[str]()
    separated = {group for group, chosen in separating(analysis) if chosen}
    flat = _flat(analysis)
    for output, names, others in mattering(analysis):
        if is_moment(output) or output in flat:
            continue
        doubtful += [f"{output} by {name}" for name in others[:_MOST_IN_SHORT]]
        if len(names) > _MOST_IN_SHORT:
            more.append(f"{output} {len(names) - _MOST_IN_SHORT}")
        rows += [
            (output if k == 0 else "", *_row_of(analysis, output, name))
            for k, name in enumerate(names[:_MOST_IN_SHORT])
        ]
        if measure in _CHANCE and output in _correlated(analysis):
            sure = analysis["input"].values[_standing(analysis, output)]
            alone += [f"{output} by {n}" for n in names[:_MOST_IN_SHORT] if n not in sure]
        if not names and output not in separated:
            (open_ if _undecided(analysis, measure, output) else quiet).append(output)
    notes = measure_notes(analysis)
    if any(row[1].startswith(DIFFERENCE) for row in rows):
        notes.append("difference: how far the planes' inputs are apart, whichever is the larger")
    if alone:
        notes.append(
            "listed by the index alone, since their rank correlation is not significant among "
            f"{counted(analysis.sizes['input'], 'input')} that are compared: {', '.join(alone)}: "
            "an effect that rises and falls, a threshold, or chance"
        )
    if rows and "input" in analysis.dims and "factor" not in analysis.dims:
        count = counted(analysis.sizes["input"], "input")
        twice = measure in _CHANCE and bool(_correlated(analysis))
        held = any(
            np.isfinite(analysis[f"{name}_partial_rank_correlation"]).any()
            for name in _correlated(analysis)
        )
        how = f" by its index or its {'partial ' * held}rank correlation" * twice
        outputs, often = len(quiet) + sum(bool(row[0]) for row in rows), 10 if twice else 20
        many = f", so up to {outputs / often:.3g} of the {outputs} outputs tested"
        notes.append(
            f"by chance alone, fewer than one output in {often} would have an input listed{how}"
            f"{many * (outputs >= often)} ({count} in all, sections, means and differences "
            "included); of a mean and its parts only the strongest is listed"
        )
        notes += confounding_notes(analysis, {row[1] for row in rows})
    if more:
        notes.append(f"further significant inputs, listed with --full: {', '.join(more)}")
    if doubtful:
        notes.append(
            "not listed, because a correlated input with a larger index explains it (its partial "
            f"rank correlation is not significant): {', '.join(doubtful)}"
        )
    if flat:
        notes.append(
            f"not listed, because samples differ by less than {100 * ALIKE:g} %: {', '.join(flat)}"
        )
    asked = analysis["requirement"].values.tolist() if "requirement" in analysis.dims else []
    if near := [name for name in asked if analysis.get(f"{name}_same_within", np.nan) > 0.0]:
        told = ", ".join(near)
        why = "no sample is farther from the mean than the numerical error"
        notes.append(f"not told, because {why}: {told}")
    if open_:
        notes.append(f"too few samples to tell what matters for {', '.join(open_)}")
    if quiet:
        notes.append(f"no significant input for {', '.join(quiet)}")
    index = "index" if measure is None else HEADS[measure]
    head = ("what matters for", "input", index, "95 % interval", *RANKS.values())
    return marked(Table(head, rows, notes, left=2), analysis, 1)


def _undecided(analysis: xr.Dataset, measure: str | None, output: str) -> bool:
    """Whether an interval of its indices is longer than all of its variance."""
    if measure != "total_index" or output not in analysis["output"]:
        return False
    return bool(_open(analysis.sel(output=output), measure).any())


def _flat(analysis: xr.Dataset) -> list[str]:
    """The outputs of which no digit that tables give changes between samples, unless none does or a
    requirement asks for them: what explains them is no news.
    """
    wanted = analysis["requirement"].values.tolist() if "requirement" in analysis.dims else []
    known = [name for name in quantities() if name in analysis and not is_moment(name)]
    known = [name for name in known if name in _correlated(analysis)]
    ends = {name: analysis[name].sel(statistic=["minimum", "maximum"]).values for name in known}
    flat = [name for name in known if name not in wanted and hardly_apart(*ends[name].tolist())]
    return flat if len(flat) < len(known) else []


def mattering(analysis: xr.Dataset) -> Iterator[tuple[str, list[str], list[str]]]:
    """For each output, and then each kind of failure with an index, the inputs (or groups) that
    matter beyond chance, those with an index first, the larger before the smaller, then those with
    a rank correlation that holds the others alone, the stronger first; and the inputs that only go
    with one of them.

    An index tells how much of the scatter is an input's: beside a strong one a weaker input has no
    more of it than chance gives, however certain it is.  Its rank correlation shows it.
    """
    measure, known = _measure(analysis), _correlated(analysis)
    indexed = dict(_indexed(analysis, measure)) if measure else {}
    groups = [name for name in indexed if name not in quantities()]
    for output in [n for n in quantities() if n in indexed or n in known] + groups:
        names = list(indexed.get(output, ()))
        if output in known and (output not in indexed or measure in _CHANCE):
            values, listed = standing_out(analysis, output, _samples(analysis, output))
            order = np.argsort(-np.abs(np.nan_to_num(values)), kind="stable")
            ranked = analysis["input"].values[order[listed[order]]].astype(str).tolist()
            names += [name for name in ranked if name not in names]
        names, others = _cleared(analysis, output, names)
        yield output, _apart(analysis, output, names), others


def _measure(analysis: xr.Dataset) -> str | None:
    """The index that the design allows; None without any."""
    return next((first for first, _ in SETS if first in analysis), None)


def _indexed(analysis: xr.Dataset, measure: str) -> Iterator[tuple[str, list[str]]]:
    """For each output with indices the inputs with more than chance gives, in all their interval
    above zero, the largest first.
    """
    (dim,) = analysis[measure].dims[1:]
    names = analysis[dim].values.astype(str)
    of_measure = [measure, _CHANCE.get(measure, measure), f"{measure}_interval"]
    known = analysis[[name for name in of_measure if name in analysis]]
    for output in analysis["output"].values.tolist():
        one = known.sel(output=output)
        values = one[measure].values
        least = _index_ends(one, measure)[:, 0]
        chance = one[_CHANCE[measure]].values if measure in _CHANCE else 0.0 * values
        listed = (values > chance) & (np.where(np.isfinite(least), least, values) > 0.0)
        if measure == "total_index":
            listed &= values > _LEAST_INDEX
            # An interval longer than all of the variance does not say that the index may be none.
            listed |= _open(one, measure) & (values > _MOST_UNTOLD)
        if np.isfinite(values).any():
            order = np.argsort(-np.nan_to_num(values))
            yield output, names[order[listed[order]]].tolist()


_LEAST_INDEX, _MOST_UNTOLD = 0.01, 0.05
"""Shares of the variance of an output up to which an input is not told, however sure it is, and of
which few samples decide."""


def _open(one: xr.Dataset, measure: str) -> NDArray[np.bool_]:
    """Which indices of an output have an interval longer than all of its variance."""
    ends = _index_ends(one, measure)
    return np.asarray(ends[:, 1] - ends[:, 0] > 1.0)


def _index_ends(one: xr.Dataset, measure: str) -> Array:
    """Intervals of the indices of one output, shape (input, 2); NaN without."""
    name = f"{measure}_interval"
    return one[name].values if name in one else np.full((one[measure].size, 2), np.nan)


def _row_of(analysis: xr.Dataset, output: str, name: str) -> tuple[str, ...]:
    """The cells of an input that matters: name, index and interval, rank correlations."""
    measure, cells = _measure(analysis), ("-", "-")
    if measure and output in analysis["output"].values:
        one = analysis.sel(output=output)
        (dim,) = one[measure].dims
        names = one[dim].values.tolist()
        if name in names:  # of blocks whose outputs have no index these are groups, not inputs
            k = names.index(name)
            ends = _ends(_index_ends(one, measure)[k], measure)
            cells = number_text(one[measure].values[k], 2), ends
    return name, *cells, *_correlations(analysis, output, name)


def _cleared(analysis: xr.Dataset, output: str, found: list[str]) -> tuple[list[str], list[str]]:
    """Of inputs, the largest first, those whose index cannot be that of another one, and the
    others: they go with an input of a larger index, and their partial rank correlation, which holds
    that, is within chance.
    """
    paired = partners(analysis)
    # Blocks move one group by itself: their indices are its own.
    if not paired or "factor" in analysis.dims or output not in _correlated(analysis):
        return found, []
    partial = analysis[f"{output}_partial_rank_correlation"].values
    clear = np.isnan(partial) | _standing(analysis, output)
    stands = dict(zip(analysis["input"].values.tolist(), clear.tolist(), strict=True))
    kept, others = list[str](), list[str]()
    for name in found:
        if stands[name] or paired.get(name, set()).isdisjoint(kept):
            kept.append(name)
        else:
            others.append(name)
    return kept, others


def _apart(analysis: xr.Dataset, output: str, found: list[str]) -> list[str]:
    """Of inputs, the largest first, those that do not contain a larger one or lie within it: the
    mean of all pulleys beside that of five of them tells the same twice.
    """
    return apart(analysis, output, found, places_in(analysis))


def _correlated(analysis: xr.Dataset) -> list[str]:
    return [name for name in quantities() if f"{name}_rank_correlation" in analysis]


def _standing(analysis: xr.Dataset, output: str) -> NDArray[np.bool_]:
    return standing_out(analysis, output, _samples(analysis, output))[1]


def _samples(analysis: xr.Dataset, output: str) -> int:
    return int(analysis[f"{output}_samples"].values[0])


def _correlations(analysis: xr.Dataset, output: str, name: str) -> tuple[str, ...]:
    """The cells of an input's rank correlations."""
    if output not in _correlated(analysis) or name not in analysis["input"].values:
        return ("-",) * len(RANKS)
    one = analysis.sel(input=name)
    known = (f"{output}_{word}rank_correlation" for word in RANKS)
    cells = [_signed(one[each].item(), one[f"{each}_interval"].values) for each in known]
    # The one that holds the other inputs says more, and one is enough.
    return (cells[0], "-") if cells[0] != "-" else tuple(cells)


def _signed(value: float, ends: Array) -> str:
    if not np.isfinite(value):
        return "-"
    interval, (low, high) = _ends(ends), ends.tolist()
    if high - low < 0.01:  # it has no digit more than the correlation
        interval = f"{low:.2f} .. {high:.2f}"
    return f"{value:+.2f}" + ("" if interval == "-" else f" ({interval})")


def what_separates(analysis: xr.Dataset) -> Table:
    """Inputs that are larger, or smaller, in samples that ended otherwise or violate."""
    if "group" not in analysis.dims:
        return Table((), ())
    rows, names, within = [], analysis["input"].values.tolist(), places_in(analysis)
    for group, chosen in separating(analysis):
        one = analysis.sel(group=group)
        middle, ends = one["separation"].values, one["separation_interval"].values
        first = group.split("; ")[0]
        rows += [
            (
                f"{first} ({one['group_samples'].item()})" if n == 0 else "",
                names[k], *directed(middle, ends, k, word=is_word(names[k], within)),
            )
            for n, k in enumerate(chosen[:_MOST_IN_SHORT])
        ]  # fmt: skip
    head = ("what separates", "input", *DIRECTED)
    return marked(Table(head, rows, left=3), analysis, 1)
