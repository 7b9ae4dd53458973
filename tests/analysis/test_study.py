"""What the analysis of a campaign tells, beside every number how many samples it is from."""

from __future__ import annotations

import json

import numpy as np
import pytest
import scipy.stats
import xarray as xr
from loops import for_each
from made_campaign import made_campaign

from made import campaign, points, response
from ringsim.analysis.derived import Derived, declare, forget
from ringsim.analysis.intervals import samples_needed, share_bounds
from ringsim.analysis.requirements import to_json
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import OF_ERRORS, told
from ringsim.analysis.verdicts import Verdict, verdict_table
from ringsim.refusal import InputError
from ringsim.tables import bound_text
from ringsim.variables import Fate, Status

pytestmark = pytest.mark.quick

MOST_TEN = {"asynchrony_max": {"max": 10.0, "probability": 0.99, "confidence": 0.9}}


def verdict(found, name="asynchrony_max", which="verdict"):
    return Verdict(int(found[which].sel(requirement=name)))


def text_of(found):
    return "\n".join(told(found, full=True))


def test_estimates_are_those_of_numpy():
    values = response(points("random", 200, 1, 0))
    found = analyse(campaign(values))
    own = found.asynchrony_max
    assert own.sel(statistic="mean").item() == pytest.approx(values.mean(), rel=1e-14)
    assert own.sel(statistic="standard_deviation").item() == pytest.approx(values.std(ddof=1))
    assert own.sel(statistic="quantile_95").item() == np.quantile(values, 0.95)
    assert own.attrs["units"] == found.asynchrony_max_interval.attrs["units"] == "degree"
    first = found.asynchrony_max_convergence.sel(part=0.25, statistic="median").item()
    assert first == np.median(values[:50])
    assert found.asynchrony_max_samples.values.tolist() == [200, 0, 0, 0]
    inside = found.asynchrony_max_interval.sel(statistic="mean").values
    assert inside[0] < own.sel(statistic="mean") < inside[1]


def test_every_variable_has_a_unit_and_says_what_it_is():
    found = analyse(campaign(np.arange(300.0)), MOST_TEN)
    for name, variable in found.data_vars.items():
        assert variable.attrs["long_name"], name
        assert variable.dtype.kind == "O" or variable.attrs["units"], name


def test_an_analysis_is_written_and_read_again(tmp_path):
    from ringsim.dataset import save

    found = analyse(campaign(np.arange(300.0)), MOST_TEN)
    save(found, tmp_path / "analysis.nc")
    xr.testing.assert_identical(found.load(), xr.load_dataset(tmp_path / "analysis.nc"))


@pytest.mark.parametrize(("count", "found"), [(230, Verdict.MET), (229, Verdict.NOT_YET_SHOWN)])
def test_230_samples_without_a_violation_show_99_of_100(count, found):
    shown = analyse(campaign(np.full(count, 9.0)), MOST_TEN)
    assert verdict(shown) == found
    assert shown.further_samples.item() == (1 if count == 229 else -1)
    bound = shown.probability_lower.item()
    assert bound == pytest.approx(0.1 ** (1 / count), rel=1e-9)  # closed form of no violation


def test_too_many_violations_are_not_met():
    values = np.where(np.arange(100) < 10, 11.0, 9.0)
    found = analyse(campaign(values), MOST_TEN)
    assert verdict(found) == Verdict.NOT_MET
    assert found.samples_violating.item() == 10
    assert found.further_samples.item() == -1
    assert "not met" in text_of(found)


def test_lost_samples_count_as_the_worst_for_either_verdict():
    status = np.where(np.arange(240) < 10, Status.TIMEOUT, Status.OK)
    values = np.where(status == Status.OK, 9.0, np.nan)
    found = analyse(campaign(values, status=status, outcome=np.where(status, 0, 1)), MOST_TEN)
    assert verdict(found) == Verdict.NOT_YET_SHOWN
    assert verdict(found, which="verdict_of_used") == Verdict.MET
    low, high = found.probability_lower.item(), found.probability_upper.item()
    assert (low, high) == pytest.approx((share_bounds(230, 240, 0.9)[0], 1.0))
    assert (found.samples_used.item(), found.samples_lost.item()) == (230, 10)
    assert found.asynchrony_max_samples.values.tolist() == [230, 10, 0, 0]
    assert found.outcome_samples.sel(kind="failed: timeout").item() == 10
    assert found.outcome_of.sel(kind="failed: timeout").item() == 240
    assert found.outcome_share.sel(kind="deployed").item() == pytest.approx(230 / 240)
    assert found.outcome_lost.sel(kind="deployed").item() == 10
    # More violations than a hundredth, were all lost ones sound: not met all the same.
    many = analyse(campaign(values + 2 * (np.arange(240) > 200), status=status), MOST_TEN)
    assert verdict(many) == Verdict.NOT_MET
    assert many.probability_upper.item() == pytest.approx(share_bounds(201, 240, 0.9)[1])


