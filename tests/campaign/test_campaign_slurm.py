"""Both batch scripts on a real Slurm, interrupted and requeued, give the file of a local run."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest
import xarray as xr

import slurm_cluster
from campaign_bench import MODULES, PATH, Bench, comparable, ranks_of, records

SCRIPTS = Path(__file__).parents[2] / "slurm"
SAMPLES = 24
ENDS = {"exit 130": 130, "kill -USR1 $$": 138, "exit 3": 3}


@pytest.mark.parametrize("script", ["array.sbatch", "mpi.sbatch"])
@pytest.mark.parametrize("ends", ENDS)
def test_a_job_that_the_warning_ended_is_started_again(script, ends, tmp_path):
    """Also where it came while the command could not listen; failures are left as they are."""
    commands = {"ringsim": ends, "srun": ends, "scontrol": f'echo "$1" >> {tmp_path}/asked'}
    for name, text in commands.items():
        (tmp_path / name).write_text(f"#!/bin/bash\n{text}\n", encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    path = f"{tmp_path}:{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", str(SCRIPTS / script), "FILE"], env=os.environ | {"PATH": path}, check=False
    )
    asked = tmp_path / "asked"
    assert (asked.read_text() if asked.exists() else "") == "requeue\n" * (ends != "exit 3")
    assert done.returncode == ENDS[ends]


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    reason = slurm_cluster.missing()
    if reason:
        pytest.skip(f"no Slurm here: {reason}")
    # Not below pytest's own folder: the path of a socket must be short and open to all.
    folder = Path("/tmp") / f"ringsim-slurm-{os.getpid()}"
    folder.mkdir()
    found, fault = slurm_cluster.start(folder)
    try:
        if fault:
            pytest.skip(f"no Slurm here: {fault}")
        yield found
    finally:
        slurm_cluster.stop(found)
        shutil.rmtree(folder, ignore_errors=True)


@pytest.fixture(scope="module")
def local(tmp_path_factory):
    bench = Bench(tmp_path_factory.mktemp("local"))
    bench.run("campaign", bench.write(SAMPLES), "--workers", 2, "--out", "out")
    return bench.result("out")


def submit(cluster, bench, script, *options, seconds=0.3):
    file = str(bench.write(SAMPLES, shared=f'"rods.damping" = {seconds}'))
    answer = cluster.ask(
        "sbatch", "--parsable", *options, str(SCRIPTS / script), file,
        "--out", "out", "--solver", "fake_solver:slow",
        cwd=bench.folder, extra={"PYTHONPATH": MODULES, "PATH": PATH, "SLURM_WAIT": "5"},
    )  # fmt: skip
    assert answer.isdigit(), answer
    return answer


def done_in_all(bench):
    return int(bench.run("status", "out").splitlines()[0].split(": ")[1].split()[0])


def wait_for(condition, what, seconds=120):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return
        time.sleep(0.1)
    raise AssertionError(f"waited for {what} in vain")


def printed(bench):
    return "\n".join(path.read_text() for path in bench.folder.glob("ringsim-*.out"))


def finish(cluster, bench, job, seconds=120):
    wait_for(
        lambda: set(cluster.states(job)) == {"COMPLETED"} or "FAILED" in cluster.states(job),
        "the job to end",
        seconds,
    )
    assert set(cluster.states(job)) == {"COMPLETED"}, printed(bench)


def test_jobs_are_warned_leave_are_requeued_and_complete(cluster, local, tmp_path, mpi):
    """One with MPI and, at the same time, one of two tasks, of which the second is warned."""
    ranks, tasks = (Bench(tmp_path / name) for name in ("ranks", "tasks"))
    for each in (ranks, tasks):
        each.folder.mkdir()
    first = submit(cluster, ranks, "mpi.sbatch")
    second = submit(cluster, tasks, "array.sbatch", "--array=1-2")
    wait_for(lambda: records(ranks.folder / "out") >= 4, "the first samples")
    cluster.ask("scancel", "--signal=USR1", "--batch", first)
    wait_for(lambda: records(tasks.folder / "out", "part2of2-*") >= 2, "the first samples")
    cluster.ask("scancel", "--signal=USR1", "--batch", f"{second}_2")
    wait_for(lambda: "stopped by SIGUSR1" in printed(ranks), "the job to stop")
    kept = done_in_all(ranks)
    assert 4 <= kept < SAMPLES
    wait_for(lambda: "stopped by SIGUSR1" in printed(tasks), "a task to stop")
    finish(cluster, ranks, first)
    assert f"{kept} of {SAMPLES} samples done, 2 workers" in printed(ranks)
    assert "MPI, 2 ranks" in ranks.result("out").attrs["execution"]
    finish(cluster, tasks, second)
    for each in (ranks, tasks):
        xr.testing.assert_identical(comparable(each.result("out")), comparable(local))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "option"), [("mpi.sbatch", "--ntasks=2"), ("array.sbatch", "--array=1-2")]
)
def test_job_at_its_time_limit_is_requeued_until_all_is_done(script, option, cluster, bench, local):
    """Nobody cancels anything: Slurm itself warns of the end of the minute, within half of it."""
    job = submit(cluster, bench, script, option, "--time=1", "--signal=B:USR1@30", seconds=3.0)
    wait_for(lambda: "stopped by SIGUSR1" in printed(bench), "the time limit")
    assert done_in_all(bench) < SAMPLES
    finish(cluster, bench, job, seconds=400)
    told, record = printed(bench), cluster.ask("scontrol", "show", "job", job)
    print(told, record)
    assert max(map(int, re.findall(r"Restarts=(\d+)", record))) >= 1
    assert max(map(int, re.findall(r"small: (\d+) of", told))) > 0
    xr.testing.assert_identical(comparable(bench.result("out")), comparable(local))


@pytest.mark.slow
def test_job_that_loses_a_rank_ends_and_goes_on_when_submitted_again(cluster, bench, local, mpi):
    """Without its other half a rank would wait until the time limit."""
    job = submit(cluster, bench, "mpi.sbatch")
    wait_for(lambda: records(bench.folder / "out", "all-rank1-*") >= 2, "the first samples")
    (rank,) = ranks_of(bench, b"1")
    os.kill(rank, signal.SIGKILL)
    wait_for(lambda: set(cluster.states(job)) <= {"FAILED", "NODE_FAIL"}, "the job to end")
    kept = done_in_all(bench)
    assert kept >= 2
    finish(cluster, bench, submit(cluster, bench, "mpi.sbatch"))
    assert f"{kept} of {SAMPLES} samples done" in printed(bench)
    xr.testing.assert_identical(comparable(bench.result("out")), comparable(local))
