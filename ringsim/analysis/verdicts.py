"""Requirements of a campaign and what its samples say of them, at one look or several."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from ringsim.analysis.campaign_notes import (
    bars_of,
    doubtful,
    drive_notes,
    latches_in_doubt,
    marked,
    open_outcomes,
    opened,
)
from ringsim.analysis.derived import of_opening
from ringsim.analysis.design import Placement, worst_is_largest
from ringsim.analysis.intervals import (
    Interval,
    Mask,
    good,
    lost,
    numbers,
    quantities,
    samples_needed,
    share_bounds,
    standard_error,
)
from ringsim.analysis.requirements import (
    KINDS,
    OUTCOME,
    Levels,
    Requirement,
    Rule,
    doubt_of,
    half_width,
    looked_at,
    require_values,
    rule_of,
    violations,
)
from ringsim.tables import Table, bound_text, counted, number_text, with_unit
from ringsim.variables import GO_ON, GOALS, Code, Fate, about, flags_of, texts_about

if TYPE_CHECKING:
    import xarray as xr

# Verdicts on requirements: met, not met, or not yet shown, with exact bounds.
#
# They err on the safe side: nobody knows what lost runs would have done, so that they count as
# violating for "met", and as keeping to the requirement for "not met".


class Verdict(Code):
    """What samples say about a requirement."""

    NOT_MET = 0
    """The upper bound of the probability is below the one required."""
    NOT_YET_SHOWN = 1
    MET = 2
    """The lower bound of the probability is at least the one required."""
    NO_POPULATION = 3
    """The design stands for no population: only violations can be counted."""


def bounds(kept: Mask, samples: NDArray[np.int64], levels: Levels, placed: Placement) -> Interval:
    """One-sided bounds of the probability that samples keep to a requirement.

    ``levels`` are the confidence of the lower and of the upper one.  Those after Clopper and
    Pearson; where the replicates of a design scatter by more than independent samples would, those
    of Student's t from the replicates.
    """
    low, high = (share_bounds(int(kept.sum()), len(kept), levels[k])[k] for k in (0, 1))
    replicate = placed.replicate_of(samples)
    if replicate is not None and placed.replicates > 1:
        share = float(kept.mean())
        error, free = standard_error(kept.astype(float), replicate)
        if free > 0 and np.isfinite(error):
            below, above = (float(scipy.special.stdtrit(free, level) * error) for level in levels)
            low, high = max(0.0, min(low, share - below)), min(1.0, max(high, share + above))
    return low, high


def judge(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement
) -> xr.Dataset:
    """The verdict on every requirement, along ``requirement``.

    Where the campaign's rule for stopping looks at a requirement again and again, its bounds hold
    at all looks at once.
    """
    import xarray as xr  # here: see ringsim.analysis.design

    rule = rule_of(campaign.attrs)
    columns: dict[str, list[float]] = {name: [] for name in _MEANING}
    none = np.zeros(campaign.sizes["sample"], dtype=bool)
    doubted = doubtful(campaign)[0] if requirements else {}
    for name, wanted in requirements.items():
        require_values(campaign, name, wanted)
        off, unsure = doubted.get(name, none), none
        if name == LATCHED:  # so many more or fewer may have caught
            count, (gone, won) = numbers(campaign, name), latches_in_doubt(campaign)
            kept = [wanted.beyond(count + each) <= 0.0 for each in (0.0, -gone, won)]
            unsure = (kept[0] != kept[1]) | (kept[0] != kept[2])
        if name == OUTCOME and wanted.is_ == Fate.DEPLOYED.word:
            unsure = open_outcomes(campaign)
        found = _judged(campaign, name, wanted, placed, rule, off | unsure)
        for key, value in (found | {"samples_unsure": (good(campaign) & unsure).sum()}).items():
            columns[key].append(value)
    known = {
        name: ("requirement", np.array(columns[name], dtype=kind), about(words))
        for name, (words, kind) in _MEANING.items()
    }
    told = [each.told(name) for name, each in requirements.items()]
    table = xr.Dataset(known, coords={"requirement": np.array([*requirements], dtype=object)})
    table["requirement_text"] = "requirement", *texts_about(told, "requirement in words")
    for name in ("verdict", "verdict_of_used"):
        table[name].attrs |= flags_of(Verdict)
    return table.assign(_together(campaign, requirements, placed, rule))


def _together(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement,
    rule: Rule | None,
) -> dict[str, Any]:  # fmt: skip
    """Samples that keep to all of several requirements, of those that have run, and the bounds of
    their probability, each with the largest confidence of them all, at all looks of a rule at once
    as their own bounds; failed runs keep to none for the lower one, and to all for the upper.
    """
    run = good(campaign) | lost(campaign)
    if len(requirements) < 2 or not run.any():
        return {}
    kept = good(campaign).copy()
    for name, wanted in requirements.items():
        kept &= ~violations(campaign, name, wanted)
    sure, ends = max(each.confidence for each in requirements.values()), (np.nan, np.nan)
    levels = [sure, sure] if rule is None else [
        max(each) for each in zip(*(
            rule.levels(name, wanted, looked_at(campaign), placed.replicates)
            for name, wanted in requirements.items()
        ), strict=True)
    ]  # fmt: skip
    if placed.population:  # what failed runs would have done, nobody knows
        index, level = campaign["sample"].to_numpy()[run], (levels[0], levels[1])
        sides = (bounds(own[run], index, level, placed) for own in (kept, kept | lost(campaign)))
        least, most = sides
        ends = least[0], most[1]
    return {
        "together_samples": ((), int(kept.sum()), about("samples that keep to all requirements")),
        "together_lost": ((), int(lost(campaign).sum()), about("of these, failed runs")),
        "together_of": ((), int(run.sum()), about("samples that have run, failed ones too")),
        **{
            f"together_probability_{word}": ((), end, about(f"{word} bound of meeting all of them"))
            for word, end in zip(("lower", "upper"), ends, strict=True)
        },
        "together_confidence": ((), sure, about("confidence of each bound")),
    }  # fmt: skip


_MEANING = {
    "probability_required": ("probability required", "f8"),
    "confidence_required": ("confidence required of each bound", "f8"),
    "confidence_lower": (
        "confidence of the lower bound, raised for repeated checks (stop_when)", "f8"),
    "confidence_upper": (
        "confidence of the upper bound, raised for repeated checks (stop_when)", "f8"),
    "verdict": ("verdict, whatever failed runs would have done", "i1"),
    "verdict_of_used": ("verdict without failed runs", "i1"),
    "probability": ("share of the samples used that meet the requirement", "f8"),
    "probability_lower": (
        "one-sided lower bound of the probability, failed runs counted as violations", "f8"),
    "probability_upper": (
        "one-sided upper bound of the probability, failed runs counted as meeting it", "f8"),
    "samples_used": ("samples with a valid result", "i8"),
    "samples_lost": ("samples whose run failed", "i8"),
    "samples_violating": ("samples used that violate the requirement", "i8"),
    "samples_without_value": ("of these, samples without a value", "i8"),
    "samples_may_be_off": (
        "samples used whose value may be off, by what their runs say, or that are closer to the "
        "limit than the numerical error", "i8"),
    "samples_close": ("of these, samples closer to the limit than the numerical error", "i8"),
    "samples_unsure": ("of these, samples in which a latch that may miss decides", "i8"),
    "numerical_error": (
        "error bar that samples without one take from those that ended alike, in the median",
        "f8"),
    "verdict_may_change": ("whether those could change the verdict, were they wrong", "i1"),
    "samples_short": ("samples that meet it and ended before their goal", "i8"),
    "further_samples": (
        "further samples without a violation that would prove it; -1: no number would", "i8"),
}  # fmt: skip


_SLIGHT, _NEVER = 0.05, 1e-6
"""Chances below which it is told that more samples will hardly show a requirement met, and below
which nobody asks how small that is."""


def _judged(
    campaign: xr.Dataset, name: str, wanted: Requirement, placed: Placement, rule: Rule | None,
    off: Mask,
) -> dict[str, float]:  # fmt: skip
    used, gone, broken = good(campaign), lost(campaign), violations(campaign, name, wanted)
    close, error = _close(campaign, name, wanted)
    if name not in (OUTCOME, LATCHED):
        off = off & _near(numbers(campaign, name), wanted)
    off = used & (off | close)
    absent = used & (np.isnan(numbers(campaign, name)) if name != OUTCOME else False)
    count, bad, missing = (int(each.sum()) for each in (used, broken, gone))
    short = used & ~broken & ended_short(campaign)
    if of_opening(name):
        short &= ~np.isfinite(numbers(campaign, "deployment_time"))
    place = campaign["sample"].to_numpy()
    levels = wanted.confidence, wanted.confidence
    looked = looked_at(campaign)
    if rule is not None:
        levels = rule.levels(name, wanted, looked, placed.replicates)
    low, high, change = 0.0, 1.0, False
    verdict = alone = Verdict.NOT_YET_SHOWN
    if count:
        alone = verdict_of(*bounds(~broken[used], place[used], levels, placed), wanted.probability)
        run = used | gone

        def ends(least: Mask, most: Mask) -> Interval:
            """By the samples that keep to it at least, and at most."""
            low, high = (bounds(kept[run], place[run], levels, placed) for kept in (least, most))
            return low[0], high[1]

        least, most = ~(broken | gone), ~broken
        low, high = ends(least, most)
        verdict = verdict_of(low, high, wanted.probability)
        if off.any() and verdict != Verdict.NOT_YET_SHOWN:
            change = verdict != verdict_of(*ends(least & ~off, most | off), wanted.probability)
    further = -1
    if count and verdict == Verdict.NOT_YET_SHOWN:
        if rule is not None and rule.judges(name):
            further = rule.further_samples(name, wanted, looked, bad + missing, placed.replicates)
        else:
            needed = samples_needed(bad + missing, wanted.probability, wanted.confidence)
            further = max(needed - count - missing, 0) or -1
    if not placed.population:
        verdict = alone = Verdict.NO_POPULATION
        low, high, further, change = np.nan, np.nan, -1, False
    return {
        "probability_required": wanted.probability, "confidence_required": wanted.confidence,
        "confidence_lower": levels[0], "confidence_upper": levels[1],
        "verdict": verdict, "verdict_of_used": alone,
        "probability": 1.0 - bad / count if count else np.nan,
        "probability_lower": low, "probability_upper": high,
        "samples_used": count, "samples_lost": missing, "samples_violating": bad,
        "samples_without_value": int(absent.sum()),
        "samples_may_be_off": int(off.sum()), "verdict_may_change": change,
        "samples_close": int((used & close).sum()), "numerical_error": error,
        "samples_short": int(short.sum()) if name != OUTCOME else 0,
        "further_samples": further,
    }  # fmt: skip


def _close(campaign: xr.Dataset, name: str, wanted: Requirement) -> tuple[Mask, float]:
    """Which samples are closer to the limit than their numerical error, see ``bars_of``."""
    if name == OUTCOME or f"{name}_error" not in campaign:
        return np.zeros(campaign.sizes["sample"], dtype=bool), np.nan
    bars, error = bars_of(campaign, name)
    close = np.asarray(np.abs(wanted.beyond(numbers(campaign, name))) < bars)
    others = close & ~np.isfinite(numbers(campaign, f"{name}_error"))
    return close, float(bars[others].max()) if others.any() else error


_FAR = 10.0
"""Factor from its limit beyond which a value that may be off decides all the same: of latch rates
and base loads that were computed again with shorter steps, none was off by more than 6."""


def _near(values: NDArray[np.float64], wanted: Requirement) -> Mask:
    """Which values are within such a factor of a limit, or across zero from it, or none."""
    near = np.isnan(values)
    for ratio in (values / bound if bound else 0.0 * values for _, bound in wanted.limits):
        near |= (ratio <= 0.0) | ((ratio > 1.0 / _FAR) & (ratio < _FAR))
    return near


IF_HOLD = "if its numbers hold"
"""Behind a verdict that numbers which may be off could change."""
LATCHED = "latched_joints"


def verdict_text(one: Mapping[str, Any]) -> str:
    """A verdict of ``judge`` in words, with how many values may be off if these could change it."""
    words, off = Verdict(one["verdict"]).words, one["samples_may_be_off"]
    if not one["verdict_may_change"]:
        return words
    return f"{words}, {IF_HOLD}: may be off in {off} of {counted(one['samples_used'], 'sample')}"


def ended_short(campaign: xr.Dataset) -> Mask:
    """Which runs ended before their goal: what they never came to cannot exceed a limit.  Those
    over a limit of loads or slack go on, and may open all the same.
    """
    if OUTCOME not in campaign:
        return np.zeros(campaign.sizes["sample"], dtype=bool)
    fate = campaign[OUTCOME].to_numpy()
    done = np.isin(fate, GO_ON) & opened(campaign)
    return np.asarray(~np.isin(fate, [-1, Fate.NONE, *GOALS]) & ~done)


def verdict_of(low: float, high: float, probability: float) -> Verdict:
    """The verdict by the one-sided bounds of a probability; not yet shown where they are NaN."""
    if low >= probability:
        return Verdict.MET
    return Verdict.NOT_MET if high < probability else Verdict.NOT_YET_SHOWN


# Verdicts as a table.


_HINT = (
    '; set a requirement on the outcome, too: outcome = { is = "deployed", probability = P, '
    "confidence = C }"
)


def verdict_about(analysis: xr.Dataset, name: str) -> dict[str, Any]:
    """All about one requirement."""
    variables = analysis.sel(requirement=name).variables
    return {str(n): v.values.item() for n, v in variables.items() if not v.dims}


def _doubts(one: Mapping[str, Any], name: str) -> list[str]:
    """Why a verdict may change, and what settles it."""
    close, unsure, told = one["samples_close"], one["samples_unsure"], []
    if close:
        error = with_unit(number_text(one["numerical_error"], 2), quantities()[name].units)
        told.append(
            f"{name}: in {counted(close, 'sample')} it is closer to the limit than its numerical "
            f"error (its own error bar; without one at most {error}, the root mean square of those "
            "of samples that ended alike): smaller steps, or more elements, settle it"
        )
    if unsure:
        which = f"whether {'all' if name == OUTCOME else 'so many'} latches catch"
        told.append(
            f"{name}: in {counted(unsure, 'sample')} it is uncertain {which}, as another joint "
            "locked within two steps before, or the rate's numerical error decides it: smaller "
            "steps settle the first, smaller steps or more elements the second"
        )
    return told


def _together_told(analysis: xr.Dataset, every: str) -> str:
    """How many samples keep to all requirements."""
    names = ("samples", "of", "probability_lower", "probability_upper", "confidence")
    kept, run, least, most, sure = (float(analysis[f"together_{name}"]) for name in names)
    told = f"{every} requirements together: {kept:.0f} of {run:.0f} samples meet them"
    # Of few that meet them all the upper bound says more, and of none the lower one nothing.
    upper = 2.0 * kept < run
    if failed := int(analysis["together_lost"]):
        how = "that may have met them" if upper else "counted as not meeting them"
        told += f" ({counted(failed, 'failed run')} {how})"
    if np.isfinite(least):
        bound = bound_text(most if upper else least, upper=upper)
        told += (
            f", a probability of at {'most' if upper else 'least'} {bound} (confidence {sure:g})"
        )
    told += ", if their numbers hold" * bool(analysis["verdict_may_change"].any())
    return told


def verdict_table(analysis: xr.Dataset) -> Table:
    """The verdicts, a row a requirement; no rows without requirements."""
    rows, notes, chosen, never = [], list[str](), False, dict[tuple[str, str], list[str]]()
    for name in analysis["requirement"].values if "requirement" in analysis.dims else ():
        one = verdict_about(analysis, name)
        verdict, alone = Verdict(one["verdict"]), Verdict(one["verdict_of_used"])
        further = one["further_samples"]
        bad, used = one["samples_violating"], one["samples_used"]
        if verdict == Verdict.NO_POPULATION:  # a share of what was chosen is no estimate
            one["probability"], chosen = np.nan, True
            but = f"; closer to the limit than the numerical error: {one['samples_close']}"
            but *= bool(one["samples_close"])
            notes.append(f"{name}: {bad} of {used} samples violate it{but}")
        rows.append((
            one["requirement_text"], verdict_text(one), f"{one['probability_required']:g}",
            f"{one['confidence_required']:g}", number_text(one["probability"]),
            decisive(verdict, one["probability_lower"], one["probability_upper"]),
            str(one["samples_used"]), str(one["samples_violating"]), str(one["samples_lost"]),
            alone.words if one["samples_lost"] else "-", str(further) if further > 0 else "-",
        ))  # fmt: skip
        if further > 0:
            more = counted(further, "further sample")
            gone = counted(one["samples_lost"], "failed run")
            kept = f" (if the {gone} are counted as violations)" * bool(one["samples_lost"])
            so_far = f"{bad} of {used} violate it so far; " * bool(bad)
            odds = (1.0 - bad / max(used, 1)) ** further if not kept else 1.0
            of = f"of {odds:.1g}" if odds >= _NEVER else f"below {_NEVER:.0e}"
            kept += f", which has a chance {of} at such a share" * (odds < _SLIGHT)
            notes.append(f"{name}: {so_far}{more} without a violation would prove it{kept}")
        if bad and verdict != Verdict.NO_POPULATION:
            low = bound_text(1.0 - one["probability_upper"], upper=False)
            high = bound_text(1.0 - one["probability_lower"], upper=True)
            notes.append(
                f"{name}: violated with a probability of {number_text(1.0 - one['probability'])} "
                f"({low} .. {high}, each bound with the confidence required)"
            )
        elif not bad and used and np.isfinite(one["probability_lower"]):
            most = bound_text(1.0 - one["probability_lower"], upper=True)
            never.setdefault((most, f"{one['confidence_required']:g}"), []).append(str(name))
        if verdict != alone:
            notes.append(
                f"{name}: without the failed runs it would be {alone.words}; run them again "
                "(ringsim campaign --retry-failed)"
            )
        if not one["samples_used"]:
            notes.append(f"{name}: no sample has a valid result for it")
        if short := one.get("samples_short"):
            held = one["samples_used"] - one["samples_violating"]
            hint = "" if OUTCOME in analysis["requirement"] else _HINT
            goal = "all V-joints had come to 180 deg" if of_opening(name) else "it was deployed"
            notes.append(
                f"{name}: {short} of the {held} samples that meet it ended before {goal}, and meet "
                f"it only as far as they came{hint}"
            )
        # More samples alone would not settle what smaller steps have to.
        if one["verdict_may_change"] or verdict == Verdict.NOT_YET_SHOWN:
            notes += _doubts(one, str(name))
        signs = [kind.key for kind in KINDS if f" {kind.sign} " in one["requirement_text"]]
        if doubt := doubt_of(name, signs):
            notes.append(f"{one['requirement_text']}: {doubt}")
        notes += [f"{name}: {each}" for each in drive_notes(analysis.attrs, name)]
        if missing := one["samples_without_value"]:
            notes.append(
                f"{name}: violations without a value (the antenna did not get that far): {missing}"
            )
    notes = [
        f"no sample violates {', '.join(names)}: the probability of a violation is at most {most} "
        f"(confidence {level})"
        for (most, level), names in never.items()
    ] + notes
    if "together_of" in analysis and rows:
        notes.insert(0, _together_told(analysis, "both" if len(rows) == 2 else f"all {len(rows)}"))
    if rows:
        notes.insert(0, _CHOSEN if chosen else _DECIDES)
    head = (
        f"requirement{', as drawn' * ('reweighted_to' in analysis)}", "verdict", "probability",
        "confidence", SHARE_MET, BOUND, "samples used", "violating", "failed runs",
        "verdict without failed runs", "samples to go",
    )  # fmt: skip
    return marked(Table(head, rows, notes), analysis, head.index(SHARE_MET))


# An analysis in a few sentences, for who reads no table.


_MOST_NAMED = 4
"""Outputs without a requirement of which the sentences speak."""


class Parts(NamedTuple):
    """Tables of which sentences take their numbers, and the inputs that go with each output."""

    event: Table
    limits: Table
    numbers: Table
    separated: Table
    errors: Sequence[Table]
    strongest: Mapping[str, Sequence[str]]


def in_short(analysis: xr.Dataset, parts: Parts) -> list[str]:
    """What the antenna did, which requirements and limits hold, the numbers that are asked for with
    what goes with them, what separates failures, and which error is the largest.
    """
    run, samples = analysis.attrs["samples_run"], analysis.attrs["samples"]
    if not run:
        return ["no sample has run yet"]
    left = [f"{samples - run} of {counted(samples, 'sample')} have not run yet"] * (run < samples)
    if event := parts.event.rows:  # its chains of samples stand for no share of all antennas
        first = "; ".join(f"{what}{':' * (',' in what)} {found}" for what, found in event[:2])
        return [f"{parts.event.head[1]}: {first}", *parts.event.notes, *left]
    told = [*_did(analysis, run), *left]
    names = analysis["requirement"].values.tolist() if "requirement" in analysis.dims else []
    told += _held([verdict_about(analysis, name) for name in names])
    told += [
        f"{limit}: NOT enough in {beyond} samples, worst {worst} in sample {sample}"
        for limit, of, worst, margin, sample, beyond in parts.limits.rows
        if margin.endswith("NOT enough") and of not in names
    ]
    rows, head = parts.numbers.rows, parts.numbers.head
    cells = {row[0].partition(" ")[0]: dict(zip(head, row, strict=True)) for row in rows}
    chosen = [name for name in names if name in cells or name in parts.strongest]
    chosen = chosen or [name for name in parts.strongest if name in quantities()][:_MOST_NAMED]
    told += filter(None, (_number(analysis, name, cells.get(name, {}), parts) for name in chosen))
    told += [
        f"{re.sub('^violates', 'samples that violate', group)} differ by {row[1]}: {row[2]}"
        for row in parts.separated.rows
        if (group := row[0])  # with the best of each
    ]
    sources: dict[str, list[str]] = {}
    for table in parts.errors:
        for output, *_, source in table.rows if "dominates" in table.head else ():
            if output.partition(" ")[0] in chosen and source != "-":
                sources.setdefault(source.partition(" (")[0], []).append(output)
    each = [f"{source} in {', '.join(outputs)}" for source, outputs in sources.items()]
    return told + [f"largest error of a mean: {'; '.join(each)}"] * bool(each)


def _did(analysis: xr.Dataset, run: int) -> list[str]:
    """How many ended how; of designs that repeat values only the samples that count."""
    if "kind" not in analysis.dims:
        return []
    counts, of = analysis["outcome_samples"].values.tolist(), int(analysis["outcome_of"].max())
    each = (f"{kind} {n}" for kind, n in zip(analysis["kind"].values, counts, strict=True))
    more = f" that count, of {run} that ran" * (of < run)
    return [f"of {counted(of, 'sample')}{more}: {', '.join(each)}"]


def _held(each: Sequence[Mapping[str, Any]]) -> list[str]:
    """Verdicts by their words, with the counts behind them."""
    told: dict[str, list[str]] = {}
    for one in each:
        verdict, bad, used = Verdict(one["verdict"]), one["samples_violating"], one["samples_used"]
        chosen = verdict == Verdict.NO_POPULATION
        words = "of samples that stand for no population" if chosen else verdict.words
        words += f", {IF_HOLD}" * bool(one["verdict_may_change"] and not chosen)
        short = one.get("samples_short", 0)
        said = [f"{bad} of {used} violate it"] * bool(bad or (chosen and used))
        said += [counted(one["samples_lost"], "failed run")] * bool(one["samples_lost"])
        said += [f"{short} of {used} meet it only as far as they came"] * bool(short)
        share = "" if chosen else f" in {one['probability_required']:g} of all"
        known = f" ({', '.join(said)})" * bool(said)
        told.setdefault(words, []).append(f"{one['requirement_text']}{share}{known}")
    plural = {of: of.replace(" its ", " their ") for of, texts in told.items() if len(texts) > 1}
    return [f"requirements {plural.get(of, of)}: {'; '.join(told[of])}" for of in told]


def _number(analysis: xr.Dataset, name: str, cell: Mapping[str, str], parts: Parts) -> str:
    """Mean and worst value of an output, and the inputs that go with it; empty without either."""
    said = []
    if (sample := cell.get("worst sample", "-")) != "-":
        ends = {"mean": "mean", "worst": "most" if worst_is_largest(analysis, name) else "least"}
        each = {word: with_unit(cell[head], cell["unit"]) for word, head in ends.items()}
        mean = f"mean {each['mean']}, " * (cell["mean"] != "-")
        said.append(f"{mean}worst {each['worst']} in sample {sample}")
    if found := parts.strongest.get(name, ())[:2]:
        said.append(f"goes most with {' and '.join(found)}")
    return f"{cell.get('output', name)}: {'; '.join(said)}" * bool(said)


SHARE_MET = "share that meets it"
BOUND = "one-sided bound"
_DECIDES = (
    "the one-sided bound, at the confidence required, decides each verdict; where neither the "
    "lower nor the upper bound decides, both are given"
)
_CHOSEN = "these samples stand for no population: there is no probability to estimate"


def decisive(verdict: Verdict, low: float, high: float) -> str:
    """The bound of a probability that decides a verdict; both where neither does."""
    least, most = bound_text(low, upper=False), bound_text(high, upper=True)
    if verdict is Verdict.MET:
        return f"at least {least}"
    if verdict is Verdict.NOT_MET:
        return f"at most {most}"
    return f"at least {least}, at most {most}" if np.isfinite([low, high]).all() else "-"


# Whether the first samples of a campaign are enough, by its ``stop_when``.


def holds(
    rule: Rule, campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement
) -> str:
    """What the samples of a look show, in words, if all conditions hold; else empty.

    ``campaign`` has the samples of the look and no others, all of which have run, and its attribute
    ``stop_when``.  InputError if a requirement cannot be judged by them.
    """
    told = []
    for each in rule.conditions:
        if each.requirement is not None:
            wanted = {each.requirement: requirements[each.requirement]}
            found = judge(campaign, wanted, placed).isel(requirement=0)
            one = {name: found[name].item() for name in _MEANING}
            shown = one["verdict"] in (Verdict.MET, Verdict.NOT_MET)
            what = wanted[each.requirement].told(each.requirement)
            told.append(f"{what} is {verdict_text(one)}")
        else:
            half = half_width(each, campaign, placed)
            shown = half <= float(each.half_width or 0.0)
            known = with_unit(number_text(half, 3), quantities()[str(each.of)].units)
            told.append(f"the {each.what} is known to {known}")
        if not shown:
            return ""
    return ", ".join(told)
