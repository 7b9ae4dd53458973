"""How much of each output the inputs explain: by the indices that the design of a campaign allows;
and by how much violations would be rarer if an input scattered less.

Failures are outputs of their own, 0 or 1.  No index of an output is given where its missing values
depend on inputs: what is left would be another population.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis import indices
from ringsim.analysis.campaign_notes import marked
from ringsim.analysis.design import (
    Blocks,
    Placement,
    blocks_of,
    called,
    correlated,
    distribution_of,
    drawn,
    inputs,
    place_called,
    population_of,
)
from ringsim.analysis.indices import UNLIKELY, chance_of_each, dependence
from ringsim.analysis.influence import groups_of
from ringsim.analysis.intervals import (
    LEVEL,
    Interval,
    Mask,
    good,
    is_moment,
    jackknife_error,
    lost,
    numbers,
    quantities,
    ran,
    share_bounds,
    varies,
)
from ringsim.analysis.requirements import Requirement, violations, without_twins
from ringsim.analysis.reweighting import (
    LEAST_OF_SHARE,
    LEAST_REPLICATES,
    SOBOL,
    Replicate,
    decisive_of_share,
    has_share_intervals,
    log_ratio,
    read_distributions,
)
from ringsim.refusal import InputError
from ringsim.sampling.distributions import Discrete, Distribution, Truncated, Uniform, label_of
from ringsim.stepping.instant import Array
from ringsim.tables import (
    Table,
    chance_text,
    counted,
    digits_of,
    fine_text,
    interval_text,
    number_text,
    with_unit,
)
from ringsim.variables import about, texts_about

_LEAST_OF_A_KIND = 10
"""Samples that failed, and that did not, below which failure is no output to analyse."""
_LEAST_BLOCKS = 8
_LEAST_FOR_FIRST = 100
"""Samples A and B of either kind below which first-order indices of failures have no intervals: of
20 their intervals held the truth in 60 to 78 of 100 campaigns, of 45 in 90 to 95, of 180 in 94 to
97.
"""
Found = dict[str, tuple[tuple[str, ...], Array]]
"""Values of variables, and their intervals ("..._interval"), with their dimensions."""
ABOUT = {
    "first_order_index":
        "share of the variance that the group alone explains (first-order Sobol' index)",
    "total_index":
        "share of the variance that the group explains with all its interactions (total index)",
    "second_order_index": "share of the variance that the interaction of two groups explains",
    "mean_absolute_effect": "mean absolute change of the output when the group moves (mu*)",
    "mean_effect": "mean change of the output when the group moves upwards (mu)",
    "effect_deviation": "standard deviation of the change when the group moves upwards (sigma)",
    "given_data_index":
        "share of the variance that the input alone explains, from independent samples",
    "chance_level":
        "largest index of all inputs that chance alone would reach for one output in 20",
}  # fmt: skip


def responses(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement]
) -> dict[str, tuple[Array, str]]:
    """Outputs that vary beyond numerical errors, with units; failures and violations, 0 or 1."""
    ok, found = good(campaign), dict[str, tuple[Array, str]]()
    # Of blocks the samples whose variance the indices share out.
    population = population_of(campaign)
    stand = np.isin(campaign["sample"].to_numpy(), population["sample"].to_numpy())
    for name in without_twins(campaign, quantities(), requirements):
        if varies(population, name):
            values = numbers(campaign, name)
            values = np.where(ok & np.isfinite(values), values, np.nan)
            found[name] = values, quantities()[name].units
    for name, (own, of) in groups_of(campaign, requirements).items():
        own_drawn, of_drawn = own[stand], of[stand]
        if min(own_drawn.sum(), (of_drawn & ~own_drawn).sum()) >= _LEAST_OF_A_KIND:
            found[name] = np.where(of, own.astype(float), np.nan), "1"
    return found


def sensitivity(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement,
    names: Collection[str] | None = None,
) -> xr.Dataset:  # fmt: skip
    """Indices of all ``responses``, along ``output``; empty where the design allows none.

    Designs of kind saltelli have ``first_order_index`` and ``total_index`` (and
    ``second_order_index``) along ``factor``, those of kind morris ``mean_absolute_effect``,
    ``mean_effect`` and ``effect_deviation``, plain ones ``given_data_index`` and ``chance_level``
    along ``input``; each with its ``..._interval``.  ``index_used`` and ``index_lost`` count blocks
    or samples, ``missing`` the samples without the output, ``missing_lost`` those of failed runs
    among them, and ``missing_by_inputs`` is the probability that samples missing at random would
    go with inputs as much: below 0.05 there is no index.  What has not run yet is none of them.
    ``names`` are the outputs to tell of beside failures, by default all.
    """
    blocks, inputs = blocks_of(campaign), drawn(campaign)
    outputs = {
        name: each
        for name, each in responses(campaign, requirements).items()
        if names is None or name in names or name not in quantities()
    }
    plain = placed.population and placed.block == 1
    if not outputs or not inputs.names or (blocks is None and not plain):
        return xr.Dataset()
    size = 1 if blocks is None else blocks.size
    # Blocks count, or samples, all of which have run.
    held = np.flatnonzero(ran(campaign).reshape(-1, size).all(axis=1))
    here = (held[:, None] * size + np.arange(size)).ravel()
    index, columns = campaign["sample"].to_numpy()[here], inputs.values[here]
    count, block = len(here), None if blocks is None else np.repeat(np.arange(len(held)), size)
    tested: dict[bytes, tuple[float, list[str]]] = {}
    found: dict[str, Found] = {}
    counts, gone = np.zeros((len(outputs), 4), dtype=np.int64), lost(campaign)[here]
    chance = np.full(len(outputs), np.nan)
    for k, (name, (every, _)) in enumerate(outputs.items()):
        values = every[here]
        missing = np.isnan(values)
        whole = np.asarray(~missing.reshape(-1, size).any(axis=1))
        # Outputs that lack the same samples share the test, and the bins.
        if (key := missing.tobytes()) not in tested:
            tested[key] = dependence(missing, columns, block), []
        chance[k], alike = tested[key]
        counts[k] = whole.sum(), len(whole) - whole.sum(), missing.sum(), (missing & gone).sum()
        if chance[k] < UNLIKELY:
            continue
        if blocks is None:
            if whole.sum() >= indices.LEAST_SAMPLES:
                alike.append(name)
        elif whole.sum() >= _LEAST_BLOCKS:
            number = held[whole]
            kept = Blocks(blocks.rows[number])
            rows = values.reshape(-1, size)[whole]
            found[name] = (
                _sobol(rows, blocks, number % placed.replicates, binary=name not in quantities())
                if blocks.of_indices
                else _effects(rows, kept, blocks)
            )
    for alike in (each for _, each in tested.values() if each):
        rows = np.array([outputs[name][0][here] for name in alike])
        whole = ~np.isnan(rows[0])
        told = _given(columns[whole], rows[:, whole], index[whole], placed)
        found |= dict(zip(alike, told, strict=True))
    coords = {"input": inputs.names} if blocks is None else {"factor": blocks.groups}
    made = _dataset(outputs, found, coords, block is not None)
    of = "samples" if block is None else "blocks"
    for k, (name, words) in enumerate({
        "index_used": f"{of} used for the indices",
        "index_lost": f"{of} left out because a sample has no value",
        "missing": f"samples of {count} completed ones without a value",
        "missing_lost": "of these, samples whose run failed",
    }.items()):  # fmt: skip
        made[name] = "output", counts[:, k], about(words)
    words = "probability that samples missing at random would depend as much on the inputs"
    made["missing_by_inputs"] = "output", chance, about(words)
    return made


def _sobol(values: Array, blocks: Blocks, replicate: NDArray[np.int64], *, binary: bool) -> Found:
    """Indices of the groups of blocks; ``binary`` outputs are 0 or 1."""
    groups = len(blocks.groups)
    middle, ends = indices.indices_with_intervals(values, groups, replicate)
    told = np.column_stack([middle, ends])
    hits = values[:, [0, -1]]
    if binary and min((hits == 0).sum(), (hits == 1).sum()) < _LEAST_FOR_FIRST:
        told[:groups, 1:] = told[2 * groups :, 1:] = np.nan
    found: Found = {
        "first_order_index": (("factor",), told[:groups]),
        "total_index": (("factor",), told[groups : 2 * groups]),
    }
    if len(told) > 2 * groups:
        matrix = np.full((groups, groups, 3), np.nan)
        for (j, k), each in zip(indices.pairs(groups), told[2 * groups :], strict=True):
            matrix[j, k] = matrix[k, j] = each
        found["second_order_index"] = (("factor", "other_factor"), matrix)
    return found


def _effects(values: Array, kept: Blocks, blocks: Blocks) -> Found:
    joint = np.array([f"moved: {group}" in blocks.rows[0] for group in blocks.groups])
    told = indices.measured(indices.effects(values, kept, blocks.groups), joint)
    return {name: (("factor",), each) for name, each in zip(indices.MEASURES, told, strict=True)}


def _given(
    columns: Array, values: Array, index: NDArray[np.int64], placed: Placement
) -> Iterator[Found]:
    """Indices of all columns, shape (samples, columns), for each of the outputs, shape (outputs,
    samples); intervals of designs whose parts are independent.

    Of Sobol' designs there are none: their points are so evenly spread that the residuals of bins
    do not scatter as the correction for chance takes it.
    """
    replicate = placed.replicate_of(index)
    part = index % indices.JACKKNIFE_PARTS if replicate is None else replicate
    part = np.unique(part, return_inverse=True)[1]
    certain = placed.has_intervals and placed.kind != "sobol" and part.max() > 0
    bins = [indices.Bins(column) for column in columns.T]
    told = np.full((len(values), len(bins), 3), np.nan)
    for k, each in enumerate(bins):
        told[:, k, 0], left_out = indices.index(each, values, part)
        if certain:
            told[:, k, 1:] = np.stack(indices.interval(told[:, k, 0], left_out), axis=-1)
    for one, level in zip(told, indices.chance_levels(bins, values), strict=True):
        chance = np.full((len(bins), 1), level)
        yield {"given_data_index": (("input",), one), "chance_level": (("input",), chance)}


def _dataset(
    outputs: Mapping[str, Any], found: Mapping[str, Found], coords: Mapping[str, Any],
    in_blocks: bool,
) -> xr.Dataset:  # fmt: skip
    """All values side by side, along ``output``; NaN where there are none."""
    made = xr.Dataset(
        coords={"output": np.array([*outputs], dtype=object), "bound": ["lower", "upper"]}
        | {name: np.array(each, dtype=object) for name, each in coords.items()}
    )
    units = [unit for _, unit in outputs.values()]
    made["output_units"] = "output", *texts_about(units, "unit of the output and of the effects")
    first: Found = next(iter(found.values()), {})
    for name, (dims, shape) in first.items():
        values = np.full((len(outputs), *shape.shape), np.nan)
        for k, output in enumerate(outputs):
            if output in found:
                values[k] = found[output][name][1]
        made[name] = ("output", *dims), values[..., 0]
        made[name].attrs = {"long_name": ABOUT[name]}
        if values.shape[-1] > 1:
            made[f"{name}_interval"] = ("output", *dims, "bound"), values[..., 1:]
            made[f"{name}_interval"].attrs = {"long_name": f"95 % interval of: {ABOUT[name]}"}
    if "second_order_index" in made and in_blocks:
        made = made.assign_coords(other_factor=np.array(coords["factor"], dtype=object))
    return made


# What became of outputs that samples lack, in words.


_TELLING = 5
"""Samples without a value from which on it is said that they depend on no input: four lie in the
same half of an input by chance once in 8, five once in 16."""
_NAMED = 5
"""Outputs that a line names at most."""


def refusals(analysis: xr.Dataset, *, every: bool = False) -> list[Table]:
    """What became of outputs that samples lack, as notes; of when peaks were only if ``every`` one
    is told.
    """
    lines = list(_gate(analysis, every=every))
    return [Table((), (), lines)] if lines else []


def _gate(analysis: xr.Dataset, *, every: bool) -> Iterator[str]:
    """What became of outputs that samples lack: why there is no index, or why there is one."""
    if "missing_by_inputs" not in analysis:
        return
    outputs: dict[tuple[int, int, float], list[str]] = {}
    blocks = ", with the rest of their blocks," if "factor" in analysis.dims else ""
    needed = ("output", "missing", "missing_lost", "missing_by_inputs")
    columns = (analysis[name].values.tolist() for name in needed)
    for output, count, failed, chance in zip(*columns, strict=True):
        if count and (every or not is_moment(output)):
            outputs.setdefault((count, failed, round(chance, 4)), []).append(output)
    for (count, failed, chance), names in outputs.items():
        who = ", ".join(names[:_NAMED]) + (
            f" and {len(names) - _NAMED} more" * (len(names) > _NAMED)
        )
        p = chance_text(chance)
        if chance < UNLIKELY:
            cures = ["set a requirement on the outcome instead"] * (failed < count)
            if failed:  # what did not fail has no value because of what the antenna did
                cures.append(
                    f"run the {failed} failed ones again (ringsim campaign --retry-failed)"
                )
            yield (
                f"no sensitivity index for {who}: whether a sample has a value depends on the "
                f"inputs ({counted(count, 'sample')} without, {p}), so the rest is not "
                f"representative: {', '.join(cures)}, or narrow the inputs"
            )
        else:
            why = f"this does not seem to depend on any input ({p})"
            if count < _TELLING:
                why = "too few to tell whether that depends on an input"
            yield f"{who}: {counted(count, 'sample')} without a value{blocks} left out; {why}"


# What would make violations rarer: their probability if one input had another distribution, by the
# weights of the same samples.
#
# P is the probability of a violation as drawn, w the ratio of the new to the old density.  What is
# told is the ratio E[w; violated] / P = E[w | violated], which the samples that violate tell by
# themselves, however uncertain P is.


STEP = 0.1
"""Part by which a standard deviation, a range or a probability is made smaller, and by which a mean
is moved, in standard deviations."""
_MOST_CHANGES = 5
"""Changes that are told for each requirement."""


class Change(NamedTuple):
    """An input with another distribution."""

    input: str
    """Its name in the campaign file."""
    of: str
    """What of its distribution is another."""
    values: str
    """That as drawn, and as it would be, with unit."""
    variable: str
    """The dataset's name of it."""
    laws: tuple[Distribution, Distribution]
    """As drawn, and as it would be; the same at all places of an input that has many."""


