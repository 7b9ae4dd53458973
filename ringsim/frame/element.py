"""A rod element between two frames: corotational, with Reissner strains of its middle.

Ends at x_1, x_2 with axes R_1, R_2; half-way between these, R = R_1 exp(psi / 2) with
psi = log(R_1^T R_2).  Strains are

    u = Z R^T (x_2 - x_1) - L e_x,   psi,

with Z below: those of a screw from one end to the other, whose middle line is as long as its arc
(Sonneville, Cardona and Bruels, Computer Methods in Applied Mechanics and Engineering 268, 2014;
exudyn's element has the same), and the energy (u . K_u u + psi . K_psi psi) / 2 with
K_u = diag(EA, S, S) / L, K_psi = diag(GJ, EI, EI) / L and 1 / S = 1 / kGA + L^2 / 12 EI: the
shear carries the flexibility of bending that constant curvature lacks (MacNeal 1978), so that the
ends of a rod loaded at its ends are exact to first order.  Kelvin-Voigt damping adds tau times the
rates of the strains.

Variations, with d phi_1, d phi_2 of the ends (spatial), a = R^T d phi, r = a_2 - a_1 and
k = |psi|:

    d psi = Z r,              Z = 1 + c [psi]^2,   c = (1 - (k / 2) / sin(k / 2)) / k^2,
    d (Z y) = Z dy + G d psi, G = c (psi y^T + (psi . y) - 2 y psi^T) + c' terms,
    turn of R: (a_1 + a_2) / 2 - e [psi] r,   e = tan(k / 4) / 2 k -> 1 / 8:

exp(-psi / 2) takes the right-hand Jacobian of the exponential map at psi to an even function of
[psi], whose inverse is Z, and half the difference of the Jacobians at -psi / 2 and psi / 2 gives e
(Jacobians: Simo and Vu-Quoc 1986; Sola et al., A micro Lie theory, 2018).  So, with y = R^T d,
spatial n = R Z K_u u and w = (x_2 - x_1) x n, forces are -n, n and moments -m - w / 2, m - w / 2
with m = R Z (K_psi psi + G^T K_u u) + e w x (R psi): the energy's exact derivative, which leaves it
unchanged in a rigid motion.  The tangent leaves out terms of second order in psi, but for
G^T K_u G, which is large where a rod is slender.
"""

import math

from ringsim.frame.vectors import (
    Matrix,
    Vector,
    across,
    add,
    compiled,
    cross,
    dot,
    mul,
    plus,
    rotation_vector,
    scale,
    skew,
    spread_block,
    times,
    transposed,
    turn,
    turn_back,
    turned,
)
from ringsim.layout.pose import Array

_SMALL = 0.1
"""Bending (rad) below which coefficients are taken by series: what these leave out is below 5e-16,
and sines cost more."""


@compiled
def coefficients(psi: Vector) -> Vector:
    """C, e and c' / k of the variations."""
    square = dot(psi, psi)
    if square < _SMALL * _SMALL:
        c = 7.0 / 5760.0 + square * (31.0 / 967680.0 + square * 127.0 / 154828800.0)
        e = 1.0 / 384.0 + square * (1.0 / 15360.0 + square * 17.0 / 10321920.0)
        slope = 31.0 / 241920.0 + square * (127.0 / 25804800.0 + square * 73.0 / 437944320.0)
        return -(1.0 / 24.0 + square * c), 0.125 + square * e, -(7.0 / 2880.0 + square * slope)
    k = math.sqrt(square)
    half = 0.5 * k
    sine = math.sin(half)
    c = (1.0 - half / sine) / square
    slope = (half * math.cos(half) / sine - 1.0) / (4.0 * half * sine * square) - 2.0 * c / square
    return c, math.tan(0.5 * half) / k * 0.5, slope


@compiled
def middle(
    r1: Matrix, r2: Matrix, d: Vector, length: float
) -> tuple[Matrix, Vector, Vector, Vector]:
    """Axes of the middle, the strains u and psi there and its coefficients."""
    psi = rotation_vector(mul(transposed(r1), r2))
    axes, own = mul(r1, turned(times(0.5, psi))), coefficients(psi)
    u = straightened(psi, own[0], turn_back(axes, d))
    return axes, (u[0] - length, u[1], u[2]), psi, own


@compiled
def straightened(psi: Vector, c: float, a: Vector) -> Vector:
    """Z a."""
    return plus(a, times(c, cross(psi, cross(psi, a))))


@compiled
def bowed(psi: Vector, own: Vector, y: Vector, force: Vector) -> Vector:
    """G^T f, the moment by which a force straightens."""
    c, _, slope = own
    square, along, across, both = dot(psi, psi), dot(psi, y), dot(psi, force), dot(y, force)
    whole = slope * (along * across - square * both) - 2.0 * c * both
    return plus(times(whole, psi), plus(times(c * across, y), times(c * along, force)))


