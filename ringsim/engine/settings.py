"""Settings of exudyn's solver that all structures share."""

from __future__ import annotations

from typing import Any

import exudyn as exu

from ringsim.scene import Scene


def solver_settings(scene: Scene, tolerance: float) -> Any:
    """Generalised-alpha with modified Newton; the step is set by a user function.

    Parameters
    ----------
    tolerance
        Residual norm at which Newton stops, N.
    """
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 2.0 * scene.solver.end_time
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    time = settings.timeIntegration
    time.verboseMode = 0
    time.endTime = scene.solver.end_time
    time.numberOfSteps = 1
    time.adaptiveStep = True
    time.adaptiveStepRecoverySteps = 10**6
    time.minimumStepSize = 1e-9
    time.generalizedAlpha.spectralRadius = scene.solver.spectral_radius
    time.generalizedAlpha.computeInitialAccelerations = False
    time.generalizedAlpha.resetAccelerations = False
    time.newton.useModifiedNewton = True
    time.newton.modifiedNewtonJacUpdatePerStep = True
    time.newton.maxIterations = 25
    time.newton.relativeTolerance = 1e-14
    time.newton.absoluteTolerance = tolerance
    return settings


def raise_own(error: Exception, refusal: str) -> None:
    """Raise again what one of our own functions raised inside exudyn, which calls it a failure of
    the solver; smaller steps would not help.

    Parameters
    ----------
    error
        What exudyn raised.
    refusal
        What the cables could not answer; they say so by an exception that is none of these.
    """
    if "USER FUNCTION" in str(error) and not refusal:
        raise RuntimeError(" ".join(str(error).split())) from error
