"""What shares of two campaigns ended how, and kept to what is required: their differences."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis import intervals
from ringsim.analysis.binomial import difference_of_pairs, difference_of_shares
from ringsim.analysis.campaign_samples import requirements_of
from ringsim.analysis.design import Placement
from ringsim.analysis.intervals import NONE
from ringsim.analysis.quantities import Mask, good, lost
from ringsim.analysis.requirements import OUTCOME, Requirement, read_requirements
from ringsim.analysis.tails import subset_simulation
from ringsim.analysis.verdicts import require_values, violations
from ringsim.refusal import InputError
from ringsim.variables import Fate, Status

Both = tuple[xr.Dataset, xr.Dataset]
Placements = tuple[Placement, Placement]
Indices = NDArray[np.int64]
Places = tuple[Indices, Indices]
"""Places of the samples of both that are pairs, shape (pairs,) each; empty without pairs."""
_FEW = 10
"""Samples of a kind, or pairs that differ, below which Student's t does not fit."""


class Event(NamedTuple):
    """Which samples of each campaign it happened to, and of which."""

    own: tuple[Mask, Mask]
    of: tuple[Mask, Mask]


def differences_of_shares(both: Both, placed: Placements, pairs: Places) -> dict[str, Any]:
    """Variables on outcomes along ``kind`` and on requirements of both along ``requirement``.

    For either, with ``kind_`` or ``kept_``: ``samples`` (side), ``share`` (side) of those compared,
    ``compared`` (side), ``share_difference``, second minus first, and its ``_interval`` (bound).
    """
    words = (ends(both[0]), ends(both[1]))
    held = good(both[0]), good(both[1])
    ran = held[0] | lost(both[0]), held[1] | lost(both[1])
    kinds = {
        kind: Event(
            (words[0] == kind, words[1] == kind), ran if kind.startswith("lost: ") else held
        )
        for kind in sorted({*words[0].tolist(), *words[1].tolist()})
    }
    found = {"kind": ("kind", np.array([*kinds], dtype=object), {"long_name": "how it ended"})}
    found |= _told("kind", "kind", kinds, placed, both, pairs)
    if kept := _kept(both, held):
        texts = np.array([*kept], dtype=object)
        found["requirement"] = "requirement", texts, {"long_name": "requirement of both"}
        found |= _told("kept", "requirement", kept, placed, both, pairs)
    return found


def has_means(both: Both, placed: Placements, pairs: int) -> bool:
    """Whether means and shares are told: of populations, and of pairs of grids and lists; not of
    subset simulation, whose levels are neither.
    """
    if any(subset_simulation(each) is not None for each in both):
        return False
    return pairs > 0 or all(each.population for each in placed)


def ends(campaign: xr.Dataset) -> NDArray[Any]:
    """How each sample ended, in a word, shape (sample,)."""
    fates, status = campaign[OUTCOME].to_numpy(), campaign["status"].to_numpy()
    words = [
        Fate(max(int(fate), 0)).word.replace("none", "unknown") if code == Status.OK
        else "not run" if code < 0 else f"lost: {Status(int(code)).word}"
        for fate, code in zip(fates, status, strict=True)
    ]  # fmt: skip
    return np.array(words, dtype=object)


def _kept(both: Both, held: tuple[Mask, Mask]) -> dict[str, Event]:
    """The requirements that both campaigns have, with equal limits, and can be judged by."""
    one, other = (read_requirements(requirements_of(each), "requirements") for each in both)
    found = {}
    for name, wanted in one.items():
        if name not in other or wanted.told(name) != other[name].told(name):
            continue
        try:
            first, second = (_keeping(each, name, wanted) for each in both)
        except InputError:  # the file of one does not tell it
            continue
        found[wanted.told(name)] = Event((first, second), held)
    return found


def _keeping(campaign: xr.Dataset, name: str, wanted: Requirement) -> Mask:
    require_values(campaign, name)
    return good(campaign) & ~violations(campaign, name, wanted)


def _told(
    word: str, dim: str, events: Mapping[str, Event], placed: Placements, both: Both, pairs: Places
) -> dict[str, Any]:
    counts = np.array([[int(own.sum()) for own in event.own] for event in events.values()])
    rows = [_compared(event, placed, both, pairs) for event in events.values()]
    numbers = np.array(rows).reshape(len(rows), 7)
    apart = "difference of the shares, second minus first"
    return {
        f"{word}_samples": (
            (dim, "side"), counts.reshape(-1, 2), {"long_name": "samples of all", "units": "1"},
        ),
        f"{word}_compared": (
            (dim, "side"), numbers[:, :2].astype("i8"),
            {"long_name": "samples compared, of which the shares are", "units": "1"},
        ),
        f"{word}_share": ((dim, "side"), numbers[:, 2:4], {"long_name": "share", "units": "1"}),
        f"{word}_share_difference": (dim, numbers[:, 4], {"long_name": apart, "units": "1"}),
        f"{word}_share_difference_interval": (
            (dim, "bound"), numbers[:, 5:],
            {"long_name": f"interval of 95 % of the {apart}", "units": "1"},
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
    bounds = NONE
    if all(each.has_intervals for each in placed):
        index = [each["sample"].to_numpy()[k] for each, k in zip(both, places, strict=True)]
        replicates = [p.replicate_of(i) for p, i in zip(placed, index, strict=True)]
        compare = _paired if len(pairs[0]) else _independent
        bounds = compare(first, second, replicates)
    return (*counts, *shares, shares[1] - shares[0], *bounds)


def _paired(first: Any, second: Any, replicates: list[Any]) -> intervals.Interval:
    only = int((first > second).sum()), int((second > first).sum())
    if replicates[0] is None or sum(only) < _FEW:
        together = int((first * second).sum())
        return difference_of_pairs(together, *only, len(first) - together - sum(only))
    low, high = intervals.of_replicates(second - first, replicates[0], np.mean)
    return max(-1.0, float(low)), min(1.0, float(high))


def _independent(first: Any, second: Any, replicates: list[Any]) -> intervals.Interval:
    counts = [(int(each.sum()), len(each)) for each in (first, second)]
    few = any(min(own, of - own) < _FEW for own, of in counts)
    if few or all(each is None for each in replicates):
        return difference_of_shares(counts[0], counts[1])
    low, high = intervals.of_difference(first, second, tuple(replicates))
    return max(-1.0, float(low)), min(1.0, float(high))
