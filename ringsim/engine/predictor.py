"""Where Newton's method begins a step in exudyn: the last steps' motion, extrapolated."""

from typing import Any

import exudyn as exu
import numpy as np

from ringsim.engine.assembly import Assembly
from ringsim.engine.rotations import Array
from ringsim.stepping.extrapolation import extrapolated

_EASY = 5
"""Most iterations of a step after which the next one begins with a cubic."""
_START = exu.ConfigurationType.StartOfStep


class Predictor:
    """Start Newton from a polynomial through the last places instead of zero acceleration.

    exudyn starts a step with zero acceleration at its end, which is off by h^2 beta a in the
    positions.  The squares of such errors stretch the stiff rods in the first iteration, and what a
    rod carries by mistake turns the next ones astray.  Moving the guess along the integrator's own
    update (a, h gamma a*, h^2 beta a*), a* = a (1 - alpha_f) / (1 - alpha_m), to the extrapolated
    places changes where Newton starts, not what it converges to.  Accelerations from differences of
    the velocities would miss the places by ten times as much: velocities are the rougher.  Euler
    parameters are brought back to unit length: their third-order growth would stretch the rods.

    It is a cubic where the last step was easy, else a parabola: where ropes swing within a step a
    cubic swings further.  Only nodes of the assembly are moved, not auxiliary unknowns.
    """

    def __init__(self, assembly: Assembly, solver: Any) -> None:
        self._data, self._solver = assembly.system.systemData, solver
        self._turns = np.array([assembly.coordinates_of(n)[3:7] for n in assembly.rigid_nodes])
        reference = np.array(self._data.GetODE2Coordinates(exu.ConfigurationType.Reference))
        self._unturned = reference[self._turns]
        self._size = assembly.size
        self._time = -1.0
        self._last: tuple[float, Array] | None = None
        self._moves: list[tuple[float, Array]] = []
        self._iterations, self._easy = 0, False

    def apply(self, time: float, newton: int, discontinuous: int) -> None:
        """Due before every residual; acts once per attempt at a step, before the first."""
        if newton != 0 or discontinuous != 0 or time == self._time:
            return
        self._time = time
        solver, size = self._solver, self._size
        start = self._data.GetSystemStateDict(_START, reference=True)
        begun = np.array(start["ODE2Coords"][:size])
        self._note(self._data.GetTime(_START), begun)
        step = solver.it.currentStepSize
        smooth = (1.0 - solver.alphaF) / (1.0 - solver.alphaM)
        now = self._data.GetSystemStateDict(reference=True)
        place = now["ODE2Coords"]
        moved = step**2 * solver.newmarkBeta * smooth * np.array(start["ODE2Coords_tt"])
        if moves := self._moves[-3 if self._easy else -2 :]:
            moved[:size] = begun + extrapolated(moves, step) - place[:size]
            moved[size:] = 0.0
        turned = (place + moved)[self._turns] + self._unturned
        stretch = 1.0 / np.linalg.norm(turned, axis=1) - 1.0
        moved[self._turns] += stretch[:, None] * turned
        guess = moved / (step**2 * solver.newmarkBeta * smooth)
        place[:] += moved
        now["ODE2Coords_t"][:] += step * solver.newmarkGamma * smooth * guess
        now["ODE2Coords_tt"][:] += guess

    def _note(self, begin: float, begun: Array) -> None:
        """Remember a state from which a step starts."""
        last = self._last
        if last is not None and begin <= last[0]:
            return  # the step is repeated
        self._last = begin, begun
        before, self._iterations = self._iterations, self._solver.it.newtonStepsCount
        if last is not None:
            duration = begin - last[0]
            rate = (begun - last[1]) / duration
            # Before rest it came as it leaves: the even motion through the first state.
            self._moves = [*(self._moves[-2:] or [(duration, -rate)]), (duration, rate)]
            self._easy = self._iterations - before <= _EASY
