"""The worst samples, what is unusual in them, and what lost runs leave open."""

import shlex
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.campaign_notes import RIGID, doubted, late_line, marked, plane_margin
from ringsim.analysis.courses import largest
from ringsim.analysis.design import (
    DIFFERENCE,
    FAILED_RUNS,
    LOST,
    by_path,
    called,
    drawn,
    endings,
    inputs,
    kinds_of_ends,
    place_names,
    placement,
    planes_apart,
    short_of_goal,
)
from ringsim.analysis.influence import separating, standing_out
from ringsim.analysis.intervals import ROUND_OFF, Mask, good, numbers, quantities, ran
from ringsim.analysis.requirements import MARGINS, OUTCOME, Requirement, require_values, violations
from ringsim.outputs import OUTPUTS
from ringsim.outputs.balance import exceeded
from ringsim.overrides import flat
from ringsim.stepping.instant import Array
from ringsim.tables import Table, counted, number_text, readable, with_unit
from ringsim.variables import GO_ON, Fate, about, texts_about

# What is unusual in the inputs of a sample, in words.


RARE = 0.05
"""Share of the samples that are as far out, on the same side, up to which a value is unusual: it
lies outside of the central 90 %.  By chance alone one input of ten is so in a sample; a wider bound
would name some input of every sample.
"""
_SIDE = 1 / 3
"""The same for an input that separates the failure: beyond this every second sample would have it.
"""
_MOST = 3
"""Inputs that are told of a sample."""
_ZERO = 273.15
"""0 C in K."""
_NOTE_ON_UNUSUAL = (
    "unusual inputs: first those that separate the failures from the other samples, or that go "
    "with the output, then those outside the central 90 % of all samples; in brackets the "
    "difference from the median (one place: of all places), or how many times the median it is, "
    "for temperatures the value in C"
)


class _Oddity(NamedTuple):
    """An input of a sample, and the share of samples that have it as far out; words, as of a fault
    that was drawn, come ``before`` numbers.
    """

    share: float
    words: str
    before: bool = False


def unusual(
    campaign: xr.Dataset, places: Sequence[int], separating: Sequence[Mapping[str, bool]] = (),
    whole: xr.Dataset | None = None,
) -> list[str]:  # fmt: skip
    """For samples, by their places, the inputs that tell them from the others, at most three:
    "cold: temperature 235 K (-38 C, the lowest); mean of pulleys 8.3e-4 m (+50 %)".

    First those that separate the failure, where the sample is on their side; then the inputs that
    are ``RARE``, the farthest out first.  ``separating`` has for each sample the columns of
    ``drawn`` that separate its failure, the best first, and whether they are larger there.

    Of an input with m places the one that is farthest out among all values counts, with m times
    the share: some place of every sample is far out by chance.  Its mean counts beside, and large
    differences of the two planes' inputs.  Of a design that changes one input at a time what is
    other than in its base case, the first of the ``whole`` campaign; of a list of cases first their
    labels, and what most of them have otherwise.  A drawn fault is always told.
    """
    if one_at_a_time(campaign if whole is None else whole):
        return [other_than_base(campaign, place, whole) for place in places]
    variables = {called(campaign[name]): campaign[name] for name in inputs(campaign)}
    columns, found, both = drawn(campaign), list[str](), planes_apart(campaign)
    listed, grid = (placement(campaign).kind == kind for kind in ("list", "grid"))
    names, usual = (labels(campaign), _usual(campaign)) if listed else ([], [])
    for place, sides in zip(places, separating or [{}] * len(places), strict=True):
        told, named = [str(each.values[place]) for each in names], set[str]()
        for name, variable, column, most in usual:
            if column[place] != most:
                new, common = (_value(each, _units(variable)) for each in (column[place], most))
                told.append(f"{name} = {new} (most: {common})")
                named.add(called(variable))
        for name, larger in sides.items():
            if name not in columns.names or len(told) == _MOST:
                continue
            k = columns.names.index(name)
            values, own = columns.values[:, k], columns.input[k]
            variable = both[own][0] if own in both else variables[own]
            value = values[place] if larger else -values[place]
            beside = values if larger else -values
            # Half of those with its own value, as where two values share all samples.
            out = float(0.5 * (np.mean(beside > value) + np.mean(beside >= value)))
            if own in named or out > (1.0 if _has_words(variable) else _SIDE):
                continue
            named.add(own)
            one = variable.ndim > 1 and name in [f"{p} of {own}" for p in place_names(variable)]
            rows = variable.to_numpy() if one else values
            told.append(
                _word(variable, place)[1] if _has_words(variable)
                else _told(name, rows, float(values[place]), _units(variable))
            )  # fmt: skip
        odd = [
            each for own, variable in variables.items() if own not in named
            for each in _odd(variable, place)
        ]  # fmt: skip
        for name in (each for each in both if each in columns.names and each not in named):
            values = columns.values[:, columns.names.index(name)]
            if (share := float(np.mean(values >= values[place]))) <= RARE:
                words = _told(name, values, float(values[place]), _units(both[name][0]))
                odd.append(_Oddity(share, words))
        told += [each.words for each in sorted(odd, key=lambda each: (not each.before, each.share))]
        told = told or (_chosen(campaign, place) if grid else [])
        found.append("; ".join(told[:_MOST]) or "nothing unusual")
    return found


