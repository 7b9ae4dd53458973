"""The frame engine answers wherever a fidelity is chosen, beside the full one and like it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import ringsim.frame.integrate
from ringsim.cli import cli
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run, run_frame, simulate
from ringsim.variables import Cause, Fidelity, Outcome, Status

SHORT = load_scene("truss2").with_values({"solver.end_time": 0.5, "solver.tolerance": 3e-3})


def called(*words: str, code: int = 0) -> str:
    done = CliRunner().invoke(cli, words)
    assert done.exit_code == code, done.output
    return done.output


def test_a_result_tells_which_engine_answered() -> None:
    found = simulate(SHORT, "frame")
    assert found["fidelity"].item() == Fidelity.FRAME
    assert found.attrs["fidelity"] == "frame"
    assert "joint coordinates" in found.attrs["source"]
    assert found["status"].item() == Status.OK
    assert found["cpu_time"].item() > 0.0


def test_what_the_frame_engine_cannot_represent_is_refused_with_the_cure(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r'fidelity = "frame" does not represent .*"full"'):
        run_frame(load_scene("planar-truss"))
    with pytest.raises(InputError, match="geometrically-exact rods only"):
        run_frame(SHORT.with_values({"rods.kind": "ancf"}))
    out = str(tmp_path / "run.nc")
    printed = called("run", "planar-truss", "--fidelity", "frame", "--out", out, code=2)
    assert len(printed.strip().splitlines()) == 1
    assert not Path(out).exists()


def test_runs_start_anew_as_those_of_the_full_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    tolerances = []

    def solve(scene: Scene, watch: Any = None) -> Outcome:
        tolerances.append(scene.solver.tolerance)
        if len(tolerances) == 1:
            return Outcome(Status.DIVERGED, "it grew", cause=Cause.ENERGY_GREW)
        return Outcome(Status.OK, "fine", {}, {"steps": np.array(7)})

    run_frame(SHORT)  # compiled by now
    monkeypatch.setattr(ringsim.frame.integrate, "solve", solve)
    found = run_frame(SHORT)
    assert found.status is Status.OK
    assert found.values["restarts"] == 1
    assert found.values["total_steps"] == 7
    assert tolerances[1] == found.values["tolerance_used"] < tolerances[0]


def test_whatever_breaks_in_a_run_is_a_status(monkeypatch: pytest.MonkeyPatch) -> None:
    def solve(scene: Scene, watch: Any = None) -> Outcome:
        raise ZeroDivisionError("on purpose")

    run_frame(SHORT)
    monkeypatch.setattr(ringsim.frame.integrate, "solve", solve)
    found = run_frame(SHORT)
    assert (found.status, found.cause) == (Status.ERROR, Cause.EXCEPTION)


@pytest.mark.slow
def test_error_bars_cover_the_difference_of_the_engines() -> None:
    quick = {  # the end of a deployment within half a second: two runs by each engine
        "structure.opening_angle": 165.0, "joints.vjoint.viscous": 0.1, "solver.tolerance": 4e-3,
        "solver.settling_time": 0.0,
        "cables.upper.winch.winding.speed": 0.1, "cables.lower.winch.winding.speed": 0.1,
    }  # fmt: skip
    scene = load_scene("truss2").with_values({"solver.error_bars": True} | quick)
    frame, full = run_frame(scene), run(scene)
    for name in ("deployment_time", "asynchrony_max", "peak_tension"):
        bars = sum(float(each.values[f"{name}_error"]) for each in (frame, full))
        assert abs(float(frame.values[name] - full.values[name])) < bars


def test_who_names_no_engine_gets_frames_where_they_represent_the_scene(tmp_path: Path) -> None:
    """And the full model elsewhere, which the first line says, and why."""
    short = "--set", "solver.end_time=0.1", "--out", str(tmp_path / "run.nc")
    assert "truss2: ok" in called("run", "truss2", *short).splitlines()[0]
    with xr.open_dataset(tmp_path / "run.nc") as found:
        assert found["fidelity"].item() == Fidelity.FRAME
    first, second, *_ = called("run", "planar-truss", *short).splitlines()
    assert first == ('using the full model: fidelity = "frame" does not represent prismatic joints')
    assert second.startswith("planar-truss: ok")
    with xr.open_dataset(tmp_path / "run.nc") as found:
        assert found["fidelity"].item() == Fidelity.FULL
    for name, wanted in (("truss2", Fidelity.FRAME), ("planar-truss", Fidelity.FULL)):
        scene = load_scene(name).with_values({"solver.end_time": 0.1})
        assert simulate(scene)["fidelity"].item() == wanted
    # What frames alone know is refused by the full model, with its own words.
    called("run", "planar-truss", "--set", "record.state_interval=0.01", *short, code=2)


def test_both_engines_stand_in_one_file_and_one_table(tmp_path: Path) -> None:
    out = tmp_path / "run.nc"
    words = "--set", "solver.end_time=0.5", "--set", "solver.tolerance=3e-3"
    printed = called("run", "truss2", "--fidelity", "both", *words, "--out", str(out))
    with xr.open_dataset(out) as found:
        full, frame = simulate(SHORT, "full"), simulate(SHORT, "frame")
        for name in ("peak_tension", "asynchrony_max", "opening_angle"):
            xr.testing.assert_equal(found[name].variable, full[name].variable)
            xr.testing.assert_equal(found[f"{name}_frame"].variable, frame[name].variable)
        assert found.attrs["fidelity"] == "both"
        assert found["fidelity_frame"].item() == Fidelity.FRAME
        assert found["peak_tension_frame"].attrs["units"] == "N"
    (row,) = [each.split() for each in printed.splitlines() if "peak_tension " in each]
    one, other = (each["peak_tension"].item() for each in (frame, full))
    told = [float(number) for number in row[2:6]]
    wanted = [one, other, abs(one - other), abs(one - other) / other]
    assert told == pytest.approx(wanted, rel=0.06)
    assert row[6] == "-"
    assert "truss2 (frame): ok" in printed
    assert "truss2 (full): ok" in printed


def test_measured_settings_are_for_one_engine() -> None:
    printed = called("run", "truss2", "--accuracy", "0.05", "--fidelity", "both", code=2)
    assert "leave out one" in printed


def test_settings_of_an_engine_that_was_not_measured_are_refused() -> None:
    printed = called("run", "planar-truss", "--accuracy", "0.05", "--fidelity", "frame", code=2)
    assert "no settings were measured for this fidelity with planar-truss" in printed
