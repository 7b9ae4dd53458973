"""Steps across which a tension bends too far are repeated with a smaller one.

Within a step only the tensions T at its ends are known.  Against the straight line through the step
before, a tension bends over a step of length h2 behind one of length h1 by

    b = |T2 - T1 - (T1 - T0) h2 / h1|.

A largest tension between two readings may be missed by b / 8, and where T kinks, because a V-joint
locks or a rope becomes taut, the step across the kink is wrong by up to b.  In the energy balance
that does not show where the joints' friction takes most of what the winch gives: a slow ring came
to its last lock with steps in which the tension doubled.  b falls with the square of the step where
T is smooth, so that a refused step is repeated with h (allowed / b)^(1/2), and the next one may be
no larger than that.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.solver import TENSION_BEND, Solver

Array = NDArray[np.float64]
_REFUSED = 2.0
"""Bend over the allowed one from which on a step is repeated."""
_SAFETY = 0.8
_FALL, _RISE = 0.2, 1.5
"""Smallest and largest ratio of successive steps."""
_FINEST = 1e-4
"""No step is repeated below this share of the largest step."""


class TensionControl:
    """Judges steps by how the tensions of the cables bend.

    Attributes
    ----------
    limit
        Largest next step in s; infinite before the first.
    """

    def __init__(self, solver: Solver, slight: float) -> None:
        """Start with slack ropes.

        Parameters
        ----------
        solver
            The scene's settings.
        slight
            Tension in N that counts as reached from the start, so that ropes may become taut.
        """
        self.limit = math.inf
        self._allowed = TENSION_BEND * solver.tolerance
        self._least = _FINEST * solver.step
        self._largest = slight
        self._past: tuple[float, Array] | None = None

    def shorter(self, step: float, before: Array, after: Array) -> float | None:
        """A smaller step in s to repeat this one with, or None if it is good enough.

        Parameters
        ----------
        step
            What was tried, s.
        before, after
            Tensions of all spans at its ends, N, shape (spans,).
        """
        ratio = self._ratio(step, before, after)
        if not ratio > _REFUSED or step <= self._least * (1.0 + 1e-6):
            return None
        return max(step * max(_FALL, _SAFETY / math.sqrt(ratio)), self._least)

    def accept(self, step: float, before: Array, after: Array) -> None:
        """Learn from a step that was taken; parameters as of ``shorter``."""
        ratio = max(self._ratio(step, before, after), 1e-3)
        growth = min(max(_SAFETY / math.sqrt(ratio), _FALL), _RISE)
        self.limit = max(step * growth, self._least) if math.isfinite(ratio) else math.inf
        self._largest = max(self._largest, float(after.max()))
        self._past = step, before

    def _ratio(self, step: float, before: Array, after: Array) -> float:
        """Bend over the allowed one; 0 where it is not known yet."""
        if self._past is None:
            return 0.0
        earlier, first = self._past
        bend = np.abs(after - before - (before - first) * (step / earlier)).max()
        return float(bend) / (self._allowed * max(self._largest, float(after.max())))
