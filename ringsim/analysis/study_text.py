"""What an analysis of a campaign tells, as tables: one for terminals, pages and Python alike."""

import json
from collections.abc import Sequence
from string import ascii_lowercase
from typing import NamedTuple

import numpy as np
import xarray as xr

from ringsim.analysis import derived
from ringsim.analysis.campaign_notes import (
    MARK,
    NOTE,
    RECORDED,
    attributes,
    doubted,
    marked,
    off_note,
    records_line,
)
from ringsim.analysis.design import placement, population_of
from ringsim.analysis.influence_text import (
    FEW_DECIDE,
    influence_tables,
    mattering,
    sensitivity_tables,
    what_matters,
    what_separates,
)
from ringsim.analysis.intervals import (
    ALIKE,
    LEAST_OF_BOOTSTRAP,
    NOTHING,
    ONE_DECIDES,
    ROUND_OFF,
    TWIN,
    all_alike,
    hardly_apart,
    is_moment,
    numbers,
    of_one,
    quantities,
    ranks,
)
from ringsim.analysis.requirements import required_by, stopping_lines
from ringsim.analysis.reweighting import (
    LEAST_OF_MEAN,
    LEAST_OF_SHARE,
    LEAST_REPLICATES,
    REWEIGHTED_STATISTICS,
    SOBOL,
)
from ringsim.analysis.sensitivity import rarer_table, refusals
from ringsim.analysis.study import PARTS, SOURCES, STATISTICS, statistics
from ringsim.analysis.tails import tail, tail_table
from ringsim.analysis.verdicts import (
    BOUND,
    IF_HOLD,
    SHARE_MET,
    Parts,
    Verdict,
    decisive,
    in_short,
    judge,
    verdict_about,
    verdict_table,
    verdict_text,
)
from ringsim.analysis.worst import margin_table, margins, worst_lines, worst_tables
from ringsim.refusal import InputError
from ringsim.sampling.distributions import law_text
from ringsim.tables import (
    Table,
    counted,
    digits_of,
    estimate_text,
    fine_text,
    interval_text,
    number_text,
    readable,
    slim,
    unit_behind,
    unit_text,
)
from ringsim.variables import GO_ON

# Estimates for other distributions of inputs, as lines for people.


THIN = " (few)"
"""Stands behind what too few samples decide."""


def reweighting_tables(analysis: xr.Dataset) -> list[Table]:
    """Which distributions, how many effective samples, then the estimates beside the old ones."""
    if "reweighted_to" not in analysis:
        return []
    laws = json.loads(analysis["reweighted_to"].item())
    law_words = "; ".join(f"{path} {law_text(law)}" for path, law in laws.items())
    first = Table((), (), [
        f"reweighted to {law_words}: {counted(analysis['reweighted_samples'].item(), 'sample')} "
        f"worth {number_text(analysis['effective_samples'].item(), 3)} effective ones"
    ])  # fmt: skip
    rows, shares, thin = [], [], False
    for name in quantities():
        if f"{name}_reweighted" not in analysis:
            continue
        for statistic in REWEIGHTED_STATISTICS:
            one = analysis.sel(reweighted_statistic=statistic, statistic=statistic)
            decisive = one[f"{name}_decisive_samples"].item()
            few = decisive < (LEAST_OF_MEAN if statistic == "mean" else LEAST_OF_SHARE)
            thin |= few
            factor, unit = unit_of(analysis, name)
            lowest = analysis[name].sel(statistic="minimum").item()
            drawn, reweighted, low, high = factor * np.array([
                one[name], one[f"{name}_reweighted"], *one[f"{name}_reweighted_interval"]
            ])  # fmt: skip
            rows.append((
                f"{name}{THIN * few}", unit, statistic.replace("_", " "),
                number_text(drawn), estimate_text(reweighted, low, high),
                FEW_DECIDE if low < 0.0 <= lowest else interval_text(low, high),
                number_text(one[f"{name}_effective_samples"].item(), 3), number_text(decisive, 3),
            ))  # fmt: skip
    for event in analysis["event"].values:
        one = analysis.sel(event=event)
        decisive = one["reweighted_share_decisive"].item()
        ends = one["reweighted_share_interval"].values.tolist()
        few = decisive < LEAST_OF_SHARE
        thin |= few
        shares.append((
            f"{event}{THIN * few}",
            estimate_text(one["reweighted_share"].item(), *ends),
            interval_text(*ends),
            number_text(decisive, 3),
        ))  # fmt: skip
    notes = list[str]()
    if analysis.attrs["design"] in SOBOL and analysis["reweighted_share_interval"].isnull().all():
        notes.append(
            f"intervals of shares and quantiles need design.replicates = {LEAST_REPLICATES}"
        )
    if thin:
        notes.append(
            f"{THIN.strip()}: too few effective samples determine it (below {LEAST_OF_MEAN:g} "
            f"for a mean, {LEAST_OF_SHARE:g} for others): the estimate may be far off, and the "
            "interval of a mean is too short; quantiles have no interval, and intervals of "
            "probabilities remain valid"
        )
    head = ("output", "unit", "statistic", "as drawn", "reweighted", "95 % interval",
            "effective samples", "that determine it")  # fmt: skip
    of_shares = ("probability of", "reweighted", "95 % interval", "samples that determine it")
    kinds = analysis.get("kind", xr.DataArray([])).values.tolist()  # shares of all that ran
    of_all = marked(Table(of_shares, shares, notes), analysis, safe=kinds)
    found = [first, marked(Table(head, rows, title="output, reweighted"), analysis), of_all]
    return [*found, _verdicts(analysis)] if "reweighted_verdict" in analysis else found


