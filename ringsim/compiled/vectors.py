"""Vectors (3 numbers) and matrices (9, row by row) as tuples, which compiled code keeps in
registers.
"""

import math
from collections.abc import Callable
from typing import Any, TypeAlias, TypeVar, cast

import numpy as np
from numba import config, njit
from numba.core.errors import NumbaError

from ringsim.compile_cache import alone, packs, tell_damage
from ringsim.layout.bodies import Array
from ringsim.refusal import InputError

Vector: TypeAlias = tuple[float, float, float]
Matrix: TypeAlias = tuple[float, float, float, float, float, float, float, float, float]

_Function = TypeVar("_Function", bound=Callable[..., Any])
_SERIES = 0.05
"""Angle (rad) below which series stand for sines and arcs, at a third of their cost: what they
leave out is below 1e-16."""


def compiled(function: _Function) -> _Function:
    """Compile a function, once a machine; its divisions by zero give infinity, as numpy's.

    Sums keep their order: with sums in any order, code that a process has compiled and code that it
    has loaded need not round alike, and samples would depend on who ran them.
    """
    return cast(_Function, _mending(njit(cache=True, error_model="numpy")(function)))


def _mending(made: Any) -> Any:
    """A compiled function that throws away what it cannot read of its stored code, and goes on."""
    compiling = made.compile

    def compile_or_mend(signature: Any) -> Any:
        try:
            return compiling(signature)
        except (NumbaError, InputError):
            raise  # of the function itself
        except Exception:  # a damaged file raises nearly anything when it is unpickled
            with alone():
                tell_damage(made.stats.cache_path)
                made._cache.flush()
                return compiling(signature)

    made.compile = compile_or_mend
    return made


def packed(function: _Function) -> _Function:
    """As ``compiled``, with the pass of LLVM that packs neighbouring numbers into registers (SLP).

    numba leaves it out since it once compiled wrongly (numba issue 8705), so that it is for the
    fronts alone, whose solutions tests compare with numpy's and, bit by bit, with those without it.
    What is compiled elsewhere in the process does not see it.
    """
    made = _mending(njit(cache=True, error_model="numpy")(function))
    compiling = made.compile

    def compile_packed(signature: Any) -> Any:
        before, config.SLP_VECTORIZE = config.SLP_VECTORIZE, int(packs())
        try:
            return compiling(signature)
        finally:
            config.SLP_VECTORIZE = before

    made.compile = compile_packed
    return cast(_Function, made)


@compiled
def unsigned(k: Any) -> Any:
    """A place or a count without sign: of others numba asks each time whether they count from the
    end, which keeps neighbouring numbers out of one register.
    """
    return np.uintp(k)


@compiled
def vector(a: Any) -> Vector:
    """Three numbers of an array."""
    return (a[0], a[1], a[2])


@compiled
def matrix(a: Any) -> Matrix:
    """Nine numbers of an array, shape (3, 3)."""
    return (a[0, 0], a[0, 1], a[0, 2], a[1, 0], a[1, 1], a[1, 2], a[2, 0], a[2, 1], a[2, 2])


@compiled
def plus(a: Vector, b: Vector) -> Vector:
    """A + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@compiled
def minus(a: Vector, b: Vector) -> Vector:
    """A - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@compiled
def times(s: float, a: Vector) -> Vector:
    """S a."""
    return (s * a[0], s * a[1], s * a[2])


@compiled
def dot(a: Vector, b: Vector) -> float:
    """A . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a: Vector, b: Vector) -> Vector:
    """A x b."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@compiled
def turn(m: Matrix, a: Vector) -> Vector:
    """M a."""
    return (
        m[0] * a[0] + m[1] * a[1] + m[2] * a[2],
        m[3] * a[0] + m[4] * a[1] + m[5] * a[2],
        m[6] * a[0] + m[7] * a[1] + m[8] * a[2],
    )


@compiled
def turn_back(m: Matrix, a: Vector) -> Vector:
    """M^T a."""
    return (
        m[0] * a[0] + m[3] * a[1] + m[6] * a[2],
        m[1] * a[0] + m[4] * a[1] + m[7] * a[2],
        m[2] * a[0] + m[5] * a[1] + m[8] * a[2],
    )


