"""Eight numbers of a row at a time, as tuples: one register of a modern processor, or two.

numba turns tuples into separate numbers, and the SLP pass of the compiler (``packed``) packs them.
Loops over rows of a dozen numbers would be too short for its loop pass: most of their time goes to
what is left beside whole registers.
"""

from typing import TypeAlias

from ringsim.frame.vectors import packed, unsigned
from ringsim.layout.pose import Array

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
