"""Quasi-static planar truss: tension and bending from the cable's length alone.

Virtual work of the spring (force F, strut length s) and the cable (tension T, length c) on the
one degree of freedom, without inertia and friction:

    F ds = T dc,   F = k (s_free - s),   T = F q p c / (b H s).

The upper beam is carried by its joint on the axis and at its outer end, where the cable pulls
towards the lower joint; lower and synchronising beam are without force, as neither carries a
load between its joints and they are not in line.  At the strut's head the moment is

    M(q) = T sin(C) (b - q),   sin(C) = H sin g / c,   C the angle between cable and beam,

and falls to zero at either end: along the straight line b - x beyond the head, and as

    M(x) = M(q) sinh(n x) / sinh(n q),   n^2 = N / (E I),   N = F cos(D) - T cos(C)

before it, where the strut (at the angle D to the beam) pulls the slender beam taut: N is up to
150 N, which takes a fifth of the moment off the middle of the beam.  Left out: the shift of the
head by the beam's deflection (about 1 mm in 500).  The strain of the outer fibre is M r / (E I).
Source: paper 001, section 4, for the features; statics by hand.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ringsim.parts.structure.planar_truss import PlanarTruss
from ringsim.scene import Scene

Array = NDArray[np.float64]


def spring_force(truss: PlanarTruss, cable: ArrayLike) -> Array:
    """Push of the deploying spring at cable lengths (m), N."""
    geometry = truss.geometry()
    strut = geometry.strut(geometry.angle(cable))
    return np.asarray(truss.spring.stiffness * (truss.spring.free_length - strut))


def tension(truss: PlanarTruss, cable: ArrayLike) -> Array:
    """Tension that holds the truss at cable lengths (m) above the stowed one, N."""
    geometry = truss.geometry()
    return spring_force(truss, cable) * geometry.strut_over_cable(geometry.angle(cable))


def bending_moment(scene: Scene, cable: ArrayLike, station: ArrayLike) -> Array:
    """Moment in the upper beam, N m, shape (stations, lengths).

    Parameters
    ----------
    cable
        Lengths of the cable, m, shape (lengths,).
    station
        Distances from the upper joint along the beam, m, shape (stations,).
    """
    truss = scene.structure
    assert isinstance(truss, PlanarTruss)
    geometry, force, pull = truss.geometry(), spring_force(truss, cable), tension(truss, cable)
    angle, length = geometry.angle(cable), np.asarray(cable, dtype=float)
    beam, head = geometry.beam, geometry.head
    across = geometry.axis * np.sin(angle) / length
    along_cable = (beam - geometry.axis * np.cos(angle)) / length
    along_strut = (head - geometry.foot * np.cos(angle)) / geometry.strut(angle)
    taut = force * along_strut - pull * along_cable
    wave = np.sqrt(taut / _stiffness(scene) + 1e-12j)
    x = np.asarray(station, dtype=float)[:, None]
    before = (np.sinh(wave * x) / np.sinh(wave * head)).real
    beyond = (beam - x) / (beam - head)
    return np.asarray(pull * across * (beam - head) * np.where(x <= head, before, beyond))


def bending_strain(scene: Scene, cable: ArrayLike, station: ArrayLike) -> Array:
    """Strain of the upper beam's outer fibre, shape (stations, lengths)."""
    radius = 0.5 * scene.rods.bar.outer_diameter
    return radius / _stiffness(scene) * bending_moment(scene, cable, station)


def _stiffness(scene: Scene) -> float:
    """Bending stiffness E I of the beams, N m^2."""
    return float(np.max(scene.rods.young_modulus)) * scene.rods.bar.second_moment