def changes(campaign: xr.Dataset, step: float = STEP) -> tuple[list[Change], dict[str, list[str]]]:
    """The distribution of each input with one parameter changed by ``step``, and what samples do
    not tell, by the reason.
    """
    tied = correlated(campaign)
    found, left = list[Change](), dict[str, list[str]]()
    for variable in (campaign[name] for name in inputs(campaign)):
        name, units = called(variable), str(variable.attrs.get("units", "1"))
        if variable.attrs.get("path") == "solver.error_bars":
            continue
        try:
            law = read_distributions({name: distribution_of(variable)})[name]
        except InputError:
            left.setdefault("listed in a file", []).append(name)
            continue
        if variable.dtype.kind not in "iuf" and not isinstance(law, Discrete):
            continue  # words have no density
        if name in tied:
            left.setdefault("correlated with another input", []).append(name)
            continue
        places, count = "", len(found)
        if variable.ndim > 1:
            places = f" at all {variable.shape[1]} {place_called(variable)}s"
        for of, before, after, other in _moved(law, step):
            digits = max(digits_of(*sorted(pair)) for pair in zip(before, after, strict=True))
            unit = "1" if isinstance(law, Discrete) else units
            told = (" .. ".join(with_unit(fine_text(value, digits), unit) for value in values)
                    for values in (before, after))  # fmt: skip
            both, own = (law, other), str(variable.name)
            found.append(Change(name, of + places, " -> ".join(told), own, both))
        if isinstance(law, Uniform):
            left.setdefault("means of uniform inputs: no samples beyond bounds", []).append(name)
        elif len(found) == count:
            left.setdefault("without a mean and a standard deviation of its own", []).append(name)
    return found, left


