"""Calibrations from file to posterior: tests of known truth, kills, workers, and refusals."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from loops import for_each

import ringsim
import ringsim.campaign.calibration as calibration
from ringsim import simulation
from ringsim.analysis import derived
from ringsim.analysis.posterior import calibration_tables
from ringsim.analysis.residuals import clock_line, residual_statistics, residuals
from ringsim.campaign.calibration import POSTERIOR, SENSORS, calibration_of
from ringsim.campaign.run import Ended
from ringsim.cli import cli
from ringsim.measured import load_measured
from ringsim.overrides import at_path
from ringsim.plots.comparison import learnt
from ringsim.refusal import InputError
from ringsim.sampling.distributions import Calibrated, Lognormal, Truncated, Uniform
from ringsim.scene import load_scene
from ringsim.simulation import simulate
from ringsim.tables import counted

SETTINGS = {
    "structure.sections": 3, "structure.opening_angle": 100.0, "boom": "none",
    "solver.end_time": 1.5,
}  # fmt: skip
PRIORS = {
    "cables.upper.winch.winding.speed":
        {"kind": "normal", "mean": 0.12, "standard_deviation": 0.01},
    "structure.opening_angle": {"kind": "uniform", "low": 97.0, "high": 103.0},
    "rods.poisson_ratio": {"kind": "lognormal", "mean": 0.3, "standard_deviation": 0.02},
}  # fmt: skip
TRUTH = {"cables.upper.winch.winding.speed": 0.127, "structure.opening_angle": 99.0}
TIMES = np.arange(0.1, 1.42, 0.1)
CLOCK = {"offset": 0.3, "drift": -0.02}
"""Of the stand: what the file does not say."""


def scene():
    return load_scene("ring18-cable").with_values(SETTINGS)


def write_test(folder, values, *, clock=None, deviation=0.1, seed=1, planned=False):
    """Readings of the V-joints of a run, which the clock of the stand shows; its TOML file."""
    folder.mkdir(exist_ok=True)
    run = simulate(scene().with_values(values | {"record.interval": 0.01}), fidelity="frame")
    stream, places = np.random.default_rng(seed), [("upper", 1), ("upper", 2), ("lower", 1)]
    clock = clock or {"offset": 0.0, "drift": 0.0}
    columns = [(TIMES - clock["offset"]) / (1.0 + clock["drift"])]
    lines = ['name = "stand"']
    if planned:
        lines += ["clock = { interval = 0.1, end = 1.4 }"]
    else:
        lines += ['file = "stand.csv"', 'clock = { column = "t" }']
    for plane, section in places:
        angle = run["opening_angle"].sel(plane=plane, section=section).dropna("time")
        exact = np.interp(TIMES, angle["time"], angle)
        columns.append(exact + deviation * stream.standard_normal(len(TIMES)))
        lines += ["[[sensors]]", f'column = "{plane}{section}"', 'variable = "opening_angle"',
                  f'place = {{ plane = "{plane}", section = {section} }}', 'unit = "deg"',
                  f"standard_deviation = {deviation}"]  # fmt: skip
    head = ",".join(["t", *(f"{p}{s}" for p, s in places)])
    np.savetxt(folder / "stand.csv", np.column_stack(columns), delimiter=",", header=head,
               comments="", fmt="%.6f")  # fmt: skip
    (folder / "stand.toml").write_text("\n".join(lines))
    return folder / "stand.toml"


def write_file(folder, runs=48, stages=3, more="", inputs=PRIORS):
    """A calibration file beside ``stand.toml``."""
    rows = [f'"{path}" = {table(law)}' for path, law in inputs.items()]
    (folder / "ring.toml").write_text(scene().to_toml())
    (folder / "cal.toml").write_text("\n".join([
        'name = "cal"', 'scene = "ring.toml"', "seed = 5", 'measured = "stand.toml"',
        f"runs = {runs}", f"stages = {stages}", more, "[inputs]", *rows,
    ]))  # fmt: skip
    return folder / "cal.toml"


def table(law):
    parts = (f"{k} = {str(v).lower() if isinstance(v, bool) else repr(v).replace(chr(39), chr(34))}"
             for k, v in law.items())  # fmt: skip
    return f"{{ {', '.join(parts)} }}"


@pytest.fixture(scope="module")
def test_files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stand")
    write_test(folder, TRUTH)
    return write_file(folder)


@pytest.fixture(scope="module")
def found(test_files, tmp_path_factory):
    """The posterior of the test, in this process."""
    out = tmp_path_factory.mktemp("found")
    return ringsim.Calibration.read(test_files).run(workers=0, out=out / "cal"), out / "cal"


@pytest.mark.parametrize("verb", ["calibrate", "sensors"])
def test_cost_is_told_before_anything_runs(test_files, tmp_path, monkeypatch, verb):
    monkeypatch.chdir(tmp_path)
    told = CliRunner().invoke(cli, [verb, str(test_files), "--dry-run", "--workers", "1"])
    assert told.exit_code == 0
    assert not list(tmp_path.iterdir())
    assert "about 48 runs" in told.stdout
    assert "predicted      about" in told.stdout


def test_truth_lies_within_what_was_found(found):
    posterior, _ = found
    for name, value in TRUTH.items():
        low, _, high = posterior["posterior_quantile"].sel(unknown=name).values
        wide = high - low
        assert low - 0.3 * wide < value < high + 0.3 * wide  # 3 sigma
        assert posterior["learnt"].sel(unknown=name) < 0.3
    assert float(posterior["learnt"].sel(unknown="rods.poisson_ratio")) > 0.95  # no angle tells it
    assert float(posterior["chance_of_all"].min()) > 1e-3
    assert int(posterior["lost"].sum()) == 0


def test_samples_quantiles_and_numbers_of_the_file_agree(found):
    posterior, _ = found
    for k, name in enumerate(posterior["unknown"].values):
        variable = next(v for v in posterior if posterior[v].attrs.get("path") == name)
        law = PRIORS[name]
        samples = posterior[variable].values
        stated = posterior["posterior_quantile"].values[k]
        shares = [(samples < edge).mean() for edge in stated]
        np.testing.assert_allclose(shares, [0.05, 0.5, 0.95], atol=0.05)
        if law["kind"] == "normal":  # x = mean + s (m + s' u): remaining scatter by hand
            assert posterior["learnt"].values[k] == pytest.approx(
                (stated[2] - stated[0]) / 2 / 1.6449 / law["standard_deviation"], rel=1e-3
            )
            edges = law["mean"] + law["standard_deviation"] * np.array([-1.6449, 0.0, 1.6449])
            np.testing.assert_allclose(posterior["prior_quantile"].values[k], edges, rtol=1e-4)
    last = posterior["stage_learnt"].isel(stage=-1).values
    np.testing.assert_array_equal(last, posterior["learnt"].values)


def test_stages_are_campaigns_of_their_own(found):
    _, folder = found
    for stage in (1, 3):
        runs = ringsim.open_campaign(folder / f"stage-{stage}")
        assert runs.sizes["sample"] == 16
    done = CliRunner().invoke(cli, ["status", str(folder / "stage-2")])
    assert done.exit_code == 0
    assert "16 of 16" in done.output
    for verb in ("status", "analyse"):
        done = CliRunner().invoke(cli, [verb, str(folder)])
        assert done.exit_code == 2
        assert f"give a campaign inside it, such as {folder / 'stage-1'} .. stage-3" in done.output


def test_budget_can_be_set_in_the_call(test_files):
    given = calibration_of(
        test_files.read_text(), test_files, {"runs": 60, "stages": 2, "solver.step": 0.02}
    )
    assert (given.budget.runs, given.budget.stages, given.members) == (60, 2, 30)
    assert given.campaign.scene.solver.step == 0.02


def test_the_stand_plans_with_the_two_changes_that_the_page_names(tmp_path):
    stand = Path(__file__).parents[2] / "campaigns" / "stand"
    text = (stand / "measured.toml").read_text(encoding="utf-8")
    line = "clock = { interval = 0.5, end = 9.0 }"
    page = (stand.parents[1] / "docs" / "guide" / "calibrate.md").read_text(encoding="utf-8")
    assert line in page
    text = text.replace('file = "readings.csv"\n', f"{line}\n")
    text = text.replace('[clock]\ncolumn = "t"\n', "")
    (tmp_path / "planned.toml").write_text(text, encoding="utf-8")
    readings = load_measured(tmp_path / "planned.toml", planned=True).readings
    assert len(readings) == text.count("[[sensors]]")
    np.testing.assert_allclose(readings[0].times, np.arange(0.5, 9.25, 0.5))


def test_what_is_printed_is_what_the_file_holds(test_files, found):
    posterior, folder = found
    done = CliRunner().invoke(cli, ["calibrate", str(test_files), "--out", str(folder)])
    assert done.exit_code == 0, done.output
    row = next(r for r in done.output.splitlines() if r.startswith("structure.opening_angle"))
    cells = [cell.strip() for cell in row.split("  ") if cell.strip()]
    low, middle, high = (
        posterior["posterior_quantile"].sel(unknown="structure.opening_angle").values
    )
    assert cells[1] == "deg"
    assert float(cells[3]) == pytest.approx(middle, rel=1e-3)
    assert [float(v) for v in cells[4].split(" .. ")] == pytest.approx([low, high], rel=2e-3)
    assert "hardly learnt from these sensors: rods.poisson_ratio" in done.output
    assert "the posterior explains every sensor" in done.output
    # Readings that the model cannot give, and those that the stages have not come to.
    wrong = posterior.assign(chance=0.0 * posterior["chance"])
    for off, words in (0.2, "The model lacks something"), (3.0, "the stages have not come to"):
        _, verdict = calibration_tables(wrong.assign(off=0.0 * posterior["off"] + off))
        text = "\n".join(verdict.notes)
        assert "NOT EXPLAINED" in text
        assert words in text
        assert ("The model lacks" in text) == (off < 1.0)
    assert f"wrote {folder / POSTERIOR}" in done.output
    first = done.output.splitlines()[0]
    assert first == "cal: 48 runs in 3 stages of 16, one after the other; what has run is kept"


def equal(one, other):
    with xr.open_dataset(one) as a, xr.open_dataset(other) as b:
        assert a.equals(b)
        return True


def command(*words):
    return [sys.executable, "-m", "ringsim", "calibrate", *map(str, words)]


@pytest.mark.slow
def test_killed_in_a_stage_and_finished_by_other_workers_it_is_the_same(
    test_files, found, tmp_path
):
    out = tmp_path / "out"
    process = subprocess.Popen(
        command(test_files, "--out", out, "--workers", 2), start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    end = time.monotonic() + 120.0
    while not (out / "stage-2" / "design.nc").exists():  # killed while the second one runs
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert not (out / POSTERIOR).exists()
    subprocess.run(command(test_files, "--out", out, "--workers", 1), check=True,
                   capture_output=True, timeout=300)  # fmt: skip
    assert equal(out / POSTERIOR, found[1] / POSTERIOR)


MPIEXEC = shutil.which(
    "mpiexec", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
)


@pytest.mark.slow
@pytest.mark.skipif(MPIEXEC is None, reason="there is no mpiexec: ringsim[mpich]")
def test_ranks_of_mpi_find_the_same(test_files, found, tmp_path):
    done = subprocess.run(
        [MPIEXEC, "-n", "2", *command(test_files, "--out", tmp_path / "out")],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("wrote ") == 1
    assert equal(tmp_path / "out" / POSTERIOR, found[1] / POSTERIOR)


def test_clock_of_the_stand_is_found_too(tmp_path):
    """Offset and drift are unknowns of the readings alone: no run knows them."""
    stand_file = write_test(tmp_path, TRUTH, clock=CLOCK)
    more = (
        "[clock]\n"
        'offset = { kind = "normal", mean = 0.0, standard_deviation = 0.3 }\n'
        'drift = { kind = "normal", mean = 0.0, standard_deviation = 0.02 }\n'
    )
    inputs = {k: v for k, v in PRIORS.items() if k != "rods.poisson_ratio"}
    file = write_file(tmp_path, 48, 3, more, inputs)
    told = CliRunner().invoke(cli, ["calibrate", str(file), "--dry-run", "--workers", "1"])
    assert (
        "\n  clock.offset: normal, mean 0, standard deviation 0.3\n  clock.drift: " in told.stdout
    )
    posterior = ringsim.Calibration.read(file).run(workers=0, out=tmp_path / "out")
    for name, value in (TRUTH | {f"clock.{k}": v for k, v in CLOCK.items()}).items():
        low, _, high = posterior["posterior_quantile"].sel(unknown=name).values
        assert low - 0.3 * (high - low) < value < high + 0.3 * (high - low), name
    assert float(posterior["chance_of_all"].min()) > 1e-3
    assert posterior.attrs["inputs"].count("clock") == 0  # no campaign draws them
    # Readings beside a campaign that draws from it are by the clock that was found.
    found = posterior["posterior_quantile"].sel(level=0.5)
    drawn = ringsim.Campaign(
        scene(), {"from": str(tmp_path / "out" / POSTERIOR)}, {"kind": "random", "samples": 12},
        fidelity="frame",
    ).run(workers=0, out=tmp_path / "flight")  # fmt: skip
    clocks = json.loads(drawn.attrs["clocks"])["stand"]
    for name in CLOCK:
        assert clocks[name] == [0.0, pytest.approx(float(found.sel(unknown=f"clock.{name}")))]
    stand = load_measured(tmp_path / "stand.toml")
    rms = residual_statistics(residuals(drawn, stand)).attrs["rms_in_deviations"]
    assert rms == pytest.approx(1.0, abs=0.35)
    with xr.open_dataset(tmp_path / "out" / "stage-3" / "campaign.nc") as last:  # its own ensemble
        beside = residual_statistics(residuals(last, stand)).attrs["rms_in_deviations"]
        last.attrs.pop("clocks")
        without = residual_statistics(residuals(last, stand)).attrs["rms_in_deviations"]
    assert beside < 0.5 * without  # by the median of 16 clocks
    unknown = drawn.copy()
    unknown.attrs.pop("clocks")
    assert residual_statistics(residuals(unknown, stand)).attrs["rms_in_deviations"] > 10.0
    done = CliRunner().invoke(cli, ["compare", str(tmp_path / "flight"), str(stand_file)])
    told = f"the clock that the calibration has found: an offset of {clocks['offset'][1]:.4g} s"
    assert told in done.output
    # A file that says another clock since is believed.
    text = stand_file.read_text().replace('"t" }', '"t", offset = 0.31 }')
    stand_file.write_text(text)
    assert not clock_line(drawn, load_measured(stand_file))


def test_sensors_may_read_outputs_by_expressions(test_files, tmp_path):
    """The angle of a joint at one time, which the truth had; in the stages by hand."""
    run = simulate(scene().with_values(TRUTH | {"record.interval": 0.01}), fidelity="frame")
    value = float(run["opening_angle"].sel(plane="upper", section=1, time=1.0))
    (tmp_path / "stand.toml").write_text(
        'name = "own"\n[[sensors]]\nvariable = "open"\nunit = "deg"\nstandard_deviation = 0.1\n'
        f"value = {value}\n"
    )
    own = "[outputs]\nopen = \"opening_angle(plane='upper', section=1, time=1.0)\""
    file = write_file(
        tmp_path, 32, 2, own, {"structure.opening_angle": PRIORS["structure.opening_angle"]}
    )
    posterior = ringsim.Calibration.read(file).run(workers=0, out=tmp_path / "out")
    assert posterior["sensor"].values.tolist() == ["open"]
    last = xr.load_dataset(tmp_path / "out" / "stage-2" / "campaign.nc")
    angle = last["opening_angle"].sel(plane="upper", section=1)
    np.testing.assert_allclose(last["open"], angle.interp(time=1.0))
    assert float(posterior["learnt"][0]) < 0.2
    derived.forget(derived.declared())


@pytest.mark.slow
def test_friction_that_the_model_does_not_know_is_told(tmp_path):
    write_test(tmp_path, TRUTH | {"cables.upper.friction.coefficient": 2e-3})
    file = write_file(tmp_path, inputs={k: v for k, v in PRIORS.items() if "poisson" not in k})
    done = CliRunner().invoke(
        cli, ["calibrate", str(file), "--out", str(tmp_path / "out"), "--workers", "1"]
    )
    assert done.exit_code == 0
    assert "NOT EXPLAINED" in done.output


@pytest.mark.parametrize("which", ["rods.poisson_ratio", "cables.upper.winch.winding.speed"])
def test_runs_that_fail_are_counted_and_shift_nothing(which, test_files, tmp_path, monkeypatch):
    """By what no angle tells, or by what is looked for, the truth among those that do not fail."""
    engine = simulation.run_frame
    limit = {"rods.poisson_ratio": 0.317, "cables.upper.winch.winding.speed": 0.129}[which]
    kept = {"rods.poisson_ratio": 0.81, "cables.upper.winch.winding.speed": 0.82}[which]

    def brittle(ring, *more):
        value = ring.rods.poisson_ratio
        if which != "rods.poisson_ratio":
            value = ring.cables.upper.winch.winding.speed
        if np.max(value) > limit:
            raise RuntimeError("it broke")
        return engine(ring, *more)

    monkeypatch.setattr(simulation, "run_frame", brittle)
    posterior = ringsim.Calibration.read(test_files).run(workers=0, out=tmp_path / "out")
    lost = posterior["lost"].values
    assert lost[0] == pytest.approx(16 * (1.0 - kept), abs=3)
    assert lost[0] > 0
    for name, value in TRUTH.items():
        low, _, high = posterior["posterior_quantile"].sel(unknown=name).values
        wide = high - low
        assert low - 0.3 * wide < value < high + 0.3 * wide, name
        assert posterior["learnt"].sel(unknown=name) < 0.3
    _, verdict = calibration_tables(posterior)
    assert f"{counted(int(lost.sum()), 'run')} of 48 failed and told nothing" in verdict.notes
    with xr.open_dataset(tmp_path / "out" / "stage-1" / "campaign.nc") as stage:
        assert int((stage["status"] != 0).sum()) == lost[0]


def test_what_is_refused_leaves_what_was_found(test_files, found, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(found[1], out)
    refused = CliRunner().invoke(cli, [
        "calibrate", str(test_files), "--out", str(out), "--set", "solver.tolerance=2e-3",
    ])  # fmt: skip
    assert refused.exit_code == 2
    assert "this folder has another campaign" in refused.output
    assert equal(out / POSTERIOR, found[1] / POSTERIOR)


def test_other_readings_are_refused_and_leave_what_was_found(test_files, found, tmp_path):
    """The first stage is that of the priors alone, and so the same; the second is not."""
    for name in ("stand.toml", "ring.toml", "cal.toml"):
        shutil.copy(test_files.parent / name, tmp_path)
    rows = (test_files.parent / "stand.csv").read_text().splitlines()
    cells = rows[4].split(",")
    rows[4] = ",".join([cells[0], f"{float(cells[1]) + 0.1:.6f}", *cells[2:]])
    (tmp_path / "stand.csv").write_text("\n".join(rows))
    out = tmp_path / "out"
    shutil.copytree(found[1], out)
    told = CliRunner().invoke(cli, ["calibrate", str(tmp_path / "cal.toml"), "--out", str(out)])
    assert told.exit_code == 2
    assert "stage 2 of 3" in told.output
    assert equal(out / POSTERIOR, found[1] / POSTERIOR)


@pytest.mark.parametrize(("runs", "stages"), [(96, 3), (36, 3), (100, 2)])
def test_stages_of_other_sizes_are_refused_before_any_of_them_grows(
    runs, stages, test_files, found, tmp_path
):
    out = tmp_path / "out"
    shutil.copytree(found[1], out)
    held = {path: path.stat().st_mtime_ns for path in out.rglob("*")}
    words = ["--set", f"runs={runs}", "--set", f"stages={stages}", "--out", str(out)]
    told = CliRunner().invoke(cli, ["calibrate", str(test_files), *words])
    assert told.exit_code == 2
    assert f"runs = {runs}: stages of {runs // stages} runs, and stage-1 in" in told.output
    assert f"has 16: set runs = {16 * stages} to go on with it" in told.output
    assert {path: path.stat().st_mtime_ns for path in out.rglob("*")} == held


def test_places_of_what_the_scene_has_not_may_be_unknown(test_files, tmp_path):
    """Hinges without friction in the scene; drawn about the prior's median."""
    for name in ("stand.toml", "stand.csv"):
        shutil.copy(test_files.parent / name, tmp_path)
    law = {"kind": "lognormal", "mean": 0.01, "standard_deviation": 0.001, "each_section": True}
    path = "joints.hinge.viscous"
    assert at_path(scene(), path) is None
    file = write_file(tmp_path, 16, 1, inputs={path: law})
    posterior = ringsim.Calibration.read(file).run(workers=0, out=tmp_path / "out")
    assert posterior["unknown"].values.tolist() == [f"{path}[{k + 1}]" for k in range(3)]
    with xr.open_dataset(tmp_path / "out" / "stage-1" / "campaign.nc") as runs:
        drawn = np.array([runs[f"joints_hinge_viscous_{k + 1}"].values for k in range(3)])
        assert (runs["status"] == 0).all()
    middle = 0.01 / np.sqrt(1.01)  # of the lognormal
    np.testing.assert_allclose(np.exp(np.log(drawn).mean(axis=1)), middle, rtol=0.05)
    assert len(np.unique(drawn)) == drawn.size


