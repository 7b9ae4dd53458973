"""Processes that are killed at any moment lose the samples in flight and nothing else."""

from __future__ import annotations

import random
import shutil
from collections import Counter, deque

import pytest
import xarray as xr

from campaign_bench import Bench, comparable, finished
from killing import alive, children_of, is_solver, strike, targets_of, until

SAMPLES = 150
LOCAL = ("solver", "all solvers", "manager", "tree")
MPI = ("solver", "rank", "launcher", "tree")


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    bench = Bench(tmp_path_factory.mktemp("undisturbed"))
    bench.run("campaign", bench.write(SAMPLES), "--workers", 2, "--out", "out")
    return bench.result("out")


class Drill:
    """Starts a campaign again and again, kills its processes, and counts what it hit.

    A campaign that is through in spite of all is compared, and another one begins.
    """

    def __init__(self, bench, undisturbed, *, ranks, seed):
        self.bench, self.undisturbed, self.ranks = bench, undisturbed, ranks
        self.chance = random.Random(seed)
        self.hits, self.hits_here = Counter(), 0
        self.out, self.trace = bench.folder / "out", bench.folder / "trace"
        bench.extra["TRACE"] = str(self.trace)
        file = bench.write(SAMPLES)
        self.command = ["campaign", file, "--out", "out", *(() if ranks else ("--workers", 2))]
        self.process = None

    def solved(self):
        return self.trace.stat().st_size if self.trace.exists() else 0

    def kill_all(self, kinds):
        todo = deque(kinds)
        while todo:
            if self.process is None:
                self.process = self.bench.start(
                    *self.command, ranks=self.ranks, solver="fake_solver:traced", fresh=True
                )
            wanted = self.solved() + self.chance.randint(1, 40)
            assert until(
                lambda wanted=wanted: self.solved() >= wanted or self.process.poll() is not None,
                seconds=60.0,
            )
            if self.process.poll() is not None:
                self.compare()
            elif self.kill(todo[0]):
                self.hits[todo.popleft()] += 1
                self.hits_here += 1
        if self.process is not None:
            self.process.communicate(timeout=60)
            self.compare()
        elif self.out.exists():  # whoever finishes it
            finish = [*self.command[:4], "--workers", 2]
            self.bench.run(*finish, solver="fake_solver:traced")
            self.compare()

    def kill(self, kind):
        """One kill; whatever was on file before it must be there afterwards."""
        solvers = [pid for pid in children_of(self.process.pid) if is_solver(pid)]
        before = finished(self.out)
        bystanders = children_of(self.process.pid) if kind == "tree" else []
        hit = strike(targets_of(self.process, kind, self.chance), bystanders)
        if kind not in ("solver", "all solvers") and hit:
            self.process.communicate(timeout=60)
            assert self.process.returncode != 0
            assert until(lambda: not any(map(alive, solvers))), "solvers outlived their parent"
            self.process = None
        assert before <= finished(self.out), f"lost by killing {kind}"
        return hit

    def compare(self):
        """The campaign is through: nothing is missing, little was done twice, all is as it was."""
        if self.process is not None:
            assert self.process.returncode == 0, self.process.communicate()[0]
            self.process.communicate()
            self.process = None
        xr.testing.assert_identical(
            comparable(self.bench.result("out")), comparable(self.undisturbed)
        )
        assert 0 <= self.solved() - SAMPLES <= 2 * self.hits_here
        shutil.rmtree(self.out)
        self.trace.unlink()
        self.hits_here = 0


def drill(kinds, *, ranks, seed, bench, undisturbed):
    found = Drill(bench, undisturbed, ranks=ranks, seed=seed)
    found.kill_all(kinds)
    assert found.hits == Counter(kinds)
    return sum(found.hits.values())


def test_four_kills_cost_a_local_campaign_nothing(bench, undisturbed):
    assert drill(LOCAL, ranks=0, seed=7, bench=bench, undisturbed=undisturbed) == 4


def test_a_rank_that_is_killed_costs_an_mpi_campaign_nothing(bench, undisturbed, mpi):
    """Solver processes die above, and all of it below."""
    assert drill(["rank"], ranks=2, seed=5, bench=bench, undisturbed=undisturbed) == 1


def shuffled(kinds, seed):
    return random.Random(seed).sample(kinds, len(kinds))


@pytest.mark.slow
def test_thirty_kills_cost_a_local_campaign_nothing(bench, undisturbed):
    kinds = shuffled([*LOCAL * 7, "manager", "tree"], 3)
    assert drill(kinds, ranks=0, seed=3, bench=bench, undisturbed=undisturbed) == 30


@pytest.mark.slow
def test_thirty_kills_cost_an_mpi_campaign_nothing(bench, undisturbed, mpi):
    kinds = shuffled([*MPI * 7, "rank", "rank"], 4)
    assert drill(kinds, ranks=2, seed=4, bench=bench, undisturbed=undisturbed) == 30
