"""A layout under construction: what a structure calls to say what it consists of."""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.records import BarHalfBracket, BlockSheave, Cable, FixedSheave, Sheave
from ringsim.layout.bodies import (
    SPACE,
    Array,
    Body,
    ChordOpening,
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
    axes_along,
    cross,
    pose_of,
    rate_of,
    real_of,
)
from ringsim.layout.layout import (
    SPACECRAFT,
    BoomBeam,
    Contact,
    Hub,
    Hung,
    Layout,
    layout_at_opening,
)
from ringsim.parts.laws import AngleLaw, Corners, PairLaw, Reaction, Rub
from ringsim.parts.rods import Tube
from ringsim.refusal import InputError
from ringsim.units import spread

if TYPE_CHECKING:
    from ringsim.scene import Scene

# What holds a structure: its boom and, at the boom's upper end, the ground or a spacecraft.


_UPWARDS = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""Axes with x along the boom."""


def add_boom(draft: "Draft") -> BoomBeam | None:
    """A flexible boom; a rigid one becomes a lump of the body at its top."""
    boom = draft.scene.boom
    if boom is None:
        return None
    draft.require_corners("boom", 2)
    top, low = (OnBody(plane[0].number) for plane in draft.corners[:2])
    body, tube = draft.bodies[top.body], boom.tube
    if boom.base == "fixed":
        draft.joints.append(Joint("weld", "", 0, InSpace(body.pose.place, SPACE), top))
    across = 0.125 * boom.mass * (tube.outer_diameter**2 + tube.inner_diameter**2)
    along = boom.mass * boom.length**2 / 3.0
    centre = np.array([0.0, 0.0, -0.5 * boom.length])
    line = Lump("boom", boom.mass, centre, np.diag([along, along, 0.0]))
    sections = across * np.diag([0.5, 0.5, 1.0])
    _add_spacecraft(draft, top.body)
    if boom.sliding is None:
        # Elements are lines: what the tube's sections have of inertia turns with its top.
        _add_lump(draft, top.body, Lump("boom", 0.0, np.zeros(3), sections))
        return BoomBeam(top, low, boom, line)
    _add_lump(draft, top.body, line._replace(inertia=line.inertia + sections))
    # A sleeve slides along z, a prismatic joint along x.
    axes = SPACE if boom.sliding == "sleeve" else _UPWARDS
    first, second = (end._replace(axes=axes) for end in (top, low))
    draft.joints.append(Joint(boom.sliding, "", 0, first, second))
    return None


def base_of(draft: "Draft") -> int | None:
    """Number of the body that is held, or that a boom's upper end is fixed to; None without."""
    for joint in draft.joints:
        if isinstance(joint.first, InSpace) and isinstance(joint.second, OnBody):
            return joint.second.body
    return None if draft.scene.boom is None else draft.corners[0][0].number


def _add_spacecraft(draft: "Draft", top: int) -> None:
    craft = draft.scene.spacecraft
    if craft is not None:
        lump = Lump(SPACECRAFT, craft.mass, np.array(craft.centre), craft.inertia_at_mount)
        _add_lump(draft, top, lump)


def _add_lump(draft: "Draft", number: int, lump: Lump) -> None:
    body = draft.bodies[number]
    draft.bodies[number] = replace(body, lumps=(*body.lumps, lump))


# The lines that carry a structure in a ground test, and what each carries.


