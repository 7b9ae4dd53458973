"""Slopes of the pulleys' friction for Newton, where ropes turn round within a step.

p = tanh(s / s_slip) is flat on both sides of the passage at s = 0.  Tangents jump across it to and
fro for ever; a step that a rope stops in needs thousands of times s_slip.  Once Newton has seen a
pulley on both sides, the slope is at least that of the secant to the last iterate on the other
side, as in the method of false position.  Kept there it would converge from one side only, and
slowly: it halves with every further iterate on the same side, as in the Illinois method
(Dowell and Jarratt, BIT 11 (1971) 168).
"""

import numpy as np

from ringsim.cable.ropes import Array, Ropes
from ringsim.cable.state import ChainState


class Turning:
    """Newton's iterates of one step, as far as slopes need them."""

    def __init__(self) -> None:
        self._ropes: Ropes | None = None
        self._seen = self._stayed = np.empty(0)

    def forget(self) -> None:
        """Begin a step."""
        self._ropes = None

    def note(self, state: ChainState) -> None:
        """Remember an iterate."""
        speeds = state.speeds
        if self._ropes is not state.ropes:
            self._ropes = state.ropes
            # Last speed on either side (m/s), and iterates on one side in a row less one.
            self._seen = np.full((2, len(speeds)), np.nan)
            self._back, self._stayed = speeds < 0.0, -np.ones(len(speeds))
        back = speeds < 0.0
        self._stayed = np.where(back == self._back, self._stayed + 1.0, 0.0)
        self._back = back
        self._seen[back.astype(int), np.arange(len(speeds))] = speeds

    def slopes(self, state: ChainState) -> Array:
        """Slope of p of each pulley at the iterate noted last, s/m, shape (pulleys,)."""
        slip = state.slip_speeds
        tangents = np.asarray((1.0 - state.exponents**2) / slip)
        if self._ropes is not state.ropes:
            return tangents
        other = self._seen[1 - self._back.astype(int), np.arange(len(slip))]
        secants = (state.exponents - np.tanh(other / slip)) / (state.speeds - other)
        return np.fmax(tangents, secants * 0.5**self._stayed)  # fmax: NaN where never seen
