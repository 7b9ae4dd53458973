"""Forces and tangent of all rods and masses, compiled."""

from typing import NamedTuple

import numpy as np

from ringsim.frame.eights import EIGHT, NONE, less, load
from ringsim.frame.eights import store as eight
from ringsim.frame.element import carried, element_tangent, middle, scaled
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
    turned_about_z,
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
    return own if angle < 0 else mul(own, turned_about_z(pose.angle[angle]))


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
    for k in range(3):
        strains.now[e, k], strains.now[e, 3 + k] = u[k], psi[k]
    du = plus(times(strains.lead, u), vector(strains.before[e, :3]))
    dpsi = plus(times(strains.lead, psi), vector(strains.before[e, 3:]))
    force = scaled(vector(mesh.stiffness[e, :3]), u, du, mesh.tau[e])
    moment = scaled(vector(mesh.stiffness[e, 3:]), psi, dpsi, mesh.tau[e])
    n, w, m = carried(axes, d, force, moment, psi, own)
    return r1, r2, axes, d, psi, n, w, m, own


@compiled
def _pulls(
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
def add_forces(
    mesh: Mesh, pose: Pose, points: Array, accelerations: Array, strains: Strains, g: Array
) -> None:
    """Add forces of elastic rods and of inertia on all unknowns, shape (unknowns,)."""
    for e in range(len(mesh.length)):
        r1, r2, _, _, _, n, w, m, _ = _loaded(mesh, pose, points, strains, e)
        f1, m1, f2, m2 = _pulls(mesh, accelerations, e, n, w, m)
        for side in range(2):
            force, moment, axes = (f1, m1, r1) if side == 0 else (f2, m2, r2)
            f = mesh.frame[e, side]
            k = mesh.home[f]
            arm = minus(vector(points[mesh.point[e, side]]), vector(pose.place[f]))
            put(g[k : k + 3], force)
            put(g[k + 3 : k + 6], plus(moment, cross(arm, force)))
            if mesh.angle[e, side] >= 0:
                z = (axes[2], axes[5], axes[8])
                g[mesh.angle_home[mesh.angle[e, side]]] += dot(z, moment)
    for p in range(len(mesh.point_mass)):
        if mesh.point_mass[p] > 0.0:
            f = mesh.point_frame[p]
            k = mesh.home[f]
            force = times(mesh.point_mass[p], vector(accelerations[p]))
            arm = minus(vector(points[p]), vector(pose.place[f]))
            put(g[k : k + 3], force)
            put(g[k + 3 : k + 6], cross(arm, force))


@compiled
def begin_tangent(
    mesh: Mesh,
    pose: Pose,
    points: Array,
    accelerations: Array,
    strains: Strains,
    by_place: float,
    fronts: Array,
) -> None:
    """Set the fronts to the derivative of ``add_forces``; ``by_place`` is that of accelerations
    after places, 1/s^2.
    """
    for number in range(len(mesh.size)):
        fronts[number, : mesh.size[number], : mesh.size[number]] = 0.0
    k12, rows, h = np.zeros((12, 12)), np.zeros((12, 16)), np.zeros((14, 16))
    for e in range(len(mesh.length)):
        r1, r2, axes, d, psi, n, w, m, bending = _loaded(mesh, pose, points, strains, e)
        f1, m1, f2, m2 = _pulls(mesh, accelerations, e, n, w, m)
        k12[:] = 0.0
        more = 1.0 + mesh.tau[e] * strains.lead
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
                force = load(rows[x], c), load(rows[x + 1], c), load(rows[x + 2], c)
                torque = load(rows[phi], c), load(rows[phi + 1], c), load(rows[phi + 2], c)
                for i in range(3):
                    eight(h[own + i], c, force[i])
                eight(h[own + 3], c, less(less(torque[0], a[2], force[1]), -a[1], force[2]))
                eight(h[own + 4], c, less(less(torque[1], a[0], force[2]), -a[2], force[0]))
                eight(h[own + 5], c, less(less(torque[2], a[1], force[0]), -a[0], force[1]))
                turning = less(less(NONE, -z[0], torque[0]), -z[1], torque[1])
                eight(h[own + 6], c, less(turning, -z[2], torque[2]))
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
                    first, own = np.uintp(mesh.local[e, 7 * side]), np.uintp(7 * side)
                    for j in range(np.uintp(6)):
                        row[first + j] += h[i, own + j]
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