def test_further_samples_would_show_only_what_lost_ones_leave_open():
    status = np.where(np.arange(100) < 10, Status.TIMEOUT, Status.OK)
    made = campaign(np.full(100, 9.0), status=status, outcome=np.where(status, 0, 1))
    assert (
        f"asynchrony_max: {samples_needed(10, 0.99, 0.9) - 100} further samples without a "
        "violation would prove it (if the 10 failed runs are counted as violations)"
    ) in text_of(analyse(made, MOST_TEN))
    assert "chance of" not in text_of(analyse(made, MOST_TEN))
    few = {"asynchrony_max": {"max": 10.0, "probability": 0.6, "confidence": 0.9}}
    violating = np.where(np.arange(20) < 8, 11.0, 9.0)
    found = analyse(campaign(violating), few)
    more = found.further_samples.item()
    assert (
        f"asynchrony_max: 8 of 20 violate it so far; {more} further samples without a violation "
        f"would prove it, which has a chance of {0.6**more:.1g} at such a share"
    ) in text_of(found)
    low = {"asynchrony_max": {"max": 10.0, "probability": 0.3, "confidence": 0.99}}
    (line,) = (each for each in text_of(analyse(campaign(np.full(4, 11.0)), low)).splitlines()
               if "would prove it" in each)  # fmt: skip
    assert line.endswith("would prove it, which has a chance below 1e-06 at such a share")
    status[:] = Status.TIMEOUT
    found = analyse(made.assign(status=("sample", status)), MOST_TEN)
    assert found.further_samples.item() == -1
    assert "further sample" not in text_of(found)
    assert "asynchrony_max: no sample has a valid result for it" in text_of(found)


def test_rings_that_never_opened_are_counted_beside_the_limit_that_they_keep_to():
    outcome = np.where(np.arange(240) < 5, Fate.STALLED, Fate.DEPLOYED)
    outcome[5] = Fate.FINISHED
    values = np.where(outcome == Fate.STALLED, 0.0, 9.0)
    values[:2] = 11.0
    made = campaign(values, outcome=outcome)
    found = analyse(made, MOST_TEN)
    assert found.samples_short.item() == 3
    line = (
        "asynchrony_max: 3 of the 238 samples that meet it ended before all V-joints had come to "
        "180 deg"
    )
    assert line in text_of(found)
    assert 'set a requirement on the outcome, too: outcome = { is = "deployed"' in text_of(found)
    outcome_too = {"outcome": {"is": "deployed", "probability": 0.9, "confidence": 0.9}}
    found = analyse(made, MOST_TEN | outcome_too)
    assert line in text_of(found)
    assert "set a requirement on the outcome" not in text_of(found)
    assert found.samples_short.values.tolist() == [3, 0]
    assert "short of their goal" not in text_of(analyse(campaign(np.full(240, 9.0)), MOST_TEN))
    # What ends at 180 deg is final for rings whose latches then miss; the shock of these is not.
    made = campaign(values, outcome=np.where(outcome == Fate.STALLED, Fate.NOT_LATCHED, outcome))
    made["deployment_time"] = "sample", np.full(240, 5.0)
    other = ("peak_tension", "least_drive_margin", "peak_lock_impulse")
    made = made.assign(dict.fromkeys(other, made["asynchrony_max"]))
    most_ten = dict.fromkeys([*made.data_vars.keys() & other, "asynchrony_max"],
                             MOST_TEN["asynchrony_max"])  # fmt: skip
    short = analyse(made, most_ten).samples_short.to_series().to_dict()
    assert short == dict.fromkeys(most_ten, 0) | {"peak_lock_impulse": 3}
    own = {"twice": "2 * peak_tension", "shaken": "peak_tension * peak_lock_impulse"}
    declare({name: Derived(of=text) for name, text in own.items()})
    try:
        made = made.assign(dict.fromkeys(own, made["asynchrony_max"]))
        short = analyse(made, dict.fromkeys(own, MOST_TEN["asynchrony_max"])).samples_short
        assert short.to_series().to_dict() == {"twice": 0, "shaken": 3}
    finally:
        forget(own)


