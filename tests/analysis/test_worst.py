"""What is told as worst is what an engineer fears: every output knows its bad end."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from loops import for_each
from made_campaign import made_campaign, with_motors

from made import campaign
from ringsim.analysis.campaign_notes import outcome_lines, peak_lines
from ringsim.analysis.comparison import compare
from ringsim.analysis.comparison_text import compared, sections
from ringsim.analysis.design import median_and_worst
from ringsim.analysis.intervals import quantities, worst_sample
from ringsim.analysis.requirements import read_requirements
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import outcome_table, statistics_table, told, verdict_lines
from ringsim.analysis.worst import margin_table, worst_tables
from ringsim.outputs import VARIABLES
from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.variables import Fate

pytestmark = pytest.mark.quick

BOUND = {"probability": 0.9, "confidence": 0.9}


def test_names_and_bad_ends_agree() -> None:
    """What an output calls itself says which end is feared."""
    for name, variable in quantities().items():
        if variable.dtype == "str" or name.endswith("_time") or "_time_" in name:
            continue
        if name.startswith("least_") and not name.endswith("_angle"):
            assert variable.worse == "smaller", name
        if name.startswith(("peak_", "total_")) or name.endswith("_max"):
            assert variable.worse == "larger", name
        if variable.largest_of or variable.least_of:
            assert variable.badness, name
            assert VARIABLES[variable.largest_of or variable.least_of].dims, name


def test_the_least_margin_of_all_samples_is_told_not_the_largest() -> None:
    made = with_motors(made_campaign(8, failed=(0,)))
    made["least_drive_margin_time"] = made["least_drive_margin"] * 0.0 + 1.5
    made["least_drive_margin_angle"] = made["least_drive_margin"] * 0.0 + 20.0
    # Sample 0 has -0.5, and is lost.
    [line] = [each for each in peak_lines(made) if each.startswith("least drive margin")]
    assert line == "least drive margin in sample 1: -0.400 at 20 deg and 1.5 s: NOT enough"
    found = analyse(made)
    assert int(found["least_drive_margin_worst_sample"]) == 1
    assert int(found["peak_tension_worst_sample"]) == 7
    table = statistics_table(found)
    at = list(table.head).index("worst sample")
    rows = {row[0]: row[at] for row in table.rows}
    assert (rows["least_drive_margin"], rows["peak_tension"]) == ("1", "7")


def with_limits(made: xr.Dataset, **limits: float) -> xr.Dataset:
    values = {f"limits.{name}": value for name, value in limits.items()}
    scene = load_scene("ring18-cable").with_values(values)
    return made.assign_attrs(scene=scene.to_toml())


def test_margins_to_limits_are_those_of_the_worst_sample_at_any_time() -> None:
    """Sample k peaks at 20 + k N; sample 2 goes to 29 N behind its last lock, and 7 is lost."""
    made = with_limits(made_campaign(8, failed=(7,)), tension=30.0)
    found = analyse(made)
    assert found["limit_text"].values.tolist() == ["limits.tension = 30 N"]
    assert found["limit_margin"].item() == pytest.approx(30.0 / 26.0 - 1.0)
    assert found["limit_sample"].item() == 6
    assert margin_table(found).rows[0][1] == "peak_tension"
    made["cable_tension"][2, 0, 0, -1] = 29.0
    found = analyse(made)
    assert found["limit_margin"].item() == pytest.approx(30.0 / 29.0 - 1.0)
    (row,) = margin_table(found).rows
    # A requirement on peak_tension, which ends with the last lock, would not see these 29 N.
    later = "cable_tension after the last lock, as recorded"
    assert row == ("limits.tension = 30 N", later, "29 N", "+0.0345", "2", "0 of 7")
    assert "limits.tension = 30 N" in "\n".join(verdict_lines(made))
    assert not margin_table(analyse(made_campaign(8))).rows


def test_overloaded_antennas_are_ordered_by_their_load_and_tell_it() -> None:
    """And those that deploy all the same have not ended before that."""
    made = with_limits(made_campaign(8), tension=23.5)
    over = made["peak_tension"].values > 23.5  # 24 .. 27 N
    made["outcome"] = "sample", np.where(over, int(Fate.OVERLOADED), made["outcome"].values)
    made["reason"] = "sample", np.array([
        f"all V-joints have reached 180 deg; {20 + k} N at 5 s, more than limits.tension = 23.5 N"
        for k in range(8)
    ], dtype=object)  # fmt: skip
    wanted = {"asynchrony_max": {"max": 90.0, **BOUND}}
    found = analyse(made, wanted)
    (table,) = (each for each in worst_tables(found, "f") if each.title.startswith("overloaded"))
    assert [row[:2] for row in table.rows] == [
        (str(k), f"{20 + k} N at 5 s, more than limits.tension = 23.5 N; "
         "all V-joints have reached 180 deg") for k in (7, 6, 5)
    ]  # fmt: skip
    # Overloaded, a ring may be open all the same.
    note = "of 4 samples overloaded, {} opened all the same"
    assert outcome_table(found).notes == [note.format(4)]
    line = next(each for each in outcome_lines(made) if each.startswith("overloaded"))
    told_of = "overloaded: 4 of 8, 4 of them opened all the same (samples 4, 5, 6, 7): "
    assert line.startswith(told_of)
    some = outcome_lines(made.isel(sample=[0, 6, 7]))
    assert any(each.startswith("overloaded: 2 of 3, 2 of them opened all the same (samples 6, 7): "
                               "sample 6: all V-joints") for each in some)  # fmt: skip
    assert not any("ended before" in line for line in told(found))
    # One whose latch has missed has not opened, though all V-joints came to 180 deg.
    caught = np.array([36] * 5 + [35, 36, 36])
    latched = made.assign(latched_joints=("sample", caught), locked_joints=("sample", [36] * 8))
    assert outcome_table(analyse(latched, wanted)).notes == [note.format(3)]
    (line,) = (each for each in outcome_lines(latched) if each.startswith("overloaded"))
    assert line.startswith("overloaded: 4 of 8, 3 of them opened all the same")
    made["deployment_time"][7] = np.nan
    assert outcome_table(analyse(made, wanted)).notes == [note.format(3)]
    assert any("1 of the 8 samples that meet it ended before" in line
               for line in told(analyse(made, wanted)))  # fmt: skip


def test_rings_over_a_limit_of_slack_are_ordered_by_it_and_may_open_all_the_same() -> None:
    """Samples 1 and 4 to 7 of 8 were slack for too long, and 1 has not opened; overloads are not
    ordered by slack."""
    slack = np.array([0.0, 2.0, 0.0, 0.5, 9.0, 11.0, 8.0, 10.0])
    made = made_campaign(8, stalled=(1,)).assign(longest_slack=("sample", slack))
    made["locked_joints"] = "sample", np.where(np.arange(8) == 1, 12, 36)
    made = with_limits(made, slack_duration=1.0, tension=21.0)
    fate = made["outcome"].to_numpy().copy()
    fate[slack > 1.0], fate[[2, 3]] = int(Fate.SLACKENED), int(Fate.OVERLOADED)
    made["outcome"] = "sample", fate
    wanted = {"asynchrony_max": {"max": 90.0, **BOUND}}
    found = analyse(made, wanted)
    of = {each.title.split(" (")[0]: each for each in worst_tables(found, "f")}
    assert [row[0] for row in of["slackened"].rows] == ["1", "5", "7"]
    assert [row[0] for row in of["overloaded"].rows] == ["3", "2"]
    assert outcome_table(found).notes == [
        "of 2 samples overloaded, 2 opened all the same",
        "of 5 samples slackened, 4 opened all the same",
    ]
    assert any("1 of the 8 samples that meet it ended before" in line for line in told(found))


def test_rings_that_did_not_latch_are_ordered_by_their_latches_then_by_their_rates() -> None:
    """All V-joints of samples 2 to 7 have come to 180 deg; where as many latches have missed, the
    slower one is the worse; a ring that stalled comes first."""
    made = made_campaign(8, stalled=(1,))
    joints = np.where(np.arange(8) == 1, 12, 36)
    rates = np.array([0.5, 0.5, 0.09, 0.08, 0.07, 0.06, 0.05, 0.04])
    made["locked_joints"] = "sample", joints
    made["latched_joints"] = "sample", joints - np.array([0, 0, 1, 2, 1, 2, 1, 1])
    made["least_latch_rate"] = "sample", rates
    fate = made["outcome"].to_numpy().copy()
    fate[2:] = int(Fate.NOT_LATCHED)
    made["outcome"] = "sample", fate
    found = analyse(made, {"outcome": {"is": "deployed", **BOUND}})
    samples = {
        each.title.partition(" (")[0]: [row[0] for row in each.rows]
        for each in worst_tables(found, "f")
    }
    assert samples["not latched"] == ["5", "3", "7"]
    assert samples["violates outcome is deployed"] == ["1", "5", "3"]


def test_a_limit_that_is_drawn_is_told_as_such() -> None:
    """Sample k peaks at 20 + k N and may have 30 - k N: 6 and 7 are beyond their own limits, though
    only 7 is beyond that of 6."""
    made = with_limits(made_campaign(8), tension=200.0)
    says = {"role": "input", "path": "limits.tension", "units": "N", "distribution": "{}"}
    made["limits_tension"] = "sample", 30.0 - np.arange(8.0), says
    (row,) = margin_table(analyse(made)).rows
    told_of = "limits.tension = 23 .. 30 N (drawn, 23 in sample 7)"
    assert row == (told_of, "peak_tension", "27 N", "-0.148: NOT enough", "7", "2 of 8")


def test_ropes_that_never_were_slack_count_as_within_the_limit() -> None:
    slack = np.zeros(8)
    slack[[2, 5]] = 3.0, 0.5
    made = with_limits(made_campaign(8).assign(longest_slack=("sample", slack)), slack_duration=1.0)
    (row,) = margin_table(analyse(made)).rows
    assert row[-2:] == ("2", "1 of 8")


def test_a_limit_that_is_passed_and_a_margin_that_is_short_are_told_above_the_verdicts() -> None:
    made = with_limits(with_motors(made_campaign(8, failed=(0,))), tension=20.0)
    wanted = {"asynchrony_max": {"max": 90.0, **BOUND}}
    lines = told(analyse(made, wanted))
    _, passed = (k for k, line in enumerate(lines) if line.startswith("limits.tension = 20 N"))
    _, short = (k for k, line in enumerate(lines) if line.startswith("least_drive_margin >= 0"))
    # 20 / 27 - 1; all but the lost one are beyond.
    assert lines[passed].split()[-7:] == ["-0.259:", "NOT", "enough", "7", "7", "of", "7"]
    least = made["least_drive_margin"].values[1:]
    assert lines[short].split()[-7:] == [
        "-0.4:", "NOT", "enough", "1", str((least < 0.0).sum()), "of", "7"
    ]  # fmt: skip
    assert max(passed, short) < next(k for k, line in enumerate(lines) if "verdict" in line)


def test_a_comparison_has_both_margins_to_the_limits_that_both_have() -> None:
    """Sample k peaks at 20 + k N, in the second at 1.5 times that; only the first limits slack."""
    first = with_limits(with_motors(made_campaign(8)), tension=30.0, slack_duration=1.0)
    second = with_limits(with_motors(made_campaign(8)), tension=30.0)
    second["peak_tension"], second["cable_tension"] = (
        1.5 * second[name] for name in ("peak_tension", "cable_tension")
    )
    found = compare(first, second)
    assert found["limit"].values.tolist() == ["limits.tension = 30 N", "least_drive_margin >= 0"]
    assert found["limit_value"].values == pytest.approx(np.array([[27.0, 40.5], [-0.5, -0.5]]))
    margins = [[30.0 / 27.0 - 1.0, 30.0 / 40.5 - 1.0], [-0.5, -0.5]]
    assert found["limit_margin"].values == pytest.approx(np.array(margins))
    (table,) = sections(found)["limits"].tables
    assert table.head == (
        "limit", "worst value in first", "worst value in second", "margin in first",
        "margin in second",
    )  # fmt: skip
    assert table.rows[0] == (
        "limits.tension = 30 N",
        "27 N",
        "40.5 N",
        "+0.111",
        "-0.259: NOT enough",
    )
    # Of two runs as of campaigns of one sample; each has the margin to its own limit.
    runs = [each.isel(sample=2, drop=True) for each in (first, second)]
    found = compare(*runs)
    assert found["limit_value"].values[0] == pytest.approx([22.0, 33.0])
    other = compare(first, with_limits(made_campaign(8), tension=31.0))
    (row,) = sections(other)["limits"].tables[0].rows
    assert row == ("limits.tension = 30 N and 31 N", "27 N", "27 N", "+0.111", "+0.148")
    assert "limits" not in sections(compare(first, made_campaign(8)))


def test_equal_values_take_the_first_sample_and_places_in_time_have_no_worst() -> None:
    made = campaign([2.0, 5.0, 5.0, np.nan], outcome=[1, 1, 1, 3])
    assert worst_sample(made, quantities()["asynchrony_max"]) == 1
    assert worst_sample(made, quantities()["least_drive_margin"]) == -1
    made["asynchrony_max_time"] = made["asynchrony_max"]
    assert worst_sample(made, quantities()["asynchrony_max_time"]) == -1
    assert median_and_worst(made) == (1, 2)


@pytest.mark.parametrize(("name", "sense"), [("peak_tension", 1), ("least_drive_margin", -1)])
def test_a_comparison_says_which_side_is_worse(name: str, sense: int) -> None:
    random = np.random.default_rng(0)
    values, seeds = random.normal(size=40), random.integers(0, 2**62, 40)

    def side(shift: float) -> xr.Dataset:
        more = {name: values + shift + 0.01 * random.normal(size=40), "sample_seed": seeds}
        return campaign(values, **more)

    def tells(line: str) -> bool:  # of the output, not of the margin to its limit
        return name in line and ">=" not in line

    for shift in (0.1, -0.1):
        [row] = [line for line in compared(compare(side(0.0), side(shift))) if tells(line)]
        assert ("second" in row.split()) == (sense * shift > 0.0)
        assert ("first" in row.split()) == (sense * shift < 0.0)
    [row] = [line for line in compared(compare(side(0.0), side(0.0))) if tells(line)]
    assert not {"first", "second"} & set(row.split())


SENSES = {
    "latch_rate": ("peak_latch_rate", "least_latch_rate"),
    "drive_margin": (None, "least_drive_margin"),
    "cable_tension": ("peak_tension", None),
    "rod_stress": ("peak_rod_stress", None),
    "asynchrony": ("asynchrony_max", None),
    "motor_torque": ("peak_motor_torque", None),
    "lock_impulse": ("peak_lock_impulse", None),
    "peak_acceleration": ("peak_acceleration_max", None),
    "lock_time": ("deployment_time", None),
    "slack_duration": (None, None),
}


@for_each("name", SENSES)
def test_a_limit_is_led_to_the_number_that_it_limits(name: str) -> None:
    """Never to the other end: it may keep to a limit that nearly all values break."""
    for key, wanted, other in zip(("max", "min"), SENSES[name], SENSES[name][::-1], strict=True):
        with pytest.raises(InputError) as refused:
            read_requirements({name: {key: 0.45, **BOUND}}, "m.toml")
        told = str(refused.value).replace(",", " ").replace(";", " ").split()
        word = "largest" if key == "max" else "least"
        assert (wanted in told) if wanted else f"no output tells its {word}" in str(refused.value)
        assert other is None or other == wanted or other not in told


def test_no_variable_is_led_to_a_number_of_another_sense() -> None:
    for name, variable in VARIABLES.items():
        if not variable.dims:
            continue
        for key, attribute in (("max", "largest_of"), ("min", "least_of")):
            with pytest.raises(InputError) as refused:
                read_requirements({name: {key: 0.45, **BOUND}}, "m.toml")
            words = str(refused.value).replace(",", " ").replace(";", " ").split()
            for other, one in VARIABLES.items():
                if not one.dims and other in words and (one.largest_of or one.least_of):
                    assert getattr(one, attribute) == name, (name, key, other)


def test_a_limit_that_some_samples_do_not_have_is_judged_by_the_others() -> None:
    made = made_campaign(8)  # peaks of 20 N and more, by one from sample to sample
    drawn = np.where(np.arange(8) % 2, "none", "22.0")
    law = '{"kind": "discrete", "values": [22.0, "none"]}'
    says = {"role": "input", "path": "limits.tension", "units": "N", "distribution": law}
    made["limits_tension"] = "sample", drawn, says
    (row,) = (row for row in margin_table(analyse(made)).rows if "limits.tension" in row[0])
    assert row[0] == "limits.tension = 22 N"
    assert row[2:] == ("26 N", "-0.154: NOT enough", "6", "2 of 4")


def test_of_no_pair_that_has_both_values_no_difference_is_told() -> None:
    """Four rings stall here and the other four there: their times are of other antennas."""
    first, second = made_campaign(8, stalled=[0, 1, 2, 3]), made_campaign(8, stalled=[4, 5, 6, 7])
    first["deployment_time"][4:], second["deployment_time"][:4] = [10, 11, 12, 13], [20, 21, 22, 23]
    for each in first, second:
        each["sample_seed"] = "sample", np.arange(8)
    found = compare(first, second)
    assert found.attrs["pairs"] == 8
    assert np.isnan(found.deployment_time_difference)
    rows = {row[0]: row for row in sections(found)["outputs"].tables[0].rows}
    assert rows["deployment_time"][2:] == ("11.5", "21.5", "4 and 4")


def test_parts_that_have_run_other_samples_are_not_paired_by_what_is_true() -> None:
    first, second = made_campaign(12, not_run=range(6, 12)), made_campaign(12, not_run=range(6))
    for each in first, second:
        each["sample_seed"] = "sample", np.arange(12)
    assert "samples are not paired: of no pair both have run" in "\n".join(
        compared(compare(first, second))
    )
