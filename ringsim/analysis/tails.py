"""How probable a rare event is, by a campaign of subset simulation."""

import json
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import norm

from ringsim.analysis.binomial import share_interval
from ringsim.analysis.intervals import LEVEL, Array, student
from ringsim.analysis.quantities import CHECKED, good, lost
from ringsim.sampling.designs.subset_simulation import SubsetSimulation
from ringsim.variables import Status


def subset_simulation(campaign: xr.Dataset) -> SubsetSimulation | None:
    """The design of a campaign if it is subset simulation, else None."""
    table = json.loads(campaign.attrs.get("design", "{}"))
    if table.get("kind") != "subset-simulation":
        return None
    return SubsetSimulation.model_validate(table)


def _responses(campaign: xr.Dataset, design: SubsetSimulation) -> Array:
    values = campaign[design.of].to_numpy().astype(float)
    return design.responses(values, ~good(campaign))


def approach(campaign: xr.Dataset) -> list[tuple[Array, Array]]:
    """Of each replicate the values of the output that its levels reached, the event's last, with
    the probability to be at or beyond each; what has no probability yet is left out.
    """
    if (design := subset_simulation(campaign)) is None:
        return []
    found = []
    for one in design.levels(_responses(campaign, design)).repetitions:
        places, shares = [*one.thresholds], [*one.beyond]
        if one.probability > 0.0:
            places, shares = [*places, design.target], [*shares, one.probability]
        # Runs without a value are beyond all: a threshold among them has no place on an axis.
        known = np.isfinite(places)
        found.append((design.sign * np.array(places)[known], np.array(shares)[known]))
    return found


def tail(campaign: xr.Dataset) -> dict[str, Any]:
    """Variables ``tail_...`` of a campaign of subset simulation; none of other campaigns.

    The interval is that of the logarithm: of independent replicates Student's t from their
    scatter; of a single one the normal limit from the correlation of its chains.
    """
    if (design := subset_simulation(campaign)) is None:
        return {}
    known = _responses(campaign, design)
    found = design.levels(known)
    each = np.array([one.probability for one in found.repetitions])
    chains = np.array([one.variation for one in found.repetitions])
    middle, count = float(each.mean()), len(each)
    by_chains = float(np.sqrt(np.mean(chains**2) / count))
    variation, wide = by_chains, float(norm.ppf(0.5 + LEVEL / 2))
    if count > 1 and middle > 0:
        variation, wide = float(each.std(ddof=1) / middle / count**0.5), student(count)
    ends = middle * np.exp(np.array([-wide, wide]) * variation)
    units = campaign[design.of].attrs.get("units", "1")
    sign, bound = (">", design.above) if design.above is not None else ("<", design.below)
    event = f"{design.of} {sign} {bound:g}{'' if units == '1' else f' {units}'}"

    def told(words: str) -> dict[str, str]:
        return {"long_name": words, "units": "1"}

    inside, both = (known > design.target) & good(campaign), np.zeros(len(known), dtype=bool)
    again = inside & both
    if f"{design.of}{CHECKED}" in campaign:
        both = campaign[f"status{CHECKED}"].to_numpy() == Status.OK
        values = campaign[f"{design.of}{CHECKED}"].to_numpy().astype(float)
        again = inside & both & (design.responses(values, ~both) > design.target)
    return {
        "tail_checked": (
            (), int((inside & both).sum()), told("runs in the event repeated with the full engine"),
        ),
        "tail_confirmed": ((), int(again.sum()), told("of these, runs in the event there, too")),
        "tail_probability": ((), middle, told(f"probability of {event}") | {"event": event}),
        "tail_probability_interval": ("bound", ends, told("interval of 95 % of that probability")),
        "tail_variation": ((), variation, told("coefficient of variation of that probability")),
        "tail_variation_of_chains": (
            (), by_chains, told("the same from the correlation of chains alone"),
        ),
        "tail_replicate_probability": (
            "tail_replicate", each, told("probability by each replicate"),
        ),
        "tail_levels": (
            "tail_replicate", np.array([len(one.thresholds) + 1 for one in found.repetitions]),
            told("levels of each replicate"),
        ),
        "tail_lost": ((), int(lost(campaign).sum()), told("runs that failed: taken as no event")),
        "tail_ended": ((), int(found.ended), told("whether all levels have run")),
    }  # fmt: skip


def tail_lines(analysis: xr.Dataset) -> list[str]:
    """The same as a sentence; none without it."""
    if "tail_probability" not in analysis:
        return []
    one = {str(n): v.to_numpy() for n, v in analysis.items() if str(n).startswith("tail_")}
    event = analysis["tail_probability"].attrs["event"]
    if not one["tail_ended"]:
        return [f"probability of {event}: not all levels have run"]
    low, high = one["tail_probability_interval"]
    by = f"{len(one['tail_levels'])} replicates of {one['tail_levels'].max()} levels at most"
    line = (
        f"probability of {event}: {float(one['tail_probability']):.3g} (95 % {low:.2g} .. "
        f"{high:.2g}), coefficient of variation {float(one['tail_variation']):.2g} from {by}, "
        f"{float(one['tail_variation_of_chains']):.2g} from the correlation of chains; "
        f"{analysis.attrs['samples']} runs, {int(one['tail_lost'])} lost and taken as no event"
    )
    if not (checked := int(one["tail_checked"])):
        return [line]
    confirmed = int(one["tail_confirmed"])
    low, high = share_interval(confirmed, checked)
    return [
        line,
        f"{confirmed} of {checked} runs in the event that were repeated with the full engine are "
        f"in it there, too (95 % {low:.2g} .. {high:.2g} of all); events that only the full engine "
        "sees are not looked for",
    ]