@compiled
def mul(a: Matrix, b: Matrix) -> Matrix:
    """A B."""
    return (
        a[0] * b[0] + a[1] * b[3] + a[2] * b[6],
        a[0] * b[1] + a[1] * b[4] + a[2] * b[7],
        a[0] * b[2] + a[1] * b[5] + a[2] * b[8],
        a[3] * b[0] + a[4] * b[3] + a[5] * b[6],
        a[3] * b[1] + a[4] * b[4] + a[5] * b[7],
        a[3] * b[2] + a[4] * b[5] + a[5] * b[8],
        a[6] * b[0] + a[7] * b[3] + a[8] * b[6],
        a[6] * b[1] + a[7] * b[4] + a[8] * b[7],
        a[6] * b[2] + a[7] * b[5] + a[8] * b[8],
    )


@compiled
def add(a: Matrix, b: Matrix) -> Matrix:
    """A + B."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3], a[4] + b[4], a[5] + b[5],
            a[6] + b[6], a[7] + b[7], a[8] + b[8])  # fmt: skip


@compiled
def scale(s: float, a: Matrix) -> Matrix:
    """S A."""
    return (s * a[0], s * a[1], s * a[2], s * a[3], s * a[4], s * a[5],
            s * a[6], s * a[7], s * a[8])  # fmt: skip


@compiled
def transposed(a: Matrix) -> Matrix:
    """A^T."""
    return (a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8])


@compiled
def skew(a: Vector) -> Matrix:
    """[a], with [a] b = a x b."""
    return (0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0)


@compiled
def across(a: Vector, m: Matrix) -> Matrix:
    """[a] M."""
    return (
        a[1] * m[6] - a[2] * m[3], a[1] * m[7] - a[2] * m[4], a[1] * m[8] - a[2] * m[5],
        a[2] * m[0] - a[0] * m[6], a[2] * m[1] - a[0] * m[7], a[2] * m[2] - a[0] * m[8],
        a[0] * m[3] - a[1] * m[0], a[0] * m[4] - a[1] * m[1], a[0] * m[5] - a[1] * m[2],
    )  # fmt: skip


@compiled
def turned(a: Vector) -> Matrix:
    """The matrix of a rotation vector, by Rodrigues' formula."""
    square = dot(a, a)
    if square < _SERIES * _SERIES:
        s = 1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))
        c = 0.5 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)))
    else:
        angle = math.sqrt(square)
        half = math.sin(0.5 * angle) / angle
        s, c = math.sin(angle) / angle, 2.0 * half * half
    x, y, z = a
    return (
        1.0 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y,
        c * x * y + s * z, 1.0 - c * (x * x + z * z), c * y * z - s * x,
        c * x * z - s * y, c * y * z + s * x, 1.0 - c * (x * x + y * y),
    )  # fmt: skip


@compiled
def turned_about_z(angle: float) -> Matrix:
    """The matrix of a turn about z."""
    c, s = math.cos(angle), math.sin(angle)
    return (c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)


@compiled
def rotation_vector(m: Matrix) -> Vector:
    """The rotation vector of a matrix, for angles below pi."""
    a = (0.5 * (m[7] - m[5]), 0.5 * (m[2] - m[6]), 0.5 * (m[3] - m[1]))
    square = dot(a, a)
    cosine = 0.5 * (m[0] + m[4] + m[8] - 1.0)
    if square < _SERIES * _SERIES and cosine > 0.0:
        tail = 0.45 + square * (15.0 / 56.0 + square * (105.0 / 576.0 + square * 945.0 / 7040.0))
        factor = 1.0 + square / 6.0 * (1.0 + square * tail)
    else:
        sine = math.sqrt(square)
        factor = math.atan2(sine, cosine) / sine
    return (factor * a[0], factor * a[1], factor * a[2])


@compiled
def store(a: Any, m: Matrix) -> None:
    """Write a matrix into an array, shape (3, 3)."""
    a[0, 0], a[0, 1], a[0, 2] = m[0], m[1], m[2]
    a[1, 0], a[1, 1], a[1, 2] = m[3], m[4], m[5]
    a[2, 0], a[2, 1], a[2, 2] = m[6], m[7], m[8]


@compiled
def put(a: Any, v: Vector) -> None:
    """Add a vector to an array, shape (3,)."""
    a[0] += v[0]
    a[1] += v[1]
    a[2] += v[2]


@compiled
def spread_block(a: Array, row: int, column: int, m: Matrix) -> None:
    """Add a matrix to an array at a row and column."""
    for i in range(3):
        for j in range(3):
            a[row + i, column + j] += m[3 * i + j]