def _verdicts(analysis: xr.Dataset) -> Table:
    """The verdicts for the other distributions, a row a requirement."""
    rows = []
    for name in analysis["requirement"].values:
        one = analysis.sel(requirement=name)
        rows.append((
            one["requirement_text"].item(),
            Verdict(one["reweighted_verdict"].item()).words
            + f", {IF_HOLD}" * bool(one["verdict_may_change"]),
            f"{one['probability_required'].item():g}", f"{one['confidence_required'].item():g}",
            number_text(one["reweighted_probability"].item()),
            decisive(Verdict(one["reweighted_verdict"].item()), *one["reweighted_bounds"].values),
        ))  # fmt: skip
    head = ("requirement, reweighted", "verdict", "probability", "confidence", SHARE_MET,
            BOUND)  # fmt: skip
    return marked(Table(head, rows), analysis, head.index(SHARE_MET))


# An analysis of a campaign as lines for people.


class Section(NamedTuple):
    """A part of what an analysis tells, the same for terminals, pages and Python."""

    name: str
    title: str
    tables: Sequence[Table]
    more: Sequence[Table] = ()
    """What tells it at length, with every interval and measure."""


def sections(
    analysis: xr.Dataset, folder: str = "DIR", *, full: bool = True
) -> dict[str, Section]:  # fmt: skip
    """All that an analysis tells, by name, parts without rows and notes left out.

    ``folder`` is the campaign's, for the commands that run samples again; unless ``full`` what
    tells it at length is left out, which takes most of the time.
    """
    changing, separated, errors = (
        rarer_table(analysis), what_separates(analysis), error_tables(analysis)
    )  # fmt: skip
    strongest = {
        output: [f"{name}{MARK * bool(analysis.attrs[NOTE])}" for name in found]
        for output, found, _ in mattering(analysis)
    }
    short = [what_matters(analysis), *refusals(analysis), separated, changing]
    if "case" in analysis.dims:
        single = analysis.attrs.get("design") == "one-at-a-time"
        short = [case_table(analysis), *([] if single else short)]
    more = _at_length(analysis) if full else {}
    numbers, event, limits = (
        statistics_table(analysis), tail_table(analysis), margin_table(analysis)
    )  # fmt: skip
    brief = in_short(analysis, Parts(event, limits, numbers, separated, errors, strongest))
    found = (
        Section("short", "In short", [Table((), (), brief)]),
        Section("tail", "Rare event", [event]),
        Section("outcomes", "Outcomes", [outcome_table(analysis)]),
        Section("statistics", "Numbers", [numbers], more.get("statistics", ())),
        Section("errors", "Numerical and statistical errors", errors, more.get("errors", ())),
        Section("matters", "What matters", short, more.get("matters", ())),
        Section("worst", "The worst samples", worst_tables(analysis, folder)),
        Section("requirements", "Requirements", [limits, verdict_table(analysis)]),
        Section("reweighting", "Other distributions", reweighting_tables(analysis)),
    )
    says = analysis.attrs

    def kept(of: Section, tables: Sequence[Table]) -> list[Table]:
        said = off_note(says) if of.name == "statistics" else ""
        return [doubted(each, says, said) for each in tables if each.rows or each.notes]

    return {
        each.name: each._replace(tables=list(map(slim, tables)), more=kept(each, each.more))
        for each in found
        if (tables := kept(each, each.tables))
    }


