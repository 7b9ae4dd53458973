"""An analysis in short: a row an output, and of what matters only what stands out of chance."""

import textwrap
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import norm

from ringsim.analysis import indices
from ringsim.analysis.design import placement, population_of
from ringsim.analysis.influence import confounding_notes, partners
from ringsim.analysis.influence_text import DIRECTED, HEADS, SETS, directed, measure_notes
from ringsim.analysis.intervals import quantities, used, worst_sample
from ringsim.analysis.worst import losses, marked
from ringsim.outputs import OUTPUTS
from ringsim.outputs.balance import summary
from ringsim.stepping.instant import Array
from ringsim.tables import Table, interval_text, number_text
from ringsim.variables import GOALS, Fate, Status, Variable

# An analysis in short: a row an output, and of what matters only what stands out of chance.


_MOST = 3
"""Inputs that are told for each output."""
_RANKS = {"partial_": "partial rank correlation", "": "rank correlation"}
"""Of rank correlations the one that holds the other inputs first, with their heads."""
_CHANCE = {"given_data_index": "chance_level"}
"""Measures that chance lifts, and how far."""


def output_table(analysis: xr.Dataset, names: list[str]) -> Table:
    """Mean with its interval, scatter, quantiles and range of each output, and its worst sample."""
    rows = []
    for name in names:
        values, counts = analysis[name].values, analysis[f"{name}_samples"].values
        mean, deviation, *quantiles, least, most = values
        used, run = counts[0], counts[:3].sum()  # what has not run is the last
        count = str(used) if used == run else f"{used} of {run}"
        units = analysis[name].attrs["units"]
        units = "" if units == "1" else units
        if least == most:
            rows.append((name, units, number_text(least), "all alike", *"------", "-", count))
        elif np.isfinite(least):
            fine = digits_of(least, most)
            ends = _ends(analysis[f"{name}_interval"].values[0], fine)
            others = [number_text(v, fine) for v in (*quantiles, least, most)]
            rows.append((
                name, units, number_text(mean, fine), ends, number_text(deviation), *others,
                worst_of(analysis, name), count,
            ))  # fmt: skip
    head = (
        "output", "unit", "mean", "95 % interval", "std. dev.", "5 %", "median", "95 %", "least",
        "most", "worst sample", "used",
    )  # fmt: skip
    return marked(Table(head, rows), analysis)


def worst_of(analysis: xr.Dataset, name: str) -> str:
    """The sample with an output's worst value; a dash where neither end is the worse one, and of
    analyses that do not tell it.
    """
    sample = int(analysis.get(f"{name}_worst_sample", -1))
    return "-" if sample < 0 else str(sample)


def digits_of(least: float, most: float) -> int:
    """So many digits that a range has four of its own."""
    larger = max(abs(least), abs(most)) / (most - least) if most > least else 1.0
    return max(4, int(np.log10(larger)) + 4)


def what_matters(analysis: xr.Dataset) -> Table:
    """Inputs (or groups) that go with each output beyond chance, by the measure of the design, and
    in which direction.
    """
    measure = next((first for first, _ in SETS if first in analysis), None)
    if measure is None and "input_is_place" not in analysis:
        return Table((), ())
    rows, quiet, doubtful = [], [], list[str]()
    told = dict(_indexed(analysis, measure)) if measure else {}
    known = _correlated(analysis)
    groups = [name for name in told if name not in quantities()]
    for output in [n for n in quantities() if n in told or n in known] + groups:
        found = told[output] if output in told else list(_ranked(analysis, output))
        found, others = _cleared(analysis, output, found)
        doubtful += [f"{output} by {name}" for name in others[:_MOST]]
        rows += [(output if k == 0 else "", *row) for k, row in enumerate(found[:_MOST])]
        if not found:
            quiet.append(output)
    notes = measure_notes(analysis)
    if rows and "input" in analysis.dims and "factor" not in analysis.dims:
        count = analysis.sizes["input"]
        largest = f"the largest of all {count} would reach" if count > 1 else "it would reach"
        notes.append(
            f"an input is told if by chance {largest} as much in fewer than one output of 20"
        )
        notes += confounding_notes(analysis, {row[1] for row in rows})
    if doubtful:
        notes.append(
            "not told, because an input of larger index that goes with it explains it (its partial "
            f"rank correlation is within chance): {', '.join(doubtful)}"
        )
    if quiet:
        notes.append(f"no input stands out of chance for {', '.join(quiet)}")
    index = "index" if measure is None else HEADS[measure]
    head = ("what matters for", "input", index, "95 % interval", *_RANKS.values())
    return marked(Table(head, rows, notes, left=2), analysis, 1)


