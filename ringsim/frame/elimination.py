"""Solving for all unknowns: fronts, one for each part and each block of bodies.

A front is a small dense matrix.  Its first ``gone`` unknowns occur in no other front that is left,
so they are eliminated there; what that leaves of the others (the Schur complement) is added to the
parent front (the multifrontal method: Duff and Reid, ACM Transactions on Mathematical Software 9,
1983).  Parts come first, then the blocks in their order; a closed ring's fronts carry the last
block along.  The work grows linearly with the sections.

With the unknowns that go first, a front [A B; C D] becomes [. B; C A^-1 .] and an inverse A^-1 of
its own: what is left of triangular factors would be too small for whole registers.
"""

import math
from typing import NamedTuple

import numpy as np

from ringsim.frame.eights import EIGHT, NONE, dot, less, load, product, size_of, store, total
from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import MOST_GONE, Indices
from ringsim.frame.vectors import compiled, unsigned
from ringsim.layout.pose import Array

LEAST_PIVOT = 1e-9
"""Pivot over the sum of its row's entries in the front.  Elimination without exchange loses as many
digits; Newton renews what they spoil, but not without end."""
_WIDE = 3 * EIGHT
"""Columns at a time of what a front leaves: as many as two neighbouring blocks have."""


class Fronts(NamedTuple):
    """Matrices, shape (n, rows, columns), with zeros behind the last column, and inverses, shape
    (n, MOST_GONE, MOST_GONE).
    """

    whole: Array
    inverse: Array

    @classmethod
    def empty(cls, mesh: Mesh) -> "Fronts":
        """Those of a mesh."""
        n, most = mesh.spots.shape
        # As far as whole eights, or what is read at a time, reach beyond the last column.
        reach = mesh.gone + _WIDE * np.ceil((mesh.size - mesh.gone) / _WIDE).astype(int)
        columns = max(most, MOST_GONE, int(reach.max()))
        columns = EIGHT * math.ceil(columns / EIGHT)
        return cls(np.zeros((n, most, columns)), np.zeros((n, MOST_GONE, MOST_GONE)))


@compiled
def factor(mesh: Mesh, fronts: Fronts) -> bool:
    """Eliminate all fronts, in place; False where a pivot is too small."""
    sound, buffer, units = True, np.zeros(MOST_GONE + _WIDE), np.eye(MOST_GONE)
    others = 1.0 - units
    for number in range(len(mesh.gone)):
        a, inverse = fronts.whole[number], fronts.inverse[number]
        gone, size = unsigned(mesh.gone[number]), unsigned(mesh.size[number])
        for spot in mesh.fixed:
            for k in range(gone):
                if mesh.spots[number, k] == spot:
                    a[k, :size] = 0.0
                    a[:size, k] = 0.0
                    a[k, k] = 1.0
        sound &= _invert(a, gone, size, units, others, buffer, inverse)
        if gone < size:
            parent = fronts.whole[mesh.parent[number]]
            _reduce(a, gone, size, inverse, mesh.up[number], buffer, parent)
    return sound


@compiled
def _invert(
    a: Array, gone: int, size: int, units: Array, others: Array, column: Array, out: Array
) -> bool:
    """Invert the part of a front that goes (Gauss and Jordan); False if a pivot is too small."""
    sound = True
    for i in range(gone):
        store(out[i], 0, load(a[i], 0))
        store(out[i], EIGHT, load(a[i], EIGHT))
    for k in range(gone):
        sums = NONE
        for j in range(unsigned(0), size, unsigned(EIGHT)):
            sums = less(sums, -1.0, size_of(load(a[k], j)))
        pivot = out[k, k]
        sound &= abs(pivot) > LEAST_PIVOT * total(sums)
        for i in range(gone):
            column[i] = out[i, k]
        column[k] = 0.0
        for first in range(unsigned(0), unsigned(MOST_GONE), unsigned(EIGHT)):
            # No single number is put into a row: loading all eight would wait for it.
            other, unit = load(others[k], first), load(units[k], first)
            own = less(unit, -1.0, product(load(out[k], first), other))
            own = less(NONE, -1.0 / pivot, own)
            for i in range(gone):
                store(out[i], first, less(product(load(out[i], first), other), column[i], own))
            store(out[k], first, own)
    return sound


