"""A structure with rigid rods as a mechanism of one coordinate: its points, mass, weight, net."""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ringsim.layout.bodies import Array, Mount, OnBody, skew
from ringsim.layout.draft import FreeHub, NetForce
from ringsim.layout.layout import Layout, layout_of
from ringsim.parts.laws import PairLaw, Switches
from ringsim.scene import Scene

# Every point of a structure with rigid rods as a linear function of a few numbers.
#
# Where a structure has a basis s(q) (``Structure.basis``), every point is r = P s with a constant
# P, found from places and derivatives of the layout at three coordinates; then r' = P s'.
# Elsewhere P = (r, r') and s = (1, 0), s' = (0, 1), good at one coordinate alone.


Pairs = tuple[Array, Array]
"""Places, or axes, and their derivatives after the coordinate, shape (..., 3) each."""

NODES = (0.2, 0.8, 1.4)
"""Coordinates at which the layout is built, rad: apart, and away from both ends of the travel."""
_CLOSE = 1e-10
"""What the basis may leave over of a place of size 1: round-off leaves 1e-14."""


class Points:
    """Coefficients P of the points of a scene; ``layout`` is one of those that P was found from.

    ``functions`` gives s and s' at a coordinate (rad), shape (2, functions).
    """

    def __init__(self, scene: Scene, at: float | None = None, layout: Layout | None = None) -> None:
        """Everywhere, or at one coordinate (rad) alone, of which a ``layout`` may be given."""
        self.functions = scene.structure.basis if at is None else lambda _: np.eye(2)
        nodes = NODES if at is None else (at,)
        self._layouts = [layout_of(scene, q) for q in nodes] if layout is None else [layout]
        self._known = np.concatenate([self.functions(q) for q in nodes])
        self.layout = self._layouts[0]

    def fit(self, read: Callable[[Layout], Pairs]) -> Array:
        """Coefficients of what is read of a layout, shape (..., 3, functions).

        Raises
        ------
        ValueError
            If it is not linear in the basis, or the basis cannot be told apart.
        """
        values = np.stack([part for layout in self._layouts for part in read(layout)])
        flat = values.reshape(len(values), -1)
        found, _, rank, _ = np.linalg.lstsq(self._known, flat, rcond=None)
        if rank < len(found):
            raise ValueError(
                f"structure: basis() has {len(found)} functions, but only {rank} can be told apart "
                f"at {len(self._layouts)} coordinates: leave out those that depend on others"
            )
        left = np.abs(self._known @ found - flat).max(initial=0.0)
        if left > _CLOSE * max(np.abs(flat).max(initial=0.0), 1.0):
            raise ValueError(
                f"structure: a place is {left:.3g} m off what its basis says: list in basis() all "
                "functions of the coordinate that layout() uses"
            )
        return np.moveaxis(found.reshape(len(found), *values.shape[1:]), 0, -1)

    def frame(self, body: int) -> Array:
        """Coefficients of a body's origin, m, and of its axes; shape (4, 3, functions)."""
        axes = [OnBody(body, axes=np.roll(np.eye(3), -k, axis=1)) for k in range(3)]
        return np.concatenate([self.places(axes[:1]), self.directions(axes)])

    def places(self, mounts: Sequence[Mount], *, ahead: float = 0.0) -> Array:
        """Coefficients of mounts of ``layout``, or of points ahead of them along their x axes (m);
        shape (mounts, 3, functions), m.
        """
        arm = np.array([ahead, 0.0, 0.0])
        return self.fit(lambda layout: _stacked(layout.pose(mount).at(arm) for mount in mounts))

    def directions(self, mounts: Sequence[Mount]) -> Array:
        """Coefficients of the mounts' x axes, shape (mounts, 3, functions)."""
        return self.places(mounts, ahead=1.0) - self.places(mounts)

    @cached_property
    def forces(self) -> tuple[Array, Array]:
        """The loads, N, and where they act; shapes (forces, 3) and (forces, 3, functions)."""
        mounts = [self.layout.joints[joint].first for joint, _ in self.layout.forces]
        vectors = np.array([force for _, force in self.layout.forces]).reshape(-1, 3)
        return vectors, self.places(mounts)

    def path(self, number: int) -> Array:
        """Coefficients of a cable's sheaves, shape (sheaves, 3, functions), m."""
        return self.fit(lambda layout: _stacked(map(layout.sheave, layout.paths[number])))


