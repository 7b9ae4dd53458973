"""Broken files are found, full disks and stop signals survived, wrong folders refused."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import netCDF4
import numpy as np
import pytest
import xarray as xr

from campaign_bench import MODULES, Bench, comparable, journals, lose, opened, records
from ringsim.campaign.folder import open_folder
from ringsim.campaign.plan import status_lines, time_left
from ringsim.execution.work import relative_cost
from ringsim.storage.netcdf import locked
from ringsim.storage.result import check_of


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished campaign; copy it before use."""
    bench = Bench(tmp_path_factory.mktemp("whole"))
    bench.run("campaign", bench.write(), "--workers", 1, "--out", "out")
    return bench


@pytest.fixture
def copied(whole, tmp_path):
    shutil.copytree(whole.folder, tmp_path, dirs_exist_ok=True)
    return Bench(tmp_path)


def flip_a_bit(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)


def truncate(path):
    os.truncate(path, path.stat().st_size - 7)


def empty(path):
    os.truncate(path, 0)


@pytest.mark.parametrize(("damage", "left"), [(flip_a_bit, 19), (truncate, 19), (empty, 0)])
def test_samples_of_damaged_records_run_again(damage, left, copied, whole):
    (journal,) = journals(copied)
    damage(journal)
    told = f"{journal.name} is damaged: 1 of its results cannot be read"
    status = copied.run("status", "out")
    assert f"{left} of 20 samples done" in status
    # What is missing at the end of a journal may be there in a moment.
    assert (told in status) == (damage is flip_a_bit)
    printed = copied.run("campaign", "small.toml", "--workers", 2, "--out", "out")
    assert (told in printed) == (damage is flip_a_bit)
    xr.testing.assert_identical(comparable(copied.result("out")), comparable(whole.result("out")))


def test_an_empty_note_of_what_was_verified_costs_nothing_but_time(copied):
    """As a full disk or a power cut leaves it."""
    empty(copied.folder / "out" / "journals-verified.npz")
    assert "20 of 20 samples done" in copied.run("status", "out")


@pytest.mark.parametrize(
    ("name", "command"),
    [("campaign.nc", "analyse"), ("design.nc", "status")],
)
def test_a_pipe_in_place_of_a_file_of_results_is_refused(copied, name, command):
    """Nothing writes to it, so that who opens it waits for ever."""
    path = copied.folder / "out" / name
    path.unlink(missing_ok=True)
    os.mkfifo(path)
    told = copied.run(command, "out", code=2, timeout=60)
    assert ("has no design.nc" if name == "design.nc" else "is a pipe or a device") in told


@pytest.mark.parametrize("make", [os.mkfifo, Path.mkdir, lambda path: path.symlink_to(path)])
@pytest.mark.parametrize("command", [["status", "out"], ["campaign", "small.toml", "--out", "out"]])
def test_what_is_no_file_in_place_of_a_journal_is_refused(copied, make, command):
    make(copied.folder / "out" / "journals" / "odd.journal")
    told = copied.run(*command, code=2, timeout=60)
    assert "odd.journal: must be a journal of the campaign" in told
    assert "Traceback" not in told


@pytest.mark.parametrize("name", ["journals-verified.npz", "progress-pipe.json"])
def test_a_pipe_in_place_of_a_note_costs_nothing(copied, name):
    path = copied.folder / "out" / name
    path.unlink(missing_ok=True)
    os.mkfifo(path)
    assert "20 of 20 samples done" in copied.run("status", "out", timeout=60)


def test_merge_of_an_unfinished_campaign_has_gaps(copied):
    lose(copied, range(8))
    assert "8 not run" in copied.run("merge", "out")
    result = copied.result("out")
    meanings = dict(
        zip(
            result.status.attrs["flag_values"].tolist(),
            result.status.attrs["flag_meanings"].split(),
            strict=True,
        )
    )
    words = [meanings[code] for code in result.status.values.tolist()]
    assert sorted(set(words)) == ["not_run", "ok"]
    gaps = np.array(words) == "not_run"
    assert gaps.sum() == 8
    np.testing.assert_array_equal(np.isnan(result.deployment_time.values), gaps)
    assert np.isfinite(result.loads_force.values).all()


