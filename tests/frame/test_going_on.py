"""Runs that go on from a stored state: as the uninterrupted one, or as a scene that tells both."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from loops import for_each

from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.outputs.recorder import StoredState
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate
from ringsim.stored_state import read_state
from ringsim.variables import TIMINGS

COUNTED = ("total_steps", "total_newton_iterations", "total_jacobians", *TIMINGS)
"""Of one process, not of the run."""


def truss(**values: Any) -> Scene:
    """The truss for 30 ms with a state every 10 ms; two underscores stand for a dot."""
    plain = {
        "solver.end_time": 0.03,
        "solver.step": 0.03,
        "record.state_interval": 0.01,
        "record.interval": 0.002,
    }
    chosen = {name.replace("__", "."): value for name, value in values.items()}
    return load_scene("truss2").with_values(plain | chosen)


def stored(scene: Scene, folder: Path) -> tuple[xr.Dataset, Path]:
    """A run and its file."""
    run, file = simulate(scene, "frame"), folder / "run.nc"
    save(run, file)
    return run, file


def different(one: xr.Dataset, other: xr.Dataset) -> list[str]:
    """Variables that are not equal bit by bit."""
    assert set(one.variables) == set(other.variables)
    return [
        str(name)
        for name in one.variables
        if name not in COUNTED and not one.variables[name].identical(other.variables[name])
    ]


MOTOR = {
    "kind": "motor", "no_load_speed": 600.0, "stall_torque": 5e-5, "gear_ratio": 100.0,
    "drum_radius": 0.002, "back_efficiency": 0.3,
}  # fmt: skip


@pytest.mark.parametrize(
    "values",
    [
        {"record__stress": True, "record__reactions": True, "record__accelerations": True},
        {
            "cables__upper__winch__winding": MOTOR,
            "faults": [
                {"kind": "jammed-pulley", "cable": 2, "pulley": 2, "time": 0.012},
                {"kind": "stuck-vjoint", "plane": "lower", "section": 2, "time": 0.015},
                {"kind": "cut-cable", "cable": 2, "span": 1, "time": 0.025},
            ],
        },
        {"solver__step_control": "constant", "solver__step": 0.002},
    ],
    ids=["recorded", "broken", "constant"],
)
def test_an_unchanged_scene_goes_on_bit_by_bit(values: dict[str, Any], tmp_path: Path) -> None:
    scene = truss(**values)
    whole, file = stored(scene, tmp_path)
    assert whole["state_time"].values == pytest.approx([0.01, 0.02, 0.03], abs=1e-8)
    again = simulate(scene, start=read_state(file, 0.02))
    # What the first run has stored before is not in the file of the second.
    assert again["state_time"].values == pytest.approx([0.03], abs=1e-8)
    own = [name for name in whole.variables if str(name).startswith("state")]
    assert different(whole.drop_vars(own), again.drop_vars(own)) == []
    assert again.attrs["reason"] == whole.attrs["reason"]
    assert again.attrs["began"].endswith(f"the state of {file} at 0.02 s, unchanged")
    save(again, tmp_path / "again.nc")
    # The second file holds all of the first run: it can be gone on from, too.
    last = read_state(tmp_path / "again.nc")
    longer = scene.with_values({"solver.end_time": 0.031})
    assert simulate(longer, start=last)["final_time"].item() == pytest.approx(0.031)


def test_a_change_is_as_a_scene_that_foresaw_it(tmp_path: Path) -> None:
    """A winch that is stopped, and a rope that is cut later, where the state was stored before."""
    file = stored(truss(), tmp_path)[1]
    late = {
        "cables.upper.winch.stop_time": 0.01,
        "faults": [{"kind": "cut-cable", "cable": 2, "span": 2, "time": 0.02}],
    }
    foreseen = simulate(truss().with_values(late), "frame")
    changed = simulate(truss().with_values(late), start=read_state(file, 0.01))
    for name in ("opening_angle", "cable_tension", "wound_length", "kinetic_energy"):
        largest = float(np.nanmax(np.abs(foreseen[name])))
        # Step control sees the change from the state on: what is left is the error of its steps.
        apart = float(np.nanmax(np.abs(changed[name] - foreseen[name])))
        assert apart <= 5e-4 * largest, name
    assert "cables.upper.winch.stop_time = 0.01" in changed.attrs["began"]


def test_a_winch_that_is_switched_on_again_goes_on_with_the_rope_on_its_drum(
    tmp_path: Path,
) -> None:
    """0.01 m/s until 6 ms, then again from 20 ms on: 60 um, and 160 um at 30 ms."""
    ends = {f"cables.{plane}.winch.stop_time": 0.006 for plane in ("upper", "lower")}
    scene = truss()
    file = stored(scene.with_values(ends), tmp_path)[1]
    run = simulate(scene, start=read_state(file, 0.02))
    wound = run["wound_length"].sel(plane="upper").values[[2, 8, 10, 12, 15]]
    assert wound == pytest.approx([4e-5, 6e-5, 6e-5, 1e-4, 16e-5], abs=1e-12)
    assert run["energy_error"].item() < 1e-3


@pytest.mark.parametrize(
    "change",
    [
        {"winding.gear_ratio": 50.0},
        *(
            pytest.param(change, marks=pytest.mark.slow)
            for change in ({"winding.stall_torque": 2e-5}, {"start_time": 0.02})
        ),
    ],
    ids=str,
)
def test_what_a_motor_gave_before_a_change_stays(change: dict[str, float], tmp_path: Path) -> None:
    """Torque, speed and energy are of the motor that it was; the energy goes on from there."""
    scene = truss(cables__upper__winch__winding=MOTOR, cables__lower__winch__winding=MOTOR)
    before, file = stored(scene, tmp_path)
    now = scene.with_values({f"cables.upper.winch.{k}": v for k, v in change.items()})
    run = simulate(now, "frame", start=read_state(file, 0.02))
    upper = {"plane": "upper", "winch": 1}
    for name in ("motor_torque", "motor_speed", "motor_energy"):
        old, new = (found[name].sel(upper).values for found in (before, run))
        # To 16 ms: the curve through the last step before the change knows the step behind it.
        np.testing.assert_array_equal(new[:9], old[:9], err_msg=name)
    assert run["motor_torque"].sel(upper).values[5] > 0.0
    # Without losses of the gear it is what the rope takes: tension times rope wound.
    after = run.sel(plane="upper").isel(time=slice(11, None))
    tension, wound = after["cable_tension"].sel(span=1).values, after["wound_length"].values
    taken = 0.5 * (tension[1:] + tension[:-1]) * np.diff(wound)
    given = np.diff(after["motor_energy"].sel(winch=1))
    assert given == pytest.approx(taken, rel=5e-3)
    # And again from there: both changes are remembered.
    save(run, tmp_path / "second.nc")
    later = scene.with_values({"solver.end_time": 0.034})
    third = simulate(later, "frame", start=read_state(tmp_path / "second.nc", 0.03))
    for name in ("motor_torque", "motor_speed", "motor_energy"):
        old, new = (found[name].sel(upper).values for found in (run, third))
        np.testing.assert_array_equal(new[:13], old[:13], err_msg=name)


def test_a_cleared_fault_lets_go(tmp_path: Path) -> None:
    """What a stuck V-joint and a jammed pulley held is lost, and the truss opens on."""
    faults = [
        {"kind": "stuck-vjoint", "plane": "upper", "section": 1, "time": 0.004},
        {"kind": "jammed-pulley", "cable": 1, "pulley": 2, "time": 0.004},
    ]
    held, file = stored(truss(faults=faults), tmp_path)
    freed = simulate(truss(), start=read_state(file, 0.01))
    angles = [run["opening_angle"].sel(plane="upper", section=1).values for run in (held, freed)]
    assert angles[0][5] == angles[1][5]
    opened = [one[15] - one[5] for one in angles]
    assert opened[1] > 5.0 * opened[0]
    lost = [run["dissipation"].values for run in (held, freed)]
    # At the state's time its reading is that of the changed scene.
    assert (lost[0][:5] == lost[1][:5]).all()
    assert lost[1][5] > 2.0 * lost[0][5]
    assert freed["energy_error"].item() < 1e-3


@for_each("freed", ["jammed-pulley", "off-sheave"])
def test_a_rope_that_two_faults_hold_at_a_pulley_slips_when_both_are_cleared(
    tmp_path: Path, freed: str
) -> None:
    faults = [
        {"kind": kind, "cable": 1, "pulley": 2, "time": 0.004}
        for kind in ("jammed-pulley", "off-sheave")
    ]
    held, file = stored(truss(faults=faults), tmp_path)
    start, left = read_state(file, 0.01), [each for each in faults if each["kind"] != freed]
    one, none = (simulate(truss(faults=each), start=start) for each in (left, []))
    for name in ("cable_tension", "opening_angle"):
        np.testing.assert_allclose(one[name], held[name], rtol=1e-3, atol=1e-3, err_msg=name)
    apart = np.abs(none["cable_tension"] - held["cable_tension"]).max()
    assert apart.item() > 0.1 * held["peak_tension"].item()


def test_what_cannot_go_on_is_refused_with_the_cure(tmp_path: Path) -> None:
    scene = truss(faults=[{"kind": "cut-cable", "cable": 1, "span": 2, "time": 0.002}])
    file = stored(scene, tmp_path)[1]
    start = read_state(file, 0.01)
    early = {"kind": "cut-cable", "cable": 2, "span": 2, "time": 0.003}
    own = scene.to_table()["faults"]
    for values, words in (
        ({"structure.half_bar": 0.29}, r"structure.half_bar = 0.29: .* another structure .*0.2889"),
        ({"rods.elements": 3}, r"rods.elements = 3: .*another structure"),
        ({"cables.upper": "none", "faults": []}, "cables.upper.* left out: .*another structure"),
        ({"faults": []}, "cannot be undone: keep that fault"),
        ({"faults": [*own, early]}, r"faults\[1\].time = 0.003 s: has not struck .* after"),
        ({"solver.end_time": 0.008, "solver.step": 0.008}, "end_time = 0.008 s: must be after"),
        ({"solver.error_bars": True}, "error_bars = true: .* set it to false"),
        (
            {"cables.upper.initial_slack": 0.001},
            "initial_slack = 0.001: this value is for the start of a run",
        ),
        ({"record.positions": True}, "record: .* no readings of position: leave out"),
    ):
        with pytest.raises(InputError, match=words):
            simulate(scene.with_values(values), start=start)
    with pytest.raises(InputError, match=r'"full": .* of the engine "frame".*"frame"'):
        simulate(scene.with_values({"record.state_interval": "none"}), "full", start=start)
    with pytest.raises(
        InputError, match=r"--at 0.015: .* it has 0.01, 0.02, 0.03 s: take --at 0.0[12]"
    ):
        read_state(file, 0.015)
    changed = tmp_path / "changed.nc"
    run = xr.load_dataset(file)
    for other in (run.assign_attrs(scene=3), run.isel(state_entry=slice(3))):
        other.to_netcdf(changed)
        with pytest.raises(InputError, match=r"changed\.nc: .*damaged or changed"):
            read_state(changed)
    ended = _ended(tmp_path)
    with pytest.raises(InputError, match="unchanged: start from an earlier state"):
        simulate(ended.scene, start=ended)
    with pytest.raises(InputError, match='"full" stores no states'):
        simulate(truss(), "full")


def _ended(folder: Path) -> StoredState:
    """The last state of a run that came to rest: winches that never turn."""
    still = {f"cables.{plane}.winch.start_time": 0.0 for plane in ("upper", "lower")}
    still |= {f"cables.{plane}.winch.stop_time": 0.0 for plane in ("upper", "lower")}
    run = simulate(truss(**{k.replace(".", "__"): v for k, v in still.items()}), "frame")
    assert run["outcome"].item() == 3, run.attrs["reason"]
    save(run, folder / "still.nc")
    return read_state(folder / "still.nc")


def test_a_file_without_states_is_refused(tmp_path: Path) -> None:
    short = truss(solver__end_time=0.01, solver__step=0.01, record__state_interval="none")
    save(simulate(short, "frame"), tmp_path / "run.nc")
    with pytest.raises(InputError, match=r"has no stored states: .*record.state_interval=1"):
        read_state(tmp_path / "run.nc")
    with pytest.raises(InputError, match="no such file"):
        read_state(tmp_path / "missing.nc")


def test_states_leave_a_run_as_it_is_but_for_its_steps(tmp_path: Path) -> None:
    """A step ends at every state: the run differs by the error of its steps, and holds no more."""
    plain = simulate(truss(record__state_interval="none"), "frame")
    run = simulate(truss(), "frame")
    assert not [name for name in plain.variables if "state" in str(name)]
    apart = float(np.nanmax(np.abs(run["opening_angle"] - plain["opening_angle"])))
    assert apart < 1e-3 * float(plain["opening_angle"].max())


def test_the_command_goes_on(tmp_path: Path) -> None:
    first, again = str(tmp_path / "first.nc"), str(tmp_path / "again.nc")
    short = ["--set", "solver.end_time=0.02", "--set", "solver.step=0.02"]
    short += ["--set", "record.interval=0.01", "--set", "record.state_interval=0.01"]

    def called(*words: str, code: int = 0) -> str:
        done = CliRunner().invoke(cli, ["run", "truss2", *words])
        assert done.exit_code == code, done.output
        return done.output

    called("--fidelity", "frame", *short, "--out", first)
    stop = "cables.upper.winch.stop_time=0.015"
    printed = called("--from", first, "--at", "0.01", *short, "--set", stop, "--out", again)
    assert f"went on from the state of {first} at 0.01 s with {stop.replace('=', ' = ')}" in printed
    with xr.open_dataset(again) as data:
        assert data.attrs["fidelity"] == "frame"
        assert float(data["final_time"]) == pytest.approx(0.02)
    for words, told in (
        (["--at", "0.01"], "--at 0.01: has no effect without --from"),
        (["--from", first, "--at", "0.015"], "it has 0.01, 0.02 s"),
        (["--from", first, "--fidelity", "both"], 'choose fidelity = "frame"'),
    ):
        lines = called(*words, *short[:6], "--out", again, code=2).strip().splitlines()
        assert len(lines) == 1
        assert told in lines[0]
    # What is refused has not gone on from anywhere.
    refused = called("--from", first, "--at", "0.02", *short, "--out", again, code=2)
    assert "must be after 0.02 s" in refused
    assert "went on from" not in refused