def test_what_was_found_goes_once_a_stage_is_run_anew(test_files, found, tmp_path, monkeypatch):
    """As of stages that were deleted: an interrupted call would leave what is no longer true."""
    out = tmp_path / "out"
    shutil.copytree(found[1], out)
    for stage in (2, 3):
        shutil.rmtree(out / f"stage-{stage}")
    monkeypatch.setattr(
        calibration, "start", lambda _, order, then: order() and order() and Ended()
    )
    calibration.run_course(lambda: ringsim.Calibration.read(test_files)._given, 0, out)
    assert (out / "stage-2").exists()
    assert not (out / POSTERIOR).exists()


def test_too_many_failed_runs_end_it_in_one_line(test_files, tmp_path, monkeypatch):
    monkeypatch.setattr(simulation, "run_frame", lambda *_: 1 / 0)
    with pytest.raises(InputError, match="stage-1: 0 of 16 runs ended well, and 3 unknowns take 8"):
        ringsim.Calibration.read(test_files).run(workers=0, out=tmp_path / "out")
    assert not (tmp_path / "out" / POSTERIOR).exists()


def test_gross_errors_are_named_by_sensor_and_time(test_files, found, tmp_path):
    for name in ("stand.toml", "stand.csv", "ring.toml", "cal.toml"):
        shutil.copy(test_files.parent / name, tmp_path)
    rows = [row.split(",") for row in (tmp_path / "stand.csv").read_text().splitlines()]
    rows[3][1] = f"{float(rows[3][1]) + 4.0:.6f}"  # 40 sigma
    rows[9][1] = f"{float(rows[9][1]) - 2.0:.6f}"
    (tmp_path / "stand.csv").write_text("\n".join(map(",".join, rows)))
    stand = tmp_path / "stand.toml"  # the time is told as the table has it
    stand.write_text(stand.read_text().replace('column = "t" }', 'column = "t", offset = 0.1 }'))
    rows = [[rows[0][0], *rows[0][1:]], *([f"{float(r[0]) - 0.1:.6f}", *r[1:]] for r in rows[1:])]
    (tmp_path / "stand.csv").write_text("\n".join(map(",".join, rows)))
    posterior = ringsim.Calibration.read(tmp_path / "cal.toml").run(workers=0, out=tmp_path / "o")
    assert posterior["stray_sensor"].values.tolist() == ["opening_angle upper 1"] * 2
    np.testing.assert_allclose(posterior["stray_time"], [0.2, 0.8], atol=1e-6)
    assert posterior.attrs["clock_unit"] == "s"
    np.testing.assert_allclose(posterior["stray_size"], [40.0, -20.0], atol=4.0)
    clean = found[0]
    for name in TRUTH:  # but for two readings of 42 the same
        now, was = (each["posterior_quantile"].sel(unknown=name).values
                    for each in (posterior, clean))  # fmt: skip
        assert abs(now[1] - was[1]) < 0.25 * (was[2] - was[0])
    _, verdict = calibration_tables(posterior)
    (line,) = (note for note in verdict.notes if note.startswith("set aside"))
    assert "opening_angle upper 1 at 0.2 s (+" in line
    assert "opening_angle upper 1 at 0.8 s (-" in line


