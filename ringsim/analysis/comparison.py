"""What is other in one campaign than in another, or in one run: paired where samples are."""

import tomllib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis import intervals
from ringsim.analysis.campaign_notes import NOTE, losses
from ringsim.analysis.derived import known_from
from ringsim.analysis.design import (
    LOST,
    NOT_RUN,
    Placement,
    by_path,
    called,
    distribution_of,
    endings,
    inputs,
    placement,
    population_of,
)
from ringsim.analysis.indices import centred_ranks, correlations
from ringsim.analysis.intervals import Mask, good, lost, numbers, quantities
from ringsim.analysis.requirements import (
    OUTCOME,
    badness_of,
    require_values,
    required_by,
    violations,
)
from ringsim.analysis.tails import subset_simulation
from ringsim.analysis.verdicts import Verdict, judge, verdict_about, verdict_text
from ringsim.analysis.worst import margins_of
from ringsim.dataset import in_order
from ringsim.outputs.base import may_be_off
from ringsim.overrides import flat, with_names
from ringsim.refusal import InputError, show
from ringsim.sampling.distributions import law_text
from ringsim.tables import where_apart
from ringsim.variables import about, flags_of, texts_about

Both = tuple[xr.Dataset, xr.Dataset]
Placements = tuple[Placement, Placement]
BADNESS = "badness"
"""Attribute of a difference: 1 where larger values are the worse ones, -1 where smaller ones are, 0
where nothing tells."""
Indices = NDArray[np.int64]
Places = tuple[Indices, Indices]
"""Places of the samples of both that are pairs, shape (pairs,) each; empty without pairs."""
_LEAST_PAIRS = 8
"""Pairs below which no rank correlation is told."""
_FEW = 10
"""Samples of a kind, or pairs that differ, below which Student's t does not fit."""


class Event(NamedTuple):
    """Which samples of each campaign it happened to, and of which."""

    own: tuple[Mask, Mask]
    of: tuple[Mask, Mask]


def differences_of_shares(both: Both, placed: Placements, pairs: Places) -> dict[str, Any]:
    """Variables on outcomes along ``kind`` and on requirements of both along ``requirement``.

    For either, with ``kind_`` or ``kept_``: ``samples`` (side), ``share`` (side) of those compared,
    ``compared`` (side), ``share_difference``, second minus first, and its ``_interval`` (bound);
    and ``kept_verdict`` (side), what the samples of each say.
    """
    words = (endings(both[0]), endings(both[1]))
    held = good(both[0]), good(both[1])
    ran = held[0] | lost(both[0]), held[1] | lost(both[1])
    kinds = {
        kind: Event((words[0] == kind, words[1] == kind), ran if kind.startswith(LOST) else held)
        for kind in sorted({*words[0].tolist(), *words[1].tolist()})
    }
    found: dict[str, Any] = {"kind": ("kind", *texts_about(kinds, "how it ended"))}
    found |= _told("kind", "kind", kinds, placed, both, pairs)
    if kept := _kept(both, held):
        found["requirement"] = "requirement", *texts_about(kept, "requirement of both")
        found |= _told("kept", "requirement", kept, placed, both, pairs)
        codes, texts = _verdicts(both, placed, [*kept])
        both_sides, says = ("requirement", "side"), "verdict on the requirement"
        found["kept_verdict"] = both_sides, codes, about(says) | flags_of(Verdict)
        found["kept_verdict_text"] = both_sides, texts, {"long_name": f"{says} in words"}
    return found


def has_means(both: Both, placed: Placements, pairs: int) -> bool:
    """Whether means and shares are told: of populations, and of pairs of grids and lists; not of
    subset simulation, whose levels are neither.
    """
    if any(subset_simulation(each.attrs) is not None for each in both):
        return False
    return pairs > 0 or all(each.population for each in placed)


def _kept(both: Both, held: tuple[Mask, Mask]) -> dict[str, Event]:
    """The requirements that both campaigns have, with equal limits, and can be judged by."""
    one, other = (required_by(each.attrs) for each in both)
    found = {}
    for name, wanted in one.items():
        if name not in other or wanted.told(name) != other[name].told(name):
            continue
        try:
            for each in both:
                require_values(each, name, wanted)
        except InputError:  # the file of one does not tell it
            continue
        first, second = (good(each) & ~violations(each, name, wanted) for each in both)
        found[wanted.told(name)] = Event((first, second), held)
    return found


