"""What samples say about other distributions of their inputs, without new runs."""

import json
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray
from pydantic import ValidationError

from ringsim.analysis.design import (
    FAILED_RUNS,
    LOST,
    Placement,
    called,
    correlated,
    endings,
    inputs,
    kinds_of_ends,
    paths_of,
)
from ringsim.analysis.indices import replicate_interval
from ringsim.analysis.intervals import (
    LEVEL,
    NONE,
    Interval,
    Mask,
    good,
    lost,
    numbers,
    quantities,
    ran,
    share_bounds,
    standard_error,
)
from ringsim.analysis.requirements import OUTCOME, Requirement, looked_at, rule_of, violations
from ringsim.analysis.verdicts import Verdict, verdict_of
from ringsim.overrides import parse_value
from ringsim.refusal import InputError, explain, known_or_nearest, show
from ringsim.sampling.distributions import Calibrated, Discrete, Distribution, Values, inside
from ringsim.sampling.table import AnyDistribution
from ringsim.stepping.instant import Array
from ringsim.units import Model
from ringsim.variables import about, flags_of

# Estimates from samples with weights, and their intervals.


_FEW = 10
"""Samples of a kind, and of the others, below which replicates do not tell its share."""
LEAST_OF_SHARE = 10.0
"""Effective samples on either side below which the scatter of weights tells no interval of a share
or a quantile: what matters may be where there is hardly a sample.
"""
LEAST_OF_MEAN = 50.0
"""Effective samples that decide a mean below which its interval is too short: with 300 samples and
weights exp(0.6 x) it holds the mean of x in 94 of 100 campaigns (110 decide), that of exp(x) in 86
(43), and with exp(1.2 x) in 85 (42) and 71 (18).
"""
Replicate = NDArray[np.int64] | None
"""The replicate that each sample belongs to; None if all are independent."""


def effective(weights: Array) -> float:
    """Number of samples of equal weight that would tell as much; Kish, Survey Sampling (1965)."""
    if not len(weights) or weights.max() == 0.0:
        return 0.0
    own = weights / weights.max()  # squares of large ones would overflow
    return float(own.sum() ** 2 / (own**2).sum())


def mean(values: Array, weights: Array) -> float:
    """Weighted mean."""
    return float(weights @ values / weights.sum())


def mean_interval(values: Array, weights: Array, replicate: Replicate) -> Interval:
    """Interval of the weighted mean, with Student's t.

    Of independent samples by the linearised variance of a ratio, with one degree of freedom less
    than effective samples; else by the jackknife over replicates.
    Source: Owen, Monte Carlo theory, methods and examples (2013), section 9.2.
    """
    centre = mean(values, weights)
    if replicate is not None:
        low, high = replicate_interval(
            lambda rows: np.array(mean(values[rows], weights[rows])), replicate,
            np.asarray, np.asarray,
        )  # fmt: skip
        return float(low), float(high)
    free = effective(weights) - 1
    if free < 1:
        return NONE
    half = float(scipy.special.stdtrit(free, 0.5 + LEVEL / 2)) * _error(values, weights, centre)
    return centre - half, centre + half


def _error(values: Array, weights: Array, centre: float) -> float:
    """Standard error of a weighted mean of independent samples."""
    free = effective(weights) - 1
    squares = float((weights**2) @ (values - centre) ** 2)
    return float(np.sqrt(squares * (1 + 1 / free)) / weights.sum())


def share_interval(own: Mask, weights: Array, replicate: Replicate) -> Interval:
    """Interval of the weighted share of some samples.

    The exact one for as many samples as would have that standard error; where none or all are of
    the kind, for the effective ones.  Source: Korn and Graubard, Survey Methodology 24 (1998).
    """
    share, few = mean(own.astype(float), weights), min(own.sum(), (~own).sum()) < _FEW
    share = 1.0 if own.all() else share  # not a bit less by round-off
    if replicate is not None and not few:
        low, high = mean_interval(own.astype(float), weights, replicate)
        if low < high:  # replicates that agree say nothing
            return max(0.0, low), min(1.0, high)
    count = effective(weights)
    if count <= 2:
        return NONE
    if 0 < share < 1:
        error = _error(own.astype(float), weights, share)
        count = share * (1 - share) / error**2
        # Fewer degrees of freedom than the count tells: t instead of the normal distribution.
        free = np.array([len(own) - 1, max(effective(weights) - 1, 1)])
        wide = scipy.special.stdtrit(free, 0.5 + LEVEL / 2)
        count *= float(wide[0] / wide[1]) ** 2
    return share_bounds(share * count, count, 0.5 + LEVEL / 2)


