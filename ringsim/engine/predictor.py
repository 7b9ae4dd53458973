"""A better first guess for every step's Newton iteration."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.engine.assembly import Assembly

Array = NDArray[np.float64]


class Predictor:
    """Start Newton from the acceleration of the last step instead of zero acceleration.

    exudyn starts a step with zero acceleration at its end, which is off by h^2 beta a in the
    positions; with stiff rods that costs Newton iterations.  Moving the guess along the
    integrator's own update (a, h gamma a*, h^2 beta a*), a* = a (1 - alpha_f) / (1 - alpha_m),
    changes where Newton starts, not what it converges to.  The acceleration is the difference
    quotient of the velocities, which is smoother than the integrator's own.  Euler parameters are
    brought back to unit length: their second-order growth would stretch the stiff rods.
    """

    def __init__(self, assembly: Assembly, solver: Any) -> None:
        self._system, self._solver = assembly.system, solver
        self._dampers = assembly.dampers
        self._turns = np.array([assembly.coordinates_of(n)[3:7] for n in assembly.rigid_nodes])
        data = self._system.systemData
        reference = np.array(data.GetODE2Coordinates(exu.ConfigurationType.Reference))
        self._unturned = reference[self._turns]
        self._time = -1.0
        self._last: tuple[float, Array] | None = None

    def apply(self, system: Any, time: float, newton: int, discontinuous: int) -> None:
        """Called by exudyn before every residual; acts once per step, before the first.

        The rods' dampers come first: they read the state that the step starts from.
        """
        self._dampers.prepare(system, time, newton, discontinuous)
        if newton != 0 or discontinuous != 0 or time == self._time:
            return
        self._time = time
        data = self._system.systemData
        start = data.GetSystemStateDict(exu.ConfigurationType.StartOfStep, reference=True)
        velocity = np.array(start["ODE2Coords_t"])
        begin = data.GetTime(exu.ConfigurationType.StartOfStep)
        if self._last is None or begin <= self._last[0]:
            guess = np.array(start["ODE2Coords_tt"])
        else:
            guess = (velocity - self._last[1]) / (begin - self._last[0])
        if self._last is None or begin > self._last[0]:
            self._last = (begin, velocity)
        solver = self._solver
        step = solver.it.currentStepSize
        smooth = (1.0 - solver.alphaF) / (1.0 - solver.alphaM)
        now = data.GetSystemStateDict(reference=True)
        place = now["ODE2Coords"]
        moved = step**2 * solver.newmarkBeta * smooth * guess
        turned = (place + moved)[self._turns] + self._unturned
        stretch = 1.0 / np.linalg.norm(turned, axis=1) - 1.0
        moved[self._turns] += stretch[:, None] * turned
        guess = moved / (step**2 * solver.newmarkBeta * smooth)
        place[:] += moved
        now["ODE2Coords_t"][:] += step * solver.newmarkGamma * smooth * guess
        now["ODE2Coords_tt"][:] += guess