@pytest.mark.slow
def test_pulley_with_a_prior_of_its_own_is_measured(tmp_path):
    """Five times the friction of the others: named, and then found with its own prior."""
    pulleys = "cables.upper.friction.coefficient"
    write_test(tmp_path, {f"{pulleys}[3]": 2e-3}, deviation=0.02)
    law = {"kind": "lognormal", "mean": 4e-4, "standard_deviation": 8e-5, "each_section": True}
    ring = scene().with_values({pulleys: 4e-4})
    own = {"kind": "uniform", "low": 0.0, "high": 4e-3}
    tables = {}
    for name, more in {"one": {}, "two": {f"{pulleys}[3]": own}}.items():
        file = write_file(tmp_path, 72, 3, inputs=more | {pulleys: law})
        (tmp_path / "ring.toml").write_text(ring.to_toml())
        tables[name] = ringsim.Calibration.read(file).run(workers=0, out=tmp_path / name)
    names = tables["one"]["unknown"].values.tolist()
    assert [pulleys in name for name in names] == [True] * 8
    # By its number or by its name, it stands at its place.
    assert tables["two"]["unknown"].values.tolist() == [*names[:2], f"{pulleys}[3]", *names[3:]]
    low, _, high = tables["two"]["posterior_quantile"][2].values
    assert low - 0.3 * (high - low) < 2e-3 < high + 0.3 * (high - low)
    judged = np.isfinite(tables["two"]["contrast"].values)
    assert judged.tolist() == [True, True, False, True, True, True, True, True]
    assert not (tables["two"]["group"] > 0).any()


