"""What is other in one campaign than in another, or in one run: paired where samples are."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis import intervals
from ringsim.analysis.blocks import population_of
from ringsim.analysis.campaign_samples import called
from ringsim.analysis.comparison_shares import differences_of_shares, ends, has_means
from ringsim.analysis.design import Placement, placement
from ringsim.analysis.intervals import NONE, Array
from ringsim.analysis.losses import NOTE, losses
from ringsim.analysis.quantities import good, numbers, quantities
from ringsim.analysis.requirements import OUTCOME
from ringsim.analysis.tails import subset_simulation
from ringsim.refusal import InputError

SIDES = ("first", "second")
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Pairs:
    """Which samples of two campaigns belong together."""

    first: Indices
    """Places in the first campaign, shape (pairs,)."""
    second: Indices
    told: str
    """By what they are paired, in words, or why there are none."""


def compare(first: xr.Dataset, second: xr.Dataset) -> xr.Dataset:
    """Differences of all outputs of two campaigns, or of two runs, second minus first.

    Returns for every output NAME that both have ``NAME_mean`` (side), ``NAME_difference``,
    ``NAME_difference_interval`` (bound), ``NAME_samples`` (side) in its unit, and for pairs
    ``NAME_largest_difference`` with ``NAME_largest_difference_sample``; the pairs whose outcome
    differs along ``change``; shares of outcomes along ``kind`` and of samples that keep to a
    requirement along ``requirement``, see ``differences_of_shares``.  Samples are those that
    ``analyse`` counts; means and shares are those of populations, and of pairs of grids and lists.
    ``pairing`` among the attributes says what is paired.  InputError if one holds a run and the
    other a campaign.
    """
    if ("sample" in first.dims) != ("sample" in second.dims):
        raise InputError(
            "one of them holds a run and the other a campaign: compare two of the same kind (one "
            "sample of a campaign as a run: ringsim replay FOLDER SAMPLE --save run.nc)"
        )
    single = "sample" not in first.dims
    one, other = (_numbered(each) for each in (first, second))
    placed = placement(one), placement(other)
    notes = {side: losses(each).note for side, each in zip(SIDES, (one, other), strict=True)}
    one, other = population_of(one), population_of(other)
    pairs = _alone() if single else paired(one, other)
    found = xr.Dataset(
        coords={"side": list(SIDES), "bound": ["lower", "upper"]},
        attrs={
            "first": str(one.attrs.get("title", "")), "second": str(other.attrs.get("title", "")),
            "pairing": pairs.told, "pairs": len(pairs.first),
            "intervals": next(
                (p.told for p in placed if not single and (not p.has_intervals or p.block > 1)), ""
            ),
            NOTE: "; ".join(f"{side}: {each}" for side, each in notes.items() if each),
        },
    )  # fmt: skip
    for name in quantities():
        if name in one and name in other:
            found = found.assign(_output(name, (one, other), placed, pairs))
    shares = differences_of_shares((one, other), placed, (pairs.first, pairs.second))
    return found.assign(_changed((one, other), pairs)).assign(shares)


def _numbered(dataset: xr.Dataset) -> xr.Dataset:
    """A campaign as it is; a run as a campaign of one sample."""
    for name in ("status", OUTCOME):
        if name not in dataset:
            raise InputError(
                f"it holds no {name}: give campaigns or runs that this version of ringsim has "
                "written"
            )
    if "sample" in dataset.dims:
        return dataset
    scalars = dataset[[name for name, v in dataset.variables.items() if not v.dims]]
    return scalars.expand_dims(sample=[0])


def _alone() -> Pairs:
    return Pairs(np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64), "two runs")


def paired(first: xr.Dataset, second: xr.Dataset) -> Pairs:
    """Pairs of samples with equal seeds in equal designs, else of samples with equal inputs.

    Equal seeds are draws at the same place of the unit cube, also where the distribution of an
    input is another; but only of one design, whose samples do not depend on results.
    """
    inputs = [
        str(name)
        for name, v in first.data_vars.items()
        if v.attrs.get("role") == "input" and name in second and v.dims[0] == "sample"
        and v.shape[1:] == second[name].shape[1:]
    ]  # fmt: skip
    designs = [(each.kind, each.replicates) for each in map(placement, (first, second))]
    seeds = "sample_seed"
    grows = subset_simulation(first) is not None
    if designs[0] == designs[1] and not grows and seeds in first and seeds in second:
        keys = [list(each[seeds].to_numpy().tolist()) for each in (first, second)]
        if (found := _matched(*keys))[0].size:
            other = [
                called(first[name]) for name in inputs
                if not np.array_equal(
                    first[name].to_numpy()[found[0]], second[name].to_numpy()[found[1]]
                )
            ]  # fmt: skip
            told = "samples are paired by their seeds"
            if other:
                told += f"; their inputs differ in {', '.join(dict.fromkeys(other))}"
            return Pairs(*found, told)
    rows = [_rows(each, inputs) for each in (first, second)]
    if inputs and all(len(set(each)) == len(each) for each in rows):
        found = _matched(*rows)
        if found[0].size:
            return Pairs(*found, "samples are paired by their inputs")
    none = np.zeros(0, dtype=np.int64)
    return Pairs(
        none, none,
        "samples are not paired, neither their seeds nor their inputs are equal: pairs would show "
        "smaller differences; give both campaigns one seed, design and number of samples",
    )  # fmt: skip


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
    largest, where = np.nan, -1
    ends: tuple[Any, Any] = NONE
    certain = all(each.has_intervals for each in placed)
    if len(pairs.first):
        one, other = values[0][pairs.first], values[1][pairs.second]
        known = np.isfinite(one) & np.isfinite(other)
        used = [one[known], other[known]]
        apart = used[1] - used[0]
        if len(apart):
            worst = int(np.abs(apart).argmax())
            largest, where = apart[worst], int(index[0][pairs.first][known][worst])
        if certain and len(apart) > 1:
            ends = _interval(apart, placed[0].replicate_of(index[0][pairs.first][known]))
    else:
        there = [np.isfinite(each) for each in values]
        used = [each[k] for each, k in zip(values, there, strict=True)]
        if certain and all(map(len, used)):
            which = tuple(
                p.replicate_of(i[k]) for p, i, k in zip(placed, index, there, strict=True)
            )
            ends = intervals.of_difference(used[0], used[1], which)
    if not all(map(len, used)):
        return {}
    about = both[0][name].attrs.get("long_name", name)
    units = {"units": quantities()[name].units}

    def told(words: str) -> dict[str, str]:
        return units | {"long_name": f"{words}: {about}"}

    means = np.array([each.mean() for each in used])
    if not has_means(both, placed, len(pairs.first)):
        means = means * np.nan
    found: dict[str, Any] = {
        f"{name}_mean": ("side", means, told("mean of the samples compared")),
        f"{name}_difference": ((), means[1] - means[0], told("second minus first")),
        f"{name}_difference_interval": (
            "bound", np.array(ends, dtype=float), told("interval of 95 % of the difference"),
        ),
        f"{name}_samples": (
            "side", np.array([len(each) for each in used], dtype="i8"),
            told("samples compared") | {"units": "1"},
        ),
    }  # fmt: skip
    if len(pairs.first):
        words = "largest difference of a pair"
        found[f"{name}_largest_difference"] = ((), largest, told(words))
        found[f"{name}_largest_difference_sample"] = (
            (), np.int64(where), told("sample of the first with the largest difference")
            | {"units": "1"},
        )  # fmt: skip
    return found


def _interval(apart: Array, replicate: Indices | None) -> tuple[Any, Any]:
    if replicate is None:
        return intervals.of_independent(apart, np.mean)
    return intervals.of_replicates(apart, replicate, np.mean)


def _changed(both: tuple[xr.Dataset, xr.Dataset], pairs: Pairs) -> dict[str, Any]:
    """The pairs in which the outcome is another one."""
    places = pairs.first, pairs.second
    one, other = (ends(each)[k] for each, k in zip(both, places, strict=True))
    changed, found = np.flatnonzero(one != other), dict[str, Any]()
    for side, dataset, place, words in zip(SIDES, both, places, (one, other), strict=True):
        found[f"changed_sample_{side}"] = (
            "change", dataset["sample"].to_numpy()[place[changed]],
            {"long_name": f"sample of the {side} whose outcome is another", "units": "1"},
        )  # fmt: skip
        found[f"changed_outcome_{side}"] = (
            "change", words[changed], {"long_name": f"how the sample of the {side} ended"},
        )  # fmt: skip
    return found