@compiled
def _reduce(
    a: Array, gone: int, size: int, inverse: Array, up: Indices, buffer: Array, parent: Array
) -> None:
    """Eliminate the rows of a front that stay, and add them to its parent."""
    share, left = buffer[:MOST_GONE], buffer[MOST_GONE:]
    for i in range(gone, size):
        row, to = a[i], parent[up[i]]
        low, high = NONE, NONE
        for k in range(gone):
            low = less(low, -row[k], load(inverse[k], 0))
            high = less(high, -row[k], load(inverse[k], EIGHT))
        store(share, 0, low)
        store(share, EIGHT, high)
        for first in range(gone, size, unsigned(_WIDE)):
            x, y = load(row, first), load(row, first + unsigned(EIGHT))
            z = load(row, first + unsigned(2 * EIGHT))
            if size - first > unsigned(2 * EIGHT):
                for k in range(gone):
                    x = less(x, share[k], load(a[k], first))
                    y = less(y, share[k], load(a[k], first + unsigned(EIGHT)))
                    z = less(z, share[k], load(a[k], first + unsigned(2 * EIGHT)))
            else:
                for k in range(gone):
                    x = less(x, share[k], load(a[k], first))
                    y = less(y, share[k], load(a[k], first + unsigned(EIGHT)))
            store(left, 0, x)
            store(left, EIGHT, y)
            store(left, 2 * EIGHT, z)
            for j in range(min(size - first, unsigned(_WIDE))):
                to[up[first + j]] += left[j]
        store(row, 0, low)
        store(row, EIGHT, high)


@compiled
def solve(mesh: Mesh, fronts: Fronts, x: Array) -> None:
    """Replace right-hand sides ``x``, shape (unknowns, a multiple of EIGHT), by solutions with
    factored fronts.
    """
    most = fronts.whole.shape[1]
    b, known = np.zeros((most, EIGHT)), np.zeros((MOST_GONE, EIGHT))
    one, eight = unsigned(1), unsigned(EIGHT)
    for column in range(unsigned(0), unsigned(x.shape[1]), eight):
        for number in range(len(mesh.gone)):
            a, spots = fronts.whole[number], mesh.spots[number]
            gone, size = unsigned(mesh.gone[number]), unsigned(mesh.size[number])
            for spot in mesh.fixed:
                store(x[spot], column, NONE)
            for k in range(gone):
                store(b[k], 0, load(x[spots[k]], column))
            # Two rows at once: a sum waits for the one before.  An odd last row is its own twin.
            for i in range(gone, size, unsigned(2)):
                twin = min(i + one, size - one)
                p, q = load(x[spots[i]], column), load(x[spots[twin]], column)
                for k in range(gone):
                    y = load(b[k], 0)
                    p, q = less(p, a[i, k], y), less(q, a[twin, k], y)
                store(x[spots[i]], column, p)
                store(x[spots[twin]], column, q)
        for number in range(len(mesh.gone) - 1, -1, -1):
            a, spots, inverse = fronts.whole[number], mesh.spots[number], fronts.inverse[number]
            gone, size = unsigned(mesh.gone[number]), unsigned(mesh.size[number])
            for k in range(size):
                store(b[k], 0, load(x[spots[k]], column))
            for i in range(unsigned(0), gone, unsigned(2)):
                twin = min(i + one, gone - one)
                p, q = load(b[i], 0), load(b[twin], 0)
                for k in range(gone, size):
                    y = load(b[k], 0)
                    p, q = less(p, a[i, k], y), less(q, a[twin, k], y)
                store(known[i], 0, p)
                store(known[twin], 0, q)
            for i in range(unsigned(0), gone, unsigned(2)):
                twin = min(i + one, gone - one)
                p, q = NONE, NONE
                for k in range(gone):
                    y = load(known[k], 0)
                    p, q = less(p, -inverse[i, k], y), less(q, -inverse[twin, k], y)
                store(x[spots[i]], column, p)
                store(x[spots[twin]], column, q)


@compiled
def solve_one(mesh: Mesh, fronts: Fronts, x: Array) -> None:
    """``solve`` for one right-hand side, shape (unknowns,)."""
    most = fronts.whole.shape[1]
    b, known = np.zeros(most + EIGHT), np.zeros(MOST_GONE)
    for number in range(len(mesh.gone)):
        a, spots = fronts.whole[number], mesh.spots[number]
        gone, size = unsigned(mesh.gone[number]), unsigned(mesh.size[number])
        for spot in mesh.fixed:
            x[spot] = 0.0
        known[:] = 0.0
        for k in range(gone):
            known[k] = x[spots[k]]
        for i in range(gone, size):
            x[spots[i]] -= dot(a[i], 0, known, gone)
    for number in range(len(mesh.gone) - 1, -1, -1):
        a, spots, inverse = fronts.whole[number], mesh.spots[number], fronts.inverse[number]
        gone, size = unsigned(mesh.gone[number]), unsigned(mesh.size[number])
        for k in range(gone, size):
            b[k - gone] = x[spots[k]]
        b[size - gone : size - gone + unsigned(EIGHT)] = 0.0
        known[gone:] = 0.0
        for i in range(gone):
            known[i] = x[spots[i]] - dot(a[i], gone, b, size - gone)
        for i in range(gone):
            x[spots[i]] = dot(inverse[i], 0, known, gone)
