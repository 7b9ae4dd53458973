"""A layout under construction: what a structure calls to say what it consists of.

Places and axes are computed at q + i STEP (ringsim.layout.pose), so that no structure has to
differentiate anything; what is fixed in a part is found from where it stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.bracket.bar_half import BarHalfBracket
from ringsim.cable.cables import Cables
from ringsim.cable.records import Cable
from ringsim.cable.sheaves import BlockSheave, FixedSheave, Sheave
from ringsim.layout.bodies import Body, InSpace, Lump, Mount, OnBody, OnRod, Rod
from ringsim.layout.free_hub import FreeHub
from ringsim.layout.joints import ChordOpening, Joint, JointOpening, Opening
from ringsim.layout.layout import Layout
from ringsim.layout.pose import Pose, axes_along, rate_of, real_of
from ringsim.layout.springs import BoomBeam, Contact, HubNet, Spring
from ringsim.parts.boom.family import Boom
from ringsim.parts.boom.rigid import RigidBoom
from ringsim.parts.loads import Loads
from ringsim.parts.net import Net
from ringsim.parts.persection import spread
from ringsim.parts.rods.family import Rods
from ringsim.parts.tube import Tube

Array = NDArray[np.float64]
_CLOSE = 1e-9
"""Points that coincide, over the size of the part: round-off leaves 1e-15."""


class Equipment(Protocol):
    """What a layout reads of a scene besides its structure."""

    @property
    def rods(self) -> Rods:
        """Material and tubes."""

    @property
    def boom(self) -> Boom | None:
        """The boom at the first corner."""

    @property
    def net(self) -> Net | None:
        """Springs from the upper corners to a hub."""

    @property
    def loads(self) -> Loads | None:
        """Forces on the joints that open."""

    @property
    def cables(self) -> Cables | None:
        """The driving cables."""


class BodyRef(NamedTuple):
    """A body of a draft."""

    number: int


class RodRef(NamedTuple):
    """A rod of a draft."""

    number: int


Part = BodyRef | RodRef


class Track(NamedTuple):
    """Where the cable of a plane can run.

    Attributes
    ----------
    stations
        Sheaves fixed on bodies, and joints that open, in the order of the path; joints by section.
    inward
        From the first or last sheave to a winch, unit vector in space.
    """

    stations: Sequence[Mount | int]
    inward: Array


@dataclass
class Draft:
    """Collects parts; ``finish`` adds what the scene names and gives the layout."""

    scene: Equipment
    bodies: list[Body] = field(default_factory=list)
    rods: list[Rod] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    openings: dict[int, list[Opening]] = field(default_factory=dict)
    corners: list[list[BodyRef]] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    contacts: list[Contact] = field(default_factory=list)
    tracks: dict[int, Track] = field(default_factory=dict)

    def body(self, place: Any, lumps: Sequence[Lump], axes: Any = None) -> BodyRef:
        """A rigid body whose axes are those of space unless given."""
        frame = np.eye(3) if axes is None else axes
        self.bodies.append(Body(Pose.of(place, frame), tuple(lumps)))
        return BodyRef(len(self.bodies) - 1)

    def rod(
        self,
        name: str,
        section: int,
        group: str,
        ends: tuple[Any, Any],
        normal: Any,
        tube: Tube,
        stations: Sequence[float],
        young_modulus: float,
    ) -> RodRef:
        """A straight rod whose joints turn about ``normal``.

        Raises
        ------
        ValueError
            If its length changes with the coordinate: it would have to be stretched.
        """
        start, end = ends
        axes = axes_along(start, end, normal)
        rod = Rod(
            name, section, group, Pose.of(start, axes), Pose.of(end, axes), tube,
            young_modulus, self.scene.rods.density, tuple(float(s) for s in stations),
        )  # fmt: skip
        stretch = abs(float((rod.end.rate - rod.start.rate) @ rod.start.axes[:, 0]))
        if stretch > _CLOSE * rod.length:
            raise ValueError(
                f"{name} of section {section + 1} changes its length by {stretch:.3g} m per unit "
                "of the structure's coordinate: place its ends so that rods keep their lengths"
            )
        self.rods.append(rod)
        return RodRef(len(self.rods) - 1)

    def add_mass(self, rod: RodRef, station: int, mass: float) -> None:
        """A point mass (kg) on a node of a rod; negative stations count from its end."""
        old = self.rods[rod.number]
        number = range(len(old.stations))[station]
        self.rods[rod.number] = replace(old, masses=(*old.masses, (number, mass)))

    def joint(
        self,
        kind: Literal["revolute", "weld"],
        family: str,
        section: int,
        parts: tuple[Part | None, Part],
        at: Any,
        axes: Any = None,
    ) -> int:
        """A joint between two parts at a place; None stands for space.

        Parameters
        ----------
        axes
            Of the joint; those of the first of the parts that is a rod unless given.

        Raises
        ------
        ValueError
            If a part does not carry the place along: the joint would come apart.
        """
        rods = [part for part in parts if isinstance(part, RodRef)]
        frame = np.eye(3) if not rods else self.rods[rods[0].number].start.axes
        frame = frame if axes is None else real_of(axes)
        first, second = (self._mount(part, at, frame, family or kind) for part in parts)
        self.joints.append(Joint(kind, family, section, first, second))
        return len(self.joints) - 1

    def slide(self, first: BodyRef, second: BodyRef, axes: Any) -> None:
        """Let two bodies slide along the x axis of ``axes``, each held at its own origin."""
        frame = real_of(axes)
        mounts = [
            OnBody(ref.number, np.zeros(3), self.bodies[ref.number].pose.axes.T @ frame)
            for ref in (first, second)
        ]
        self.joints.append(Joint("prismatic", "", 0, mounts[0], mounts[1]))

    def opening(self, plane: int, joint: int, sense: float, lift: Any) -> None:
        """Let a revolute's angle be the opening angle of the plane's next section."""
        self.openings.setdefault(plane, []).append(
            JointOpening(joint, sense, np.asarray(lift, dtype=float))
        )

    def chord_opening(self, plane: int, body: BodyRef, centre: Any) -> None:
        """Let the line from a point in space to a body's origin be that angle."""
        self.openings.setdefault(plane, []).append(ChordOpening(body.number, real_of(centre)))

    def on(self, body: BodyRef, at: Any) -> OnBody:
        """A place on a body that carries it."""
        found = self._mount(body, at, np.eye(3), "sheave")
        assert isinstance(found, OnBody)
        return found

    def finish(self) -> Layout:
        """The layout, with boom, net, loads and cables of the scene."""
        boom = self._boom()
        openings = tuple(tuple(self.openings[plane]) for plane in sorted(self.openings))
        layout = Layout(
            tuple(self.bodies),
            tuple(self.rods),
            tuple(self.joints),
            openings,
            tuple(tuple(ref.number for ref in plane) for plane in self.corners),
            (),
            tuple(self.springs),
            tuple(self.contacts),
            self._net(),
            boom,
            self._forces(openings),
        )
        return replace(layout, paths=self._paths(layout))

    def _mount(self, part: Part | None, at: Any, axes: Array, what: str) -> Mount:
        place, rate = real_of(at), rate_of(at)
        if part is None:
            return InSpace(place, axes)
        if isinstance(part, BodyRef):
            pose = self.bodies[part.number].pose
            mount: Mount = OnBody(part.number, pose.inside(place), pose.axes.T @ axes)
            moved, size = pose.at(pose.inside(place)), 1.0
        else:
            rod = self.rods[part.number]
            share = float((place - rod.start.place) @ rod.start.axes[:, 0]) / rod.length
            nearest = int(np.argmin(np.abs(np.array(rod.stations) - share)))
            mount, size = OnRod(part.number, nearest), rod.length
            pose = rod.station(rod.stations[nearest])
            moved = pose.place, pose.rate
        apart = max(np.abs(moved[0] - place).max(), np.abs(moved[1] - rate).max())
        if apart > _CLOSE * max(size, 1.0):
            raise ValueError(
                f"a {what} stands {apart:.3g} m off a part that it belongs to, or leaves it as the "
                "structure folds: give the place that both parts share"
            )
        return mount

    def _boom(self) -> BoomBeam | None:
        boom = self.scene.boom
        if boom is None:
            return None
        top, low = self.corners[0][0], self.corners[1][0]
        upper = self.bodies[top.number].pose
        if boom.base == "fixed":
            space = InSpace(upper.place, np.eye(3))
            self.joints.append(Joint("weld", "", 0, space, OnBody(top.number, *_HERE)))
        tube = boom.tube
        across = 0.125 * boom.mass * (tube.outer_diameter**2 + tube.inner_diameter**2)
        along = boom.mass * boom.length**2 / 3.0 + 0.5 * across
        centre = np.array([0.0, 0.0, -0.5 * boom.length])
        lump = Lump("boom", boom.mass, centre, np.diag([along, along, across]))
        ends = OnBody(top.number, *_HERE), OnBody(low.number, *_HERE)
        if not isinstance(boom, RigidBoom):
            return BoomBeam(*ends, boom, lump)
        body = self.bodies[top.number]
        self.bodies[top.number] = replace(body, lumps=(*body.lumps, lump))
        self.joints.append(Joint("sleeve", "", 0, *ends))
        return None

    def _net(self) -> HubNet | None:
        net = self.scene.net
        if net is None:
            return None
        held = tuple(ref.number for ref in self.corners[0])
        places = np.array([self.bodies[number].pose.place for number in held])
        hub = FreeHub(net, len(held)).hub(places)
        return HubNet(hub, net.hub_mass, held, spread(net.stiffness, len(held)))

    def _forces(self, openings: tuple[tuple[Opening, ...], ...]) -> tuple[tuple[int, Array], ...]:
        if self.scene.loads is None:
            return ()
        found = []
        for plane in openings:
            force = spread(self.scene.loads.force, len(plane))
            for opening, value in zip(plane, force, strict=True):
                if isinstance(opening, JointOpening) and value != 0.0:
                    found.append((opening.joint, float(value) * opening.lift))
        return tuple(found)

    def _paths(self, layout: Layout) -> tuple[tuple[Sheave, ...], ...]:
        cables = self.scene.cables
        if cables is None:
            return ()
        found = []
        for plane, cable in cables.present():
            track = self.tracks[plane]
            path = [self._sheave(layout, plane, cable, one) for one in track.stations]
            if cable.end == "last":
                path = path[::-1]
            away = cables.winch_distance * track.inward
            ends = [path[0], path[-1]] if cable.end == "both" else [path[0]]
            winches = [self._winch(end, away) for end in ends]
            found.append((winches[0], *path, *winches[1:]))
        return tuple(found)

    def _sheave(self, layout: Layout, plane: int, cable: Cable, station: Mount | int) -> Sheave:
        """A fixed sheave, or the one beside a joint that opens, where the bracket holds it."""
        if isinstance(station, OnBody):
            return FixedSheave(station, np.zeros(3))
        assert isinstance(station, int)
        opening = layout.openings[plane][station]
        assert isinstance(opening, JointOpening)
        joint = layout.joints[opening.joint]
        left, right = joint.first, joint.second
        assert isinstance(left, OnRod)
        assert isinstance(right, OnRod)
        bracket = cable.bracket
        if not isinstance(bracket, BarHalfBracket):
            return BlockSheave(left, right, opening.sense, cable.block_offset)
        ends = layout.pose(left).axes, layout.pose(right).axes
        chord = ends[0][:, 0] + ends[1][:, 0]
        chord = chord / np.linalg.norm(chord)
        phi = float(
            np.arctan2(np.linalg.norm(np.cross(chord, ends[0][:, 0])), chord @ ends[0][:, 0])
        )
        inward = -opening.sense * np.cross(ends[0][:, 2], chord)
        aside, inwards = bracket.place(phi, cable.block_offset)
        place = float(aside) * chord + float(inwards) * inward
        side = 0 if bracket.half == "first" else 1
        return FixedSheave((left, right)[side], ends[side].T @ place)

    def _winch(self, nearest: Sheave, away: Array) -> FixedSheave:
        """The winch of a sheave at an end of the path."""
        assert isinstance(nearest, FixedSheave)
        assert isinstance(nearest.node, OnBody)
        axes = self.bodies[nearest.node.body].pose.axes @ nearest.node.axes
        return FixedSheave(nearest.node, nearest.arm + axes.T @ away)


_HERE = (np.zeros(3), np.eye(3))
"""A body's own origin and axes."""