def test_merging_twice_gives_the_same_values(copied):
    before = comparable(copied.result("out"))
    copied.run("merge", "out")
    copied.run("merge", "out")
    xr.testing.assert_identical(comparable(copied.result("out")), before)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("seed = 7", "seed = 8", "its seed"),
        ('"solver.end_time" = 20.0', '"solver.end_time" = 21.0', "its scene"),
        ('"net.stiffness" =', '"net.damping" =', "its inputs"),
        ("high = 0.05", "high = 0.06", "20 samples are not the first"),
    ],
)
def test_folder_of_another_campaign_is_refused(old, new, named, copied):
    file = copied.folder / "small.toml"
    file.write_text(file.read_text().replace(old, new))
    printed = copied.run("campaign", file, "--out", "out", code=2)
    assert "this folder has another campaign" in printed
    assert named in printed
    assert "--out" in printed


def test_a_folder_with_more_samples_is_told_how_to_go_on(copied):
    """As it was begun with --samples."""
    file = copied.folder / "small.toml"
    file.write_text(file.read_text().replace("samples = 20", "samples = 10"))
    printed = copied.run("campaign", file, "--out", "out", code=2)
    assert printed.strip().endswith(
        "out was begun with 20 samples, small.toml now asks for 10: give --samples 20 to go on, or "
        "another folder with --out"
    )
    copied.run("campaign", file, "--out", "out", "--samples", "20")


def test_folder_with_other_files_is_refused(bench):
    (bench.folder / "out").mkdir()
    (bench.folder / "out" / "thesis.tex").touch()
    printed = bench.run("campaign", bench.write(), "--out", "out", code=2)
    assert "has other files (thesis.tex) and no campaign" in printed


def test_file_where_the_folder_should_be_is_refused(bench):
    (bench.folder / "out").touch()
    printed = bench.run("campaign", bench.write(), "--out", "out", code=2)
    assert len(printed.splitlines()) == 1


def wait_until_some_are_done(bench, process, samples=1):
    end = time.monotonic() + 60
    while time.monotonic() < end:
        if records(bench.folder / "out") >= samples:
            return
        assert process.poll() is None, process.communicate()[0]
        time.sleep(0.05)
    raise AssertionError("the campaign does not begin")


SLEEPY = {"shared": '"rods.damping" = 0.05'}


OTHERS = [pytest.param(each, marks=pytest.mark.slow) for each in (signal.SIGINT, signal.SIGUSR1)]
"""As a keyboard and Slurm send them: one interrupts a merge in test_campaign_together.py, the other
reaches all ranks below."""


@pytest.mark.parametrize("number", [signal.SIGTERM, *OTHERS])
def test_stop_signal_ends_the_campaign_and_it_goes_on_later(number, bench):
    start = ("campaign", bench.write(40, **SLEEPY), "--workers", 2, "--out", "out")
    process = bench.start(*start, solver="fake_solver:slow", fresh=True)
    wait_until_some_are_done(bench, process)
    process.send_signal(number)
    printed, _ = process.communicate(timeout=60)
    assert process.returncode == 130, printed
    assert f"stopped by {number.name}" in printed
    assert "run the same command again to continue" in printed
    assert not (bench.folder / "out" / "campaign.nc").exists()
    bench.run(*start, solver="fake_solver:slow")
    assert (bench.result("out").status == 0).all()


def test_a_file_that_may_not_grow_is_told_with_the_limit(copied):
    """As HDF5 tells it: "HDF error"."""
    (copied.folder / "out" / "campaign.nc").unlink()
    command = f"ulimit -f 1; exec {sys.executable} -m ringsim merge out"
    done = subprocess.run(
        ["bash", "-c", command], cwd=copied.folder, env=copied.environment(), text=True,
        capture_output=True, check=False,
    )  # fmt: skip
    assert done.returncode == 2, done.stderr
    assert "files may have 1 kB here (ulimit -f)" in done.stderr
    assert not (copied.folder / "out" / "campaign.nc").exists()


