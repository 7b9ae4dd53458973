"""A structure with rigid rods as a mechanism: its coordinates, its mass, its equations of motion.

A closed ring has one coordinate, the fold q; an open arc the swings psi of its four end assemblies
besides (ringsim.theory.ideal_points), three of them free where a boom joins two, and two where its
joint is prismatic.

The structure moves as one rigid body (velocity V, rotation W, along its own axes), folds and
swings.  For masses m at r(p), p = (q, psi),

    sum m J^T (J (V' + W x V, W', p'') + W x (W x r) + 2 W x r' + r'') = forces,
    J = (1, -[r]x, dr/dp),

Kane's equations.  With r = P s the sums over the masses are constant: sum m, sum m P and
sum m P_i P_j^T.  A base that floats has no force on the translation; a support holds a body, and so
gives V and W as functions of p and p'.
Source: Kane and Levinson, Dynamics: Theory and Applications (1985), secs. 4.11 and 6.1.
"""

import math

import numpy as np

from ringsim.layout.bodies import OnBody
from ringsim.layout.free_hub import FreeHub, NetForces
from ringsim.layout.layout import Layout
from ringsim.layout.pose import Array, skew
from ringsim.parts.net.hub import SpringNet
from ringsim.scene import Scene
from ringsim.theory.configuration import Configuration
from ringsim.theory.ideal_edge import IdealEdge
from ringsim.theory.ideal_points import UP, Points, body_of

_LEVI_CIVITA = np.cross(np.eye(3)[:, None], np.eye(3))
_UNIT = np.eye(3)
_AHEAD, _BEHIND = np.array([5, 6, 1]), np.array([7, 2, 3])


def _axial(w: Array) -> Array:
    """Sums of a x b from sums of a b^T, shape (..., 3, 3)."""
    flat = w.reshape(*w.shape[:-2], 9)
    return np.asarray(flat[..., _AHEAD] - flat[..., _BEHIND])


def _trace(w: Array) -> Array:
    """Sums of a . b from sums of a b^T, shape (..., 3, 3)."""
    return np.asarray(w.reshape(*w.shape[:-2], 9)[..., ::4].sum(axis=-1))


