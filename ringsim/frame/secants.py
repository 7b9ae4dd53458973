"""Broyden's method: what a tangent that is not renewed learns from the changes made with it.

With changes s_0 ... s_n since the tangent was factored, and z = -K^-1 g of the newest residual,

    z <- z + s_(j+1) (s_j . z) / (s_j . s_j),  j = 0 ... n - 1,
    s_(n+1) = z / (1 - (s_n . z) / (s_n . s_n))

(the product form of the good Broyden update: Kelley, Iterative Methods for Linear and Nonlinear
Equations, SIAM 1995, section 7.3).  It costs some dot products, in which turns count by the way
that they move a length: sums of metres and radians would depend on the unit of length.
"""

from ringsim.layout.pose import Array

_ALIKE = 0.7
"""Largest share of the last change in the next one for which the update is made: a change that
hardly differs from the last one says that the tangent is wrong there."""


class Secants:
    """The changes since a tangent."""

    def __init__(self, lengths: Array) -> None:
        """``lengths``, shape (unknowns,): by which turns become ways (m); 1 for what is one."""
        self._metric = lengths**2
        self._changes: list[Array] = []
        self._squares: list[float] = []

    def forget(self) -> None:
        """Begin with a new tangent, or after a change that was not taken whole."""
        self._changes, self._squares = [], []

    def corrected(self, change: Array) -> Array:
        """The change to make instead of the tangent's own, shape (unknowns,)."""
        last = len(self._changes) - 1
        for n, square in enumerate(self._squares):
            share = float((self._metric * self._changes[n]) @ change) / square
            if n < last:
                change = change + share * self._changes[n + 1]
            elif share < _ALIKE:
                change = change / (1.0 - share)
        self._changes.append(change)
        self._squares.append(float((self._metric * change) @ change))
        return change
