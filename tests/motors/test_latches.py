"""Latches: their torque, the rate at which joints meet them, and those that do not catch."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from loops import for_each
from pydantic import ValidationError
from scipy.integrate import quad

from motor_rings import MOTOR, STALL, ring
from ringsim.analysis.design import endings
from ringsim.analysis.intervals import quantities
from ringsim.analysis.requirements import Requirement, violations
from ringsim.outputs.family import Run, Series
from ringsim.outputs.joints import FastestLatch, Latching
from ringsim.outputs.rods_and_cables import CableTension
from ringsim.parts.joints import Latch
from ringsim.parts.margin import EcssMechanisms
from ringsim.refusal import InputError
from ringsim.rigid.margin import DriveMargin
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate
from ringsim.variables import Fate

LATCH = {"peak_torque": 0.3, "reach": 8.0}
REACH = math.radians(8.0)


def latched(**values: object) -> Scene:
    """Three sections from 160 deg on that springs open against their latches."""
    plain = {
        "cables": "none", "structure.sections": 3, "structure.opening_angle": 160.0, "joints": {},
        "hinge_spring": {"kind": "linear", "stiffness": 0.02, "preload": 0.3}, "latch": LATCH,
        "solver.tolerance": 1e-4, "solver.newton_tolerance": 1e-6, "solver.end_time": 1.0,
        "record.interval": 1e-3, "stop.latch": True, "solver.settling_time": 0.01,
    }  # fmt: skip
    return ring().with_values(plain | {k.replace("__", "."): v for k, v in values.items()})


def test_the_energy_of_the_ramp_is_the_integral_of_its_torque() -> None:
    law = Latch(**LATCH)
    work, _ = quad(lambda x: law.reaction(x, 0.0, 0.0).elastic, REACH, 0.0)
    assert work == pytest.approx(2.0 / 3.0 * 0.3 * REACH, rel=1e-12)
    for begin, end in ((0.3, 0.1), (0.3, 0.05), (0.1, -0.01)):
        work, _ = quad(lambda x: law.reaction(x, 0.0, 0.0).elastic, begin, end, points=[0.0, REACH])
        assert law.reaction(end, 0.0, 0.0).stored - law.reaction(
            begin, 0.0, 0.0
        ).stored == pytest.approx(work, rel=1e-9)
    assert law.reaction(0.5 * REACH, 0.0, 0.0).elastic == pytest.approx(-0.3, rel=1e-12)
    np.testing.assert_array_equal(
        law.reaction(np.array([-0.1, 0.0, REACH, 1.0]), 0.0, 0.0).elastic, 0.0
    )


def test_resistance_is_that_of_all_ramps() -> None:
    found = DriveMargin(latched(latch__peak_torque=[0.1, 0.2, 0.6]), EcssMechanisms())
    for share in (0.1, 0.5, 0.9, 1.5):
        now = found.at(math.pi - share * REACH)
        resisting = now.resisting
        expected = 2 * 0.9 * 4.0 * share * max(1.0 - share, 0.0)
        assert resisting["latches"] == pytest.approx(expected, rel=1e-9, abs=1e-15)
        springs = 6 * (0.3 + 0.02 * share * REACH)
        assert now.driving["springs"] == pytest.approx(springs, rel=1e-12)


def test_a_ring_of_stiff_rods_meets_its_latches_as_the_quadrature_says() -> None:
    """Usual rods swing in the last degrees, which makes the rates 4 % larger."""
    scene = latched(rods__young_modulus=1.2e13)
    ring, found = OneCoordinate(scene), simulate(scene, "frame")
    start = scene.structure.coordinate
    time = opening_time(ring, start, panels=200).time
    assert float(found.deployment_time) == pytest.approx(time, rel=1e-3)
    folding = math.sqrt(2.0 * (ring.work(0.0) - ring.work(start)) / ring.motion(0.0).inertia)
    # What the springs give over 20 deg, less what the ramps take.
    gained = 6 * (0.3 * math.radians(20.0) + 0.01 * math.radians(20.0) ** 2 - 0.2 * REACH)
    assert ring.work(0.0) - ring.work(start) == pytest.approx(gained, rel=1e-9)
    np.testing.assert_allclose(found.latch_rate, 2.0 * folding, rtol=5e-3)
    assert found.latched.values.tolist() == [[1] * 3] * 2
    assert int(found.latched_joints) == 6
    assert float(found.energy_error) < 1e-3


@pytest.mark.slow
def test_both_engines_meet_latches_alike() -> None:
    frame, full = (simulate(latched(), fidelity) for fidelity in ("frame", "full"))
    np.testing.assert_allclose(frame.deployment_time, full.deployment_time, rtol=1e-4)
    np.testing.assert_allclose(frame.latch_rate, full.latch_rate, rtol=2e-3)
    for run in (frame, full):
        places_of_rates(run)


@pytest.mark.parametrize("fidelity", ["frame", pytest.param("full", marks=pytest.mark.slow)])
def test_joints_that_come_too_slowly_leave_again(fidelity: str) -> None:
    """Springs hold the joints at their stops; here they fold again, as they have come."""
    scene = latched(
        latch={"min_rate": 100.0}, solver__settling_time=0.05, stop__damping=0.0,
        hinge_spring={"kind": "linear", "stiffness": 0.02, "preload": 0.3},
    )  # fmt: skip
    found = simulate(scene, fidelity)
    assert float(found.latch_rate.max()) < 100.0
    assert int(found.latched_joints) == 0
    assert int(found.outcome) == Fate.NOT_LATCHED
    assert int(found.locked_joints) == 6
    assert "6 of 6 latches did not catch: upper 1, upper 2, upper 3" in found.attrs["reason"]
    after = found.opening_angle.where(found.time > float(found.deployment_time)).min()
    caught = simulate(scene.with_values({"latch.min_rate": 0.0}), fidelity)
    held = caught.opening_angle.where(caught.time > float(caught.deployment_time)).min()
    assert float(after) < float(held) < 180.0
    assert int(caught.outcome) == Fate.DEPLOYED
    assert float(caught.final_time) == pytest.approx(float(caught.deployment_time) + 0.05)
    # It is followed until it rests, for a tenth of the time that there is.
    assert float(found.final_time) > float(found.deployment_time) + 0.1


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_a_latch_that_has_failed_does_not_catch(fidelity: str) -> None:
    """That of upper 2 from the start, those of lower 1 and 3 by their rates; one that has caught
    holds on."""
    faults = [
        {"kind": "failed-latch", "section": 2, "time": 0.0},
        {"kind": "failed-latch", "plane": "lower", "section": 2, "time": 0.9},
    ]
    scene = latched(
        faults=faults, latch={"min_rate": [0.0, 0.0, 100.0]}, solver__tolerance=1e-3
    )  # fmt: skip
    found = simulate(scene, fidelity)
    assert found.latched.values.tolist() == [[1, 0, 0], [1, 1, 0]]
    assert "3 of 6 latches did not catch: upper 2, upper 3, lower 3" in found.attrs["reason"]
    assert int(found.outcome) == Fate.NOT_LATCHED


def driven(**values: object) -> Scene:
    """Motors in place of the springs; the latch of lower 2 has failed."""
    fault = {"kind": "failed-latch", "plane": "lower", "section": 2, "time": 0.0}
    return ring(
        structure__sections=3, structure__opening_angle=170.0, stop__latch=True, faults=[fault],
        solver__end_time=20.0, record__reactions=True, record__accelerations=True, **values,
    )  # fmt: skip


@pytest.fixture(scope="module")
def pressed() -> xr.Dataset:
    return simulate(driven(), "frame")


def test_a_winch_pulls_until_the_latches_of_its_plane_hold(pressed: xr.Dataset) -> None:
    """The motor of the other plane stalls, and the ring rests in its stops."""
    assert int(pressed.outcome) == Fate.NOT_LATCHED
    assert pressed.latched.values.tolist() == [[1, 1, 1], [1, 0, 1]]
    reason = pressed.attrs["reason"]
    rest = "; came to rest with 6 of 6 V-joints at 180 deg: no winch moves the ring"
    assert reason.startswith(f"1 of 6 latches did not catch: lower 2{rest}")
    assert float(pressed.final_time) > float(pressed.deployment_time) + 0.1 * 20.0
    # At rest a motor turns with up to 1 % of half its speed without a load.
    last = pressed.motor_torque.dropna("time", how="all").isel(time=-1, winch=0)
    assert last.values.tolist() == [0.0, pytest.approx(MOTOR["stall_torque"], rel=5e-3)]
    tension = pressed.cable_tension.dropna("time", how="all").isel(time=-1, span=0)
    assert float(tension.sel(plane="lower")) == pytest.approx(STALL, rel=5e-3)


def test_numbers_of_a_run_are_the_extremes_of_its_places(pressed: xr.Dataset) -> None:
    told = pressed.time[pressed.time <= pressed.final_time]
    # The motors still creep as the run ends, which is behind the last output time.
    power = pressed.motor_power.sel(time=told[-1]).sum()
    since = (pressed.final_time - told[-1]) * power
    for name, value in {
        "least_latch_rate": pressed.latch_rate.min(),
        "peak_latch_rate": pressed.latch_rate.max(),
        "peak_lock_impulse": pressed.lock_impulse.max(),
        "peak_acceleration_max": pressed.peak_acceleration.max(),
        "total_motor_energy": pressed.motor_energy.max("time").sum() + since,
    }.items():
        assert float(pressed[name]) == pytest.approx(float(value), rel=1e-5), name
        assert float(pressed[name]) > 0.0
    # Of all steps, between which output times lie.
    stall = MOTOR["stall_torque"]
    assert float(pressed.motor_torque.max()) <= float(pressed.peak_motor_torque) <= stall
    most = stall * MOTOR["no_load_speed"] / 4.0
    assert float(pressed.motor_power.max()) <= float(pressed.peak_motor_power) <= most
    assert {"least_latch_rate", "peak_latch_rate", "total_motor_energy"} < set(quantities())


def places_of_rates(run: xr.Dataset) -> None:
    """Times and places of the extreme latch rates lead back to them."""
    for name in ("least_latch_rate", "peak_latch_rate"):
        plane, section = (str(run[f"{name}_plane"].values), int(run[f"{name}_section"]))
        place = {"plane": plane, "section": section}
        assert float(run.latch_rate.sel(place)) == float(run[name])
        assert float(run.lock_time.sel(place)) == float(run[f"{name}_time"])


def test_extreme_latch_rates_have_time_and_place(pressed: xr.Dataset) -> None:
    places_of_rates(pressed)
    assert float(pressed.least_latch_rate) < float(pressed.peak_latch_rate)


def test_the_largest_latch_rate_is_known_where_joints_did_not_come() -> None:
    """Of rates made by hand: a place that was not met has no part in it."""
    times = np.linspace(0.0, 2.0, 201)
    slopes = np.array([[0.5, 0.8, 0.01], [0.4, 0.2, 0.01]])  # rad/s; the last come to 171 deg
    angles = math.pi - 0.15 + times[:, None, None] * slopes
    rates = np.broadcast_to(slopes, angles.shape)
    locks = np.where(slopes > 0.1, 0.15 / slopes, np.nan)
    for sure in (True, False):
        shown = angles if sure else angles - 2.0
        series = [Series(times, each, times) for each in (shown, rates)]
        known = {"plane": np.array(["upper", "lower"]), "section": np.arange(1, 4)}
        run = Run(latched(), *series, locks if sure else locks * np.nan, {}, known)
        found = FastestLatch().reduce(run, series[0]) | Latching().reduce(run, series[0])
        assert np.isnan(found["least_latch_rate"])
        if not sure:
            assert np.isnan(found["peak_latch_rate"])
            assert "peak_latch_rate_time" not in found
            continue
        assert found["peak_latch_rate"] == pytest.approx(0.8, rel=1e-6)
        assert found["peak_latch_rate_time"] == pytest.approx(0.15 / 0.8)
        assert (found["peak_latch_rate_plane"], found["peak_latch_rate_section"]) == ("upper", 2)


def test_a_ring_that_is_not_latched_falls_short(pressed: xr.Dataset) -> None:
    campaign = xr.Dataset({
        "status": ("sample", [0, 0]),
        "outcome": ("sample", [int(Fate.DEPLOYED), int(pressed.outcome)]),
    })  # fmt: skip
    wanted = Requirement.model_validate({"is": "deployed", "probability": 0.9, "confidence": 0.9})
    assert violations(campaign, "outcome", wanted).tolist() == [False, True]
    assert endings(campaign).tolist() == ["deployed", "not latched"]


def test_the_latest_latch_tells_when_a_motor_stops() -> None:
    """Of joints that come again and catch then; see ``Run.held``."""
    times = np.linspace(0.0, 4.0, 401)
    past = np.poly1d([1.0, 1.5, 3.0], r=True) * 0.1
    angles, rates = (
        np.tile(each(times)[:, None, None], (1, 2, 3)) for each in (past, past.deriv())
    )
    series = [Series(times, each, times) for each in (angles + math.pi, rates)]
    run = Run(latched(latch={"min_rate": [0.05, 0.2, 0.4]}), *series, np.full((2, 3), 1.0), {}, {})
    np.testing.assert_allclose(run.held, [[1.0, 3.0, np.nan]] * 2, rtol=1e-6)
    again = replace(run, caught=np.array([[True, True, True], [False, False, False]]))
    np.testing.assert_allclose(again.held, [[1.0, 3.0, 1.0], [np.nan] * 3], rtol=1e-6)


def test_tensions_count_until_all_latches_have_caught() -> None:
    """Winches pull on at a ring that is not locked: 2 N more each second."""
    times = np.linspace(0.0, 4.0, 401)
    past = np.poly1d([1.0, 1.5, 3.0], r=True) * 0.1
    angles, rates = (
        np.tile(each(times)[:, None, None], (1, 2, 3)) for each in (past, past.deriv())
    )
    series = [Series(times, each, times) for each in (angles + math.pi, rates)]
    pull = np.stack([[10.0 + 2.0 * times, 9.0 + times]] * 2).transpose(2, 0, 1)
    known = {"plane": np.array(["upper", "lower"]), "span": np.arange(1, 3)}
    for least, ends in ((0.05, 1.0), (0.2, 3.0), (0.4, 4.0)):  # at once, the third time, never
        scene = latched(latch={"min_rate": least})
        run = Run(scene, *series, np.full((2, 3), 1.0), {}, known)
        found = CableTension().reduce(run, Series(times, pull, times))
        assert found["peak_tension"] == pytest.approx(10.0 + 2.0 * ends)
        assert found["peak_tension_time"] == pytest.approx(ends)
        assert (found["peak_tension_plane"], found["peak_tension_span"]) == ("upper", 1)


@for_each(
    ("values", "text"),
    [
        ({"stop.latch": False}, "set stop.latch = true"),
        ({"stop": "none"}, "set stop.latch = true"),
        ({"latch": "none", "stop.latch": False,
          "faults": [{"kind": "failed-latch", "section": 1, "time": 0.0}]}, "fault of a latch"),
        ({"faults": [{"kind": "failed-latch", "section": 4, "time": 0.0}]}, "at most 3"),
        ({"latch.peak_torque": -1.0}, "latch.peak_torque = -1.0"),
        ({"latch.reach": 90.0}, "latch.reach = 90.0"),
        ({"latch.min_rate": [1.0]}, "needs 3"),
    ],
)  # fmt: skip
def test_latches_that_cannot_be_are_refused(values: dict[str, object], text: str) -> None:
    with pytest.raises((InputError, ValidationError), match=text):
        latched().with_values(values)


def test_rings_without_latches_tell_no_rate() -> None:
    short = {
        "solver.end_time": 0.05,
        "solver.step": 0.01,
        "record.interval": 0.01,
        "structure.sections": 3,
    }
    assert "latch_rate" not in simulate(load_scene("ring18").with_values(short), "frame")
