"""Verdicts on requirements: met, not met, or not yet shown, with exact bounds.

They err on the safe side: nobody knows what lost runs would have done, so that they count as
violating for "met", and as keeping to the requirement for "not met".
"""

from collections.abc import Mapping

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.stats import t

from ringsim.analysis.binomial import samples_needed, share_bounds
from ringsim.analysis.design import Placement
from ringsim.analysis.intervals import Interval, standard_error
from ringsim.analysis.looks import Levels, Rule, rule_of
from ringsim.analysis.quantities import Mask, good, lost, numbers, quantities, tells_of
from ringsim.analysis.requirements import OUTCOME, Requirement
from ringsim.refusal import InputError, known_or_nearest
from ringsim.variables import GOALS, Code, Fate, flags_of


class Verdict(Code):
    """What samples say about a requirement."""

    NOT_MET = 0
    """The upper bound of the probability is below the one required."""
    NOT_YET_SHOWN = 1
    MET = 2
    """The lower bound of the probability is at least the one required."""
    NO_POPULATION = 3
    """The design stands for no population: only violations can be counted."""


def violations(campaign: xr.Dataset, name: str, wanted: Requirement) -> Mask:
    """Which samples violate a requirement, of those that have numbers that hold.

    One without a value violates it: an antenna that never deploys has no deployment time.
    """
    if name == OUTCOME:
        codes = campaign[OUTCOME].to_numpy()
        broken = codes != Fate[str(wanted.is_).upper()]
    else:
        values = numbers(campaign, name)
        low = -np.inf if wanted.min is None else wanted.min
        high = np.inf if wanted.max is None else wanted.max
        broken = ~((values >= low) & (values <= high))
    return np.asarray(good(campaign) & broken)


def bounds(
    kept: Mask, samples: NDArray[np.int64], levels: Levels, placed: Placement
) -> Interval:  # fmt: skip
    """One-sided bounds of the probability that samples keep to a requirement.

    ``levels`` are the confidence of the lower and of the upper one.  Those after Clopper and
    Pearson; where the replicates of a design scatter by more than independent samples would, those
    of Student's t from the replicates.
    """
    low, high = (share_bounds(int(kept.sum()), len(kept), levels[k])[k] for k in (0, 1))
    replicate = placed.replicate_of(samples)
    if replicate is not None and placed.replicates > 1:
        share = float(kept.mean())
        error, free = standard_error(kept.astype(float), replicate)
        if free > 0:
            below, above = (float(t.ppf(level, free) * error) for level in levels)
            low, high = max(0.0, min(low, share - below)), min(1.0, max(high, share + above))
    return low, high


def judge(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement
) -> xr.Dataset:
    """The verdict on every requirement, along ``requirement``.

    Where the campaign's rule for stopping looks at a requirement again and again, its bounds hold
    at all looks at once.
    """
    rule = rule_of(campaign.attrs)
    columns: dict[str, list[float]] = {name: [] for name in _MEANING}
    for name, wanted in requirements.items():
        require_values(campaign, name)
        for key, value in _judged(campaign, name, wanted, placed, rule).items():
            columns[key].append(value)
    known = {
        name: ("requirement", values, {"long_name": words, "units": "1"})
        for name, (words, _) in _MEANING.items()
        for values in [np.array(columns[name], dtype=_MEANING[name][1])]
    }
    told = [each.told(name) for name, each in requirements.items()]
    found = xr.Dataset(known, coords={"requirement": np.array([*requirements], dtype=object)})
    found["requirement_text"] = (
        "requirement", np.array(told, dtype=object), {"long_name": "requirement in words"}
    )  # fmt: skip
    for name in ("verdict", "verdict_of_used"):
        found[name].attrs |= flags_of(Verdict)
    return found


