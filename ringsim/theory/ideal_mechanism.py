"""The ideal ring as a mechanism: its coordinates, its mass, its equations of motion.

A closed ring of rigid rods has one coordinate, the bar angle phi.  An open arc has the swings psi
of its four end assemblies besides (ringsim.theory.ideal_ends): five coordinates, or four where a
boom joins two of them.

All but the end assemblies is the core: it moves as one rigid body (velocity V, rotation W, along
the core's own axes) and folds.  For masses m at r(p), p = (phi, psi),

    sum m J^T (J (V' + W x V, W', p'') + W x (W x r) + 2 W x r' + r'') = forces,
    J = (1, -[r]x, dr/dp),

Kane's equations.  A base that floats has no force on the core's translation; a fixed one holds
the first upper assembly, and so gives V and W as functions of p and p'.
Source: Kane and Levinson, Dynamics: Theory and Applications (1985), secs. 4.11 and 6.1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.scene import Scene
from ringsim.theory.ideal_ends import RIGID, Ends, Reach, boom_masses, on_the_boom
from ringsim.theory.ideal_points import UP, basis, point_masses, points_of

Array = NDArray[np.float64]


def skew(r: Array) -> Array:
    """The matrix [r]x."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def _axial(w: Array) -> Array:
    """Sum of a x b from the sum of a b^T."""
    return np.array([w[1, 2] - w[2, 1], w[2, 0] - w[0, 2], w[0, 1] - w[1, 0]])


class Pose(NamedTuple):
    """Coordinates and rates of the mechanism at one instant.

    Attributes
    ----------
    basis
        s, s', s'' of ringsim.theory.ideal_points, shape (3, 4).
    place, rate
        p = (phi, psi) and its rate, shape (1,) or (5,), rad and rad/s.
    slopes
        Derivatives of p after the free coordinates, shape (len(p), freedom).
    bias
        p'' less slopes times the free accelerations, rad/s^2.
    reach
        The end assemblies of an open arc.
    held
        On a fixed base: derivatives of (V, W) after p', and what is left of their rates.
    """

    basis: Array
    place: Array
    rate: Array
    slopes: Array
    bias: Array
    reach: Reach | None = None
    held: tuple[Array, Array] | None = None


