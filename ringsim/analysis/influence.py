"""What matters: which inputs go with an output, and which separate failures from successes."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis import indices
from ringsim.analysis.design import (
    DIFFERENCE,
    FAILED_RUNS,
    Drawn,
    Placement,
    campaign_file,
    drawn,
    endings,
    learnt_lines,
    short_of_goal,
)
from ringsim.analysis.indices import centred_ranks, chance_of_each, largest_by_chance
from ringsim.analysis.intervals import Mask, good, lost, numbers, quantities, used, varies
from ringsim.analysis.requirements import Requirement, violations, without_twins
from ringsim.analysis.tails import subset_simulation
from ringsim.refusal import InputError
from ringsim.stepping.instant import Array
from ringsim.tables import counted
from ringsim.variables import about, texts_about

# Pairs of inputs that go together, so that the effect of one may be taken for the other's.


_NAMED = 3
"""Pairs that a note names at most."""


class Pair(NamedTuple):
    """Two columns of which one tells something about the other."""

    first: int
    second: int
    correlation: float
    """Their rank correlation."""
    share: float
    """Given-data index of the ranks of one by the other, the larger one; NaN of few samples."""

    @property
    def strength(self) -> float:
        """Share of the variance of one that goes with the other, about."""
        return float(np.fmax(self.correlation**2, self.share))


def pairs(columns: Array, which: NDArray[np.bool_]) -> list[Pair]:
    """Pairs of columns, shape (samples, columns), that go together more than the largest pair does
    by chance in one case of 20, the strongest first: by rank correlation, or by given-data index,
    since points of few samples in many dimensions may lie on lines that are not straight.

    ``which``, shape (columns, columns), tells which pairs count.
    """
    samples, wide = columns.shape
    which = np.triu(which | which.T, 1)
    if samples < 3 or not which.any():
        return []
    # Three tests of each: the correlation, and the index in both directions.
    among = 3 * int(which.sum())
    ranks = centred_ranks(columns)
    scale = np.sqrt((ranks**2).sum(axis=0))
    ranks /= np.where(scale > 0, scale, 1.0)
    matrix = ranks.T @ ranks
    beyond = np.abs(matrix) > largest_by_chance(samples, np.zeros(()), among)
    share = np.full((wide, wide), np.nan)
    if samples >= indices.LEAST_SAMPLES:
        chance = chance_of_each(among)
        for k, column in enumerate(columns.T):
            bins = indices.Bins(column)
            share[k] = indices.given_data_indices(bins, ranks)
            beyond[k] |= share[k] > indices.level_of_normal(bins, chance)
        share = np.fmax(share, share.T)
    first, second = np.nonzero(which & (beyond | beyond.T))
    found = [
        Pair(int(j), int(k), float(matrix[j, k]), float(share[j, k]))
        for j, k in zip(first, second, strict=True)
    ]
    return sorted(found, key=lambda pair: -pair.strength)


def _apart(inputs: Drawn) -> NDArray[np.bool_]:
    """Which pairs of inputs nothing but the design makes correlate, shape (input, input): not a
    mean with its own places, nor words of one input.
    """
    own, place = np.array(inputs.input), np.array(inputs.level) == "place"
    return np.asarray((own[:, None] != own) | (place[:, None] & place))


def confounded(inputs: Drawn, used: NDArray[np.bool_], cure: str) -> dict[str, Any]:
    """Variables along ``pair``: the names of both inputs and their correlation, with its ``cure``;
    none without a pair.  ``used``, shape (samples,), are the samples that count.
    """
    found = pairs(inputs.values[used], _apart(inputs))
    if not found:
        return {}
    names = inputs.names
    columns: dict[str, tuple[Any, dict[str, Any]]] = {
        "first": texts_about((names[each.first] for each in found), "first input of the pair"),
        "second": texts_about((names[each.second] for each in found), "second input of the pair"),
        "correlation": (
            [each.correlation for each in found],
            about("rank correlation of the two inputs") | {"cure": cure},
        ),
        "share": (
            [each.share for each in found],
            about("share of the variance of one of them, in ranks, that the other explains"),
        ),
    }  # fmt: skip
    return {f"pair_{name}": ("pair", *each) for name, each in columns.items()}


def _cure(campaign: xr.Dataset, placed: Placement) -> str:
    """What parts inputs that go together in the samples, if anything does."""
    if campaign_file(campaign).get("correlations") or learnt_lines(campaign):
        return "they are drawn so (correlations, or a test), and more samples would not part them"
    return "draw more samples" + ', or use design.kind = "random"' * (not placed.independent)


def partners(analysis: xr.Dataset) -> dict[str, set[str]]:
    """Of every input that goes with others in the samples, their names."""
    found: dict[str, set[str]] = {}
    for first, second, *_ in _pairs_in(analysis):
        found.setdefault(first, set()).add(second)
        found.setdefault(second, set()).add(first)
    return found


def confounding_notes(analysis: xr.Dataset, told: Collection[str]) -> list[str]:
    """Which inputs among those that are told go with others, and what that means."""
    found = [
        each for each in _pairs_in(analysis)
        if not {*each[:2]}.isdisjoint(told)
        # It goes with its own parts whatever the design is.
        and not any(name.startswith(DIFFERENCE) for name in each[:2])
    ]  # fmt: skip
    if not found:
        return []
    shares = [f"{share:.0%}, " * bool(np.isfinite(share)) for *_, share in found]
    named = ", ".join(
        f"{first} with {second} ({share}r = {correlation:+.2f})"
        for (first, second, correlation, _), share in zip(found[:_NAMED], shares, strict=False)
    )
    of = "share of the variance of one that the other explains, rank correlation"
    more = f" and {counted(len(found) - _NAMED, 'other pair')}" * (len(found) > _NAMED)
    return [
        "these inputs are correlated in the samples, more than by chance "
        f"({of if any(shares) else 'rank correlation'}): {named}{more}, so that the effect of one "
        f"may be taken for that of the other: {analysis['pair_correlation'].attrs['cure']}"
    ]


def _pairs_in(analysis: xr.Dataset) -> list[tuple[str, str, float, float]]:
    if "pair" not in analysis.dims:
        return []
    names = ("pair_first", "pair_second", "pair_correlation", "pair_share")
    columns = [analysis[name].values.tolist() for name in names]
    return list(zip(*columns, strict=True))


# What matters: which inputs go with an output, and which separate failures from successes.
#
# The idea of ranking inputs by how they separate failures is that of NASA's Monte Carlo tool, NTRS
# 20130001901.


LEAST = 8
"""Samples below which there is no correlation to speak of."""
_LEAST_GROUP = 3
"""Samples of a group, and of the rest, below which nothing separates them."""
_LEVELS = ("difference", "place", "quarter", "mean")
"""How an input of many places, or of both planes, is represented; the last one decides about the
other inputs."""


def influence(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement
) -> xr.Dataset:
    """Rank measures of all drawn inputs, along ``input``; without variables if none was drawn, and
    of subset simulation: samples of a chain repeat each other, and each level is beyond a threshold
    of its own.

    For every output NAME ``NAME_rank_correlation`` and ``NAME_partial_rank_correlation``; along
    ``group`` the ``separation`` of samples that were lost, ended in another way than planned, or
    violate a requirement: the probability that the input is larger there.  Intervals as for other
    statistics.  Pairs of inputs that go together beyond chance are along ``pair``.  In partial
    correlations an input of many places is represented by its mean, for its quarters by the means
    of these, and for its places by these.
    """
    inputs = drawn(campaign)
    if not inputs.names or subset_simulation(campaign.attrs) is not None:
        return xr.Dataset()
    found: dict[str, Any] = {}
    index, ok = campaign["sample"].to_numpy(), good(campaign)
    columns, last = indices.Columns(inputs.values), np.ones(len(ok), dtype=bool)
    for name in without_twins(campaign, quantities(), requirements):
        values = numbers(campaign, name)
        known = ok & np.isfinite(values)
        if known.sum() < LEAST or not varies(campaign, name):
            continue
        if not np.array_equal(known, last):  # most outputs lack the same samples
            columns, last = indices.Columns(inputs.values[known]), known
        replicate = placed.replicate_of(index[known])
        plain, partial = _correlated(columns, values[known], inputs, placed, replicate)
        for word, (middle, ends) in {"": plain, "partial_": partial}.items():
            words = f"{word.replace('_', ' ')}rank correlation with {name}"
            found |= _told(f"{name}_{word}rank_correlation", middle, ends, words, ("input",))
    groups = groups_of(campaign, requirements)
    if groups:
        each = groups.values()
        pairs = [_separated(inputs, own, of, index, placed) for own, of in each]
        found["separation_chance"] = (
            ("group", "input"),
            np.array([indices.area_chances(inputs.values[of], own[of]) for own, of in each]),
            about("probability of such a separation if the group was drawn by lot"),
        )
        middle, ends = (np.array([pair[k] for pair in pairs]) for k in (0, 1))
        words = (
            "probability that the input is larger in a sample of the group than in another sample"
        )
        found |= _told("separation", middle, ends, words, ("group", "input"))
        counts = np.array([own.sum() for own, _ in groups.values()], dtype="i8")
        found["group_samples"] = "group", counts, about("number of samples in the group")
    if not found:
        return xr.Dataset()
    found["input_is_place"] = (
        "input", np.isin(inputs.level, ["place", "quarter"]),
        about("whether the input belongs to one section (pulley, ...) or to a quarter of them"),
    )  # fmt: skip
    found["inputs_held"] = (
        "input", _held(np.array(inputs.level)),
        about("number of other inputs whose effect the partial correlation removes"),
    )  # fmt: skip
    found["input_of"] = "input", *texts_about(inputs.input, "drawn input that it belongs to")
    found["input_span"] = (
        ("input", "bound"), np.array(inputs.span, dtype="i8"),
        about("first of its sections (pulleys, ...), and the one after the last"),
    )  # fmt: skip
    found |= confounded(inputs, ok, _cure(campaign, placed))
    coords: dict[str, Any] = {"input": np.array(inputs.names, dtype=object)}
    if groups:
        coords["group"] = np.array([*groups], dtype=object)
    return xr.Dataset(found, coords=coords)


def apart(
    analysis: xr.Dataset, output: str, names: list[str], places: Mapping[str, tuple[str, int, int]]
) -> list[str]:
    """Of columns, the strongest first, those that share no place with a stronger one, in their
    order.

    Which of two that share places is the stronger their plain rank correlations say, where there
    are such: a partial one holds other columns for a mean than for its places.
    """
    variable = f"{output}_rank_correlation"
    ordered = names
    if variable in analysis:
        plain = analysis[variable].fillna(0.0).to_series().abs()
        ordered = sorted(names, key=lambda name: -plain.get(name, 0.0))
    kept = strongest(ordered, places)
    return [name for name in names if name in kept]


def strongest(names: Sequence[str], places: Mapping[str, tuple[str, int, int]]) -> list[str]:
    """Of columns, the strongest first, those that share no place with a stronger one.

    ``places`` are the input of each, its first place and the one behind its last.

    >>> places = {"mean": ("cable", 0, 8), "5 to 8": ("cable", 4, 8), "1": ("cable", 0, 1)}
    >>> strongest(["5 to 8", "mean", "1"], places)
    ['5 to 8', '1']
    """
    kept, taken = list[str](), dict[str, list[tuple[int, int]]]()
    for name in names:
        own, low, high = places.get(name, (name, 0, 0))
        others = taken.setdefault(own, [])
        if not any(max(low, first) < min(high, end) for first, end in others):
            kept.append(name)
            others.append((low, high))
    return kept


def separating(analysis: xr.Dataset) -> Iterator[tuple[str, list[int]]]:
    """The groups of ``influence`` with the inputs that separate each beyond chance, the best first;
    of inputs that share places only the best.
    """
    if "group" not in analysis.dims:
        return
    level = chance_of_each(analysis.sizes["input"])
    places, names = places_in(analysis), analysis["input"].values.astype(str)
    for group in analysis["group"].values:
        one = analysis.sel(group=group)
        middle, ends = one["separation"].values - 0.5, one["separation_interval"].values - 0.5
        order = np.argsort(-np.abs(np.nan_to_num(middle)), kind="stable")
        rare = one["separation_chance"].values < level
        order = order[(rare & beyond(middle, ends, 0.0))[order]]
        kept = strongest(names[order].tolist(), places)
        yield str(group), [int(k) for k in order if names[k] in kept]


RANKS = {"partial_": "partial rank correlation", "": "rank correlation"}
"""How names of rank correlations begin, and what these are."""


def standing_out(analysis: xr.Dataset, output: str, samples: int) -> tuple[Array, Mask]:
    """Rank correlations of all inputs, partial where there are such, and which of them stand out
    of what the largest reaches by chance in so many samples; shape (input,) both.
    """
    (values, ends), (plain, plain_ends) = (
        (analysis.variables[name].values, analysis.variables[f"{name}_interval"].values)
        for name in (f"{output}_{word}rank_correlation" for word in RANKS)
    )
    partial = np.isfinite(values)
    values, ends = np.where(partial, values, plain), np.where(partial[:, None], ends, plain_ends)
    held = np.where(partial, analysis["inputs_held"].values, 0)
    chance = largest_by_chance(samples, held, len(values))
    return values, beyond(values, ends, chance)


def beyond(values: Array, ends: Array, chance: Array | float) -> Mask:
    """Which values are larger than the largest of all by chance, and if they have intervals leave
    out zero by these, too.
    """
    clear = (ends[:, 0] > 0.0) | (ends[:, 1] < 0.0)
    return np.asarray((np.abs(values) > chance) & (clear | ~np.isfinite(ends).all(axis=1)))


def places_in(analysis: xr.Dataset) -> dict[str, tuple[str, int, int]]:
    """Of each input whose it is, its first place and the one behind its last."""
    if "input_of" not in analysis:
        return {}
    names = ("input", "input_of", "input_span")
    columns = (analysis.variables[name].values.tolist() for name in names)
    return {name: (own, *span) for name, own, span in zip(*columns, strict=True)}


def _told(
    name: str, middle: Array, ends: Array, words: str, dims: tuple[str, ...]
) -> dict[str, Any]:
    return {
        name: (dims, middle, about(words)),
        f"{name}_interval": ((*dims, "bound"), ends, about(f"95 % interval of: {words}")),
    }


def _correlated(
    columns: indices.Columns, output: Array, inputs: Drawn, placed: Placement,
    replicate: NDArray[np.int64] | None,
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:  # fmt: skip
    """Plain and partial rank correlations, shape (input,), with intervals, shape (input, 2)."""
    level = np.array(inputs.level)

    def plain(rows: Any) -> Array:
        return indices.correlations(columns.ranks(rows), output[rows])

    def partial(rows: Any) -> Array:
        found, x = np.full(len(level), np.nan), columns.ranks(rows)
        for each in (each for each in _LEVELS if (level == each).any() or each == "mean"):
            held = _together(level, each)
            found[held] = indices.partial_correlations(x[:, held], output[rows])
        return found

    every, held = np.ones(len(output), dtype=bool), _held(level)
    results = []
    for measure, others in ((plain, 0), (partial, held)):
        middle, ends = measure(every), np.full((len(level), 2), np.nan)
        if placed.has_intervals and replicate is None:
            for count in np.unique(others):
                some = np.broadcast_to(others == count, level.shape)
                both = indices.correlation_interval(middle[some], len(output), int(count))
                ends[some] = np.stack(both, axis=1)
        elif placed.has_intervals and replicate is not None:
            both = indices.replicate_interval(
                measure, replicate, indices.to_normal, np.tanh, doubt=True
            )
            ends = np.stack(both, axis=1)
        results.append((middle, ends))
    return results[0], results[1]


def _held(level: NDArray[np.str_]) -> NDArray[np.int64]:
    """How many other inputs the partial correlation of each one holds, shape (input,)."""
    found = np.zeros(len(level), dtype=np.int64)
    for each in _LEVELS:
        held = _together(level, each)
        found[held] = held.sum() - 1
    return found


def _together(level: NDArray[np.str_], each: str) -> Mask:
    """The columns of which a partial correlation takes one and holds the others: of one level, and
    inputs of one place.  Differences are beside the means of their parts, but these without them,
    which are half of their own effect.
    """
    beside = ("input", each, "mean") if each == "difference" else ("input", each)
    return np.isin(level, beside)


def groups_of(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement]
) -> dict[str, tuple[Mask, Mask]]:
    """Samples to be told from the rest, and of which samples they are; only those of some size.

    What the same samples are has one name, parted by semicolons.
    """
    ok, gone = good(campaign), lost(campaign)
    found = {FAILED_RUNS: (gone, ok | gone)}
    words = endings(campaign)
    found |= {word: (words == word, ok) for word in short_of_goal(words)}
    for name, wanted in requirements.items():
        found[f"violates {wanted.told(name)}"] = (violations(campaign, name, wanted), ok)
    alike: dict[bytes, list[str]] = {}
    for word, (own, of) in found.items():
        if min(own.sum(), of.sum() - own.sum()) >= _LEAST_GROUP:
            alike.setdefault(own.tobytes() + of.tobytes(), []).append(word)
    return {"; ".join(words): found[words[0]] for words in alike.values()}


def _separated(
    inputs: Drawn, own: Mask, of: Mask, index: NDArray[np.int64], placed: Placement
) -> tuple[Array, Array]:
    """Areas of a group, shape (input,), and their intervals, shape (input, 2)."""
    columns, group = inputs.values[of], own[of]
    middle, replicate = indices.areas(columns, group), placed.replicate_of(index[of])
    if not placed.has_intervals:
        return middle, np.full((len(middle), 2), np.nan)
    if replicate is None:
        inside = int(group.sum())
        return middle, np.stack(indices.area_interval(middle, inside, len(group) - inside), axis=1)

    def measure(rows: Mask) -> Array:
        some = group[rows]
        if some.all() or not some.any():
            return np.full(len(middle), np.nan)
        found = indices.areas(columns[rows], some)
        return np.where((found > 0) & (found < 1), found, np.nan)

    return middle, np.stack(
        indices.replicate_interval(
            measure, replicate, scipy.special.logit, scipy.special.expit, doubt=True
        ),
        axis=1,
    )


# Which V-joint is ahead of all others, and which is behind.


_WHO = {"leader": "leads", "laggard": "lags"}


def over_time(run: xr.Dataset) -> xr.Dataset:
    """The most and the least open joint of a run over time, in words, and their distance.

    Among joints that are equally open the first one stands; empty and NaN where nothing was
    recorded.
    """
    if "opening_angle" not in run:
        raise InputError("leader: needs opening_angle, which this dataset does not have")
    angles = run["opening_angle"].transpose("time", "plane", "section")
    rows = angles.to_numpy().reshape(angles.sizes["time"], -1)
    names = np.array(
        [f"{p} {s}" for p in run["plane"].to_numpy() for s in run["section"].to_numpy()]
    )
    known = np.isfinite(rows).all(axis=1)
    filled = np.where(known[:, None], rows, 0.0)
    joints = {
        "leader": (filled.argmax(axis=1), "most open V-joint"),
        "laggard": (filled.argmin(axis=1), "least open V-joint"),
    }
    found = xr.Dataset(coords={"time": run["time"]})
    for name, (joint, words) in joints.items():
        found[name] = "time", np.where(known, names[joint], ""), {"long_name": words}
    apart = np.where(known, np.ptp(filled, axis=1), np.nan)
    says = about("difference of their opening angles", angles.attrs.get("units", ""))
    return found.assign(asynchrony=("time", apart, says))


def often(campaign: xr.Dataset) -> xr.Dataset:
    """In how many samples each joint leads and lags at the largest asynchrony, (plane, section).

    ``samples`` among the attributes are those that tell: their numbers hold, and their joints have
    been apart.
    """
    needed = [f"asynchrony_{who}_{dim}" for who in _WHO for dim in ("plane", "section")]
    if absent := [name for name in (*needed, "plane", "section") if name not in campaign]:
        raise InputError(
            f"leader: needs {absent[0]}, which this campaign has not recorded, or which its "
            "fidelity does not compute"
        )
    good = used(campaign)
    planes, sections = (campaign[dim].to_numpy().tolist() for dim in ("plane", "section"))
    found = xr.Dataset(coords={"plane": campaign["plane"], "section": campaign["section"]})
    told = np.asarray(good[needed[0]].to_numpy() != "", dtype=bool)
    for who, word in _WHO.items():
        counts = np.zeros((len(planes), len(sections)), dtype="i8")
        rows = good[f"asynchrony_{who}_plane"].to_numpy()[told]
        columns = good[f"asynchrony_{who}_section"].to_numpy()[told]
        np.add.at(
            counts, ([planes.index(p) for p in rows], [sections.index(int(s)) for s in columns]), 1
        )
        says = about(f"samples in which the V-joint {word} most")
        found[word] = ("plane", "section"), counts, says
    found.attrs = {"samples": int(told.sum()), "of": campaign.sizes["sample"]}
    return found
