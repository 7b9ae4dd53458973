"""Whether the first samples of a campaign are enough, by its ``stop_when``."""

from collections.abc import Mapping

import numpy as np
import xarray as xr

from ringsim.analysis import intervals
from ringsim.analysis.design import Placement
from ringsim.analysis.looks import Condition, Rule, rule_of
from ringsim.analysis.quantities import good, numbers, quantities
from ringsim.analysis.requirements import Requirement
from ringsim.analysis.verdicts import Verdict, judge
from ringsim.tables import counted, number_text


def holds(
    rule: Rule, campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement
) -> str:
    """What the samples of a look show, in words, if all conditions hold; else empty.

    ``campaign`` has the samples of the look and no others, all of which have run, and its attribute
    ``stop_when``.  InputError if a requirement cannot be judged by them.
    """
    told = []
    for each in rule.conditions:
        if each.requirement is not None:
            wanted = {each.requirement: requirements[each.requirement]}
            (code,) = judge(campaign, wanted, placed)["verdict"].to_numpy().tolist()
            shown = code in (Verdict.MET, Verdict.NOT_MET)
            word = Verdict(code).word.replace("_", " ")
            told.append(f"{wanted[each.requirement].told(each.requirement)} is {word}")
        else:
            half, shown = _half_width(each, campaign, placed), False
            units = quantities()[str(each.of)].units
            unit = "" if units == "1" else f" {units}"
            shown = half <= float(each.half_width or 0.0)
            told.append(f"the {each.what} is known to {number_text(half, 3)}{unit}")
        if not shown:
            return ""
    return ", ".join(told)


def _half_width(condition: Condition, campaign: xr.Dataset, placed: Placement) -> float:
    """Half the length of the interval of a mean or a quantile; NaN if there is none."""
    values = numbers(campaign, str(condition.of))
    known = good(campaign) & np.isfinite(values)
    if known.sum() < 2 or not placed.has_intervals:
        return float("nan")
    used, replicate = values[known], placed.replicate_of(campaign["sample"].to_numpy()[known])
    if condition.quantile is None:
        low, high = (
            intervals.of_independent(used, np.mean)
            if replicate is None
            else intervals.of_replicates(used, replicate, np.mean)
        )
    else:
        low, high = (
            intervals.quantile_of_independent(used, condition.quantile)
            if replicate is None
            else intervals.quantile_of_replicates(used, replicate, condition.quantile)
        )
    return float(high - low) / 2


def stopping_lines(campaign: xr.Dataset, placed: Placement) -> list[str]:
    """What became of the rule of a merged campaign, a line; none if it has none."""
    says = campaign.attrs
    if (rule := rule_of(says)) is None:
        return []
    count, most = campaign.sizes["sample"], int(says.get("planned_samples", 0))
    if "stopped_after" in says:
        taken = [*rule.numbers(count, placed.replicates), count]
        first = f"stop_when ended the campaign after {count} of at most {most} samples, because "
        first += str(says["stop_reason"])
    else:
        taken = rule.numbers(count, placed.replicates)
        first = f"stop_when did not end the campaign of {count} samples"
    looks = f"{counted(len(taken), 'look')}: {', '.join(map(str, taken))}" if taken else "no look"
    kept = []
    if any(each.requirement for each in rule.conditions):
        kept.append("bounds of its requirements hold at all looks at once")
    kept.append("other intervals are those of a number of samples fixed before")
    return [f"{first} ({looks}); {', '.join(kept)}"]
