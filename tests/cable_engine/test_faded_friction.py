"""A run whose slip speed is too fast for its rope says so, in every fidelity."""

from __future__ import annotations

import math
from typing import Any

import pytest

from driven import outcome, truss
from ringsim.outputs.base import SMOOTHED, may_be_off
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run_frame
from ringsim.variables import Fate

SLOW = 5e-4
STALLED = {"kind": "stall", "speed": 0.05, "max_tension": 0.03}


def slowly(**values: Any) -> Scene:
    """The truss, half open, for a short while."""
    fields: dict[str, Any] = {
        "structure__opening_angle": 120.0,
        "solver__end_time": 2.0,
        "boom": "none",
        "both__winch__winding": {"kind": "constant", "speed": SLOW},
    }
    return truss(**(fields | values))


@pytest.mark.parametrize(
    "fidelity",
    [pytest.param(outcome, id="full", marks=pytest.mark.slow), pytest.param(run_frame, id="frame")],
)
def test_too_fast_a_slip_speed_is_named_with_its_cure(fidelity: Any) -> None:
    found = fidelity(slowly(cables__upper__slip_speed=2e-4))
    assert found.fate is Fate.CUT_OFF
    # 0.5 x 5e-4 m/s over 6 spans; the lower cable follows its winch.
    assert found.reason.endswith(
        " % too high: cables.upper.slip_speed = 0.0002 m/s must be at most 4.2e-05 m/s"
    )
    assert "cables.lower" not in found.reason


def test_both_cables_take_one_clause_behind_the_reason_of_the_run() -> None:
    """The cure is good for both: the lower cable is wound at half the speed of the upper one."""
    slower = {"kind": "constant", "speed": 0.5 * SLOW}
    found = run_frame(slowly(both__slip_speed=2e-4, cables__lower__winch__winding=slower))
    reason, remark = found.reason.split("; ")
    assert reason == "solver.end_time = 2 s was reached with 0 of 4 V-joints locked"
    assert remark.startswith("pulley friction is smoothed, tension far from the winch up to ")
    both = "cables.upper.slip_speed and cables.lower.slip_speed = 0.0002 m/s"
    assert f"{both} must be at most 2.1e-05 m/s" in remark
    assert len(remark) < 180


def test_friction_that_is_mostly_smoothed_away_is_told_as_such() -> None:
    """At a thousandth of the slip speed hardly any of the friction is left."""
    crawl = {"kind": "constant", "speed": 1e-6}
    heavy = {"kind": "bearing", "coefficient": 0.003}
    values = {"both__winch__winding": crawl, "both__friction": heavy, "both__slip_speed": 2e-4}
    reason = run_frame(slowly(**values)).reason
    assert "; much of the pulley friction is smoothed away: the ring moves too easily" in reason
    share = float(reason.partition("tensions are up to ")[2].partition(" %")[0])
    # Bearings (docs/theory/cables.md) at a right angle; V, two hinges, V: m spans v = 1.5 w / 6 lie
    # beyond each, and its friction acts by tanh(m v / s_slip).
    eta = (1.0 - 0.3 * math.cos(0.25 * math.pi)) / (1.0 + 0.3 * math.cos(0.25 * math.pi))
    lost = sum(1.0 - math.tanh(m * 1.5 * 1e-6 / 6.0 / 2e-4) for m in (1, 2, 2, 3))
    assert share == pytest.approx(100.0 * (eta**-lost - 1.0), abs=0.5)
    names, cures = may_be_off(reason)
    assert names == ["asynchrony_max", "peak_tension"]
    both = "cables.upper.slip_speed and cables.lower.slip_speed"
    assert cures == {SMOOTHED: f"set {both} = 8.3e-08 m/s"}


def test_that_a_ring_opens_is_in_doubt_where_friction_was_smoothed_away() -> None:
    """Its time, too; what stops short with little friction does so with all of it."""
    slips = {f"cables.{plane}.slip_speed": 0.1 for plane in ("upper", "lower")}
    scene = load_scene("ring18-motor").with_values(slips | {"structure.sections": 6})
    found = run_frame(scene)
    assert found.fate is Fate.DEPLOYED
    names, _ = may_be_off(found.reason)
    assert names == ["asynchrony_max", "deployment_time", "outcome", "peak_tension"]
    slower = run_frame(scene.with_values(dict.fromkeys(slips, 2e-4)))
    assert SMOOTHED not in slower.reason
    assert slower.values["deployment_time"] > found.values["deployment_time"]


def test_smoothed_friction_is_too_low_near_the_winch_and_too_high_far_from_it() -> None:
    """A rope that crawls over bearings of 3 mm: with the cure, the spans beside the winch have
    more, and the last one has less."""
    crawl = {"kind": "constant", "speed": 1e-6}
    heavy = {"kind": "bearing", "coefficient": 0.003}
    values = {"both__winch__winding": crawl, "both__friction": heavy}
    smooth = run_frame(slowly(**values, both__slip_speed=2e-4))
    cured = run_frame(slowly(**values, both__slip_speed=8.3e-8))
    assert SMOOTHED not in cured.reason
    before, after = (each.values["cable_tension"][0, :, -1] for each in (smooth, cured))
    assert after[0] > before[0] > 0.0
    assert after[-1] < before[-1]
    assert cured.values["peak_tension"] > smooth.values["peak_tension"]


def test_silence_where_friction_acts_or_where_there_is_none() -> None:
    for values in (
        {},
        {"both__slip_speed": 4.2e-5},
        {"both__slip_speed": 2e-4, "both__friction": {"kind": "none"}},
    ):
        # All fidelities look at what was wound: the cheapest stands for them.
        assert "slip_speed" not in run_frame(slowly(**values)).reason


def test_a_motor_that_stalls_into_a_crawl_is_judged_by_what_it_wound() -> None:
    found = run_frame(slowly(both__winch__winding=STALLED, joints__vjoint__viscous=0.5))
    assert "; pulley friction is smoothed" in found.reason