def test_replay_runs_no_code_that_a_file_names(copied):
    path = copied.folder / "out" / "design.nc"
    with netCDF4.Dataset(path, "a") as file:
        file.solver = "os:system"
    printed = copied.run("replay", "out", "0", code=2)
    assert "names the solver 'os:system', which ringsim does not have" in printed


def test_time_left_counts_samples_and_checks_apart(copied):
    """Two of ten samples are to run, of 4 s each, and two checks of 30 s, by two workers."""
    folder = open_folder(copied.folder / "out")
    half = {"scene": folder.scene, "table": SimpleNamespace(columns=(), samples=10)}
    samples = np.where(np.arange(10) < 8, 4.0, np.nan)
    checks = np.where(np.isin(np.arange(10), [3, 7]), 30.0, np.nan)

    def survey(*, judged: bool) -> SimpleNamespace:
        seconds = checks if judged else samples
        return SimpleNamespace(missing=np.flatnonzero(np.isnan(seconds)), seconds=seconds)

    half["survey"] = lambda checks=False: survey(judged=checks)
    checked = SimpleNamespace(**half, unchecked=lambda: np.array([0, 5]))
    without = SimpleNamespace(**half, unchecked=lambda: np.empty(0, dtype=int))
    assert time_left(checked, 2) == "about 34 s"
    assert time_left(without, 2) == "about 4 s"
    checks[:] = np.nan
    # Until one has ended a check is taken for 30 times a sample, as a plan says: 8 + 2 x 120 s.
    assert time_left(checked, 2) == "about 2.1 min, a check taken as 30 times a sample"
    # The last one leaves workers idle; nothing is known before one has ended.
    samples[:8] = 100.0
    assert time_left(without, 48) == "about 100 s"
    samples[:] = np.nan
    assert time_left(checked, 2) == "not known yet"
    # Checks run first: of one of 30 s a sample is taken to be 1 s.  Two are left, and ten samples.
    checks[3] = 30.0
    assert time_left(checked, 2) == "about 35 s, a check taken as 30 times a sample"
    # Two of the eight that are over had error bars, and took several times as long.
    bars = np.isin(np.arange(10), [0, 5])
    column = replace(folder.table.columns[0], path="solver.error_bars", values=bars)
    half["table"] = SimpleNamespace(columns=(column,), samples=10)
    whole = relative_cost(half["table"], folder.scene)
    samples[:8] = 50.0 * whole[:8]
    barred = SimpleNamespace(**half, unchecked=lambda: np.empty(0, dtype=int))
    assert whole[0] > 2.0 * whole[9]
    told = f"about {100.0 * whole[9]:.0f} s (costly samples come first)"
    assert time_left(barred, 1) == told


def test_a_worker_that_runs_a_check_runs_no_samples(copied):
    """Of 40 samples of 8 s each ten are over, and of two workers one is busy with a check."""
    folder = open_folder(copied.folder / "out")
    samples, judged = np.full((2, 40), np.nan)
    samples[:10] = 8.0

    def survey(checks=False):
        seconds = judged if checks else samples
        return SimpleNamespace(missing=np.flatnonzero(np.isnan(seconds)), seconds=seconds)

    table = SimpleNamespace(columns=(), samples=40)
    made = SimpleNamespace(
        scene=folder.scene, table=table, survey=survey, unchecked=lambda: np.array([0])
    )
    # 200 s of the check's 240 s are left, 4 s of a sample, and 29 samples wait for either worker.
    running = {check_of(0): 40.0, 10: 4.0}
    told = "about 3.6 min, a check taken as 30 times a sample"
    assert time_left(made, 2, running) == told
    # The check alone takes longer than all the samples.
    samples[12:] = 8.0
    assert time_left(made, 2, running).startswith("about 3.3 min")
    samples[12:] = np.nan
    judged[5] = 100.0
    assert time_left(made, 2, running) == "about 2.5 min"
    # Nobody knows when it ends: the other worker is alone, and a single one goes on after it.
    judged[5] = np.nan
    running[check_of(0)] = 250.0
    assert time_left(made, 2, running) == "about 3.9 min, plus 1 check of unknown duration"
    alone = {check_of(0): 250.0}
    assert time_left(made, 1, alone) == "about 4.0 min, plus 1 check of unknown duration"