def case_table(analysis: xr.Dataset) -> Table:
    """Of a design that changes one input at a time, or lists cases by name, a row a case."""
    told = "case_sample", "case_change", "case_outcome"
    names = [str(name) for name in analysis if str(name).startswith("case_") and name not in told]
    units = [unit_of(analysis, name) for name in names]
    rows = [
        (
            str(int(one["case_sample"])), str(one["case_change"].item()),
            str(one["case_outcome"].item()),
            *(number_text(factor * float(one[name]))
              for name, (factor, _) in zip(names, units, strict=True)),
        )
        for one in (analysis.isel(case=k) for k in range(analysis.sizes["case"]))
    ]  # fmt: skip
    heads = [unit_behind(n.removeprefix("case_"), unit or "1")
             for n, (_, unit) in zip(names, units, strict=True)]  # fmt: skip
    change = str(analysis["case_change"].attrs["long_name"]).replace(
        "what is other than in", "other than"
    )
    return Table(("sample", change, "outcome", *heads), rows, left=3)


def _at_length(analysis: xr.Dataset) -> dict[str, list[Table]]:
    return {
        "statistics": [statistics_table(analysis, every=True), every_statistic(analysis)],
        "errors": error_tables(analysis, every=True),
        "matters": [
            *sensitivity_tables(analysis),
            *influence_tables(analysis),
            rarer_table(analysis),
        ],
    }


def told(analysis: xr.Dataset, folder: str = "DIR", *, full: bool = False) -> list[str]:
    """All ``sections`` as lines of a terminal, verdicts near the end, where they are seen.

    ``full`` has the interval and the convergence of every statistic, and every measure of what
    matters, whatever chance would explain.
    """
    lines = [*head_lines(analysis)]
    if not full:
        lines.append("--full gives all statistics with intervals and convergence, and all inputs")
    for each in sections(analysis, folder, full=full).values():
        chosen = each.more or each.tables
        parts = [table.lines() for table in chosen]
        if each.name == "worst":
            parts = [worst_lines(analysis, folder)]
        for part in parts:
            lines += ["", *part]
    return lines


def head_lines(analysis: xr.Dataset) -> list[str]:
    """What was analysed, lost runs that bend it, and what its intervals are from."""
    counts = counted(analysis.attrs["samples"], "sample")
    if (run := analysis.attrs["samples_run"]) < analysis.attrs["samples"]:
        counts += f", of which {run} have run"
    counts += f", design {analysis.attrs['design'] or 'unknown'}"
    title = analysis.attrs["title"]
    lines = [f"{title}: {counts}" if title else counts]
    told = (analysis.attrs.get("learnt", ""), analysis.attrs[NOTE], analysis.attrs["intervals"])
    lines += filter(None, told)
    if "tail_probability" in analysis:
        lines.append(
            "no sensitivity to inputs is given: samples of subset simulation depend on each "
            "other, and each level has its own threshold"
        )
    if stopping := analysis.attrs["stopping"]:
        lines.append(stopping + MARK * bool(analysis.attrs[NOTE]))
    return lines


def verdict_lines(campaign: xr.Dataset) -> list[str]:
    """The verdicts on the requirements of a merged campaign's own file; none without any."""
    placed, says = placement(campaign), attributes(campaign)
    found = xr.Dataset(tail(campaign), attrs={"samples": campaign.sizes["sample"]})
    lines = [*filter(None, [says[NOTE]])]
    lines += [line + MARK * bool(says[NOTE]) for line in stopping_lines(campaign, placed)]
    lines += tail_table(found).lines()
    known = margins(campaign).assign_attrs(says)
    lines += slim(doubted(margin_table(known), says)).lines() if known.data_vars else []
    wanted = required_by(campaign.attrs)
    try:
        found = judge(population_of(campaign), wanted, placed)
    except InputError as error:
        return [*lines, f"the requirements cannot be checked: {error}"]
    lines += slim(doubted(verdict_table(found.assign_attrs(says)), says)).lines()
    return lines + [*filter(None, [records_line(campaign, wanted)])] * bool(wanted)