def _moved(
    law: Distribution, step: float
) -> Iterator[tuple[str, Sequence[float], Sequence[float], Distribution]]:
    """What of a distribution is changed, its values before and after, and the other one."""
    if isinstance(law, Discrete):
        shares = np.array(law.shares)
        # Of two values that of the rarer one tells both.
        for k in [int(shares.argmin())] if len(shares) == 2 else range(len(shares)):
            less = (1.0 - step) * shares[k]
            new = shares * (1.0 - less) / max(1.0 - shares[k], 1e-300)
            new[k] = less
            other = law.model_copy(update={"probabilities": tuple(new.tolist())})
            yield f"probability of {label_of(law.values[k])}", [shares[k]], [less], other
    elif isinstance(law, Uniform):
        cut = 0.5 * step * (law.high - law.low)
        ends = {"low": law.low + cut, "high": law.high - cut}
        yield "range", [law.low, law.high], [*ends.values()], law.model_copy(update=ends)
    else:
        own: Any = law.of if isinstance(law, Truncated) else law
        if not {"mean", "standard_deviation"} <= type(own).model_fields.keys():
            return
        far = step * own.standard_deviation
        for key, by in ("standard_deviation", -far), ("mean", -far), ("mean", far):
            old = getattr(own, key)
            try:
                other = type(own).model_validate(own.model_dump() | {key: old + by})
            except ValueError:  # as a mean of a lognormal one below zero
                continue
            of = key.replace("_", " ") + " before the bounds" * (own is not law)
            whole = other if own is law else law.model_copy(update={"of": other})
            yield of, [old], [old + by], whole


