"""What matters: which inputs go with an output, and which separate failures from successes.

The idea of ranking inputs by how they separate failures is that of NASA's Monte Carlo tool, NTRS
20130001901.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import expit, logit

from ringsim.analysis import ranks
from ringsim.analysis.confounded import confounded
from ringsim.analysis.design import Placement
from ringsim.analysis.drawn import Drawn, drawn
from ringsim.analysis.intervals import Array
from ringsim.analysis.quantities import Mask, good, lost, numbers, quantities
from ringsim.analysis.requirements import OUTCOME, Requirement
from ringsim.analysis.tails import subset_simulation
from ringsim.analysis.verdicts import violations
from ringsim.variables import GOALS, Fate

LEAST = 8
"""Samples below which there is no correlation to speak of."""
_LEAST_GROUP = 3
"""Samples of a group, and of the rest, below which nothing separates them."""
_LEVELS = ("place", "quarter", "mean")
"""How an input of many places is represented; the last one decides about the other inputs."""


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
    if not inputs.names or subset_simulation(campaign) is not None:
        return xr.Dataset()
    found: dict[str, Any] = {}
    index, ok = campaign["sample"].to_numpy(), good(campaign)
    columns, last = ranks.Columns(inputs.values), np.ones(len(ok), dtype=bool)
    for name in quantities():
        if name not in campaign:
            continue
        values = numbers(campaign, name)
        known = ok & np.isfinite(values)
        if known.sum() < LEAST or np.ptp(values[known]) == 0:
            continue
        if not np.array_equal(known, last):  # most outputs lack the same samples
            columns, last = ranks.Columns(inputs.values[known]), known
        replicate = placed.replicate_of(index[known])
        plain, partial = _correlated(columns, values[known], inputs, placed, replicate)
        for word, (middle, ends) in {"": plain, "partial_": partial}.items():
            about = f"{word.replace('_', ' ')}rank correlation with {name}"
            found |= _told(f"{name}_{word}rank_correlation", middle, ends, about, ("input",))
    groups = groups_of(campaign, requirements)
    if groups:
        pairs = [_separated(inputs, own, of, index, placed) for own, of in groups.values()]
        middle, ends = (np.array([pair[k] for pair in pairs]) for k in (0, 1))
        about = "probability that the input is larger in the group than in the rest"
        found |= _told("separation", middle, ends, about, ("group", "input"))
        found["group_samples"] = (
            "group", np.array([own.sum() for own, _ in groups.values()], dtype="i8"),
            {"long_name": "samples of the group", "units": "1"},
        )  # fmt: skip
    if not found:
        return xr.Dataset()
    found["input_is_place"] = (
        "input", np.isin(inputs.level, ["place", "quarter"]),
        {"long_name": "whether it is of one place, or a quarter, of many", "units": "1"},
    )  # fmt: skip
    found["inputs_held"] = (
        "input", _held(np.array(inputs.level)),
        {"long_name": "other inputs that its partial correlations hold", "units": "1"},
    )  # fmt: skip
    found |= confounded(inputs, ok)
    coords: dict[str, Any] = {"input": np.array(inputs.names, dtype=object)}
    if groups:
        coords["group"] = np.array([*groups], dtype=object)
    return xr.Dataset(found, coords=coords)


def _told(
    name: str, middle: Array, ends: Array, about: str, dims: tuple[str, ...]
) -> dict[str, Any]:
    return {
        name: (dims, middle, {"long_name": about, "units": "1"}),
        f"{name}_interval": (
            (*dims, "bound"), ends, {"long_name": f"interval of 95 % of: {about}", "units": "1"},
        ),
    }  # fmt: skip


def _correlated(
    columns: ranks.Columns, output: Array, inputs: Drawn, placed: Placement,
    replicate: NDArray[np.int64] | None,
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:  # fmt: skip
    """Plain and partial rank correlations, shape (input,), with intervals, shape (input, 2)."""
    level = np.array(inputs.level)
    own = level == "input"

    def plain(rows: Any) -> Array:
        return ranks.correlations(columns.ranks(rows), output[rows])

    def partial(rows: Any) -> Array:
        found, x = np.full(len(level), np.nan), columns.ranks(rows)
        for each in (each for each in _LEVELS if (level == each).any() or each == "mean"):
            held = own | (level == each)
            found[held] = ranks.partial_correlations(x[:, held], output[rows])
        return found

    every, held = np.ones(len(output), dtype=bool), _held(level)
    results = []
    for measure, others in ((plain, 0), (partial, held)):
        middle, ends = measure(every), np.full((len(level), 2), np.nan)
        if placed.has_intervals and replicate is None:
            for count in np.unique(others):
                some = np.broadcast_to(others == count, level.shape)
                both = ranks.correlation_interval(middle[some], len(output), int(count))
                ends[some] = np.stack(both, axis=1)
        elif placed.has_intervals and replicate is not None:
            both = ranks.replicate_interval(measure, replicate, ranks.to_normal, np.tanh)
            ends = np.stack(both, axis=1)
        results.append((middle, ends))
    return results[0], results[1]


def _held(level: NDArray[np.str_]) -> NDArray[np.int64]:
    """How many other inputs the partial correlation of each one holds, shape (input,)."""
    found, own = np.zeros(len(level), dtype=np.int64), level == "input"
    for each in _LEVELS:
        found[own | (level == each)] = (own | (level == each)).sum() - 1
    return found


def groups_of(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement]
) -> dict[str, tuple[Mask, Mask]]:
    """Samples to be told from the rest, and of which samples they are; only those of some size.

    What the same samples are has one name, parted by semicolons.
    """
    ok, gone = good(campaign), lost(campaign)
    found = {"lost": (gone, ok | gone)}
    for fate in Fate:
        if fate not in GOALS and fate != Fate.NONE and OUTCOME in campaign:
            found[fate.word.replace("_", " ")] = (ok & (campaign[OUTCOME].to_numpy() == fate), ok)
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
    middle, replicate = ranks.areas(columns, group), placed.replicate_of(index[of])
    if not placed.has_intervals:
        return middle, np.full((len(middle), 2), np.nan)
    if replicate is None:
        inside = int(group.sum())
        return middle, np.stack(ranks.area_interval(middle, inside, len(group) - inside), axis=1)

    def measure(rows: Mask) -> Array:
        some = group[rows]
        if some.all() or not some.any():
            return np.full(len(middle), np.nan)
        found = ranks.areas(columns[rows], some)
        return np.where((found > 0) & (found < 1), found, np.nan)

    return middle, np.stack(ranks.replicate_interval(measure, replicate, logit, expit), axis=1)
