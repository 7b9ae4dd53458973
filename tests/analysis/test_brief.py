"""An analysis in short: a row an output, and of inputs only those beyond chance."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr
from scipy.stats import beta

from made import drawn_campaign
from ringsim.analysis.influence import apart
from ringsim.analysis.influence_text import what_matters, what_separates
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import (
    OF_ERRORS,
    error_tables,
    sections,
    statistics_table,
    told,
)
from ringsim.sampling.designs.blocks import Saltelli
from ringsim.sampling.designs.independent import RandomDesign, Sobol

pytestmark = pytest.mark.quick


def linear(x):
    """Rises with x1 and falls with x2, of which x3 says nothing."""
    return 3.0 * x[:, 0] - x[:, 1]


@pytest.fixture(scope="module")
def found():
    return analyse(drawn_campaign(RandomDesign(samples=400), linear, 3, 4))


def test_what_matters_is_what_the_output_is_made_of(found):
    table = what_matters(found)
    named = [row[:2] for row in table.rows]
    assert named == [("asynchrony_max", "x1"), ("", "x2")]
    index, _, rank = (float(table.rows[0][k].split()[0]) for k in (2, 3, 4))
    assert index == pytest.approx(0.9, abs=0.03)  # 9 of 10 parts of the variance
    assert rank > 0.9
    assert table.rows[1][4].startswith("-0.")


def test_an_output_of_chance_alone_is_said_to_be_so():
    noise = np.random.default_rng(3).random(400)
    table = what_matters(analyse(drawn_campaign(RandomDesign(samples=400), lambda _: noise, 3, 4)))
    assert not table.rows
    assert table.notes[-1] == "no significant input for asynchrony_max"


def test_indices_that_few_samples_leave_open_are_no_sign_of_nothing():
    """8 replicates of 2 base samples: intervals are longer than all of the variance."""
    design = Saltelli(samples=16, replicates=8)
    wild = drawn_campaign(design, lambda x: np.exp(20.0 * x[:, 0]) * (1.0 + 1e-3 * x[:, 1]), 3, 4)
    table = what_matters(analyse(wild))
    # What few samples decide is listed if it is large, and what is next to nothing is not.
    assert [row[1] for row in table.rows] == ["x1"]
    open_ = "too few samples to tell what matters for asynchrony_max"
    listed = [row[:2] for row in table.rows]
    assert (open_ in table.notes) == (not listed)
    assert not any(note.startswith("no significant input") for note in table.notes)
    sure = drawn_campaign(Saltelli(samples=64, replicates=8), linear, 3, 4)
    table = what_matters(analyse(sure))
    assert table.rows[0][:2] == ("asynchrony_max", "x1")
    assert not any(
        note.startswith(("too few samples to tell", "no significant")) for note in table.notes
    )


def test_designs_without_intervals_are_judged_by_what_chance_would_reach():
    design = Sobol(samples=32)
    found = analyse(drawn_campaign(design, linear, 3, 4))
    assert np.isnan(found.asynchrony_max_rank_correlation_interval).all()
    table = what_matters(found)
    # x2 has a tenth of the variance: it stands out where x1 is held.
    assert abs(found.asynchrony_max_rank_correlation.sel(input="x2")) < 1.96 / 31**0.5
    assert found.asynchrony_max_partial_rank_correlation.sel(input="x2") < -0.8
    assert [row[1] for row in table.rows] == ["x1", "x2"]
    told = "fewer than one output in 20 would have an input listed (3 inputs in all, sections"
    assert told in table.notes[-1]
    late = analyse(drawn_campaign(design, linear, 3, 4, lost=lambda x: x[:, 0] > 0.7))
    assert np.isnan(late.separation_interval).all()
    ((group, name, *_),) = what_separates(late).rows
    assert group.startswith("failed")
    assert name == "x1"
    # What some input separates is not said to depend on none.
    assert not any("no significant" in n and "failed" in n for n in what_matters(late).notes)


def test_a_mean_beside_its_parts_is_told_once():
    friction = np.random.default_rng(6).random((600, 16))
    made = drawn_campaign(RandomDesign(samples=600), lambda x: x[:, 0], 1, 1)
    made["asynchrony_max"] = "sample", friction[:, 4:8].sum(axis=1) + 0.5 * friction[:, 12]
    made["friction"] = ("sample", "pulley"), friction, {"role": "input", "path": "friction"}
    every = analyse(made)
    named = [row[1] for row in what_matters(every).rows]
    # The mean of all goes with it as well, by those four: 0.51 of its ranks.
    assert every.asynchrony_max_rank_correlation.sel(input="mean of friction") > 0.4
    assert named[0] == "pulleys 5 to 8 of friction"
    assert set(named[1:]) <= {"pulleys 13 to 16 of friction", "pulley 13 of friction"}
    assert len(named) == 2


def test_which_of_a_mean_and_its_places_is_stronger_says_the_plain_correlation():
    """Partial ones hold other columns for a mean than for its places."""
    names = ["friction[1]", "mean of friction", "friction[2]", "force"]
    places = dict(zip(names, [("f", 0, 1), ("f", 0, 9), ("f", 1, 2), ("g", 0, 0)], strict=True))
    plain = xr.Dataset(
        {"peak_tension_rank_correlation": ("input", [0.76, -0.8, 0.3, 0.1])}, {"input": names}
    )
    assert apart(plain, "peak_tension", names, places) == ["mean of friction", "force"]
    assert apart(xr.Dataset(), "peak_tension", names, places) == [
        "friction[1]", "friction[2]", "force",
    ]  # fmt: skip


def test_what_rounding_leaves_is_no_result():
    made = drawn_campaign(RandomDesign(samples=400), linear, 3, 4)
    rounding = np.random.default_rng(1).normal(size=400)
    made["peak_tension"] = "sample", 1e-17 * rounding, {"units": "N"}
    made["deployment_time"] = "sample", 20.0 + 1e-14 * rounding, {"units": "s"}
    made["peak_latch_rate"] = "sample", 2e-9 + 1e-10 * rounding, {"units": "rad/s"}
    table = statistics_table(analyse(made))
    assert [row[0] for row in table.rows] == ["peak_latch_rate", "asynchrony_max"]
    assert table.notes[0] == "the same in all samples: deployment_time 20 s, peak_tension 0"


def test_what_differs_by_less_than_its_numerical_error_is_one_value():
    """Peaks are 40 N with errors of 0.1 N that go with x1, so that indices would name it."""
    made = drawn_campaign(RandomDesign(samples=400), linear, 3, 4)
    error = 0.1 * (2 * made["x1"].values - 1)
    bars = np.where(np.arange(400) % 10 == 0, 0.11, np.nan)  # of one sample in ten
    made["peak_tension"] = "sample", 40.0 + error, {"units": "N"}
    made["peak_tension_error"] = "sample", bars, {"units": "N"}
    one = analyse(made)
    table, told_of = statistics_table(one), "\n".join(told(one))
    assert [row[0] for row in table.rows] == ["asynchrony_max"]
    least, most = made.peak_tension.values.min(), made.peak_tension.values.max()
    inside = f"{least:.4g} .. {most:.4g} N, mean {made.peak_tension.values.mean():.4g}"
    assert table.notes == [
        "no sample is farther from the mean than the error bars (root mean square): "
        f"peak_tension {inside}, error bars 0.11"
    ]
    assert told_of.count("peak_tension") == 1
    # --full has its statistics, and a requirement brings it into the tables.
    full = statistics_table(one, every=True)
    assert [row[0] for row in full.rows] == ["asynchrony_max", "peak_tension"]
    bound = {"peak_tension": {"max": 40.0, "probability": 0.1, "confidence": 0.9}}
    required = analyse(made, bound)
    (row,) = (row for row in statistics_table(required).rows if row[0] == "peak_tension")
    assert [float(row[k]) for k in (8, 9)] == pytest.approx([least, most], rel=1e-3)
    (budget, *_) = error_tables(required)
    assert "peak_tension" in [each[0] for each in budget.rows]
    assert budget.notes[-2:] == [OF_ERRORS, "engines not measured"]
    # Of outputs of which not the same is measured by letters.
    checked = required.copy()
    checked["asynchrony_max_error_of_mean"][:] = [0.1, np.nan, 0.2]
    (budget, *_) = error_tables(checked)
    marks = {row[0]: row[-1] for row in budget.rows}
    assert marks == {"asynchrony_max": "engines (a)", "peak_tension": "numerical (b)"}
    assert budget.notes[-2:] == ["(a) numerical not measured", "(b) engines not measured"]
    why = "no sample is farther from the mean than the numerical error"
    less = f"not told, because {why}: peak_tension"
    assert less in what_matters(required).notes
    assert "peak_tension" not in one.output.values
    assert "peak_tension_rank_correlation" not in one
    # Half of that error is less than what is seen, and a single sample may be enough.
    made["peak_tension_error"] = "sample", bars / 2, {"units": "N"}
    assert "peak_tension" in [row[0] for row in statistics_table(analyse(made)).rows]
    made["peak_tension"][7] = 40.2
    made["peak_tension_error"] = "sample", bars, {"units": "N"}
    assert np.ptp(made["peak_tension"].values[:7]) < 0.2
    assert np.isnan(analyse(made).peak_tension_same_within)


def test_an_output_has_one_row_with_its_statistics(found):
    (row,) = statistics_table(found).rows
    mean, *_, least, most = found.asynchrony_max.values
    assert [float(row[k]) for k in (2, 8, 9)] == pytest.approx([mean, least, most], rel=1e-3)
    assert row[-1] == "400"


def test_the_short_form_is_shorter_and_names_the_long_one(found):
    short, long = told(found), told(found, full=True)
    assert len(short) < len(long)
    assert any("--full" in line for line in short)
    assert not any("--full" in line for line in long)


def test_a_weak_input_beside_a_strong_one_is_told_by_its_rank_correlation():
    """x1 has all but 1 % of the variance; x2 and x3 have less than chance gives of 20 inputs."""

    def output(x):
        return 10.0 * (x[:, 0] > 0.5) + 1.0 * x[:, 1] - 0.8 * x[:, 2]

    found = analyse(drawn_campaign(RandomDesign(samples=240), output, 20, 5))
    one = found.sel(output="asynchrony_max")
    assert (one.given_data_index < one.chance_level).sel(input=["x2", "x3"]).all()
    table = what_matters(found)
    assert sorted(row[1] for row in table.rows) == ["x1", "x2", "x3"]
    assert table.rows[0][1] == "x1"
    assert (
        "in 10 would have an input listed by its index or its partial rank correlation"
        in (table.notes[1])
    )


def test_outputs_without_an_index_in_blocks_are_told_by_inputs_and_not_by_groups():
    """A gate may bar the index of an output; its inputs then are none of the groups."""
    found = analyse(drawn_campaign(RandomDesign(samples=60), linear, 3, 4))
    found = found.drop_vars(["given_data_index", "given_data_index_interval", "chance_level"])
    found = found.assign_coords(factor=["one", "two"])
    empty = np.full((found.sizes["output"], 2), np.nan)
    found["total_index"] = ("output", "factor"), empty
    found["total_index_interval"] = ("output", "factor", "bound"), np.stack([empty] * 2, axis=-1)
    found["first_order_index"] = found["total_index"]
    found["first_order_index_interval"] = found["total_index_interval"]
    row = what_matters(found).rows[0]
    assert row[:3] == ("asynchrony_max", "x1", "-")


def test_an_interval_that_one_sample_decides_is_none():
    """39 values between 0 and 1, and one of 50 that alone has another x1: its square is nearly all
    of the scatter, and the index is that of one sample, with an interval longer than 1."""

    def output(x):
        return np.where(np.arange(40) == 0, 50.0, x[:, 1])

    made = drawn_campaign(RandomDesign(samples=40), output, 3, 5)
    made["x1"] = made["x1"].copy(data=1.0 * (np.arange(40) == 0))
    lines = told(analyse(made, {}, {"x2": {"kind": "uniform", "low": 0.0, "high": 0.7}}), full=True)
    (row,) = (line for line in lines if "standard deviation" in line and "asynch" in line)
    assert "one sample decides it" in row
    (row,) = (line for line in lines if line.startswith("asynchrony_max by x1"))
    assert "not known: few samples decide it" in row
    usual = told(
        analyse(drawn_campaign(RandomDesign(samples=60), lambda x: x[:, 1], 3, 5)), full=True
    )
    assert not any("decide it" in line or "decides it" in line for line in usual)


def test_a_mean_that_cannot_be_negative_has_no_interval_that_is():
    """Reweighted to where the one large value lies."""

    def output(x):
        return np.where(np.arange(60) == 7, 40.0, x[:, 1] ** 2)

    made = drawn_campaign(RandomDesign(samples=60), output, 2, 3)
    low = 0.5 * np.floor(2.0 * float(made["x2"][7]))
    law = {"x2": {"kind": "uniform", "low": low, "high": low + 0.5}}
    found = analyse(made, {}, law)
    ends = found["asynchrony_max_reweighted_interval"].sel(reweighted_statistic="mean").values
    assert ends[0] < 0.0 < ends[1]
    (row,) = (
        line for line in told(found, full=True)
        if line.startswith("asynchrony_max (few)") and "  mean  " in line
    )  # fmt: skip
    assert "not known: few samples decide it" in row


def test_what_hardly_differs_is_not_explained_unless_a_requirement_asks_for_it():
    """Of 40 N by 0.01 N, all of it x1's: no digit of it that tables give changes."""
    made = drawn_campaign(RandomDesign(samples=200), linear, 3, 4)
    made["peak_tension"] = "sample", 40.0 + 0.01 * made["x1"].values, {"units": "N"}
    told_of = "not listed, because samples differ by less than 0.1 %: peak_tension"
    table = what_matters(analyse(made))
    assert [row[0] for row in table.rows if row[0]] == ["asynchrony_max"]
    assert told_of in table.notes
    wanted = {"peak_tension": {"max": 41.0, "probability": 0.9, "confidence": 0.9}}
    assert "peak_tension" in [row[0] for row in what_matters(analyse(made, wanted)).rows]
    alone = what_matters(analyse(made.drop_vars("asynchrony_max")))  # then it is all there is
    assert [row[0] for row in alone.rows if row[0]] == ["peak_tension"]