def _chosen(campaign: xr.Dataset, place: int) -> list[str]:
    """Of a grid, in which no value is rare, those of a sample that are at the end of theirs."""
    told = []
    for variable in (campaign[name] for name in inputs(campaign)):
        for of, column in () if _has_words(variable) else _columns(variable):
            if column[place] in (column.min(), column.max()) and np.ptp(column):
                name = f"{of}{called(variable)}"
                told.append(_told(name, column, float(column[place]), _units(variable)))
    return told


def labels(campaign: xr.Dataset) -> list[xr.DataArray]:
    """Of a list of cases the texts that tell them apart."""
    return [
        campaign[name] for name, v in campaign.variables.items()
        if v.attrs.get("role") == "label" and v.dims == ("sample",) and v.dtype.kind in "OU"
    ]  # fmt: skip


def _usual(campaign: xr.Dataset) -> list[tuple[str, xr.DataArray, NDArray[Any], Any]]:
    """Of each input, or place of it, that most cases of a list have alike: its name, what it is of,
    its values, and that of most.
    """
    found = []
    for variable in (campaign[name] for name in inputs(campaign)):
        for of, column in _columns(variable):
            most, count = Counter(column.tolist()).most_common(1)[0]
            if 2 * count > len(column):
                found.append((f"{of}{called(variable)}", variable, column, most))
    return found


def _columns(variable: xr.DataArray) -> list[tuple[str, NDArray[Any]]]:
    """Values of an input over samples, of each place of it, and the place in words."""
    values = variable.to_numpy()
    of = [""] if values.ndim == 1 else [f"{one} of " for one in place_names(variable)]
    return list(zip(of, values.reshape(len(values), -1).T, strict=True))


def one_at_a_time(campaign: xr.Dataset) -> bool:
    """Whether each sample differs from sample 0, the base case, by one change; not without it."""
    return placement(campaign).kind == "one-at-a-time" and 0 in campaign["sample"].values


def other_than_base(campaign: xr.Dataset, place: int, whole: xr.Dataset | None = None) -> str:
    """What a sample, by its place in the file, has other than the first one of the whole campaign:
    "cables.lower.winch.stop_time = 1 s (base: none)".
    """
    told = []
    for name in inputs(campaign):
        variable, first = campaign[name], _columns((campaign if whole is None else whole)[name])
        for (of, column), (_, bases) in zip(_columns(variable), first, strict=True):
            if column[place] != bases[0]:
                new, base = (_value(each, _units(variable)) for each in (column[place], bases[0]))
                told.append(f"{of}{called(variable)} = {new} (base: {base})")
    return "; ".join(told[:_MOST]) or "the base case"


def _value(value: Any, units: str) -> str:
    try:
        return with_unit(f"{float(value):.4g}", units)
    except ValueError:
        return str(value)