def body_of(mount: Mount) -> int:
    """Number of a mount's body; -1 on rods and in space."""
    return mount.body if isinstance(mount, OnBody) else -1


def _stacked(pairs: Iterable[Sequence[Array]]) -> Pairs:
    found = np.array(list(pairs)).reshape(-1, 2, 3)
    return found[:, 0], found[:, 1]


# Laws between bodies on a ring of rigid rods: generalised force - sum T dl/dq.


class RigidPairs:
    """The pairs of a law; a net's hub lies where its strings balance."""

    def __init__(self, points: Points, law: PairLaw) -> None:
        self._law, self._hub = law, FreeHub(law) if law.hung else None
        self.group = law.group
        first, second = law.bodies.T
        self._second = points.places([OnBody(int(body)) for body in second])
        if self._hub is None:
            self._first = points.places([OnBody(int(body)) for body in first])

    def force(self, now: "Configuration") -> NetForce:
        """At rest, on the coordinate."""
        ends, moving = now.places(self._second), now.velocities(self._second)
        if self._hub is not None:
            return self._hub.force(ends, moving)
        arms, growing = ends - now.places(self._first), moving - now.velocities(self._first)
        lengths = np.linalg.norm(arms, axis=1)
        longer = np.sum(arms * growing, axis=1) / lengths
        still = self._law.reaction(lengths, np.zeros(len(lengths)))
        return NetForce(0.0 - float(still.elastic @ longer), float(np.sum(still.stored)))


# A structure with rigid rods at one coordinate, and how its points move there.


class Configuration(NamedTuple):
    """The mechanism at a coordinate q (rad), which grows at 1 rad/s.

    ``values`` and ``slopes`` are the functions s of ``Points`` and their derivatives after q, shape
    (functions,).
    """

    place: float
    values: Array
    slopes: Array

    def places(self, points: Array) -> Array:
        """Of points from their coefficients; (points, 3, functions) -> (points, 3), m."""
        return np.asarray(points @ self.values)

    def velocities(self, points: Array) -> Array:
        """Shape (points, 3), m/s, in the layout's rates: without V and W."""
        return np.asarray(points @ self.slopes)


# A structure with rigid rods as a mechanism of one coordinate: its mass, weight and net.
#
# The structure moves as one rigid body (velocity V, rotation W, along its own axes) and folds,
# which the coordinate q tells: a point at r moves with V + W x r + q' dr/dq.  With r = P s the sums
# over the masses are constant: sum m, sum m P and sum m P_i P_j^T.  A base that floats has neither
# momentum nor angular momentum; a support holds a body, and so gives V and W from q and q'. The end
# assemblies of an open arc are held upright. Source: Kane and Levinson, Dynamics: Theory and
# Applications (1985), secs. 4.11 and 6.1.


_LEVI_CIVITA = np.cross(np.eye(3)[:, None], np.eye(3))
_UNIT = np.eye(3)


def _axial(w: Array) -> Array:
    """Sum of a x b from the sum of a b^T, shape (3, 3)."""
    return np.asarray([w[1, 2] - w[2, 1], w[2, 0] - w[0, 2], w[0, 1] - w[1, 0]])


