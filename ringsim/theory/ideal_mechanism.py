"""A structure with rigid rods as a mechanism of one coordinate: its mass, weight and net.

The structure moves as one rigid body (velocity V, rotation W, along its own axes) and folds, which
the coordinate q tells: a point at r moves with V + W x r + q' dr/dq.  With r = P s the sums over
the masses are constant: sum m, sum m P and sum m P_i P_j^T.  A base that floats has neither
momentum nor angular momentum; a support holds a body, and so gives V and W from q and q'.
The end assemblies of an open arc are held upright.
Source: Kane and Levinson, Dynamics: Theory and Applications (1985), secs. 4.11 and 6.1.
"""

import numpy as np

from ringsim.layout.bodies import OnBody
from ringsim.layout.free_hub import FreeHub, NetForce
from ringsim.layout.layout import Layout
from ringsim.layout.pose import Array, skew
from ringsim.parts.net.hub import SpringNet
from ringsim.scene import Scene
from ringsim.theory.configuration import Configuration
from ringsim.theory.ideal_edge import IdealEdge
from ringsim.theory.ideal_points import Points, body_of

_LEVI_CIVITA = np.cross(np.eye(3)[:, None], np.eye(3))
_UNIT = np.eye(3)


def _axial(w: Array) -> Array:
    """Sum of a x b from the sum of a b^T, shape (3, 3)."""
    return np.asarray([w[1, 2] - w[2, 1], w[2, 0] - w[0, 2], w[0, 1] - w[1, 0]])


class Mechanism:
    """Coordinate, masses and forces of a scene's structure; arguments are those of ``Points``.

    ``fixed`` is whether a body is held: the first upper assembly by the base of a boom.
    """

    def __init__(self, scene: Scene, at: float | None = None, layout: Layout | None = None) -> None:
        self.points = points = Points(scene, at, layout)
        masses = points.layout.point_masses()[0]
        places = points.fit(lambda layout: layout.point_masses()[2:])
        count, flat = places.shape[-1], places.reshape(len(masses), -1)
        self._mass, self._first = float(masses.sum()), np.tensordot(masses, places, 1)
        second = ((flat.T * masses) @ flat).reshape(3, count, 3, count)
        self._second = second.transpose(1, 3, 0, 2)
        corners, edge = points.layout.corners, points.layout.edge
        self._net: FreeHub | IdealEdge | None = None
        if isinstance(scene.net, SpringNet):
            self._ends = points.places([OnBody(body) for body in corners[0]])
            self._net = FreeHub(scene.net, len(self._ends))
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

    def at(self, q: float) -> Configuration:
        """The mechanism at a coordinate (rad)."""
        values, slopes = self.points.functions(q)
        centre, moving = self._first @ values, self._first @ slopes
        by_place = np.tensordot(values, self._second, 1)
        about, turned = np.tensordot(values, by_place, 1), np.tensordot(slopes, by_place, 1)
        matrix = np.zeros((7, 7))
        matrix[:3, :3] = self._mass * _UNIT
        matrix[:3, 3:6] = -skew(centre)
        matrix[3:6, 3:6] = np.trace(about) * _UNIT - about
        matrix[:3, 6] = moving
        matrix[3:6, 6] = _axial(turned)
        matrix[3:6, :3] = matrix[:3, 3:6].T
        matrix[6, :6] = matrix[:6, 6]
        matrix[6, 6] = np.trace(np.tensordot(slopes, np.tensordot(slopes, self._second, 1), 1))
        return Configuration(q, values, slopes, matrix)

    def net(self, now: Configuration) -> NetForce:
        """What the net does at rest."""
        if self._net is None:
            return NetForce(0.0, 0.0)
        return self._net.force(now.places(self._ends), now.velocities(self._ends))

    def weight(self, now: Configuration) -> Array:
        """Generalised force of gravity and of what lines carry on (V, W, q), N and N m."""
        if self._gravity is None:
            return np.zeros(7)
        down, arm = self.gravity(now), self._weighed @ now.values
        folding = float(down @ (self._weighed @ now.slopes))
        return np.array([*(self._weighing * down), *np.cross(arm, down), folding])

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

    def rates(self, now: Configuration) -> Array:
        """(V, W, q') at q' = 1 that hold the held body; else those without momentum, shape (7,)."""
        if self.fixed:
            return np.append(self._holding(now), 1.0)
        found = np.linalg.solve(now.matrix[:6, :6], -now.matrix[:6, 6])
        return np.append(found, 1.0)

    def inertia(self, now: Configuration) -> float:
        """Twice the kinetic energy at q' = 1 rad/s, kg m^2."""
        rates = self.rates(now)
        return float(rates @ now.matrix @ rates)

    def _holding(self, now: Configuration) -> Array:
        """(V, W) that stop the held body while the mechanism folds, shape (6,)."""
        places, moving = self._held @ now.values, self._held @ now.slopes
        turn = -0.5 * np.einsum("abc,kb,kc->a", _LEVI_CIVITA, places[1:], moving[1:])
        return np.concatenate([np.cross(places[0], turn) - moving[0], turn])