def _moved(both: Both, placed: Placements) -> list[str]:
    """What each campaign says of requirements on one output whose limits differ, as "peak_tension
    <= 20 N: met -> peak_tension <= 60 N: not met".
    """
    one, other = (required_by(each.attrs) for each in both)
    lines = []
    for name in (n for n in one if n in other and one[n].told(n) != other[n].told(n)):
        words = []
        for campaign, its, wanted in zip(both, placed, (one, other), strict=True):
            try:
                verdict = verdict_about(judge(campaign, {name: wanted[name]}, its), name)
            except InputError:  # its file does not tell it
                break
            words.append(f"{wanted[name].told(name)}: {verdict_text(verdict)}")
        lines += [" -> ".join(words)] * (len(words) == len(both))
    return lines


def _verdicts(
    both: Both, placed: Placements, texts: list[str]
) -> tuple[NDArray[np.int8], NDArray[np.object_]]:
    """What the samples of each campaign say of requirements, each shape (requirement, side): the
    verdict, and in words, with how many values may be off.
    """
    columns, words = [], []
    for campaign, its in zip(both, placed, strict=True):
        wanted = {each.told(name): name for name, each in required_by(campaign.attrs).items()}
        names = [wanted[text] for text in texts]
        judged = judge(campaign, {n: required_by(campaign.attrs)[n] for n in names}, its)
        every = [verdict_about(judged, name) for name in names]
        columns.append([one["verdict"] for one in every])
        words.append([verdict_text(one) for one in every])
    return np.array(columns, dtype=np.int8).T, np.array(words, dtype=object).T


def _told(
    word: str, dim: str, events: Mapping[str, Event], placed: Placements, both: Both, pairs: Places
) -> dict[str, Any]:
    counts = np.array([[int(own.sum()) for own in event.own] for event in events.values()])
    rows = [_compared(event, placed, both, pairs) for event in events.values()]
    numbers = np.array(rows).reshape(len(rows), 7)
    apart = "difference of the shares, second minus first"
    return {
        f"{word}_samples": ((dim, "side"), counts.reshape(-1, 2), about("samples of all")),
        f"{word}_compared": (
            (dim, "side"), numbers[:, :2].astype("i8"),
            about("samples compared, of which the shares are"),
        ),
        f"{word}_share": ((dim, "side"), numbers[:, 2:4], about("share")),
        f"{word}_share_difference": (dim, numbers[:, 4], about(apart)),
        f"{word}_share_difference_interval": (
            (dim, "bound"), numbers[:, 5:], about(f"interval of 95 % of the {apart}"),
        ),
    }  # fmt: skip


def _compared(
    event: Event, placed: Placements, both: Both, pairs: Places
) -> tuple[float, ...]:  # fmt: skip
    """Samples compared, their shares, the difference and its interval; NaN for what is not told."""
    places: list[Indices] = [np.flatnonzero(of) for of in event.of]
    if len(pairs[0]):
        whole = event.of[0][pairs[0]] & event.of[1][pairs[1]]
        places = [each[whole] for each in pairs]
    first, second = (own[k].astype(float) for own, k in zip(event.own, places, strict=True))
    counts = float(len(first)), float(len(second))
    if not all(counts) or not has_means(both, placed, len(pairs[0])):
        return (*counts, *[np.nan] * 5)
    shares = float(first.mean()), float(second.mean())
    bounds = intervals.NONE
    if all(each.has_intervals for each in placed):
        index = [each["sample"].to_numpy()[k] for each, k in zip(both, places, strict=True)]
        replicates = [p.replicate_of(i) for p, i in zip(placed, index, strict=True)]
        compare = _paired if len(pairs[0]) else _independent
        bounds = compare(first, second, replicates)
    return (*counts, *shares, shares[1] - shares[0], *bounds)