def decisive_of_mean(values: Array, weights: Array) -> float:
    """Effective number of samples that decide the error of a weighted mean."""
    return effective(np.abs(weights * (values - mean(values, weights))))


def decisive_of_share(own: Mask, weights: Array) -> float:
    """Effective number of samples of the kind, or of the others where these are fewer."""
    return min(effective(weights[own]), effective(weights[~own]))


def quantile(values: Array, weights: Array, probability: float) -> float:
    """Quantile of the weighted distribution; NaN beyond the middles of the outermost weights."""
    order = np.argsort(values)
    level = (np.cumsum(weights[order]) - 0.5 * weights[order]) / weights.sum()
    if not level[0] <= probability <= level[-1]:
        return np.nan
    return float(np.interp(probability, level, values[order]))


def quantile_interval(
    values: Array, weights: Array, probability: float, replicate: Replicate
) -> Interval:
    """Interval of a weighted quantile: where the interval of the share below it reaches to.

    Source: Woodruff, J. Am. Statistical Association 47 (1952).
    """
    middle = quantile(values, weights, probability)
    if np.isnan(middle) or decisive_of_share(values <= middle, weights) < LEAST_OF_SHARE:
        return NONE
    low, high = share_interval(values <= middle, weights, replicate)
    found = quantile(values, weights, low), quantile(values, weights, high)
    return NONE if np.isnan(sum(found)) else found


# Bounds of a probability under other distributions of inputs, safe whatever their tails.
#
# The weights of samples, new over old density, may be without bound: where the new distribution has
# much and the old one hardly a sample, no scatter of weights warns.  A cap W makes two parts of the
# probability of an event A, w the weight as the distributions give it everywhere:
#
#     P_new(A) = E_old[min(w, W) 1_A] + E_new[(1 - W / w)+ 1_A]
#
# The first is W times the mean of numbers between 0 and 1, of which samples are drawn: it has
# bounds whatever their distribution.  The second is at most E_new[(1 - W / w)+], which needs no
# run: draws of the new distribution tell it.  W is chosen by the distributions and the number of
# samples alone, so that it is not fitted to what the samples did.


_DRAWS = 1 << 16
"""Draws of the new distribution that place the cap, and as many that tell what is beyond it."""
_ERROR_OF_DRAWS = 0.01
"""Part of the error of a bound that is left to the draws."""


class Pair(NamedTuple):
    """An input's distributions."""

    old: Distribution
    new: Distribution
    places: int
    """How many values it has, independent of each other."""


def mean_bounds(mean: float, count: int, error: float) -> Interval:
    """Bounds of the expectation of numbers between 0 and 1, from the mean of so many independent
    ones; each is missed with a probability of at most ``error``.

    Where the samples' mean m and the expectation p have count * KL(m, p) = ln(1 / error), KL that
    of Bernoulli's distributions; with m = 0 the exact bound of a share.  Source: Hoeffding, J. Am.
    Statistical Association 58 (1963), theorem 1.

    >>> low, high = mean_bounds(0.0, 300, 0.1)
    >>> round(high, 6) == round(1 - 0.1 ** (1 / 300), 6)
    True
    """
    far = np.log(1.0 / error) / count

    def apart(p: float) -> float:
        with np.errstate(divide="ignore", invalid="ignore"):
            one = mean * np.log(mean / p) if mean > 0 else 0.0
            other = (1 - mean) * np.log((1 - mean) / (1 - p)) if mean < 1 else 0.0
        return float(one + other - far)

    tiny = 1e-300
    low = (
        scipy.optimize.brentq(apart, tiny, mean, rtol=1e-10)
        if mean > tiny and apart(tiny) > 0
        else 0.0
    )
    most = 1.0 - 2.0**-53
    high = (
        scipy.optimize.brentq(apart, mean, most, rtol=1e-10)
        if mean < most and apart(most) > 0
        else 1.0
    )
    return float(low), float(high)


