"""The hinge assemblies at the ends of an open arc: pendulums on the pins of one section.

Their swings are psi_1 .. psi_4 (left upper, left lower, right upper, right lower), rad about the
section's normal.  A boom in the first one, on which the second slides, leaves the angle b between
these two: with a the distance of the pins from the assembly's centre and h the section's height,

    sin(psi_1) = a (1 - cos b) / h,   psi_2 = psi_1 + b.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.scene import Scene
from ringsim.structures.ring_geometry import RingGeometry
from ringsim.theory.ideal_points import SIGN, UP, Points

Array = NDArray[np.float64]

SENSE = np.array([-1.0, 1.0, 1.0, -1.0])
"""How the rods on the end assemblies turn while phi grows: about the section's normal or
against it."""
RIGID = 6
"""Rates of the core as one rigid body, V and W."""


class Reach(NamedTuple):
    """Point masses on the end assemblies at one instant.

    Attributes
    ----------
    arms, across
        From the pins to the masses, and the derivatives of that after their swings, shape
        (masses, 3), m.
    places
        Shape (masses, 3), m.
    jacobian
        Derivatives of the places after (V, W, p'), shape (masses, 3, 11).
    """

    arms: Array
    across: Array
    places: Array
    jacobian: Array


class Ends:
    """The end assemblies of an arc, as point masses; the first four are their centres.

    Attributes
    ----------
    swing
        Which swing each mass takes part in, from 0.
    pins
        Coefficients of its pin (ringsim.theory.ideal_points), shape (masses, 3, 4).
    normals
        Axis of its pin, shape (masses, 3).
    masses
        Shape (masses,), kg.
    """

    def __init__(self, scene: Scene, geometry: RingGeometry, points: Points) -> None:
        hung, arms = boom_masses(scene)
        first, last = geometry.directions[0], geometry.directions[-1]
        out = geometry.hinge_offset * np.stack([-first, -first, last, last])
        whole = np.concatenate([out, out[0] + arms])
        self.swing = np.concatenate([np.arange(4), np.zeros(len(hung), dtype=np.intp)])
        own = [points.left[0, 0], points.left[1, 0], points.right[0, -1], points.right[1, -1]]
        self.pins = np.stack(own)[self.swing]
        self.normals = geometry.normals[[0, 0, -1, -1]][self.swing]
        self.masses = np.concatenate([np.full(4, scene.structure.corner_mass), hung])
        self._beside = self.normals * np.einsum("ij,ij->i", self.normals, whole)[:, None]
        self._arms, self._ahead = whole - self._beside, np.cross(self.normals, whole)

    def reach(self, basis: Array, swings: Array) -> Reach:
        """The masses at swings in rad, shape (4,)."""
        angle = swings[self.swing][:, None]
        c, s = np.cos(angle), np.sin(angle)
        arms = self._beside + c * self._arms + s * self._ahead
        across = c * self._ahead - s * self._arms
        places = self.pins @ basis[0] + arms
        x, y, z = places.T
        jacobian = np.zeros((len(arms), 3, RIGID + 5))
        jacobian[:, [0, 1, 2], [0, 1, 2]] = 1.0
        jacobian[:, 0, 4], jacobian[:, 0, 5] = z, -y
        jacobian[:, 1, 3], jacobian[:, 1, 5] = -z, x
        jacobian[:, 2, 3], jacobian[:, 2, 4] = y, -x
        jacobian[:, :, 6] = self.pins @ basis[1]
        jacobian[np.arange(len(arms)), :, 7 + self.swing] = across
        return Reach(arms, across, places, jacobian)

    def accelerations(self, reach: Reach, basis: Array, rates: Array, turn: Array) -> Array:
        """Of the masses at zero (V' + W x V, W', p''), shape (masses, 3), m/s^2.

        Parameters
        ----------
        rates
            Of p, rad/s.
        turn
            The matrix [W]x, rad/s.
        """
        swinging = rates[1 + self.swing][:, None]
        velocity = rates[0] * reach.jacobian[:, :, 6] + swinging * reach.across
        found = rates[0] ** 2 * (self.pins @ basis[2])
        found += swinging**2 * (self._beside - reach.arms)
        return np.asarray(found + reach.places @ (turn @ turn).T + 2.0 * velocity @ turn.T)

    def spins(self) -> Array:
        """Sum over the assemblies of A^T A, A their rate of turn after (V, W, p'), (11, 11)."""
        turns = np.zeros((4, 3, RIGID + 5))
        turns[:, :, 3:6] = np.eye(3)
        turns[np.arange(4), :, 7 + np.arange(4)] = self.normals[:4]
        return np.asarray(np.einsum("iaj,iak->jk", turns, turns))


def on_the_boom(
    geometry: RingGeometry, basis: Array, free: Array, rates: Array
) -> tuple[Array, Array, Array]:
    """p, its derivatives after (phi, b, psi_3, psi_4), and p'' at zero accelerations of these.

    The second derivatives come from sin(psi_1) h = a (1 - cos b), differentiated twice.  NaN
    where the boom blocks the lower assembly.
    """
    offset, b, b_rate, phi_rate = geometry.hinge_offset, free[1], rates[1], rates[0]
    h, h_slope, h_bend = 2.0 * geometry.half_diagonal * basis[:, 3]
    lean = offset * (1.0 - math.cos(b)) / h
    angle = math.asin(lean) if abs(lean) < 1.0 else math.nan
    level = h * math.cos(angle)
    by_b, by_phi = offset * math.sin(b) / level, -lean * h_slope / level
    rate = by_b * b_rate + by_phi * phi_rate
    bias = (
        offset * math.cos(b) * b_rate**2
        + rate**2 * h * lean
        - 2.0 * rate * math.cos(angle) * h_slope * phi_rate
        - lean * h_bend * phi_rate**2
    ) / level
    slopes = np.zeros((5, 4))
    slopes[0, 0] = slopes[3, 2] = slopes[4, 3] = slopes[2, 1] = 1.0
    slopes[1:3, 0] = by_phi
    slopes[1:3, 1] += by_b
    place = np.array([free[0], angle, angle + b, free[2], free[3]])
    return place, slopes, np.array([0.0, bias, bias, 0.0, 0.0])


def boom_masses(scene: Scene) -> tuple[Array, Array]:
    """Point masses of the boom and their places from the first upper assembly's centre."""
    boom = scene.boom
    if boom is None:
        return np.zeros(0), np.zeros((0, 3))
    tube = boom.tube
    reach = math.sqrt(3.0 / 16.0 * (tube.outer_diameter**2 + tube.inner_diameter**2))
    down = -boom.length * UP
    sides = [0.5 * down + sign * reach * way for way in np.eye(3)[:2] for sign in SIGN]
    return np.full(6, boom.mass / 6.0), np.array([0.0 * down, down, *sides])
