"""An analysis of a campaign as lines for people."""

import json
from collections.abc import Collection, Iterator

import numpy as np
import xarray as xr

from ringsim.analysis.brief import digits_of, output_table, what_matters, what_separates
from ringsim.analysis.design import placement, population_of
from ringsim.analysis.influence_text import influence_tables, refusals, sensitivity_tables
from ringsim.analysis.intervals import quantities
from ringsim.analysis.reweighting import (
    LEAST_OF_MEAN,
    LEAST_OF_SHARE,
    LEAST_REPLICATES,
    REWEIGHTED_STATISTICS,
    SOBOL,
)
from ringsim.analysis.study import PARTS, SOURCES, STATISTICS
from ringsim.analysis.tails import tail, tail_lines
from ringsim.analysis.verdicts import OUTCOME, Verdict, judge, read_requirements, stopping_lines
from ringsim.analysis.worst import LOST, MARK, NOTE, losses, marked, worst_lines
from ringsim.refusal import InputError
from ringsim.sampling.distributions import label_of
from ringsim.tables import Table, counted, interval_text, number_text, slim, text_table

# Estimates for other distributions of inputs, as lines for people.


THIN = " (few)"
"""Stands behind what too few samples decide."""


def reweighting_lines(analysis: xr.Dataset) -> Iterator[str]:
    """Which distributions, how many effective samples, then the estimates beside the old ones."""
    if "reweighted_to" not in analysis:
        return
    bent = MARK * bool(analysis.attrs.get(NOTE))
    laws = json.loads(analysis["reweighted_to"].item())
    told = ", ".join(f"{path} = {label_of(law)}" for path, law in laws.items())
    yield (
        f"reweighted to {told}: {analysis['reweighted_samples'].item()} samples count as "
        f"{number_text(analysis['effective_samples'].item(), 3)} effective ones"
    )
    rows, thin = [], False
    for name, variable in quantities().items():
        if f"{name}_reweighted" not in analysis:
            continue
        for statistic in REWEIGHTED_STATISTICS:
            one = analysis.sel(reweighted_statistic=statistic, statistic=statistic)
            low, high = one[f"{name}_reweighted_interval"].values.tolist()
            decisive = one[f"{name}_decisive_samples"].item()
            few = decisive < (LEAST_OF_MEAN if statistic == "mean" else LEAST_OF_SHARE)
            thin |= few
            rows.append((
                f"{name}{THIN * few}{bent}", "" if variable.units == "1" else variable.units,
                statistic.replace("_", " "),
                number_text(one[name].item()), number_text(one[f"{name}_reweighted"].item()),
                interval_text(low, high), number_text(one[f"{name}_effective_samples"].item(), 3),
                number_text(decisive, 3),
            ))  # fmt: skip
    if rows:
        head = ("output", "unit", "statistic", "as drawn", "reweighted", "95 % interval",
                "effective samples", "that decide it")  # fmt: skip
        yield from text_table(head, rows)
    shares = []
    for event in analysis["event"].values:
        one = analysis.sel(event=event)
        decisive = one["reweighted_share_decisive"].item()
        few = decisive < LEAST_OF_SHARE
        thin |= few
        shares.append((
            f"{event}{THIN * few}{'' if event == LOST else bent}",
            number_text(one["reweighted_share"].item()),
            interval_text(*one["reweighted_share_interval"].values.tolist()),
            number_text(decisive, 3),
        ))  # fmt: skip
    known = bool(analysis["reweighted_share_interval"].notnull().any())
    if shares:
        yield ""
        if analysis.attrs["design"] in SOBOL and not known:
            yield f"intervals of shares and quantiles need design.replicates = {LEAST_REPLICATES}"
        yield from text_table(
            ("probability of", "reweighted", "95 % interval", "samples that decide it"), shares
        )
    if thin:
        yield (
            f"{THIN.strip()}: too few samples decide it (below {LEAST_OF_MEAN:g} effective of a "
            f"mean, {LEAST_OF_SHARE:g} of others): the estimate may be far off, the interval of "
            "a mean is too short, a quantile has none, and that of a probability holds in any case"
        )
    if "reweighted_verdict" in analysis:
        yield ""
        yield from slim(_verdicts(analysis)).lines()


def _verdicts(analysis: xr.Dataset) -> Table:
    """The verdicts for the other distributions, a row a requirement."""
    rows = []
    for name in analysis["requirement"].values:
        one = analysis.sel(requirement=name)
        rows.append((
            one["requirement_text"].item(), f"{one['probability_required'].item():g}",
            f"{one['confidence_required'].item():g}",
            Verdict(one["reweighted_verdict"].item()).word.replace("_", " "),
            number_text(one["reweighted_probability"].item()),
            interval_text(*one["reweighted_bounds"].values.tolist()),
        ))  # fmt: skip
    head = ("requirement, reweighted", "probability", "confidence", "verdict", "estimate",
            "one-sided bounds")  # fmt: skip
    return marked(Table(head, rows), analysis, head.index("estimate"))


