"""Quasi-static planar truss: tension and bending from the cable's length alone.

Moments about the upper joint hold the spring (force F along the strut) and the cable (tension T)
in balance, without inertia and friction.  With a straight beam that is the virtual work of the
one degree of freedom,

    F ds = T dc,   F = k (s_free - s),   T = F q p c / (b H s).

The upper beam is carried by its joint on the axis and at its outer end, where the cable pulls
towards the lower joint; lower and synchronising beam are without force, as neither carries a
load between its joints and they are not in line.  At the strut's head the moment is

    M(q) = T sin(C) (b - q),   sin(C) = H sin g / c,   C the angle between cable and beam,

and falls to zero at either end: along the straight line b - x beyond the head, and as

    M(x) = M(q) sinh(n x) / sinh(n q),   n^2 = N / (E I),   N = F cos(D) - T cos(C)

before it, where the strut (at the angle D to the beam) pulls the slender beam taut.  The head
stands off the straight line by

    w = M(q) q (b - q) / (E I b) ((b - q) / 3 + q f(n q)),   f(z) = (z coth z - 1) / z^2,

f(0) = 1/3 being the textbook's deflection at a force between two supports.  It lengthens the
strut and turns it: F, D and T are those of the displaced head, found by repetition.  Left out:
the shortening of the beam's chord (of the order w^2 / b) and its stretch N / (E A).  The strain
of the outer fibre is M r / (E I).
Source: paper 001, section 4, for the features; own statics.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ringsim.scene import Scene
from ringsim.structures.planar_truss import PlanarTruss, TrussGeometry

Array = NDArray[np.float64]
_REPETITIONS = 12
"""Each reduces the error of the deflection a hundredfold, as it changes the moment by 1 %."""


@dataclass(frozen=True)
class TrussStatics:
    """Forces on the upper beam at some lengths of the cable; arrays of shape (lengths,).

    Attributes
    ----------
    push, tension
        Force of the spring and of the cable, N.
    deflection
        Distance of the strut's head from the beam's chord, m.
    moment
        Bending moment at the head, N m.
    pull
        Force N along the beam between its joint and the head, positive where taut, N.
    """

    push: Array
    tension: Array
    deflection: Array
    moment: Array
    pull: Array


def spring_force(truss: PlanarTruss, cable: ArrayLike) -> Array:
    """Push of the deploying spring at cable lengths (m) with rigid beams, N."""
    geometry = truss.geometry()
    strut = geometry.strut(geometry.angle(cable))
    return np.asarray(-truss.spring.reaction(strut - truss.spring.free_length, 0.0, None).elastic)


def tension(truss: PlanarTruss, cable: ArrayLike) -> Array:
    """Tension that holds a truss with rigid beams at cable lengths (m) above the stowed one, N."""
    geometry = truss.geometry()
    return spring_force(truss, cable) * strut_over_cable(geometry, geometry.angle(cable))


def strut_over_cable(geometry: TrussGeometry, angle: ArrayLike) -> Array:
    """Ratio (ds/dg) / (dc/dg) = q p c / (b H s), finite even where the truss is folded flat: the
    cable keeps its hold there, although neither length changes.
    """
    sides = geometry.head * geometry.foot / (geometry.beam * geometry.axis)
    return np.asarray(sides * geometry.cable(angle) / geometry.strut(angle))


def statics(scene: Scene, cable: ArrayLike) -> TrussStatics:
    """Balance of the truss with an elastic upper beam at lengths of the cable (m)."""
    truss = scene.structure
    assert isinstance(truss, PlanarTruss)
    geometry, length = truss.geometry(), np.asarray(cable, dtype=float)
    angle = geometry.angle(length)
    beam, head, foot = geometry.beam, geometry.head, geometry.foot
    # Directions in the frame of the chord: along it, and across it on the side the strut pushes to.
    cable_across = geometry.axis * np.sin(angle) / length
    cable_along = (beam - geometry.axis * np.cos(angle)) / length
    bend = np.zeros_like(angle)
    for _ in range(_REPETITIONS):
        along, across = head - foot * np.cos(angle), bend + foot * np.sin(angle)
        strut = np.hypot(along, across)
        push = -truss.spring.reaction(strut - truss.spring.free_length, 0.0, None).elastic
        lever = (head * across - bend * along) / strut
        hold = push * lever / (beam * cable_across)
        pull = push * along / strut - hold * cable_along
        moment = hold * (cable_across * (beam - head) + cable_along * bend)
        slope = (beam - head) / 3.0 + head * _taut(_wave(scene, pull) * head)
        bend = moment * head * (beam - head) / (_stiffness(scene) * beam) * slope
    return TrussStatics(push, hold, bend, moment, pull)


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
    balance, beam, head = statics(scene, cable), truss.beam_length, truss.strut_head
    wave = _wave(scene, balance.pull)
    x = np.asarray(station, dtype=float)[:, None]
    before = (np.sinh(wave * x) / np.sinh(wave * head)).real
    beyond = (beam - x) / (beam - head)
    return np.asarray(balance.moment * np.where(x <= head, before, beyond))


def bending_strain(scene: Scene, cable: ArrayLike, station: ArrayLike) -> Array:
    """Strain of the upper beam's outer fibre, shape (stations, lengths)."""
    radius = 0.5 * scene.rods.bar.outer_diameter
    return radius / _stiffness(scene) * bending_moment(scene, cable, station)


def _wave(scene: Scene, pull: Array) -> NDArray[np.complex128]:
    """Wave number n, 1/m: real in tension, imaginary in compression, never exactly zero."""
    return np.asarray(np.sqrt(pull / _stiffness(scene) + 1e-12j))


def _taut(z: NDArray[np.complex128]) -> Array:
    """f(z) = (z coth z - 1) / z^2, by its series where the quotient would lose precision."""
    square = z * z
    small = np.abs(square) < 1e-4
    safe = np.where(small, 1.0, z)
    whole = (safe / np.tanh(safe) - 1.0) / safe**2
    return np.asarray(np.where(small, 1.0 / 3.0 - square / 45.0, whole).real)


def _stiffness(scene: Scene) -> float:
    """Bending stiffness E I of the beams, N m^2."""
    return float(np.max(scene.rods.young_modulus)) * scene.rods.bar.second_moment
