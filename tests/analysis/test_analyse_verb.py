"""``ringsim analyse`` from a campaign file to verdicts, with a stand-in for the solver."""

from __future__ import annotations

import shutil

import netCDF4
import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from loops import for_each
from preloaded import ringsim

from made import campaign
from ringsim.cli.results import analyse_command
from ringsim.refusal import InputError

CAMPAIGN = """
name = "study"
scene = "ring18"
design = { kind = "sobol", samples = 64, replicates = 8 }
[set]
"structure.sections" = 6
boom = "none"
[inputs]
"loads.force" = { kind = "uniform", low = 0.01, high = 0.013 }
[requirements]
outcome = { is = "deployed", probability = 0.9, confidence = 0.9 }
deployment_time = { max = 30.0, probability = 0.9, confidence = 0.9 }
"""
STAND_IN = '''
import numpy as np
from ringsim.variables import Fate, Outcome, Status

def run(scene):
    """Fails above a force of 0.012 N, stalls above 0.0115 N."""
    force = scene.loads.force
    if force > 0.012:
        return Outcome(Status.SOLVER_FAILED, "on purpose")
    if force > 0.0115:
        return Outcome(Status.OK, "at rest", {}, {"outcome": np.array(Fate.STALLED)})
    values = {"outcome": np.array(Fate.DEPLOYED), "deployment_time": np.array(0.2 / force)}
    return Outcome(Status.OK, "all open", {}, values)
'''


def analyse(*arguments):
    return CliRunner().invoke(analyse_command, [*map(str, arguments)], catch_exceptions=False)


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    (folder / "stand_in.py").write_text(STAND_IN)
    return run_campaign(folder, CAMPAIGN)


def run_campaign(folder, text):
    (folder / "study.toml").write_text(text)
    line = ["campaign", "study.toml", "--workers", 0, "--solver", "stand_in:run"]
    done = ringsim(*line, folder=folder)  # where the stand-in is found
    assert (folder / "runs/study/campaign.nc").exists(), done.stderr
    return folder / "runs/study"


def test_a_campaign_is_judged_by_the_requirements_of_its_file(study, tmp_path):
    done = analyse(study, "--out", tmp_path / "analysis.nc")
    assert done.exit_code == 0
    assert "8 independent replicates" in done.output
    assert "deployment_time <= 30 s" in done.output
    found = xr.load_dataset(tmp_path / "analysis.nc")
    # A third of the forces fails, a sixth stalls, half deploys.
    lost, used = found.samples_lost.values, found.samples_used.values
    assert lost[0] == pytest.approx(64 / 3, abs=2)
    assert (lost + used == 64).all()
    assert found.samples_violating.values[0] == pytest.approx(64 / 6, abs=2)
    assert (found.samples_violating[0] == found.samples_violating[1]).all()
    assert found.verdict.values.tolist() == [0, 0]
    low, high = found.deployment_time_interval.sel(statistic="mean").values
    # Mean of 0.2 / force between 0.01 and 0.0115 N.
    assert low < 0.2 / 0.0015 * 0.13976194237515868 < high


def test_a_requirement_of_the_command_line_replaces_the_file_s(study):
    done = analyse(study, "--require", "outcome: is deployed, probability 0.5, confidence 0.9")
    line = next(line for line in done.output.splitlines() if line.startswith("outcome is deployed"))
    assert " met " in line


def test_the_gate_is_closed_until_every_requirement_is_met(study, tmp_path):
    every = ringsim("analyse", str(study), "--gate", folder=tmp_path)
    assert every.returncode == 4
    assert "gate closed: outcome is deployed: not met; deployment_time" in every.stderr
    words = "probability 0.2, confidence 0.9"  # half deploys
    wanted = f"outcome: is deployed, {words}", f"deployment_time: max 30 s, {words}"
    open_ = [word for each in wanted for word in ("--require", each)]
    assert ringsim("analyse", str(study), "--gate", *open_, folder=tmp_path).returncode == 0
    # What is not yet shown is not met.
    unsure = "--require", "outcome: is deployed, probability 0.5, confidence 0.9"
    late = ringsim("analyse", str(study), "--gate", *open_[2:], *unsure, folder=tmp_path)
    assert late.returncode == 4
    assert "outcome is deployed: not yet shown" in late.stderr


