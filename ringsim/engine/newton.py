"""When exudyn's modified Newton renews its Jacobian within a step, and when it gives up.

exudyn renews where the residual does not halve, but never before the third iteration; where the
residual doubles, or after eight iterations, it begins the step anew, without its extrapolated
start, and renews the Jacobian in every iteration from then on.  Stops, and dry friction that turns
round, let a residual grow by much more on the way to a solution.  So here

- any iteration, the first ones included, renews the Jacobian where the residual falls too little,
  and each does from the ninth on;
- growth is no reason to begin anew, but for that of a run-away, by ``_RUNAWAY`` in an iteration:
  there the step is given up, and repeated with a shorter one;
- the second iteration has a Jacobian of its own where that of the start is worth nothing.  The
  extrapolated start strains the rods; one that carries a force F by mistake is as if it had a
  lateral stiffness F / L, which must not rule over its inertia m / h^2.

exudyn offers no settings for this, but its solver's counters can be written before a residual.
"""

from typing import Any

import numpy as np

from ringsim.layout.layout import Layout

_EXEMPT = 2
"""Iterations in which exudyn does not look at the residual's fall."""
_RUNAWAY = 1e6
_ROUGH = 30.0
"""Start's residual over that at which mistaken forces and inertia are alike.  1 renews Jacobians
for nothing (490 for 344 on ring18), 1e9 leaves them where a ring of 6 that stalls wants new ones.
"""


class Newton:
    """Newton's iterations of the steps of one run."""

    iterations = 25
    """Most iterations of a step."""
    fall = 0.6
    """Share of the last residual above which the Jacobian is renewed."""
    patience = 8
    """Iterations after which it is renewed in any case."""

    def __init__(self, solver: Any, layout: Layout) -> None:
        self._solver, self._count = solver, 0
        # The residual of a step's start is a norm over all rods, and so is this, kg m.
        self._rough = _ROUGH * float(np.linalg.norm([rod.mass * rod.length for rod in layout.rods]))

    @classmethod
    def configure(cls, newton: Any) -> None:
        """Settings of exudyn's that leave these decisions to an object of this class."""
        newton.useModifiedNewton = True
        newton.modifiedNewtonJacUpdatePerStep = True
        newton.maxIterations = newton.maxModifiedNewtonIterations = cls.iterations + _EXEMPT
        # exudyn's own limit for beginning anew is a growth by 2, of what stands in lastResidual.
        newton.modifiedNewtonContractivity = cls.fall / _RUNAWAY

    def apply(self) -> None:
        """Due before every residual."""
        now, found = self._solver.it, self._solver.conv
        if now.newtonSteps == 1:
            now.newtonSteps += _EXEMPT
            if found.residual * now.currentStepSize**2 > self._rough:
                found.jacobianUpdateRequested = True
        elif 0 < now.newtonSteps == self._count:
            found.stopNewton = True  # exudyn begins anew
        if now.newtonSteps > self.patience + _EXEMPT:
            found.jacobianUpdateRequested = True
        if now.newtonSteps > 0:
            found.lastResidual = found.lastResidual * _RUNAWAY
        self._count = now.newtonSteps
