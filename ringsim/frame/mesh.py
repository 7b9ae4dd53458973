"""Frames, joint angles and ends of rods of a layout: revolutes built into the unknowns."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.bodies import (
    Array,
    InSpace,
    Joint,
    JointOpening,
    Mount,
    OnBody,
    OnRod,
    Pose,
    stiffness_of,
)
from ringsim.layout.layout import SPACECRAFT, BoomBeam, Layout
from ringsim.parts.rods import Rods, Tube
from ringsim.refusal import InputError

# Frames, joint angles and ends of rods of a layout: revolutes built into the unknowns.
#
# A frame is a place and axes, six unknowns; a joint angle is one.  Every body is a frame.  Where
# two rods cross or meet in a revolute, the first one's node is a frame and the second one's is
# turned against it by an angle; where a rod hangs on a body, its end is turned against the body by
# one.


NOT_HERE = 'fidelity = "frame" does not represent'
CURE = 'choose fidelity = "full"'


class End(NamedTuple):
    """A node of a rod: frame, place in it (m), axes in it before the turn of an angle about its z
    axis, and the number of that angle, -1 if there is none.
    """

    frame: int
    arm: Array
    axes: Array
    angle: int


class Element(NamedTuple):
    """An elastic element between two ends; length (m), stiffness of u (N/m) and psi (N m), shape
    (6,), and what ``inertia_of`` gives.
    """

    first: End
    second: End
    length: float
    stiffness: Array
    mass: Array


class Angle(NamedTuple):
    """A joint's angle: joint, sense of the joint's own rate, and value at the start, rad."""

    joint: int
    sense: float
    start: float


class Skeleton:
    """Frames, angles and ends of a layout, before they are arrays."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout
        self.places = [body.pose.place for body in layout.bodies]
        self.axes = [body.pose.axes for body in layout.bodies]
        self.rates = [(body.pose.rate, body.pose.turn) for body in layout.bodies]
        self.angles: list[Angle] = []
        self.angle_rates: list[float] = []
        self.fixed: list[int] = []
        self.slides: list[tuple[int, int, bool]] = []
        """Bodies at the top of a boom and on it, and whether these cannot turn against each other.
        """
        self.beam: list[End] = []
        self._ends: dict[tuple[int, int], End] = {}
        self.angle_of: dict[int, int] = {}
        self._opening = {
            one.joint for plane in layout.openings for one in plane if isinstance(one, JointOpening)
        }
        revolutes = [(n, j) for n, j in enumerate(layout.joints) if j.kind == "revolute"]
        for joint in layout.joints:
            self._hold(joint)
        # Hinges first: what hangs on a body needs no frame of its own.
        for number, joint in revolutes:
            if not all(isinstance(side, OnRod) for side in (joint.first, joint.second)):
                self._hang(number, joint)
        for number, joint in revolutes:
            if all(isinstance(side, OnRod) for side in (joint.first, joint.second)):
                self._cross(number, joint)

    def end(self, rod: int, station: int) -> End:
        """The node of a rod at a station; one that no joint holds has a frame of its own."""
        key = rod, station
        if key not in self._ends:
            part = self.layout.rods[rod]
            pose = part.node(station)
            self._frame(pose)
            self._ends[key] = End(len(self.places) - 1, np.zeros(3), np.eye(3), -1)
        return self._ends[key]

    def add_beam(self, beam: BoomBeam) -> list[Element]:
        """The elements of a flexible boom, from its clamped top down; ``beam`` are their nodes."""
        boom, pose = beam.record, self.layout.pose(beam.top)
        # x along the boom, downwards, as the body at its top stands after assembly.
        own = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        axes = pose.axes @ own
        length = boom.length / boom.elements
        self.beam = [End(beam.top.body, beam.top.arm, beam.top.axes @ own, -1)]
        top = replace(pose, axes=axes)
        for k in range(1, boom.elements + 1):
            place, rate = top.at(np.array([k * length, 0.0, 0.0]))
            self._frame(Pose(place, axes, rate, top.turn))
            self.beam.append(End(len(self.places) - 1, np.zeros(3), np.eye(3), -1))
        young, area, second = boom.young_modulus, boom.tube.area, boom.tube.second_moment
        # Nothing twists a boom along which a body slides freely: any torsional stiffness will do.
        bending, across = young * second, 12.0 * young * second / length**2
        stiffness = np.array([young * area, across, across, bending, bending, bending]) / length
        # Its sections' inertia is the top's (ringsim.layout.draft).
        mass = boom.mass / boom.elements / 6.0 * np.array([2.0, 1.0])
        return [Element(*pair, length, stiffness, mass) for pair in pairwise(self.beam)]

    def _frame(self, pose: Pose) -> None:
        self.places.append(pose.place)
        self.axes.append(pose.axes)
        self.rates.append((pose.rate, pose.turn))

    def end_of(self, mount: Mount) -> End:
        """The node that carries a mount on a rod or a body."""
        if isinstance(mount, OnRod):
            return self.end(mount.rod, mount.station)
        if isinstance(mount, OnBody):
            return End(mount.body, mount.arm, mount.axes, -1)
        raise InputError(f"{NOT_HERE} a joint to a place in space: {CURE}")

    def _hold(self, joint: Joint) -> None:
        if joint.kind == "weld" and isinstance(joint.first, InSpace):
            assert isinstance(joint.second, OnBody)
            self.fixed.append(joint.second.body)
        elif joint.kind == "sleeve" or (joint.kind == "prismatic" and _along_z(joint.first)):
            assert isinstance(joint.first, OnBody)
            assert isinstance(joint.second, OnBody)
            pair = joint.first.body, joint.second.body
            self.slides.append((*pair, joint.kind == "prismatic"))
        elif joint.kind != "revolute":
            raise InputError(f"{NOT_HERE} {joint.kind} joints: {CURE}")

    def _hang(self, number: int, joint: Joint) -> None:
        """A rod's node on a body."""
        swapped = isinstance(joint.first, OnBody)
        rod, body = (joint.second, joint.first) if swapped else (joint.first, joint.second)
        if not isinstance(rod, OnRod) or not isinstance(body, OnBody):
            raise InputError(f"{NOT_HERE} revolutes between bodies: {CURE}")
        self._free(rod)
        pose, other = self.layout.pose(rod), self.layout.bodies[body.body].pose
        # The joint's rate is that of its second part against its first.
        sense = 1.0 if swapped else -1.0
        axes, start = other.axes.T @ pose.axes, 0.0
        if number in self._opening:  # its angle counts from the body's own axes there
            axes = body.axes
            x, along = (other.axes @ axes)[:, :2].T, pose.axes[:, 0]
            start = float(np.arctan2(along @ x[1], along @ x[0]))
        rate = float((pose.turn - other.turn) @ pose.axes[:, 2])
        angle = self._angle(number, sense, start, rate)
        self._ends[rod.rod, rod.station] = End(body.body, body.arm, axes, angle)

    def _cross(self, number: int, joint: Joint) -> None:
        """A second rod's node on the first one's."""
        first, second = joint.first, joint.second
        assert isinstance(first, OnRod)
        assert isinstance(second, OnRod)
        self._free(second)
        on = self.end(*first)
        if on.angle >= 0:
            raise InputError(f"{NOT_HERE} three parts in one revolute: {CURE}")
        one, other = self.layout.pose(first), self.layout.pose(second)
        along, across = one.axes[:, 0], one.axes[:, 1]
        start = float(np.arctan2(other.axes[:, 0] @ across, other.axes[:, 0] @ along))
        angle = self._angle(number, 1.0, start, float((other.turn - one.turn) @ one.axes[:, 2]))
        self._ends[second.rod, second.station] = End(on.frame, on.arm, on.axes, angle)

    def _free(self, node: OnRod) -> None:
        if (node.rod, node.station) in self._ends:
            raise InputError(f"{NOT_HERE} a rod's end in two joints: {CURE}")

    def _angle(self, joint: int, sense: float, start: float, rate: float) -> int:
        self.angles.append(Angle(joint, sense, start))
        self.angle_rates.append(rate)
        self.angle_of[joint] = len(self.angles) - 1
        return len(self.angles) - 1


