"""A run that fails starts anew with smaller steps, says so, and never more often than asked."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

from ringsim import simulation
from ringsim.analysis.campaign_notes import restart_lines
from ringsim.campaign import studies
from ringsim.cli import cli
from ringsim.dataset import to_dataset
from ringsim.exudyn import integrate
from ringsim.parts.solver import Solver
from ringsim.scene import load_scene
from ringsim.variables import COUNTS, Outcome, Status

SCENE = load_scene("truss2")


class Endings:
    """Solves a scene by giving one prepared ending after the other."""

    def __init__(self, *statuses: Status, steps: int = 10) -> None:
        self.left, self.steps = list(statuses), steps
        self.solvers: list[Solver] = []

    def __call__(self, scene, watch):
        self.solvers.append(scene.solver)
        status = self.left.pop(0)
        values = {"steps": np.array(self.steps), "final_time": np.array(1.0)}
        values |= {n: np.array(0.0) for n in ("energy_error", "constraint_error", "asynchrony_max")}
        reason = f"ending {len(self.solvers)}; 1 of 24 latches did not catch"
        return Outcome(status, reason, {}, values)


@pytest.fixture
def endings(monkeypatch):
    def install(*statuses: Status, steps: int = 10) -> Endings:
        prepared = Endings(*statuses, steps=steps)
        monkeypatch.setattr(integrate, "solve", prepared)
        return prepared

    return install


def test_a_sound_run_starts_once(endings) -> None:
    prepared = endings(Status.OK)
    outcome = simulation.run(SCENE)
    assert outcome.reason == "ending 1; 1 of 24 latches did not catch"
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
    assert outcome.reason.startswith("ending 3; 1 of 24 latches did not catch (start 3 with solver")
    # Of the antenna in a start that is not used nothing is told.
    assert outcome.reason.endswith("start 1: ending 1)")


def test_there_are_no_more_restarts_than_asked_for(endings) -> None:
    for allowed in (0, 1, 3):
        prepared = endings(*[Status.DIVERGED] * 9)
        outcome = simulation.run(SCENE.with_values({"solver.restarts": allowed}))
        assert outcome.status is Status.DIVERGED
        assert int(outcome.values["restarts"]) == allowed
        assert len(prepared.solvers) == allowed + 1


@pytest.mark.parametrize("status", [Status.OK, Status.ERROR])
def test_what_smaller_steps_do_not_cure_is_not_repeated(endings, status) -> None:
    prepared = endings(status)
    assert simulation.run(SCENE).status is status
    assert len(prepared.solvers) == 1


def test_a_run_with_too_many_steps_is_not_repeated_with_more(endings) -> None:
    prepared = endings(Status.SOLVER_FAILED, steps=SCENE.solver.step_limit)
    assert simulation.run(SCENE).status is Status.SOLVER_FAILED
    assert len(prepared.solvers) == 1


def test_a_refined_solver_stays_within_its_bounds() -> None:
    least = Solver(step=1e-9, tolerance=1e-8, deviation_tolerance=1e-6)
    assert least.refined(5) == least
    assert Solver().refined(0) == Solver()


def test_the_counts_of_all_starts_are_kept_beside_those_of_the_last(endings) -> None:
    endings(Status.DIVERGED, Status.DIVERGED, Status.OK, steps=7)
    found = to_dataset(simulation.run(SCENE), SCENE)
    assert int(found["steps"]) == 7
    assert int(found["total_steps"]) == 21
    assert float(found["step_used"]) == SCENE.solver.step / 16
    assert float(found["tolerance_used"]) == SCENE.solver.tolerance / 256


def test_a_real_run_that_starts_anew_took_more_than_its_last_start() -> None:
    """The same coarse run without restarts took the difference, step for step."""
    coarse = load_scene("ring18").with_values(
        {"structure.sections": 4, "boom": "none", "solver.step_control": "constant"}
        | {"solver.step": 0.02, "loads.force": 1.0, "solver.restarts": 1}
        | {"structure.opening_angle": 120.0}
    )
    whole = simulation.run(coarse)
    first = simulation.run(coarse.with_values({"solver.restarts": 0}))
    assert int(whole.values["restarts"]) == 1
    assert float(whole.values["step_used"]) == 0.005
    assert np.isnan(whole.values["tolerance_used"])
    assert float(first.values["step_used"]) == 0.02
    for name in COUNTS:
        assert int(first.values[f"total_{name}"]) == int(first.values[name]) > 0
        both = int(whole.values[name]) + int(first.values[name])
        assert int(whole.values[f"total_{name}"]) == both


def test_the_summary_of_a_run_says_that_it_started_anew(endings, tmp_path) -> None:
    endings(Status.DIVERGED, Status.DIVERGED, Status.OK)
    arguments = ["run", "truss2", "--fidelity", "full", "--out", str(tmp_path / "run.nc")]
    lines = CliRunner().invoke(cli, arguments).output.splitlines()
    (told,) = [line for line in lines if "restarted" in line]
    assert "restarted 2 times" in told
    assert "solver.step = 0.00625 s instead of 0.1 s" in told
    assert "solver.tolerance = 1.2e-06 instead of 0.0003" in told
    assert any(line.split() == ["steps", "of", "all", "attempts", "30"] for line in lines)
    endings(Status.OK)
    plain = CliRunner().invoke(cli, arguments).output
    assert "anew" not in plain
    assert "all starts" not in plain


def test_a_campaign_says_how_many_samples_started_anew() -> None:
    counts = {"restarts": [0, 2, 1, -1], "steps": [10, 40, 20, -1], "total_steps": [10, 70, 40, -1]}
    whole = xr.Dataset({name: ("sample", np.array(n)) for name, n in counts.items()})
    (line,) = restart_lines(whole)
    assert line.startswith("2 of 3 samples were restarted")  # of those that have run
    assert "42% of all 120 steps" in line  # (30 + 20) of 120
    assert restart_lines(whole.isel(sample=[0, 3])) == []


def test_a_rung_of_an_accuracy_study_never_starts_anew(monkeypatch, tmp_path) -> None:
    asked = []

    def refuse(folder, name, scene, cases, **how):
        asked.append((scene, cases))
        raise KeyboardInterrupt

    monkeypatch.setattr(studies, "run_cases", refuse)
    scene = SCENE.with_values({"solver.restarts": 5})
    with pytest.raises(KeyboardInterrupt):
        studies.run_ladder(tmp_path, scene, workers=1, timeout=60.0)
    ((varied, cases),) = asked
    assert varied.solver.restarts == 0
    assert not any("solver.restarts" in case for case in cases)