def hang(draft: "Draft", gravity: np.ndarray, base: int | None) -> Hung | None:
    """The lines of a scene's offload; the base carries its own corner where it is held."""
    law = draft.scene.offload
    if law is None:
        return None
    planes = {"upper": (0,), "lower": (1,), "both": (0, 1)}[law.planes]
    draft.require_corners("offload", planes[-1] + 1)
    size, count = float(np.linalg.norm(gravity)), len(draft.corners[0])
    chosen = [number - 1 for number in law.corners] or range(count)
    carried = [(draft.corners[plane][k].number, k) for plane in planes for k in chosen]
    own = np.array([draft.bodies[body].mass for body, _ in carried])
    net, boom = draft.scene.net, draft.scene.boom
    whole = sum(body.mass for body in draft.bodies) + sum(
        rod.mass + sum(mass for _, mass, _ in rod.masses) for rod in draft.rods
    )
    whole += 0.0 if net is None else net.point_mass
    # A rigid boom is a lump of the body at its top.
    if boom is not None and boom.sliding is None and not draft.scene.held:
        whole += boom.mass
    held = draft.bodies[base] if base is not None and draft.scene.held else None
    if held is not None and base not in [body for body, _ in carried]:
        whole -= held.mass
    residual = spread(law.residual, count)[[k for _, k in carried]]
    lifts = (1.0 - residual) * size * (own + (whole - own.sum()) / len(carried))
    keep = [n for n, (body, _) in enumerate(carried) if held is None or body != base]
    return Hung(law, tuple(carried[n][0] for n in keep), lifts[keep], -gravity / size)


# The hub of a net, where its strings balance.
#
# The hub lies where the strings' pulls balance, sum T_i u_i = 0 (T_i the tension, u_i the direction
# from the hub): the least of a convex energy while they only pull, found by Newton's method with
# A_i = dT_i/dl u_i u_i^T + (T_i / l_i) (1 - u_i u_i^T), the pulls' derivatives after its place.
# The strings' work is then that of the corners alone.


_MOST = 60
"""Newton steps to the hub, each a tenth of the net's size long at most."""
_BALANCED = 1e-14
"""Pull on the hub over the largest string's, or its movement over the net's size, taken as zero."""
_NUDGE = 1e-7
"""Change of a string's length by which its stiffness is measured, over the net's size."""


class NetForce(NamedTuple):
    """Generalised force of a net at rest on a coordinate (N m), and its energy (J)."""

    force: float
    energy: float


class FreeHub:
    """Strings of a law from a free hub; ``ends`` have the shape (strings, 3), m."""

    def __init__(self, law: PairLaw) -> None:
        self._law = law

    def place(self, ends: Array) -> Array:
        """Where it lies, shape (3,), m: midway while all is slack."""
        return self._balance(ends)[0]

    def force(self, ends: Array, slopes: Array) -> NetForce:
        """On a coordinate after which ``slopes`` are the ends' derivatives, (strings, 3), m/rad."""
        _, units, still = self._balance(ends)
        longer = np.sum(units * slopes, axis=1)
        # A difference, not a negative: a slack net pulls with 0, not -0.
        return NetForce(0.0 - float(still.elastic @ longer), float(np.sum(still.stored)))

    def _balance(self, ends: Array) -> tuple[Array, Array, Reaction]:
        """The hub, and the strings' directions and reaction at rest there."""
        hub, size, moved = ends.mean(axis=0), float(np.ptp(ends)), np.inf
        for _ in range(_MOST):
            arms = ends - hub
            lengths = np.maximum(np.linalg.norm(arms, axis=1), 1e-300)
            units = arms / lengths[:, None]
            still = self._still(lengths)
            pull = still.elastic @ units
            balanced = np.abs(pull).max() <= _BALANCED * np.abs(still.elastic).max()
            if balanced or moved < _BALANCED * size:
                break
            ahead, behind = (self._still(lengths + by * _NUDGE * size).elastic for by in (1, -1))
            stiffness = (ahead - behind) / (2.0 * _NUDGE * size)
            along = units[:, :, None] * units[:, None, :]
            across = (still.elastic / lengths)[:, None, None] * (np.eye(3) - along)
            matrix = (stiffness[:, None, None] * along + across).sum(axis=0)
            step = np.linalg.lstsq(matrix, pull, rcond=1e-9)[0]
            moved = float(np.abs(step).max())
            hub = hub + (step if moved <= 0.1 * size else step * (0.1 * size / moved))
        return hub, units, still

    def _still(self, lengths: Array) -> Reaction:
        return self._law.reaction(lengths, np.zeros(len(lengths)))


