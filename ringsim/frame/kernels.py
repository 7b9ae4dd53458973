"""A rod element between two frames: corotational, with Reissner strains of its middle."""

import math
from typing import NamedTuple

import numpy as np

from ringsim.compiled.vectors import (
    Matrix,
    Vector,
    across,
    add,
    compiled,
    cross,
    dot,
    matrix,
    minus,
    mul,
    plus,
    put,
    rotation_vector,
    scale,
    skew,
    spread_block,
    store,
    times,
    transposed,
    turn,
    turn_back,
    turned,
    unsigned,
    vector,
)
from ringsim.frame.elimination import EIGHT, NONE, less, put_eight, take_eight
from ringsim.frame.mesh import Mesh
from ringsim.layout.bodies import Array

# A rod element between two frames: corotational, with Reissner strains of its middle.
#
# Ends at x_1, x_2 with axes R_1, R_2; half-way between these, R = R_1 exp(psi / 2) with
# psi = log(R_1^T R_2).  Strains are
#
#     u = Z R^T (x_2 - x_1) - L e_x,   psi,
#
# with Z below: those of a screw from one end to the other, whose middle line is as long as its arc
# (Sonneville, Cardona and Bruels, Computer Methods in Applied Mechanics and Engineering 268, 2014;
# exudyn's element has the same), and the energy (u . K_u u + psi . K_psi psi) / 2 with K_u =
# diag(EA, S, S) / L, K_psi = diag(GJ, EI, EI) / L and 1 / S = 1 / kGA + L^2 / 12 EI: the shear
# carries the flexibility of bending that constant curvature lacks (MacNeal 1978), so that the ends
# of a rod loaded at its ends are exact to first order.  Kelvin-Voigt damping adds tau times the
# rates of the strains.
#
# Variations, with d phi_1, d phi_2 of the ends (spatial), a = R^T d phi, r = a_2 - a_1 and
# k = |psi|:
#
#     d psi = Z r,              Z = 1 + c [psi]^2,   c = (1 - (k / 2) / sin(k / 2)) / k^2,
#     d (Z y) = Z dy + G d psi, G = c (psi y^T + (psi . y) - 2 y psi^T) + c' terms,
#     turn of R: (a_1 + a_2) / 2 - e [psi] r,   e = tan(k / 4) / 2 k -> 1 / 8:
#
# exp(-psi / 2) takes the right-hand Jacobian of the exponential map at psi to an even function of
# [psi], whose inverse is Z, and half the difference of the Jacobians at -psi / 2 and psi / 2 gives
# e (Jacobians: Simo and Vu-Quoc 1986; Sola et al., A micro Lie theory, 2018).  So, with y = R^T d,
# spatial n = R Z K_u u and w = (x_2 - x_1) x n, forces are -n, n and moments -m - w / 2, m - w / 2
# with m = R Z (K_psi psi + G^T K_u u) + e w x (R psi): the energy's exact derivative, which leaves
# it unchanged in a rigid motion.  The tangent leaves out terms of second order in psi, but for G^T
# K_u G, which is large where a rod is slender.


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


# Forces and energies of all rods and masses, compiled.


class Pose(NamedTuple):
    """Places (f, 3), m, and axes (f, 3, 3) of all frames, and all joint angles (a,), rad."""

    place: Array
    axes: Array
    angle: Array


class Strains(NamedTuple):
    """Strains u (m) and psi (rad) of all elements at a state, shape (e, 6); ``before`` and
    ``lead`` (1/s) give their rates, lead * strain + before.
    """

    now: Array
    before: Array
    lead: float


@compiled
def move(mesh: Mesh, pose: Pose, step: Array) -> None:
    """Move a pose by changes of all unknowns, shape (unknowns,); in place."""
    for f in range(len(pose.place)):
        k = mesh.home[f]
        put(pose.place[f], (step[k], step[k + 1], step[k + 2]))
        by = turned((step[k + 3], step[k + 4], step[k + 5]))
        store(pose.axes[f], mul(by, matrix(pose.axes[f])))
    for n in range(len(pose.angle)):
        pose.angle[n] += step[mesh.angle_home[n]]


@compiled
def moved_between(mesh: Mesh, before: Pose, after: Pose, out: Array) -> None:
    """Changes of all unknowns from one pose to another, shape (unknowns,)."""
    for f in range(len(before.place)):
        k = mesh.home[f]
        by = mul(matrix(after.axes[f]), transposed(matrix(before.axes[f])))
        psi = rotation_vector(by)
        for i in range(3):
            out[k + i] = after.place[f, i] - before.place[f, i]
            out[k + 3 + i] = psi[i]
    for n in range(len(before.angle)):
        out[mesh.angle_home[n]] = after.angle[n] - before.angle[n]


