"""Steps that follow tensions: what they refuse, what they allow, and the peaks they find."""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import pytest

from ringsim.parts.solver import Solver
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run, run_frame
from ringsim.stepping.instant import Energies, Instant
from ringsim.stepping.repeats import TensionBend
from ringsim.variables import Outcome, Status

SOLVER = Solver(step=0.1, tolerance=2e-3)
SLACK = 0.05
REST = Energies(0.0, 0.0, 0.0, 0.0)


def instant(time: float, tension: float) -> Instant:
    return Instant(time, *np.zeros((2, 2, 3)), REST, 0.0, np.array([tension]))


def control_after(*tensions: float) -> TensionBend:
    """A control that has taken steps of 10 ms between these tensions."""
    control = TensionBend(SOLVER, SLACK)
    for before, after in itertools.pairwise(tensions):
        control.accept(instant(0.0, before), instant(0.01, after))
    return control


def shorter(control: TensionBend, step: float, before: float, after: float) -> float | None:
    return control.shorter(instant(0.0, before), instant(step, after))


def test_a_straight_tension_is_never_refused() -> None:
    control = control_after(1.0, 2.0, 3.0)
    assert shorter(control, 0.02, 3.0, 5.0) is None
    assert control.limit == pytest.approx(1.5 * 0.01)


def test_a_kink_is_repeated_in_proportion_to_the_root_of_its_bend() -> None:
    allowed = 15.0 * SOLVER.tolerance * 1.6  # of the largest, reached in the step itself
    asked = shorter(control_after(1.0, 1.0, 1.0), 0.01, 1.0, 1.6)
    assert asked == pytest.approx(0.01 * 0.8 * np.sqrt(allowed / 0.6))


def test_tensions_within_the_slack_width_are_left_alone() -> None:
    assert shorter(control_after(0.0, 1e-5, 0.0), 0.01, 0.0, 1e-3) is None


def test_the_smallest_step_is_never_repeated() -> None:
    assert shorter(control_after(1.0, 1.0), 1e-4 * SOLVER.step, 1.0, 9.0) is None


def slow_ring(**values: object) -> Scene:
    """Five sections whose V-joints lock one after another, wound at 16 mm/s against soft stops."""
    plain: dict[str, object] = {
        "structure.sections": 5,
        "structure.opening_angle": 150.0,
        "structure.hinge_offset": 0.02,
        "structure.aspect_ratio": 0.8608,
        "structure.corner_mass": 0.01731,
        "structure.vjoint_mass": 0.07102,
        "net": "none",
        "stop.stiffness": 17.18,
        "stop.damping": 0.5787,
        "joints.vjoint.viscous": 0.0355,
        "solver.end_time": 60.0,
    }
    for plane in ("upper", "lower"):
        winding = {"kind": "ramp", "speed": 0.01561, "duration": 0.4517}
        plain |= {
            f"cables.{plane}.winch.winding": winding,
            f"cables.{plane}.axial_stiffness": 4107.0,
            f"cables.{plane}.friction.coefficient": 0.001337,
            f"cables.{plane}.slack_width": 0.009186,
            f"cables.{plane}.block_offset": 0.08214,
        }
    return load_scene("ring18-cable").with_values(plain | values)


@pytest.mark.parametrize("engine", [run_frame, pytest.param(run, marks=pytest.mark.slow)])
def test_the_tension_of_the_last_lock_is_found(engine: Callable[[Scene], Outcome]) -> None:
    """It rises by 10 N/s there; the energy balance alone let steps of 33 ms cross it.

    The truth is that of frames, with fine steps.
    """
    coarse = engine(slow_ring())
    fine = run_frame(slow_ring(**{"solver.tolerance": 3e-4, "solver.step": 0.03}))
    assert coarse.status is fine.status is Status.OK
    peak, truth = (float(one.values["peak_tension"]) for one in (coarse, fine))
    # The tolerance allows a bend of 4.5 % of the largest tension.
    assert peak == pytest.approx(truth, rel=0.045)
