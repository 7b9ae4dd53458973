"""A layout under construction: what a structure calls to say what it consists of.

Places and axes are given at q + i STEP (ringsim.layout.pose): no structure differentiates anything.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from ringsim.cable.bracket.bar_half import BarHalfBracket
from ringsim.cable.records import Cable
from ringsim.cable.sheaves import BlockSheave, FixedSheave, Sheave
from ringsim.layout.base import add_boom, base_of
from ringsim.layout.bodies import SPACE, Body, InSpace, Lump, Mount, OnBody, OnRod, Rod, pose_of
from ringsim.layout.edge import along_edges
from ringsim.layout.free_hub import FreeHub
from ringsim.layout.hung import hang
from ringsim.layout.joints import ChordOpening, Joint, JointOpening, Opening
from ringsim.layout.layout import Contact, HubNet, Layout, Spring
from ringsim.layout.pose import Array, Pose, axes_along, rate_of, real_of
from ringsim.parts.net.hub import SpringNet
from ringsim.parts.persection import spread
from ringsim.parts.tube import Tube

_CLOSE = 1e-9
"""Points that coincide, over the size of the part: round-off leaves 1e-15."""


class BodyRef(NamedTuple):
    """A body of a draft."""

    number: int


class RodRef(NamedTuple):
    """A rod of a draft."""

    number: int


Part = BodyRef | RodRef


class Track(NamedTuple):
    """Where the cable of a plane can run.

    ``stations`` are, in the order of the path, sheaves fixed on bodies and the sections whose joint
    opens; ``inward`` points from the first or last of them to a winch, a unit vector in space.
    """

    stations: Sequence[Mount | int]
    inward: Array


@dataclass
class Draft:
    """Collects parts; ``finish`` adds what the scene names and gives the layout.

    Of the scene it reads ``rods``, ``boom``, ``spacecraft``, ``net``, ``loads``, ``gravity``,
    ``offload`` and ``cables``.
    """

    scene: Any
    bodies: list[Body] = field(default_factory=list)
    rods: list[Rod] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    openings: dict[int, list[Opening]] = field(default_factory=lambda: defaultdict(list))
    corners: list[list[BodyRef]] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    contacts: list[Contact] = field(default_factory=list)
    tracks: dict[int, Track] = field(default_factory=dict)

    def body(self, place: Any, lumps: Sequence[Lump], axes: Any = SPACE) -> BodyRef:
        """A rigid body whose axes are those of space unless given."""
        self.bodies.append(Body(Pose.of(place, axes), tuple(lumps)))
        return BodyRef(len(self.bodies) - 1)

    def rod(
        self,
        name: str,
        section: int,
        group: str,
        ends: Sequence[Any],
        normal: Any,
        tube: Tube,
        stations: Sequence[float],
        young_modulus: float,
        masses: tuple[tuple[int, float, str], ...] = (),
        strain: float = 0.0,
    ) -> RodRef:
        """A straight rod whose joints turn about ``normal``; see ``Rod`` for what it is made of.

        Raises
        ------
        ValueError
            If its length changes with the coordinate: it would have to be stretched.
        """
        start = Pose.of(ends[0], axes_along(ends[0], ends[1], normal))
        end = replace(start, place=real_of(ends[1]), rate=rate_of(ends[1]))
        rod = Rod(name, section, group, start, end, tube, young_modulus, self.scene.rods.density,
                  tuple(float(share) for share in stations), masses, strain)  # fmt: skip
        stretch = abs(float((end.rate - start.rate) @ start.axes[:, 0]))
        if stretch > _CLOSE * rod.length:
            raise ValueError(
                f"{name} of section {section + 1} changes its length by {stretch:.3g} m per unit "
                "of the structure's coordinate: place its ends so that rods keep their lengths"
            )
        self.rods.append(rod)
        return RodRef(len(self.rods) - 1)

    def joint(
        self,
        kind: Literal["revolute", "weld"],
        family: str,
        section: int,
        parts: Sequence[Part | None],
        at: Any,
        axes: Any = None,
        error: Array | None = None,
    ) -> int:
        """A joint between two parts at a place; None stands for space.

        Its ``axes`` are those of the first of the parts that is a rod unless given; see ``Joint``
        for its ``error``, here a vector in space.

        Raises
        ------
        ValueError
            If a part does not carry the place along: the joint would come apart.
        """
        if axes is None:
            rods = [self.rods[part.number] for part in parts if isinstance(part, RodRef)]
            axes = rods[0].start.axes if rods else SPACE
        if parts[1] is None:  # a place in space comes first, as those who read supports expect
            parts = parts[::-1]
        first, second = (self._mount(part, at, real_of(axes), family or kind) for part in parts)
        if error is not None:
            assert isinstance(second, OnBody)
            error = self.bodies[second.body].pose.axes.T @ error
        self.joints.append(Joint(kind, family, section, first, second, error))
        return len(self.joints) - 1

    def slide(self, first: BodyRef, second: BodyRef, axes: Any) -> None:
        """Let two bodies slide along the x axis of ``axes``, each held at its own origin."""
        numbers, frame = (first.number, second.number), real_of(axes)
        low, high = (OnBody(k, axes=self.bodies[k].pose.axes.T @ frame) for k in numbers)
        self.joints.append(Joint("prismatic", "", 0, low, high))

    def opening(self, plane: int, joint: int, sense: float, lift: Any) -> None:
        """Let a revolute's angle be the opening angle of the plane's next section."""
        self.openings[plane].append(JointOpening(joint, sense, np.asarray(lift, dtype=float)))

    def chord_opening(self, plane: int, body: BodyRef, centre: Any) -> None:
        """Let the line from a point in space to a body's origin be that angle."""
        self.openings[plane].append(ChordOpening(body.number, real_of(centre)))

    def on(self, body: BodyRef, at: Any) -> Mount:
        """A place on a body that carries it."""
        return self._mount(body, at, SPACE, "sheave")

    def finish(self) -> Layout:
        """The layout, with boom, net, loads and cables of the scene."""
        weight = self.scene.gravity
        gravity = None if weight is None else np.array(weight.vector)
        boom = add_boom(self)  # adds lumps and joints
        openings = tuple(tuple(self.openings[plane]) for plane in sorted(self.openings))
        return Layout(
            bodies=tuple(self.bodies),
            rods=tuple(self.rods),
            joints=tuple(self.joints),
            openings=openings,
            corners=tuple(tuple(ref.number for ref in plane) for plane in self.corners),
            paths=self._paths(),
            springs=tuple(self.springs),
            contacts=tuple(self.contacts),
            net=self._net(),
            boom=boom,
            forces=self._forces(openings),
            base=base_of(self),
            gravity=gravity,
            hung=None if gravity is None else hang(self, gravity, base_of(self)),
            edge=along_edges(self),
        )

    def _mount(self, part: Part | None, at: Any, axes: Array, what: str) -> Mount:
        place, size = real_of(at), 1.0
        if part is None:
            return InSpace(place, axes)
        mount: Mount
        if isinstance(part, BodyRef):
            pose = self.bodies[part.number].pose
            mount = OnBody(part.number, pose.axes.T @ (place - pose.place), pose.axes.T @ axes)
        else:
            rod = self.rods[part.number]
            size = max(rod.length, 1.0)
            share = float((place - rod.start.place) @ rod.start.axes[:, 0]) / rod.length
            off = [abs(station - share) for station in rod.stations]
            mount = OnRod(part.number, off.index(min(off)))
        there = pose_of(mount, self.bodies, self.rods)
        apart = max(np.abs(there.place - place).max(), np.abs(there.rate - rate_of(at)).max())
        if apart > _CLOSE * size:
            raise ValueError(
                f"a {what} stands {apart:.3g} m off a part that it belongs to, or leaves it as the "
                "structure folds: give the place that both parts share"
            )
        return mount

    def require_corners(self, part: str, planes: int) -> None:
        """Raise a ValueError if so many planes have no corners for a part."""
        if len(self.corners) < planes:
            raise ValueError(
                f"{part}: this structure has no corners to hold one in {planes} of its planes: "
                f'leave it out ({part} = "none")'
            )

    def _net(self) -> HubNet | None:
        net = self.scene.net
        if not isinstance(net, SpringNet):
            return None
        self.require_corners("net", 1)
        held = tuple(ref.number for ref in self.corners[0])
        hub = FreeHub(net, len(held)).hub(np.array([self.bodies[k].pose.place for k in held]))
        return HubNet(net, hub, held)

    def _forces(self, openings: Sequence[Sequence[Opening]]) -> tuple[tuple[int, Array], ...]:
        force = 0.0 if self.scene.loads is None else self.scene.loads.force
        return tuple(
            (one.joint, value * one.lift)
            for plane in openings
            for one, value in zip(plane, spread(force, len(plane)).tolist(), strict=True)
            if isinstance(one, JointOpening) and value != 0.0
        )

    def _paths(self) -> tuple[tuple[Sheave, ...], ...]:
        cables, found = self.scene.cables, []
        for plane, cable in () if cables is None else cables.present():
            if plane not in self.tracks:
                raise ValueError(
                    f"cables: this structure has no track for a cable in plane {plane + 1}: leave "
                    "it out, or give Draft.tracks one"
                )
            track = self.tracks[plane]
            path = [self._sheave(plane, cable, station) for station in track.stations]
            if cable.end == "last":
                path.reverse()
            winches = []
            for end in (path[0], path[-1]) if cable.end == "both" else path[:1]:
                assert isinstance(end, FixedSheave)
                axes = pose_of(end.node, self.bodies, self.rods).axes
                away = axes.T @ (cables.winch_distance * track.inward)
                winches.append(FixedSheave(end.node, end.arm + away))
            found.append((winches[0], *path, *winches[1:]))
        return tuple(found)

    def _sheave(self, plane: int, cable: Cable, station: Mount | int) -> Sheave:
        """A fixed sheave, or the one beside a joint that opens, where the bracket holds it."""
        if not isinstance(station, int):
            return FixedSheave(station, np.zeros(3))
        opening = self.openings[plane][station]
        assert isinstance(opening, JointOpening)
        joint, bracket = self.joints[opening.joint], cable.bracket
        halves = joint.first, joint.second
        if not isinstance(bracket, BarHalfBracket):
            return BlockSheave(halves, opening.sense, cable.block_offset)
        frames = [pose_of(half, self.bodies, self.rods).axes for half in halves]
        bar, normal = frames[0][:, 0], frames[0][:, 2]
        chord = bar + frames[1][:, 0]
        chord = chord / np.linalg.norm(chord)
        phi = float(np.arctan2(np.linalg.norm(np.cross(chord, bar)), chord @ bar))
        aside, inward = bracket.place(phi, cable.block_offset)
        place = float(aside) * chord - float(inward) * opening.sense * np.cross(normal, chord)
        side = 0 if bracket.half == "first" else 1
        return FixedSheave(halves[side], frames[side].T @ place)