@compiled
def straighten(pose: Pose) -> None:
    """Take what round-off has done to the axes out: R (3 - R^T R) / 2."""
    most = (1.5, 0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, 1.5)
    for f in range(len(pose.axes)):
        r = matrix(pose.axes[f])
        store(pose.axes[f], mul(r, add(most, scale(-0.5, mul(transposed(r), r)))))


@compiled
def push(g: Array, first: int, force: Vector, moment: Vector) -> None:
    """Add a force and a moment to the unknowns of a frame."""
    k = unsigned(first)
    g[k] += force[0]
    g[k + unsigned(1)] += force[1]
    g[k + unsigned(2)] += force[2]
    g[k + unsigned(3)] += moment[0]
    g[k + unsigned(4)] += moment[1]
    g[k + unsigned(5)] += moment[2]


@compiled
def place_points(mesh: Mesh, pose: Pose, out: Array) -> None:
    """Places of all points with mass, shape (p, 3)."""
    for n in range(len(mesh.point_frame)):
        f = mesh.point_frame[n]
        arm = turn(matrix(pose.axes[f]), vector(mesh.point_arm[n]))
        out[n, 0] = pose.place[f, 0] + arm[0]
        out[n, 1] = pose.place[f, 1] + arm[1]
        out[n, 2] = pose.place[f, 2] + arm[2]


@compiled
def end_axes(mesh: Mesh, pose: Pose, e: int, side: int) -> Matrix:
    """Axes of an end of an element."""
    own = mul(matrix(pose.axes[mesh.frame[e, side]]), matrix(mesh.axes[e, side]))
    angle = mesh.angle[e, side]
    if angle < 0:
        return own
    c, s = math.cos(pose.angle[angle]), math.sin(pose.angle[angle])
    return (
        c * own[0] + s * own[1], c * own[1] - s * own[0], own[2],
        c * own[3] + s * own[4], c * own[4] - s * own[3], own[5],
        c * own[6] + s * own[7], c * own[7] - s * own[6], own[8],
    )  # fmt: skip


@compiled
def _loaded(
    mesh: Mesh, pose: Pose, points: Array, strains: Strains, e: int
) -> tuple[Matrix, Matrix, Matrix, Vector, Vector, Vector, Vector, Vector, Vector]:
    """What an element holds: axes of its ends and middle, d, psi, n, w, m, coefficients; keeps its
    strains.
    """
    r1, r2 = end_axes(mesh, pose, e, 0), end_axes(mesh, pose, e, 1)
    d = minus(vector(points[mesh.point[e, 1]]), vector(points[mesh.point[e, 0]]))
    axes, u, psi, own = middle(r1, r2, d, mesh.length[e])
    now, before, stiffness = strains.now[e], strains.before[e], mesh.stiffness[e]
    for k in range(3):
        now[k], now[3 + k] = u[k], psi[k]
    du = plus(times(strains.lead, u), (before[0], before[1], before[2]))
    dpsi = plus(times(strains.lead, psi), (before[3], before[4], before[5]))
    ku, kp = vector(stiffness), (stiffness[3], stiffness[4], stiffness[5])
    force, moment = scaled(ku, u, du, mesh.tau[e]), scaled(kp, psi, dpsi, mesh.tau[e])
    n, w, m = carried(axes, d, force, moment, psi, own)
    return r1, r2, axes, d, psi, n, w, m, own


@compiled
def pulls_of(
    mesh: Mesh, accelerations: Array, e: int, n: Vector, w: Vector, m: Vector
) -> tuple[Vector, Vector, Vector, Vector]:
    """Forces and moments on an element's ends, with those of inertia."""
    a1 = vector(accelerations[mesh.point[e, 0]])
    a2 = vector(accelerations[mesh.point[e, 1]])
    own, other = mesh.mass[e, 0], mesh.mass[e, 1]
    f1 = minus(plus(times(own, a1), times(other, a2)), n)
    f2 = plus(plus(times(own, a2), times(other, a1)), n)
    half = times(0.5, w)
    return f1, minus(times(-1.0, m), half), f2, minus(m, half)