def balanced(layout: Layout) -> Layout:
    """A layout with its hub where the strings of the net balance."""
    hung = [law for law in layout.pair_laws if law.hung]
    if not hung or layout.hub is None:
        return layout
    if len(hung) > 1:
        raise ValueError("net: define all strings to the hub in one law")
    ends = np.array([layout.bodies[body].pose.place for body in hung[0].bodies[:, 1]])
    return replace(layout, hub=layout.hub._replace(place=FreeHub(hung[0]).place(ends)))


# A layout under construction: what a structure calls to say what it consists of.
#
# Places and axes are given at q + i STEP (ringsim.layout.bodies): no structure differentiates
# anything.


_CLOSE = 1e-9
"""Points that coincide, over the size of the part: round-off leaves 1e-15."""


_opened: "list[tuple[Scene, Array]]" = []
"""The scene whose net was strung last, and its places: a run and its drive margin ask for the same,
and layouts are most of what either builds."""


def _deployed(scene: "Scene") -> Array:
    """Places of all bodies of a scene where it is open, m, shape (bodies, 3)."""
    if not _opened or _opened[0][0] is not scene:
        layout = layout_at_opening(scene.model_copy(update={"net": None}), math.pi)
        _opened[:] = [(scene, np.array([body.pose.place for body in layout.bodies]))]
    (_, places), *_ = _opened
    return places


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

    Of the scene it reads ``rods``, ``joints``, ``stop``, ``hinge_spring``, ``latch``, ``faults``,
    ``boom``, ``spacecraft``, ``net``, ``loads``, ``gravity``, ``offload`` and ``cables``.
    """

    scene: "Scene"
    bodies: list[Body] = field(default_factory=list)
    rods: list[Rod] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    openings: dict[int, list[Opening]] = field(default_factory=lambda: defaultdict(list))
    corners: list[list[BodyRef]] = field(default_factory=list)
    pairs: list[PairLaw] = field(default_factory=list)
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
        stations: Sequence[float] | Array,
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
                "of the structure's coordinate: define its ends so that the rod keeps its length"
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
        where, own = (real_of(at), rate_of(at)), real_of(axes)
        first, second = (self._mount(part, *where, own, family or kind) for part in parts)
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
        return self._mount(body, real_of(at), rate_of(at), SPACE, "sheave")

    def finish(self) -> Layout:
        """The layout, with boom, net, loads and cables of the scene."""
        weight = self.scene.gravity
        gravity = None if weight is None else np.array(weight.vector)
        boom = add_boom(self)  # adds lumps and joints
        openings = tuple(tuple(self.openings[plane]) for plane in sorted(self.openings))
        layout = Layout(
            bodies=tuple(self.bodies),
            rods=tuple(self.rods),
            joints=tuple(self.joints),
            openings=openings,
            corners=tuple(tuple(ref.number for ref in plane) for plane in self.corners),
            paths=self._paths(),
            contacts=tuple(self.contacts),
            hub=None,
            boom=boom,
            forces=self._forces(openings),
            base=base_of(self),
            gravity=gravity,
            hung=None if gravity is None else hang(self, gravity, base_of(self)),
            angle_laws=self._angle_laws(openings),
            pair_laws=(*self.pairs, *self._net()),
            rubs=tuple(self._rub(*one) for one in self.scene.joints.present().items()),
        )
        net = self.scene.net
        if net is None or not any(law.hung for law in layout.pair_laws):
            return layout
        return balanced(replace(layout, hub=Hub(np.zeros(3), net.point_mass)))

    def _angle_laws(self, openings: Sequence[Sequence[Opening]]) -> tuple[AngleLaw, ...]:
        """Of stops, springs, latches and faults; InputError without V-joints that they act on."""
        scene, found = self.scene, list[AngleLaw]()
        parts = {name: getattr(scene, name) for name in ("stop", "hinge_spring", "latch")}
        parts |= {f"faults[{k}]": fault for k, fault in enumerate(scene.faults, 1)}
        for name, part in parts.items():
            if part is None:
                continue
            laws = part.laws(scene.structure.planes, scene.structure.sections)
            if laws and not all(isinstance(one, JointOpening) for row in openings for one in row):
                raise InputError(
                    f"{name}: this structure has no opening joints for it to act on: leave it "
                    f'out ({name} = "none")'
                )
            found += laws
        return tuple(found)

    def _rub(self, family: str, law: Any) -> Rub:
        """Friction of the joints of a family."""
        own = [number for number, joint in enumerate(self.joints) if joint.family == family]
        if not own:
            known = ", ".join(sorted({joint.family for joint in self.joints} - {""}))
            raise InputError(
                f"joints.{family}: this structure has no joint of that family (it has: "
                f'{known or "none"}): leave it out (joints.{family} = "none")'
            )
        sections = np.array([self.joints[number].section for number in own])
        return Rub(family, law, tuple(own), sections)

    def _mount(
        self, part: Part | None, place: Array, rate: Array, axes: Array, what: str
    ) -> Mount:  # fmt: skip
        size = 1.0
        if part is None:
            return InSpace(place, axes)
        mount: Mount
        if isinstance(part, BodyRef):
            pose = self.bodies[part.number].pose
            arm = place - pose.place
            mount = OnBody(part.number, pose.axes.T @ arm, pose.axes.T @ axes)
            there = pose.place + pose.axes @ mount.arm
            moving = pose.rate + cross(pose.turn.tolist(), arm.tolist())
        else:
            rod = self.rods[part.number]
            size = max(rod.length, 1.0)
            share = float((place - rod.start.place) @ rod.start.axes[:, 0]) / rod.length
            off = [abs(station - share) for station in rod.stations]
            mount = OnRod(part.number, off.index(min(off)))
            node = rod.node(mount.station)
            there, moving = node.place, node.rate
        differences = *(there - place).tolist(), *(moving - rate).tolist()
        apart = max(map(abs, differences))
        if apart > _CLOSE * size:
            raise ValueError(
                f"a {what} is {apart:.3g} m away from a part that it connects, at some opening "
                "angle: give the point that both parts share"
            )
        return mount

    def require_corners(self, part: str, planes: int) -> None:
        """Raise a ValueError if so many planes have no corners for a part."""
        if len(self.corners) < planes:
            raise ValueError(
                f"{part}: this structure has no corners for one in {planes} of its planes: leave "
                f'it out ({part} = "none")'
            )

    def _net(self) -> list[PairLaw]:
        net = self.scene.net
        if net is None:
            return []

        def distances(pairs: NDArray[np.int64]) -> Array:
            places = _deployed(self.scene)
            return np.asarray(np.linalg.norm(np.diff(places[pairs], axis=1)[:, 0], axis=1))

        rows = tuple(tuple(ref.number for ref in plane) for plane in self.corners)
        return list(net.laws(Corners(rows, self.scene.structure.sections, distances)))

    def _forces(self, openings: Sequence[Sequence[Opening]]) -> tuple[tuple[int, Array], ...]:
        force = 0.0 if self.scene.loads is None else self.scene.loads.force
        return tuple(
            (one.joint, value * one.lift)
            for plane in openings
            for one, value in zip(plane, spread(force, len(plane)).tolist(), strict=True)
            if isinstance(one, JointOpening) and value != 0.0
        )

    def _paths(self) -> tuple[tuple[Sheave, ...], ...]:
        cables, found = self.scene.cables, list[tuple[Sheave, ...]]()
        if cables is None:
            return ()
        for plane, cable in cables.present():
            if plane not in self.tracks:
                raise ValueError(
                    f"cables: this structure has no cable path in plane {plane + 1}: leave the "
                    "cable out, or add a path to Draft.tracks"
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