def test_a_probability_is_bounded_where_no_sample_violates():
    """Of 40 samples without a violation 1 - 0.1^(1/40) = 0.0559 at 90 %."""
    made = drawn_campaign(RandomDesign(samples=40), linear, 2, 4)
    wanted = {"asynchrony_max": {"max": 9.0, "probability": 0.9, "confidence": 0.9}}
    assert round(1.0 - 0.1 ** (1 / 40), 5) == 0.05594
    assert (
        "no sample violates asynchrony_max: the probability of a violation is at most 0.05594 "
        "(confidence 0.9)"
    ) in told(analyse(made, wanted))


@pytest.mark.parametrize("bad", [0, 3])
def test_printed_bounds_hold_as_surely_as_the_computed_ones(bad):
    """Clopper and Pearson's quantiles of the beta distribution; of 12 samples without a violation
    1 - 0.1^(1/12) = 0.1746, which 0.17 would not bound.
    """
    made = drawn_campaign(RandomDesign(samples=12), linear, 2, 4)
    most = np.sort(made.asynchrony_max.to_numpy())[-1 - bad]
    wanted = {"asynchrony_max": {"max": most, "probability": 0.85, "confidence": 0.9}}
    lines = told(analyse(made, wanted))
    low = beta.ppf(0.1, 12 - bad, bad + 1)
    high = beta.ppf(0.9, 12 - bad + 1, bad) if bad else 1.0
    (row,) = (line for line in lines if line.startswith("asynchrony_max <= "))
    least, other = (float(found) for found in re.findall(r"at (?:least|most) ([\d.]+)", row))
    assert low - 1e-4 < least <= low
    assert high <= other < high + 1e-4
    (line,) = (line for line in lines if "a probability" in line or "the probability" in line)
    ends = [float(found) for found in re.findall(r"0\.\d+", line.partition("(conf")[0])]
    assert 1.0 - low <= ends[-1] < 1.0 - low + 1e-3
    assert not bad or 1.0 - high - 1e-4 < ends[1] <= 1.0 - high


