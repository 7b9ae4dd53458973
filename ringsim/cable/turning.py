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


class Turning:
    """Newton's iterates of one step, as far as slopes need them."""

    def __init__(self) -> None:
        self._ropes: Ropes | None = None
        self._seen = np.empty((2, 0))
        """Last speed on either side, m/s."""
        self._back = np.empty(0, dtype=bool)
        self._stayed = np.empty(0)
        """Iterates on one side in a row, less one."""

    def forget(self) -> None:
        """Begin a step."""
        self._ropes = None

    def note(self, ropes: Ropes, speeds: Array) -> None:
        """Remember an iterate: speeds of the ropes over all pulleys, m/s."""
        back = np.asarray(speeds < 0.0)
        if self._ropes is not ropes:
            self._ropes, self._seen = ropes, np.full((2, len(speeds)), np.nan)
            self._back, self._stayed = back, -np.ones(len(speeds))
        self._stayed = (self._stayed + 1.0) * (back == self._back)
        self._back = back
        np.copyto(self._seen[0], speeds, where=~back)
        np.copyto(self._seen[1], speeds, where=back)

    def slopes(self, ropes: Ropes, speeds: Array, exponents: Array, slip: Array) -> Array:
        """Slope of p of each pulley at the iterate noted last, s/m, shape (pulleys,), from its
        speed, p and slip speed.
        """
        own = (1.0 - exponents**2) / slip
        if self._ropes is not ropes:
            return np.asarray(own)
        other = self._seen[1 - self._back.astype(int), np.arange(len(slip))]
        secants = (exponents - np.tanh(other / slip)) / (speeds - other)
        # fmax: NaN where the other side was never seen.
        return np.asarray(np.fmax(own, secants * 0.5**self._stayed))
