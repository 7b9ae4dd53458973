"""Main numbers of a run in words: their unit, their digits, and how far they are from limits."""

from __future__ import annotations

import numpy as np

from ringsim.outputs.balance import summary
from ringsim.outputs.recorder import against_limits
from ringsim.scene import load_scene


def test_numbers_end_with_the_digits_of_their_error_bars() -> None:
    values = {
        "deployment_time": np.array(32.4713), "deployment_time_error": np.array(0.02),
        "peak_rod_stress": np.array(3.01834e7), "peak_rod_stress_error": np.array(3.6e5),
        "peak_tension": np.array(31.968),
    }  # fmt: skip
    told = {name: " ".join(text.split()) for name, text in summary(values, {}).items()}
    assert told["deployment_time"] == "32.47 s +- 0.02"
    assert told["peak_rod_stress"] == "30.18 MPa +- 0.36"
    assert told["peak_tension"] == "31.968 N"  # no error is known


def test_a_tension_that_is_larger_behind_the_last_lock_is_no_peak_and_told() -> None:
    """In single precision, as files have it, 31.968 N are larger by 1e-8 of it."""
    values = {"peak_tension": np.array(31.968)}
    for most, more in ((31.968, False), (32.0, True)):
        values["cable_tension"] = np.array([[[np.nan, 12.0, most]]], dtype="f4")
        told = summary(values, {})["peak_tension"]
        assert told.endswith("; more than that after the last lock") == more


def test_slack_is_told_from_when_on_and_where_if_there_was_some() -> None:
    places = {"plane": "upper", "span": 3, "time": 9.25}
    values = {f"longest_slack_{name}": np.array(each) for name, each in places.items()}
    values["longest_slack"] = np.array(18.9)
    spans = {"upper": ("winch to a", "a to b", "b to c")}
    told = " ".join(summary(values, spans)["longest_slack"].split())
    assert told == "18.9 s from 9.25 s on: upper, span 3 (b to c)"
    assert "longest_slack" not in summary({"longest_slack": np.array(0.0)}, spans)


def test_a_deployment_time_tells_which_joints_lock_last() -> None:
    """Those within the error bar of the time, the latest first; the ties of joints that move alike
    where no error is known; not all names of many."""
    values = {
        "deployment_time": np.array(12.0), "plane": np.array(["lower", "upper"]),
        "section": np.arange(1, 4), "lock_time": np.array([[11.0, 11.98, 12.0], [9.0, 11.99, 8.0]]),
    }  # fmt: skip

    def told() -> str:
        return " ".join(summary(values, {})["deployment_time"].split()[2:])

    assert told() == "(last: lower 3)"
    values["deployment_time_error"] = np.array(0.015)
    assert told() == "+- 0.015 (last: lower 3, or by the error bar upper 2)"
    values["deployment_time_error"] = np.array(3.4)
    more = "upper 2, lower 2, lower 1, 1 more"
    assert told() == f"+- 3.4 (last: lower 3, or by the error bar {more})"
    values["deployment_time_error"] = np.array(5.0)
    assert told() == "+- 5 (which is last the error bar does not tell)"
    del values["deployment_time_error"]
    values["lock_time"] = np.array([[11.0, 12.0, 12.0 - 1e-12], [9.0, 12.0, 8.0]])
    assert told() == "(last: lower 2, upper 2, lower 3)"
    values["lock_time"] = np.full((2, 3), 12.0)
    assert told() == "(all at once)"
    values["deployment_time_error"] = np.array(0.1)
    assert told() == "+- 0.1 (all at once)"
    del values["deployment_time_error"]
    values["lock_time"] = np.array([[11.0, np.nan, 12.0], [9.0, 12.0, 8.0]])
    assert told() == ""
    alone = {
        "plane": np.array(["upper"]),
        "section": np.array([1]),
        "lock_time": np.array([[12.0]]),
    }
    values |= alone
    assert told() == ""


def test_loads_are_told_by_how_far_they_are_from_their_limits() -> None:
    limits = {"limits.tension": 40.0, "limits.rod_stress": 3e7, "record.stress": True}
    scene = load_scene("ring18-cable").with_values(limits)
    values = {
        "cable_tension": np.array([[[np.nan, 12.0, 30.0]]]), "peak_tension": np.array(20.0),
        "rod_stress": np.array([[[1e6, 2e6]]]), "peak_rod_stress": np.array(2.7e7),
    }  # fmt: skip
    # Behind the last lock a tension counts as well.
    assert sorted(against_limits(scene, values)) == [
        "largest rod stress: margin +0.111 (limit / value - 1) to limits.rod_stress = 30 MPa",
        "largest tension: margin +0.333 (limit / value - 1) to limits.tension = 40 N",
    ]
    assert not list(against_limits(load_scene("ring18-cable"), values))
    of_slack = load_scene("ring18-cable").with_values({"limits.slack_duration": 30.0})
    (slack,) = against_limits(of_slack, values | {"longest_slack": np.array(8.0)})
    assert slack == (
        "longest slack: margin +2.75 (limit / value - 1) to limits.slack_duration = 30 s"
    )
    values["peak_tension"] = np.array(50.0)  # its outcome is "overloaded", and says so
    over, _ = sorted(against_limits(scene, values), reverse=True)
    assert over == "largest tension: margin -0.2 (limit / value - 1) to limits.tension = 40 N"
