"""Points of the cables' paths on frames, compiled.

A point stands at X + R (arm + C Rz(share theta) b) of a frame X, R: a pulley on a hinge assembly
has b = 0, one on a bar half turns with its joint (share 1, or 0 on the half that is the frame), and
a block on the bisector of two halves turns half as far, b = (0, -sense h, 0): the bisector of
``ringsim.engine.cable_path`` for relative turns of the halves below three quarters of a turn.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ringsim.cable.ropes import Ropes
from ringsim.cable.sheaves import BlockSheave, Sheave
from ringsim.frame.chain import Spans
from ringsim.frame.kernels import Pose, push
from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import Indices, Parts
from ringsim.frame.skeleton import Skeleton
from ringsim.frame.vectors import (
    compiled,
    cross,
    dot,
    matrix,
    minus,
    mul,
    plus,
    times,
    turn,
    turned_about_z,
    vector,
)
from ringsim.layout.pose import Array


class Lines(NamedTuple):
    """Points of all paths, of every one: frame, arm, axes C, b, angle (-1: none) and share.

    ``span`` are the spans between different frames, ``near`` their first points (the other is the
    next), ``front`` and ``local`` where their unknowns are (X, phi, angle of both points).
    """

    frame: Indices
    arm: Array
    axes: Array
    swung: Array
    angle: Indices
    share: Array
    span: Indices
    near: Indices
    front: Indices
    local: Indices


class Arms(NamedTuple):
    """Of all points at a pose, (points, 3) each: arms that turn with the frames, what turns with
    the angles, and about which axes.
    """

    whole: Array
    swung: Array
    axis: Array

    @classmethod
    def empty(cls, points: int) -> "Arms":
        """Of so many points."""
        return cls(*(np.zeros((points, 3)) for _ in range(3)))


def lines_of(
    skeleton: Skeleton, parts: Parts, paths: Sequence[Sequence[Sheave]], ropes: Ropes
) -> Lines:
    """The points of paths of a layout."""
    found = [_point(skeleton, sheave) for path in paths for sheave in path]
    frame, arm, axes, swung, angle, share = (np.array(each) for each in zip(*found, strict=True))
    spans, fronts, local = [], [], []
    for span, near in enumerate(ropes.near.tolist()):
        ends = near, near + 1
        if frame[near] == frame[near + 1]:
            continue
        inner = [int(frame[k]) for k in ends if frame[k] >= len(skeleton.layout.bodies)]
        front, _ = parts.front_of(int(parts.home[inner[0]]))
        row = parts.local(front, [(int(frame[k]), int(angle[k])) for k in ends])
        spans.append(span)
        fronts.append(front)
        local.append(row)
    return Lines(
        frame, arm, axes, swung, angle, share, np.array(spans), ropes.near[spans],
        np.array(fronts), np.array(local),
    )  # fmt: skip


def no_lines() -> Lines:
    """Of a scene without cables."""
    three, whole, one = np.zeros((0, 3)), np.zeros(0, dtype=np.int64), np.zeros(0)
    return Lines(
        whole, three, np.zeros((0, 3, 3)), three, whole, one, whole, whole, whole,
        np.zeros((0, 14), dtype=np.int64),
    )  # fmt: skip


def _point(skeleton: Skeleton, sheave: Sheave) -> tuple[int, Array, Array, Array, int, float]:
    none = np.zeros(3)
    if isinstance(sheave, BlockSheave):
        first, second = (skeleton.end_of(mount) for mount in sheave.nodes)
        swung = np.array([0.0, -sheave.sense * sheave.offset, 0.0])
        turning = second if first.angle < 0 else first
        return first.frame, first.arm, turning.axes, swung, turning.angle, 0.5
    end = skeleton.end_of(sheave.node)
    if end.angle < 0:
        return end.frame, end.arm + end.axes @ sheave.arm, np.eye(3), none, -1, 0.0
    return end.frame, end.arm, end.axes, sheave.arm, end.angle, 1.0


@compiled
def place_lines(lines: Lines, pose: Pose, arms: Arms, out: Array) -> None:
    """Arms and places of all points, shape (points, 3), m."""
    for n in range(len(lines.frame)):
        frame, angle = lines.frame[n], lines.angle[n]
        axes = matrix(pose.axes[frame])
        arm, swung, axis = turn(axes, vector(lines.arm[n])), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if angle >= 0:
            own = mul(axes, matrix(lines.axes[n]))
            turned = turned_about_z(lines.share[n] * pose.angle[angle])
            swung = turn(own, turn(turned, vector(lines.swung[n])))
            axis = times(lines.share[n], (own[2], own[5], own[8]))
        arm = plus(arm, swung)
        for k in range(3):
            arms.whole[n, k], arms.swung[n, k], arms.axis[n, k] = arm[k], swung[k], axis[k]
            out[n, k] = pose.place[frame, k] + arm[k]


@compiled
def pull_lines(lines: Lines, mesh: Mesh, arms: Arms, forces: Array, out: Array, first: int) -> None:
    """Add what forces on all points, shape (n, points, 3), do to the unknowns, (unknowns, columns),
    from the ``first`` column on.
    """
    for n in range(len(lines.frame)):
        k, angle = mesh.home[lines.frame[n]], lines.angle[n]
        arm, turned = vector(arms.whole[n]), cross(vector(arms.axis[n]), vector(arms.swung[n]))
        for c in range(len(forces)):
            force = vector(forces[c, n])
            moment = cross(arm, force)
            for i in range(3):
                out[k + i, first + c] += force[i]
                out[k + 3 + i, first + c] += moment[i]
            if angle >= 0:
                out[mesh.angle_home[angle], first + c] += dot(turned, force)


@compiled
def pull_spans(lines: Lines, mesh: Mesh, arms: Arms, spans: Spans, g: Array) -> None:
    """Add what resists the pull of spans between frames to the unknowns, shape (unknowns,)."""
    for s in range(len(lines.span)):
        span = lines.span[s]
        force = times(spans.tension[span], vector(spans.unit[span]))
        for side in range(2):
            n = lines.near[s] + side
            pull = force if side == 1 else times(-1.0, force)
            k, angle = mesh.home[lines.frame[n]], lines.angle[n]
            push(g, k, pull, cross(vector(arms.whole[n]), pull))
            if angle >= 0:
                turned = cross(vector(arms.swung[n]), pull)
                g[mesh.angle_home[angle]] += dot(vector(arms.axis[n]), turned)


@compiled
def add_line_tangent(lines: Lines, arms: Arms, spans: Spans, fronts: Array) -> None:
    """Add how the pulls of spans between frames turn with the spans and the arms to the fronts."""
    legs, pulled = np.zeros((3, 14)), np.zeros((3, 14))
    for s in range(len(lines.span)):
        span, front = lines.span[s], fronts[lines.front[s]]
        for side in range(2):
            n, own, sign = lines.near[s] + side, 7 * side, 2.0 * side - 1.0
            a, b, z = vector(arms.whole[n]), vector(arms.swung[n]), vector(arms.axis[n])
            swing = cross(z, b)
            for i in range(3):
                for j in range(6):
                    legs[i, own + j] = 0.0
                legs[i, own + i] = sign
                legs[i, own + 6] = sign * swing[i]
            legs[0, own + 4], legs[0, own + 5] = sign * a[2], -sign * a[1]
            legs[1, own + 3], legs[1, own + 5] = -sign * a[2], sign * a[0]
            legs[2, own + 3], legs[2, own + 4] = sign * a[1], -sign * a[0]
            # Arms turn under a constant force f that resists: as for the ends of elements.
            f = times(sign * spans.tension[span], vector(spans.unit[span]))
            along, b_along, z_along = dot(f, a), dot(f, b), dot(f, z)
            lifted = cross(swing, f)
            local = lines.local[s]
            for i in range(3):
                row = local[own + 3 + i]
                for j in range(3):
                    front[row, local[own + 3 + j]] += a[i] * f[j]
                front[row, row] -= along
                if local[own + 6] >= 0:
                    k = local[own + 6]
                    front[row, k] += lifted[i]
                    front[k, row] += z_along * b[i] - b_along * z[i]
            if local[own + 6] >= 0:
                front[local[own + 6], local[own + 6]] += dot(z, cross(swing, f))
        # T (1 - u u^T) / L: the tension turns with the span.
        unit, stiffness = vector(spans.unit[span]), spans.tension[span] / spans.length[span]
        for j in range(14):
            leg = (legs[0, j], legs[1, j], legs[2, j])
            aside = minus(leg, times(dot(unit, leg), unit))
            for i in range(3):
                pulled[i, j] = stiffness * aside[i]
        for i in range(14):
            row = lines.local[s, i]
            if row >= 0:
                for j in range(14):
                    if lines.local[s, j] >= 0:
                        front[row, lines.local[s, j]] += (
                            legs[0, i] * pulled[0, j]
                            + legs[1, i] * pulled[1, j]
                            + legs[2, i] * pulled[2, j]
                        )