def test_a_stage_that_has_overshot_begins_nearer_to_the_one_before(tmp_path, monkeypatch):
    """Where the middle of the next one is nothing that a ring can have."""
    write_test(tmp_path, TRUTH)
    file = write_file(tmp_path)
    right = calibration.learn
    stages = []

    def overshot(points, told):
        found = right(points, told)
        stages.append(points)
        if len(stages) == 1:  # 14 sigma: a ratio of Poisson of 0.75, half of it scatters beyond 0.5
            mean = found.posterior.mean.copy()
            mean[2] = 14.0
            return found._replace(posterior=found.posterior._replace(mean=mean))
        return found

    monkeypatch.setattr(calibration, "learn", overshot)
    posterior = ringsim.Calibration.read(file).run(workers=0, out=tmp_path / "out")
    assert stages[1][:, 2].mean() == pytest.approx(3.5, abs=0.8)
    assert "stage-2" in {each.name for each in (tmp_path / "out").iterdir()}
    assert posterior.attrs["runs"] == 48


# What stands on it.


def test_campaign_draws_what_was_found(found, tmp_path):
    posterior, folder = found
    shutil.copy(folder / POSTERIOR, tmp_path)
    (tmp_path / "ring.toml").write_text(scene().to_toml())
    (tmp_path / "flight.toml").write_text(
        'name = "flight"\nscene = "ring.toml"\nfidelity = "frame"\n'
        'design = { kind = "sobol", samples = 256 }\n'
        '[inputs]\nfrom = { file = "posterior.nc", without = ["rods.poisson_ratio"] }\n'
        '"rods.damping" = { kind = "uniform", low = 0.0005, high = 0.002 }\n'
    )
    table_ = ringsim.campaign.specification.load_campaign(tmp_path / "flight.toml").draw()
    drawn = {column.path: column.values for column in table_.columns}
    assert set(drawn) == {"rods.damping", *TRUTH}
    for name in TRUTH:
        stated = posterior["posterior_quantile"].sel(unknown=name).values
        np.testing.assert_allclose(np.quantile(drawn[name], [0.05, 0.5, 0.95]), stated, rtol=2e-3)
    held = [list(posterior["unknown"].values).index(name) for name in TRUTH]
    wanted = posterior["correlation"].values[held[0], held[1]]
    assert np.corrcoef(*(drawn[name] for name in TRUTH))[0, 1] == pytest.approx(wanted, abs=0.05)
    assert abs(wanted) > 0.3  # or the line above says nothing