def test_an_antenna_that_never_deploys_violates_a_deployment_time():
    outcome = np.where(np.arange(50) < 5, Fate.STALLED, Fate.DEPLOYED)
    times = np.where(outcome == Fate.DEPLOYED, 8.0, np.nan)
    made = campaign(np.full(50, 9.0), outcome=outcome, deployment_time=times)
    wanted = {"deployment_time": {"max": 10.0, "probability": 0.99, "confidence": 0.9}}
    found = analyse(made, wanted)
    assert found.samples_violating.item() == found.samples_without_value.item() == 5
    assert verdict(found, "deployment_time") == Verdict.NOT_MET
    assert found.deployment_time_samples.values.tolist() == [45, 0, 5, 0]
    assert "violations without a value (the antenna did not get that far): 5" in text_of(found)


def test_samples_that_have_not_run_are_neither_used_nor_lost():
    status = np.where(np.arange(40) < 10, -1, Status.OK)
    found = analyse(campaign(np.full(40, 1.0), status=status), MOST_TEN)
    assert found.asynchrony_max_samples.values.tolist() == [30, 0, 0, 10]
    assert found.samples_used.item() == 30
    assert verdict(found) == Verdict.NOT_YET_SHOWN


def test_all_requirements_together_are_counted_with_the_bound_of_what_keeps_to_all():
    """Failed runs keep to none; the confidence is the largest that was asked for."""
    made = made_campaign(40, failed=(3,))
    angles, loads = (made[name].values for name in ("asynchrony_max", "peak_tension"))
    most = np.nanquantile(angles, 0.8), np.nanquantile(loads, 0.7)
    kept = int(((angles <= most[0]) & (loads <= most[1]) & (made["status"].values == 0)).sum())
    wanted = {
        "asynchrony_max": {"max": most[0], "probability": 0.5, "confidence": 0.9},
        "peak_tension": {"max": most[1], "probability": 0.5, "confidence": 0.95},
    }
    found = analyse(made, wanted)
    assert int(found.together_samples) == kept < 0.8 * 40
    assert int(found.together_of) == 40
    least = scipy.stats.beta.ppf(0.05, kept, 40 - kept + 1)
    assert float(found.together_probability_lower) == pytest.approx(least)
    line = f"both requirements together: {kept} of 40 samples meet them (1 failed run counted as "
    line += "not meeting them), a probability of at least"
    (own,) = (note for note in verdict_table(found).notes if note.startswith(line))
    assert "if their numbers hold" not in own
    # Numbers that a run doubts may move them all: so says the line, as each verdict does.
    text = (
        "; steps of 9 ms at the lock at 1 s are too long for shocks, so peak_tension may be off: x"
    )
    words = np.array([f"done{text}"] * 40)
    doubted = analyse(made.assign(reason=("sample", words)), wanted)
    (own,) = (note for note in verdict_table(doubted).notes if note.startswith(line))
    assert bool(doubted["verdict_may_change"].any()) == own.endswith(", if their numbers hold")
    assert bool(doubted["verdict_may_change"].any())
    few = analyse(
        made, wanted | {"peak_tension": {"max": 0.0, "probability": 0.5, "confidence": 0.95}}
    )
    most = scipy.stats.beta.ppf(0.95, 2, 39)  # the failed run may have met them
    assert float(few.together_probability_upper) == pytest.approx(most)
    line = "both requirements together: 0 of 40 samples meet them (1 failed run that may have met "
    line += f"them), a probability of at most {bound_text(most, upper=True)} (confidence"
    assert any(note.startswith(line) for note in verdict_table(few).notes)
    # Where looks share the error, so does the bound of all: no more than that of any.
    rule = {"conditions": [{"requirement": name} for name in wanted], "looks": {"first": 8}}
    made.attrs["stop_when"] = json.dumps(rule)
    looked = analyse(made, wanted)
    least = float(looked.together_probability_lower)
    assert least < float(found.together_probability_lower)
    assert least <= float(looked.probability_lower.min())
    assert "together_of" not in analyse(made, {"peak_tension": wanted["peak_tension"]})


def test_requirements_of_the_file_are_judged_and_outcomes_are():
    from ringsim.analysis.requirements import read_requirements

    made = campaign(np.full(300, 9.0))
    wanted = MOST_TEN | {"outcome": {"is": "deployed", "probability": 0.9, "confidence": 0.9}}
    made.attrs["requirements"] = to_json(read_requirements(wanted, "test"))
    found = analyse(made)
    assert found.requirement.values.tolist() == ["asynchrony_max", "outcome"]
    assert verdict(found, "outcome") == Verdict.MET
    assert found.requirement_text.values.tolist() == [
        "asynchrony_max <= 10 deg", "outcome is deployed"
    ]  # fmt: skip