def test_the_rate_of_samples_is_of_the_workers_that_run_them(copied):
    """Twelve samples took 2 s of a worker each; of three workers one runs a check."""
    lose(copied, range(8))
    out = copied.folder / "out"
    told = {
        "state": "running", "host": "here", "pid": 1, "workers": 3, "updated": time.time(),
        "spent": [24.0, 0.0], "ended": [12, 0], "running": {check_of(0): 5.0, 0: 1.0, 1: 1.0},
    }  # fmt: skip
    (out / "progress-all.json").write_text(json.dumps(told))

    def rate():
        with locked(out / "lock-all"):
            return next(x.split(maxsplit=1)[1] for x in status_lines(open_folder(out))
                        if x.startswith("  rate"))  # fmt: skip

    assert rate() == "1 samples/s so far (1 worker busy with checks)"
    told["running"] = {check_of(k): 5.0 for k in range(3)}
    (out / "progress-all.json").write_text(json.dumps(told))
    assert rate() == "1.5 samples/s so far (between checks)"
    told |= {"running": {0: 1.0, 1: 1.0, 2: 1.0}, "ended": [12, 1]}
    (out / "progress-all.json").write_text(json.dumps(told))
    assert rate() == "1.5 samples/s so far (without checks)"


@pytest.mark.slow  # a signal to one rank, test_campaign_together.py, goes the same way
def test_stop_signal_reaches_all_ranks(bench, mpi):
    start = ("campaign", bench.write(40, **SLEEPY), "--out", "out")
    process = bench.start(*start, ranks=2, solver="fake_solver:slow")
    wait_until_some_are_done(bench, process)
    process.send_signal(signal.SIGUSR1)
    printed, _ = process.communicate(timeout=60)
    assert process.returncode == 130, printed
    assert printed.count("run the same command again to continue") == 1
    bench.run(*start, solver="fake_solver:slow")
    assert (bench.result("out").status == 0).all()


def test_running_campaign_tells_its_status_and_keeps_others_out(bench):
    start = ("campaign", bench.write(600, **SLEEPY), "--workers", 2, "--out", "out")
    process = bench.start(*start, solver="fake_solver:slow")
    wait_until_some_are_done(bench, process, 4)
    # A busy machine may write its progress late.
    told = ""
    for _ in range(150):
        told = bench.run("status", "out")
        if "time left" in told:
            break
        time.sleep(0.1)
    assert "running, 2 workers" in told
    assert told.endswith("  next           wait; ringsim merge out gives the results so far\n")
    assert "time left" in told
    printed = bench.run(*start, solver="fake_solver:slow", code=2)
    assert "another process is running this campaign" in printed
    assert "not run" in bench.run("merge", "out")
    process.kill()
    process.communicate()
    assert "killed, 2 workers" in bench.run("status", "out")


def test_status_names_all_samples_that_run(bench):
    """Three begin within a second, and nothing happens after that."""
    file = bench.write(3, shared='"rods.damping" = 60.0')
    start = ("campaign", file, "--workers", 3, "--out", "out")
    process = bench.start(*start, solver="fake_solver:slow")
    end, told = time.monotonic() + 60.0, ""
    while "running        3: " not in told:
        assert time.monotonic() < end, told
        assert process.poll() is None
        time.sleep(0.1)
        if (bench.folder / "out" / "design.nc").exists():
            told = bench.run("status", "out")


