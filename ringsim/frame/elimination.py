"""The tangent of all unknowns, eliminated section by section, with the border of the ropes."""

import math
from typing import NamedTuple

import numpy as np

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
PANEL = 2 * EIGHT
WIDE = 3 * EIGHT
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
                (number, first, min(PANEL, gone - first))
                for number, gone in enumerate(mesh.gone.tolist())
                for first in range(0, gone, PANEL)
            ]
        )
        front, first, gone = panels.T
        # As far as what is read at a time reaches beyond the last column.
        kept = mesh.size[front] - first - gone
        reach = first + np.maximum(gone + WIDE * np.ceil(kept / WIDE), PANEL).astype(int)
        n, most = mesh.spots.shape
        columns = EIGHT * math.ceil(max(most, int(reach.max())) / EIGHT)
        inverse = np.zeros((len(panels), PANEL, PANEL))
        return cls(np.zeros((n, most, columns)), panels, inverse, columns)


# The border of the fronts (newton.c): changes of tension in all ropes and places of a net's hub.


class Border(NamedTuple):
    """Room for columns of the border, shape (unknowns * k,), for rows of a hub, (3 * unknowns,),
    for how the ropes' points move with each column, (3 * points * k,), and for its own block,
    (k * k,), factored with pivots, (k,); what is in use: its number of columns, whether strings
    pull at the hub, factors of the ropes, and columns of the hub, the first ones, (4,).

    k is a whole number of eights: columns of zeros, whose unknowns are zero, fill the last.
    ``alone``, N/m, shape (1,), is the inertia of a hub that no string pulls: it moves by this
    alone.  Else nan.
    """

    columns: Array
    hub: Array
    moved: Array
    corner: Array
    alone: Array
    pivots: Indices
    used: Indices

    @classmethod
    def empty(cls, unknowns: int, factors: int, points: int, hub: bool) -> "Border":
        """With room for so many factors of ropes over so many points, and for a hub."""
        k = EIGHT * math.ceil((factors + 3 * hub) / EIGHT)
        columns, rows, moved = unknowns * k, 3 * unknowns * hub, 3 * points * k
        return cls(
            np.zeros(columns), np.zeros(rows), np.zeros(moved), np.zeros(k * k), np.full(1, np.nan),
            np.zeros(k, dtype=np.int64), np.zeros(4, dtype=np.int64),
        )  # fmt: skip