def test_outcomes_are_rows_with_exact_intervals():
    outcome = np.where(np.arange(100) < 7, Fate.PARTLY_DEPLOYED, Fate.DEPLOYED)
    found = analyse(campaign(np.full(100, 9.0), outcome=outcome))
    own = found.sel(kind="partly deployed")
    assert own.outcome_share.item() == pytest.approx(0.07)
    # Clopper and Pearson's interval of 7 of 100, from their tables.
    np.testing.assert_allclose(own.outcome_share_interval.values, [0.0286, 0.1389], atol=1e-4)
    assert own.outcome_share_convergence.values[0] == pytest.approx(7 / 25)


@pytest.mark.parametrize("kind", ["sobol", "latin-hypercube"])
def test_one_design_has_estimates_but_no_intervals_and_replicates_have_both(kind):
    for replicates in (1, 8):
        values = response(points(kind, 256, replicates, 0))
        design = {"kind": kind, "samples": 256, "replicates": replicates}
        found = analyse(campaign(values, design=design), MOST_TEN)
        assert found.asynchrony_max.sel(statistic="mean").item() == values.mean()
        known = np.isfinite(found.asynchrony_max_interval.sel(statistic="median"))
        assert known.all() == (replicates == 8)
        assert ("no intervals" in text_of(found)) == (replicates == 1)
    assert "design.replicates = 8" not in text_of(found)


def test_replicates_that_scatter_more_than_independent_samples_widen_the_bounds():
    values = np.where(np.arange(800) % 8 == 0, 11.0, 9.0)  # one replicate violates throughout
    design = {"kind": "sobol", "samples": 800}
    wanted = {"asynchrony_max": {"max": 10.0, "probability": 0.8, "confidence": 0.95}}
    alone, parted = (
        analyse(campaign(values, design=design | {"replicates": each}), wanted) for each in (1, 8)
    )
    assert verdict(alone) == Verdict.MET
    assert verdict(parted) == Verdict.NOT_YET_SHOWN


@pytest.mark.parametrize("kind", ["grid", "list"])
def test_grids_and_lists_have_extremes_only(kind):
    found = analyse(campaign(np.arange(30.0), design={"kind": kind}), MOST_TEN)
    assert found.asynchrony_max.sel(statistic="maximum").item() == 29.0
    assert np.isnan(found.asynchrony_max.sel(statistic="mean"))
    assert np.isnan(found.outcome_share).all()
    assert verdict(found) == Verdict.NO_POPULATION
    assert found.samples_violating.item() == 19
    assert "do not represent a population" in text_of(found)


def test_a_file_without_a_design_has_extremes_alone():
    made = campaign(response(points("random", 60, 1, 0)))
    del made.attrs["design"]
    assert "is not known" in analyse(made).attrs["intervals"]


def test_errors_stand_side_by_side():
    values = np.random.default_rng(0).normal(9.0, 1.0, 100)
    bars = np.where(np.arange(100) % 8 == 0, 0.5, np.nan)
    more = {
        "asynchrony_max_error": bars, "asynchrony_max_checked": values + 0.02,
        "status_checked": np.where(np.arange(100) < 50, 0, -1),
    }  # fmt: skip
    found = analyse(campaign(values, **more))
    sampling, numerical, engines = found.asynchrony_max_error_of_mean.values
    assert sampling == pytest.approx(values.std(ddof=1) / 10)
    assert numerical == pytest.approx(0.5)
    assert engines == pytest.approx(0.02)
    assert told(found)[-2].split()[-1] == "numerical"
    assert told(found)[-1] == OF_ERRORS
    alone = analyse(campaign(values, asynchrony_max_error=bars))
    assert told(alone)[-2:] == [OF_ERRORS, "engines not measured"]
    assert told(alone)[-3].endswith(" numerical")


def test_a_campaign_of_which_every_run_failed_is_told():
    status = np.full(12, Status.DIVERGED)
    found = analyse(campaign(np.full(12, np.nan), status=status, outcome=np.zeros(12)), MOST_TEN)
    assert verdict(found) == Verdict.NOT_YET_SHOWN
    assert found.outcome_share.sel(kind="failed: diverged").item() == 1.0
    assert "12 of 12" in text_of(found)


@for_each(
    ("made", "wanted", "words"),
    [
        (xr.Dataset({"status": 0}), None, "this is not a campaign"),
        (
            campaign([1.0, 2.0]),
            {"peak_tension": MOST_TEN["asynchrony_max"]},
            "the file has no such output",
        ),
        (campaign([1.0, np.nan]), MOST_TEN, "1 sample reached the goal without a value"),
    ],
)
def test_what_cannot_be_judged_is_refused(made, wanted, words):
    with pytest.raises(InputError, match=words):
        analyse(made, wanted)