def test_differences_of_rounding_are_told_as_zero_and_narrow_ranges_with_all_their_digits():
    made = drawn_campaign(RandomDesign(samples=40), linear, 2, 4)
    power = np.linspace(2.9994, 3.0, 40)
    made["peak_motor_power"] = "sample", power, {"units": "W"}
    checked = np.where(np.arange(40) % 20 == 0, power * (1.0 + 1e-9), np.nan)
    made["peak_motor_power_checked"] = "sample", checked, {"units": "W"}
    status = np.where(np.arange(40) % 20 == 0, 0, -1)
    made["status_checked"] = "sample", status, {}
    found = analyse(made)
    (line,) = [line for line in told(found) if line.startswith("peak_motor_power ")]
    assert line.split()[3:6] == ["0", "2", "0"]
    # A range that scatter makes of less than a thousandth is a note, not a row of statistics.
    note = "samples differ by less than 0.1 %: peak_motor_power 2.9994 .. 3.0000 W"
    assert note in statistics_table(found).notes
    every = next(r for r in statistics_table(found, every=True).rows if r[0] == "peak_motor_power")
    assert {"2.9997", "2.9994", "3.0000"} <= set(every)
    # What a requirement names stays a row.
    wanted = {"peak_motor_power": {"max": 3.1, "probability": 0.5, "confidence": 0.9}}
    rows = statistics_table(analyse(made, wanted)).rows
    assert "peak_motor_power" in [row[0] for row in rows]