def ratio_of(
    own: Mask, weights: Array, replicate: Replicate, errors: Sequence[float], *, sobol: bool = False
) -> tuple[float, list[Interval]]:
    """By what the probability of what happened to ``own`` samples is multiplied with weights, shape
    (samples,), and for each of ``errors`` an interval that misses it with that probability.

    By Student's t with Hall's correction for skewness, of the linearised variance of independent
    samples, or of the jackknife over replicates (of Sobol' points of the larger one); of weights
    that take two values the exact one of the share of either among ``own``.
    Sources: Owen, Monte Carlo theory, methods and examples (2013), section 9.2; Hall, J. Royal
    Statistical Society B 54 (1992) 221.
    """
    scaled, count = weights / weights.mean(), len(own)
    found, two = float(scaled[own].mean()), np.unique(weights.round(9))
    if len(two) == 2:
        # Undivided: their mean over all samples is uncertain, what it is of is 1.
        (low, high), found = two, float(weights[own].mean())
        upper = int(np.sum(weights[own] > two.mean()))
        shares = [share_bounds(upper, int(own.sum()), 1.0 - each / 2) for each in errors]
        return found, [(low + (high - low) * a, low + (high - low) * b) for a, b in shares]
    free = float(min(own.sum(), count - own.sum()) - 1)
    apart = own * (scaled - found) / own.mean() - found * (scaled - 1.0)
    error = float(np.sqrt(np.mean(apart**2) / (count - 1)))
    bend = float(np.mean(apart**3) / np.mean(apart**2) ** 1.5 / np.sqrt(count))
    if replicate is not None:
        part = np.unique(replicate, return_inverse=True)[1]
        of_own, count_own, of_all, count_all = (
            row.sum() - np.bincount(part, row)
            for row in (weights * own, 1.0 * own, weights, np.ones(count))
        )
        left = of_own / np.maximum(count_own, 1.0) * count_all / of_all
        left = np.where(count_own > 0, left, np.nan)  # where one replicate has all of them
        # Of Sobol' points the jackknife alone held the truth in as few as 87 of 100 campaigns.
        error, free = float(np.maximum(error * sobol, jackknife_error(left))), len(left) - 1.0

    far = scipy.special.stdtrit(free, 1.0 - np.array(errors) / 2) * np.array([[1.0], [-1.0]])
    if bend:  # where Student's t without skewness becomes one with it
        far = 3.0 / bend * (np.cbrt(1.0 + bend * (far - bend / 6.0)) - 1.0)
    low, high = found - error * far
    return found, list(zip(np.maximum(0.0, low).tolist(), high.tolist(), strict=True))