@compiled
def scaled(stiffness: Vector, strain: Vector, rate: Vector, tau: float) -> Vector:
    """Force of three strains (N or N m): elastic and viscous."""
    return (
        stiffness[0] * (strain[0] + tau * rate[0]),
        stiffness[1] * (strain[1] + tau * rate[1]),
        stiffness[2] * (strain[2] + tau * rate[2]),
    )


@compiled
def carried(
    axes: Matrix, d: Vector, force: Vector, moment: Vector, psi: Vector, own: Vector
) -> tuple[Vector, Vector, Vector]:
    """Spatial n, w and m of the force and moment in the middle's axes."""
    c, e, _ = own
    n = turn(axes, straightened(psi, c, force))
    w = cross(d, n)
    bent = straightened(psi, c, plus(moment, bowed(psi, own, turn_back(axes, d), force)))
    return n, w, plus(turn(axes, bent), times(e, cross(w, turn(axes, psi))))


@compiled
def element_tangent(
    axes: Matrix,
    d: Vector,
    n: Vector,
    w: Vector,
    m: Vector,
    psi: Vector,
    own: Vector,
    ku: Vector,
    kp: Vector,
    k: Array,
) -> None:
    """Add the tangent after (x_1, phi_1, x_2, phi_2) to ``k``, shape (12, 12).

    ``ku`` and ``kp`` are stiffnesses of the strains with what damping adds.
    """
    c, e, _ = own
    half = (0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.5)
    a, bend = _in_space(axes, ku), turn(axes, psi)
    g = _bow(times(c, bend), d)
    ag = mul(a, g)
    by_bend = add(ag, _bow(times(c, bend), n))
    bow = _bow_turn(c, d, n)
    b = add(add(_in_space(axes, kp), scale(e, skew(w))), add(mul(transposed(g), ag), bow))
    swing = skew(times(e, bend))  # e [psi]
    first, second = add(half, swing), add(half, scale(-1.0, swing))
    by_turn = add(mul(a, skew(d)), scale(-1.0, skew(n)))
    p1 = add(mul(by_turn, first), scale(-1.0, by_bend))
    p2 = add(mul(by_turn, second), by_bend)
    wd = add(across(d, a), scale(-1.0, skew(n)))
    w1, w2 = across(d, p1), across(d, p2)
    md = add(transposed(by_bend), scale(-1.0, mul(swing, wd)))
    q = scale(-1.0, add(skew(m), mul(swing, skew(w))))
    q = add(q, mul(transposed(by_bend), skew(d)))
    m1 = add(add(mul(q, first), scale(-1.0, b)), scale(-1.0, mul(swing, w1)))
    m2 = add(add(mul(q, second), b), scale(-1.0, mul(swing, w2)))

    for row, sign in ((0, -1.0), (6, 1.0)):
        spread_block(k, row, 0, scale(-sign, a))
        spread_block(k, row, 6, scale(sign, a))
        spread_block(k, row, 3, scale(sign, p1))
        spread_block(k, row, 9, scale(sign, p2))
        by_place = add(scale(sign, md), scale(-0.5, wd))
        spread_block(k, row + 3, 0, scale(-1.0, by_place))
        spread_block(k, row + 3, 6, by_place)
        spread_block(k, row + 3, 3, add(scale(sign, m1), scale(-0.5, w1)))
        spread_block(k, row + 3, 9, add(scale(sign, m2), scale(-0.5, w2)))


@compiled
def _in_space(axes: Matrix, stiffness: Vector) -> Matrix:
    """R diag(k_x, k, k) R^T = k + (k_x - k) x x^T."""
    s, more = stiffness[1], stiffness[0] - stiffness[1]
    x, y, z = axes[0], axes[3], axes[6]
    return (
        s + more * x * x, more * x * y, more * x * z,
        more * x * y, s + more * y * y, more * y * z,
        more * x * z, more * y * z, s + more * z * z,
    )  # fmt: skip


@compiled
def _bow(p: Vector, y: Vector) -> Matrix:
    """P y^T + p . y - 2 y p^T."""
    m = dot(p, y)
    return (
        m - p[0] * y[0], p[0] * y[1] - 2.0 * y[0] * p[1], p[0] * y[2] - 2.0 * y[0] * p[2],
        p[1] * y[0] - 2.0 * y[1] * p[0], m - p[1] * y[1], p[1] * y[2] - 2.0 * y[1] * p[2],
        p[2] * y[0] - 2.0 * y[2] * p[0], p[2] * y[1] - 2.0 * y[2] * p[1], m - p[2] * y[2],
    )  # fmt: skip


@compiled
def _bow_turn(c: float, d: Vector, n: Vector) -> Matrix:
    """C (d n^T + n d^T - 2 d . n)."""
    m = -2.0 * c * dot(d, n)
    xy, yz, zx = (
        c * (d[0] * n[1] + d[1] * n[0]),
        c * (d[1] * n[2] + d[2] * n[1]),
        c * (d[2] * n[0] + d[0] * n[2]),
    )
    return (
        m + 2.0 * c * d[0] * n[0], xy, zx,
        xy, m + 2.0 * c * d[1] * n[1], yz,
        zx, yz, m + 2.0 * c * d[2] * n[2],
    )  # fmt: skip
