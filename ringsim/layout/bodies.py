"""Rigid bodies, elastic rods, and places on them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ringsim.layout.pose import Array, Pose
from ringsim.parts.tube import Tube


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
    (``ringsim.theory.assembled``) tells where its ``nodes`` then are, one a station.
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

    @property
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