def _paired(first: Any, second: Any, replicates: list[Any]) -> intervals.Interval:
    only = int((first > second).sum()), int((second > first).sum())
    apart, few = second - first, sum(only) < _FEW
    if replicates[0] is None or few or intervals.agree(apart, replicates[0]) or not np.ptp(apart):
        together = int((first * second).sum())
        return intervals.difference_of_pairs(together, *only, len(first) - together - sum(only))
    low, high = intervals.of_replicates(apart, replicates[0], np.mean)
    return max(-1.0, float(low)), min(1.0, float(high))


def _independent(first: Any, second: Any, replicates: list[Any]) -> intervals.Interval:
    counts = [(int(each.sum()), len(each)) for each in (first, second)]
    few = any(min(own, of - own) < _FEW for own, of in counts)
    if few or all(each is None for each in replicates):
        return intervals.difference_of_shares(counts[0], counts[1])
    low, high = intervals.of_difference(first, second, tuple(replicates))
    return max(-1.0, float(low)), min(1.0, float(high))


# Pairs, and what is told of all outputs.


SIDES, PLACE = ("first", "second"), ("plane", "section")
_LONGEST = 200  # letters of a setting: of several faults, too


@dataclass(frozen=True)
class Pairs:
    """Which samples of two campaigns belong together."""

    first: Indices
    """Places in the first campaign, shape (pairs,)."""
    second: Indices
    told: str
    """By what they are paired, in words, or why there are none."""


def compare(first: xr.Dataset, second: xr.Dataset, names: tuple[str, str] = SIDES) -> xr.Dataset:
    """Differences of all outputs of two campaigns, or of two runs, second minus first.

    Returns for every output NAME that both have ``NAME_mean`` (side), ``NAME_difference``,
    ``NAME_difference_interval`` (bound), ``NAME_numerical_error`` (side; root mean square of error
    bars, NaN without), ``NAME_samples`` (side) in its unit, and for pairs
    ``NAME_largest_difference`` with ``NAME_largest_difference_sample`` and
    ``NAME_rank_correlation`` of both (NaN of few pairs, and where either side hardly differs
    between samples) and ``NAME_spread`` (side), and ``NAME_doubtful`` (side), in how many samples
    the runs themselves say that it may be off, if any does; an output that only one of them has is
    missing in the other, and in the difference. The pairs whose outcome differs along ``change``;
    shares of outcomes along ``kind`` and of samples that meet a requirement along ``requirement``,
    see ``differences_of_shares``, and the verdicts on those whose limits differ as lines in the
    attribute ``moved``; the margins of both to their limits along ``limit``; the scenes' values
    that differ along ``setting``, by path.  Samples are those of ``samples_of``, as far as
    ``analyse`` counts them; means and shares are those of populations, and of pairs of grids and
    lists. ``pairing`` among the attributes says what is paired; ``names`` are what tables and
    figures call the two. InputError if one holds a run and the other a campaign.
    """
    if ("sample" in first.dims) != ("sample" in second.dims):
        raise InputError(
            "one of them holds a run and the other a campaign: compare two of the same kind (one "
            "sample of a campaign as a run: ringsim replay FOLDER SAMPLE --save run.nc)"
        )
    own = [known_from(each.attrs) for each in (first, second)]
    unlike = [n for n in own[0] if n in own[1] and own[0][n].of != own[1][n].of]
    single = "sample" not in first.dims
    # Outputs of one name that mean two things cannot be compared: ``settings`` tells them.
    one, other = (_numbered(each.drop_vars(unlike, errors="ignore")) for each in (first, second))
    placed, planned = (placement(one), placement(other)), (one, other)
    notes = {side: losses(each).note for side, each in zip(SIDES, (one, other), strict=True)}
    ran = [int((endings(each) != NOT_RUN).sum()) for each in map(population_of, planned)]
    first_alone = np.zeros(1, dtype=np.int64)
    pairs = Pairs(first_alone, first_alone, "two runs")
    if not single:
        (one, other), pairs = samples_of(one, other)
    found = xr.Dataset(
        coords={"side": list(SIDES), "bound": ["lower", "upper"]},
        attrs={
            "first": str(one.attrs.get("title", "")), "second": str(other.attrs.get("title", "")),
            "first_name": names[0], "second_name": names[1],
            "pairing": pairs.told, "pairs": len(pairs.first), "runs": int(single),
            "first_samples": one.sizes["sample"], "second_samples": other.sizes["sample"],
            "first_ran": ran[0], "second_ran": ran[1],
            "first_planned": population_of(planned[0]).sizes["sample"],
            "second_planned": population_of(planned[1]).sizes["sample"],
            "joints": [int(np.prod([a.sizes.get(k, 0) for k in PLACE])) for a in (first, second)],
            "intervals": next(
                (p.told for p in placed if not single and (not p.has_intervals or p.block > 1)), ""
            ),
            "moved": "" if single else "\n".join(_moved((one, other), placed)),
            NOTE: "; ".join(f"{side}: {each}" for side, each in notes.items() if each),
        },
    )  # fmt: skip
    wanted, twins = [required_by(each.attrs) for each in (first, second)], intervals.Twins()
    for name in quantities():
        if name in one and name in other:
            found = found.assign(_output(name, (one, other), placed, pairs))
            if f"{name}_difference" in found:
                found[f"{name}_difference"].attrs[BADNESS] = badness_of(name, *wanted)
                twin = twins.of(
                    name, np.concatenate([numbers(each, name)[good(each)] for each in (one, other)])
                )
                if twin and not any(name in each for each in wanted):
                    found[f"{name}_difference"].attrs[intervals.TWIN] = twin
    for side, mine, its in zip(SIDES, (first, second), (second, first), strict=True):
        only = (name for name in quantities() if name in mine and name not in its)
        found.attrs[f"only_{side}"] = ", ".join(only)
    shares = differences_of_shares((one, other), placed, (pairs.first, pairs.second))
    more = _changed((one, other), pairs) | settings((one, other)) | _doubtful((one, other))
    more |= _limits((first, second) if single else (one, other))
    return found.assign(more).assign(shares)


