"""How much of each output the inputs explain: by the indices that the design of a campaign allows.

Failures are outputs of their own, 0 or 1.  No index of an output is given where its missing values
depend on inputs: what is left would be another population.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis import indices
from ringsim.analysis.design import Blocks, Placement, blocks_of, drawn, population_of
from ringsim.analysis.indices import UNLIKELY, dependence
from ringsim.analysis.influence import groups_of
from ringsim.analysis.intervals import good, is_moment, lost, numbers, quantities, ran, varies
from ringsim.analysis.requirements import Requirement
from ringsim.stepping.instant import Array
from ringsim.tables import Table, chance_text, counted
from ringsim.variables import about

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
    """Outputs that vary beyond their numerical error, NaN where missing, with units; then failures
    and violations, 0 or 1.
    """
    ok, found = good(campaign), dict[str, tuple[Array, str]]()
    # Of blocks the samples whose variance the indices share out.
    population = population_of(campaign)
    stand = np.isin(campaign["sample"].to_numpy(), population["sample"].to_numpy())
    for name, variable in quantities().items():
        if varies(population, name):
            values = numbers(campaign, name)
            found[name] = np.where(ok & np.isfinite(values), values, np.nan), variable.units
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
    part = index % indices.PARTS if replicate is None else replicate
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
    made["output_units"] = "output", np.array([u for _, u in outputs.values()], dtype=object)
    made["output_units"].attrs = {"long_name": "unit of the output and of the effects"}
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