def brief(made, wanted=None):
    """The sentences in short on a made campaign."""
    return sections(analyse(made, wanted), full=False)["short"].tables[0].notes


def test_the_sentences_on_top_say_what_the_tables_say():
    """Of a made campaign whose truth is known: x1 decides, and 40 % violate a limit."""
    made = drawn_campaign(RandomDesign(samples=400), linear, 3, 4)
    values = made["asynchrony_max"].values
    limit = float(np.sort(values)[239])
    wanted = {
        "asynchrony_max": {"max": limit, "probability": 0.9, "confidence": 0.9},
        "peak_tension": {"max": 1e9, "probability": 0.9, "confidence": 0.9},
    }
    made["peak_tension"] = "sample", np.linspace(1.0, 2.0, 400), {"units": "N"}
    lines = brief(made, wanted)
    said = "\n".join(lines)
    assert "of 400 samples: deployed 400" in lines
    text = (
        r"^requirements not met: asynchrony_max <= .* deg in 0.9 of all \(160 of 400 violate it\)$"
    )
    assert re.search(text, said, re.MULTILINE)
    assert "requirements met: peak_tension <= 1e+09 N in 0.9 of all" in lines
    text = r"^samples that violate asynchrony_max .* \(160\) differ by x1: larger in "
    assert re.search(text, said, re.MULTILINE)
    (line,) = (line for line in lines if line.startswith("asynchrony_max: "))
    mean, worst, sample, found = re.fullmatch(
        r"asynchrony_max: mean (\S+) deg, worst (\S+) deg in sample (\d+); goes most with (.*)",
        line,
    ).groups()
    assert float(mean) == pytest.approx(values.mean(), rel=0.01)
    assert float(worst) == pytest.approx(values.max(), rel=1e-3)
    assert int(sample) == values.argmax()
    assert found == "x1 and x2"
    # Nothing matters for a row of numbers.
    (line,) = (line for line in lines if line.startswith("peak_tension: "))
    assert "goes most" not in line