def _doubtful(both: Both) -> dict[str, Any]:
    """Of each output of which a run says that it may be off, in how many samples of both."""
    reasons = [np.atleast_1d(one.get("reason", one.attrs.get("reason", ""))) for one in both]
    doubts = [[may_be_off(str(reason)) for reason in own] for own in reasons]
    counts = [Counter(name for names, _ in own for name in names) for own in doubts]
    causes = dict.fromkeys(cause for own in doubts for _, cures in own for cause in cures)
    words = about("samples whose run says that it may be off") | {"since": " or ".join(causes)}
    return {
        f"{name}_doubtful": ("side", np.array([each[name] for each in counts]), words)
        for name in dict.fromkeys([*counts[0], *counts[1]])
    }


def _limits(both: Both) -> dict[str, Any]:
    """The worst value of both sides and the margin of each to its own limit, for limits that both
    have, see ``worst.margins``; no variables without any.
    """
    known = margins_of(both)
    if not all("limit" in each.dims for each in known):
        return {}
    texts = [each["limit_text"].values.tolist() for each in known]
    paths = [[text.partition(" = ")[0] for text in own] for own in texts]
    shared = [path for path in paths[0] if path in paths[1]]
    places = [[own.index(path) for path in shared] for own in paths]
    one, other = (each.isel(limit=own) for each, own in zip(known, places, strict=True))
    words = []
    for first, second in zip(one["limit_text"].values, other["limit_text"].values, strict=True):
        words.append(first if first == second else f"{first} and {second.partition(' = ')[2]}")
    found: dict[str, Any] = {"limit": ("limit", np.array(words, dtype=object))}
    found["limit_output"] = "limit", one["limit_output"].values, one["limit_output"].attrs
    for name in ("limit_value", "limit_margin"):
        values = np.stack([one[name].values, other[name].values], axis=-1)
        found[name] = ("limit", "side"), values, one[name].attrs
    return found


