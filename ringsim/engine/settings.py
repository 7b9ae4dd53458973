"""Settings of exudyn's solver."""

import math
from typing import Any

import exudyn as exu
import numpy as np

from ringsim.engine.build import Built
from ringsim.engine.newton import Newton
from ringsim.engine.rod_dampers import STIFFENING
from ringsim.scene import Scene
from ringsim.theory.scales import residual_tolerance, rope_reach


def solver_settings(scene: Scene, tolerance: float) -> Any:
    """Generalised-alpha with modified Newton, which stops at a residual norm ``tolerance`` (N); the
    step is set by a user function.
    """
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
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
    Newton.configure(time.newton)
    time.newton.relativeTolerance = 1e-14
    time.newton.absoluteTolerance = tolerance
    return settings


def newton_norm(built: Built) -> float:
    """Residual norm in N at which Newton stops; see ``residual_tolerance``."""
    scene, layout = built.model.scene, built.model.layout
    size = built.model.assembly.system.systemData.ODE2Size()
    rounded = 4.0 * float(np.finfo(float).eps)
    reached = rounded * math.sqrt(size)
    if scene.rods.damping > 0.0:
        reached *= STIFFENING
    return max(residual_tolerance(scene, layout, reached), rounded * rope_reach(scene))