@compiled
def held_by(
    loads: Array, e: int
) -> tuple[Matrix, Matrix, Matrix, Vector, Vector, Vector, Vector, Vector, Vector]:
    """What ``add_forces`` has kept of an element: ``_loaded``."""
    low, high = loads[e, 3], loads[e, 4]
    return (
        matrix(loads[e, 0]), matrix(loads[e, 1]), matrix(loads[e, 2]),
        vector(low[0]), vector(low[1]), vector(low[2]),
        vector(high[0]), vector(high[1]), vector(high[2]),
    )  # fmt: skip


@compiled
def add_forces(
    mesh: Mesh, pose: Pose, points: Array, accelerations: Array, strains: Strains, loads: Array,
    g: Array,
) -> None:  # fmt: skip
    """Add forces of elastic rods and of inertia on all unknowns, shape (unknowns,); keeps what the
    elements hold in ``loads``, shape (e, 5, 3, 3).
    """
    for e in range(len(mesh.length)):
        r1, r2, axes, d, psi, n, w, m, own = _loaded(mesh, pose, points, strains, e)
        store(loads[e, 0], r1)
        store(loads[e, 1], r2)
        store(loads[e, 2], axes)
        store(loads[e, 3], d + psi + n)
        store(loads[e, 4], w + m + own)
        f1, m1, f2, m2 = pulls_of(mesh, accelerations, e, n, w, m)
        for side in range(2):
            force, moment, end = (f1, m1, r1) if side == 0 else (f2, m2, r2)
            f = mesh.frame[e, side]
            k = mesh.home[f]
            arm = minus(vector(points[mesh.point[e, side]]), vector(pose.place[f]))
            push(g, k, force, plus(moment, cross(arm, force)))
            if mesh.angle[e, side] >= 0:
                z = (end[2], end[5], end[8])
                g[mesh.angle_home[mesh.angle[e, side]]] += dot(z, moment)
    for p in range(len(mesh.point_mass)):
        if mesh.point_mass[p] > 0.0:
            f = mesh.point_frame[p]
            k = mesh.home[f]
            force = times(mesh.point_mass[p], vector(accelerations[p]))
            arm = minus(vector(points[p]), vector(pose.place[f]))
            push(g, k, force, cross(arm, force))


@compiled
def energies_of(mesh: Mesh, velocities: Array, strains: Array) -> tuple[float, float]:
    """Kinetic energy of rods and points and elastic energy of rods, J; velocities of the points,
    shape (p, 3), m/s.
    """
    kinetic = elastic = 0.0
    for e in range(len(mesh.mass)):
        v1, v2 = vector(velocities[mesh.point[e, 0]]), vector(velocities[mesh.point[e, 1]])
        kinetic += 0.5 * mesh.mass[e, 0] * (dot(v1, v1) + dot(v2, v2))
        kinetic += mesh.mass[e, 1] * dot(v1, v2)
        for k in range(6):
            elastic += 0.5 * mesh.stiffness[e, k] * strains[e, k] * strains[e, k]
    for p in range(len(mesh.point_mass)):
        v = vector(velocities[p])
        kinetic += 0.5 * mesh.point_mass[p] * dot(v, v)
    return kinetic, elastic


# Tangent of all rods and masses, compiled.