def _has_words(variable: xr.DataArray) -> bool:
    return variable.dtype.kind in "OUSb"


def _units(variable: xr.DataArray) -> str:
    return str(variable.attrs.get("units", "1"))


def _word(variable: xr.DataArray, sample: int) -> tuple[float, str]:
    """The share of samples that have the words of one, and these words."""
    rows = variable.to_numpy().reshape(variable.shape[0], -1).astype(str)
    alike = int((rows == rows[sample]).all(axis=1).sum())
    word = ", ".join(dict.fromkeys(rows[sample].tolist()))
    return alike / len(rows), f"{called(variable)} = {word} (as in {alike} of {len(rows)})"


def _odd(variable: xr.DataArray, sample: int) -> Iterator[_Oddity]:
    """The oddity of one input in a sample, by its place in the file; none if it is usual."""
    name = called(variable)
    if _has_words(variable):
        share, words = _word(variable, sample)
        fault = variable.attrs.get("path") == "faults" and variable.values[sample] != "none"
        if fault or share <= 2.0 * RARE:  # words have no side
            yield _Oddity(share, words, before=True)
        return
    numbers, odd = variable.to_numpy().astype(float), list[_Oddity]()
    for each, of in (
        [(numbers, [name])]
        if numbers.ndim == 1
        else [
            (numbers, [f"{place} of {name}" for place in place_names(variable)]),
            (numbers.mean(axis=1), [f"mean of {name}"]),
        ]
    ):
        rows = each.reshape(len(each), -1)
        if not (known := np.isfinite(rows)).any() or not known[sample].any():
            continue
        apart = np.abs(rows[sample] - np.median(rows[known]))
        if np.nanmax(apart) <= ROUND_OFF * np.abs(rows[known]).max():
            continue
        # With those that have the same: of a few discrete values many samples have the farthest.
        others, near = np.delete(rows, sample, axis=0), ROUND_OFF * np.nanmax(np.abs(rows))
        below = np.array([np.sum(~(others > value + near)) for value in rows[sample]])
        above = np.array([np.sum(~(others < value - near)) for value in rows[sample]])
        k = int(np.minimum(below, above).argmin())
        share = (min(below[k], above[k]) + 1.0) / len(rows)
        if share <= RARE:
            told = _told(of[k], rows, float(rows[sample, k]), _units(variable))
            odd.append(_Oddity(share, told))
    if odd:
        yield min(odd, key=lambda each: each.share)  # of equal ones the place, which moves the mean


def _told(name: str, rows: Array, value: float, units: str) -> str:
    """A value among those of all samples."""
    middle = float(np.nanmedian(rows))
    end = {rows.min(): ", the lowest", rows.max(): ", the highest"}.get(value, "")
    if units == "K" and not name.startswith(DIFFERENCE):
        colder = float(np.mean(rows < value))
        sense, share = ("warmer", colder) if value > middle else ("colder", np.mean(rows > value))
        than = f", {sense} than {100.0 * share:.0f} %" * (not end)
        return f"{name} {value:.4g} K ({value - _ZERO:.0f} C{than}{end})"
    if rows.min() > 0.0 or rows.max() < 0.0:
        ratio = value / middle
        far = f"{100.0 * (ratio - 1.0):+.0f} %" if ratio < 3.0 else f"{ratio:.2g} times the median"
    else:
        far = with_unit(f"{value - middle:+.2g}", units)
    return f"{name} {with_unit(f'{value:.4g}', units)} ({far}{end})"


# The worst samples: of each requirement that is violated, of each outcome that falls short of the
# goal, and of each way in which runs were lost.


MOST = 3
"""Samples that are told of each failure."""


class _Failure(NamedTuple):
    """Samples that failed in one way."""

    words: str
    own: Mask
    badness: Array
    """By which samples are ordered, the worst the largest; NaN comes last."""
    value: str
    """Output that is told of each sample; empty for the reason of its end."""
    larger: bool | None = None
    """Whether values of it are worse that are larger; None where both may be."""


