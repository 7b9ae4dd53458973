"""Quasi-static planar truss: tension and bending from the cable's length alone.

Virtual work of the spring (force F, strut length s) and the cable (tension T, length c) on the
one degree of freedom, without inertia and friction:

    F ds = T dc,   F = k (s_free - s),   T = F q p c / (b H s).

The upper beam is carried by its joint on the axis and at its outer end, where the cable pulls
towards the lower joint; lower and synchronising beam are without force, as neither carries a
load between its joints and they are not in line.  The strut's push at the head q bends it to

    M(x) = T sin(C) (b - q) x / q  for x <= q,      T sin(C) (b - x)  beyond,

sin(C) = H sin g / c the sine of the angle between cable and beam.  The strain of the outer fibre
is M r / (E I).  Source: paper 001, section 4, for the features; statics by hand.
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


def bending_moment(truss: PlanarTruss, cable: ArrayLike, station: ArrayLike) -> Array:
    """Moment in the upper beam, N m, shape (stations, lengths).

    Parameters
    ----------
    cable
        Lengths of the cable, m.
    station
        Distances from the upper joint along the beam, m.
    """
    geometry = truss.geometry()
    angle, x = geometry.angle(cable), np.atleast_1d(np.asarray(station, dtype=float))[:, None]
    across = tension(truss, cable) * geometry.axis * np.sin(angle) / geometry.cable(angle)
    span, head = geometry.beam, geometry.head
    lever = np.where(x <= head, (span - head) * x / head, span - x)
    return np.asarray(lever * across)


def bending_strain(scene: Scene, cable: ArrayLike, station: ArrayLike) -> Array:
    """Strain of the upper beam's outer fibre, shape (stations, lengths)."""
    truss, rods = scene.structure, scene.rods
    assert isinstance(truss, PlanarTruss)
    stiffness = float(np.max(rods.young_modulus)) * rods.bar.second_moment
    moment = bending_moment(truss, cable, station)
    return np.asarray(0.5 * rods.bar.outer_diameter * moment / stiffness)
