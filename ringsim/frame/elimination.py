"""The tangent of all unknowns, eliminated section by section, with the border of the ropes."""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ringsim.core.library import call
from ringsim.frame.mesh import Indices, Mesh
from ringsim.layout.bodies import Array

# Solving for all unknowns: fronts, one for each part and each block of bodies (fronts.c).
#
# A front is a small dense matrix.  Its first ``gone`` unknowns occur in no other front that is
# left, so they are eliminated there; what that leaves of the others (the Schur complement) is added
# to the parent front (the multifrontal method: Duff and Reid, ACM Transactions on Mathematical
# Software 9, 1983).  Parts come first, then the blocks in their order; a closed ring's fronts carry
# the last block along.  The work grows linearly with the sections.
#
# A front's unknowns go in panels of 16 at most.  With a panel first, [A B; C D] becomes
# [. B; C A^-1 .] and an inverse A^-1 of its own: what is left of triangular factors would be too
# small for whole registers.


EIGHT = 8
"""Right-hand sides that are solved at a time."""
_PANEL = 2 * EIGHT
_WIDE = 3 * EIGHT
"""Columns at a time of what a panel leaves: as many as two neighbouring blocks have."""


class Fronts(NamedTuple):
    """Matrices, shape (n, rows, columns), with room behind the last column for whole eights, whose
    numbers mean nothing; panels, (m, 3): front, first unknown there and number of unknowns; their
    inverses, (m, 16, 16); number of columns.
    """

    whole: Array
    panels: Indices
    inverse: Array
    columns: int

    @classmethod
    def empty(cls, mesh: Mesh) -> "Fronts":
        """Those of a mesh."""
        panels = np.array(
            [
                (number, first, min(_PANEL, gone - first))
                for number, gone in enumerate(mesh.gone.tolist())
                for first in range(0, gone, _PANEL)
            ]
        )
        front, first, gone = panels.T
        # As far as what is read at a time reaches beyond the last column.
        kept = mesh.size[front] - first - gone
        reach = first + np.maximum(gone + _WIDE * np.ceil(kept / _WIDE), _PANEL).astype(int)
        n, most = mesh.spots.shape
        columns = EIGHT * math.ceil(max(most, int(reach.max())) / EIGHT)
        inverse = np.zeros((len(panels), _PANEL, _PANEL))
        return cls(np.zeros((n, most, columns)), panels, inverse, columns)


def factor(mesh: Mesh, fronts: Fronts) -> bool:
    """Eliminate all fronts, in place; False where a pivot is too small."""
    return bool(call("factor", mesh, fronts))


def solve(mesh: Mesh, fronts: Fronts, x: Array) -> None:
    """Replace right-hand sides ``x``, shape (unknowns, a multiple of EIGHT), by solutions with
    factored fronts.
    """
    call("solve", mesh, fronts, x)


def solve_one(mesh: Mesh, fronts: Fronts, x: Array) -> None:
    """``solve`` for one right-hand side, shape (unknowns,)."""
    call("solve_one", mesh, fronts, x)


# The tangent of all unknowns, factored, with its border.
#
#     K x + C z = r,   R^T x + D z = r_z:
#
# K is in the fronts; z are the changes of tension in all ropes and, where a net's strings pull, the
# places of its hub.


class Border(NamedTuple):
    """C and R, shape (unknowns, k) each, and D, (k, k); the hub has the first three if ``strung``.

    k is a whole number of eights: columns of zeros, whose z is zero, fill the last.
    ``hub_inertia``, N/m, is that of a hub that no string pulls: it moves by this alone.  Else nan.
    """

    columns: Array
    rows: Array
    corner: Array
    strung: bool
    hub_inertia: float

    @property
    def first(self) -> int:
        """First column of the ropes."""
        return 3 if self.strung else 0

    @classmethod
    def empty(cls, unknowns: int, factors: int, strung: bool, hub_inertia: float) -> "Border":
        """With room for the hub and so many factors of the ropes."""
        k = EIGHT * math.ceil((factors + 3 * strung) / EIGHT)
        columns, rows = np.zeros((2, unknowns, k))
        return cls(columns, rows, -np.eye(k), strung, hub_inertia)


class Factored:
    """Solves with the tangent; ``sound`` unless a pivot is too small."""

    def __init__(self, mesh: Mesh, fronts: Fronts, border: Border) -> None:
        self._mesh, self._fronts, self._border = mesh, fronts, border
        self.sound = bool(factor(mesh, fronts))
        if self.sound and len(border.corner):
            solve(mesh, fronts, border.columns)
            corner = border.corner - border.rows.T @ border.columns
            # LAPACK itself: around it numpy and scipy spend more than these few dozen rows take.
            # Transposed, so that rows are its columns.
            *self._corner, wrong = dgetrf(corner.T, overwrite_a=True)
            self.sound &= wrong == 0

    def solve(self, g: Array) -> Array:
        """The change of all unknowns, the hub's last, that takes a residual to zero."""
        unknowns, border = self._mesh.unknowns, self._border
        found = -g
        x, hub = found[:unknowns], found[unknowns:]
        solve_one(self._mesh, self._fronts, x)
        if len(border.corner):
            right = -(x @ border.rows)
            if border.strung:
                right[:3] += hub
            z, _ = dgetrs(*self._corner, right, trans=1)
            x -= border.columns @ z
            if border.strung:
                hub[:] = z[:3]
        if not math.isnan(border.hub_inertia):
            hub /= border.hub_inertia
        return np.asarray(found)
