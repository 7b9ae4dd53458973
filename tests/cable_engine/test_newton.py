"""How Newton converges with the cables' tangents."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import exudyn as exu
import pytest

from driven import truss, write_all
from ringsim.exudyn.build import build
from ringsim.exudyn.integrate import solver_settings

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
