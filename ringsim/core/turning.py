"""Slopes of dry friction for Newton, where ropes or joints turn round within a step."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ringsim.cable.ropes import Array, Indices
from ringsim.core.library import call

# What Newton's iterates of one step tell of dry friction (turning.c).
#
# A law like p = tanh(s / s_slip) is flat on both sides of the passage at s = 0.  Tangents jump
# across it to and fro for ever; a step that a rope stops in needs thousands of times s_slip.  Once
# Newton has seen a pulley, or a joint, on both sides, the slope is at least that of the secant to
# the last iterate on the other side, as in the method of false position.  Kept there it would
# converge from one side only, and slowly: it halves with every further iterate on the same side, as
# in the Illinois method (Dowell and Jarratt, BIT 11 (1971) 168).


class Seen(NamedTuple):
    """Rates of pulleys or joints: the last ones ahead and back, shape (2, n); whether the newest is
    back; iterates on its side in a row, less one; and whether there is any, shape (1,).
    """

    last: Array
    back: Indices
    stayed: Indices
    begun: Indices

    @classmethod
    def empty(cls, n: int) -> "Seen":
        """Of so many."""
        whole = np.zeros((2, n), dtype=np.int64)
        return cls(np.zeros((2, n)), whole[0], whole[1], np.zeros(1, dtype=np.int64))

    def forget(self) -> None:
        """Begin a step."""
        self.begun[0] = 0


_NUDGE = 1e-7
"""Change of rate (rad/s) by which tangents of laws are measured."""
_ENDS = np.array([[1.0], [-1.0]])


class Turning:
    """Newton's iterates of one step, and slopes of laws that Python evaluates."""

    def __init__(self) -> None:
        self._owner: object = None
        self._seen = Seen.empty(0)

    def forget(self) -> None:
        """Begin a step."""
        self._owner = None

    def note(self, owner: object, rates: Array) -> None:
        """Remember an iterate: rates, shape (n,), of pulleys or joints, whose meaning changes with
        their ``owner``, as speeds (m/s) of the ropes that a fault may split.
        """
        if self._owner is not owner:
            self._owner, self._seen = owner, Seen.empty(len(rates))
        call("note_rates", self._seen, np.ascontiguousarray(rates))

    def slopes(
        self, owner: object, rates: Array, own: Array, law: Callable[[Array], Array]
    ) -> Array:
        """Slopes of a law at the iterate noted last, shape (n,), in its unit over that of the
        rates: ``own``, its derivatives there, or what the other side asks for.
        """
        if self._owner is not owner:
            return own
        other, out = np.empty((2, len(rates)))
        call("rates_across", self._seen, other)
        given = (np.ascontiguousarray(each) for each in (rates, own, law(rates), law(other)))
        call("slopes_between", self._seen, *given, out)
        return out

    def tangents(self, owner: object, rates: Array, law: Callable[[Array], Array]) -> Array:
        """``slopes`` of a law whose derivatives are those of central differences."""
        ahead, behind = law(rates + _NUDGE * _ENDS)
        return self.slopes(owner, rates, (ahead - behind) / (2.0 * _NUDGE), law)