def drawn_weights(pairs: Mapping[str, Pair], seed: int) -> Array:
    """Weights at independent draws of the new distributions, shape (draws,); infinite where the old
    ones have nothing.
    """
    rng, logarithm = np.random.default_rng(seed), np.zeros(_DRAWS)
    for old, new, places in pairs.values():
        for _ in range(places):
            values = new.quantile(inside(rng.random(_DRAWS)))
            logarithm += new.log_density(values) - old.log_density(values)
    return np.exp(np.minimum(logarithm, 700.0))


class Cap:
    """The largest weight that counts, for so many samples and so much error of a bound."""

    def __init__(self, pairs: Mapping[str, Pair], samples: int, error: float) -> None:
        self._error = error
        rising = np.sort(drawn_weights(pairs, 0))
        # Beyond each draw as a cap, and what samples without a violation would leave below it.
        inverse = np.append(np.cumsum((1.0 / rising)[::-1])[::-1][1:], 0.0)
        beyond = (np.arange(len(rising))[::-1] - rising * inverse) / len(rising)
        none = mean_bounds(0.0, samples, error)[1]
        self.weight = float(rising[np.argmin(beyond + rising * none)])
        """The cap W."""
        left = np.maximum(1.0 - self.weight / drawn_weights(pairs, 1), 0.0)
        self.beyond = mean_bounds(float(left.mean()), len(left), _ERROR_OF_DRAWS * error)[1]
        """Bound of what the new distribution has beyond it."""

    def bounds(self, own: Mask, weights: Array, replicate: Replicate) -> Interval:
        """One-sided bounds of the new probability of what happened to some samples, each missed
        with a probability of at most the error.

        ``weights`` are densities' ratios, shape (samples,), of all samples that were drawn.  Where
        replicates of a design scatter by more, those of Student's t from them.
        """
        values = np.minimum(weights, self.weight) / self.weight * own
        error = self._error * (1.0 - _ERROR_OF_DRAWS)
        mean = float(values.mean())
        low, high = mean_bounds(mean, len(values), error)
        if replicate is not None:
            scatter, free = standard_error(values, replicate)
            half = float(-scipy.special.stdtrit(free, error) * scatter) if free > 0 else np.nan
            low, high = float(np.fmin(low, mean - half)), float(np.fmax(high, mean + half))
        return max(0.0, self.weight * low), min(1.0, self.weight * high + self.beyond)


# What samples say about other distributions of their inputs, without new runs.


LEAST_EFFECTIVE = 10.0
"""Effective samples below which nothing is told."""
LEAST_REPLICATES = 16
"""Replicates of a Sobol' design from which on weighted shares and quantiles have intervals."""
SOBOL = ("sobol", "saltelli")
_BEYOND = 1e-3
"""Probability of the new distribution that may lie where the old one has none."""
_BEYOND_SAMPLES = 0.01
"""The same where the old one has hardly a sample, if that is more than two samples' share."""
REWEIGHTED_STATISTICS = {"mean": None, "quantile_05": 0.05, "median": 0.5, "quantile_95": 0.95}


class _Holder(Model):
    reweight: dict[str, AnyDistribution]


def read_distributions(table: Mapping[str, Any]) -> dict[str, Distribution]:
    """Distributions by path from plain tables; InputError if one is refused."""
    try:
        return _Holder.model_validate({"reweight": dict(table)}).reweight
    except ValidationError as error:
        raise InputError(explain(error, _Holder, "--reweight")) from None


def parse_reweighted(texts: Iterable[str]) -> dict[str, Any]:
    """Plain tables by path from texts of the command line.

    >>> parse_reweighted(['loads.force = { kind = "uniform", low = 1, high = 2 }'])
    {'loads.force': {'kind': 'uniform', 'low': 1, 'high': 2}}
    """
    found: dict[str, Any] = {}
    for text in texts:
        path, equals, raw = (part.strip() for part in text.partition("="))
        path = path[1:-1] if path[:1] == path[-1:] and path[:1] in ('"', "'") else path
        table = parse_value(raw, f"--reweight {path}") if path and equals and raw else None
        if not isinstance(table, dict):
            raise InputError(
                f"--reweight {show(text)}: must read PATH = DISTRIBUTION, for example "
                "'loads.force = { kind = \"normal\", mean = 0.01, standard_deviation = 0.001 }'"
            )
        if path in found:
            raise InputError(f"--reweight {path} is given twice: leave out one of the two")
        found[path] = table
    return found


