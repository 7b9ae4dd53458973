"""A structure at one value of its coordinate: the one description that every room reads."""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.records import BlockSheave, Sheave
from ringsim.layout.bodies import (
    STEP,
    Array,
    Body,
    InSpace,
    Joint,
    JointOpening,
    Lump,
    Mount,
    OnBody,
    OnRod,
    Opening,
    Pose,
    Rod,
    cross,
    pose_of,
    skew,
)
from ringsim.parts.ground import Offload
from ringsim.parts.laws import AngleLaw, PairLaw, Rub

if TYPE_CHECKING:
    from ringsim.scene import Scene

# A structure at one value of its coordinate: the one description that every room reads.


SPACECRAFT = "spacecraft"
"""Group of the lump that is one."""
OWN = "structure"
"""Group of laws that a structure brings itself, against which it rests before a run."""


class Contact(NamedTuple):
    """A body's origin that may not come closer than ``room`` to the plane x_axis = 0.

    ``law`` has ``push(depth, rate, xp)`` as a ``Reaction``.
    """

    body: int
    axis: int
    room: float
    law: Any


class Hub(NamedTuple):
    """The free point of a net: where its strings balance, shape (3,), m, and its mass, kg."""

    place: Array
    mass: float


class Hung(NamedTuple):
    """Lines that carry bodies at their origins: the law, numbers of the bodies, what each carries
    at the start, N, and the unit vector along which they pull.
    """

    law: Offload
    bodies: tuple[int, ...]
    lifts: Array
    up: Array


class BoomBeam(NamedTuple):
    """A flexible boom: clamped at ``top``, while ``low`` slides along it.

    ``lump`` is what it would be as a rigid part of the body at its top, but for the inertia of its
    sections when they turn, which that body has.
    """

    top: OnBody
    low: OnBody
    record: Any
    lump: Lump


class PointMasses(NamedTuple):
    """Masses (kg) and numbers of their bodies, -1 for rods, shape (n,); places (m) and their
    derivatives after the coordinate, shape (n, 3).
    """

    masses: Array
    bodies: NDArray[np.int_]
    places: Array
    rates: Array


_AXES = np.vstack([np.eye(3), -np.eye(3)])
"""Directions of six points about their middle."""


class Half(NamedTuple):
    """Elements ``first`` to ``last`` - 1 of a rod."""

    rod: int
    first: int
    last: int


