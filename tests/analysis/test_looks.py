"""Looking again and again errs no more often than a single look may."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binom

from made import campaign
from ringsim.analysis.design import placement
from ringsim.analysis.intervals import samples_needed, share_bounds
from ringsim.analysis.requirements import Condition, Requirement, Rule
from ringsim.analysis.study import analyse
from ringsim.analysis.verdicts import holds

RULE = Rule(conditions=[Condition(requirement="asynchrony_max")])
MOST = 2500


def ever(probability, wanted, side):
    """Probability that some look up to MOST says met (side 0) or not met (side 1).

    Exact: the number of violations is a Markov chain, whose distribution among the campaigns that
    no look has ended is carried from look to look.
    """
    alive, before, said = np.ones(1), 0, 0.0
    for count in RULE.numbers(MOST):
        step = binom.pmf(np.arange(count - before + 1), count - before, 1.0 - probability)
        alive, before = np.convolve(alive, step), count
        confidence = RULE.levels("asynchrony_max", wanted, count)[side]
        likely = np.flatnonzero(alive > 1e-12)
        bounds = [share_bounds(count - bad, count, confidence)[side] for bad in likely]
        ends = np.array(bounds) >= wanted.probability
        if side == 1:
            ends = np.array(bounds) < wanted.probability
        said += alive[likely[ends]].sum()
        alive[likely[ends]] = 0.0
    return said


LONG = [(0.9, 0.95), (0.7, 0.8)]


@pytest.mark.parametrize(
    ("probability", "confidence"),
    [(0.99, 0.9), *(pytest.param(*each, marks=pytest.mark.slow) for each in LONG)],
)
def test_all_looks_together_err_no_more_than_one_may(probability, confidence):
    wanted = Requirement(max=1.0, probability=probability, confidence=confidence)
    for side in (0, 1):  # just missed, or just kept to
        assert 0.0 < ever(probability, wanted, side) <= 1.0 - confidence


def test_without_the_parts_looks_would_err_more_often(monkeypatch):
    """The fault that the parts mend; else the test above could not fail."""
    wanted = Requirement(max=1.0, probability=0.9, confidence=0.95)
    monkeypatch.setattr(Rule, "levels", lambda *_: (0.95, 0.95))
    assert ever(0.9, wanted, 0) > 0.09


def test_a_good_antenna_is_soon_shown_to_be_one():
    """Without a violation the first look of enough samples ends it: 324, where 230 are needed."""
    wanted = Requirement(max=1.0, probability=0.99, confidence=0.9)
    assert ever(1.0, wanted, 0) == pytest.approx(1.0)
    looks = RULE.numbers(MOST)
    confidence = [RULE.levels("asynchrony_max", wanted, n)[0] for n in looks]
    shown = [n for n, c in zip(looks, confidence, strict=True) if n >= samples_needed(0, 0.99, c)]
    assert shown[0] == 324


def test_the_further_samples_of_a_rule_are_at_a_look_that_ends_it():
    made = campaign(np.full(216, 0.5), design={"kind": "random", "samples": 5000})
    made.attrs["stop_when"] = RULE.model_dump_json(exclude_none=True)
    wanted = {"asynchrony_max": {"max": 1.0, "probability": 0.99, "confidence": 0.9}}
    found = analyse(made, wanted)
    assert found.further_samples.item() == 324 - 216
    once = made.isel(sample=slice(90))
    assert "(1 look: 64)" in analyse(once, wanted).attrs["stopping"]
    more = campaign(np.full(324, 0.5))
    more.attrs |= made.attrs
    assert analyse(more, wanted).verdict.item() == 2
    # Beside the rule the bound of a look is wider than that of samples fixed before.
    assert found.confidence_lower.item() == 0.95
    plain = analyse(campaign(np.full(216, 0.5)), wanted)
    assert plain.probability_lower > found.probability_lower


def test_a_selection_of_a_campaign_that_ended_early_tells_its_looks():
    """Of 324 samples without a violation; bounds by hand, with the confidence of all of them."""
    wanted = {"asynchrony_max": {"max": 1.0, "probability": 0.99, "confidence": 0.9}}
    made = campaign(np.full(324, 0.5), design={"kind": "random", "samples": 5000})
    made.attrs |= {"stop_when": RULE.model_dump_json(exclude_none=True), "stopped_after": 324,
                   "planned_samples": 5000, "stop_reason": "it is met"}  # fmt: skip
    right = analyse(made, wanted)
    for chosen in (slice(3), slice(-100, None), np.arange(0, 324, 2)):
        part = made.isel(sample=chosen)
        found = analyse(part, wanted)
        assert found.attrs["stopping"] == right.attrs["stopping"]
        assert "ended the campaign after 324 of at most 5000 samples" in found.attrs["stopping"]
        assert found.confidence_lower.item() == right.confidence_lower.item()
        error = 1.0 - right.confidence_lower.item()
        assert found.probability_lower.item() == pytest.approx(error ** (1 / part.sizes["sample"]))


@pytest.mark.parametrize("quantile", [pytest.param(None, marks=pytest.mark.slow), 0.9])
def test_intervals_at_the_end_are_nearly_those_of_fixed_samples(quantile):
    """95 % intervals cover 92 % at least where their own length has ended the campaign."""
    wide = 0.12 if quantile is None else 0.25
    condition = Condition(of="asynchrony_max", quantile=quantile, half_width=wide)
    rule = Rule(conditions=[condition])
    random, truth = np.random.default_rng(5), np.log(10.0) if quantile else 1.0
    inside, lengths = [], []
    for _ in range(300):
        values = random.exponential(size=RULE.numbers(MOST)[-1])
        for count in rule.numbers(MOST):
            made = campaign(values[:count])
            if holds(rule, made, {}, placement(made)):
                break
        low, high = interval(values[:count], quantile)
        inside.append(low <= truth <= high)
        lengths.append(count)
    # At 92 % of 300 campaigns 257 or fewer would hold it once in 6,500 times.
    assert np.mean(inside) >= 258 / 300
    assert len(set(lengths)) > 1


def interval(values, quantile):
    from ringsim.analysis import intervals

    if quantile is None:
        return intervals.of_independent(values, np.mean)
    return intervals.quantile_of_independent(values, quantile)