def weights_of(
    campaign: xr.Dataset, wanted: Mapping[str, Distribution]
) -> tuple[Array, dict[str, Pair]]:
    """Weight of each sample, shape (samples,), the ratio of the densities; and these by path.

    An input of many places has the new distribution in each of them, independently.  InputError
    where an input was not drawn by itself, or its samples do not cover the new distribution.
    """
    known = {called(campaign[name]): campaign[name] for name in inputs(campaign)}
    logarithm, pairs = np.zeros(campaign.sizes["sample"]), dict[str, Pair]()
    for path, new in wanted.items():
        if path not in known:
            hint = known_or_nearest(path, known) if known else "none is drawn"
            # Of paths that share one drawn value none has a distribution of its own.
            whole = (f"did you mean {n}?" for n, each in known.items() if path in paths_of(each))
            hint = next(whole, hint)
            raise InputError(f"--reweight {path}: is not a drawn input of this campaign ({hint})")
        if new.follows:
            raise InputError(
                f'--reweight {path}: kind = "function" follows another input: give the new '
                f"distribution to {new.follows}"
            )
        values, old = known[path].to_numpy(), _drawn_from(campaign, path, known[path])
        for key in ("each_section", "shared", "unit"):  # where values go is as it was drawn
            mine, theirs = getattr(new, key), getattr(old, key)
            if mine and mine != theirs:
                drawn = f"with {show(theirs)}" if theirs else "without it"
                raise InputError(
                    f"--reweight {path}: {key} = {show(mine)}: the samples were drawn {drawn}, and "
                    "a new distribution changes no more than what they are worth: leave it out"
                )
        _check_cover(path, old, new, max(1, int(ran(campaign).sum())))
        logarithm += log_ratio(old, new, values)
        pairs[path] = Pair(old, new, values[:1].size)
    return np.exp(np.minimum(logarithm, 700.0)), pairs


def log_ratio(old: Distribution, new: Distribution, values: Values) -> Array:
    """Logarithm of the new over the old density, shape (samples,); of values with many places,
    which are independent, the sum over these.  NaN where there is neither density.
    """
    with np.errstate(invalid="ignore"):
        ratio = new.log_density(values) - old.log_density(values)
    return ratio if ratio.ndim == 1 else np.asarray(ratio.sum(axis=1))


def _drawn_from(campaign: xr.Dataset, path: str, variable: xr.DataArray) -> Distribution:
    try:
        table = json.loads(str(variable.attrs.get("distribution", "")))
        old = _Holder.model_validate({"reweight": {path: table}}).reweight[path]
    except (ValueError, ValidationError):
        raise InputError(
            f"--reweight {path}: this input has no distribution in the file (its values were "
            "listed): draw it from a distribution"
        ) from None
    if isinstance(old, Calibrated):
        raise InputError(
            f"--reweight {path}: it was learnt from a test, whose readings tie it to the other "
            "inputs, and a new distribution of one input alone would not keep that: run a new "
            "campaign"
        )
    if other := correlated(campaign).get(path):
        raise InputError(
            f"--reweight {path}: it is correlated with {other}, and a new distribution of one "
            "input alone would not keep the correlation: run a new campaign"
        )
    return old


def _check_cover(path: str, old: Distribution, new: Distribution, samples: int) -> None:
    if isinstance(old, Discrete) != isinstance(new, Discrete):
        kinds = ["values" if isinstance(each, Discrete) else "an interval" for each in (old, new)]
        raise InputError(
            f"--reweight {path}: it was drawn from {kinds[0]}, and the new distribution is over "
            f"{kinds[1]}: run a new campaign"
        )
    if isinstance(new, Discrete):
        for value in new.values:
            if not np.isfinite(old.log_density(np.array([value], dtype=object))).all():
                raise InputError(
                    f"--reweight {path}: {show(value)} was never drawn, so no sample has it: "
                    "leave it out, or run a campaign with it"
                )
        return
    tail = 0.5 / samples
    for part, most, words in (
        (0.0, _BEYOND, "where no value was drawn"),
        (tail, max(_BEYOND_SAMPLES, 2 / samples), f"where hardly any of {samples} samples lie"),
    ):
        low, high = old.quantile(inside(np.array([part, 1 - part]))).tolist()
        low *= abs(low) > 1e-12 * abs(high)  # a bound of 0, of which it is a hair inside
        beyond = new.probability(low) + 1 - new.probability(high)
        if beyond > most:
            raise InputError(
                f"--reweight {path}: {100 * beyond:.2g} % of the new distribution lie below "
                f"{low:.4g} or above {high:.4g}, {words}; at most {100 * most:.2g} % are allowed: "
                "choose a narrower distribution, or run a campaign with it"
            )