def worst(
    campaign: xr.Dataset,
    requirements: Mapping[str, Requirement],
    analysis: xr.Dataset | None = None,
) -> xr.Dataset:
    """The worst samples of each failure along ``worst``, the worst first; empty without failures.

    ``worst_failure`` says what failed, with ``worst_failed`` samples of ``worst_of`` that ran; then
    ``worst_sample``, ``worst_found`` (its value, or why it ended) and ``worst_inputs``, what is
    unusual in its inputs.  Violations are ordered by their distance from the bound, those without
    a value last; outcomes as ``_stuck`` or ``_beyond`` has it; lost runs by how far they came.
    ``analysis`` is the ``influence`` of the campaign, of which the inputs that separate a failure
    are named first.  InputError if a requirement cannot be judged.
    """
    for name, wanted in requirements.items():
        require_values(campaign, name, wanted)
    # What has not run yet is no sample of which others are told.
    whole, campaign = campaign, campaign.isel(sample=np.flatnonzero(ran(campaign)))
    rows, chosen = list[tuple[str, int, int, str]](), list[int]()
    sides, every = list[dict[str, bool]](), _sides(analysis)
    wider = list[tuple[Mask, dict[str, bool]]]()
    for each in _failures(campaign, requirements):
        own = np.flatnonzero(each.own)
        side = _of_failure(every, each.words) or _of_output(analysis, each, campaign)
        # A few stalled rings are told by what separates all that do not deploy, as if named there.
        if not side and not each.value:
            side = next((s for mask, s in wider if s and mask[own].all()), {})
        if not each.value and not each.own.all():
            wider.append((each.own, side))
        order = own[np.argsort(-each.badness[own], kind="stable")][:MOST]
        for place in order.tolist():
            told = _found(campaign, each.value, place)
            rows.append((each.words, int(each.own.sum()), campaign.sizes["sample"], told))
            chosen.append(place)
            sides.append(side)
    if not rows:
        return xr.Dataset()
    failures, failed, of, found = zip(*rows, strict=True)
    columns: dict[str, tuple[Any, dict[str, Any]]] = {
        "failure": texts_about(failures, "what failed"),
        "failed": (np.array(failed), about("number of samples with this failure")),
        "of": (np.array(of), about("samples that have run")),
        "sample": (campaign["sample"].to_numpy()[chosen], about("one of the worst of these")),
        "found": texts_about(found, "its value, or why the run ended"),
        "inputs": texts_about(unusual(campaign, chosen, sides, whole), "its unusual inputs"),
    }
    return xr.Dataset({f"worst_{name}": ("worst", *each) for name, each in columns.items()})


def _sides(analysis: xr.Dataset | None) -> dict[str, dict[str, bool]]:
    """Of each failure by its words the inputs that separate it, and whether they are larger."""
    found: dict[str, dict[str, bool]] = {}
    if analysis is None:
        return found
    for group, chosen in separating(analysis):
        one = analysis.sel(group=group)["separation"][chosen]
        larger = dict(zip(one["input"].values.tolist(), (one.values > 0.5).tolist(), strict=True))
        found |= dict.fromkeys(group.split("; "), larger)
    return found


def _of_failure(sides: Mapping[str, dict[str, bool]], words: str) -> dict[str, bool]:
    """What separates a failure of some of these words; all lost runs are one group."""
    names = [FAILED_RUNS if word.startswith(LOST) else word for word in words.split("; ")]
    return next((sides[name] for name in names if name in sides), {})


def _of_output(
    analysis: xr.Dataset | None, failure: _Failure, campaign: xr.Dataset
) -> dict[str, bool]:  # fmt: skip
    """The inputs that go with the output which fails beyond chance, the strongest first, and
    whether larger ones make it worse: where nearly all samples fail nothing separates these.
    """
    goes_with = f"{failure.value}_rank_correlation"
    if analysis is None or failure.larger is None or goes_with not in analysis:
        return {}
    samples = int(np.isfinite(numbers(campaign, failure.value)[good(campaign)]).sum())
    values, listed = standing_out(analysis, failure.value, samples)
    order = np.argsort(-np.abs(np.nan_to_num(values)), kind="stable")
    names = analysis["input"].values.astype(str)
    return {str(names[k]): (values[k] > 0.0) == failure.larger for k in order if listed[k]}