class Mechanism:
    """Coordinates, masses and equations of a scene's structure; arguments are those of ``Points``.

    ``freedom`` is the number of free coordinates, q the first: 1, or 3 to 5 for an open arc;
    ``fixed`` is whether a body is held: the first upper assembly by the base of a boom.
    """

    def __init__(self, scene: Scene, at: float | None = None, layout: Layout | None = None) -> None:
        self.points = points = Points(scene, at, layout)
        masses, bodies = points.layout.point_masses()[:2]
        places = points.swung(lambda layout: layout.point_masses()[2:], bodies)
        count, flat = places.shape[-1], places.reshape(len(masses), -1)
        self._mass, self._first = float(masses.sum()), np.tensordot(masses, places, 1)
        second = ((flat.T * masses) @ flat).reshape(3, count, 3, count)
        self._second = second.transpose(1, 3, 0, 2).reshape(count, -1)
        corners, edge = points.layout.corners, points.layout.edge
        self._corners = points.places([OnBody(body) for body in corners[0]] if corners else [])
        self._net: FreeHub | IdealEdge | None = None
        self._ends = self._corners
        if isinstance(scene.net, SpringNet):
            self._net = FreeHub(scene.net, len(self._corners))
        elif edge is not None:
            self._net = IdealEdge(scene, edge)
            self._ends = points.places([OnBody(int(body)) for body in edge.pairs.ravel()])
        held = [body_of(support.second) for support in points.layout.supports]
        self.fixed = bool(held)
        self._held = points.frame(held[0]) if held else np.zeros(0)
        self._gravity, hung = points.layout.gravity, points.layout.hung
        self._weighing, self._weighed = self._mass, self._first
        if hung is not None and self._gravity is not None:
            # A line takes as much from the mass that weighs.
            taken = hung.lifts / np.linalg.norm(self._gravity)
            self._weighing -= float(taken.sum())
            lines = points.places([OnBody(body) for body in hung.bodies])
            self._weighed = self._weighed - np.tensordot(taken, lines, 1)
        swings = len(points.swinging)
        self._on_boom = swings > 0 and scene.boom is not None
        # A prismatic joint on a boom holds the tilts of both its assemblies.
        self._upright = self._on_boom and any(j.kind == "prismatic" for j in points.layout.joints)
        self.freedom = 1 + swings - self._on_boom - self._upright
        if self._on_boom:
            pins = points.pins
            self._height = pins[0, 2] - pins[1, 2]
            self._offset = float(np.linalg.norm(self._corners[0, :, pins.shape[-1]]))

    def configuration(self, free: Array, rates: Array) -> Configuration:
        """The mechanism at free coordinates (rad) and their rates (rad/s)."""
        place, slopes, bias = free, np.eye(self.freedom), np.zeros(self.freedom)
        if self._on_boom:
            place, slopes, bias = self._along_the_boom(free, rates)
        rate = slopes @ rates
        s, n = self.points.functions(place, rate), len(place)
        first = self._first @ s
        half = (s[:, : n + 1].T @ self._second).reshape(n + 1, len(s), 9)
        second = (s.T @ half).reshape(n + 1, n + 3, 3, 3)
        matrix = np.zeros((6 + n, 6 + n))
        matrix[:3, :3] = self._mass * _UNIT
        matrix[:3, 3:6] = -skew(first[:, 0])
        matrix[3:6, 3:6] = _trace(second[0, 0]) * _UNIT - second[0, 0]
        matrix[:3, 6:] = first[:, 1 : n + 1]
        matrix[3:6, 6:] = _axial(second[0, 1 : n + 1]).T
        matrix[6:, 6:] = _trace(second[1:, 1 : n + 1])
        matrix[3:6, :3] = matrix[:3, 3:6].T
        matrix[6:, :6] = matrix[:6, 6:].T
        return Configuration(place, rate, slopes, bias, s, first, second, matrix)

    def net(self, now: Configuration, rate: Array) -> NetForces:
        """What the net does while p changes at a rate (rad/s)."""
        if self._net is None:
            return NetForces(np.zeros(len(rate)), 0.0, 0.0)
        return self._net.forces(now.places(self._ends), now.slopes_of(self._ends), rate)

    def net_tensions(self, now: Configuration) -> Array | None:
        """Of cables along a net's edge, N, shape (planes, sections), NaN in planes without; None
        of other nets.
        """
        if not isinstance(self._net, IdealEdge):
            return None
        return self._net.tensions(now.places(self._ends))

    def vertical(self, now: Configuration) -> Array:
        """Unit vector that points up in space, in the structure's axes, if it cannot pitch."""
        return np.asarray(self._held[3] @ now.values) if self.fixed else UP

    def weight(self, now: Configuration) -> Array:
        """Generalised force of gravity and of what lines carry on (V, W, p), N and N m."""
        if self._gravity is None:
            return np.zeros(len(now.matrix))
        down, n = self.gravity(now), len(now.place)
        first = self._weighed @ now.functions
        whole, turning = self._weighing * down, np.cross(first[:, 0], down)
        return np.concatenate([whole, turning, first[:, 1 : n + 1].T @ down])

    def weight_work(self, now: Configuration) -> float:
        """Their work function, J, from the held body's place on."""
        if self._gravity is None:
            return 0.0
        arm = self._weighed @ now.values
        if self.fixed:
            arm = arm - self._weighing * (self._held[0] @ now.values)
        return float(arm @ self.gravity(now))

    def gravity(self, now: Configuration) -> Array:
        """In the structure's axes, m/s^2; only where there is any."""
        assert self._gravity is not None
        if not self.fixed:
            return self._gravity
        return np.asarray(np.tensordot(self._gravity, self._held[1:], 1) @ now.values)

    def rigid_rates(self, now: Configuration, spin: Array | None = None) -> Array:
        """V and W, shape (6,), that hold the held body; else those without momentum, with the
        rotation ``spin`` (rad/s) or, if None, without angular momentum too.
        """
        matrix = now.matrix
        if self.fixed:
            return np.asarray(self._holding(now)[:, :-2] @ now.rate)
        if spin is None:
            return np.asarray(np.linalg.solve(matrix[:6, :6], -matrix[:6, 6:] @ now.rate))
        momentum = matrix[:3, 3:6] @ spin + matrix[:3, 6:] @ now.rate
        return np.concatenate([-momentum / matrix[0, 0], spin])

    def accelerations(
        self, now: Configuration, spin: Array, torque: Array, forces: Array
    ) -> tuple[Array, Array]:
        """Accelerations of the free coordinates, and W' of a base that floats; rad/s^2.

        ``spin`` is W (rad/s), ``torque`` that on the whole structure, ``forces`` those on p (N m).
        """
        rigid = 0 if self.fixed else 6
        load, reach, rest = self._equations(now, spin, torque, forces)
        matrix = now.matrix
        found = np.linalg.solve(reach.T @ matrix @ reach, reach.T @ (load - matrix @ rest))
        return np.asarray(found[rigid:]), np.asarray(found[3:6] if rigid else np.zeros(3))

    def reaction(
        self, now: Configuration, spin: Array, torque: Array, forces: Array, moving: Array
    ) -> Array:
        """Force (N) and torque (N m) of what holds the held body, in the axes of space and about
        the body's origin, shape (2, 3): the rate of momentum that nothing else gives.

        Arguments as of ``accelerations``, and the accelerations of the free coordinates.
        """
        load, reach, rest = self._equations(now, spin, torque, forces)
        force, about = (now.matrix @ (reach @ moving + rest) - load)[:6].reshape(2, 3)
        origin, axes = (self._held @ now.values)[0], (self._held @ now.values)[1:]
        return np.asarray([axes @ force, axes @ (about - np.cross(origin, force))])

    def _equations(
        self, now: Configuration, spin: Array, torque: Array, forces: Array
    ) -> tuple[Array, Array, Array]:
        """What acts on (V, W, p); how their rates follow from the unknown accelerations, and from
        the state alone.
        """
        first, second, matrix, turn = now.first, now.second, now.matrix, skew(spin)
        whirl, rigid = turn @ turn, 0 if self.fixed else 6
        # Accelerations of the masses at zero (V' + W x V, W', p'') are linear in s, s' and s''.
        about = second[:, 0] @ whirl.T + 2.0 * second[:, -2] @ turn.T + second[:, -1]
        inertial = whirl @ first[:, 0] + 2.0 * turn @ first[:, -2] + first[:, -1]
        along = _trace(about[1:])
        load = np.concatenate([-inertial, torque - _axial(about[0]), forces - along])
        load += self.weight(now)
        reach = np.zeros((len(matrix), rigid + self.freedom))
        reach[:rigid, :rigid] = np.eye(rigid)
        reach[6:, rigid:] = now.slopes
        rest = np.concatenate([np.zeros(6), now.bias])
        if self.fixed:
            holding, origin = self._holding(now), self._held[0] @ now.functions
            reach[:6] = holding[:, :-2] @ now.slopes
            rest[:6] = holding[:, :-2] @ now.bias + holding[:, -1]
            rest[:3] -= whirl @ origin[:, 0] + 2.0 * turn @ origin[:, -2]
        return load, reach, rest

    def _holding(self, now: Configuration) -> Array:
        """(V, W) that stop the held body while it moves with each column of s, shape (6, n + 2)."""
        frame = self._held @ now.functions
        origin, axes = frame[0], frame[1:]
        turn = -0.5 * np.einsum("abc,kb,kcj->aj", _LEVI_CIVITA, axes[:, :, 0], axes[:, :, 1:])
        return np.vstack([skew(origin[:, 0]) @ turn - origin[:, 1:], turn])

    def _along_the_boom(self, free: Array, rates: Array) -> tuple[Array, Array, Array]:
        """p, its derivatives after (q, b, psi_3, psi_4), and p'' at zero accelerations of these.

        A boom in the first end assembly, on which the second slides, leaves the angle b between
        these two: with a the distance of a pin from its assembly's centre and h that of the pins,

            sin(psi_1) h = a (1 - cos b),   psi_2 = psi_1 + b,

        of which bias is the second derivative.  NaN where the boom blocks the lower assembly.
        With a prismatic joint b is zero and not among the arguments, and so are psi_1 and psi_2.
        """
        if self._upright:
            slopes = np.zeros((5, 3))
            slopes[0, 0] = slopes[3, 1] = slopes[4, 2] = 1.0
            return slopes @ free, slopes, np.zeros(5)
        h, h_slope, h_bend = self.points.basis(float(free[0])) @ self._height
        offset = self._offset
        b, b_rate, q_rate = free[1], rates[1], rates[0]
        lean = offset * (1.0 - math.cos(b)) / h
        angle = math.asin(lean) if abs(lean) < 1.0 else math.nan
        level = h * math.cos(angle)
        by_b, by_q = offset * math.sin(b) / level, -lean * h_slope / level
        rate = by_b * b_rate + by_q * q_rate
        bias = (
            offset * math.cos(b) * b_rate**2
            + rate**2 * h * lean
            - 2.0 * rate * math.cos(angle) * h_slope * q_rate
            - lean * h_bend * q_rate**2
        ) / level
        slopes = np.zeros((5, 4))
        slopes[0, 0] = slopes[3, 2] = slopes[4, 3] = slopes[2, 1] = 1.0
        slopes[1:3, 0] = by_q
        slopes[1:3, 1] += by_b
        place = np.array([free[0], angle, angle + b, free[2], free[3]])
        return place, slopes, np.array([0.0, bias, bias, 0.0, 0.0])