def reweight(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement,
    wanted: Mapping[str, Distribution],
) -> xr.Dataset:  # fmt: skip
    """Statistics and probabilities if inputs had other distributions.

    For every output NAME ``NAME_reweighted`` along ``reweighted_statistic``, its ``_interval`` and
    ``NAME_effective_samples``; ``reweighted_share`` along ``event``: outcomes, lost runs, and
    requirements that are kept to; ``reweighted_verdict`` with its one-sided ``reweighted_bounds``
    along ``requirement``; ``effective_samples`` of all that ran.  InputError where the design
    stands for no population, or below 10 effective samples.
    """
    if not placed.population:
        raise InputError(f"--reweight: {placed.told}")
    weights, pairs = weights_of(campaign, wanted)
    ok, gone, index = good(campaign), lost(campaign), campaign["sample"].to_numpy()
    run = ok | gone
    if (count := effective(weights[run])) < LEAST_EFFECTIVE:
        raise InputError(
            f"--reweight {', '.join(wanted)}: {run.sum()} samples are worth {count:.2g} "
            f"effective ones, and at least {LEAST_EFFECTIVE:g} are needed: choose a distribution "
            "closer to the old one, reweight fewer inputs, or run a campaign with it"
        )
    found: dict[str, Any] = {}
    for name, variable in quantities().items():
        values = numbers(campaign, name)
        known = ok & np.isfinite(values) & (weights > 0)
        if name not in campaign or effective(weights[known]) < LEAST_EFFECTIVE:
            continue
        rows = np.array([
            _told(values[known], weights[known], level, placed, placed.replicate_of(index[known]))
            for level in REWEIGHTED_STATISTICS.values()
        ])  # fmt: skip
        says = about(f"reweighted estimates of: {name}", variable.units)
        found[f"{name}_reweighted"] = "reweighted_statistic", rows[:, 0], says
        found[f"{name}_reweighted_interval"] = (
            ("reweighted_statistic", "bound"), rows[:, 1:3], says,
        )  # fmt: skip
        found[f"{name}_decisive_samples"] = (
            "reweighted_statistic", rows[:, 3],
            about("effective samples that determine each estimate"),
        )  # fmt: skip
        found[f"{name}_effective_samples"] = (
            (), effective(weights[known]), about("effective samples"),
        )  # fmt: skip
    cap, shares, words = None, list[tuple[float, ...]](), list[str]()
    by = placed.replicate_of(index[run])
    for word, (own, of) in _events(campaign, requirements, ok, gone).items():
        share, ends = mean(own[of].astype(float), weights[of]), NONE
        decisive = decisive_of_share(own[of], weights[of])
        # What failed runs would have done nobody knows: from none of them to all.
        both = own[run], (own | gone)[run]
        if has_share_intervals(placed) and decisive >= LEAST_OF_SHARE:
            least, most = (share_interval(each, weights[run], by) for each in both)
            ends = least[0], most[1]
        elif has_share_intervals(placed):
            cap = cap or Cap(pairs, int(run.sum()), (1 - LEVEL) / 2)
            ends = _rarer(cap, both[0], ~both[1], weights[run], by)
        words.append(word)
        shares.append((share, *ends, decisive))
    told = np.array(shares).reshape(-1, 4)
    says = about("share with the new distributions of the inputs")
    found["reweighted_share"] = "event", told[:, 0], says
    found["reweighted_share_interval"] = ("event", "bound"), told[:, 1:3], says
    found["reweighted_share_decisive"] = (
        "event", told[:, 3], about(
            "effective samples in the event, or outside of it if these are fewer"),
    )  # fmt: skip
    if requirements and ok.any():
        found |= _verdicts(campaign, requirements, placed, weights, pairs)
    found["effective_samples"] = (), count, about("effective samples of all that ran")
    found["reweighted_samples"] = (), int(run.sum()), {"long_name": "samples that ran"}
    laws = {path: law.model_dump(mode="json", exclude_none=True) for path, law in wanted.items()}
    found["reweighted_to"] = (), json.dumps(laws), {"long_name": "distributions by path (JSON)"}
    coords = {
        "reweighted_statistic": [*REWEIGHTED_STATISTICS], "event": np.array(words, dtype=object),
        "bound": ["lower", "upper"],
    }  # fmt: skip
    return xr.Dataset(found, coords=coords)