def _along_z(mount: Mount) -> bool:
    """Whether a prismatic joint slides along the z axis of a body, through its origin."""
    if not isinstance(mount, OnBody) or mount.arm.any():
        return False
    return bool(mount.axes[2, 0] == 1.0)


def inertia_of(density: float, tube: Tube, length: float) -> Array:
    """Masses m_own, m_other of a rod between its end points, shape (2,), kg: an end's inertia force
    is m_own times its acceleration and m_other times that of the other end.

    (m / 6) (2, 1) is a thin rod, which moves linearly between its ends, and (mu, -mu) with
    mu L^2 = rho I L the inertia of its sections when it turns; that about its own axis is left out.
    """
    sixth, sections = density * tube.area * length / 6.0, density * tube.second_moment / length
    return np.array([2.0 * sixth + sections, sixth - sections])


# Parts, blocks and fronts: in which order unknowns are eliminated.
#
# Bodies of all planes at a corner are a block of unknowns, which comes after the inner ones; inner
# unknowns that elements hold together form a part, and a part touches one block, or two that are
# neighbours.


Indices = NDArray[np.int64]


class Parts:
    """Places of all unknowns in the system, and the fronts that eliminate them.

    Attributes
    ----------
    home, angle_home
        First unknown of each frame, and that of each angle.
    of_element
        Part, and front, of each element.
    unknowns, gone, size, spots, parent, up
        See ``ringsim.frame.mesh.Mesh``.
    """

    def __init__(
        self, skeleton: Skeleton, elements: Sequence[Element], touching: Sequence[int]
    ) -> None:
        """Order the unknowns; the last element's part touches the bodies ``touching`` as well.

        Raises
        ------
        InputError
            If the structure is not a chain of corners with parts between neighbours.
        """
        corners = np.array(skeleton.layout.corners).T
        self._bodies = len(skeleton.layout.bodies)
        self._inner_frames = len(skeleton.places) - self._bodies
        if sorted(corners.ravel().tolist()) != list(range(self._bodies)):
            raise InputError(f"{NOT_HERE} bodies that are no corners: {CURE}")
        members = self._join(len(skeleton.angles), elements)
        self.home = np.zeros(len(skeleton.places), dtype=np.int64)
        self.angle_home = np.zeros(len(skeleton.angles), dtype=np.int64)
        parts, place = [], 0
        for own in members:
            first = place
            for k in own:
                if k < self._inner_frames:
                    self.home[self._bodies + k] = place
                else:
                    self.angle_home[k - self._inner_frames] = place
                place += 6 if k < self._inner_frames else 1
            parts.append(list(range(first, place)))
        self._start, self._width, self._blocks = place, 6 * corners.shape[1], len(corners)
        self.unknowns = place + self._width * self._blocks
        for number, corner in enumerate(corners):
            self.home[corner] = place + self._width * number + 6 * np.arange(len(corner))
        inner = [len(spots) for spots in parts]
        touched: list[set[int]] = [set() for _ in parts]
        for part, element in zip(self.of_element.tolist(), elements, strict=True):
            touched[part] |= {element.first.frame, element.second.frame}
        touched[int(self.of_element[-1])] |= set(touching)
        for spots, frames in zip(parts, touched, strict=True):
            bodies = sorted(int(self.home[frame]) for frame in frames if frame < self._bodies)
            self._require_neighbours({(home - place) // self._width for home in bodies})
            spots += [home + k for home in bodies for k in range(6)]
        self._add_fronts(parts, inner)
        self._places: dict[int, dict[int, int]] = {}

    def local(self, front: int, ends: Sequence[tuple[int, int]]) -> list[int]:
        """Places in a front of the unknowns of frames and angles: six and one, -1 for no angle."""
        where = self._places.get(front)
        if where is None:
            spots = self.spots[front, : self.size[front]].tolist()
            where = self._places[front] = {spot: k for k, spot in enumerate(spots)}
        found: list[int] = []
        for frame, angle in ends:
            first = where[int(self.home[frame])]  # the six of a frame are neighbours
            found += range(first, first + 6)
            found.append(where[int(self.angle_home[angle])] if angle >= 0 else -1)
        return found

    def front_of(self, unknown: int) -> tuple[int, int]:
        """The front that eliminates an unknown, and its place there."""
        front = bisect_right(self._firsts, unknown) - 1
        return front, unknown - self._firsts[front]

    def front_holding(self, frames: Sequence[int], what: str) -> int:
        """The front with all unknowns of some frames that is eliminated first; InputError with
        ``what`` connects them if there is none.
        """
        homes = [int(self.home[frame]) for frame in frames]
        front = min(self.front_of(home)[0] for home in homes)
        if not set(homes) <= set(self.spots[front, : self.size[front]].tolist()):
            raise InputError(f"{NOT_HERE} {what} between corners that are no neighbours: {CURE}")
        return front

    def _inner_of(self, end: End) -> list[int]:
        """Inner frames, and angles behind them, of an end."""
        frame = [] if end.frame < self._bodies else [end.frame - self._bodies]
        return frame + ([] if end.angle < 0 else [self._inner_frames + end.angle])

    def _join(self, angles: int, elements: Sequence[Element]) -> list[list[int]]:
        """What each part holds: inner frames and angles that elements join (union-find)."""
        root = list(range(self._inner_frames + angles))

        def find(k: int) -> int:
            while root[k] != k:
                k = root[k] = root[root[k]]
            return k

        for element in elements:
            held = self._inner_of(element.first) + self._inner_of(element.second)
            if not held:
                raise InputError(f"{NOT_HERE} rods without joints between two bodies: {CURE}")
            for k in held[1:]:
                root[find(k)] = find(held[0])
        members: dict[int, list[int]] = {}
        # Angles first: each occurs in one or two elements only, so that little is left of it.
        for k in (*range(self._inner_frames, len(root)), *range(self._inner_frames)):
            members.setdefault(find(k), []).append(k)
        numbers = {top: number for number, top in enumerate(members)}
        held_first = [
            (self._inner_of(element.first) + self._inner_of(element.second))[0]
            for element in elements
        ]
        self.of_element = np.array([numbers[find(k)] for k in held_first])
        return list(members.values())

    def _require_neighbours(self, blocks: set[int]) -> None:
        apart = max(blocks) - min(blocks)
        if len(blocks) > 2 or apart not in (0, 1, self._blocks - 1):
            raise InputError(f"{NOT_HERE} rods between corners that are no neighbours: {CURE}")

    def _add_fronts(self, parts: list[list[int]], inner: list[int]) -> None:
        """The fronts of parts, then of blocks: each block is eliminated into the next one and the
        last, which a closed ring's first one is coupled to.
        """
        lists, width, start = list(parts), self._width, self._start
        for k in range(self._blocks):
            rest = sorted({k + 1, self._blocks - 1} & set(range(k + 1, self._blocks)))
            lists.append(
                [start + width * one + place for one in (k, *rest) for place in range(width)]
            )
        self._firsts = [spots[0] for spots in lists]
        self.gone = np.array([*inner, *[width] * self._blocks])
        self.size = np.array([len(spots) for spots in lists])
        shape = len(lists), int(self.size.max())
        self.spots, self.up = np.full(shape, -1), np.full(shape, -1)
        self.parent = np.full(len(lists), -1)
        for number, spots in enumerate(lists):
            self.spots[number, : len(spots)] = spots
            rest = spots[int(self.gone[number]) :]
            if rest:
                parent = len(parts) + min((spot - start) // width for spot in rest)
                places = {spot: k for k, spot in enumerate(lists[parent])}
                self.parent[number] = parent
                self.up[number, int(self.gone[number]) : len(spots)] = [
                    places[spot] for spot in rest
                ]


# A layout in joint coordinates as arrays, for the core.


class Mesh(NamedTuple):
    """Arrays of what does not change in a run; e elements, f frames, a angles, p points.

    Of the ends of elements: frame, angle (-1: none), axes in the frame, number of the point
    there; lengths (m), stiffness of u and psi, shape (e, 6), and masses (``inertia_of``).
    Points with mass: frame, place in it and mass beside that of the elements.  ``home`` and
    ``angle_home`` are the unknowns of frames (the first of six) and angles; ``part`` the front of
    each element, ``local`` its unknowns (x, phi, angle by end) there, -1 for none.
    Fronts (see ``ringsim.frame.elimination``), those of the parts first and then one a block:
    number of unknowns that go, of all, their places in the system (``spots``, -1 behind the last),
    the front that takes the rest and where (``up``).  ``fixed`` unknowns do not move.
    """

    frame: Indices
    angle: Indices
    axes: Array
    point: Indices
    length: Array
    stiffness: Array
    mass: Array
    tau: Array
    point_frame: Indices
    point_arm: Array
    point_mass: Array
    home: Indices
    angle_home: Indices
    part: Indices
    local: Indices
    angle_local: Indices
    """Front of each angle and its place there, shape (a, 2)."""
    frame_local: Indices
    """Front of each frame and the place of its first unknown there, shape (f, 2)."""
    gone: Indices
    size: Indices
    spots: Indices
    parent: Indices
    up: Indices
    fixed: Indices
    craft: Indices
    """Points of the spacecraft, four or none."""
    unknowns: int


def mesh_of(
    skeleton: Skeleton, rods: Rods, boom: Sequence[Element] = (), touching: Sequence[int] = ()
) -> tuple[Mesh, Parts]:
    """The arrays of a skeleton, with elements of a boom, which bodies ``touching`` it hold.

    InputError if the structure is not a chain of corners with parts between neighbours.
    """
    layout, elements = skeleton.layout, []
    for number, rod in enumerate(layout.rods):
        for k, (drawn, length) in enumerate(zip(rod.lengths, rod.natural_lengths, strict=True)):
            ends = skeleton.end(number, k), skeleton.end(number, k + 1)
            mass = inertia_of(rod.density, rod.tube, float(drawn))
            stiffness = stiffness_of(rod, rods, float(length))
            elements.append(Element(*ends, float(length), stiffness, mass))
    elements += boom
    parts, points = Parts(skeleton, elements, touching), _Points()
    pairs = [(element.first, element.second) for element in elements]
    point = np.array([[points.at(end.frame, end.arm) for end in pair] for pair in pairs])
    for number, rod in enumerate(layout.rods):
        for station, own, _ in rod.masses:
            end = skeleton.end(number, station)
            points.add(end.frame, end.arm, own)
    for number, body in enumerate(layout.bodies):
        craft = [lump for lump in body.lumps if lump.group == SPACECRAFT]
        rest = replace(body, lumps=tuple(lump for lump in body.lumps if lump not in craft))
        for arm in tetrahedron(rest.mass, rest.centre, rest.inertia):
            points.add(number, arm, 0.25 * rest.mass)
        # A spacecraft has points of its own: what they weigh is what it feels.
        for lump in craft:
            for arm in tetrahedron(lump.mass, lump.centre, lump.inertia):
                points.craft.append(points.add(number, arm, 0.25 * lump.mass))
    local = [
        parts.local(int(part), [(end.frame, end.angle) for end in pair])
        for part, pair in zip(parts.of_element, pairs, strict=True)
    ]

    def ends_of(name: str, dtype: Any) -> Any:
        return np.array([[getattr(end, name) for end in pair] for pair in pairs], dtype=dtype)

    mesh = Mesh(
        frame=ends_of("frame", np.int64),
        angle=ends_of("angle", np.int64),
        axes=ends_of("axes", float),
        point=point,
        length=np.array([element.length for element in elements]),
        stiffness=np.array([element.stiffness for element in elements]),
        mass=np.array([element.mass for element in elements]),
        # The boom's elements come last, and are not damped.
        tau=np.repeat([rods.damping, 0.0], [len(elements) - len(boom), len(boom)]),
        point_frame=np.array(points.frames),
        point_arm=np.array(points.arms),
        point_mass=np.array(points.masses),
        home=parts.home,
        angle_home=parts.angle_home,
        part=parts.of_element,
        local=np.array(local),
        angle_local=np.array([parts.front_of(int(k)) for k in parts.angle_home]).reshape(-1, 2),
        frame_local=np.array([parts.front_of(int(k)) for k in parts.home]),
        gone=parts.gone,
        size=parts.size,
        spots=parts.spots,
        parent=parts.parent,
        up=parts.up,
        fixed=np.array(
            [int(parts.home[body]) + k for body in skeleton.fixed for k in range(6)], dtype=np.int64
        ),
        craft=np.array(points.craft, dtype=np.int64),
        unknowns=parts.unknowns,
    )
    return mesh, parts


def tetrahedron(mass: float, centre: Array, inertia: Array) -> Array:
    """Places of four equal masses with a body's mass, centre and inertia about its origin: (4, 3).

    They stand at c + sum +- r_k n_k with r_k^2 = e_k / m, e_k and n_k the principal values and
    directions of the second moments about c, and signs of the corners of a tetrahedron in a cube.
    """
    seconds = 0.5 * np.trace(inertia) * np.eye(3) - inertia - mass * np.outer(centre, centre)
    values, axes = np.linalg.eigh(seconds)
    arms = axes * np.sqrt(np.maximum(values, 0.0) / mass)
    signs = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    return np.asarray(centre + signs @ arms.T)


class _Points:
    """Points with mass; those of one frame at one place are one."""

    def __init__(self) -> None:
        self.frames: list[int] = []
        self.arms: list[Array] = []
        self.masses: list[float] = []
        self._known: dict[tuple[int, ...], int] = {}
        self.craft: list[int] = []

    def at(self, frame: int, arm: Array) -> int:
        key = (frame, *(round(1e9 * x) for x in arm.tolist()))
        if key not in self._known:
            self._known[key] = len(self.frames)
            self.frames.append(frame)
            self.arms.append(np.asarray(arm, dtype=float))
            self.masses.append(0.0)
        return self._known[key]

    def add(self, frame: int, arm: Array, mass: float) -> int:
        self.masses[self.at(frame, arm)] += mass
        return self.at(frame, arm)
