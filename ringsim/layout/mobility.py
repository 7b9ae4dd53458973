"""How many ways a structure of rigid parts can move: null space of the constraint Jacobian.

A section of a pantograph ring folds, and each of its four hinge assemblies tilts about the common
axis of its two rods.  Where two sections meet, their normals differ: no tilt is left.  A closed
ring has one freedom, an open arc five (four if a boom joins two end assemblies, three if its joint
is prismatic).  At 180 deg the bars lie straight, and each of the 2 N V-joints can start to move by
itself.
"""

from itertools import pairwise

import numpy as np

from ringsim.layout.bodies import InSpace, Mount, OnBody
from ringsim.layout.joints import Joint
from ringsim.layout.layout import Layout
from ringsim.layout.pose import Array, skew

RANK_TOLERANCE = 1e-9
"""Singular values below this fraction of the largest are zeros.  Round-off leaves 1e-15; the
smallest true one is 5e-4 half open and 6e-8 at 0.01 deg for a ring of 120 sections."""
_HELD = {
    "revolute": [0, 1, 2, 3, 4],
    "prismatic": [1, 2, 3, 4, 5],
    "sleeve": [0, 1],
    "weld": [0, 1, 2, 3, 4, 5],
}
"""Translations and, from 3, rotations that a joint of each kind holds, along its own axes."""


def internal_mobility(layout: Layout) -> int:
    """Degrees of freedom of a structure of rigid parts beyond its six as one rigid body.

    The motions of each section (of its joints) by itself are joined at the bodies that sections
    share.  A boom counts as rigid; supports do not count.
    """
    joints = [joint for joint in layout.all_joints if not isinstance(joint.first, InSpace)]
    size = max(rod.length for rod in layout.rods)
    motions: dict[tuple[bool, int], list[tuple[int, Array]]] = {}  # of a part: first column, twists
    columns = 0
    for number in sorted({joint.section for joint in joints}):
        own = [joint for joint in joints if joint.section == number]
        parts = sorted({_part(mount) for joint in own for mount in (joint.first, joint.second)})
        middle = np.mean([layout.pose(joint.first).place for joint in own], axis=0)
        rows = np.concatenate([_row(layout, joint, parts, middle, size) for joint in own])
        _, values, shapes = np.linalg.svd(rows)
        free = shapes[_rank(values) :].T.reshape(len(parts), 6, -1)
        for part, twist in zip(parts, free, strict=True):
            place = layout.bodies[part[1]].pose.place if part[0] else middle
            arm = skew((place - middle) / size)
            at_part = np.concatenate([twist[:3] - arm @ twist[3:], twist[3:]])
            motions.setdefault(part, []).append((columns, at_part))
        columns += free.shape[-1]
    joined = [np.zeros((0, columns))]
    for shared in motions.values():
        for (start, twist), (other, same) in pairwise(shared):
            joined.append(np.zeros((6, columns)))
            joined[-1][:, start : start + twist.shape[1]] += twist
            joined[-1][:, other : other + same.shape[1]] -= same
    rank = _rank(np.linalg.svd(np.concatenate(joined), compute_uv=False))
    return columns - rank - 6


def _part(mount: Mount) -> tuple[bool, int]:
    """Whether a body, and its number or that of the rod."""
    assert not isinstance(mount, InSpace)
    return (True, mount.body) if isinstance(mount, OnBody) else (False, mount.rod)


def _row(
    layout: Layout, joint: Joint, parts: list[tuple[bool, int]], at: Array, size: float
) -> Array:
    """What a joint holds, (constraints, 6 parts): on velocity at a point, and angular velocity."""
    pose = layout.pose(joint.first)
    turned = pose.axes.T @ skew((pose.place - at) / size)
    whole = np.block([[pose.axes.T, -turned], [np.zeros((3, 3)), pose.axes.T]])
    held = whole[_HELD[joint.kind]]
    row = np.zeros((len(held), len(parts), 6))
    row[:, parts.index(_part(joint.first))] += held
    row[:, parts.index(_part(joint.second))] -= held
    return row.reshape(len(held), -1)


def _rank(values: Array) -> int:
    """From singular values."""
    return int(np.sum(values > RANK_TOLERANCE * values.max(initial=0.0)))