def not_met(analysis: xr.Dataset) -> list[str]:
    """The requirements that are not met, not yet shown to be, or only if numbers hold that may be
    off, each with its verdict, and samples that are left; empty if all is done and met.
    """
    if "requirement" not in analysis.dims:
        return []
    run, samples = analysis.attrs["samples_run"], analysis.attrs["samples"]
    # Those that are left may be the slow ones, and the slow ones those that fail.
    left = [f"{samples - run} of {samples} samples have not run"] if run < samples else []
    each = [verdict_about(analysis, name) for name in analysis["requirement"].values]
    bad = [
        f"{one['requirement_text']}: {verdict_text(one)}" for one in each
        if one["verdict"] != Verdict.MET or one["verdict_may_change"]
    ]  # fmt: skip
    return [*bad, *left]


def outcome_table(analysis: xr.Dataset) -> Table:
    """What the antenna did, and how runs were lost, with shares."""
    rows = [
        (
            str(kind),
            f"{one['outcome_samples'].item()} of {one['outcome_of'].item()}"
            + f" ({one['outcome_lost'].item()} failed)" * bool(one["outcome_lost"].item()),
            estimate_text(one["outcome_share"].item(), *one["outcome_share_interval"].values),
            interval_text(*one["outcome_share_interval"].values),
            *map(number_text, one["outcome_share_convergence"].values[:-1]),
        )
        for kind in analysis["kind"].values
        for one in [analysis.sel(kind=kind)]
    ]  # fmt: skip
    notes = []
    for over in (each.words for each in GO_ON) if "outcome_open" in analysis else ():
        if over in analysis["kind"].values:
            one = analysis.sel(kind=over)
            count, opened = (int(one[f"outcome_{name}"]) for name in ("samples", "open"))
            told = f"of {counted(count, 'sample')} {over}, {opened} opened all the same"
            notes += [told] * bool(opened)
    return Table(("outcome", "samples", "share", "95 % interval", *_parts()), rows, notes)


def _parts() -> list[str]:
    return [f"of the first {100 * part:.0f} %" for part in PARTS[:-1]]


def statistics_table(analysis: xr.Dataset, *, every: bool = False) -> Table:
    """Mean with its interval, scatter, quantiles and range of each output, and its worst sample;
    of when peaks were, and of what differs by less than its error bar and no requirement names,
    only if ``every`` one is told.
    """
    rows, few, alike, within = [], False, list[str](), list[str]()
    again, flat = list[str](), list[str]()
    wanted = analysis["requirement"].values if "requirement" in analysis.dims else ()
    for name in outputs_in(analysis):
        if is_moment(name) and not every:
            continue
        factor, units = unit_of(analysis, name)
        values, counts = factor * analysis[name].values, analysis[f"{name}_samples"].values
        mean, deviation, *quantiles, least, most = values
        used, run = counts[0], counts[:3].sum()  # what has not run is the last
        count = str(used) if used == run else f"{used} of {run}"
        bar, fine = factor * float(analysis[f"{name}_same_within"]), digits_of(least, most)
        if all_alike(least, most):
            value = "0" if abs(least) < NOTHING else f"{number_text(least)} {units}".rstrip()
            alike.append(f"{name} {value}" + f" (in {count})" * int(used < run))
            continue
        twin = analysis[name].attrs.get(TWIN)
        if twin is not None and not every and name not in wanted:
            again.append(f"{name} is {twin}")
            continue
        if hardly_apart(least, most) and not every and name not in wanted and np.isnan(bar):
            ends = f"{fine_text(least, fine)} .. {fine_text(most, fine)}"
            flat.append(f"{name} {ends} {units}".rstrip() + f" (in {count})" * int(used < run))
            continue
        if np.isfinite(bar):
            inside = f", mean {fine_text(mean, fine)}" * bool(np.isfinite(mean))
            told = f"{fine_text(least, fine)} .. {fine_text(most, fine)} {units}".rstrip()
            within.append(f"{name} {told}{inside}, error bars {bar:.2g}")
        if np.isfinite(least) and (every or np.isnan(bar) or name in wanted):
            low, high = (factor * analysis[f"{name}_interval"].values[0]).tolist()
            scatters = np.isfinite(analysis[f"{name}_error_of_mean"].values[0])
            few |= bool(scatters and np.isnan(low) and used < LEAST_OF_BOOTSTRAP)
            others = [fine_text(v, fine) for v in (*quantiles, least, most)]
            worst = int(analysis[f"{name}_worst_sample"])
            rows.append((
                name, units, estimate_text(mean, low, high, fine), interval_text(low, high, fine),
                number_text(deviation), *others, "-" if worst < 0 else str(worst), count,
            ))  # fmt: skip
    head = (
        "output", "unit", "mean", "95 % interval of it", "std. dev.", "5 %", "median", "95 %",
        "least", "most", "worst sample", "samples used",
    )  # fmt: skip
    notes = [f"the same in all samples: {', '.join(alike)}"] * bool(alike)
    notes += [f"samples differ by less than {100 * ALIKE:g} %: {', '.join(flat)}"] * bool(flat)
    notes += [f"in all samples {', '.join(again)}"] * bool(again)
    if unsaid := [row[0] for row in rows if row[-2] == "-"]:
        known = derived.known_from(analysis.attrs).items()
        own = [name for name, each in known if name in unsaid and each.worse is None]
        told = "worst sample '-': nothing says that one end of the output is worse than the other"
        cure = f'; of {", ".join(own)}, worse = "larger" or "smaller" under [outputs] says it'
        notes.append(f"{told}{cure * bool(own)}")
    notes += filter(None, [analysis.attrs.get(RECORDED)])
    if within:
        notes.append(f"{_WITHIN}: {'; '.join(within)}")
    return marked(Table(head, rows, [*notes, *[too_few()] * few]), analysis)