@dataclass(frozen=True)
class Layout:
    """Everything that a structure consists of, with its rates; SI units throughout.

    ``openings`` are by plane and section, ``corners`` hinge assemblies by plane and corner, as
    numbers of bodies; ``paths`` sheaves of each cable of the scene in order, from its first winch
    to its far end; ``forces`` constant ones: number of the joint whose first mount they act on,
    and vector, N; ``base`` the body that is held, or that a boom's upper end is fixed to;
    ``gravity`` the weight of a kilogram, m/s^2; ``hung`` the lines of a ground test;
    ``held`` how much further open V-joints are held before a run, shape (planes, sections), rad;
    ``angle_laws`` what acts on V-joints, ``pair_laws`` what acts between bodies, and ``rubs`` what
    brakes joints by their rates alone.
    """

    bodies: tuple[Body, ...]
    rods: tuple[Rod, ...]
    joints: tuple[Joint, ...]
    openings: tuple[tuple[Opening, ...], ...]
    corners: tuple[tuple[int, ...], ...]
    paths: tuple[tuple[Sheave, ...], ...]
    contacts: tuple[Contact, ...]
    hub: Hub | None
    boom: BoomBeam | None
    forces: tuple[tuple[int, Array], ...]
    base: int | None = None
    gravity: Array | None = None
    hung: Hung | None = None
    held: Array | None = None
    angle_laws: tuple[AngleLaw, ...] = ()
    pair_laws: tuple[PairLaw, ...] = ()
    rubs: tuple[Rub, ...] = ()

    def pose(self, mount: Mount) -> Pose:
        """The frame of a mount, with its own axes."""
        return pose_of(mount, self.bodies, self.rods)

    def masses(self) -> dict[str, float]:
        """Of each group of parts, kg."""
        parts = [(rod.group, rod.mass) for rod in self.rods]
        parts += [(lump.group, lump.mass) for body in self.bodies for lump in body.lumps]
        parts += [(group, mass) for rod in self.rods for _, mass, group in rod.masses]
        if self.boom is not None:
            parts.append(("boom", self.boom.lump.mass))
        if self.hub is not None:
            parts.append(("hub", self.hub.mass))
        found: dict[str, float] = {}
        for group, mass in parts:
            found[group] = found.get(group, 0.0) + mass
        return found

    @cached_property
    def point_masses(self) -> PointMasses:
        """Point masses that move as the rigid parts do, with the same inertia.

        A part of mass m is six of m / 6 at c +- r_k n_k about its centre of mass c, where
        r_k^2 = 3 e_k / m with e_k, n_k the principal values and directions of its second moments
        tr(J) / 2 - J about c; a rod so has two at its ends.  A flexible boom counts as rigid; the
        net's hub is left out.
        """
        parts: list[tuple[Array, int, Array, Array]] = []
        bodies = list(enumerate(self.bodies))
        if self.boom is not None:
            top = self.boom.top.body
            bodies.append((top, Body(self.bodies[top].pose, (self.boom.lump,))))
        sixth = np.full(6, 1.0 / 6.0)
        for number, body in bodies:
            mass, centre = body.mass, body.centre
            seconds = 0.5 * np.trace(body.inertia) * np.eye(3) - body.inertia
            values, axes = np.linalg.eigh(seconds - mass * np.outer(centre, centre))
            arms = (axes * np.sqrt(3.0 * np.maximum(values, 0.0) / mass)).T
            spread = centre + np.concatenate([arms, -arms])
            parts.append((mass * sixth, number, *body.pose.at(spread)))
        for rod in self.rods:
            middle, tube = rod.station(0.5), rod.tube
            across = math.sqrt(3.0 * tube.second_moment / tube.area)
            arms = _AXES * (0.5 * rod.length, across, across)
            parts.append((rod.mass * sixth, -1, *middle.at(arms)))
            for station, mass, _ in rod.masses:
                pose = rod.station(rod.stations[station])
                parts.append((np.array([mass]), -1, pose.place[None], pose.rate[None]))
        masses, numbers, places, rates = zip(*parts, strict=True)
        counts = [len(each) for each in masses]
        joined = (np.concatenate(each) for each in (places, rates))
        return PointMasses(np.concatenate(masses), np.repeat(numbers, counts), *joined)

    def sheave(self, sheave: Sheave) -> tuple[Array, Array]:
        """Place of a sheave and its derivative after the coordinate, shape (3,), m."""
        if not isinstance(sheave, BlockSheave):
            return self.pose(sheave.node).at(sheave.arm)
        left, right = map(self.pose, sheave.nodes)
        both = left.axes[:, 1] + right.axes[:, 1]
        both = both + sheave.sense * (right.axes[:, 0] - left.axes[:, 0])
        arm = -sheave.sense * sheave.offset * both / np.linalg.norm(both)
        turn = 0.5 * (left.turn + right.turn)
        return left.place + arm, left.rate + cross(turn, arm)

    def opening_angles(self) -> tuple[Array, Array]:
        """Opening angles, rad, and derivatives after the coordinate, shape (planes, sections)."""
        found = np.array([[self._opening(one) for one in plane] for plane in self.openings])
        return found[..., 0], found[..., 1]

    def opens_by_twice(self, coordinate: float) -> bool:
        """Whether every opening angle is pi less twice the coordinate (rad), as in pantographs."""
        angles, rates = self.opening_angles()
        expected = np.pi - 2.0 * coordinate
        return bool(np.allclose(angles, expected, atol=1e-6) and np.allclose(rates, -2.0))

    def _opening(self, opening: Opening) -> tuple[float, float]:
        if not isinstance(opening, JointOpening):
            pose = self.bodies[opening.body].pose
            (x, y, _), (by_x, by_y, _) = pose.place - opening.centre, pose.rate
            return float(np.arctan2(x, -y)), float(x * by_y - y * by_x) / float(x * x + y * y)
        joint = self.joints[opening.joint]
        first, second = self.pose(joint.first), self.pose(joint.second)
        y, other, z = first.axes[:, 1], second.axes[:, 1], first.axes[:, 2]
        folded = opening.sense * float(np.arctan2(cross(y, other) @ z, y @ other))
        folded += 2.0 * np.pi if folded < -0.5 * np.pi else 0.0
        return np.pi - folded, -opening.sense * float((second.turn - first.turn) @ z)

    @property
    def all_joints(self) -> tuple[Joint, ...]:
        """Joints, with that of a body that slides along a flexible boom as along a rigid one."""
        if self.boom is None:
            return self.joints
        return (*self.joints, Joint("sleeve", "", 0, self.boom.top, self.boom.low))

    @property
    def supports(self) -> tuple[Joint, ...]:
        """Joints to places in space."""
        return tuple(j for j in self.joints if isinstance(j.first, InSpace))

    @property
    def spacecraft(self) -> Lump | None:
        """The spacecraft, which is a lump of the base."""
        lumps = () if self.base is None else self.bodies[self.base].lumps
        return next((lump for lump in lumps if lump.group == SPACECRAFT), None)

    def halves(self) -> dict[str, list[Half]]:
        """Rows of results by name, in the order of the layout, with a value a section: a rod with
        a joint inside is two, left and right of it.
        """
        sides = (side for joint in self.joints for side in (joint.first, joint.second))
        held = {(mount.rod, mount.station) for mount in sides if isinstance(mount, OnRod)}
        rows: dict[str, list[Half]] = {}
        for number, rod in enumerate(self.rods):
            last = len(rod.stations) - 1
            middle = [station for station in range(1, last) if (number, station) in held]
            names = ("_left", "_right") if middle else ("",)
            for name, ends in zip(names, pairwise((0, *middle[-1:], last)), strict=True):
                rows.setdefault(rod.name + name, []).append(Half(number, *ends))
        return rows


