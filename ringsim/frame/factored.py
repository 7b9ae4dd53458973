"""The tangent of all unknowns, factored, with its border.

    K x + C z = r,   R^T x + D z = r_z:

K is in the fronts; z are the changes of tension in all ropes and, where a net's strings pull, the
places of its hub.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ringsim.frame.eights import EIGHT
from ringsim.frame.elimination import Fronts, factor, solve, solve_one
from ringsim.frame.mesh import Mesh
from ringsim.layout.pose import Array


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
