"""The ideal ring as a mechanism: its coordinates, its mass, its equations of motion.

A closed ring of rigid rods has one coordinate, the bar angle phi.  The four hinge assemblies at
the ends of an open arc hang on the pins of one section each, a distance a from their centres, and
swing about its normal by psi_1 .. psi_4: five coordinates.  A boom in the first upper assembly,
on which the lower one slides, leaves four: with h the height of the section and b the angle
between the two assemblies, sin(psi_1) = a (1 - cos b) / h, psi_2 = psi_1 + b.

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
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.scene import Scene
from ringsim.theory.ideal_points import SIGN, UP, Points, basis, point_masses, points_of

Array = NDArray[np.float64]

SENSE = np.array([-1.0, 1.0, 1.0, -1.0])
"""How the rods on the end assemblies (left upper, left lower, right upper, right lower) turn
while phi grows: about the section's normal or against it."""
_RIGID = 6
_NONE = np.zeros((0, 3))


def skew(r: Array) -> Array:
    """The matrix [r]x."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def _axial(w: Array) -> Array:
    """Sum of a x b from the sum of a b^T."""
    return np.array([w[1, 2] - w[2, 1], w[2, 0] - w[0, 2], w[0, 1] - w[1, 0]])


@dataclass(frozen=True)
class _Ends:
    """Point masses on the swinging assemblies; the first four are the assemblies' centres."""

    swing: NDArray[np.intp]
    pins: Array
    normals: Array
    masses: Array
    beside: Array
    """Part of each arm along the pin's axis, which does not turn."""
    arms: Array
    """The rest at psi = 0."""
    ahead: Array
    """The rest a quarter turn on."""


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
    arms, across
        From the pins to the point masses of the end assemblies, and the derivatives of that after
        their swings, shape (masses, 3), m.
    jacobian
        Derivatives of these masses' places after (V, W, p'), shape (masses, 3, 6 + len(p)).
    held
        On a fixed base: derivatives of (V, W) after p', and what is left of their rates.
    """

    basis: Array
    place: Array
    rate: Array
    slopes: Array
    bias: Array
    arms: Array = _NONE
    across: Array = _NONE
    jacobian: Array = _NONE
    held: tuple[Array, Array] = (_NONE, _NONE)


class Mechanism:
    """Coordinates, masses and equations of the ideal ring of a scene.

    Attributes
    ----------
    points
        See ringsim.theory.ideal_points.
    freedom
        Number of free coordinates: 1, or 4 or 5 for an open arc; phi is the first.
    fixed
        Whether the first upper assembly is held.
    """

    def __init__(self, scene: Scene) -> None:
        ring, rods, boom = scene.structure, scene.rods, scene.boom
        self.geometry = ring.geometry()
        self.points: Points = points_of(self.geometry)
        self.fixed = boom is not None and boom.base == "fixed"
        self._boom = boom is not None
        self._along = self.geometry.directions[0]
        tubes = [(rods.density * t.area, rods.density * t.second_moment)
                 for t in (rods.diagonal, rods.bar)]  # fmt: skip
        masses, places = point_masses(self.geometry, self.points, *tubes, ring.vjoint_mass)
        corners = self.points.corners
        inner = corners if ring.closed else corners[:, 1:-1]
        inner = inner.reshape(-1, 3, 4)
        hung, arms = _boom_masses(scene)
        self._hinge_spin = ring.corner_mass * ring.hinge_size**2 / 6.0
        self._core_spin = self._hinge_spin * len(inner)
        self.ends: _Ends | None = None
        if ring.closed:
            masses = np.concatenate([masses, np.full(len(inner), ring.corner_mass), hung])
            boom_places = corners[0, 0] + arms[:, :, None] * np.eye(4)[0]
            places = np.concatenate([places, inner, boom_places])
        else:
            masses = np.concatenate([masses, np.full(len(inner), ring.corner_mass)])
            places = np.concatenate([places, inner])
            self.ends = self._hang(ring.corner_mass, hung, arms)
            self._end_spin = self._end_spins()
        self.freedom = 1 if ring.closed else 4 if self._boom else 5
        self._mass = float(masses.sum())
        self._first = np.einsum("i,iap->ap", masses, places)
        self._second = np.einsum("i,iap,ibq->apbq", masses, places, places)

    def _hang(self, mass: float, hung: Array, arms: Array) -> _Ends:
        geometry, points = self.geometry, self.points
        first, last = geometry.directions[0], geometry.directions[-1]
        pins = np.stack([points.left[0, 0], points.left[1, 0],
                         points.right[0, -1], points.right[1, -1]])  # fmt: skip
        normals = geometry.normals[[0, 0, -1, -1]]
        out = geometry.hinge_offset * np.stack([-first, -first, last, last])
        swing = np.concatenate([np.arange(4), np.zeros(len(hung), dtype=np.intp)])
        pins, normals = pins[swing], normals[swing]
        whole = np.concatenate([out, out[0] + arms])
        beside = normals * np.einsum("ij,ij->i", normals, whole)[:, None]
        return _Ends(
            swing, pins, normals, np.concatenate([np.full(4, mass), hung]),
            beside, whole - beside, np.cross(normals, whole),
        )  # fmt: skip

    def pose(self, free: Array, rates: Array) -> Pose:
        """Where everything is at free coordinates (rad) and their rates (rad/s)."""
        found = self._pose(free, rates)
        return found._replace(held=self._held(found)) if self.fixed else found

    def _pose(self, free: Array, rates: Array) -> Pose:
        s = basis(self.geometry, float(free[0]))
        if self.ends is None:
            return Pose(s, free, rates, np.ones((1, 1)), np.zeros(1))
        if self._boom:
            place, rate, slopes, bias = self._on_the_boom(s, free, rates)
        else:
            place, rate, slopes, bias = free, rates, np.eye(5), np.zeros(5)
        return self._reach(Pose(s, place, rate, slopes, bias))

    def _reach(self, pose: Pose) -> Pose:
        """The same with arms, their slopes and the Jacobian of the end assemblies."""
        ends = self.ends
        assert ends is not None
        angle = pose.place[1 + ends.swing][:, None]
        c, s = np.cos(angle), np.sin(angle)
        arms, across = ends.beside + c * ends.arms + s * ends.ahead, c * ends.ahead - s * ends.arms
        x, y, z = (ends.pins @ pose.basis[0] + arms).T
        count = len(arms)
        jacobian = np.zeros((count, 3, _RIGID + 5))
        jacobian[:, [0, 1, 2], [0, 1, 2]] = 1.0
        jacobian[:, 0, 4], jacobian[:, 0, 5] = z, -y
        jacobian[:, 1, 3], jacobian[:, 1, 5] = -z, x
        jacobian[:, 2, 3], jacobian[:, 2, 4] = y, -x
        jacobian[:, :, 6] = ends.pins @ pose.basis[1]
        jacobian[np.arange(count), :, 7 + ends.swing] = across
        return pose._replace(arms=arms, across=across, jacobian=jacobian)

    def _on_the_boom(
        self, s: Array, free: Array, rates: Array
    ) -> tuple[Array, Array, Array, Array]:
        """The first upper assembly's swing from the angle b of the lower one against it."""
        offset, b, b_rate, phi_rate = self.geometry.hinge_offset, free[1], rates[1], rates[0]
        h, h_slope, h_bend = 2.0 * self.geometry.half_diagonal * s[:, 3]
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
        curving = np.array([0.0, bias, bias, 0.0, 0.0])
        return place, slopes @ rates, slopes, curving

    def corner_motion(self, pose: Pose) -> tuple[Array, Array]:
        """Upper corners and their derivatives after p, shapes (corners, 3), (corners, 3, p), m."""
        upper = self.points.corners[0]
        places, slopes = upper @ pose.basis[0], np.zeros((len(upper), 3, len(pose.place)))
        slopes[:, :, 0] = upper @ pose.basis[1]
        if self.ends is not None:
            for corner, end in ((0, 0), (-1, 2)):
                places[corner] = self.ends.pins[end] @ pose.basis[0] + pose.arms[end]
                slopes[corner, :, 0] = self.ends.pins[end] @ pose.basis[1]
                slopes[corner, :, 1 + end] = pose.across[end]
        return places, slopes

    def vertical(self, pose: Pose) -> Array:
        """Unit vector of a ring on a fixed base that points up in space, in the core's axes."""
        if self.ends is None or not self.fixed:
            return UP
        angle = pose.place[1]
        return np.asarray(math.cos(angle) * UP - math.sin(angle) * self._along)

    def mass(self, pose: Pose) -> Array:
        """Mass matrix of (V, W, p), shape (6 + len(p), 6 + len(p))."""
        size = _RIGID + len(pose.place)
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
        if self.ends is not None:
            flat = pose.jacobian.reshape(-1, size)
            matrix += (flat.T * np.repeat(self.ends.masses, 3)) @ flat + self._end_spin
        return matrix

    def inertial(self, pose: Pose, spin: Array) -> Array:
        """Inertial forces (mass times acceleration) at zero V' + W x V, W', p'', shape (6 + p,)."""
        rate, turn = pose.rate[0], skew(spin)
        first = self._first @ pose.basis.T
        second = self._seconds(pose.basis)
        whirl = turn @ turn
        found = np.zeros(_RIGID + len(pose.place))
        found[:3] = whirl @ first[:, 0] + 2.0 * rate * turn @ first[:, 1] + rate**2 * first[:, 2]
        about, along = (
            second[k, 0] @ whirl.T + 2.0 * rate * second[k, 1] @ turn.T + rate**2 * second[k, 2]
            for k in (0, 1)
        )
        found[3:6] = _axial(about)
        found[6] = np.trace(along)
        if self.ends is not None:
            swinging = pose.rate[1 + self.ends.swing][:, None]
            velocity = rate * pose.jacobian[:, :, 6] + swinging * pose.across
            bias = rate**2 * (self.ends.pins @ pose.basis[2])
            bias += swinging**2 * (self.ends.beside - pose.arms)
            places = self.ends.pins @ pose.basis[0] + pose.arms
            bias += places @ whirl.T + 2.0 * velocity @ turn.T
            flat = pose.jacobian.reshape(-1, len(found))
            found += (self.ends.masses[:, None] * bias).ravel() @ flat
            found[3:6] += self._hinge_spin * turn @ (pose.rate[1:] @ self.ends.normals[:4])
        return found

    def rigid_rates(self, pose: Pose, matrix: Array, spin: Array | None = None) -> Array:
        """V and W of the core, shape (6,).

        On a fixed base those that hold the first assembly; else those without momentum, with the
        rotation ``spin`` (rad/s) or, if None, without angular momentum too.
        """
        if self.fixed:
            return np.asarray(pose.held[0] @ pose.rate)
        if spin is None:
            return np.linalg.solve(matrix[:6, :6], -matrix[:6, 6:] @ pose.rate)
        momentum = matrix[:3, 3:6] @ spin + matrix[:3, 6:] @ pose.rate
        return np.concatenate([-momentum / matrix[0, 0], spin])

    def accelerations(
        self, pose: Pose, matrix: Array, spin: Array, torque: Array, forces: Array
    ) -> tuple[Array, Array]:
        """Accelerations of the free coordinates, rad/s^2, and W', rad/s^2.

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
        if self.ends is None and not self.fixed:
            found = np.linalg.solve(matrix, load)
            return found[6:], found[3:6]
        load -= matrix[:, 6:] @ pose.bias
        free = len(pose.slopes[0])
        reach = np.zeros((len(matrix), free if self.fixed else _RIGID + free))
        reach[6:, -free:] = pose.slopes
        if self.fixed:
            held, bias = pose.held
            reach[:6] = held @ pose.slopes
            load -= matrix[:, :6] @ (held @ pose.bias + bias)
        else:
            reach[:6, :6] = np.eye(6)
        found = np.linalg.solve(reach.T @ matrix @ reach, reach.T @ load)
        return found[-free:], found[3:6] if not self.fixed else np.zeros(3)

    def _held(self, pose: Pose) -> tuple[Array, Array]:
        """What holds the first upper assembly, see ``Pose``."""
        slopes, bias = np.zeros((6, len(pose.place))), np.zeros(6)
        rate = pose.rate[0]
        if self.ends is None:
            corner = self.points.corners[0, 0]
            slopes[:3, 0] = -corner @ pose.basis[1]
            bias[:3] = -(rate**2) * (corner @ pose.basis[2])
            return slopes, bias
        pin, across, swing = self.ends.pins[0], pose.across[0], pose.rate[1]
        place, velocity = pin @ pose.basis[0] + pose.arms[0], rate * (pin @ pose.basis[1])
        turn = skew(self.ends.normals[0])
        slopes[3:, 1] = -self.ends.normals[0]
        slopes[:3, 0] = -pin @ pose.basis[1]
        slopes[:3, 1] = turn @ place - across
        bias[:3] = -(rate**2) * (pin @ pose.basis[2]) + 2.0 * swing * (turn @ velocity)
        bias[:3] += swing**2 * (turn @ (across - turn @ place))
        return slopes, bias

    def _seconds(self, s: Array) -> Array:
        """Sums of m (P s_i) (P s_j)^T, shape (i, j, 3, 3)."""
        return np.einsum("ip,apbq,jq->ijab", s, self._second, s)

    def _end_spins(self) -> Array:
        """What the end assemblies' own rotation adds to the mass matrix, shape (11, 11)."""
        assert self.ends is not None
        turns = np.zeros((4, 3, _RIGID + 5))
        turns[:, :, 3:6] = np.eye(3)
        turns[np.arange(4), :, 7 + np.arange(4)] = self.ends.normals[:4]
        return np.asarray(self._hinge_spin * np.einsum("iaj,iak->jk", turns, turns))


def _boom_masses(scene: Scene) -> tuple[Array, Array]:
    """Point masses of the boom and their places from the first upper assembly's centre."""
    boom = scene.boom
    if boom is None:
        return np.zeros(0), np.zeros((0, 3))
    tube = boom.tube
    reach = math.sqrt(3.0 / 16.0 * (tube.outer_diameter**2 + tube.inner_diameter**2))
    down = -boom.length * UP
    sides = [0.5 * down + sign * reach * way for way in np.eye(3)[:2] for sign in SIGN]
    return np.full(6, boom.mass / 6.0), np.array([0.0 * down, down, *sides])
