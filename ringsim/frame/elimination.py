"""The tangent of all unknowns, eliminated section by section, with the border of the ropes."""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ringsim.compiled.vectors import packed, unsigned
from ringsim.frame.mesh import Indices, Mesh
from ringsim.layout.bodies import Array

# Eight numbers of a row at a time, as tuples: one register of a modern processor, or two.
#
# numba turns tuples into separate numbers, and the SLP pass of the compiler (``packed``) packs
# them. Loops over rows of a dozen numbers would be too short for its loop pass: most of their time
# goes to what is left beside whole registers.


EIGHT = 8
Eight: TypeAlias = tuple[float, float, float, float, float, float, float, float]
NONE: Eight = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@packed
def take_eight(row: Array, first: int) -> Eight:
    """Eight numbers of a row."""
    k = unsigned(first)
    return (
        row[k], row[k + unsigned(1)], row[k + unsigned(2)], row[k + unsigned(3)],
        row[k + unsigned(4)], row[k + unsigned(5)], row[k + unsigned(6)], row[k + unsigned(7)],
    )  # fmt: skip


@packed
def put_eight(row: Array, first: int, x: Eight) -> None:
    """Put eight numbers into a row."""
    k = unsigned(first)
    row[k], row[k + unsigned(1)], row[k + unsigned(2)] = x[0], x[1], x[2]
    row[k + unsigned(3)], row[k + unsigned(4)], row[k + unsigned(5)] = x[3], x[4], x[5]
    row[k + unsigned(6)], row[k + unsigned(7)] = x[6], x[7]


@packed
def less(x: Eight, share: float, y: Eight) -> Eight:
    """X - share y."""
    return (
        x[0] - share * y[0], x[1] - share * y[1], x[2] - share * y[2], x[3] - share * y[3],
        x[4] - share * y[4], x[5] - share * y[5], x[6] - share * y[6], x[7] - share * y[7],
    )  # fmt: skip


@packed
def product(x: Eight, y: Eight) -> Eight:
    """Of each two numbers."""
    return (
        x[0] * y[0], x[1] * y[1], x[2] * y[2], x[3] * y[3],
        x[4] * y[4], x[5] * y[5], x[6] * y[6], x[7] * y[7],
    )  # fmt: skip


@packed
def size_of(x: Eight) -> Eight:
    """Of each number."""
    return (
        abs(x[0]), abs(x[1]), abs(x[2]), abs(x[3]), abs(x[4]), abs(x[5]), abs(x[6]), abs(x[7])
    )  # fmt: skip


@packed
def total(x: Eight) -> float:
    """Of all eight."""
    return ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]))


@packed
def row_dot(row: Array, first: int, y: Array, n: int) -> float:
    """Of n numbers of a row with those of y, which has zeros behind them up to whole eights."""
    found = NONE
    for k in range(unsigned(0), unsigned(n), unsigned(EIGHT)):
        found = less(found, -1.0, product(take_eight(row, unsigned(first) + k), take_eight(y, k)))
    return total(found)


# Solving for all unknowns: fronts, one for each part and each block of bodies.
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


LEAST_PIVOT = 1e-9
"""Pivot over the sum of its row's entries in the front.  Elimination without exchange loses as many
digits; Newton renews what they spoil, but not without end."""
_PANEL = 2 * EIGHT
_WIDE = 3 * EIGHT
"""Columns at a time of what a panel leaves: as many as two neighbouring blocks have."""


class Fronts(NamedTuple):
    """Matrices, shape (n, rows, columns), with room behind the last column for whole eights, whose
    numbers mean nothing; panels, (m, 3): front, first unknown there and number of unknowns; their
    inverses, (m, 16, 16).
    """

    whole: Array
    panels: Indices
    inverse: Array

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
        return cls(np.zeros((n, most, columns)), panels, inverse)