class Mechanism:
    """Coordinate, masses and forces of a scene's structure; arguments are those of ``Points``.

    ``fixed`` is whether a body is held: the first upper assembly by the base of a boom;
    ``switches`` are those of the laws on its V-joints, all whole.
    """

    def __init__(self, scene: Scene, at: float | None = None, layout: Layout | None = None) -> None:
        self.points = points = Points(scene, at, layout)
        self.switches = Switches(points.layout.angle_laws)
        masses = points.layout.point_masses[0]
        places = points.fit(lambda layout: layout.point_masses[2:])
        count, flat = places.shape[-1], places.reshape(len(masses), -1)
        self._mass, self._first = float(masses.sum()), np.tensordot(masses, places, 1)
        second = ((flat.T * masses) @ flat).reshape(3, count, 3, count)
        self._second = second.transpose(1, 3, 0, 2)
        laws = [law for law in points.layout.pair_laws if law.category is not None]
        self._pairs = [RigidPairs(points, law) for law in laws]
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
        return Configuration(q, *self.points.functions(q))

    def masses(self, now: Configuration) -> Array:
        """The mass matrix of (V, W, q'), shape (7, 7)."""
        values, slopes = now.values, now.slopes
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
        return matrix

    def pairs(self, now: Configuration, group: str | None = None) -> NetForce:
        """What laws between bodies do at rest, all or those of a group."""
        found = [pair.force(now) for pair in self._pairs if group in (None, pair.group)]
        return NetForce(sum(one.force for one in found), sum(one.energy for one in found))

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
        return self._rates(now, None if self.fixed else self.masses(now))

    def inertia(self, now: Configuration) -> float:
        """Twice the kinetic energy at q' = 1 rad/s, kg m^2."""
        masses = self.masses(now)
        rates = self._rates(now, masses)
        return float(rates @ masses @ rates)

    def _rates(self, now: Configuration, masses: Array | None) -> Array:
        if self.fixed or masses is None:
            return np.append(self._holding(now), 1.0)
        return np.append(np.linalg.solve(masses[:6, :6], -masses[:6, 6]), 1.0)

    def _holding(self, now: Configuration) -> Array:
        """(V, W) that stop the held body while the mechanism folds, shape (6,)."""
        places, moving = self._held @ now.values, self._held @ now.slopes
        turn = -0.5 * np.einsum("abc,kb,kc->a", _LEVI_CIVITA, places[1:], moving[1:])
        return np.concatenate([np.cross(places[0], turn) - moving[0], turn])


# The loads on the V-joints of a ring of rigid rods, section by section.


class SectionLoads:
    """Virtual work of the pair of forces in each section; along z in the ring's own axes, as the
    loads of the rigid ring are.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        layout = mechanism.points.layout
        self._forces, self._places = mechanism.points.forces
        self._sections = np.array([layout.joints[one].section for one, _ in layout.forces], int)

    def at(self, now: Configuration) -> Array:
        """Generalised forces on the opening angle, N m, shape (sections + 1,), positive where they
        open.
        """
        if not len(self._sections):
            return np.zeros(1)
        # The angle opens by two for one that the coordinate falls.
        power = -0.5 * np.sum(self._forces * now.velocities(self._places), axis=1)
        return np.asarray(np.bincount(self._sections, power), dtype=float)


# Laws on all V-joints of a ring of rigid rods, whose joints open alike.


class Torques(NamedTuple):
    """Sum of torques that resist folding, N m, and energy, J."""

    torque: float
    stored: float


def torques_at(switches: Switches, folded: float, group: str | None = None) -> Torques:
    """Of the laws that a drive meets on its way, or those of a group, at rest and at the angle
    (rad) by which every V-joint is folded.
    """
    torque = stored = 0.0
    for number, law in enumerate(switches.laws):
        if law.category is not None and group in (None, law.group):
            angles = np.full(len(law.places), folded)
            still = law.own.reaction(angles, np.zeros(len(angles)), switches.setting[number])
            torque += float(np.sum(switches.on[number] * still.elastic))
            stored += float(np.sum(switches.on[number] * still.stored))
    return Torques(torque, stored)