def _indexed(analysis: xr.Dataset, measure: str) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    """For each output with indices the inputs with more than chance gives, in all their interval
    above zero.
    """
    (dim,) = analysis[measure].dims[1:]
    for output in analysis["output"].values.tolist():
        one = analysis.sel(output=output)
        values = one[measure].values
        known = f"{measure}_interval" in one and np.isfinite(one[f"{measure}_interval"]).any()
        ends = one[f"{measure}_interval"].values if known else np.full((len(values), 2), np.nan)
        chance = one[_CHANCE[measure]].values if measure in _CHANCE else 0.0 * values
        least = np.where(np.isfinite(ends[:, 0]), ends[:, 0], values)
        beyond = (values > chance) & (least > 0.0)
        chosen = [k for k in np.argsort(-np.nan_to_num(values)) if beyond[k]]
        if np.isfinite(values).any():
            yield output, [
                (
                    str(analysis[dim].values[k]), number_text(values[k], 2),
                    _ends(ends[k]),
                    *_correlations(analysis, output, str(analysis[dim].values[k])),
                )
                for k in chosen
            ]  # fmt: skip


def _cleared(
    analysis: xr.Dataset, output: str, found: list[tuple[str, ...]]
) -> tuple[list[tuple[str, ...]], list[str]]:
    """The rows, the largest first, of inputs whose index cannot be that of another one, and the
    names of the others: they go with an input of a larger index, and their partial rank
    correlation, which holds that, is within chance.
    """
    paired = partners(analysis)
    # Blocks move one group by itself: their indices are its own.
    if not paired or "factor" in analysis.dims or output not in _correlated(analysis):
        return found, []
    partial = analysis[f"{output}_partial_rank_correlation"].values
    clear = np.isnan(partial) | standing_out(analysis, output)[1]
    stands = dict(zip(analysis["input"].values.tolist(), clear.tolist(), strict=True))
    kept, others = list[tuple[str, ...]](), list[str]()
    for row in found:
        larger = {each[0] for each in kept}
        if stands[row[0]] or paired.get(row[0], set()).isdisjoint(larger):
            kept.append(row)
        else:
            others.append(row[0])
    return kept, others


def _correlated(analysis: xr.Dataset) -> list[str]:
    end = "_rank_correlation"
    return [
        str(name).removesuffix(end)
        for name in analysis.data_vars
        if str(name).endswith(end) and not str(name).endswith(f"_partial{end}")
    ]


def _ranked(analysis: xr.Dataset, output: str) -> Iterator[tuple[str, ...]]:
    """Inputs whose rank correlation with an output without index is beyond chance: the partial one
    where samples are enough to hold the other inputs.
    """
    if output not in _correlated(analysis):
        return
    values, beyond = standing_out(analysis, output)
    for k in np.argsort(-np.abs(np.nan_to_num(values)), kind="stable"):
        if beyond[k]:
            name = str(analysis["input"].values[k])
            yield name, "-", "-", *_correlations(analysis, output, name)


def standing_out(analysis: xr.Dataset, output: str) -> tuple[Array, NDArray[np.bool_]]:
    """Rank correlations of all inputs, partial where there are such, and which of them stand out
    of what the largest reaches by chance; shape (input,) both.
    """
    (values, ends), (plain, plain_ends) = (
        (analysis[name].values, analysis[f"{name}_interval"].values)
        for name in (f"{output}_{word}rank_correlation" for word in _RANKS)
    )
    partial = np.isfinite(values)
    values, ends = np.where(partial, values, plain), np.where(partial[:, None], ends, plain_ends)
    samples = int(analysis[f"{output}_samples"].values[0])
    held = np.where(partial, analysis["inputs_held"].values, 0)
    chance = indices.largest_by_chance(samples, held, len(values))
    return values, _beyond(values, ends, chance)


def _correlations(analysis: xr.Dataset, output: str, name: str) -> tuple[str, ...]:
    """The cells of an input's rank correlations."""
    if output not in _correlated(analysis) or name not in analysis["input"].values:
        return ("-",) * len(_RANKS)
    one = analysis.sel(input=name)
    known = (f"{output}_{word}rank_correlation" for word in _RANKS)
    return tuple(_signed(one[each].item(), one[f"{each}_interval"].values) for each in known)


def _signed(value: float, ends: Array) -> str:
    if not np.isfinite(value):
        return "-"
    interval = _ends(ends)
    return f"{value:+.2f}" + ("" if interval == "-" else f" ({interval})")


