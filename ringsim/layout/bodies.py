"""Rigid bodies, elastic rods, joints, and places on them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.rods import Rods, Tube

# Where something stands at one value of a structure's coordinate, and how it moves with it.


Array = NDArray[np.float64]
STEP = 1e-30
"""Imaginary part of the coordinate at which a layout is built: f(q + i h) = f(q) + i h f'(q), the
complex step (Squire and Trapp, SIAM Review 40, 1998), good to round-off as it subtracts nothing."""


def rate_of(values: Any) -> Array:
    """Derivative after the coordinate of something that was computed at q + i ``STEP``."""
    return np.asarray(values).imag / STEP


def real_of(values: Any) -> Array:
    """Its value at q."""
    return np.array(np.asarray(values).real, dtype=float)


@dataclass(frozen=True)
class Pose:
    """A frame and its derivative after the coordinate q.

    Origin, shape (3,), m, and axes as columns, shape (3, 3); derivative of the origin, m, and
    rotation vector per unit of q, shape (3,).

    Examples
    --------
    >>> q = 0.5 + 1j * STEP
    >>> pose = Pose.of([np.cos(q), np.sin(q), 0.0], turned_about_z(q))
    >>> pose.turn.round(12).tolist()
    [0.0, 0.0, 1.0]
    """

    place: Array
    axes: Array
    rate: Array
    turn: Array

    @classmethod
    def of(cls, place: Any, axes: Any) -> "Pose":
        """From an origin and axes computed at q + i ``STEP``."""
        frame = real_of(axes)
        spin = rate_of(axes) @ frame.T
        turn = 0.5 * np.array(
            [spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]]
        )
        return cls(real_of(place), frame, rate_of(place), turn)

    def at(self, arm: Array) -> tuple[Array, Array]:
        """Points fixed in this frame, shape (..., 3): places, m, and derivatives, m per unit of
        q.
        """
        lever = arm @ self.axes.T
        return self.place + lever, self.rate + lever @ skew(self.turn).T


def cross(a: Any, b: Any) -> NDArray[Any]:
    """Cross product of two vectors, shape (3,), real or complex."""
    return np.array(  # numpy's own costs fifteen times as much
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def skew(r: Array) -> Array:
    """The matrix [r]x."""
    return np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])


def turned_about_z(angle: Any) -> NDArray[Any]:
    """Axes turned about z by an angle in rad, real or complex, shape (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def axes_along(start: Any, end: Any, normal: Any) -> NDArray[Any]:
    """Axes as columns: x from start to end, z along ``normal``; real or complex, shape (3, 3)."""
    run = np.asarray(end) - np.asarray(start)
    x = run / np.sqrt(np.sum(run * run))  # no norm: it takes absolute values, which drop i STEP
    return np.array([x, cross(normal, x), normal]).T


# Rigid bodies, elastic rods, and places on them.


class Lump(NamedTuple):
    """A mass (kg) of a body, listed under ``group``; centre of mass, m, shape (3,), and inertia
    about the body's origin, kg m^2, shape (3, 3), in the body's axes.
    """

    group: str
    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True)
class Body:
    """A rigid body."""

    pose: Pose
    lumps: tuple[Lump, ...]

    @property
    def mass(self) -> float:
        """Total mass, kg."""
        return sum(lump.mass for lump in self.lumps)

    @property
    def centre(self) -> Array:
        """Centre of mass in the body's axes, shape (3,), m."""
        return np.asarray(sum(lump.mass * lump.centre for lump in self.lumps) / self.mass)

    @property
    def inertia(self) -> Array:
        """Inertia about the body's origin in its axes, shape (3, 3), kg m^2."""
        return np.asarray(sum(lump.inertia for lump in self.lumps))


