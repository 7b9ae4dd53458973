"""How many ways a ring of rigid parts can move, counted and computed.

Bodies are the two diagonals and four bar halves of every section and the upper and lower hinge
assembly of every corner; joints are the pivot, two V-joints and eight hinge pins of every
section, each a revolute about the section's normal.

The Kutzbach count 6 (bodies - 1) - 5 joints comes out far below zero (-7 N - 6 for a closed
ring): it takes all constraints for independent, which parallel axes and equal lengths are not.
The true mobility at a fold state is the dimension of the null space of the constraint Jacobian.

- A section for itself has five internal freedoms: it folds, and each of its four hinge
  assemblies tilts about the common axis of the two rods that it carries.
- Where two sections meet, both share the upper and the lower hinge assembly.  Their normals
  differ, so neither assembly can tilt about both: the tilt is gone, and what is left makes
  both sections equally high.
- An open arc therefore keeps five freedoms whatever its length (the fold, and the tilts of the
  four assemblies at its ends), and a closed ring has one: the fold.
- At 180 deg exactly the state is singular: the bars lie straight, the sections' width is
  stationary, and each of the 2 N V-joints can start to move by itself instead of with the fold.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.structures.ring_geometry import RingGeometry

Array = NDArray[np.float64]

RANK_TOLERANCE = 1e-9
"""Singular values below this fraction of the largest are zeros.  Round-off leaves 1e-15; the
smallest true one is 5e-4 half open and 6e-8 at 0.01 deg for a ring of 120 sections."""

_ROD_ENDS = (
    ("lower_left", "pivot", "upper_right"),
    ("upper_left", "pivot", "lower_right"),
    ("upper_left", "upper_vjoint"),
    ("upper_vjoint", "upper_right"),
    ("lower_left", "lower_vjoint"),
    ("lower_vjoint", "lower_right"),
)
_HINGES = ("upper_left", "lower_left", "upper_right", "lower_right")
_BODIES = len(_ROD_ENDS) + len(_HINGES)
_LEFT = slice(6 * len(_ROD_ENDS), 6 * len(_ROD_ENDS) + 12)
_RIGHT = slice(6 * len(_ROD_ENDS) + 12, 6 * _BODIES)


def kutzbach_count(sections: int, *, closed: bool) -> int:
    """Mobility as 6 (bodies - 1) - 5 joints, which overconstrained linkages exceed."""
    corners = sections if closed else sections + 1
    return 6 * (6 * sections + 2 * corners - 1) - 5 * 11 * sections


def internal_mobility(geometry: RingGeometry, phi: float) -> int:
    """Degrees of freedom of the ring of rigid parts beyond its six as one rigid body.

    First the motions of one section are found (they are the same for all, seen along its own
    axes), then those of all sections are joined at the hinge assemblies that they share.

    Parameters
    ----------
    geometry
        The ideal ring or arc.
    phi
        Bar angle of the fold state in rad, between 0 (deployed) and pi/2 (stowed).

    Returns
    -------
    int
        1 for a closed ring and 5 for an open arc; at 180 deg 2 N and 2 N + 4.
    """
    points = _section_points(geometry, phi)
    motions = _null_space(_section_jacobian(points))
    corner = np.array([0.5 * geometry.width(phi) + geometry.hinge_offset, 0.0, 0.0])
    corner = corner / geometry.half_diagonal
    axes = np.stack(
        [
            geometry.directions,
            -geometry.normals,
            np.tile([0.0, 0.0, 1.0], (geometry.sections, 1)),
        ],
        axis=-1,
    )
    left = np.stack([_twists_at(motions[_LEFT], -corner, turn) for turn in axes])
    right = np.stack([_twists_at(motions[_RIGHT], corner, turn) for turn in axes])

    sections, free = geometry.sections, motions.shape[1]
    shared = sections if geometry.closed else sections - 1
    joined = np.zeros((shared, 12, sections, free))
    for k in range(shared):
        joined[k, :, k] += right[k]
        joined[k, :, (k + 1) % sections] -= left[(k + 1) % sections]
    rank = _rank(joined.reshape(shared * 12, sections * free))
    return int(sections * free - rank - 6)


def _section_points(geometry: RingGeometry, phi: float) -> dict[str, Array]:
    """Joints of one section about its middle (along, outward, up), in half diagonals."""
    width, height = geometry.width(phi), geometry.height(phi)
    dip = geometry.half_bar * float(np.sin(phi))
    points = {"pivot": (0.0, 0.0)}
    for plane, sign in (("upper", 1.0), ("lower", -1.0)):
        points[f"{plane}_left"] = (-0.5 * width, 0.5 * sign * height)
        points[f"{plane}_right"] = (0.5 * width, 0.5 * sign * height)
        points[f"{plane}_vjoint"] = (0.0, sign * (0.5 * height - dip))
    return {
        name: np.array([along, 0.0, up]) / geometry.half_diagonal
        for name, (along, up) in points.items()
    }


def _section_jacobian(points: dict[str, Array]) -> Array:
    """Five velocity constraints per revolute, shape (55, 60).

    Unknown per body: velocity of the point at the section's middle, then angular velocity.
    """
    rows = []
    for name, point in points.items():
        bodies = [body for body, ends in enumerate(_ROD_ENDS) if name in ends]
        if name in _HINGES:
            bodies.append(len(_ROD_ENDS) + _HINGES.index(name))
        for other in bodies[:-1]:
            row = np.zeros((5, _BODIES, 6))
            row[:, other] = _pinned(point)
            row[:, bodies[-1]] = -_pinned(point)
            rows.append(row.reshape(5, -1))
    return np.concatenate(rows)


def _pinned(point: Array) -> Array:
    """What a revolute about the outward axis compares, shape (5, 6): v + w x r, w_x, w_z."""
    compared = np.zeros((5, 6))
    compared[:3, :3] = np.eye(3)
    compared[:3, 3:] = -_cross_matrix(point)
    compared[3, 3] = compared[4, 5] = 1.0
    return compared


def _twists_at(motions: Array, point: Array, turn: Array) -> Array:
    """Twists of two bodies at ``point`` for every motion, turned into the ring's axes."""
    velocity, spin = motions.reshape(2, 2, 3, -1).transpose(1, 0, 2, 3)
    velocity = velocity - _cross_matrix(point) @ spin
    return np.concatenate([turn @ velocity, turn @ spin], axis=1).reshape(12, -1)


def _cross_matrix(r: Array) -> Array:
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def _null_space(matrix: Array) -> Array:
    _, values, rows = np.linalg.svd(matrix)
    rank = int(np.sum(values > RANK_TOLERANCE * values[0]))
    return np.asarray(rows[rank:].T)


def _rank(matrix: Array) -> int:
    if matrix.size == 0:
        return 0
    values = np.linalg.svd(matrix, compute_uv=False)
    return int(np.sum(values > RANK_TOLERANCE * values[0]))