def _failures(campaign: xr.Dataset, requirements: Mapping[str, Requirement]) -> list[_Failure]:
    """All failures that happened; those of the same samples as one, with the words of both."""
    stuck, found = _stuck(campaign), []
    for name, wanted in requirements.items():
        badness, value = stuck, ""
        if name != OUTCOME:
            badness, value = wanted.beyond(numbers(campaign, name)), name
        words, own = f"violates {wanted.told(name)}", violations(campaign, name, wanted)
        if not np.isfinite(badness[own]).any():  # why they ended tells more
            badness, value = stuck, ""
        known = value and None in (wanted.max, wanted.min)
        found.append(_Failure(words, own, badness, value, wanted.min is None if known else None))
    ends, came = endings(campaign), -numbers(campaign, "final_time")
    short = short_of_goal(ends)
    beyond = {each.word: _beyond(campaign, each) for each in GO_ON if each.word in short}
    found += [_Failure(word, ends == word, beyond.get(word, stuck), "") for word in short]
    kinds = [word for word in kinds_of_ends(ends) if word.startswith(LOST)]
    found += [_Failure(word, ends == word, came, "") for word in kinds]
    kept: dict[tuple[bytes, str], _Failure] = {}
    for each in (each for each in found if each.own.any()):
        key = each.own.tobytes(), each.value
        before = kept.get(key)
        kept[key] = each if before is None else before._replace(
            words=f"{before.words}; {each.words}"
        )  # fmt: skip
    return [*kept.values()]


def _stuck(campaign: xr.Dataset) -> Array:
    """How far an antenna is from what it should be: by the V-joints that have not locked, then by
    the latches that have not caught, then by the least rate at which one was met.
    """
    caught = np.nan_to_num(numbers(campaign, "latched_joints"))
    slow = 1.0 / (1.0 + np.nan_to_num(numbers(campaign, "least_latch_rate")))
    less = (caught - slow) / (2.0 + caught.max(initial=0.0))  # below 1, by which counts differ
    return np.asarray(-numbers(campaign, "locked_joints") - less)


def _beyond(campaign: xr.Dataset, fate: Fate) -> Array:
    """How bad an end beyond a limit is: loads by how far they are beyond theirs, slack by the
    V-joints that have not locked, and its time.
    """
    stuck = -numbers(campaign, "locked_joints")
    ratios = {path: -ratio for path, *_, ratio in _ratios(campaign)}  # reads all series
    slack = np.nan_to_num(ratios.pop(f"limits.{_SLACK[0]}", stuck), nan=-1.0)
    if fate is Fate.OVERLOADED:
        return np.asarray(np.fmax.reduce([*ratios.values()] or [stuck]))
    return np.asarray(stuck + 0.5 * slack / (1.0 + np.abs(slack)))  # counts differ by 1


def _found(campaign: xr.Dataset, name: str, place: int) -> str:
    """The value of an output in a sample, or why it ended: the first clause of its reason."""
    value = float(numbers(campaign, name)[place]) if name else np.nan
    if np.isfinite(value):
        units = quantities()[name].units
        return with_unit(f"{value:.4g}", units)
    reason = str(campaign["reason"].to_numpy()[place]) if "reason" in campaign else ""
    why, how = first_clause(reason), reason.partition("; ")[0].partition(":")[0]
    why = why if why.startswith(how) else f"{why}; {how}"  # over a limit: how far it came
    why = why or "no reason is told"
    return f"no value: {why}" if name else why


def first_clause(reason: str) -> str:
    """Why a run ended, or which limit it passed, without what follows from it."""
    clauses = reason.split("; ")
    return next((each for each in clauses if "more than limits." in each), clauses[0])


def command(folder: str, sample: int) -> str:
    """What runs a sample of the campaign in a folder again."""
    return f"ringsim replay {shlex.quote(folder)} {sample}"