_MEANING = {
    "probability_required": ("probability required", "f8"),
    "confidence_required": ("confidence required of each bound", "f8"),
    "confidence_lower": ("confidence of the lower bound, more than required at many looks", "f8"),
    "confidence_upper": ("confidence of the upper bound, more than required at many looks", "f8"),
    "verdict": ("verdict, whatever lost samples would have done", "i1"),
    "verdict_of_used": ("verdict if lost samples were as the others", "i1"),
    "probability": ("share of the samples used that keep to the requirement", "f8"),
    "probability_lower": ("one-sided lower bound of the probability, lost samples violating", "f8"),
    "probability_upper": ("one-sided upper bound of the probability, lost samples keeping", "f8"),
    "samples_used": ("samples with numbers that hold", "i8"),
    "samples_lost": ("samples whose run failed", "i8"),
    "samples_violating": ("samples used that violate the requirement", "i8"),
    "samples_without_value": ("of these, samples without a value", "i8"),
    "samples_short": ("samples that keep to it and ended short of their goal", "i8"),
    "further_samples": ("further samples, none violating, that would show it; -1: none", "i8"),
}  # fmt: skip


def require_values(campaign: xr.Dataset, name: str) -> None:
    """Refuse (InputError) an output that the runs do not compute: it would seem violated."""
    if name not in campaign:
        known = [OUTCOME, *(each for each in quantities() if each in campaign)]
        raise InputError(
            f"requirement on {name}: the file has no such output ({known_or_nearest(name, known)})"
        )
    none = np.flatnonzero(good(campaign) & ~tells_of(campaign, name))
    if name != OUTCOME and len(none):
        raise InputError(
            f"requirement on {name}: {len(none)} samples reached their goal without a value of "
            f"it, the first is {campaign['sample'].to_numpy()[none[0]]}: their model does not "
            "compute it, or an older ringsim ran them; require another output, use the full "
            "fidelity, or run them again"
        )


def _judged(
    campaign: xr.Dataset, name: str, wanted: Requirement, placed: Placement, rule: Rule | None
) -> dict[str, float]:
    used, gone = good(campaign), lost(campaign)
    broken = violations(campaign, name, wanted)
    absent = used & np.isnan(numbers(campaign, name)) if name != OUTCOME else ~used & used
    count, bad, missing = (int(each.sum()) for each in (used, broken, gone))
    short = used & ~broken & _ended_short(campaign)
    place = campaign["sample"].to_numpy()
    levels = wanted.confidence, wanted.confidence
    looked = int((campaign["status"].to_numpy() >= 0).sum())
    if rule is not None:
        levels = rule.levels(name, wanted, looked, placed.replicates)
    low, high = 0.0, 1.0
    verdict = alone = Verdict.NOT_YET_SHOWN
    if count:
        alone = verdict_of(*bounds(~broken[used], place[used], levels, placed), wanted.probability)
        run = used | gone
        low, high = (
            bounds(kept[run], place[run], levels, placed)[k]
            for k, kept in enumerate((~(broken | gone), ~broken))
        )
        verdict = verdict_of(low, high, wanted.probability)
    further = -1
    if count and verdict == Verdict.NOT_YET_SHOWN:
        if rule is not None and rule.judges(name):
            further = rule.further_samples(name, wanted, looked, bad + missing, placed.replicates)
        else:
            needed = samples_needed(bad + missing, wanted.probability, wanted.confidence)
            further = max(needed - count - missing, 0) or -1
    if not placed.population:
        verdict = alone = Verdict.NO_POPULATION
        low, high, further = np.nan, np.nan, -1
    return {
        "probability_required": wanted.probability, "confidence_required": wanted.confidence,
        "confidence_lower": levels[0], "confidence_upper": levels[1],
        "verdict": verdict, "verdict_of_used": alone,
        "probability": 1.0 - bad / count if count else np.nan,
        "probability_lower": low, "probability_upper": high,
        "samples_used": count, "samples_lost": missing, "samples_violating": bad,
        "samples_without_value": int(absent.sum()),
        "samples_short": int(short.sum()) if name != OUTCOME else 0,
        "further_samples": further,
    }  # fmt: skip


def _ended_short(campaign: xr.Dataset) -> Mask:
    """Which runs ended before their goal: what they never came to cannot exceed a limit."""
    if OUTCOME not in campaign:
        return np.zeros(campaign.sizes["sample"], dtype=bool)
    return ~np.isin(campaign[OUTCOME].to_numpy(), [-1, Fate.NONE, *GOALS])


def verdict_of(low: float, high: float, probability: float) -> Verdict:
    """The verdict by the one-sided bounds of a probability; not yet shown where they are NaN."""
    if low >= probability:
        return Verdict.MET
    return Verdict.NOT_MET if high < probability else Verdict.NOT_YET_SHOWN