@compiled
def begin_tangent(
    mesh: Mesh,
    pose: Pose,
    points: Array,
    accelerations: Array,
    loads: Array,
    lead: float,
    by_place: float,
    fronts: Array,
) -> None:
    """Set the fronts to the derivative of ``add_forces``, which has kept ``loads``; ``lead`` and
    ``by_place`` are those of rates of strains after strains (1/s), and of accelerations after
    places (1/s^2).
    """
    for number in range(len(mesh.size)):
        fronts[number, : mesh.size[number], : mesh.size[number]] = 0.0
    k12, rows, h = np.zeros((12, 12)), np.zeros((12, 16)), np.zeros((14, 16))
    for e in range(len(mesh.length)):
        r1, r2, axes, d, psi, n, w, m, bending = held_by(loads, e)
        f1, m1, f2, m2 = pulls_of(mesh, accelerations, e, n, w, m)
        k12[:] = 0.0
        more = 1.0 + mesh.tau[e] * lead
        ku = times(more, vector(mesh.stiffness[e, :3]))
        kp = times(more, vector(mesh.stiffness[e, 3:]))
        element_tangent(axes, d, n, w, m, psi, bending, ku, kp, k12)
        for k in range(3):
            k12[k, k] += by_place * mesh.mass[e, 0]
            k12[k, 6 + k] += by_place * mesh.mass[e, 1]
            k12[6 + k, k] += by_place * mesh.mass[e, 1]
            k12[6 + k, 6 + k] += by_place * mesh.mass[e, 0]
        for side in range(2):
            x, phi, own = 6 * side, 6 * side + 3, 7 * side
            end = r1 if side == 0 else r2
            a = minus(vector(points[mesh.point[e, side]]), vector(pose.place[mesh.frame[e, side]]))
            z = (end[2], end[5], end[8])
            for i in range(12):
                # d x = d X - a x d phi, and the force's row times that: f . (d phi x a).
                f = (k12[i, x], k12[i, x + 1], k12[i, x + 2])
                t = (k12[i, phi], k12[i, phi + 1], k12[i, phi + 2])
                swung = cross(a, f)
                for j in range(3):
                    rows[i, own + j] = f[j]
                    rows[i, own + 3 + j] = t[j] + swung[j]
                rows[i, own + 6] = dot(t, z)
        for side in range(2):
            x, phi, own = 6 * side, 6 * side + 3, 7 * side
            end = r1 if side == 0 else r2
            f = f1 if side == 0 else f2
            moment = m1 if side == 0 else m2
            a = minus(vector(points[mesh.point[e, side]]), vector(pose.place[mesh.frame[e, side]]))
            z = (end[2], end[5], end[8])
            for c in range(0, 2 * EIGHT, EIGHT):
                fx, fy, fz = (
                    take_eight(rows[x], c),
                    take_eight(rows[x + 1], c),
                    take_eight(rows[x + 2], c),
                )
                mx, my, mz = (
                    take_eight(rows[phi], c),
                    take_eight(rows[phi + 1], c),
                    take_eight(rows[phi + 2], c),
                )
                put_eight(h[own], c, fx)
                put_eight(h[own + 1], c, fy)
                put_eight(h[own + 2], c, fz)
                put_eight(h[own + 3], c, less(less(mx, a[2], fy), -a[1], fz))
                put_eight(h[own + 4], c, less(less(my, a[0], fz), -a[2], fx))
                put_eight(h[own + 5], c, less(less(mz, a[1], fx), -a[0], fy))
                put_eight(h[own + 6], c, less(less(less(NONE, -z[0], mx), -z[1], my), -z[2], mz))
            # The arm and the joint's axis turn with the frame under constant force and moment:
            # (d phi x a) x f = (a f^T - (f . a)) d phi, (d phi x z) . m = (z x m) . d phi.
            along, sideways = dot(f, a), cross(z, moment)
            for i in range(3):
                for j in range(3):
                    h[own + 3 + i, own + 3 + j] += a[i] * f[j]
                h[own + 3 + i, own + 3 + i] -= along
                h[own + 6, own + 3 + i] += sideways[i]
        front = fronts[mesh.part[e]]
        for i in range(14):
            if mesh.local[e, i] >= 0:
                row = front[mesh.local[e, i]]
                for side in range(2):
                    first, begun = unsigned(mesh.local[e, 7 * side]), unsigned(7 * side)
                    for j in range(unsigned(6)):
                        row[first + j] += h[i, begun + j]
                    if mesh.local[e, 7 * side + 6] >= 0:
                        row[mesh.local[e, 7 * side + 6]] += h[i, 7 * side + 6]
    # Points with mass of their own: those of frames in parts have no arm.
    for p in range(len(mesh.point_mass)):
        if mesh.point_mass[p] == 0.0:
            continue
        f, mass = mesh.point_frame[p], by_place * mesh.point_mass[p]
        front, first = fronts[mesh.frame_local[f, 0]], mesh.frame_local[f, 1]
        a = minus(vector(points[p]), vector(pose.place[f]))
        force = times(mesh.point_mass[p], vector(accelerations[p]))
        along, square = dot(force, a), dot(a, a)
        s = (0.0, -a[2], a[1], a[2], 0.0, -a[0], -a[1], a[0], 0.0)
        for i in range(3):
            front[first + i, first + i] += mass
            front[first + 3 + i, first + 3 + i] += mass * square - along
            for j in range(3):
                front[first + i, first + 3 + j] -= mass * s[3 * i + j]
                front[first + 3 + i, first + j] += mass * s[3 * i + j]
                front[first + 3 + i, first + 3 + j] += a[i] * force[j] - mass * a[i] * a[j]