@packed
def factor(mesh: Mesh, fronts: Fronts) -> bool:
    """Eliminate all fronts, in place; False where a pivot is too small."""
    sound, buffer, units = True, np.zeros(_PANEL + _WIDE), np.eye(_PANEL)
    others = 1.0 - units
    for panel in range(len(fronts.panels)):
        number, first, count = fronts.panels[panel]
        a, inverse = fronts.whole[number], fronts.inverse[panel]
        begin, end, size = unsigned(first), unsigned(first + count), unsigned(mesh.size[number])
        for spot in mesh.fixed:
            for k in range(begin, end):
                if mesh.spots[number, k] == spot:
                    a[k, begin:size] = 0.0
                    a[begin:size, k] = 0.0
                    a[k, k] = 1.0
        sound &= _invert(a, begin, end, size, units, others, buffer, inverse)
        if end < size:
            last = first + count == mesh.gone[number]
            parent = fronts.whole[mesh.parent[number]] if last else a
            _reduce(a, begin, end, size, inverse, mesh.up[number], buffer, parent, last)
    return sound


@packed
def _invert(
    a: Array, begin: int, end: int, size: int, units: Array, others: Array, column: Array,
    out: Array,
) -> bool:  # fmt: skip
    """Invert a panel's own block (Gauss and Jordan); False if a pivot is too small."""
    sound, gone = True, end - begin
    for i in range(gone):
        put_eight(out[i], 0, take_eight(a[begin + i], begin))
        put_eight(out[i], EIGHT, take_eight(a[begin + i], begin + unsigned(EIGHT)))
    for k in range(gone):
        sums = NONE
        for j in range(begin, size, unsigned(EIGHT)):
            sums = less(sums, -1.0, size_of(take_eight(a[begin + k], j)))
        pivot = out[k, k]
        sound &= abs(pivot) > LEAST_PIVOT * total(sums)
        for i in range(gone):
            column[i] = out[i, k]
        column[k] = 0.0
        for first in range(unsigned(0), unsigned(_PANEL), unsigned(EIGHT)):
            # No single number is put into a row: loading all eight would wait for it.
            other, unit = take_eight(others[k], first), take_eight(units[k], first)
            own = less(unit, -1.0, product(take_eight(out[k], first), other))
            own = less(NONE, -1.0 / pivot, own)
            for i in range(gone):
                put_eight(
                    out[i], first, less(product(take_eight(out[i], first), other), column[i], own)
                )
            put_eight(out[k], first, own)
    return sound


@packed
def _reduce(
    a: Array, begin: int, end: int, size: int, inverse: Array, up: Indices, buffer: Array,
    parent: Array, last: bool,
) -> None:  # fmt: skip
    """Eliminate the rows of a front that stay; those of its last panel are added to its parent."""
    share, left, gone = buffer[:_PANEL], buffer[_PANEL:], end - begin
    eight, twice = unsigned(EIGHT), unsigned(2 * EIGHT)
    for i in range(end, size):
        row, to = a[i], parent[unsigned(up[i]) if last else i]
        low, high = NONE, NONE
        for k in range(gone):
            low = less(low, -row[begin + k], take_eight(inverse[k], 0))
            high = less(high, -row[begin + k], take_eight(inverse[k], EIGHT))
        put_eight(share, 0, low)
        put_eight(share, EIGHT, high)
        for first in range(end, size, unsigned(_WIDE)):
            x, y, z = (
                take_eight(row, first),
                take_eight(row, first + eight),
                take_eight(row, first + twice),
            )
            if size - first > twice:
                for k in range(gone):
                    x = less(x, share[k], take_eight(a[begin + k], first))
                    y = less(y, share[k], take_eight(a[begin + k], first + eight))
                    z = less(z, share[k], take_eight(a[begin + k], first + twice))
            else:
                for k in range(gone):
                    x = less(x, share[k], take_eight(a[begin + k], first))
                    y = less(y, share[k], take_eight(a[begin + k], first + eight))
            put_eight(left, 0, x)
            put_eight(left, EIGHT, y)
            put_eight(left, 2 * EIGHT, z)
            count = min(size - first, unsigned(_WIDE))
            if last:
                for j in range(count):
                    to[up[first + j]] += left[j]
            else:
                for j in range(count):
                    to[first + j] = left[j]
        # The last panel of a front is read no more behind its own columns, others fill both eights.
        put_eight(row, begin, low)
        put_eight(row, begin + eight, high)


