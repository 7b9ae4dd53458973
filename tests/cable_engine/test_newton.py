"""How Newton converges with the cables' tangents."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import exudyn as exu
import pytest

from driven import truss, write_all
from ringsim.exudyn.build import build
from ringsim.exudyn.integrate import solver_settings
from ringsim.frame.integrate import solve as run_frame
from ringsim.scene import load_scene
from ringsim.variables import Status

pytestmark = pytest.mark.quick


def residuals(*, whole: bool, step: float) -> list[float]:
    """Residual norms (N) of full Newton's iterations in the first step of a taut truss.

    Its ropes are pre-stretched, with friction in every pulley, and the motors start at full
    speed: the step begins far from its end.
    """
    scene = truss(
        structure__opening_angle=70.0,
        both__initial_slack=-1e-3,
        both__axial_stiffness=1e4,
        both__friction__coefficient=0.003,
        both__winch__winding__speed=0.05,
    )
    built = build(scene)
    assert built.cables is not None
    if whole:
        write_all(built.cables)
    system, solver = built.model.assembly.system, exu.MainSolverImplicitSecondOrder()
    settings = solver_settings(scene, 1e-7)
    settings.timeIntegration.newton.useModifiedNewton = False
    settings.timeIntegration.adaptiveStep = False
    settings.timeIntegration.endTime = step
    found: list[float] = []

    def note(mbs: Any, time: float, newton: int, discontinuous: int) -> None:
        # Called before a residual is computed: what stands there is that of the iterate before.
        if newton > 1:
            found.append(float(solver.conv.residual))

    system.SetPreNewtonResidualUserFunction(note)
    assert solver.InitializeSolver(system, settings)
    solver.SolveSteps(system, settings)
    found.append(float(solver.conv.residual))
    return found


def test_full_newton_converges_quadratically_on_a_taut_truss() -> None:
    """While the cables' residual rules; exudyn leaves the change of M(q) a out of its Jacobian.

    Measured: 0.99, 7.3e-5, 3.3e-7 N with steps of 10 ms.  The last of these is the part of the
    inertia, which shrinks with the square of the step and falls linearly.
    """
    for step, rest in ((5e-3, 2e-8), (1e-2, 1e-6)):
        found = residuals(whole=True, step=step)
        assert found[1] > 0.1
        assert found[2] < 1e-3 * found[1] ** 2
        assert found[3] < rest
        assert len(found) <= 5


def test_the_reduced_tangent_converges_as_well() -> None:
    """What it leaves out of the decay is below what exudyn leaves out of the inertia."""
    exact, reduced = (residuals(whole=w, step=1e-2) for w in (True, False))
    # One more at the end, where it is linear: 4.2e-7 N are left where the exact one has 8e-8 N.
    assert len(reduced) <= len(exact) + 1
    assert reduced[2] == pytest.approx(exact[2], rel=0.1)
    # Linear at the end: each iteration at least thirds the residual.
    assert max(b / a for a, b in pairwise(reduced[1:])) < 0.34


def test_a_damped_rope_whose_winch_stops_goes_slack_within_a_step() -> None:
    """Its tension falls by what the winch's speed has damped; V-joints that hold it have no inertia
    about their bars, so that tangents of the taut rope and of the slack one lead to each other.
    """
    arc = {"sections": 3, "closed": False, "polygon_sections": 4, "opening_angle": 26.0}
    scene = load_scene("ring18-cable").with_values(
        {f"structure.{name}": value for name, value in arc.items()}
        | {
            "boom.base": "fixed", "net": "none", "rods.damping": 0.0, "stop.latch": False,
            "cables.upper": "none",
            "cables.lower": {
                "winch": {
                    "winding": {"kind": "ramp", "speed": 0.36, "duration": 0.55}, "stop_time": 1.69,
                },
                "bracket": {"kind": "bar-half", "angle": 92.0}, "axial_stiffness": 6e4,
                "friction": {"kind": "bearing", "coefficient": 1e-4}, "damping_time": 4e-3,
                "initial_slack": 0.007,
            },
            "solver.end_time": 1.75, "solver.restarts": 0,
        }
    )  # fmt: skip
    found = run_frame(scene)
    assert found.status is Status.OK, found.reason
    assert found.values["energy_error"] < 1e-3
