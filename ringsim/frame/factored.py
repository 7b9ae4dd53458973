"""The tangent of all unknowns, factored, with its border.

    K x + C z = r,   R^T x + D z = r_z:

K is in the fronts; z are the changes of tension in all ropes and, where a net's strings pull, the
places of its hub.
"""

import math
from typing import NamedTuple

import numpy as np

from ringsim.frame.elimination import factor, solve, solve_one
from ringsim.frame.mesh import Mesh
from ringsim.layout.pose import Array


class Border(NamedTuple):
    """C and R, shape (unknowns, k) each, and D, (k, k); the hub has the last three if ``strung``.

    ``hub_inertia``, N/m, is that of a hub that no string pulls: it moves by this alone.  Else nan.
    """

    columns: Array
    rows: Array
    corner: Array
    strung: bool
    hub_inertia: float


class Factored:
    """Solves with the tangent; ``sound`` unless a pivot is too small."""

    def __init__(self, mesh: Mesh, fronts: Array, border: Border) -> None:
        self._mesh, self._fronts, self._border = mesh, fronts, border
        self.sound = bool(factor(mesh, fronts))
        if len(border.corner):
            solve(mesh, fronts, border.columns)
            corner = border.corner - border.rows.T @ border.columns
            # Its few dozen rows and columns are solved with once an iteration.
            self._corner = np.linalg.inv(corner) if self.sound else corner

    def solve(self, g: Array) -> Array:
        """The change of all unknowns, the hub's last, that takes a residual to zero."""
        unknowns, border = self._mesh.unknowns, self._border
        found = -g
        x, hub = found[:unknowns], found[unknowns:]
        solve_one(self._mesh, self._fronts, x)
        if len(border.corner):
            right = -(x @ border.rows)
            if border.strung:
                right[-3:] += hub
            z = self._corner @ right
            x -= border.columns @ z
            if border.strung:
                hub[:] = z[-3:]
        if not math.isnan(border.hub_inertia):
            hub /= border.hub_inertia
        return np.asarray(found)
