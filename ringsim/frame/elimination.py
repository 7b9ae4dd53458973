"""Solving for all unknowns: fronts, one for each part and each block of bodies.

A front is a small dense matrix.  Its first ``gone`` unknowns occur in no other front that is left,
so they are eliminated there; what that leaves of the others (the Schur complement) is added to the
parent front (the multifrontal method: Duff and Reid, ACM Transactions on Mathematical Software 9,
1983).  Parts come first, then the blocks in their order; a closed ring's fronts carry the last
block along.  The work grows linearly with the sections.
"""

from ringsim.frame.mesh import Mesh
from ringsim.frame.vectors import compiled
from ringsim.layout.pose import Array

LEAST_PIVOT = 1e-9
"""Pivot over the largest entry of its row in the front as assembled.  Elimination without exchange
loses as many digits; Newton renews what they spoil, but not without end."""


@compiled
def factor(mesh: Mesh, fronts: Array) -> bool:
    """Eliminate all fronts, shape (n, most, most), in place; False where a pivot is too small."""
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
            pivot = a[k, k]
            largest = 0.0
            for j in range(k, size):
                largest = max(largest, abs(a[k, j]))
            sound &= abs(pivot) > LEAST_PIVOT * largest
            for i in range(k + 1, size):
                share = a[i, k] / pivot
                a[i, k] = share
                if share != 0.0:
                    for j in range(k + 1, size):
                        a[i, j] -= share * a[k, j]
        if gone < size:
            other = fronts[mesh.parent[number]]
            for i in range(gone, size):
                row = mesh.up[number, i]
                for j in range(gone, size):
                    other[row, mesh.up[number, j]] += a[i, j]
    return sound


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
                x[pivot, c] /= a[k, k]


@compiled
def solve_one(mesh: Mesh, fronts: Array, x: Array) -> None:
    """``solve`` for one right-hand side, shape (unknowns,)."""
    for number in range(len(mesh.gone)):
        a, spots = fronts[number], mesh.spots[number]
        for k in range(mesh.gone[number]):
            value = x[spots[k]]
            for spot in mesh.fixed:
                if spot == spots[k]:
                    x[spot] = value = 0.0
            if value != 0.0:
                for i in range(k + 1, mesh.size[number]):
                    x[spots[i]] -= a[i, k] * value
    for number in range(len(mesh.gone) - 1, -1, -1):
        a, spots = fronts[number], mesh.spots[number]
        for k in range(mesh.gone[number] - 1, -1, -1):
            value = x[spots[k]]
            for j in range(k + 1, mesh.size[number]):
                value -= a[k, j] * x[spots[j]]
            x[spots[k]] = value / a[k, k]
