"""Tangent of all rods and masses, compiled."""

import numpy as np

from ringsim.frame.eights import EIGHT, NONE, less, put_eight, take_eight
from ringsim.frame.element import element_tangent
from ringsim.frame.kernels import Pose, held_by, pulls_of
from ringsim.frame.mesh import Mesh
from ringsim.frame.vectors import compiled, cross, dot, minus, times, unsigned, vector
from ringsim.layout.pose import Array


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