def settings(both: Both) -> dict[str, Any]:
    """The values in which the scenes differ, as text by path: ``setting_first``, ``_second``.

    Fidelities are among them, and before them the distributions and requirements of campaigns.
    A value that one of them lacks is "none".  No values if a file does not hold its scene.
    """
    tables = [tomllib.loads(str(each.attrs.get("scene", ""))) for each in both]
    scenes = [flat(with_names(table)) for table in tables]
    if all(scenes):
        engines = [{"fidelity": str(each.attrs.get("fidelity", ""))} for each in both]
        scenes = [engine | scene for engine, scene in zip(engines, scenes, strict=True)]
    drawn = [by_path(each).keys() for each in both]
    paths = dict.fromkeys(path for scene in scenes for path in scene) if all(scenes) else {}
    apart = [
        path for path in paths
        if path not in ("name", "title") and scenes[0].get(path) != scenes[1].get(path)
        and path not in drawn[0] | drawn[1]  # then its samples have values of their own
        and [scene[path] for scene in scenes if path in scene] != [[]]  # all, by default
    ]  # fmt: skip
    asked = [_asked(each) for each in both]
    other = [
        name for name in dict.fromkeys([*asked[0], *asked[1]])
        if asked[0].get(name) != asked[1].get(name)
    ]  # fmt: skip
    found: dict[str, Any] = {"setting": ("setting", np.array(other + apart, dtype=object))}
    fixed = [{f"input {p}": f"{show(v)}, not drawn" for p, v in each.items()} for each in scenes]
    known = [given | own for own, given in zip(asked, fixed, strict=True)]
    words = [where_apart(*(each.get(name, "none") for each in known)) for name in other]
    for k, (side, scene) in enumerate(zip(SIDES, scenes, strict=True)):
        told = [each[k] for each in words]
        told += [show(scene[path], _LONGEST) if path in scene else "none" for path in apart]
        found[f"setting_{side}"] = "setting", *texts_about(told, f"value in the {side}")
    return found


def _asked(campaign: xr.Dataset) -> dict[str, str]:
    """Distributions, outputs by expressions and requirements of a campaign in words, by name."""
    whole = 10**6  # characters of a law: no less than all is compared
    drawn = (campaign[name] for name in inputs(campaign))
    laws = {f"input {called(each)}": law_text(distribution_of(each), whole) for each in drawn}
    for path, name in by_path(campaign).items():
        law, own = distribution_of(campaign[name]), called(campaign[name])
        if path != own:  # follows an input, or shares its values
            words = law_text(law, whole) if law.get("kind") == "function" else f"that of {own}"
            laws[f"input {path}"] = words
    wanted = required_by(campaign.attrs)
    laws |= {f"output {name}": each.of for name, each in known_from(campaign.attrs).items()}
    return laws | {
        f"requirement {name}": f"{each.told(name).removeprefix(name).strip()}, probability "
        f"{each.probability:g}, confidence {each.confidence:g}"
        for name, each in wanted.items()
    }


def _numbered(dataset: xr.Dataset) -> xr.Dataset:
    """A campaign as it is; a run as a campaign of one sample."""
    for name in ("status", OUTCOME):
        if name not in dataset:
            raise InputError(f"it has no {name}: give campaigns or runs of this version of ringsim")
    if "sample" in dataset.dims:
        return in_order(dataset)
    scalars = dataset[[name for name, v in dataset.variables.items() if not v.dims]]
    return scalars.expand_dims(sample=[0])


def samples_of(first: xr.Dataset, second: xr.Dataset) -> tuple[Both, Pairs]:
    """The samples of two campaigns that are compared, and how: those of pairs where there are any,
    else all; of either those that have run, if any has, and stand for the population.
    """
    ran = []
    for each in (population_of(first), population_of(second)):
        over = np.flatnonzero(endings(each) != NOT_RUN)
        ran.append(each.isel(sample=over) if len(over) else each)
    pairs = paired(ran[0], ran[1])
    if not len(pairs.first):
        if len(paired(first, second).first):
            pairs = replace(pairs, told="samples are not paired: of no pair both have run")
        return (ran[0], ran[1]), pairs
    order = np.sort(pairs.second)
    both = ran[0].isel(sample=pairs.first), ran[1].isel(sample=order)
    places = np.arange(len(order)), np.searchsorted(order, pairs.second)
    return both, Pairs(*places, pairs.told)