class Mechanism:
    """Coordinates, masses and equations of the ideal ring of a scene.

    Attributes
    ----------
    geometry, points
        Its fold states, and the coefficients of its points.
    ends
        The end assemblies of an open arc.
    freedom
        Number of free coordinates: 1, or 4 or 5 for an open arc; phi is the first.
    fixed
        Whether the first upper assembly is held.
    """

    def __init__(self, scene: Scene) -> None:
        ring, rods, boom = scene.structure, scene.rods, scene.boom
        self.geometry = ring.geometry()
        self.points = points_of(self.geometry)
        self.fixed = boom is not None and boom.base == "fixed"
        self.freedom = 1 if ring.closed else 5 if boom is None else 4
        self._along = self.geometry.directions[0]
        diagonal, bar = (
            (rods.density * tube.area, rods.density * tube.second_moment)
            for tube in (rods.diagonal, rods.bar)
        )
        masses, places = point_masses(self.geometry, self.points, diagonal, bar, ring.vjoint_mass)
        corners = self.points.corners
        inner = corners if ring.closed else corners[:, 1:-1]
        inner = inner.reshape(-1, 3, 4)
        masses = np.concatenate([masses, np.full(len(inner), ring.corner_mass)])
        places = np.concatenate([places, inner])
        spin = ring.corner_mass * ring.hinge_size**2 / 6.0
        self._core_spin = spin * len(inner)
        self.ends: Ends | None = None
        if ring.closed:
            hung, arms = boom_masses(scene)
            masses = np.concatenate([masses, hung])
            places = np.concatenate([places, corners[0, 0] + arms[:, :, None] * np.eye(4)[0]])
        else:
            self.ends = Ends(scene, self.geometry, self.points)
            self._hinge_spin, self._end_spin = spin, spin * self.ends.spins()
        self._mass = float(masses.sum())
        self._first = np.einsum("i,iap->ap", masses, places)
        self._second = np.einsum("i,iap,ibq->apbq", masses, places, places)

    def pose(self, free: Array, rates: Array) -> Pose:
        """Pose of the mechanism at free coordinates (rad) and their rates (rad/s)."""
        s = basis(self.geometry, float(free[0]))
        if self.ends is None:
            found = Pose(s, free, rates, np.ones((1, 1)), np.zeros(1))
        else:
            place, slopes, bias = free, np.eye(5), np.zeros(5)
            if self.freedom == 4:
                place, slopes, bias = on_the_boom(self.geometry, s, free, rates)
            reach = self.ends.reach(s, place[1:])
            found = Pose(s, place, slopes @ rates, slopes, bias, reach)
        return found._replace(held=self._held(found)) if self.fixed else found

    def corner_motion(self, pose: Pose) -> tuple[Array, Array]:
        """Upper corners and their derivatives after p, shapes (corners, 3), (corners, 3, p), m."""
        upper = self.points.corners[0]
        places, slopes = upper @ pose.basis[0], np.zeros((len(upper), 3, len(pose.place)))
        slopes[:, :, 0] = upper @ pose.basis[1]
        if pose.reach is not None:
            places[[0, -1]] = pose.reach.places[[0, 2]]
            slopes[[0, -1]] = pose.reach.jacobian[[0, 2], :, RIGID:]
        return places, slopes

    def vertical(self, pose: Pose) -> Array:
        """Unit vector that points up in space, in the core's axes, of a ring that cannot pitch."""
        if self.ends is None or not self.fixed:
            return UP
        angle = pose.place[1]
        return np.asarray(math.cos(angle) * UP - math.sin(angle) * self._along)

    def mass(self, pose: Pose) -> Array:
        """Mass matrix of (V, W, p), shape (6 + len(p), 6 + len(p))."""
        size = RIGID + len(pose.place)
        matrix = np.zeros((size, size))
        first = self._first @ pose.basis[:2].T
        second = self._seconds(pose.basis[:2])
        matrix[:3, :3] = self._mass * np.eye(3)
        matrix[:3, 3:6] = -skew(first[:, 0])
        matrix[3:6, 3:6] = (np.trace(second[0, 0]) + self._core_spin) * np.eye(3) - second[0, 0]
        matrix[:3, 6] = first[:, 1]
        matrix[3:6, 6] = _axial(second[0, 1])
        matrix[6, 6] = np.trace(second[1, 1])
        matrix[3:6, :3] = matrix[:3, 3:6].T
        matrix[6, :6] = matrix[:6, 6]
        if self.ends is not None and pose.reach is not None:
            flat = pose.reach.jacobian.reshape(-1, size)
            matrix += (flat.T * np.repeat(self.ends.masses, 3)) @ flat + self._end_spin
        return matrix

    def inertial(self, pose: Pose, spin: Array) -> Array:
        """Mass times acceleration at zero (V' + W x V, W', p''), shape (6 + len(p),)."""
        rate, turn = pose.rate[0], skew(spin)
        first = self._first @ pose.basis.T
        second = self._seconds(pose.basis)
        whirl = turn @ turn
        found = np.zeros(RIGID + len(pose.place))
        found[:3] = whirl @ first[:, 0] + 2.0 * rate * turn @ first[:, 1] + rate**2 * first[:, 2]
        about, along = (
            second[k, 0] @ whirl.T + 2.0 * rate * second[k, 1] @ turn.T + rate**2 * second[k, 2]
            for k in (0, 1)
        )
        found[3:6] = _axial(about)
        found[6] = np.trace(along)
        if self.ends is not None and pose.reach is not None:
            moving = self.ends.accelerations(pose.reach, pose.basis, pose.rate, turn)
            flat = pose.reach.jacobian.reshape(-1, len(found))
            found += (self.ends.masses[:, None] * moving).ravel() @ flat
            found[3:6] += self._hinge_spin * turn @ (pose.rate[1:] @ self.ends.normals[:4])
        return found

    def rigid_rates(self, pose: Pose, matrix: Array, spin: Array | None = None) -> Array:
        """V and W of the core, shape (6,).

        On a fixed base those that hold the first assembly; else those without momentum, with the
        rotation ``spin`` (rad/s) or, if None, without angular momentum too.
        """
        if pose.held is not None:
            return np.asarray(pose.held[0] @ pose.rate)
        if spin is None:
            return np.asarray(np.linalg.solve(matrix[:6, :6], -matrix[:6, 6:] @ pose.rate))
        momentum = matrix[:3, 3:6] @ spin + matrix[:3, 6:] @ pose.rate
        return np.concatenate([-momentum / matrix[0, 0], spin])

    def accelerations(
        self, pose: Pose, matrix: Array, spin: Array, torque: Array, forces: Array
    ) -> tuple[Array, Array]:
        """Accelerations of the free coordinates, and W' of a base that floats; rad/s^2.

        Parameters
        ----------
        matrix
            From ``mass``.
        spin
            W, rad/s.
        torque
            On the core, N m, shape (3,).
        forces
            Generalised forces on p, N m.
        """
        load = np.concatenate([np.zeros(3), torque, forces]) - self.inertial(pose, spin)
        load -= matrix[:, 6:] @ pose.bias
        if pose.held is not None:
            slopes, bias = pose.held
            load -= matrix[:, :6] @ (slopes @ pose.bias + bias)
            reach = np.concatenate([slopes @ pose.slopes, pose.slopes])
            return np.asarray(np.linalg.solve(reach.T @ matrix @ reach, reach.T @ load)), UP * 0.0
        if self.freedom < len(pose.place):
            reach = np.zeros((len(matrix), RIGID + self.freedom))
            reach[:6, :6] = np.eye(6)
            reach[6:, 6:] = pose.slopes
            matrix, load = reach.T @ matrix @ reach, reach.T @ load
        found = np.linalg.solve(matrix, load)
        return np.asarray(found[6:]), np.asarray(found[3:6])

    def _held(self, pose: Pose) -> tuple[Array, Array]:
        """What holds the first upper assembly, see ``Pose``."""
        slopes, bias = np.zeros((RIGID, len(pose.place))), np.zeros(RIGID)
        rate = pose.rate[0]
        if self.ends is None or pose.reach is None:
            corner = self.points.corners[0, 0]
            slopes[:3, 0] = -corner @ pose.basis[1]
            bias[:3] = -(rate**2) * (corner @ pose.basis[2])
            return slopes, bias
        pin, place, across = self.ends.pins[0], pose.reach.places[0], pose.reach.across[0]
        turn, swing, sliding = skew(self.ends.normals[0]), pose.rate[1], pin @ pose.basis[1]
        slopes[3:, 1] = -self.ends.normals[0]
        slopes[:3, 0] = -sliding
        slopes[:3, 1] = turn @ place - across
        bias[:3] = -(rate**2) * (pin @ pose.basis[2]) + 2.0 * swing * rate * (turn @ sliding)
        bias[:3] += swing**2 * (turn @ (across - turn @ place))
        return slopes, bias

    def _seconds(self, s: Array) -> Array:
        """Sums of m (P s_i) (P s_j)^T, shape (i, j, 3, 3)."""
        return np.asarray(np.einsum("ip,apbq,jq->ijab", s, self._second, s))