_WITHIN = "no sample is farther from the mean than the error bars (root mean square)"


def too_few() -> str:
    """How many samples intervals take."""
    of_median, of_others = (
        next(n for n in range(2, 1000) if ranks(n, level)) for level in (0.5, 0.05)
    )
    return (
        "too few samples for some intervals: a mean or a standard deviation needs "
        f"{LEAST_OF_BOOTSTRAP}, a median {of_median}, the other quantiles {of_others}"
    )


def unit_of(analysis: xr.Dataset, name: str) -> tuple[float, str]:
    """Factor and unit in which tables tell an output; empty where it has none."""
    factor, units = readable(
        str(analysis.variables[name].attrs["units"]),
        np.nanmax(np.abs(analysis.variables[name].values), initial=0.0),
    )
    return factor, unit_text(units)


def every_statistic(analysis: xr.Dataset) -> Table:
    """A row a statistic of each output, with its interval, its convergence, and whose it is."""
    rows = []
    for name in outputs_in(analysis):
        used, lost, absent, _ = (str(n) for n in analysis[f"{name}_samples"].values)
        factor, units = unit_of(analysis, name)
        values = factor * analysis[name].values
        least, most = values[-2:]
        far = max(most - values[0], values[0] - least)
        fine = digits_of(least, most)
        for k, statistic in enumerate(STATISTICS):
            value = values[k]
            # What is alike in all samples takes one row.
            same = all_alike(least, most)
            if np.isnan(value) or (same and statistic != "maximum"):
                continue
            digits = 4 if statistic == "standard_deviation" else fine
            first = factor * analysis.variables[f"{name}_convergence"].values[:-1, k]
            low, high = (factor * analysis.variables[f"{name}_interval"].values[k]).tolist()
            alone = ""
            if statistic == "standard_deviation" and of_one(value, far, int(used)):
                alone, low, high = ONE_DECIDES, np.nan, np.nan
            side, who = k - len(STATISTICS) + 2, ("-", "-")
            if side >= 0 and not same:
                bar = factor * analysis[f"{name}_end_error"].values[side]
                who = str(analysis[f"{name}_end_sample"].values[side]), number_text(bar, 2)
            rows.append((
                name, units,
                "all" if same else statistic.replace("_", " "),
                estimate_text(value, low, high, digits),
                alone or interval_text(low, high, digits), *who,
                *(number_text(v, digits) for v in first), used, lost, absent,
            ))  # fmt: skip
    head = (
        "output", "unit", "statistic", "estimate", "95 % interval", "in sample",
        "its error bar", *_parts(), "samples used", "failed runs", "no value",
    )  # fmt: skip
    return marked(Table(head, rows, title="every statistic"), analysis)


def outputs_in(analysis: xr.Dataset) -> list[str]:
    """The outputs that an analysis is about."""
    return [name for name in quantities() if name in analysis]