def enough_weight(own: Mask, weights: Array) -> bool:
    """Whether weights tell a change of ``own`` samples: below that 95 % held in 9 of 14 cases."""
    fewest = float(min(own.sum(), len(own) - own.sum()))
    values = len(np.unique(weights.round(9)))  # 1, that of all, if no sample has a word
    if fewest < LEAST_OF_SHARE or values < 2:
        return False
    return values == 2 or decisive_of_share(own, weights) >= min(25.0, 0.7 * fewest)


def rarer(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement,
    step: float = STEP,
) -> xr.Dataset:  # fmt: skip
    """By what the probability of violating each requirement is multiplied if one input has another
    distribution: ``change_ratio`` along ``requirement`` and ``change``, its ``_interval``, and
    ``change_listed`` where chance among all changes does not explain it; ``change_input``,
    ``change_of`` and ``change_values`` say what is changed, and ``change_untold`` what is not told.

    Only samples whose numbers hold count.  NaN below 10 samples that violate or that do not, and
    where few of them have most of the weight.  Empty without a requirement, and where the design
    stands for no population.
    """
    if not requirements or not placed.population:
        return xr.Dataset()
    if has_share_intervals(placed):
        found, left = changes(campaign, step)
    else:
        least = LEAST_REPLICATES if placed.kind in SOBOL else 8
        found, left = [], {f"needs design.replicates = {least}": ["any input"]}
    if not found and not left:  # nothing was drawn
        return xr.Dataset()
    held = good(campaign)
    replicate = placed.replicate_of(campaign["sample"].to_numpy()[held])
    told = np.full((len(requirements), len(found), 3), np.nan)
    listed = np.zeros(told.shape[:2], dtype="i1")
    # Of both sides to which a mean may move at most one is told.
    chance = chance_of_each(max(1, len({each[:2] for each in found})))
    normal = -float(scipy.special.ndtri(chance / 2))
    broken = [violations(campaign, *each)[held] for each in requirements.items()]
    for n, each in enumerate(found):
        logarithm = log_ratio(*each.laws, campaign[each.variable].to_numpy()[held])
        weights = np.exp(np.minimum(logarithm, 700.0))
        for k, own in enumerate(broken):
            if not enough_weight(own, weights):
                continue
            levels, sobol = [1.0 - LEVEL, chance], placed.kind in SOBOL
            ratio, (ends, wide) = ratio_of(own, weights, replicate, levels, sobol=sobol)
            told[k, n] = ratio, *ends
            # The scatter among all samples, since few violations may be alike by chance; of the
            # logarithm, which has the shorter tails.
            apart = logarithm if np.isfinite(logarithm).all() else weights
            most = normal * float(apart.std()) * (1.0 / own.sum() - 1.0 / len(own)) ** 0.5
            far = abs(float(apart[own].mean() - apart.mean())) > most
            listed[k, n] = far and (wide[0] > 1.0 or wide[1] < 1.0)
    words = "factor of the probability of violating the requirement if an input has another one"
    why = "; ".join(f"{', '.join(names)} ({each})" for each, names in left.items())
    untold = np.array(why, dtype=object)  # so that files take it as text
    says = "input whose distribution is another", "what of it", "as drawn, and as it would be"
    texts = {
        f"change_{Change._fields[k]}": ("change", *texts_about([e[k] for e in found], says[k]))
        for k in range(3)
    }
    dims, bars = ("requirement", "change"), about(f"95 % interval of the {words}")
    return xr.Dataset(
        texts | {
            "change_ratio": (dims, told[..., 0], about(words)),
            "change_ratio_interval": ((*dims, "bound"), told[..., 1:], bars),
            "change_listed": (dims, listed, about("whether chance does not explain it")),
            "change_untold": ((), untold, {"long_name": "what is not tried, and why"}),
        },
        coords={"requirement": np.array([*requirements], dtype=object)},
    )  # fmt: skip