@pytest.mark.parametrize("ranks", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_solver_process_that_cannot_start_is_told_and_nobody_waits(ranks, bench, request):
    if ranks:
        request.getfixturevalue("mpi")
    (bench.folder / "sitecustomize.py").write_text("import sys\nsys.executable = '/no/python'\n")
    bench.extra["PYTHONPATH"] = f"{bench.folder}{os.pathsep}{MODULES}"
    start = ("campaign", bench.write(4), "--out", "out")
    printed = bench.run(*start, ranks=ranks, code=2, fresh=True)
    assert printed.count("the solver process cannot be started") == 1
    assert "Traceback" not in printed


@pytest.fixture
def small_disk(tmp_path):
    """A file system of its own with little room."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=500k", "tmpfs", str(disk)]
    if shutil.which("mount") is None or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("a small tmpfs cannot be mounted here: needs the right to mount")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=True)


@pytest.mark.parametrize("ranks", [0, pytest.param(2, marks=pytest.mark.slow)])
def test_full_disk_stops_the_campaign_and_loses_no_finished_sample(
    ranks, small_disk, bench, request
):
    if ranks:
        request.getfixturevalue("mpi")
    workers = () if ranks else ("--workers", 2)
    file = bench.write(60, shared='"record.interval" = 0.01')
    start = ("campaign", file, "--out", small_disk / "out", *workers)
    printed = bench.run(*start, ranks=ranks, code=2)
    line = next(line for line in printed.splitlines() if "cannot be written" in line)
    assert "No space left on device" in line or "HDF error" in line
    assert "free some space" in line
    subprocess.run(["mount", "-o", "remount,size=200m", str(small_disk)], check=True)
    told = bench.run("status", small_disk / "out")
    done = int(told.splitlines()[0].split(": ")[1].split()[0])
    assert 0 < done < 60
    printed = bench.run(*start)  # whoever ran it first
    assert f"{done} of 60 samples done" in printed
    bench.run("campaign", file, "--out", "elsewhere", "--workers", 0)
    mine, other = opened(small_disk / "out" / "campaign.nc"), bench.result("elsewhere")
    xr.testing.assert_identical(comparable(mine), comparable(other))


LAUNCHERS = {
    "none that is known": {"SLURM_STEP_NUM_TASKS": "4"},
    # Open MPI 5: the library of MPICH would end the process when it is started.
    "Open MPI": {"OMPI_COMM_WORLD_SIZE": "4", "PMIX_NAMESPACE": "prterun-1", "PMIX_RANK": "0"},
}


@pytest.mark.parametrize("launcher", LAUNCHERS)
def test_launcher_of_another_mpi_is_refused(launcher, bench, mpi):
    bench.extra |= LAUNCHERS[launcher]
    printed = bench.run("campaign", bench.write(), "--out", "out", code=2)
    (line,) = printed.splitlines()
    assert "started 4 processes, but they do not see each other" in line
    assert "MPICH" in line
    assert "mpiexec" in line
    assert not (bench.folder / "out").exists()


def test_workers_under_mpi_are_refused(bench, mpi):
    printed = bench.run("campaign", bench.write(), "--workers", 2, "--out", "out", ranks=2, code=2)
    assert printed.count("leave out --workers") == 1


@pytest.mark.parametrize("ranks", [pytest.param(0, marks=pytest.mark.slow), 2])
def test_solver_process_knows_neither_mpi_nor_xarray_nor_matplotlib(ranks, bench, mpi):
    """Least of all below ranks, which know all three."""
    bench.run("campaign", bench.write(2), "--out", "out", ranks=ranks, solver="fake_solver:spy",
              fresh=True)  # fmt: skip
    assert set(bench.result("out").reason.values) == {"clean"}


def test_status_advises_no_merge_before_a_sample_has_ended(copied, monkeypatch):
    """Of checks alone, which may end first, there is nothing to merge."""
    monkeypatch.setattr("ringsim.campaign.plan.runs_in", lambda _: True)
    for gone, told in ((range(1, 99), "gives the results so far"), (range(99), "no sample has")):
        lose(copied, gone)
        assert told in status_lines(open_folder(copied.folder / "out"))[-1]