def test_the_sentences_name_the_larger_error_as_far_as_it_is_known():
    made = drawn_campaign(RandomDesign(samples=400), linear, 3, 4)
    for bar, source in ((0.3, "numerical"), (1e-6, "sampling")):
        made["asynchrony_max_error"] = "sample", np.full(400, bar), {"units": "degree"}
        told = f"largest error of a mean: {source} in asynchrony_max"
        assert told in brief(made)


def test_of_designs_that_repeat_values_only_the_samples_count_that_do():
    made = drawn_campaign(Saltelli(samples=64, replicates=8), linear, 3, 4)
    run = made.sizes["sample"]
    assert f"of 128 samples that count, of {run} that ran: deployed 128" in brief(made)


def test_failed_and_unfinished_runs_are_told_and_are_no_output():
    made = drawn_campaign(RandomDesign(samples=400), linear, 3, 4)
    lost = made["x1"].values.reshape(-1) > np.sort(made["x1"].values.reshape(-1))[340]
    for name in ("asynchrony_max",):
        made[name] = "sample", np.where(lost, np.nan, made[name].values), made[name].attrs
    made["status"] = "sample", np.where(lost, 2, 0), made["status"].attrs
    wanted = {"asynchrony_max": {"max": 1e3, "probability": 0.9, "confidence": 0.9}}
    lines = brief(made, wanted)
    (line,) = (line for line in lines if line.startswith("requirements "))
    assert "(59 failed runs)" in line
    assert not [line for line in lines if line.startswith("failed runs") and "goes most" in line]
    assert [line for line in lines if line.startswith("failed runs (59) differ by x1: larger in ")]


def test_a_campaign_that_has_not_run_says_so():
    made = drawn_campaign(RandomDesign(samples=8), linear, 3, 4)
    made["status"] = "sample", np.full(8, -1), made["status"].attrs
    assert brief(made) == ["no sample has run yet"]