def _rarer(cap: Cap, own: Mask, others: Mask, weights: Array, replicate: Replicate) -> Interval:
    """Interval of the share of some samples, whatever those that are neither own nor others would
    have done, from bounds of the rarer ones.
    """
    rare, rest = (own, others) if weights @ own < weights @ others else (others, own)
    low, high = (cap.bounds(each, weights, replicate) for each in (rare, ~rest))
    ends = low[0], high[1]
    return ends if rare is own else (1.0 - ends[1], 1.0 - ends[0])


def _verdicts(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement], placed: Placement,
    weights: Array, pairs: Mapping[str, Pair],
) -> dict[str, Any]:  # fmt: skip
    """Verdicts along ``requirement`` for the other distributions, by one-sided bounds that count
    lost runs as violating for the lower one and as keeping to it for the upper one.
    """
    held, run = good(campaign), ran(campaign)
    replicate, rows = placed.replicate_of(campaign["sample"].to_numpy()[run]), []
    rule = rule_of(campaign.attrs)
    for name, wanted in requirements.items():
        broken, ends = violations(campaign, name, wanted), NONE
        levels = wanted.confidence, wanted.confidence
        if rule is not None:  # it ended the campaign by its results
            levels = rule.levels(name, wanted, looked_at(campaign), placed.replicates)
        if has_share_intervals(placed):
            for end, level, own in zip((0, 1), levels, (broken | ~held, broken), strict=True):
                cap = Cap(pairs, int(run.sum()), 1.0 - level)
                found = _rarer(cap, ~own[run], own[run], weights[run], replicate)
                ends = (found[0], ends[1]) if end == 0 else (ends[0], found[1])
        verdict = verdict_of(*ends, wanted.probability)
        rows.append((verdict, mean((~broken[held]).astype(float), weights[held]), *ends))
    told = np.array(rows)
    words = "probability of meeting the requirement with the new distributions of the inputs"
    return {
        "reweighted_verdict": (
            "requirement", told[:, 0].astype("i1"),
            about("verdict with the new distributions of the inputs") | flags_of(Verdict),
        ),
        "reweighted_probability": ("requirement", told[:, 1], about(words)),
        "reweighted_bounds": (
            ("requirement", "bound"), told[:, 2:], about(f"one-sided bounds of the {words}"),
        ),
    }  # fmt: skip


def has_share_intervals(placed: Placement) -> bool:
    """Whether weighted shares and quantiles have intervals.

    Shares of a few Sobol' points take few values: 8 replicates held the truth in 91 of 100
    campaigns, 16 in 94 to 97.
    """
    few = placed.kind in SOBOL and placed.replicates < LEAST_REPLICATES
    return placed.has_intervals and not few


def _told(
    values: Array, weights: Array, level: float | None, placed: Placement, replicate: Any
) -> tuple[float, ...]:
    """Estimate of the mean, or of a quantile, its interval if the design has some, and how many
    effective samples decide it.
    """
    if level is None:
        middle, ends = mean(values, weights), NONE
        if placed.has_intervals:
            ends = mean_interval(values, weights, replicate)
        return (middle, *ends, decisive_of_mean(values, weights))
    middle, ends = quantile(values, weights, level), NONE
    if has_share_intervals(placed):
        ends = quantile_interval(values, weights, level, replicate)
    # Beyond the outermost weights there is no estimate, and nothing that would decide one.
    decisive = decisive_of_share(values <= middle, weights) if np.isfinite(middle) else 0.0
    return (middle, *ends, decisive)


def _events(
    campaign: xr.Dataset, requirements: Mapping[str, Requirement], ok: Mask, gone: Mask
) -> dict[str, tuple[Mask, Mask]]:
    """What may happen to a sample: which it happened to, of all that ran; of those that hold."""
    found: dict[str, tuple[Mask, Mask]] = {}
    if OUTCOME in campaign and ok.any():
        words = endings(campaign)
        kinds = [word for word in kinds_of_ends(words) if not word.startswith(LOST)]
        found = {word: (words == word, ok | gone) for word in kinds}
    if gone.any():
        found[FAILED_RUNS] = gone, ok | gone
    for name, each in requirements.items() if ok.any() else ():
        found[each.told(name)] = ok & ~violations(campaign, name, each), ok
    return found