# An analysis of a campaign as lines for people.


_HINT = (
    '; require the outcome, too, as outcome = { is = "deployed", probability = P, confidence = C }'
)


def told(analysis: xr.Dataset, folder: str = "DIR", *, full: bool = False) -> list[str]:
    """Outcomes, outputs, errors, what matters, the worst samples; verdicts last, where they are
    seen.  ``folder`` is the campaign's, for the commands that run samples again.

    ``full`` has the interval and the convergence of every statistic, and every measure of what
    matters, whatever chance would explain.
    """
    counts = counted(analysis.attrs["samples"], "sample")
    if (run := analysis.attrs["samples_run"]) < analysis.attrs["samples"]:
        counts += f", of which {run} have run"
    counts += f", design {analysis.attrs['design'] or 'unknown'}"
    title = analysis.attrs["title"]
    lines = [f"{title}: {counts}" if title else counts]
    lines += [*filter(None, [analysis.attrs[NOTE]]), analysis.attrs["intervals"]]
    if "tail_probability" in analysis:
        lines.append(
            "no input is told to matter: samples of a chain repeat each other, and levels lie "
            "beyond different thresholds"
        )
    if not full:
        lines.append("all statistics with intervals and convergence, and all inputs: --full")
    if stopping := analysis.attrs["stopping"]:
        lines.append(stopping + MARK * bool(analysis.attrs[NOTE]))
    lines += tail_lines(analysis)
    tables = [outcome_table(analysis)]
    if full:
        tables += [_outputs(analysis), error_table(analysis)]
        tables += [*sensitivity_tables(analysis), *influence_tables(analysis)]
    else:
        tables += [output_table(analysis, outputs_in(analysis)), _known_errors(analysis)]
        tables += [what_matters(analysis), *refusals(analysis), what_separates(analysis)]
    parts = [table.lines() if full else slim(table).lines() for table in tables]
    parts += [worst_lines(analysis, folder)]
    parts += [slim(verdict_table(analysis)).lines(), list(reweighting_lines(analysis))]
    for more in filter(None, parts):
        lines += ["", *more]
    return lines


def _known_errors(analysis: xr.Dataset) -> Table:
    """The errors, if there is another one than that of sampling."""
    names = outputs_in(analysis)
    known = [np.isfinite(analysis[f"{name}_error_of_mean"].values[1:]).any() for name in names]
    return error_table(analysis) if any(known) else Table((), ())


def verdict_lines(campaign: xr.Dataset) -> list[str]:
    """The verdicts on the requirements of a merged campaign's own file; none without any."""
    own = json.loads(campaign.attrs.get("requirements", "{}"))
    placed, lost = placement(campaign), losses(campaign)
    found = xr.Dataset(tail(campaign), attrs={"samples": campaign.sizes["sample"]})
    lines = [*filter(None, [lost.note])]
    lines += [line + lost.mark for line in stopping_lines(campaign, placed)] + tail_lines(found)
    if not own:
        return lines
    try:
        found = judge(population_of(campaign), read_requirements(own, "requirements"), placed)
    except InputError as error:
        return [*lines, f"the requirements cannot be judged: {error}"]
    return [*lines, *verdict_table(found.assign_attrs({NOTE: lost.note})).lines()]


