"""Slopes of dry friction for Newton, where ropes or joints turn round within a step.

A law like p = tanh(s / s_slip) is flat on both sides of the passage at s = 0.  Tangents jump across
it to and fro for ever; a step that a rope stops in needs thousands of times s_slip.  Once Newton
has seen a pulley, or a joint, on both sides, the slope is at least that of the secant to the last
iterate on the other side, as in the method of false position.  Kept there it would converge from
one side only, and slowly: it halves with every further iterate on the same side, as in the Illinois
method (Dowell and Jarratt, BIT 11 (1971) 168).
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_NUDGE = 1e-7
"""Change of rate (rad/s) by which tangents of laws are measured."""
_ENDS = np.array([[1.0], [-1.0]])


class Turning:
    """Newton's iterates of one step, as far as slopes need them."""

    def __init__(self) -> None:
        self._owner: object = None
        self._noted: list[Array] = []
        """Rates that no slope has been asked for yet."""
        self._seen = np.empty((2, 0))
        """Last rate on either side."""
        self._back = np.empty(0, dtype=bool)
        self._stayed = np.empty(0)
        """Iterates on one side in a row, less one."""

    def forget(self) -> None:
        """Begin a step."""
        self._owner = None

    def note(self, owner: object, rates: Array) -> None:
        """Remember an iterate: rates, shape (n,), of pulleys or joints, whose meaning changes with
        their ``owner``, as speeds (m/s) of the ropes that a fault may split.
        """
        if self._owner is not owner:
            self._owner, self._noted = owner, []
            self._seen = np.full((2, len(rates)), np.nan)
            self._back, self._stayed = rates < 0.0, -np.ones(len(rates))
        self._noted.append(rates.copy())

    def _take(self, rates: Array) -> None:
        back = rates < 0.0
        self._stayed = (self._stayed + 1.0) * (back == self._back)
        self._back = back
        np.copyto(self._seen[0], rates, where=~back)
        np.copyto(self._seen[1], rates, where=back)

    def slopes(
        self, owner: object, rates: Array, own: Array, law: Callable[[Array], Array]
    ) -> Array:
        """Slopes of a law at the iterate noted last, shape (n,), in its unit over that of the
        rates: ``own``, its derivatives there, or what the other side asks for.
        """
        if self._owner is not owner:
            return own
        for noted in self._noted:
            self._take(noted)
        self._noted = []
        other = self._seen[1 - self._back.astype(int), np.arange(len(rates))]
        secants = (law(rates) - law(other)) / (rates - other)
        # fmax: NaN where the other side was never seen.
        return np.asarray(np.fmax(own, secants * 0.5**self._stayed))

    def tangents(self, owner: object, rates: Array, law: Callable[[Array], Array]) -> Array:
        """``slopes`` of a law whose derivatives are those of central differences."""
        ahead, behind = law(rates + _NUDGE * _ENDS)
        return self.slopes(owner, rates, (ahead - behind) / (2.0 * _NUDGE), law)