def test_a_bound_may_have_its_unit_and_no_other(study):
    found = analyse(
        study, "--require", "deployment_time: max 12 s, probability 0.5, confidence 0.9"
    )
    assert "deployment_time <= 12 s" in found.output
    for words, told in (
        ("max 12 N, probability 0.5, confidence 0.9", "max = 12 N: give it in s"),
        ("max 12, probability 0.5 s, confidence 0.9", "0.5 s: give it without a unit"),
    ):
        with pytest.raises(InputError, match=told):
            analyse(study, "--require", f"deployment_time: {words}")


def test_the_gate_is_closed_while_samples_are_left(tmp_path):
    """Those that are left may be the slow ones."""
    status = [0] * 12 + [-1] * 8
    campaign(np.arange(20.0), status=status).to_netcdf(tmp_path / "campaign.nc")
    words = "--require", "asynchrony_max: max 100 deg, probability 0.5, confidence 0.5"
    told = ringsim("analyse", tmp_path / "campaign.nc", "--gate", *words)
    words = f"{tmp_path / 'campaign.nc'}: gate closed: 8 of 20 samples have not run\n"
    assert (told.returncode, told.stderr) == (4, words)


def test_a_gate_needs_requirements(tmp_path):
    campaign(np.arange(20.0)).to_netcdf(tmp_path / "campaign.nc")
    with pytest.raises(InputError, match="has no requirements: give some"):
        analyse(tmp_path / "campaign.nc", "--gate")


def claiming(file, count):
    """A small file with a dimension of so many samples, none of them written."""
    with netCDF4.Dataset(file, "w") as made:
        made.createDimension("sample", count)
        made.createVariable("status", "i1", ("sample",), chunksizes=(1000,))


@for_each(
    ("make", "words"),
    [
        (lambda folder: None, "no such file or folder"),
        (lambda folder: folder.mkdir(), "no campaign in it"),
        (lambda folder: (folder.mkdir(), (folder / "design.nc").touch()), "no sample has"),
        (
            lambda folder: (
                (folder / "journals").mkdir(parents=True),
                (folder / "design.nc").touch(),
                (folder / "journals/all.journal").touch(),
            ),
            "design.nc: cannot be read",
        ),
        (lambda folder: folder.write_text("text"), "cannot be read as a netCDF file"),
        (lambda folder: xr.Dataset({"status": 0}).to_netcdf(folder), "not a campaign"),
        (
            lambda folder: campaign(np.arange(9.0), status=[77] * 9).to_netcdf(folder),
            "status holds 77, which is not a valid code",
        ),
        (lambda folder: claiming(folder, 10**12), "has 1,000,000,000,000 entries, must be at most"),
    ],
)
def test_what_is_no_campaign_is_refused(make, words, tmp_path):
    make(tmp_path / "given")
    with pytest.raises(InputError, match=words):
        analyse(tmp_path / "given")


def test_a_campaign_s_file_is_no_result(tmp_path):
    (tmp_path / "study.toml").write_text(CAMPAIGN)
    with pytest.raises(InputError, match="this is an input file without results"):
        analyse(tmp_path / "study.toml")


def test_the_output_needs_a_name_of_netcdf(tmp_path):
    campaign([1.0, 2.0]).to_netcdf(tmp_path / "campaign.nc")
    with pytest.raises(InputError, match="must end with"):
        analyse(tmp_path, "--out", tmp_path / "analysis.txt")


def test_a_requirement_that_changes_later_is_taken_over_and_nothing_runs_again(study, tmp_path):
    folder = tmp_path / "later"
    shutil.copytree(study.parents[1], folder)
    (folder / "stand_in.py").write_text("def run(scene):\n    raise SystemExit('ran again')\n")
    found = run_campaign(folder, CAMPAIGN.replace("max = 30.0", "max = 10.0"))
    done = analyse(found)
    assert "deployment_time <= 10 s" in done.output
    with (
        xr.open_dataset(found / "campaign.nc") as now,
        xr.open_dataset(study / "campaign.nc") as old,
    ):
        np.testing.assert_array_equal(now.deployment_time, old.deployment_time)


def test_the_file_that_is_read_is_not_written(tmp_path):
    """The campaign of a mailed file was gone."""
    path = tmp_path / "mailed.nc"
    campaign([1.0, 2.0, 3.0]).to_netcdf(path)
    held = path.read_bytes()
    done = CliRunner().invoke(analyse_command, [str(path), "--out", str(path)])
    assert isinstance(done.exception, InputError)
    assert "what is read from this file would be lost" in str(done.exception)
    assert path.read_bytes() == held