def what_separates(analysis: xr.Dataset) -> Table:
    """Inputs that are larger, or smaller, in samples that ended otherwise or violate."""
    if "group" not in analysis.dims:
        return Table((), ())
    rows, samples = [], analysis.attrs["samples_run"]
    normal = float(norm.isf(indices.chance_of_each(analysis.sizes["input"]) / 2))
    for group in analysis["group"].values:
        one = analysis.sel(group=group)
        middle, ends = one["separation"].values, one["separation_interval"].values
        order = np.argsort(-np.abs(np.nan_to_num(middle - 0.5)))
        own = one["group_samples"].item()
        # Variance of the area under the curve without a difference: Mann and Whitney (1947).
        chance = normal * ((samples + 1) / (12.0 * own * max(samples - own, 1))) ** 0.5
        beyond = _beyond(middle - 0.5, ends - 0.5, chance)
        chosen = [k for k in order if beyond[k]]
        first = str(group).split("; ")[0]
        rows += [
            (
                f"{first} ({one['group_samples'].item()})" if n == 0 else "",
                str(analysis["input"].values[k]), *directed(middle, ends, k),
            )
            for n, k in enumerate(chosen[:_MOST])
        ]  # fmt: skip
    head = ("what separates", "input", *DIRECTED)
    return marked(Table(head, rows, left=3), analysis, 1)


def _beyond(values: Array, ends: Array, chance: Array | float) -> NDArray[np.bool_]:
    """Which values are larger than the largest of all by chance, and if they have intervals leave
    out zero by these, too.
    """
    apart = (ends[:, 0] > 0.0) | (ends[:, 1] < 0.0)
    return (np.abs(values) > chance) & (apart | ~np.isfinite(ends).all(axis=1))


def _ends(interval: Array, digits: int = 2) -> str:
    return interval_text(float(interval[0]), float(interval[1]), digits)


# What a merged campaign says about its numerics, in lines for people.


_NAMED = 6
"""Samples that a line names at most."""
_LONGEST = 200
"""Characters of a reason that a line shows."""


def notes(campaign: xr.Dataset) -> list[str]:
    """All lines but those of the error budget."""
    parts = (outcome_lines, peak_lines, override_lines, restart_lines)
    return [line for part in parts for line in part(campaign)]


def outcome_lines(campaign: xr.Dataset) -> list[str]:
    """What became of the antenna, and which runs failed: a line an end, with the first reason."""
    reasons = campaign["reason"].to_numpy() if "reason" in campaign else None
    return ending_lines(
        campaign["outcome"].to_numpy(), campaign["status"].to_numpy(),
        lambda sample: "" if reasons is None else str(reasons[sample]),
    )  # fmt: skip


def ending_lines(
    fates: NDArray[Any], status: NDArray[Any], reason_of: Callable[[int], str]
) -> list[str]:
    """The same from codes of every sample and what finds the reason of one, "" if it is lost.

    Counts are of the samples that have run.
    """
    good, lines = status == Status.OK, []
    ran = int(np.sum(status >= Status.OK))  # below: has not run
    for fate in Fate:
        own = np.flatnonzero(good & (fates == fate))
        if not len(own) or fate == Fate.NONE:
            continue
        more = ", ..." if len(own) > _NAMED else ""
        named = f" (sample{'s' * (len(own) > 1)} {', '.join(map(str, own[:_NAMED]))}{more})"
        if fate in GOALS:
            named = ""
        elif why := reason_of(int(own[0])):
            named += f": {textwrap.shorten(why, _LONGEST, placeholder=' ...')}"
        lines.append(f"{fate.word.replace('_', ' ')}: {len(own)} of {ran}{named}")
    for code in Status:
        own = np.flatnonzero(status == code)
        if code.failed and len(own):
            why = reason_of(int(own[0]))
            first = f"first sample {own[0]}{': ' if why else ''}{why}"
            first = textwrap.shorten(first, _LONGEST, placeholder=" ...")
            lines.append(f"{code.word.replace('_', ' ')}: {len(own)} of {ran}, {first}")
    return lines