def layout_of(scene: "Scene", coordinate: float | None = None) -> Layout:
    """The layout of a scene's structure at a coordinate (rad), or as it starts.

    >>> from ringsim.scene import load_scene
    >>> layout = layout_of(load_scene("truss2"))
    >>> len(layout.bodies), len(layout.rods), len(layout.joints)
    (6, 12, 24)
    """
    q = scene.structure.coordinate if coordinate is None else coordinate
    return scene.structure.layout(scene, q + 1j * STEP)


def layout_at_opening(scene: "Scene", opening: float, first: Layout | None = None) -> Layout:
    """The layout at which the mean opening angle has a value (rad), by Newton's method.

    ``first`` is the layout as the structure starts, if it is there already.

    Raises
    ------
    ValueError
        If the structure never opens so far.
    """
    q = float(scene.structure.coordinate)
    for _ in range(30):
        layout, first = first or layout_of(scene, q), None
        angles, rates = layout.opening_angles()
        missing = opening - float(angles.mean())
        if abs(missing) < 1e-12:
            return layout
        q += missing / float(rates.mean())
    raise ValueError(f"no state of the structure has a mean opening angle of {opening:.4g} rad")


# How many ways a structure of rigid parts can move: null space of the constraint Jacobian.
#
# A section of a pantograph ring folds, and each of its four hinge assemblies tilts about the common
# axis of its two rods.  Where two sections meet, their normals differ: no tilt is left.  A closed
# ring has one freedom, an open arc five (four if a boom joins two end assemblies, three if its
# joint is prismatic).  At 180 deg the bars lie straight, and each of the 2 N V-joints can start to
# move by itself.


RANK_TOLERANCE = 1e-9
"""Singular values below this fraction of the largest are zeros.  Round-off leaves 1e-15; the
smallest true one is 5e-4 half open and 6e-8 at 0.01 deg for a ring of 120 sections."""
_HELD = {
    "revolute": [0, 1, 2, 3, 4],
    "prismatic": [1, 2, 3, 4, 5],
    "sleeve": [0, 1],
    "weld": [0, 1, 2, 3, 4, 5],
}
"""Translations and, from 3, rotations that a joint of each kind holds, along its own axes."""


def internal_mobility(layout: Layout) -> int:
    """Degrees of freedom of a structure of rigid parts beyond its six as one rigid body.

    The motions of each section (of its joints) by itself are joined at the bodies that sections
    share.  A boom counts as rigid; supports do not count.
    """
    joints = [joint for joint in layout.all_joints if not isinstance(joint.first, InSpace)]
    size = max(rod.length for rod in layout.rods)
    motions: dict[tuple[bool, int], list[tuple[int, Array]]] = {}  # of a part: first column, twists
    columns = 0
    for number in sorted({joint.section for joint in joints}):
        own = [joint for joint in joints if joint.section == number]
        parts = sorted({_part(mount) for joint in own for mount in (joint.first, joint.second)})
        middle = np.mean([layout.pose(joint.first).place for joint in own], axis=0)
        rows = np.concatenate([_row(layout, joint, parts, middle, size) for joint in own])
        _, values, shapes = np.linalg.svd(rows)
        free = shapes[_rank(values) :].T.reshape(len(parts), 6, -1)
        for part, twist in zip(parts, free, strict=True):
            place = layout.bodies[part[1]].pose.place if part[0] else middle
            arm = skew((place - middle) / size)
            at_part = np.concatenate([twist[:3] - arm @ twist[3:], twist[3:]])
            motions.setdefault(part, []).append((columns, at_part))
        columns += free.shape[-1]
    joined = [np.zeros((0, columns))]
    for shared in motions.values():
        for (start, twist), (other, same) in pairwise(shared):
            joined.append(np.zeros((6, columns)))
            joined[-1][:, start : start + twist.shape[1]] += twist
            joined[-1][:, other : other + same.shape[1]] -= same
    rank = _rank(np.linalg.svd(np.concatenate(joined), compute_uv=False))
    return columns - rank - 6


def _part(mount: Mount) -> tuple[bool, int]:
    """Whether a body, and its number or that of the rod."""
    assert not isinstance(mount, InSpace)
    return (True, mount.body) if isinstance(mount, OnBody) else (False, mount.rod)


def _row(
    layout: Layout, joint: Joint, parts: list[tuple[bool, int]], at: Array, size: float
) -> Array:
    """What a joint holds, (constraints, 6 parts): on velocity at a point, and angular velocity."""
    pose = layout.pose(joint.first)
    turned = pose.axes.T @ skew((pose.place - at) / size)
    whole = np.block([[pose.axes.T, -turned], [np.zeros((3, 3)), pose.axes.T]])
    held = whole[_HELD[joint.kind]]
    row = np.zeros((len(held), len(parts), 6))
    row[:, parts.index(_part(joint.first))] += held
    row[:, parts.index(_part(joint.second))] -= held
    return row.reshape(len(held), -1)


def _rank(values: Array) -> int:
    """From singular values."""
    return int(np.sum(values > RANK_TOLERANCE * values.max(initial=0.0)))
