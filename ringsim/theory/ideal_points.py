"""Every point of an ideal ring as a linear function of four numbers.

With the bar angle phi, half bar l, half diagonal d and the diagonals' angle theta,
d cos(theta) = l cos(phi), let

    s(phi) = (1, cos(phi), sin(phi), sin(theta)),   sin(theta) = sqrt(1 - (l / d)^2 cos(phi)^2).

The distance of two corners 2 (l cos(phi) + a), half the height d sin(theta) and the rods'
directions are linear in s, so every point is r = P s with a constant P of shape (3, 4), and its
derivatives after phi are P s' and P s''.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ringsim.structures.ring_geometry import RingGeometry

Array = NDArray[np.float64]

UP = np.array([0.0, 0.0, 1.0])
SIGN = np.array([1.0, -1.0])
"""Upper and lower plane."""
_ONE, _COS, _SIN, _HEIGHT = np.eye(4)


@dataclass(frozen=True)
class Points:
    """Coefficients of the named points, each shape (..., 3, 4), m.

    Attributes
    ----------
    corners
        Centres of the hinge assemblies, shape (2, corners, 3, 4).
    left, right
        Pins of a section at its first and second corner, shape (2, sections, 3, 4).
    vjoints
        Middle joints of the folding bars, shape (2, sections, 3, 4).
    """

    corners: Array
    left: Array
    right: Array
    vjoints: Array


def basis(geometry: RingGeometry, phi: float) -> Array:
    """The functions s and their first and second derivatives after phi, shape (3, 4).

    NaN where the diagonals are too short.
    """
    ratio = (geometry.half_bar / geometry.half_diagonal) ** 2
    c, s = math.cos(phi), math.sin(phi)
    rest = 1.0 - ratio * c * c
    h = math.sqrt(rest) if rest > 0.0 else math.nan
    slope = ratio * c * s / h
    bend = (ratio * (c * c - s * s) - slope * slope) / h
    return np.array([[1.0, c, s, h], [0.0, -s, c, slope], [0.0, -c, -s, bend]])


def points_of(geometry: RingGeometry) -> Points:
    """Coefficients of corners, pins and V-joints about the polygon's centre."""
    bar, offset = geometry.half_bar, geometry.hinge_offset
    chord = 2.0 * (bar * _COS + offset * _ONE)
    lift = SIGN[:, None, None, None] * np.outer(UP, geometry.half_diagonal * _HEIGHT)
    first = geometry.plan[: geometry.sections]
    second = np.roll(geometry.plan, -1, axis=0)[: geometry.sections]
    inside = _outer(geometry.directions, offset * _ONE)
    drop = SIGN[:, None, None, None] * np.outer(UP, bar * _SIN)
    return Points(
        corners=_outer(geometry.plan, chord) + lift,
        left=_outer(first, chord) + inside + lift,
        right=_outer(second, chord) - inside + lift,
        vjoints=_outer(0.5 * (first + second), chord) + lift - drop,
    )


def point_masses(
    geometry: RingGeometry,
    points: Points,
    diagonal: tuple[float, float],
    bar: tuple[float, float],
    vjoint: float,
) -> tuple[Array, Array]:
    """Point masses equivalent to rods and V-joints, shape (n,) and (n, 3, 4).

    A rod of mass m is m / 6 at its ends and 2 m / 3 in its middle (Simpson's rule, exact for what
    quadratics along it), the latter spread over four points across the rod so that its
    cross-sections' own rotation counts.

    Parameters
    ----------
    diagonal, bar
        Mass per length (kg/m) and transverse rotary inertia per length (kg m).
    vjoint
        Mass of a V-joint, kg.
    """
    along, ratio = geometry.directions, geometry.half_bar / geometry.half_diagonal
    normals = _outer(geometry.normals, _ONE)
    tall = np.outer(UP, _COS)
    slant = _outer(along, _SIN)
    steep = _outer(along, _HEIGHT)
    masses, places = [np.full(points.vjoints[..., 0, 0].size, vjoint)], [points.vjoints]
    left, right, middle = points.left, points.right, points.vjoints
    slanted = (*diagonal, 2.0 * geometry.half_diagonal)
    folding = (*bar, geometry.half_bar)
    for start, end, across, (density, inertia, length) in (
        (left[1], right[0], ratio * tall - steep, slanted),
        (left[0], right[1], ratio * tall + steep, slanted),
        (left[0], middle[0], tall + slant, folding),
        (middle[0], right[0], tall - slant, folding),
        (left[1], middle[1], tall - slant, folding),
        (middle[1], right[1], tall + slant, folding),
    ):
        share = density * length / 6.0
        reach = math.sqrt(3.0 * inertia / density)
        centre = 0.5 * (start + end)
        sides = [centre + sign * reach * way for way in (across, normals) for sign in (1.0, -1.0)]
        masses.append(np.full(6 * len(start), share))
        places += [start, end, *sides]
    return np.concatenate(masses), np.concatenate([p.reshape(-1, 3, 4) for p in places])


def _outer(vectors: Array, function: Array) -> Array:
    return np.asarray(vectors[..., :, None] * function)