def budget_lines(campaign: xr.Dataset) -> list[str]:
    """Whether numerical or sampling error dominates the mean, a line for each output with bars.

    Where the design does not tell the standard error, the line has the numerical one alone.

    The numerical error is the root mean square of the error bars, each of which bounds the error
    of one sample.  Those of neighbouring samples are alike, so they do not average out: it is
    compared with the standard error as it is.  Samples that did not end well are left out.
    """
    sound, placed, lines = used(population_of(campaign)), placement(campaign), []
    mark = losses(campaign).mark
    for name in map(str, sound.data_vars):
        of = name.removesuffix("_error")
        if of == name or of not in sound or sound[of].dims != ("sample",):
            continue
        known = sound[of].dropna("sample")
        values, bars = (
            each.to_numpy().astype(float) for each in (known, sound[name].dropna("sample"))
        )
        if len(values) >= 2 and len(bars):
            spread, numerical = values.std(ddof=1), np.sqrt(np.mean(bars**2))
            sampling = placed.error_of_mean(values, known["sample"].to_numpy())
            larger = "numerical" if numerical > sampling else "sampling"
            units = sound[of].attrs.get("units", "1")
            lines.append(
                f"{of}: mean {values.mean():.6g}{'' if units == '1' else f' {units}'}, spread "
                f"{spread:.2g}, "
                + (f"standard error {sampling:.2g}, " if np.isfinite(sampling) else "")
                + f"numerical error at most {numerical:.2g} ({len(bars)} of {len(values)} samples)"
                + (f": {larger} error dominates the mean" if np.isfinite(sampling) else "")
                + mark
            )
    return lines


def override_lines(campaign: xr.Dataset) -> list[str]:
    """A line for each other setting with which samples were run that had failed before."""
    if "overrides" not in campaign:
        return []
    texts, status = campaign["overrides"].to_numpy(), campaign["status"].to_numpy()
    return [
        f"{len(own)} of {len(texts)} samples were run again with {text} (overrides): "
        f"{int((own == 0).sum())} ok"
        for text in sorted(set(texts) - {""})
        for own in [status[texts == text]]
    ]


def restart_lines(campaign: xr.Dataset) -> list[str]:
    """One line if samples were restarted with smaller steps (``restarts`` above 0), else none."""
    known = {"restarts", "steps", "total_steps"} <= set(campaign.data_vars)
    if not known or not (anew := int((campaign["restarts"] > 0).sum())):
        return []
    # Missing counts are negative.
    counted, every = (float(campaign[n].clip(min=0).sum()) for n in ("steps", "total_steps"))
    lost = 1.0 - counted / max(every, 1.0)
    return [
        f"{anew} of {campaign.sizes['sample']} samples were restarted with smaller steps "
        f"(restarts, step_used): {lost:.0%} of all {every:.0f} steps went to attempts that failed"
    ]


def peak_lines(campaign: xr.Dataset) -> list[str]:
    """The worst value of all samples that ended well, when and where, for outputs that tell it.

    Which end is the worst the output knows: margins and latch rates the least, loads the largest.

    Places have no names where samples differ in the ends at which the winches are.  Of outputs that
    can have an error bar the line says how large that is in this sample.
    """
    spans = {}
    if "span_name" in campaign:
        names = campaign.span_name.transpose("plane", "span").values.tolist()
        spans = dict(zip(campaign.plane.values.tolist(), names, strict=True))
    sound, lines, unknown, mark = used(campaign), [], False, losses(campaign).mark
    for output in OUTPUTS:
        for variable in output.variables:
            if variable.summary is None or (sample := worst_sample(sound, variable)) < 0:
                continue
            worst = sound.sel(sample=sample)
            values = {str(n): each.values for n, each in worst.items() if not each.dims}
            if output().told(values, spans):
                # Series tell which places are alike.
                values = {str(n): each.values for n, each in worst.variables.items()}
                told = " ".join(summary(values, spans)[variable.name].split())
                error = _numerical(sound, variable, worst) if variable.error_bar else ""
                unknown |= bool(variable.error_bar and not error)
                lines.append(f"{variable.summary[0]} in sample {sample}: {told}{error}{mark}")
    if unknown:
        lines.append(
            "no sample states its numerical error: give error_bars_every, or see what "
            "solver.error_bars = true says of the samples named here"
        )
    return lines


def _numerical(sound: xr.Dataset, variable: Variable, worst: xr.Dataset) -> str:
    """How large the numerical error of a sample's value is; empty if no sample tells."""
    if (name := f"{variable.name}_error") not in sound or not sound[name].notnull().any():
        return ""
    unit = "" if variable.units == "1" else f" {variable.units}"
    if np.isfinite(own := float(worst[name])):
        return f"; numerical error at most {own:.2g}{unit}"
    stated = sound[name].dropna("sample")
    return (
        f"; its numerical error is not stated, at most {float(stated.max()):.2g}{unit} in the "
        f"{stated.size} samples that state theirs"
    )
