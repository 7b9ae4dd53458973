"""Every way to fail has a code, which survives restarts, journals and files."""

from __future__ import annotations

import numpy as np
import pytest

from ringsim import simulation
from ringsim.execution.work import solve
from ringsim.exudyn import integrate
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene
from ringsim.storage.result import Result
from ringsim.variables import Cause, Fate, Outcome, Reason, Status

RING = load_scene("ring18").with_values(
    {"structure.sections": 3, "structure.aspect_ratio": 1.0, "net": "none", "loads.force": 0.03}
)


@pytest.mark.parametrize(
    ("values", "cause"),
    [
        ({"solver.step_limit": 5, "solver.restarts": 0}, Cause.STEP_LIMIT),
        (
            {"solver.step_control": "constant", "solver.step": 0.2, "solver.restarts": 0}
            | {"solver.energy_tolerance": 1e6},
            Cause.FEW_STEPS,
        ),
    ],
)
def test_a_run_says_why_it_ended(values, cause) -> None:
    outcome = simulation.run(RING.with_values(values))
    assert outcome.cause is cause
    assert outcome.status is not Status.OK


def test_a_run_that_goes_well_has_no_cause() -> None:
    assert simulation.run(RING.with_values({"solver.end_time": 6.0})).cause is Cause.NONE


@pytest.mark.parametrize(
    ("causes", "counts"),
    [
        ([Cause.BLOW_UP, Cause.JOINT_GAP, Cause.NEWTON], Cause.NEWTON),
        ([Cause.BLOW_UP, Cause.JOINT_GAP, Cause.STEP_LIMIT], Cause.BLOW_UP),
    ],
)
def test_the_last_start_counts_unless_it_ran_out_of_its_smaller_steps(
    causes, counts, monkeypatch
) -> None:
    left = list(causes)

    def ending(scene: Scene, watch: object) -> Outcome:
        return Outcome(Status.DIVERGED, "so", {}, {"steps": np.array(1)}, left.pop(0))

    monkeypatch.setattr(integrate, "solve", ending)
    assert simulation.run(RING).cause is counts


@pytest.mark.parametrize(
    ("error", "cause"),
    [
        (InputError("loads.force = 1 N: too much"), Cause.REFUSED),
        (ZeroDivisionError(), Cause.EXCEPTION),
        (MemoryError(), Cause.MEMORY),
    ],
)
def test_a_sample_that_raises_has_a_cause(error, cause) -> None:
    def solver(scene: Scene) -> Outcome:
        raise error

    assert solve(solver, RING, 0, {}).cause is cause


def test_a_journal_keeps_cause_and_outcome() -> None:
    result = Result(3, Status.DIVERGED, "it blew up", cause=Cause.BLOW_UP)
    assert Result.from_header(result.header(), b"").cause is Cause.BLOW_UP
    result = Result(3, Status.OK, "all V-joints have reached 180 deg", fate=Fate.DEPLOYED)
    assert Result.from_header(result.header(), b"").fate is Fate.DEPLOYED


def test_a_reason_is_its_sentence() -> None:
    reason = Reason(Cause.NEWTON, "the solver stopped")
    assert reason == "the solver stopped"
    assert not Reason()
    assert Reason().cause is Cause.NONE
