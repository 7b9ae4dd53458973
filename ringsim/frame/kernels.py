"""Forces and energies of all rods and masses, compiled."""

import math
from typing import NamedTuple

from ringsim.frame.element import carried, middle, scaled
from ringsim.frame.mesh import Mesh
from ringsim.frame.vectors import (
    Matrix,
    Vector,
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
    store,
    times,
    transposed,
    turn,
    turned,
    unsigned,
    vector,
)
from ringsim.layout.pose import Array


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
