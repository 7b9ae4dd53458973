"""How probable a rare event is, by a campaign of subset simulation."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from ringsim.analysis.intervals import (
    CHECKED,
    LEVEL,
    good,
    lost,
    share_bounds,
    share_interval,
    student,
)
from ringsim.sampling.designs.levels import Repetition, SubsetSimulation
from ringsim.stepping.instant import Array
from ringsim.tables import Table, bound_text, chance_text, with_unit
from ringsim.variables import Status, about

if TYPE_CHECKING:
    import xarray as xr

DISAGREE = 0.01
"""Probability below which replicates scatter by more than their chains explain."""


def subset_simulation(attributes: Mapping[Any, Any]) -> SubsetSimulation | None:
    """The design that a campaign keeps if it is subset simulation, else None."""
    table = json.loads(attributes.get("design", "{}"))
    if table.get("kind") != "subset-simulation":
        return None
    return SubsetSimulation.model_validate(table)


def _as_grown(campaign: xr.Dataset) -> xr.Dataset:
    """The samples in the order in which they were drawn, up to the first that is left out: which
    ones come after it follows from its response.
    """
    campaign = campaign.sortby("sample")
    there = campaign["sample"].to_numpy() == np.arange(campaign.sizes["sample"])
    return campaign.isel(sample=slice(int(np.cumprod(there).sum())))


def _responses(campaign: xr.Dataset, design: SubsetSimulation) -> Array:
    values = campaign[design.of].to_numpy().astype(float)
    return design.responses(values, ~good(campaign))


def approach(campaign: xr.Dataset) -> list[tuple[Array, Array]]:
    """Of each replicate the values of the output that its levels reached, the event's last, with
    the probability to be beyond each; what has no probability yet is left out.
    """
    if (design := subset_simulation(campaign.attrs)) is None:
        return []
    found = []
    for one in design.levels(_responses(_as_grown(campaign), design)).repetitions:
        places, shares = [*one.thresholds], [*one.shares]
        if one.probability > 0.0:
            places, shares = [*places, design.target], [*shares, one.probability]
        # Runs without a value are beyond all: a threshold among them has no place on an axis.
        known = np.isfinite(places)
        found.append((design.sign * np.array(places)[known], np.array(shares)[known]))
    return found


def agreement(each: Array, chains: Array) -> float:
    """Probability that replicates scatter as much as these if their errors were those of their
    chains; NaN of a single one, and if any did not come to the event.

    Where the event has parts that only some replicates found, it is small: chains in one part tell
    nothing of the others.  Variance of normal logarithms: chi-squared.
    """
    square = float(np.mean(chains**2))
    if len(each) < 2 or not (each > 0.0).all() or not 0.0 < square < np.inf:
        return np.nan
    free = len(each) - 1
    return float(scipy.special.chdtrc(free, free * np.log(each).var(ddof=1) / square))


def replicated_interval(each: Array, chains: Array, most: float = 1.0) -> tuple[Array, float]:
    """Interval of the probability that replicates ``each`` estimate, and the mean's coefficient of
    variation by their scatter (NaN for a single one); ``chains`` are their own coefficients.

    A replicate is a product of many shares: its logarithm is nearly normal, and lies below that of
    the probability by half its variance on average, since its mean is exact.  That variance is
    taken from the chains, which know it better than a few replicates do; the width comes from the
    replicates' scatter, but is not less than that from their chains: few may agree by chance.

    Where they disagree beyond that, their logarithms are of different things.  Then the lower end
    is what a mean of positive numbers that is exact on average exceeds that often (Markov), and the
    upper end is ``most``, a bound from samples that no chain has led.
    """
    count, middle = len(each), float(each.mean())
    if not (each > 0.0).all():
        return np.full(2, np.nan), np.nan
    logs, square = np.log(each), float(np.mean(chains**2))
    if agreement(each, chains) < DISAGREE:
        variation = float(each.std(ddof=1) / middle / count**0.5)
        return np.array([(1 - LEVEL) / 2 * middle, max(most, middle)]), variation
    variation, half = np.nan, float(scipy.special.ndtri(0.5 + LEVEL / 2)) * (square / count) ** 0.5
    if count > 1:
        variation = float(each.std(ddof=1) / middle / count**0.5)
        half = max(half, student(count) * float(logs.std(ddof=1)) / count**0.5)
    ends = np.exp(logs.mean() + square / 2 + np.array([-half, half]))
    # Their mean may be outside still, and two replicates that agree little reach beyond all.
    return np.array([min(ends[0], middle), min(max(ends[1], middle), 1.0)]), variation


def tail(campaign: xr.Dataset) -> dict[str, Any]:
    """Variables ``tail_...`` of a campaign of subset simulation; none of other campaigns."""
    if (design := subset_simulation(campaign.attrs)) is None:
        return {}
    campaign, given = _as_grown(campaign), campaign.sizes["sample"]
    known = _responses(campaign, design)
    found = design.levels(known)
    each = np.array([one.probability for one in found.repetitions])
    chains = np.array([one.variation for one in found.repetitions])
    unled = bound_of_first_levels(found.repetitions, design.target)
    ends, variation = replicated_interval(each, chains, unled)
    units = campaign[design.of].attrs.get("units", "1")
    event = _event(design, design.target, units)

    levels = np.array([len(one.thresholds) + 1 for one in found.repetitions])
    first = sum(len(one.states[0]) for one in found.repetitions if one.states)
    of_chains = float(np.sqrt(np.mean(chains**2) / len(each)))
    return {
        "tail_probability": (
            (), float(each.mean()), about(f"probability of {event}") | {"event": event},
        ),
        "tail_probability_interval": ("bound", ends, about("95 % interval of that probability")),
        "tail_agreement": (
            (), agreement(each, chains),
            about(
                "probability of such a scatter of the replicates from the errors of their chains "
                "alone"),
        ),
        "tail_unled": (
            (), unled,
            about("97.5 % upper bound of that probability from the first level's samples alone"),
        ),
        "tail_unled_samples": ((), first, about("samples of the first levels")),
        "tail_variation": ((), variation, about("coefficient of variation of that probability")),
        "tail_variation_of_chains": (
            (), of_chains, about("the same, from the correlation within chains alone"),
        ),
        "tail_replicate_probability": (
            "tail_replicate", each, about("probability by each replicate"),
        ),
        "tail_levels": ("tail_replicate", levels, about("levels of each replicate")),
        "tail_lost": ((), int(lost(campaign).sum()), about(
            "failed runs, counted as outside the event")),
        "tail_ended": ((), int(found.ended), about("whether all levels have run")),
        "tail_left_out": ((), int(len(known) < given), about(
            "whether samples are left out that others were drawn from")),
        **_short(design, known, found.repetitions, units),
        **_checks(campaign, design, known, found.repetitions, units),
    }  # fmt: skip


def bound_of_first_levels(found: list[Repetition], response: float) -> float:
    """Upper bound of the probability beyond a response from the independent samples of the first
    levels, whatever chains have found; 1 before they have run.
    """
    first = [one.states[0] > response for one in found if one.states]
    if not first:
        return 1.0
    inside = np.concatenate(first)
    return share_bounds(int(inside.sum()), len(inside), 0.5 + LEVEL / 2)[1]


def _event(design: SubsetSimulation, response: float, units: str) -> str:
    """That the output is beyond a response, in words."""
    sign = ">" if design.sign > 0 else "<"
    return f"{design.of} {sign} {with_unit(f'{design.sign * response + 0.0:.6g}', units)}"


def _short(
    design: SubsetSimulation, known: Array, found: list[Repetition], units: str
) -> dict[str, Any]:
    """If replicates ended short of the event: the value nearest to it whose probability all of them
    tell, which bounds that of the event, and the value of the run nearest to it.
    """
    ends = [one.reached for one in found if one.probability == 0.0]
    if not ends or any(np.isnan(one.probability) for one in found):
        return {}
    each, chains = np.array([one.beyond(min(ends)) for one in found]).T
    unled = bound_of_first_levels(found, min(ends))
    ends_of_interval, _ = replicated_interval(each, chains, unled)
    if not (each > 0.0).all():  # the best of some first level are equal
        ends_of_interval = np.array([0.0, unled])
    elif any(one.probability > 0.0 for one in found):  # by a way that the others did not find
        ends_of_interval[1] = unled
    event = _event(design, min(ends), units)
    nearest = design.sign * float(np.max(known, where=np.isfinite(known), initial=-np.inf))
    return {
        "tail_reached_probability": (
            (), float(each.mean()), about(f"probability of {event}") | {"event": event},
        ),
        "tail_reached_probability_interval": (
            "bound", ends_of_interval, about("95 % interval of that probability"),
        ),
        "tail_nearest": (
            (), nearest, about(f"{design.of} of the run nearest to the event", units),
        ),
    }  # fmt: skip


def _checks(
    campaign: xr.Dataset, design: SubsetSimulation, known: Array, found: list[Repetition],
    units: str,
) -> dict[str, Any]:  # fmt: skip
    """What the runs repeated with the full engine say, and the probability with the limit moved by
    what the engines differ at most: nearer, and farther.
    """
    held, both = good(campaign), np.zeros(len(known), dtype=bool)
    inside, again, apart = (known > design.target) & held, both, 0.0
    if f"{design.of}{CHECKED}" in campaign:
        # Also of failed runs, which count as outside the event.
        both = campaign[f"status{CHECKED}"].to_numpy() == Status.OK
        values = campaign[f"{design.of}{CHECKED}"].to_numpy().astype(float)
        full = design.responses(values, ~both)
        again, pairs = full > design.target, both & held & np.isfinite(full) & np.isfinite(known)
        apart = float(np.max(np.abs(full[pairs] - known[pairs]), initial=0.0))
    moved = [
        float(np.mean([one.beyond(design.target + step)[0] for one in found]))
        for step in (apart, -apart)
    ]
    counts = {
        "tail_checked": (inside & both, "runs in the event repeated with the full engine"),
        "tail_confirmed": (
            inside & both & again,
            "of these, runs in the event with the full engine, too",
        ),
        "tail_checked_outside": (
            ~inside & both,
            "runs outside the event repeated with the full engine",
        ),
        "tail_missed": (~inside & both & again, "of these, runs in the event with the full engine"),
    }
    return {
        **{
            name: ((), int(chosen.sum()), about(words))
            for name, (chosen, words) in counts.items()
        },
        "tail_difference": (
            (), apart, about(f"largest difference of {design.of} between the engines", units),
        ),
        "tail_probability_moved": (
            "bound", np.array(moved), about("probability with the limit moved by this difference"),
        ),
    }  # fmt: skip


def short_of(found: xr.Dataset) -> list[str]:
    """Why a rare event has no interval, and by what its probability is bounded; none if it has."""
    each = found["tail_replicate_probability"].to_numpy()
    if (each > 0.0).all():
        return []
    if "tail_reached_probability" not in found:
        none = int(np.isnan(each).sum())
        return [f"unknown: {none} of {len(each)} replicates have too few runs with a value"]
    reached, nearest = found["tail_reached_probability"], found["tail_nearest"]
    low, high = found["tail_reached_probability_interval"].to_numpy()
    most, short = bound_text(high, 2, upper=True), int((each == 0.0).sum())
    words = [f"below {most}: {short} of {len(each)} replicates did not reach the event"]
    if short < len(each):
        words.append(f"the mean of all {len(each)} estimates is {each.mean():.2g}")
    told = f"the bound is the probability of {reached.attrs['event']}"
    if low > 0.0:
        told += f", which all replicates reached: {float(reached):.3g} (95 % "
        told += f"{bound_text(low, 2, upper=False)} .. {most})"
    else:
        told += f" by the first {int(found['tail_unled_samples'])} samples, which are independent"
    return [
        *words,
        told,
        "the run nearest to the event has "
        f"{with_unit(f'{float(nearest):.6g}', nearest.attrs['units'])}",
    ]


def unseen_lines(found: xr.Dataset) -> list[str]:
    """What chains cannot tell of a rare event that all replicates came to, as sentences: whether
    these disagree, and how probable parts of it may be that none has found.
    """
    chance, most = float(found["tail_agreement"]), float(found["tail_unled"])
    samples, lines = int(found["tail_unled_samples"]), []
    if chance < DISAGREE:
        lines.append(
            f"the replicates differ by more than their own errors ({chance_text(chance)}): some "
            "replicates did not find all parts of the event, so the interval is wide (from their "
            f"mean and from the first {samples} samples); increase replicates and samples"
        )
    lines.append(
        "these numbers leave out any part of the event that no chain has found; the first "
        f"{samples} samples, which are independent, give an upper bound of "
        f"{bound_text(most, 2, upper=True)} (97.5 %) for the whole event"
    )
    return lines


def tail_table(analysis: xr.Dataset) -> Table:
    """Probability of the rare event with its interval, how sure it is and why; empty without one.

    ``analysis`` holds what ``tail`` gives, and the number of ``samples`` among its attributes.
    """
    if "tail_probability" not in analysis:
        return Table((), ())
    head = "rare event", str(analysis["tail_probability"].attrs["event"])
    runs, lost = analysis.attrs["samples"], int(analysis["tail_lost"])
    replicates, levels = analysis.sizes["tail_replicate"], int(analysis["tail_levels"].max())
    if not int(analysis["tail_ended"]):
        if int(analysis["tail_left_out"]):
            notes = [
                "samples are left out from which others were drawn: no probability; analyse the "
                "whole campaign for it"
            ]
            return Table(head, [("runs", str(runs))], notes)
        notes = ["not all levels have run yet: no probability"]
        return Table(head, [("runs so far", str(runs))], notes)
    low, high = analysis["tail_probability_interval"].to_numpy()
    by_chains = f"{float(analysis['tail_variation_of_chains']):.2g} from the chains alone"
    scatter = f"{float(analysis['tail_variation']):.2g} from the replicates, " * (replicates > 1)
    if why := short_of(analysis):
        rows = [("probability", why[0])]
    else:
        each = (f"{p:.2g}" for p in analysis["tail_replicate_probability"].to_numpy())
        rows = [
            ("probability", f"{float(analysis['tail_probability']):.3g}"),
            ("95 % interval, for the parts that the chains found", f"{low:.2g} .. {high:.2g}"),
            ("coefficient of variation", f"{scatter}{by_chains}"),
            ("by each replicate", ", ".join(each)),
        ]
    rows += [
        ("levels", f"{levels} at most with the first one, in {replicates} replicates"),
        ("runs", f"{runs}, {lost} failed and counted as outside the event"),
    ]
    if checked := int(analysis["tail_checked"]):
        confirmed = int(analysis["tail_confirmed"])
        low, high = share_interval(confirmed, checked)
        rows.append((
            "in the event with the full engine, too",
            f"{confirmed} of {checked} repeated runs (95 %: {low:.2g} .. {high:.2g} of all)",
        ))  # fmt: skip
    if outside := int(analysis["tail_checked_outside"]):
        rows.append((
            "in the event with the full engine only",
            f"{int(analysis['tail_missed'])} of {outside} repeated runs outside the event (the "
            "nearest ones, those that ended before the antenna was deployed, and failed ones)",
        ))  # fmt: skip
    if (checked or outside) and not why:
        apart = analysis["tail_difference"]
        farther, nearer = analysis["tail_probability_moved"].to_numpy()
        moved = with_unit(f"{float(apart):.2g}", apart.attrs["units"])
        rows.append((
            f"probability with the limit moved by {moved} (difference of the engines)",
            f"{farther:.3g} to {nearer:.3g}",
        ))  # fmt: skip
    notes = why[1:] or unseen_lines(analysis)
    if why:
        notes.append("raise samples or most_levels, so that every replicate reaches the event")
    return Table(head, rows, notes, left=2)
