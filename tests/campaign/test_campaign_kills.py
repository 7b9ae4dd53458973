"""Processes that are killed at any moment lose the samples in flight and nothing else."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from pathlib import Path

import pytest
import xarray as xr

from campaign_bench import Bench, comparable

SAMPLES = 240
SMALL_SHARDS = "[output]\nshard_samples = 16\n"


def children_of(pid):
    """All processes below one, the deepest first."""
    try:
        direct = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except OSError:
        return []
    return [deep for child in direct for deep in [*children_of(int(child)), int(child)]]


def kill(pid):
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        return


def is_solver(pid):
    try:
        return b"ringsim.execution.child" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def strike(process, victim, chance):
    below = children_of(process.pid)
    match victim:
        case "solver":
            solvers = [pid for pid in below if is_solver(pid)]
            if solvers:
                kill(chance.choice(solvers))
        case "rank":
            ranks = [pid for pid in below if any(map(is_solver, children_of(pid)))]
            if ranks:
                kill(chance.choice(ranks))
        case "manager":
            kill(process.pid)
        case "tree":
            for pid in [*below, process.pid]:
                kill(pid)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    bench = Bench(tmp_path_factory.mktemp("undisturbed"))
    bench.run("campaign", bench.write(SAMPLES), "--workers", 2, "--out", "out")
    return bench.result("out")


def gone(pids, seconds=10.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if not any(is_solver(pid) for pid in pids):
            return True
        time.sleep(0.05)
    return False


def survive(bench, victims, *, ranks, seed, undisturbed):
    """Kill and start again; returns the number of runs that had to be repeated."""
    chance = random.Random(seed)
    bench.extra["TRACE"] = str(bench.folder / "trace")
    file = bench.write(SAMPLES, more=SMALL_SHARDS)
    start = ["campaign", file, "--out", "out", *(() if ranks else ("--workers", 2))]
    kills = 0
    for victim in victims:
        process = bench.start(*start, ranks=ranks, solver="fake_solver:traced")
        try:
            process.communicate(timeout=chance.uniform(0.5, 1.6))
        except subprocess.TimeoutExpired:
            solvers = [pid for pid in children_of(process.pid) if is_solver(pid)]
            strike(process, victim, chance)
            kills += 1
            process.communicate(timeout=60)
            assert gone(solvers), "solver processes outlived their parent"
        if process.returncode == 0:
            xr.testing.assert_identical(comparable(bench.result("out")), comparable(undisturbed))
            break
    bench.run(*start, ranks=ranks, solver="fake_solver:traced")
    xr.testing.assert_identical(comparable(bench.result("out")), comparable(undisturbed))
    repeated = (bench.folder / "trace").stat().st_size - SAMPLES
    assert 0 <= repeated <= 2 * (kills + 1)
    assert not list((bench.folder / "out" / "journals").iterdir())


@pytest.mark.parametrize("seed", range(7))
def test_killed_local_campaigns_go_on_where_they_were(seed, bench, undisturbed):
    victims = random.Random(seed).sample(["solver", "manager", "tree"], 3)
    survive(bench, victims, ranks=0, seed=seed, undisturbed=undisturbed)


@pytest.mark.parametrize("seed", range(3))
def test_killed_mpi_campaigns_go_on_where_they_were(seed, bench, undisturbed, mpi):
    victims = random.Random(seed).sample(["solver", "rank", "tree"], 3)
    survive(bench, victims, ranks=2, seed=seed, undisturbed=undisturbed)