def paired(first: xr.Dataset, second: xr.Dataset) -> Pairs:
    """Pairs of samples with equal seeds in equal designs, else of samples with equal inputs.

    Equal seeds are draws at the same place of the unit cube, also where the distribution of an
    input is another; but only of one design, whose samples do not depend on results, and only if
    no other input of one has moved the places of those behind it.
    """
    known = [
        str(name) for name, v in first.data_vars.items()
        if v.attrs.get("role") == "input" and name in second and v.dims[0] == "sample"
        and not str(v.attrs.get("path", "")).startswith("solver.")
    ]  # fmt: skip
    inputs = [name for name in known if first[name].shape[1:] == second[name].shape[1:]]
    designs, seeds = (
        [(p.kind, p.replicates) for p in map(placement, (first, second))],
        "sample_seed",
    )
    grows, alike = subset_simulation(first.attrs) is not None, designs[0] == designs[1]
    unlike = (
        f", because neither their {'seeds' if alike else 'designs'} nor their inputs are equal; "
        "pairs show smaller differences: give both campaigns the same seed, design and number of "
        "samples"
    )
    if alike and not grows and seeds in first and seeds in second:
        keys = [list(each[seeds].to_numpy().tolist()) for each in (first, second)]
        if (found := _matched(*keys))[0].size:
            other, moved = _unlike((first, second), known, found)
            if not moved:
                told = f"; their inputs differ in {', '.join(other)}" * bool(other)
                return Pairs(*found, f"samples are paired by their seeds{told}")
            unlike = (
                ", although their seeds are equal: another input, its places, a correlation or the "
                f"number of samples has moved the draws of {', '.join(moved)}; pairs show smaller "
                "differences: in a random design give new inputs last, those with each_section too"
            )
    rows = [_rows(each, inputs) for each in (first, second)]
    if inputs and all(len(set(each)) == len(each) for each in rows):
        found = _matched(*rows)
        if found[0].size:
            return Pairs(*found, "samples are paired by their inputs")
    none = np.zeros(0, dtype=np.int64)
    return Pairs(none, none, f"samples are not paired{unlike}")


def _unlike(both: Both, known: list[str], pairs: Places) -> tuple[list[str], list[str]]:
    """Names of inputs whose values are unlike in pairs, and of those that should be alike."""
    other, moved = list[str](), list[str]()
    for one, two in ([each[name] for each in both] for name in known):
        name = called(one)
        if one.shape[1:] != two.shape[1:]:
            other.append(f"{name} ({one[0].size} and {two[0].size} places)")
            continue
        apart = one.to_numpy()[pairs[0]] != two.to_numpy()[pairs[1]]
        other += [name] * bool(apart.any())
        law = distribution_of(one)
        drawn = law.get("kind", "function") != "function" and law == distribution_of(two)
        # A place with a distribution of its own leaves the others as they are.
        moved += [name] * (drawn and bool(apart.any(axis=0).all()))
    return list(dict.fromkeys(other)), list(dict.fromkeys(moved))


def _rows(campaign: xr.Dataset, inputs: list[str]) -> list[Any]:
    columns = [
        campaign[name].to_numpy().reshape(campaign.sizes["sample"], -1).tolist() for name in inputs
    ]
    return [str(row) for row in zip(*columns, strict=True)]


def _matched(first: list[Any], second: list[Any]) -> tuple[Indices, Indices]:
    places = {key: k for k, key in enumerate(second)}
    found = [(k, places[key]) for k, key in enumerate(first) if key in places]
    both = np.array(found, dtype=np.int64).reshape(-1, 2)
    return both[:, 0], both[:, 1]


