"""Solving for all unknowns: fronts, one for each part and each block of bodies.

A front is a small dense matrix.  Its first ``gone`` unknowns occur in no other front that is left,
so they are eliminated there; what that leaves of the others (the Schur complement) is added to the
parent front (the multifrontal method: Duff and Reid, ACM Transactions on Mathematical Software 9,
1983).  Parts come first, then the blocks in their order; a closed ring's fronts carry the last
block along.  The work grows linearly with the sections.
"""

import numpy as np

from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import Indices
from ringsim.frame.vectors import compiled
from ringsim.layout.pose import Array

LEAST_PIVOT = 1e-9
"""Pivot over the sum of its row's entries when its turn comes.  Elimination without exchange loses
as many digits; Newton renews what they spoil, but not without end."""


@compiled
def factor(mesh: Mesh, fronts: Array) -> bool:
    """Eliminate all fronts, shape (n, most, most), in place, with inverse pivots; False where a
    pivot is too small.
    """
    sound = True
    for number in range(len(mesh.gone)):
        a, gone, size = fronts[number], mesh.gone[number], mesh.size[number]
        for spot in mesh.fixed:
            for k in range(gone):
                if mesh.spots[number, k] == spot:
                    a[k, :size] = 0.0
                    a[:size, k] = 0.0
                    a[k, k] = 1.0
        for k in range(gone):
            total = 0.0
            for j in range(k, size):
                total += abs(a[k, j])
            sound &= abs(a[k, k]) > LEAST_PIVOT * total
            inverse = 1.0 / a[k, k]
            a[k, k] = inverse
            for i in range(k + 1, gone):
                share = a[i, k] * inverse
                a[i, k] = share
                for j in range(k + 1, size):
                    a[i, j] -= share * a[k, j]
        if gone < size:
            _reduce(a, gone, size, mesh.up[number], fronts[mesh.parent[number]])
    return sound


@compiled
def _reduce(a: Array, gone: int, size: int, up: Indices, parent: Array) -> None:
    """Eliminate the rows of a front that stay, and add them to its parent."""
    fours = gone - gone % 4
    for i in range(gone, size):
        for k in range(gone):
            share = a[i, k] * a[k, k]
            a[i, k] = share
            for j in range(k + 1, gone):
                a[i, j] -= share * a[k, j]
        # Four pivots at once: the row is read and written a quarter as often.
        for k in range(0, fours, 4):
            p, q, r, s = a[i, k], a[i, k + 1], a[i, k + 2], a[i, k + 3]
            for j in range(gone, size):
                a[i, j] -= p * a[k, j] + q * a[k + 1, j] + r * a[k + 2, j] + s * a[k + 3, j]
        for k in range(fours, gone):
            share = a[i, k]
            for j in range(gone, size):
                a[i, j] -= share * a[k, j]
        row = up[i]
        for j in range(gone, size):
            parent[row, up[j]] += a[i, j]


@compiled
def solve(mesh: Mesh, fronts: Array, x: Array) -> None:
    """Replace right-hand sides ``x``, shape (unknowns, n), by solutions with factored fronts."""
    columns = x.shape[1]
    for number in range(len(mesh.gone)):
        a, spots = fronts[number], mesh.spots[number]
        for k in range(mesh.gone[number]):
            pivot = spots[k]
            for spot in mesh.fixed:
                if spot == pivot:
                    x[pivot] = 0.0
            for i in range(k + 1, mesh.size[number]):
                share, row = a[i, k], spots[i]
                if share != 0.0:
                    for c in range(columns):
                        x[row, c] -= share * x[pivot, c]
    for number in range(len(mesh.gone) - 1, -1, -1):
        a, spots = fronts[number], mesh.spots[number]
        for k in range(mesh.gone[number] - 1, -1, -1):
            pivot = spots[k]
            for j in range(k + 1, mesh.size[number]):
                share, row = a[k, j], spots[j]
                if share != 0.0:
                    for c in range(columns):
                        x[pivot, c] -= share * x[row, c]
            for c in range(columns):
                x[pivot, c] *= a[k, k]


@compiled
def solve_one(mesh: Mesh, fronts: Array, x: Array) -> None:
    """``solve`` for one right-hand side, shape (unknowns,): by rows, which lie together."""
    y = np.empty(fronts.shape[1])
    for number in range(len(mesh.gone)):
        a, spots, gone = fronts[number], mesh.spots[number], mesh.gone[number]
        for i in range(gone):
            known = 0.0
            for k in range(i):
                known += a[i, k] * y[k]
            y[i] = x[spots[i]] - known
            for spot in mesh.fixed:
                if spot == spots[i]:
                    y[i] = 0.0
            x[spots[i]] = y[i]
        for i in range(gone, mesh.size[number]):
            known = 0.0
            for k in range(gone):
                known += a[i, k] * y[k]
            x[spots[i]] -= known
    for number in range(len(mesh.gone) - 1, -1, -1):
        a, spots, gone = fronts[number], mesh.spots[number], mesh.gone[number]
        size = mesh.size[number]
        for k in range(gone, size):
            y[k] = x[spots[k]]
        for k in range(gone - 1, -1, -1):
            known = 0.0
            for j in range(k + 1, size):
                known += a[k, j] * y[j]
            y[k] = (x[spots[k]] - known) * a[k, k]
            x[spots[k]] = y[k]