def worst_tables(analysis: xr.Dataset, folder: str) -> list[Table]:
    """Of each failure a table of its worst samples, the worst first."""
    if "worst" not in analysis.dims:
        return []
    found: dict[str, list[tuple[str, ...]]] = {}
    values = [analysis[f"worst_{name}"].values.tolist() for name in COLUMNS]
    for words, failed, of, sample, value, odd in zip(*values, strict=True):
        head = f"{words} ({failed} of {counted(of, 'sample')})"
        row = (str(sample), value, odd, command(folder, sample))
        found.setdefault(head, []).append(row)
    columns = ("sample", "found", "unusual inputs", "run it again")
    return [Table(columns, rows, left=4, title=words) for words, rows in found.items()]


COLUMNS = ("failure", "failed", "of", "sample", "found", "inputs")


def note_on_unusual(analysis: xr.Dataset) -> str:
    """What "unusual inputs" are; empty where samples differ from a base case by one change each."""
    if analysis.attrs.get("design") == "grid":
        return f"{_NOTE_ON_UNUSUAL}; where none is, those at the ends of the grid"
    return "" if analysis.attrs.get("design") == "one-at-a-time" else _NOTE_ON_UNUSUAL


def worst_lines(analysis: xr.Dataset, folder: str) -> list[str]:
    """The same for terminals."""
    lines = list[str]()
    tables = [doubted(each, analysis.attrs) for each in worst_tables(analysis, folder)]
    for table in tables:
        lines.append(f"worst of: {table.title}")
        for sample, value, odd, again in table.rows:
            lines += [f"  sample {sample}: {value}", f"    inputs: {odd}", f"    {again}"]
    notes = dict.fromkeys([note_on_unusual(analysis), *(n for each in tables for n in each.notes)])
    return [*lines, *filter(None, notes)] if lines else []


# How far the worst samples stay from the limits of the scene, and from the drive that they need.


_SLACK = ("slack_duration", "longest_slack")
_DRIVE, _PLANE = "least_drive_margin", "least_plane_margin"


def margins_of(both: Sequence[xr.Dataset]) -> list[xr.Dataset]:
    """The margins of two runs or campaigns, of one plane's cable of both if of either."""
    campaigns = [each if "sample" in each.dims else each.expand_dims(sample=[0]) for each in both]
    plane = next(filter(None, map(plane_margin, campaigns)), "")
    return [margins(each, plane) for each in campaigns]


def margins(campaign: xr.Dataset, plane: str = "") -> xr.Dataset:
    """The margin to each limit of the scene along ``limit``, of the worst of the samples whose
    numbers hold.

    ``limit_text`` (as "limits.tension = 80 N"), ``limit_output``, ``limit_margin`` (limit over the
    largest value, less 1), ``limit_value`` and ``limit_sample``; a limit holds for the whole run,
    so that values behind the last lock count, too: ``limit_of`` says so where one is larger than
    the peak, ``limit_output``.  Behind these the drive margin of scenes with one, which is one
    already, and where it is least before a winch starts, that from then on; and that of one
    plane's own cable, the output ``plane``, or where it is news.  Empty without any.
    """
    rows = list[tuple[str, str, str, float, float, int, int, int]]()
    for path, peak, series, allowed, values, ratio in _ratios(campaign):
        k, units = int(np.nanargmin(ratio)), quantities()[peak].units
        bound = float(np.broadcast_to(allowed, ratio.shape)[k])
        told = f"{path} = {with_unit(f'{bound:g}', units)}"
        if (low := np.nanmin(allowed)) < (high := np.nanmax(allowed)):  # each sample has its own
            ends = with_unit(f"{low:.4g} .. {high:.4g}", units)
            told = f"{path} = {ends} (drawn, {bound:.4g} in sample {int(campaign['sample'][k])})"
        later = series and exceeded(numbers(campaign, peak)[k], values[k])
        of = f"{series} after the last lock, as recorded" if later else peak
        known = good(campaign) & np.isfinite(values + allowed)  # ropes never slack have 0 s of it
        counts = int((known & (values > allowed)).sum()), int(known.sum())
        rows.append((told, peak, of, float(ratio[k]), float(values[k]), k, *counts))
    late = [f"{_DRIVE}_started"] * bool(late_line(campaign))
    for name in (_DRIVE, *late, *filter(None, [plane or plane_margin(campaign)])):
        least = np.where(good(campaign), numbers(campaign, name), np.nan)
        if np.isfinite(least).any():
            k = int(np.nanargmin(least))
            counts = int((least < 0.0).sum()), int(np.isfinite(least).sum())
            rows.append((f"{name} >= 0", name, name, float(least[k]), float(least[k]), k, *counts))
    if not rows:
        return xr.Dataset()
    texts, names, told_of, margin, value, places, beyond, of_all = zip(*rows, strict=True)
    columns = {
        "text": texts_about(texts, "limit of the scene"),
        "output": texts_about(names, "output that it bounds"),
        "of": texts_about(told_of, "what has the worst value"),
        "margin": (np.array(margin), about("limit over the worst value, less 1; drive margin")),
        "value": (np.array(value), about("worst value of all samples, in the output's unit")),
        "sample": (campaign["sample"].to_numpy()[[*places]], about("sample with that value")),
        "beyond": (np.array(beyond), about("samples that are beyond the limit")),
        "samples": (np.array(of_all), about("samples that have a value")),
    }
    return xr.Dataset({f"limit_{name}": ("limit", *each) for name, each in columns.items()})