@pytest.mark.slow
def test_second_test_begins_where_the_first_ended(found, tmp_path):
    """Twice the same readings are worth readings of half the variance.  By their own name alone
    they are refused."""
    posterior, folder = found
    stand = write_test(tmp_path, TRUTH)
    stand.write_text(stand.read_text().replace('name = "stand"', 'name = "stand-2"'))
    shutil.copy(folder / POSTERIOR, tmp_path)
    file = write_file(tmp_path, inputs={})
    file.write_text(file.read_text() + '\nfrom = "posterior.nc"\n')
    second = ringsim.Calibration.read(file).run(workers=0, out=tmp_path / "out")
    for name in TRUTH:
        was = posterior["posterior_quantile"].sel(unknown=name).values
        now = second["posterior_quantile"].sel(unknown=name).values
        assert (now[2] - now[0]) / (was[2] - was[0]) == pytest.approx(np.sqrt(0.5), rel=0.06)
        assert now[1] == pytest.approx(was[1], abs=0.1 * (was[2] - was[0]))
    assert '"data": "stand, stand-2"' in second.attrs["inputs"]


@pytest.mark.parametrize("mark", ["", " (NOT EXPLAINED: intervals too narrow)", ", later"])
def test_readings_that_a_prior_has_learnt_from_are_refused(mark, tmp_path):
    write_test(tmp_path, TRUTH)
    file = write_file(tmp_path, inputs={})
    of = table({"kind": "uniform", "low": 97.0, "high": 103.0})
    prior = f'{{ kind = "calibrated", of = {of}, shift = 0.1, remaining_scatter = 0.5, data = '
    text = f'{file.read_text()}\n"structure.opening_angle" = {prior}"first, stand{mark}" }}\n'
    file.write_text(text)
    for more in (["--dry-run"], ["--out", str(tmp_path / "out")]):
        told = CliRunner().invoke(cli, ["calibrate", str(file), *more])
        assert told.exit_code == 2
        assert (
            "inputs.structure.opening_angle has learnt from the test stand already" in told.output
        )
        assert "another name in stand.toml" in told.output
    assert not (tmp_path / "out").exists()
    calibration_of(text.replace("first, stand", "first, stand-0"), file).require_readings()