@dataclass(frozen=True)
class Rod:
    """A straight elastic rod; its ends have the same axes: x along it, z along its joints' axis.

    Rods of one ``name``, one a ``section`` (from 0), share a row of the results; ``group`` is what
    they are called where masses are listed and lines are drawn.  ``stations`` are the shares of the
    length, from 0 to 1, at which nodes are, with elements between; ``masses`` are point masses on
    nodes: station, kg, and what they are called.  ``young_modulus`` in Pa, ``density`` in kg/m^3.
    It is made longer than it is drawn by the share ``strain``; an assembled structure
    (``ringsim.rigid.assembling``) tells where its ``nodes`` then are, one a station.
    """

    name: str
    section: int
    group: str
    start: Pose
    end: Pose
    tube: Tube
    young_modulus: float
    density: float
    stations: tuple[float, ...]
    masses: tuple[tuple[int, float, str], ...] = ()
    strain: float = 0.0
    nodes: tuple[Pose, ...] = ()

    @cached_property
    def length(self) -> float:
        """Distance of the ends, m."""
        return float(np.linalg.norm(self.end.place - self.start.place))

    @property
    def mass(self) -> float:
        """Without point masses, kg."""
        return self.density * self.tube.area * self.length

    @cached_property
    def lengths(self) -> Array:
        """Of its elements, m."""
        return np.diff(self.stations) * self.length

    @property
    def natural_lengths(self) -> Array:
        """Of its elements where nothing strains them, m."""
        return self.lengths * (1.0 + self.strain)

    @cached_property
    def _drawn(self) -> tuple[Pose, ...]:
        return tuple(self.station(share) for share in self.stations)

    def node(self, station: int) -> Pose:
        """The pose of a station by its number."""
        return (self.nodes or self._drawn)[station]

    def station(self, share: float) -> Pose:
        """The pose at a share of the length."""
        start, end, rest = self.start, self.end, 1.0 - share
        place, rate = rest * start.place + share * end.place, rest * start.rate + share * end.rate
        return Pose(place, start.axes, rate, start.turn)


SPACE = np.eye(3)
"""The axes of space."""


class OnBody(NamedTuple):
    """A place on a body: its number, and an arm and axes in the body's own axes."""

    body: int
    arm: Array = np.zeros(3)
    axes: Array = SPACE


class OnRod(NamedTuple):
    """A node of a rod: the numbers of the rod and of its station."""

    rod: int
    station: int


class InSpace(NamedTuple):
    """A place that does not move, with its axes."""

    place: Array
    axes: Array


Mount = OnBody | OnRod | InSpace


def pose_of(mount: Mount, bodies: Sequence[Body], rods: Sequence[Rod]) -> Pose:
    """The frame of a mount, with its own axes."""
    if isinstance(mount, InSpace):
        return Pose(mount.place, mount.axes, np.zeros(3), np.zeros(3))
    if isinstance(mount, OnBody):
        body = bodies[mount.body].pose
        place, rate = body.at(mount.arm)
        return Pose(place, body.axes @ mount.axes, rate, body.turn)
    return rods[mount.rod].node(mount.station)


# What holds bodies and rods together, and which angles say how far a structure has opened.


@dataclass(frozen=True)
class Joint:
    """A joint between two places that coincide; its axes are those of its mounts.

    "revolute" turns about z, "prismatic" slides along x, "sleeve" slides along z and turns freely,
    "weld" holds everything.  By its ``family`` a scene gives it friction: "pivot", "hinge",
    "vjoint", ...; empty if it cannot have any.  ``section`` counts from 0.  Where a part is not
    made as drawn, ``error`` is by how much longer the arm of the second mount, a body's, is (m); in
    a structure that has been put together the arm has it.
    """

    kind: Literal["revolute", "prismatic", "sleeve", "weld"]
    family: str
    section: int
    first: Mount
    second: Mount
    error: Array | None = None


@dataclass(frozen=True)
class JointOpening:
    """An opening angle at a revolute: pi less ``sense`` times the turn of the second part.

    It is pi, and the joint locked, where both parts lie in line.  ``lift`` is the direction in
    space of a load that opens it, shape (3,).
    """

    joint: int
    sense: float
    lift: Array


@dataclass(frozen=True)
class ChordOpening:
    """The angle about z of the line from a point in space to a body's origin, from -y; no lock."""

    body: int
    centre: Array


Opening = JointOpening | ChordOpening


# How stiff an element of a rod is.


def stiffness_of(rod: Rod, rods: Rods, length: float) -> Array:
    """Stiffness of u and psi of an element of a length (m), shape (6,), N/m and N m.

    See ``ringsim.frame.state`` for the strains; the shear carries the flexibility of bending
    that constant curvature lacks.
    """
    young, area, second = rod.young_modulus, rod.tube.area, rod.tube.second_moment
    shear, bending = young * rods.shear_modulus_ratio, young * second
    direct = rod.tube.shear_factor(rods.poisson_ratio) * shear * area
    across = 1.0 / (1.0 / direct + length**2 / (12.0 * bending))
    return np.array([young * area, across, across, 2.0 * shear * second, bending, bending]) / length