def _ratios(campaign: xr.Dataset) -> Iterator[tuple[str, str, str, Any, Array, Array]]:
    """Of each limit of the scene its path, the output that it bounds and its series, what it
    allows, the largest values and the margins of all samples.
    """
    scene = flat(tomllib.loads(str(campaign.attrs.get("scene", ""))))
    own = by_path(campaign)
    for limit, peak, series in limited():
        path = f"limits.{limit}"
        if peak not in campaign or (path not in scene and path not in own):
            continue
        allowed: Any = None if path in own else float(scene[path])
        if allowed is None:
            given = campaign[own[path]].values.tolist()
            allowed = np.array([np.nan if each == "none" else float(each) for each in given])
        values = largest(campaign, peak, series)
        ratio = np.asarray(allowed / np.where(good(campaign) & (values > 0), values, np.nan) - 1.0)
        if np.isfinite(ratio).any():
            yield path, peak, series, allowed, values, ratio


def limited() -> Iterator[tuple[str, str, str]]:
    """Limits of loads by their names, with the output that each bounds, and its series."""
    for output in OUTPUTS:
        for one in output.variables if output.limit else ():
            if one.largest_of == output.variables[0].name:
                yield output.limit, one.name, output.variables[0].name
    yield *_SLACK, ""


def margin_table(analysis: xr.Dataset) -> Table:
    """The margins, a row a limit; no rows without."""
    if "limit" not in analysis.dims:
        return Table((), ())
    rows = []
    columns = (analysis[f"limit_{word}"].values.tolist()
               for word in ("text", "output", "of", "margin", "value", "sample", "beyond",
                            "samples"))  # fmt: skip
    for told, name, of, margin, value, sample, beyond, every in zip(*columns, strict=True):
        factor, units = readable(quantities()[name].units, value)
        worst = with_unit(number_text(factor * value), units)
        short = "" if margin >= 0.0 else ": NOT enough"
        counts = f"{beyond} of {every}"
        rows.append((told, of, worst, f"{margin:+.3g}{short}", str(sample), counts))
    notes = [
        "margin: limit / worst value - 1, of all samples and the whole run; with a factor of "
        "safety F it is (1 + margin) / F - 1"
        + "; that of the drive is one already, with the factors of its standard"
        * any(of.startswith((_DRIVE, _PLANE)) for _, of, *_ in rows)
    ] * any(not of.startswith((_DRIVE, _PLANE)) for _, of, *_ in rows)
    if not {*MARGINS} & {*analysis.get("requirement", xr.DataArray([])).values.tolist()}:
        notes += filter(None, [analysis.attrs.get(RIGID)])  # else the verdict says so
    head = ("limit", "of", "worst value", "margin", "in sample", "samples beyond")
    return marked(Table(head, rows, notes, left=2), analysis, 2)