@packed
def solve(mesh: Mesh, fronts: Fronts, x: Array) -> None:
    """Replace right-hand sides ``x``, shape (unknowns, a multiple of EIGHT), by solutions with
    factored fronts.
    """
    panels = len(fronts.panels)
    b, known = np.zeros((fronts.whole.shape[1], EIGHT)), np.zeros((_PANEL, EIGHT))
    one, two = unsigned(1), unsigned(2)
    for column in range(unsigned(0), unsigned(x.shape[1]), unsigned(EIGHT)):
        for panel in range(panels):
            number, first, count = fronts.panels[panel]
            a, spots = fronts.whole[number], mesh.spots[number]
            begin, end, size = unsigned(first), unsigned(first + count), unsigned(mesh.size[number])
            for spot in mesh.fixed:
                put_eight(x[spot], column, NONE)
            for k in range(begin, end):
                put_eight(b[k], 0, take_eight(x[spots[k]], column))
            # Two rows at once: a sum waits for the one before.  An odd last row is its own twin.
            for i in range(end, size, two):
                twin = min(i + one, size - one)
                p, q = take_eight(x[spots[i]], column), take_eight(x[spots[twin]], column)
                for k in range(begin, end):
                    y = take_eight(b[k], 0)
                    p, q = less(p, a[i, k], y), less(q, a[twin, k], y)
                put_eight(x[spots[i]], column, p)
                put_eight(x[spots[twin]], column, q)
        for panel in range(panels - 1, -1, -1):
            number, first, count = fronts.panels[panel]
            a, spots, inverse = fronts.whole[number], mesh.spots[number], fronts.inverse[panel]
            begin, end, size = unsigned(first), unsigned(first + count), unsigned(mesh.size[number])
            gone = unsigned(count)
            for k in range(begin, size):
                put_eight(b[k], 0, take_eight(x[spots[k]], column))
            for i in range(unsigned(0), gone, two):
                twin = min(i + one, gone - one)
                p, q = take_eight(b[begin + i], 0), take_eight(b[begin + twin], 0)
                for k in range(end, size):
                    y = take_eight(b[k], 0)
                    p, q = less(p, a[begin + i, k], y), less(q, a[begin + twin, k], y)
                put_eight(known[i], 0, p)
                put_eight(known[twin], 0, q)
            for i in range(unsigned(0), gone, two):
                twin = min(i + one, gone - one)
                p, q = NONE, NONE
                for k in range(gone):
                    y = take_eight(known[k], 0)
                    p, q = less(p, -inverse[i, k], y), less(q, -inverse[twin, k], y)
                put_eight(x[spots[begin + i]], column, p)
                put_eight(x[spots[begin + twin]], column, q)


@packed
def solve_one(mesh: Mesh, fronts: Fronts, x: Array) -> None:
    """``solve`` for one right-hand side, shape (unknowns,)."""
    panels = len(fronts.panels)
    b, known = np.zeros(fronts.whole.shape[1] + EIGHT), np.zeros(_PANEL)
    for panel in range(panels):
        number, first, count = fronts.panels[panel]
        a, spots = fronts.whole[number], mesh.spots[number]
        for spot in mesh.fixed:
            x[spot] = 0.0
        known[:] = 0.0
        for k in range(count):
            known[k] = x[spots[first + k]]
        for i in range(first + count, mesh.size[number]):
            x[spots[i]] -= row_dot(a[i], first, known, count)
    for panel in range(panels - 1, -1, -1):
        number, first, count = fronts.panels[panel]
        a, spots, inverse = fronts.whole[number], mesh.spots[number], fronts.inverse[panel]
        end, kept = first + count, mesh.size[number] - first - count
        for k in range(kept):
            b[k] = x[spots[end + k]]
        b[kept : kept + EIGHT] = 0.0
        known[count:] = 0.0
        for i in range(count):
            known[i] = x[spots[first + i]] - row_dot(a[first + i], end, b, kept)
        for i in range(count):
            x[spots[first + i]] = row_dot(inverse[i], 0, known, count)


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
