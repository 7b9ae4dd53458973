"""What may jump is read on both sides; what comes behind the end is not waited for."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
import xarray as xr
from loops import for_each

import ringsim
from ringsim import load_scene, simulate
from ringsim.outputs.base import unwound
from ringsim.variables import Fate

JAM = {"kind": "jammed-pulley", "cable": "upper", "pulley": "section 2 V", "time": 1.0}
CUT = {"kind": "cut-cable", "cable": "upper", "span": 1, "time": 1.03}


def run(name: str, fidelity: str = "frame", **values: Any) -> xr.Dataset:
    """A small ring; two underscores stand for a dot."""
    chosen = {key.replace("__", "."): value for key, value in values.items()}
    return simulate(load_scene(name).with_values({"structure.sections": 5} | chosen), fidelity)


@for_each("fidelity", ["frame", "full"])
def test_a_rope_that_parts_had_the_tension_of_that_instant(fidelity: str) -> None:
    """The same ring that ends there tells it; a limit that it passes is passed."""
    given = {"limits__tension": 98.0, "limits__overrun": 20.0, "record__interval": 0.01}
    parted = run("ring18-cable", fidelity, faults=[JAM, CUT], solver__end_time=1.1, **given)
    ended = run("ring18-cable", fidelity, faults=[JAM], solver__end_time=1.03, **given)
    assert parted["peak_tension"].item() == pytest.approx(ended["peak_tension"].item(), rel=1e-3)
    assert parted["outcome"].item() == ended["outcome"].item() == Fate.OVERLOADED
    assert parted["energy_error"].item() < 1e-3
    # Just before it the rope has nearly all of its tension, just behind it none.
    own = parted["cable_tension"].sel(plane="upper", span=1)
    assert own.sel(time=1.02).item() > 0.6 * parted["peak_tension"].item()
    assert own.sel(time=slice(1.03, None)).max().item() == 0.0


def test_a_motor_has_no_torque_before_it_starts_and_its_speed_until_it_stops() -> None:
    winch, motor = "cables.lower.winch", "cables.lower.winch.winding"
    late = {
        f"{winch}.start_time": 2.0, f"{motor}.rotor_inertia": 1e-6,
        f"{motor}.torque_constant": 0.02,
    }  # fmt: skip
    found = run("ring18-motor", solver__end_time=3.0, record__interval=0.02, **late).sel(
        plane="lower", winch=1
    )
    for name in ("motor_torque", "motor_current", "motor_speed"):
        assert not found[name].sel(time=slice(None, 1.985)).any(), name
    assert found["motor_torque"].sel(time=slice(2.0, 2.1)).min().item() > 0.0
    stopped = run(
        "ring18-motor",
        solver__end_time=4.5,
        record__interval=0.02,
        cables__upper__winch__stop_time=4.0,
    )
    speed = stopped["motor_speed"].sel(plane="upper", winch=1)
    assert speed.sel(time=3.98).item() == pytest.approx(speed.sel(time=3.9).item(), rel=0.02)
    assert not speed.sel(time=slice(4.0, None)).any()


def test_power_that_commands_switch_adds_up_to_the_energy() -> None:
    """With rotors, which take energy at each command; trapezoids of records every 10 ms."""
    law = "winch.winding"
    found = run("ring18-motor", solver__end_time=4.0, record__interval=0.01, **{
        "controller": {"kind": "synchronise", "speed": 0.09, "gain": 0.5, "period": 0.5},
        **{f"cables.{p}.{law}.rotor_inertia": 1e-6 for p in ("upper", "lower")},
    })  # fmt: skip
    power, energy = found["motor_power"], found["motor_energy"]
    for plane in ("upper", "lower"):
        own = power.sel(plane=plane, winch=1)
        summed = float(np.trapezoid(own.values, own["time"].values))
        assert summed == pytest.approx(energy.sel(plane=plane, winch=1)[-1].item(), rel=2e-3)


def test_a_first_command_changes_nothing_that_a_motor_did_before() -> None:
    """Its own ramp counts until then."""
    law = "cables.upper.winch.winding"
    values = {
        "structure.sections": 5, "solver.end_time": 3.0, f"{law}.ramp": 3.0,
        f"{law}.rotor_inertia": 1e-7, f"{law}.torque_constant": 0.02,
    }  # fmt: skip
    scene, told = load_scene("ring18-motor").with_values(values), []
    for commands in (False, True):
        stepping = ringsim.steps(scene, period=0.5)
        for number, _ in enumerate(stepping):
            if commands and number >= 4:  # from 2 s on
                stepping.command(upper=0.05)
        told.append(stepping.result.sel(plane="upper", winch=1, time=slice(None, 1.99)))
    for name in ("motor_torque", "motor_current", "motor_electrical_energy", "motor_speed"):
        np.testing.assert_allclose(told[1][name], told[0][name], rtol=1e-6, err_msg=name)


def test_who_looks_on_needs_no_winches() -> None:
    scene = load_scene("ring18").with_values({"structure.sections": 5, "solver.end_time": 1.2})
    assert len(list(ringsim.steps(scene, period=0.5))) == 3


WINCH = load_scene("ring18-cable").cables.upper.winch.model_dump() | {"start_time": 1e3}


@for_each(
    "later",
    [
        {"faults": [{"kind": "failed-latch", "section": 1, "time": 1000.0}]},
        {"faults": [{"kind": "cut-cable", "span": 2, "time": 1000.0}]},
        {"cables__upper__end": "both", "cables__upper__far_winch": WINCH},
        {"loads": {"force": 0.0, "reversal_time": 1000.0}},
    ],
)
def test_nothing_waits_for_what_comes_behind_the_end(later: dict[str, Any]) -> None:
    """A ring of one cable comes to rest."""
    one = {"solver__end_time": 20.0, "cables__lower": "none"}
    plain, found = run("ring18-cable", **one), run("ring18-cable", **one, **later)
    assert plain["outcome"].item() == found["outcome"].item() == Fate.PARTLY_DEPLOYED
    assert found["final_time"].item() == pytest.approx(plain["final_time"].item(), rel=0.05)


def test_a_base_is_not_loaded_at_the_start_by_springs_that_have_failed() -> None:
    places = [(plane, k) for plane in ("upper", "lower") for k in range(1, 6)]
    springs = [
        {"kind": "failed-spring", "plane": plane, "section": k, "time": 0.0} for plane, k in places
    ]
    given = {"kind": "linear", "stiffness": 0.5}
    for fidelity in ("frame", "full"):
        found = run(
            "ring18", fidelity, loads="none", net="none", boom__base="fixed", hinge_spring=given,
            record__reactions=True, solver__end_time=0.2, faults=springs,
        )  # fmt: skip
        assert found["peak_base_force"].item() < 1e-3


def test_rotations_count_whole_turns() -> None:
    """Of a body that turns about an axis that itself wanders."""
    from scipy.spatial.transform import Rotation

    size = np.linspace(0.0, 15.0, 400)[1:]
    axis = np.array([np.cos(0.1 * size), np.sin(0.1 * size), 0.2 * np.ones_like(size)])
    axis /= np.linalg.norm(axis, axis=0)
    wanted = (size * axis).T
    found = unwound(Rotation.from_rotvec(wanted).as_rotvec())
    np.testing.assert_allclose(found, wanted, atol=1e-9)


def test_whole_turns_of_a_body_that_wobbles_do_not_depend_on_steps() -> None:
    """Near a whole turn all that is left of its rotation is the wobble, about another axis."""
    from scipy.spatial.transform import Rotation

    for tilt, step, sense in itertools.product((0.5, 5.0, 20.0), (0.003, 0.1, 0.5), (1.0, -1.0)):
        there = np.arange(0.0, 15.0, step)
        angle = sense * np.append(there, there[::-1])
        wobble = tilt * np.clip(np.abs(angle[:, None]) / 3.0, 0.0, 1.0)
        turns = Rotation.from_rotvec(np.outer(angle, [0.0, 0.0, 1.0]))
        turns *= Rotation.from_euler("x", wobble, degrees=True)
        found = unwound(turns.as_rotvec())
        size = np.linalg.norm(found, axis=1)
        assert np.abs(size - np.abs(angle)).max() < np.radians(2.0 * tilt)
        assert size[-1] == 0.0


@pytest.mark.parametrize("fidelity", ["frame", "full"])
def test_the_speed_of_a_table_jumps_at_its_ends(fidelity: str) -> None:
    """Damped ropes are as slack before its first time, and as taut before its last one, as if it
    did not jump there.
    """
    table = {"kind": "table", "times": [0.3, 0.6, 0.9], "lengths": [0.0, 0.03, 0.06]}
    values = {f"cables__{plane}__damping_time": 0.01 for plane in ("upper", "lower")}
    values |= {f"cables__{plane}__winch__winding": table for plane in ("upper", "lower")}
    given = {"fidelity": fidelity, "record__interval": 0.001} | values
    whole = run("ring18-cable", solver__end_time=1.0, **given)["cable_tension"][0, 0]
    short = run("ring18-cable", solver__end_time=0.899, **given)["cable_tension"][0, 0]
    assert whole.sel(time=0.299, method="nearest").item() < 0.04  # as slack as at the start
    at = {"time": [0.88, 0.89, 0.898], "method": "nearest"}
    np.testing.assert_allclose(whole.sel(**at), short.sel(**at), rtol=0.02)
