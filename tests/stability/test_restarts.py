"""A run that fails starts anew with smaller steps, says so, and never more often than asked."""

from __future__ import annotations

import numpy as np
import pytest

from ringsim import simulation
from ringsim.dataset import to_dataset
from ringsim.execution.serial import Serial
from ringsim.execution.solve import solve
from ringsim.execution.work import Limits, Retry, Task, Work
from ringsim.parts.solver import Solver
from ringsim.parts.structure.pantograph_ring import PantographRing
from ringsim.scene import load_scene
from ringsim.variables import Outcome, Status

SCENE = load_scene("truss2")


class Endings:
    """Solves a scene by giving one prepared ending after the other."""

    def __init__(self, *statuses: Status, steps: int = 10) -> None:
        self.left, self.steps = list(statuses), steps
        self.solvers: list[Solver] = []

    def __call__(self, scene):
        self.solvers.append(scene.solver)
        status = self.left.pop(0)
        values = {"steps": np.array(self.steps), "final_time": np.array(1.0)}
        values |= {n: np.array(0.0) for n in ("energy_error", "constraint_error", "asynchrony_max")}
        reason = f"ending {len(self.solvers)}"
        return lambda **_: Outcome(status, reason, {}, values)


@pytest.fixture
def endings(monkeypatch):
    def install(*statuses: Status, steps: int = 10) -> Endings:
        prepared = Endings(*statuses, steps=steps)
        monkeypatch.setitem(simulation.SOLVERS, PantographRing, prepared)
        return prepared

    return install


def test_a_sound_run_starts_once(endings) -> None:
    prepared = endings(Status.OK)
    outcome = simulation.run(SCENE)
    assert outcome.reason == "ending 1"
    assert int(outcome.values["restarts"]) == 0
    assert len(prepared.solvers) == 1


@pytest.mark.parametrize("status", [Status.SOLVER_FAILED, Status.DIVERGED])
def test_a_failed_run_starts_anew_with_a_quarter_of_the_step(endings, status) -> None:
    prepared = endings(status, status, Status.OK)
    outcome = simulation.run(SCENE)
    assert outcome.status is Status.OK
    assert int(to_dataset(outcome, SCENE)["restarts"]) == 2
    first, second, third = prepared.solvers
    assert (second.step, third.step) == (first.step / 4, first.step / 16)
    assert (second.tolerance, third.tolerance) == (first.tolerance / 16, first.tolerance / 256)
    assert outcome.reason.startswith("ending 3 (start 3 with solver.step = 0.00625 s")
    assert outcome.reason.endswith("start 1: ending 1)")


def test_there_are_no_more_restarts_than_asked_for(endings) -> None:
    for allowed in (0, 1, 3):
        prepared = endings(*[Status.DIVERGED] * 9)
        outcome = simulation.run(SCENE.with_values({"solver.restarts": allowed}))
        assert outcome.status is Status.DIVERGED
        assert int(outcome.values["restarts"]) == allowed
        assert len(prepared.solvers) == allowed + 1


@pytest.mark.parametrize("status", [Status.UNFINISHED, Status.ERROR])
def test_what_smaller_steps_do_not_cure_is_not_repeated(endings, status) -> None:
    prepared = endings(status)
    assert simulation.run(SCENE).status is status
    assert len(prepared.solvers) == 1


def test_a_run_with_too_many_steps_is_not_repeated_with_more(endings) -> None:
    prepared = endings(Status.SOLVER_FAILED, steps=SCENE.solver.step_limit)
    assert simulation.run(SCENE).status is Status.SOLVER_FAILED
    assert len(prepared.solvers) == 1


def test_a_refined_solver_stays_within_its_bounds() -> None:
    least = Solver(step=1e-9, tolerance=1e-8)
    assert least.refined(5) == least
    assert Solver().refined(0) == Solver()


@pytest.mark.parametrize(("times", "runs"), [(0, 3), (1, 2), (4, 5)])
def test_a_campaign_that_repeats_samples_replaces_the_restarts(endings, times, runs) -> None:
    """1 + times attempts, not (1 + times) (1 + restarts)."""
    prepared, kept = endings(*[Status.DIVERGED] * 9), []
    work = Work(
        solver="ringsim.simulation:run",
        scene=SCENE.to_table(),
        values_of=lambda sample: {},
        limits=Limits(),
        retry=Retry(times=times),
        keep=kept.append,
        started=lambda sample: None,
        finished=lambda result: None,
        stop=lambda: "",
    )
    Serial().run([0], work)
    assert len(prepared.solvers) == runs
    assert kept[0].attempts == 1 + times


def test_a_replayed_attempt_runs_as_the_campaign_ran_it(endings) -> None:
    prepared = endings(Status.DIVERGED)
    solve(simulation.run, SCENE, Task(0, {}, 0.5, restarts=False))
    assert [solver.step for solver in prepared.solvers] == [0.5 * SCENE.solver.step]