def error_tables(analysis: xr.Dataset, *, every: bool = False) -> list[Table]:
    """The error budget: what makes means wrong, by how much and where it is largest, as far as
    there is more than the error of sampling (or ``every`` one); then errors of the solution itself.
    """
    rows, at_length = [], every
    wanted = analysis["requirement"].values if "requirement" in analysis.dims else ()
    for name in outputs_in(analysis):
        if is_moment(name) and not at_length:
            continue
        errors, counts, largest, samples = (
            analysis.variables[f"{name}_{word}"].values
            for word in ("error_of_mean", "error_samples", "largest_error", "largest_error_sample")
        )
        mean, *_, least, most = analysis[name].values
        known = np.isfinite(errors)
        within = bool(np.isfinite(analysis[f"{name}_same_within"]))
        same = within and not (at_length or name in wanted)
        if same or all_alike(least, most) or not (known.any() and np.isfinite(mean)):
            continue
        every |= bool(known[1:].any())
        factor, units = unit_of(analysis, name)
        errors, largest = factor * errors, factor * largest
        cells = [number_text(errors[0], 2)]
        nothing = max(ROUND_OFF * max(abs(least), abs(most)), NOTHING) * factor
        for error, count, most_of_all, sample in list(
            zip(errors, counts, largest, samples, strict=True)
        )[1:]:
            told = ["0" if error < nothing else number_text(error, 2), str(count), "0"]
            if most_of_all >= nothing:
                told[2] = f"{most_of_all:.2g} (sample {sample})"
            cells += told if count else ["-"] * 3
        rows.append((name, units, *cells, dominating(errors)))
    head = (
        "error of the mean of", "unit", "sampling (standard error)", "numerical (error bars)",
        "samples with bars", "largest bar", "engines (difference)", "samples checked",
        "largest difference", "dominates",
    )  # fmt: skip
    notes = [OF_ERRORS] * any(any(c != "-" for c in (row[3], row[6])) for row in rows)
    untold = dict.fromkeys(row[-1].partition(" (")[2].rstrip(")") for row in rows if row[-1] != "-")
    # What is not measured is told once: below all rows, or by letters that rows refer to.
    several, words = len(untold) > 1, list(filter(None, untold))
    for letter, unknown in zip(ascii_lowercase, words, strict=False):
        mark = f"({letter})" * several
        rows = [(*row[:-1], row[-1].replace(f" ({unknown})", f" {mark}".rstrip())) for row in rows]
        notes.append(f"{mark} {unknown}".lstrip())
    tables = [marked(Table(head, rows, notes), analysis)] if every else []
    if "balance" in analysis.dims:
        columns = (analysis[f"balance_{word}"].values.tolist()
                   for word in ("median", "largest", "sample", "samples"))  # fmt: skip
        balances = [
            (str(name), f"{median:.2g}", f"{largest:.2g} (sample {sample})", str(count))
            for name, median, largest, sample, count in zip(
                analysis["balance"].values, *columns, strict=True
            )
            if largest > NOTHING  # frames have no gap in any joint
        ]
        of_solution = "error of the solution", "median", "largest", "samples"
        tables.append(marked(Table(of_solution, balances), analysis))
    if (remarks := analysis.attrs.get("remarks")) and not at_length:
        tables.append(Table((), (), remarks.split("\n")))
    return tables


OF_ERRORS = (
    "numerical, engines: root mean square of the error bars, and of the differences of the "
    "engines, over the samples that have them; they do not average out: the mean is as wrong"
)
"""What the columns of the error budget are."""


def dominating(errors: np.ndarray[tuple[int], np.dtype[np.float64]]) -> str:
    """The source that dominates, as far as they are known; empty below two."""
    known = np.isfinite(errors)
    if known.sum() < 2:
        return "-"
    unknown = [name for name, k in zip(SOURCES, known, strict=True) if not k]
    found = SOURCES[int(np.nanargmax(errors))]
    return f"{found} ({' and '.join(unknown)} not measured)" if unknown else found


def error_lines(campaign: xr.Dataset) -> list[str]:
    """Statistics and errors of those outputs of a merged campaign that have error bars."""
    stand = population_of(campaign)
    barred = [n for n in quantities() if np.isfinite(numbers(stand, f"{n}_error")).any()]
    found = xr.Dataset(statistics(stand, placement(campaign), barred), attrs=attributes(campaign))
    tables = [statistics_table(found), *error_tables(found)]
    tables = [slim(doubted(table, found.attrs)) for table in tables if table.rows]
    return [line for table in tables for line in table.lines()]
