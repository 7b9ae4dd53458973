"""Runs that go on from a stored state with something else in the scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from ringsim.cable.control import Readings, Sampler
from ringsim.dataset import save
from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.simulation import simulate
from ringsim.stored_state import read_state
from ringsim.variables import Status

RING = {
    "structure.sections": 4, "structure.opening_angle": 60.0, "solver.end_time": 3.0,
    "record.state_interval": 2.0, "solver.restarts": 0,
}  # fmt: skip
CRAFT = {"mass": 500.0, "inertia": [100.0, 100.0, 100.0]}


def gone_on(folder: Path, first: dict[str, Any], change: dict[str, Any]) -> xr.Dataset:
    """From the state at 2 s."""
    scene = load_scene("ring18-cable").with_values(RING | first)
    save(simulate(scene, "frame"), folder / "run.nc")
    return simulate(scene.with_values(change), start=read_state(folder / "run.nc", 2.0))


@pytest.mark.parametrize(
    ("first", "change"),
    [
        ({}, {"structure.hinge_size": 0.02}),
        ({}, {"structure.corner_mass": 0.04}),
        ({}, {"boom.density": 900.0}),
        ({"spacecraft": CRAFT}, {"spacecraft.mass": 600.0}),
        ({"spacecraft": CRAFT}, {"spacecraft.inertia": [150.0, 150.0, 150.0]}),
        ({"spacecraft": CRAFT}, {"spacecraft.centre": [0.1, 0.0, 0.0]}),
        ({"spacecraft": CRAFT | {"inertia": [50.0, 50.0, 100.0]}}, {"spacecraft": CRAFT}),
    ],
    ids=["hinge", "corner", "boom", "mass", "inertia", "centre", "flat"],
)
def test_other_masses_move_as_the_bodies_did(
    first: dict[str, Any], change: dict[str, Any], tmp_path: Path
) -> None:
    """Points that carry a body's mass stand elsewhere in it: taken as the old ones they would jump
    by millimetres within a step, with 1e4 J and more.
    """
    found = gone_on(tmp_path, first, change)
    assert found["status"] == Status.OK
    assert found["energy_error"] < 3e-4


def test_masses_of_another_extent_are_refused(tmp_path: Path) -> None:
    """A mass in one point is one point that is followed, and a body four."""
    point = {"spacecraft": CRAFT | {"inertia": [1e-16, 1e-16, 1e-16]}}
    with pytest.raises(InputError, match="spread in a direction in which they had no extent"):
        gone_on(tmp_path, point, {"spacecraft.inertia": [100.0, 100.0, 100.0]})


def test_lengths_that_a_temperature_changes_are_another_structure(tmp_path: Path) -> None:
    def warm(value: float) -> dict[str, Any]:
        return {"temperature": {"bar": {"value": value, "expansion": 1e-6}}}

    with pytest.raises(InputError, match=r"temperature\.bar\.value = 393\.15: .*another structure"):
        gone_on(tmp_path, warm(293.15), warm(393.15))
    error = {"rods.length_error": {"bar_upper_left": 0.0}}
    with pytest.raises(InputError, match=r"bar_upper_left = 0\.0001: .*another structure"):
        gone_on(tmp_path, error, {"rods.length_error": {"bar_upper_left": 1e-4}})


def test_an_unchanged_scene_at_a_temperature_goes_on_bit_by_bit(tmp_path: Path) -> None:
    friction = {"temperatures": [173.0, 293.15], "factors": [4.0, 1.0]}
    cold = {"temperature": {"joint": {"value": 213.15, "friction": friction}}}
    found = gone_on(tmp_path, cold, {})
    whole = simulate(load_scene("ring18-cable").with_values(RING | cold), "frame")
    assert found["steps"] == whole["steps"]
    xr.testing.assert_equal(found["opening_angle"], whole["opening_angle"])


def test_a_winch_that_holds_after_a_change_keeps_the_rope_on_its_drum(tmp_path: Path) -> None:
    def winch(speed: float) -> dict[str, Any]:
        return {"winding": {"kind": "constant", "speed": speed}, "after_lock": "hold"}

    first = {
        "structure.opening_angle": 150.0, "solver.end_time": 14.0, "solver.settling_time": 1.0,
        "cables.upper.winch": winch(0.03), "cables.lower.winch": winch(0.03),
    }  # fmt: skip
    change = {f"cables.{plane}.winch": winch(0.04) for plane in ("upper", "lower")}
    found = gone_on(tmp_path, first, change)
    assert found["status"] == Status.OK
    wound = found["wound_length"].values[np.isfinite(found["wound_length"].values)]
    assert wound.min() >= 0.0
    assert wound.max() < 0.25


def test_a_failed_encoder_shows_its_last_reading_to_another_controller(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown, read = list[float](), Sampler._readings

    def noted(self: Sampler, *given: Any) -> Readings:
        found = read(self, *given)
        shown.append(float(found.opening_angle[0, 1]))
        return found

    monkeypatch.setattr(Sampler, "_readings", noted)
    winch = {"winding": {"kind": "commanded", "max_speed": 0.2}}
    first = {
        "cables.upper.winch": winch, "cables.lower.winch": winch,
        "controller": {"kind": "synchronise", "period": 0.5, "speed": 0.12, "gain": 0.01},
        "faults": [{"kind": "failed-sensor", "plane": "upper", "section": 2, "time": 1.2}],
    }  # fmt: skip
    gone_on(tmp_path, first, {"controller.gain": 0.02})
    last = shown[2]  # at 1 s
    assert last > 65.0
    # Then those of the first run until 2.5 s, the sample at 0 s of the new one, and its others.
    assert [each for each in shown[3:] if each != last] == pytest.approx([60.0])


def test_constant_steps_behind_a_state_are_not_judged_as_from_rest(tmp_path: Path) -> None:
    """The first V-joint locks five of them later, which says nothing of a delayed start."""
    values = {
        "structure.opening_angle": 165.0, "solver.end_time": 2.5, "record.state_interval": 0.25
    }  # fmt: skip
    scene = load_scene("ring18-cable").with_values(RING | values)
    save(simulate(scene, "frame"), tmp_path / "run.nc")
    constant = scene.with_values({"solver.step_control": "constant", "solver.step": 0.005})
    found = simulate(constant, start=read_state(tmp_path / "run.nc", 1.25))
    assert "fewer than" not in found.attrs["reason"]


MOTOR = {"kind": "motor", "no_load_speed": 60.0, "stall_torque": 1.0, "drum_radius": 0.01}


def motors(**values: Any) -> dict[str, Any]:
    return {f"cables.{plane}.winch.winding": MOTOR | values for plane in ("upper", "lower")}


def test_a_motor_keeps_the_last_command_of_a_controller_that_is_gone(tmp_path: Path) -> None:
    """Its rope and its shaft: what it gives is the rope's work, and it lags behind nothing else."""
    told = {"kind": "synchronise", "speed": 0.05, "gain": 0.0, "period": 0.5}
    given = motors(speed=40.0, rotor_inertia=1e-6) | {"controller": told, "record.interval": 0.01}
    found = gone_on(tmp_path, given, {"controller": "none"})
    later = found.sel(time=slice(2.1, None))
    np.testing.assert_allclose(later["motor_speed"], 5.0, rtol=1e-3)
    tension = found["cable_tension"].isel(span=0).sel(time=slice(2.1, None))
    np.testing.assert_allclose(later["motor_torque"].sel(winch=1), 0.01 * tension, rtol=1e-3)


@pytest.mark.parametrize("change", ["stop_time", "start_time"])
def test_a_motor_that_a_change_switches_off_stands_at_once(change: str, tmp_path: Path) -> None:
    given = motors(speed=20.0) | {"record.interval": 0.01}
    time = {"stop_time": 1.0, "start_time": 2.5}[change]
    found = gone_on(tmp_path, given, {f"cables.upper.winch.{change}": time})
    speed = found["motor_speed"].sel(plane="upper", winch=1)
    assert speed.sel(time=1.99, method="nearest").item() > 1.0
    assert np.abs(speed.sel(time=[2.0, 2.01], method="nearest")).max() == 0.0