def verdict_table(analysis: xr.Dataset) -> Table:
    """The verdicts, a row a requirement; no rows without requirements."""
    rows, notes = [], list[str]()
    for name in analysis["requirement"].values if "requirement" in analysis.dims else ():
        one = {str(n): v.item() for n, v in analysis.sel(requirement=name).items() if not v.dims}
        verdict, alone = Verdict(one["verdict"]), Verdict(one["verdict_of_used"])
        further = one["further_samples"]
        rows.append((
            one["requirement_text"], f"{one['probability_required']:g}",
            f"{one['confidence_required']:g}", _words(verdict), number_text(one["probability"]),
            interval_text(one["probability_lower"], one["probability_upper"]),
            str(one["samples_used"]), str(one["samples_violating"]), str(one["samples_lost"]),
            _words(alone) if one["samples_lost"] else "-", str(further) if further > 0 else "-",
        ))  # fmt: skip
        if further > 0:
            more = counted(further, "further sample")
            taken = counted(one["samples_lost"], "lost sample")
            kept = f", with {taken} as violations" * bool(one["samples_lost"])
            notes.append(f"{name}: {more} without a violation would show it{kept}")
        if verdict != alone:
            notes.append(
                f"{name}: it would be {_words(alone)} if lost samples were as the others, which "
                "nobody knows: run them again (ringsim campaign --retry-failed)"
            )
        if not one["samples_used"]:
            notes.append(f"{name}: no sample has numbers that tell of it")
        if short := one.get("samples_short"):
            held = one["samples_used"] - one["samples_violating"]
            hint = "" if OUTCOME in analysis["requirement"] else _HINT
            notes.append(
                f"{name}: {short} of the {held} that keep to it ended short of their goal, and "
                f"might not have kept to it further on{hint}"
            )
        if missing := one["samples_without_value"]:
            notes.append(
                f"{name}: violations without a value, as the antenna did not get so far: {missing}"
            )
    head = (
        f"requirement{', as drawn' * ('reweighted_to' in analysis)}", "probability", "confidence",
        "verdict", "estimate", "one-sided bounds", "used", "violating", "lost",
        "if lost ones were as the others", "further",
    )  # fmt: skip
    return marked(Table(head, rows, notes), analysis, head.index("estimate"))


def _words(verdict: Verdict) -> str:
    return verdict.word.replace("_", " ")


def outcome_table(analysis: xr.Dataset) -> Table:
    """What the antenna did, and how runs were lost, with shares."""
    rows = [
        (
            str(kind).replace("_", " "),
            f"{one['outcome_samples'].item()} of {one['outcome_of'].item()}"
            + f" ({one['outcome_lost'].item()} lost)" * bool(one["outcome_lost"].item()),
            number_text(one["outcome_share"].item()),
            interval_text(*one["outcome_share_interval"].values),
            *map(number_text, one["outcome_share_convergence"].values[:-1]),
        )
        for kind in analysis["kind"].values
        for one in [analysis.sel(kind=kind)]
    ]  # fmt: skip
    return Table(("outcome", "samples", "share", "95 % interval", *_parts()), rows)


def _parts() -> list[str]:
    return [f"first {part:.0%}" for part in PARTS[:-1]]


def _outputs(analysis: xr.Dataset) -> Table:
    rows = []
    for name in outputs_in(analysis):
        used, lost, absent, _ = (str(n) for n in analysis[f"{name}_samples"].values)
        units = analysis[name].attrs["units"]
        values = analysis[name].values
        least, most = values[-2:]
        fine = digits_of(least, most)
        for k, statistic in enumerate(STATISTICS):
            value = values[k]
            # What is alike in all samples takes one row.
            if np.isnan(value) or (least == most and statistic != "maximum"):
                continue
            digits = 4 if statistic == "standard_deviation" else fine
            low, high = analysis[f"{name}_interval"].values[k]
            first = analysis[f"{name}_convergence"].values[:-1, k]
            rows.append((
                name, "" if units == "1" else units,
                "all" if least == most else statistic.replace("_", " "), number_text(value, digits),
                interval_text(low, high, digits), *(number_text(v, digits) for v in first),
                used, lost, absent,
            ))  # fmt: skip
    head = (
        "output", "unit", "statistic", "estimate", "95 % interval", *_parts(), "used", "lost",
        "no value",
    )  # fmt: skip
    return marked(Table(head, rows), analysis)


def outputs_in(analysis: xr.Dataset) -> list[str]:
    """The outputs that an analysis is about."""
    return [name for name in quantities() if name in analysis]


def error_table(analysis: xr.Dataset, names: Collection[str] | None = None) -> Table:
    """What makes means wrong, and by how much; ``names`` are the outputs, by default all."""
    rows = []
    for name in outputs_in(analysis) if names is None else names:
        errors = analysis[f"{name}_error_of_mean"].values
        mean, *_, least, most = analysis[name].values
        if np.isfinite(errors).any() and np.isfinite(mean) and least < most:
            rows.append(
                (
                    name,
                    analysis[name].attrs["units"],
                    *(number_text(e, 2) for e in errors),
                    dominating(errors),
                )
            )
    head = (
        "error of the mean of", "unit", "sampling (standard error)", "numerical (error bars)",
        "engines (difference)", "dominates",
    )  # fmt: skip
    return marked(Table(head, rows), analysis)


def dominating(errors: np.ndarray[tuple[int], np.dtype[np.float64]]) -> str:
    """The source that dominates, as far as they are known; empty below two."""
    known = np.isfinite(errors)
    if known.sum() < 2:
        return "-"
    unknown = [name for name, k in zip(SOURCES, known, strict=True) if not k]
    found = SOURCES[int(np.nanargmax(errors))]
    return f"{found} ({', '.join(unknown)} unknown)" if unknown else found
