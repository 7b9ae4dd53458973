"""``ringsim accuracy`` and ``ringsim run --accuracy`` on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest
import xarray as xr
from click.testing import CliRunner, Result
from loops import for_each

from ringsim import simulation
from ringsim.analysis.study import evidence_for, read_evidence
from ringsim.cli import cli
from ringsim.scene import builtin_scenes, load_scene

SMALL = [
    "--set", "structure.sections=3", "--set", "structure.aspect_ratio=1.0", "--set", "net=none",
    "--set", "loads.force=0.03", "--set", "solver.end_time=5.0",
]  # fmt: skip


def ringsim(*words: str) -> Result:
    return CliRunner().invoke(cli, list(words))


@for_each("name", builtin_scenes())
def test_every_builtin_scene_has_its_evidence(name: str) -> None:
    scene = load_scene(name)
    evidence = evidence_for(scene)
    of = dict.fromkeys(("ring18-flight", "ring18-ground", "ring18-motor"), "ring18-cable")
    of["ring18-stow"] = "ring18"
    assert evidence.scene == of.get(name, name)
    for setting in evidence.settings:
        scene.with_values(dict(setting.values))


def test_settings_are_picked_and_told(tmp_path: Path) -> None:
    out = tmp_path / "run.nc"
    found = ringsim("run", "ring18", *SMALL, "--accuracy", "0.05", "--out", str(out))
    assert found.exit_code == 0, found.output
    picked = evidence_for(load_scene("ring18")).pick(0.05)
    step = f"solver.step = {picked.values['solver.step']}"
    assert f"settings for 0.05: fidelity = frame, {step}, solver.tolerance" in found.output
    assert "errors measured with ring18: deployment time" in found.output
    with xr.open_dataset(out) as dataset:
        assert f"tolerance = {picked.values['solver.tolerance']}" in dataset.attrs["scene"]
        assert dataset.attrs["fidelity"] == "frame"


@pytest.mark.parametrize(
    ("words", "represented"),
    [(["--fidelity", "full"], True), ([], False)],
    ids=["asked-for", "not-represented"],
)
def test_the_full_engine_runs_where_the_cheaper_one_cannot_or_may_not(
    words: list[str], represented: bool, tmp_path: Path, monkeypatch
) -> None:
    out = tmp_path / "run.nc"
    if not represented:
        monkeypatch.setattr(simulation, "why_not_frame", lambda scene: "it cannot")
    asked = ["--set", "solver.end_time=0.5", "--accuracy", "0.05", "--out", str(out)]
    found = ringsim("run", "ring18", *SMALL, *asked, *words)
    assert found.exit_code == 0, found.output
    assert "settings for 0.05: fidelity = full, " in found.output
    with xr.open_dataset(out) as dataset:
        assert dataset.attrs["fidelity"] == "full"


@for_each(
    ("words", "told"),
    [
        (["--accuracy", "1e-7"], "the best setting measured with ring18 has an error of"),
        (["--accuracy", "0.05", "--of", "mass"], "--of mass: must be one of motion, loads"),
        (["--accuracy", "0.05", "--of", "peak_tension"], "not measured with ring18: choose"),
        (["--of", "loads"], "without --accuracy"),
        (["--accuracy", "0.05", "--set", "solver.step_control=constant"], "step_control"),
        (["--accuracy", "0.05", "--fidelity", "both"], "leave out one"),
        (["--accuracy", "0.05", "--set", "solver.tolerance=1e-3"], "--accuracy selects this value"),
        (["--evidence", "none.toml"], "without --accuracy"),
        (["--accuracy", "0.01", "--evidence", "none.toml"], "there is no such file"),
        (["--accuracy", "7"], "--accuracy"),
    ],
)
def test_what_makes_no_sense_is_refused(words: list[str], told: str, tmp_path: Path) -> None:
    found = ringsim("run", "ring18", *words, "--out", str(tmp_path / "x.nc"))
    assert found.exit_code == 2
    assert told in found.output
    assert not list(tmp_path.iterdir())


def test_slope_vector_rods_need_their_own_evidence(tmp_path: Path) -> None:
    scene = tmp_path / "ancf.toml"
    scene.write_text(load_scene("ring18").with_values({"rods.kind": "ancf"}).to_toml())
    found = ringsim("run", str(scene), "--accuracy", "0.01", "--out", str(tmp_path / "x.nc"))
    assert found.exit_code == 2
    assert "geometrically-exact" in found.output


def test_a_scene_without_a_good_end_is_told_early(tmp_path: Path) -> None:
    """The cheapest reference run tells; nothing else is run."""
    small = [*SMALL, "--set", "solver.end_time=0.2"]
    words = ["accuracy", "ring18", *small, "--out", str(tmp_path), "--workers", "1"]
    found = CliRunner().invoke(cli, words, standalone_mode=False)
    assert found.return_value == 3
    assert "reference run with solver.step_control = motion" in found.output
    assert "locked" in found.output
    assert "change the scene" in found.output
    assert {file.name for file in tmp_path.iterdir() if file.is_dir()} == {"first"}


def test_a_study_of_a_missing_scene_is_bad_input(tmp_path: Path) -> None:
    found = ringsim("accuracy", "ring99", "--out", str(tmp_path / "x"))
    assert found.exit_code == 2
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_a_study_from_end_to_end(tmp_path: Path) -> None:
    folder = tmp_path / "study"
    found = ringsim("accuracy", "ring18", *SMALL, "--out", str(folder), "--workers", "2")
    assert found.exit_code == 0, found.output
    assert {"accuracy.nc", "accuracy.md", "accuracy.png", "settings.toml"} <= {
        file.name for file in folder.iterdir()
    }
    with xr.open_dataset(folder / "accuracy.nc") as study:
        error = study.error.sel(output="deployment_time")
        assert float(error.where(study.ladder == "as it stands").min()) < 2e-4
        assert 0.9 < float(study.order.sel(graded="steps", output="energy")) < 3.0
        assert float(study.engines_differ.sel(output="motion")) < 1e-3
        assert (study.bound >= study.error).where(study.error.notnull(), True).all()
    own = read_evidence(folder / "settings.toml")
    wanted = own.settings[-1].errors["motion"]
    again = ringsim(
        "run", "ring18", *SMALL, "--accuracy", str(2.0 * wanted),
        "--evidence", str(folder / "settings.toml"), "--out", str(tmp_path / "run.nc"),
    )  # fmt: skip
    assert again.exit_code == 0, again.output