def _output(
    name: str, both: tuple[xr.Dataset, xr.Dataset], placed: tuple[Placement, Placement],
    pairs: Pairs,
) -> dict[str, Any]:  # fmt: skip
    """All variables about one output; none if it has no value to compare."""
    values = [np.where(good(each), numbers(each, name), np.nan) for each in both]
    index = [each["sample"].to_numpy() for each in both]
    largest, where, together = np.nan, -1, np.nan
    ends: tuple[Any, Any] = intervals.NONE
    certain = all(each.has_intervals for each in placed)
    if len(pairs.first):
        one, other = values[0][pairs.first], values[1][pairs.second]
        known = np.isfinite(one) & np.isfinite(other)
        used = [one[known], other[known]]
        apart = used[1] - used[0]
        if len(apart):
            worst = int(np.abs(apart).argmax())
            largest, where = apart[worst], int(index[0][pairs.first][known][worst])
        if len(apart) >= _LEAST_PAIRS and not any(
            intervals.hardly_apart(x.min(), x.max()) for x in used
        ):
            (together,) = correlations(centred_ranks(used[0][:, None]), used[1]).tolist()
        if certain:
            ends = placed[0].interval(apart, index[0][pairs.first][known], np.mean)
            ends = intervals.by_signs(ends, apart)
    else:
        there = [np.isfinite(each) for each in values]
        used = [each[k] for each, k in zip(values, there, strict=True)]
        if certain and all(map(len, used)):
            which = tuple(
                p.replicate_of(i[k]) for p, i, k in zip(placed, index, there, strict=True)
            )
            ends = intervals.of_difference(used[0], used[1], which)
    alone = False
    if not all(map(len, used)):  # one of them may have none, as of a ring that stays closed
        used = [each[np.isfinite(each)] for each in values]
        ends, alone = intervals.NONE, len(pairs.first) > 0 and all(map(len, used))
    if not any(map(len, used)):
        return {}
    means = np.array([each.mean() if len(each) else np.nan for each in used])
    if not has_means(both, placed, len(pairs.first)):
        means = means * np.nan
    rows: dict[str, tuple[Any, Any, str]] = {
        "mean": ("side", means, "mean of the samples compared"),
        # No pair has both values: those of one side are of other antennas than of the other.
        "difference": ((), np.nan if alone else means[1] - means[0], "second minus first"),
        "difference_interval": ("bound", np.array(ends), "interval of 95 % of the difference"),
        "samples": ("side", np.array([len(each) for each in used]), "samples compared"),
    }
    bars = np.array([_bar_of(each, name) for each in both])
    rows["numerical_error"] = "side", bars, "root mean square of the error bars"
    if len(pairs.first):
        rows["largest_difference"] = (), largest, "largest difference of a pair"
        rows["largest_difference_sample"] = (
            (), np.int64(where), "sample of the first with the largest difference",
        )  # fmt: skip
        rows["rank_correlation"] = (), together, "rank correlation of pairs"
        spreads = np.array([each.std() if len(each) else np.nan for each in used])
        rows["spread"] = "side", spreads, "standard deviation of the samples compared"
    meaning, units = both[0][name].attrs.get("long_name", name), quantities()[name].units
    found = {}
    for word, (dims, each, words) in rows.items():
        plain = np.asarray(each).dtype.kind != "f" or word == "rank_correlation"
        found[f"{name}_{word}"] = dims, each, about(f"{words}: {meaning}", "1" if plain else units)
    return found


def _bar_of(campaign: xr.Dataset, name: str) -> float:
    """Root mean square of the error bars of an output; NaN without any."""
    bars = numbers(campaign, f"{name}_error")[good(campaign)]
    known = bars[np.isfinite(bars)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan


def _changed(both: tuple[xr.Dataset, xr.Dataset], pairs: Pairs) -> dict[str, Any]:
    """The pairs in which the outcome is another one."""
    places = pairs.first, pairs.second
    one, other = (endings(each)[k] for each, k in zip(both, places, strict=True))
    changed, found = np.flatnonzero(one != other), dict[str, Any]()
    for side, dataset, place, words in zip(SIDES, both, places, (one, other), strict=True):
        found[f"changed_sample_{side}"] = (
            "change", dataset["sample"].to_numpy()[place[changed]],
            about(f"sample of the {side} whose outcome is another"),
        )  # fmt: skip
        ended = texts_about(words[changed].tolist(), f"how the sample of the {side} ended")
        found[f"changed_outcome_{side}"] = "change", *ended
    return found