def test_plan_of_sensors_foretells_what_a_test_tells(test_files, found, tmp_path):
    write_test(tmp_path, TRUTH, planned=True)
    file = write_file(tmp_path)
    done = CliRunner().invoke(
        cli, ["sensors", str(file), "--out", str(tmp_path / "plan"), "--workers", "1"]
    )
    assert done.exit_code == 0, done.output
    plan = xr.load_dataset(tmp_path / "plan" / SENSORS)
    assert done.output.index(str(plan["sensor"].values[0])) < done.output.index(
        str(plan["sensor"].values[1])
    )
    for name in TRUTH:  # the truth is one sigma off the medians, where the plan stands
        assert float(plan["learnt"].sel(unknown=name)[-1]) == pytest.approx(
            float(found[0]["learnt"].sel(unknown=name)), rel=0.25
        )
    assert (plan["learnt"].diff("sensor") < 1e-6).all()
    for more in (["--out", str(tmp_path / "cal")], ["--dry-run"]):
        refused = CliRunner().invoke(cli, ["calibrate", str(file), *more])
        assert refused.exit_code == 2
    assert "still to come" in refused.output


@for_each(
    "more, inputs, words",
    [
        (
            'design = { kind = "random", samples = 4 }',
            PRIORS,
            "design: a calibration places its own",
        ),
        ("check_every = 4", PRIORS, "check_every: leave it out"),
        ("", {}, "there is nothing to find"),
        (
            "",
            {"loads.force": {"kind": "discrete", "values": [0.1, 0.2]}},
            "continuous distribution",
        ),
        ("clock = { offset = 3 }", PRIORS, "clock.offset"),
        ("mesured = 1", PRIORS, "mesured"),
        ("sensors = 1", PRIORS, "sensors: this is measured data, no calibration file"),
        ("error_bars_every = 4", PRIORS, "error_bars_every: leave it out"),
        ("max_failed = 2", PRIORS, "max_failed: failed runs are counted"),
        (
            'clock.offset = { kind = "discrete", values = [0.1, 0.2] }',
            PRIORS,
            "clock.offset: must be one number of a range",
        ),
    ],
)
def test_what_is_refused(more, inputs, words, tmp_path):
    write_test(tmp_path, {})
    file = write_file(tmp_path, more=more, inputs=inputs)
    done = CliRunner().invoke(cli, ["calibrate", str(file), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2, done.output
    assert words in done.output
    assert not (tmp_path / "out").exists()


@for_each(
    "file, words",
    [
        ("nonsync_quick.toml", "design: this is no calibration file: run it with ringsim campaign"),
        ("stand/measured.toml", "sensors: this is measured data, no calibration file: name it in a "
         'calibration file, as measured = "measured.toml"'),
    ],
)  # fmt: skip
def test_files_of_other_verbs_are_told(file, words):
    done = CliRunner().invoke(cli, ["calibrate", str(STAND.parent / file)])
    assert done.exit_code == 2
    assert words in done.output
    ran = CliRunner().invoke(cli, ["run", str(STAND / "measured.toml")])
    assert ran.exit_code == 2
    assert "sensors: this is measured data, not a scene" in ran.output
    ran = CliRunner().invoke(cli, ["check", str(STAND / "friction.toml")])
    assert "measured: this is a calibration file, not a scene: run it with ringsim calibrate" in (
        ran.output
    )
    with pytest.raises(InputError, match="scene: this is no measured data"):
        load_measured(STAND / "friction.toml")
    optimised = CliRunner().invoke(cli, ["optimise", str(STAND / "friction.toml")])
    assert optimised.exit_code == 2
    assert "measured: this is no optimisation file: run it with ringsim calibrate" in (
        optimised.output
    )


def test_too_few_runs_and_readings_out_of_time_are_refused(tmp_path):
    write_test(tmp_path, {})
    file = write_file(tmp_path, runs=16, stages=4)
    done = CliRunner().invoke(cli, ["calibrate", str(file), "--out", str(tmp_path / "out")])
    assert done.exit_code == 2
    assert "set runs = 32 at least" in done.output
    stand = tmp_path / "stand.toml"
    stand.write_text(stand.read_text().replace('"t" }', '"t", offset = 99.0 }'))
    file = write_file(tmp_path, runs=32, inputs={k: PRIORS[k] for k in list(PRIORS)[:1]},
                      more='set = { "solver.end_time" = 0.5 }')  # fmt: skip
    done = CliRunner().invoke(
        cli, ["calibrate", str(file), "--out", str(tmp_path / "late"), "--workers", "0"]
    )
    assert done.exit_code == 2


@for_each(
    "said, words",
    [
        (
            'from = "none.nc"',
            "none.nc: run the calibration first that makes it",
        ),
        ('from = { file = "posterior.nc", without = ["x"] }', "x is no unknown of posterior.nc"),
        ('from = { fil = "posterior.nc" }', "fil"),
        (
            'from = "posterior.nc"\n"structure.opening_angle" = { kind = "uniform", low = 1.0, '
            "high = 2.0 }",
            "is given by inputs and by inputs.from",
        ),
        ('from = "runs.nc"', "has no posterior"),
        ("from = 3", 'write from = "posterior.nc"'),
    ],
)
def test_what_of_a_posterior_is_refused(said, words, found, tmp_path):
    _, folder = found
    shutil.copy(folder / POSTERIOR, tmp_path)
    shutil.copy(folder / "stage-1" / "campaign.nc", tmp_path / "runs.nc")
    (tmp_path / "c.toml").write_text(
        'name = "c"\nscene = "truss2"\ndesign = { kind = "random", samples = 2 }\n[inputs]\n' + said
    )
    done = CliRunner().invoke(cli, ["campaign", str(tmp_path / "c.toml"), "--dry-run"])
    assert done.exit_code == 2, done.output
    assert words in done.output, done.output


def test_unknown_that_another_scene_lacks_is_named_with_its_cure(found, tmp_path):
    _, folder = found
    shutil.copy(folder / POSTERIOR, tmp_path)
    (tmp_path / "c.toml").write_text(
        'name = "c"\nscene = "planar-truss"\ndesign = { kind = "random", samples = 2 }\n'
        '[inputs]\nfrom = "posterior.nc"'
    )
    done = CliRunner().invoke(cli, ["campaign", str(tmp_path / "c.toml"), "--dry-run"])
    assert done.exit_code == 2, done.output
    assert "leave it out by without = [" in done.output, done.output


@for_each(
    "of",
    [
        Lognormal(mean=2.0, standard_deviation=0.5),
        Uniform(low=-1.0, high=3.0),
        Truncated(of=Lognormal(mean=2.0, standard_deviation=0.5), high=2.5),
    ],
)
def test_calibrated_distribution_is_one(of):
    """Its probability undoes its quantile, and its density is the slope of its probability."""
    law = Calibrated(of=of, shift=0.7, remaining_scatter=0.3)
    shares = np.array([0.02, 0.3, 0.5, 0.9])
    values = law.quantile(shares)
    np.testing.assert_allclose([law.probability(v) for v in values], shares, rtol=1e-9)
    step = 1e-6
    slope = [(law.probability(v + step) - law.probability(v - step)) / (2 * step) for v in values]
    np.testing.assert_allclose(np.exp(law.log_density(values)), slope, rtol=1e-6)
    plain = Calibrated(of=of, shift=0.0, remaining_scatter=1.0)
    np.testing.assert_allclose(plain.quantile(shares), of.quantile(shares), rtol=1e-12)


STAND = Path(__file__).parents[2] / "campaigns" / "stand"


@pytest.mark.slow
def test_shipped_test_is_explained_and_holds_its_truth(tmp_path):
    """That of docs/guide/calibrate.md, made by the other engine."""
    posterior = ringsim.Calibration.read(STAND / "friction.toml").run(2, out=tmp_path / "out")
    truth = tomllib.loads((STAND / "truth.toml").read_text(encoding="utf-8"))
    known = truth["values"] | {"clock.offset": truth["clock"]["offset"]}
    assert set(known) == set(posterior["unknown"].values)
    for name, value in known.items():
        low, _, high = posterior["posterior_quantile"].sel(unknown=name).values
        assert low < value < high, name
    assert float(posterior["chance_of_all"].min()) > 1e-3
    assert float(posterior["learnt"].sel(unknown="joints.vjoint.viscous")) < 0.1
    # What the page shows is what is printed.
    page = (STAND.parents[1] / "docs" / "guide" / "calibrate.md").read_text(encoding="utf-8")
    shown = page.partition("```text\nunknown ")[2].partition("```")[0].splitlines()
    printed = "\n".join(line for each in calibration_tables(posterior) for line in each.lines())
    for line in ("unknown " + shown[0], *shown[1:]):
        assert line == "..." or line in printed, line


@pytest.mark.slow
def test_shipped_test_with_a_bad_pulley_names_it(tmp_path):
    """Also the page's: by half of the runs, in two stages."""
    file = STAND / "pulleys" / "pulleys.toml"
    posterior = ringsim.Calibration.read(file, {"runs": 160, "stages": 2}).run(
        2, out=tmp_path / "o"
    )
    named = posterior["unknown"].values[posterior["group"].values > 0].tolist()
    truth = tomllib.loads((STAND / "pulleys" / "truth.toml").read_text(encoding="utf-8"))["values"]
    name = "cables.lower.friction.coefficient"
    assert named == [f'{name}["section 3 V"]']
    unknowns = [each for each in posterior["unknown"].values.tolist() if each.startswith(name)]
    assert unknowns.index(named[0]) == int(np.argmax(truth[name]))
    told = "\n".join(note for each in calibration_tables(posterior) for note in each.notes)
    assert 'stands out from the other places: ["section 3 V"] (+5' in told
    assert f"""theirs, '{named[0]}' = {{ kind = "uniform", low = 0.0, high = 0.0039 }}""" in told
    own = calibration_of((STAND / "pulleys" / "suspect.toml").read_text(encoding="utf-8"),
                         STAND / "pulleys" / "suspect.toml")  # fmt: skip
    laws = own.campaign.specification.inputs
    assert [path for path, law in laws.items() if isinstance(law, Uniform)] == named


def test_shipped_test_can_be_read():
    given = calibration_of((STAND / "friction.toml").read_text(encoding="utf-8"),
                           STAND / "friction.toml")  # fmt: skip
    assert len(given.measurement.readings) == 14
    assert given.members == 48


def test_figure_shows_what_the_file_holds(found, tmp_path):
    posterior, folder = found
    figure = learnt(posterior)
    left, right = figure.axes
    shown = [label.get_text().splitlines()[0] for label in left.get_yticklabels()]
    assert shown == posterior["unknown"].values.tolist()
    for k, (bar, line) in enumerate(zip(left.containers[::2], left.containers[1::2], strict=True)):
        assert bar[0].get_x() == pytest.approx(-1.6449)
        (low, high) = line.lines[2][0].get_segments()[0][:, 0]
        assert 0.5 * (low + high) == pytest.approx(float(posterior["shift"][k]))
        assert high - low == pytest.approx(2 * 1.6449 * float(posterior["learnt"][k]))
    marks = right.collections[0].get_offsets()
    np.testing.assert_allclose(marks[:, 0], posterior["rms_in_deviations"])
    done = CliRunner().invoke(cli, ["plot", str(folder / POSTERIOR), "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "posterior-fig-learnt.png").stat().st_size > 10_000


def test_sensors_without_a_place_or_a_reading_are_told_before_a_run(tmp_path):
    write_test(tmp_path, {})
    file, stand = write_file(tmp_path), tmp_path / "stand.toml"
    text = stand.read_text()
    stand.write_text(text.replace('"upper", section = 2', '"upper", section = 9'))
    with pytest.raises(InputError, match="the scene has no section 9"):
        ringsim.Calibration.read(file)
    rows = (tmp_path / "stand.csv").read_text().splitlines()
    (tmp_path / "stand.csv").write_text(
        "\n".join([rows[0], *(r.split(",")[0] + ",,," for r in rows[1:])])
    )
    stand.write_text(text)
    with pytest.raises(InputError, match="all cells are empty"):
        ringsim.Calibration.read(file)


def test_pulley_of_ten_sigma_can_be_drawn():
    law = Lognormal(mean=4e-4, standard_deviation=8e-5)
    far = law.of_normal(np.array([8.0, 9.0, 10.0]))
    np.testing.assert_allclose(np.diff(np.log(far)), np.sqrt(np.log(1.04)), rtol=1e-9)
    np.testing.assert_allclose(law.to_normal(far), [8.0, 9.0, 10.0], rtol=1e-12)
    moved = Calibrated(of=law, shift=9.0, remaining_scatter=0.1)
    assert len(set(moved.quantile(np.linspace(0.1, 0.9, 50)).tolist())) == 50
