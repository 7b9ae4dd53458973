"""Real runs under guard: one made to fail stops early, starts anew, and is cured or says why."""

from __future__ import annotations

import pytest

from ringsim.analysis.stability import cause_of
from ringsim.engine.build import build
from ringsim.engine.energy import Energies
from ringsim.engine.energy_control import EnergyControl
from ringsim.engine.integrate import Integration
from ringsim.parts.solver import Solver
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run
from ringsim.variables import Status


def ring(**solver) -> Scene:
    """Four sections, pushed from 120 deg to their stops in 0.9 s."""
    return load_scene("ring18").with_values(
        {
            "structure.sections": 4,
            "structure.opening_angle": 120.0,
            "boom": "none",
            "net": "none",
            "joints.vjoint.viscous": 0.001,
            "loads.force": 0.1,
            "solver.end_time": 4.0,
        }
        | {f"solver.{name}": value for name, value in solver.items()}
    )


COARSE = {"step_control": "constant", "step": 0.1, "restarts": 0}


def test_a_sound_run_is_left_alone() -> None:
    outcome = run(ring())
    assert outcome.status is Status.OK
    assert int(outcome.values["restarts"]) == 0
    assert float(outcome.values["energy_error"]) < ring().solver.energy_tolerance


def test_a_run_with_absurd_steps_stops_early_with_its_cause() -> None:
    """Without guards it goes on to the stops and says that it went well."""
    unguarded = run(ring(**COARSE, energy_tolerance=1e6))
    assert unguarded.status is Status.OK
    outcome = run(ring(**COARSE))
    assert outcome.status is Status.DIVERGED
    assert cause_of(outcome.reason) == "energy grew"
    assert float(outcome.values["final_time"]) < 0.5 * float(unguarded.values["final_time"])


def test_too_coarse_steps_are_cured_by_a_new_start() -> None:
    coarse = ring(step_control="constant", step=0.02)
    outcome = run(coarse)
    assert outcome.status is Status.OK
    assert float(outcome.values["energy_error"]) < coarse.solver.energy_tolerance
    assert 1 <= int(outcome.values["restarts"]) <= coarse.solver.restarts
    first = outcome.reason.partition("start 1: ")[2]
    assert cause_of(first) in ("energy lost", "energy grew")


def test_a_stop_that_is_far_too_soft_is_named() -> None:
    soft = ring(restarts=0).with_values({"loads.force": 10.0, "stop.stiffness": 1e-3})
    outcome = run(soft.with_values({"stop.damping": 0.0}))
    assert outcome.status is Status.DIVERGED
    assert cause_of(outcome.reason) == "stop passed"


def test_an_error_of_our_own_inside_the_solver_is_not_called_a_failure_of_the_solver() -> None:
    integration = Integration(build(ring()))
    steps = integration.history.times

    def broken(*_: object) -> bool:
        if len(steps) > 3:
            raise KeyError("surprise")
        return False

    integration._guard.stops = broken  # type: ignore[method-assign]
    with pytest.raises(RuntimeError, match="KeyError: 'surprise'"):
        integration.run()


def test_the_smallest_step_is_not_repeated_forever() -> None:
    """As the difference of two times it is longer than itself by round-off."""
    solver, begin = Solver(step=3.0), 7.5e-4
    control = EnergyControl(solver, 1e-12, tireless=True)
    still, thrown = Energies(0.0, 0.0, 0.0, 0.0), Energies(1.0, 0.0, 0.0, 0.0)
    step, repeats = solver.step, 0
    while (shorter := control.shorter((begin + step) - begin, still, thrown)) and repeats < 100:
        step, repeats = shorter, repeats + 1
    assert 3 < repeats < 20
    assert step < 1e-3 * solver.step