def rarer_table(analysis: xr.Dataset) -> Table:
    """What would make violations of requirements rarer, or more frequent, the largest change first;
    in notes requirements of which nothing is told.
    """
    if "change_ratio" not in analysis:
        return Table((), ())
    rows, quiet, few, more, unequal = (list[Any]() for _ in range(5))
    names = [analysis[f"change_{word}"].values.tolist() for word in ("input", "of", "values")]
    which = [*zip(*names, strict=True)]
    for name in analysis["requirement"].values.tolist():
        one = analysis.sel(requirement=name)
        bad, used = int(one["samples_violating"]), int(one["samples_used"])
        if min(bad, used - bad) < LEAST_OF_SHARE:
            few += [f"{name} ({bad} of {used} violate it)"] * bool(bad)
            continue
        ratio, ends = one["change_ratio"].values, one["change_ratio_interval"].values
        # Of both sides to which a mean may move that with fewer violations.
        best = dict[tuple[str, str], int]()
        for k in np.argsort(ratio).tolist():
            best.setdefault(which[k][:2], k)
        kept = [k for k in best.values() if one["change_listed"].values[k]]
        kept.sort(key=lambda k: -abs(ratio[k] - 1.0))
        missing = {which[k][:2] for k in np.flatnonzero(np.isnan(ratio))}
        quiet += [name] * (not kept and not 0 < np.isnan(ratio).sum() == len(ratio))
        unequal += [f"{name} ({len(missing)} of {len(best)} changes)"] * bool(missing)
        if len(kept) > _MOST_CHANGES:
            more.append(f"{name} {len(kept) - _MOST_CHANGES}")
        for n, k in enumerate(kept[:_MOST_CHANGES]):
            first = f"violates {one['requirement_text'].item()} ({bad} of {used})" * (n == 0)
            change, low, high = 100.0 * (np.array([ratio[k], *ends[k]]) - 1.0)
            rows.append((
                first, *which[k],
                f"{number_text(bad / used, 3)} -> {number_text(bad / used * ratio[k], 3)}",
                f"{change:+.2g} %", f"{interval_text(low, high, 3)} %",
            ))  # fmt: skip
    notes = list[str]()
    if rows:
        count = len({each[:2] for each in which})
        notes.append(
            "estimated from the same samples (weights, as with --reweight), one distribution at a "
            f"time: standard deviation, range or probability {100 * STEP:g} % smaller, or mean "
            f"moved by {100 * STEP:g} % of the standard deviation to the side with fewer "
            "violations; the interval is that of the change, not of the probability as drawn; of "
            f"{count} changes each, chance alone would list fewer than one requirement in 20"
        )
    notes += [f"further significant changes: {', '.join(more)}"] * bool(more)
    if quiet and which:
        what = f"if an input scattered {100 * STEP:g} % less, no significant change of the chance"
        notes.append(f"{what} of violating {', '.join(quiet)} (by weights of these samples)")
    why = "changes that these samples cannot tell, since few would have most of the weight"
    notes += [f"{why}: {', '.join(unequal)}"] * bool(unequal)
    needs = f"{LEAST_OF_SHARE:g} that violate and as many that do not are needed"
    why = f"too few samples to tell what would make violations rarer ({needs})"
    notes += [f"{why}: {', '.join(few)}"] * bool(few)
    untold = analysis["change_untold"].item()
    notes += [f"changes that were not tried: {untold}"] * bool(untold and (rows or quiet))
    head = ("what changes a probability", "input", "its", "from -> to", "probability", "change",
            "95 % interval")  # fmt: skip
    return marked(Table(head, rows, notes, left=3), analysis, 1)
