"""A layout as arrays: frames, joint angles, rod elements and the order of their unknowns.

A frame is a place and axes, six unknowns; a joint angle is one.  Every body is a frame.  Where two
rods cross or meet in a revolute, the first one's node is a frame and the second one's is turned
against it by an angle; where a rod hangs on a body, its end is turned against the body by one.
Revolutes are so built into the unknowns.

Bodies of all planes at a corner are a block of unknowns, which comes after the inner ones; inner
unknowns that elements hold together form a part, and a part touches one block, or two that are
neighbours: its inner unknowns are eliminated by themselves (``ringsim.frame.elimination``).
"""

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.bodies import InSpace, Mount, OnBody, OnRod, Rod
from ringsim.layout.joints import Joint
from ringsim.layout.layout import BoomBeam, Layout
from ringsim.layout.pose import Array, Pose
from ringsim.parts.rods.family import Rods
from ringsim.parts.tube import Tube
from ringsim.refusal import InputError

Indices = NDArray[np.int64]


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


class Mesh(NamedTuple):
    """Arrays of what does not change in a run; e elements, f frames, a angles, p points.

    Of the ends of elements: frame, angle (-1: none), place and axes in the frame, number of the
    point there; lengths (m), stiffness of u and psi, shape (e, 6), and masses (``inertia_of``).
    Points with mass: frame, place in it and mass beside that of the elements.  ``home`` and
    ``inner_home`` are the unknowns of frames (the first of six) and angles; ``part`` that of each
    element, ``local`` its unknowns (x, phi, angle by end) among the part's, -1 for none.
    Fronts (see ``ringsim.frame.elimination``), those of the parts first and then one a block:
    number of unknowns that go, of all, their places in the system (``spots``, -1 behind the last),
    the front that takes the rest and where (``up``).  ``fixed`` unknowns do not move.
    """

    frame: Indices
    angle: Indices
    arm: Array
    axes: Array
    point: Indices
    length: Array
    stiffness: Array
    mass: Array
    tau: float
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
    unknowns: int


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
        self.slides: list[tuple[int, int]] = []
        self.beam: list[End] = []
        self._ends: dict[tuple[int, int], End] = {}
        self.angle_of: dict[int, int] = {}
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
            pose = part.station(part.stations[station])
            self._frame(pose)
            self._ends[key] = End(len(self.places) - 1, np.zeros(3), np.eye(3), -1)
        return self._ends[key]

    def add_beam(self, beam: BoomBeam) -> list[Element]:
        """The elements of a flexible boom, from its clamped top down; ``beam`` are their nodes."""
        boom, body = beam.record, self.layout.bodies[beam.top.body]
        # x along the boom, downwards.
        axes = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
        length = boom.length / boom.elements
        self.beam = [End(beam.top.body, beam.top.arm, body.pose.axes.T @ axes, -1)]
        place, rate = body.pose.at(beam.top.arm)
        top = Pose(place, axes, rate, body.pose.turn)
        for k in range(1, boom.elements + 1):
            place, rate = top.at(np.array([k * length, 0.0, 0.0]))
            self._frame(Pose(place, axes, rate, top.turn))
            self.beam.append(End(len(self.places) - 1, np.zeros(3), np.eye(3), -1))
        young, area, second = boom.young_modulus, boom.tube.area, boom.tube.second_moment
        # Nothing twists a boom along which a body slides freely: any torsional stiffness will do.
        bending, across = young * second, 12.0 * young * second / length**2
        stiffness = np.array([young * area, across, across, bending, bending, bending]) / length
        mass = inertia_of(boom.density, boom.tube, length)
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
        raise InputError(f"{_FRAME} a joint to a place in space: {_CURE}")

    def _hold(self, joint: Joint) -> None:
        if joint.kind == "weld" and isinstance(joint.first, InSpace):
            assert isinstance(joint.second, OnBody)
            self.fixed.append(joint.second.body)
        elif joint.kind == "sleeve":
            assert isinstance(joint.first, OnBody)
            assert isinstance(joint.second, OnBody)
            self.slides.append((joint.first.body, joint.second.body))
        elif joint.kind != "revolute":
            raise InputError(f"{_FRAME} {joint.kind} joints: {_CURE}")

    def _hang(self, number: int, joint: Joint) -> None:
        """A rod's node on a body."""
        swapped = isinstance(joint.first, OnBody)
        rod, body = (joint.second, joint.first) if swapped else (joint.first, joint.second)
        if not isinstance(rod, OnRod) or not isinstance(body, OnBody):
            raise InputError(f"{_FRAME} revolutes between bodies: {_CURE}")
        self._free(rod)
        pose, other = self.layout.pose(rod), self.layout.bodies[body.body].pose
        # The joint's rate is that of its second part against its first.
        sense = 1.0 if swapped else -1.0
        angle = self._angle(number, sense, 0.0, float((pose.turn - other.turn) @ pose.axes[:, 2]))
        key = rod.rod, rod.station
        self._ends[key] = End(body.body, body.arm, other.axes.T @ pose.axes, angle)

    def _cross(self, number: int, joint: Joint) -> None:
        """A second rod's node on the first one's."""
        first, second = joint.first, joint.second
        assert isinstance(first, OnRod)
        assert isinstance(second, OnRod)
        self._free(second)
        on = self.end(*first)
        if on.angle >= 0:
            raise InputError(f"{_FRAME} three parts in one revolute: {_CURE}")
        one, other = self.layout.pose(first), self.layout.pose(second)
        along, across = one.axes[:, 0], one.axes[:, 1]
        start = float(np.arctan2(other.axes[:, 0] @ across, other.axes[:, 0] @ along))
        angle = self._angle(number, 1.0, start, float((other.turn - one.turn) @ one.axes[:, 2]))
        self._ends[second.rod, second.station] = End(on.frame, on.arm, on.axes, angle)

    def _free(self, node: OnRod) -> None:
        if (node.rod, node.station) in self._ends:
            raise InputError(f"{_FRAME} a rod's end in two joints: {_CURE}")

    def _angle(self, joint: int, sense: float, start: float, rate: float) -> int:
        self.angles.append(Angle(joint, sense, start))
        self.angle_rates.append(rate)
        self.angle_of[joint] = len(self.angles) - 1
        return len(self.angles) - 1


_FRAME = 'fidelity = "frame" does not represent'
_CURE = 'choose fidelity = "full"'


def mesh_of(
    skeleton: Skeleton,
    rods: Rods,
    boom: Sequence[Element] = (),
    touching: Sequence[int] = (),
) -> Mesh:
    """The arrays of a skeleton, with elements of a boom, which bodies ``touching`` it hold.

    Raises
    ------
    InputError
        If the structure is not a chain of corners with parts between neighbours.
    """
    layout = skeleton.layout
    elements = []
    for number, rod in enumerate(layout.rods):
        for k, length in enumerate(rod.lengths.tolist()):
            ends = skeleton.end(number, k), skeleton.end(number, k + 1)
            mass = inertia_of(rod.density, rod.tube, length)
            elements.append(Element(*ends, length, stiffness_of(rod, rods, length), mass))
    elements += boom
    corners = np.array(layout.corners).T
    width, blocks = 6 * corners.shape[1], len(corners)
    bodies, frames = len(layout.bodies), len(skeleton.places)
    if sorted(corners.ravel()) != list(range(bodies)):
        raise InputError(f"{_FRAME} bodies that are no corners: {_CURE}")
    # Parts: frames behind the bodies and angles, joined by elements.
    items = frames - bodies + len(skeleton.angles)
    root = list(range(items))

    def find(k: int) -> int:
        while root[k] != k:
            k = root[k] = root[root[k]]
        return k

    def inner_of(end: End) -> list[int]:
        own = [] if end.frame < bodies else [end.frame - bodies]
        return own + ([] if end.angle < 0 else [frames - bodies + end.angle])

    for first, second, *_ in elements:
        held = inner_of(first) + inner_of(second)
        for k in held[1:]:
            root[find(k)] = find(held[0])
    members: dict[int, list[int]] = defaultdict(list)
    for k in range(items):
        members[find(k)].append(k)
    numbers = {top: n for n, top in enumerate(members)}
    touched: dict[int, set[int]] = defaultdict(set)
    part = np.empty(len(elements), dtype=np.int64)
    for n, (first, second, *_) in enumerate(elements):
        held = inner_of(first) + inner_of(second)
        if not held:
            raise InputError(f"{_FRAME} rods without joints between two bodies: {_CURE}")
        part[n] = numbers[find(held[0])]
        touched[int(part[n])] |= {end.frame for end in (first, second) if end.frame < bodies}
    for body in touching:
        touched[int(part[-1])].add(body)
    home, angle_home = (
        np.zeros(frames, dtype=np.int64),
        np.zeros(len(skeleton.angles), dtype=np.int64),
    )
    first_of, inner_of_part, place = [], [], 0
    for own in members.values():
        first_of.append(place)
        for k in own:
            if k < frames - bodies:
                home[bodies + k] = place
                place += 6
            else:
                angle_home[k - frames + bodies] = place
                place += 1
        inner_of_part.append(place - first_of[-1])
    inner = place
    block_of = {}
    for number, corner in enumerate(corners):
        for k, body in enumerate(corner):
            home[body] = inner + width * number + 6 * k
            block_of[int(body)] = number
    spots_of: list[list[int]] = []
    for n in range(len(members)):
        spots = list(range(first_of[n], first_of[n] + inner_of_part[n]))
        for body in sorted(touched[n], key=lambda b: int(home[b])):
            spots += range(int(home[body]), int(home[body]) + 6)
        spots_of.append(spots)
        _require_neighbours({block_of[body] for body in touched[n]}, blocks)
    fronts = _Fronts(inner_of_part, spots_of, inner, width, blocks)
    where = [{spot: k for k, spot in enumerate(spots)} for spots in spots_of]
    local = np.full((len(elements), 14), -1, dtype=np.int64)
    for n, element in enumerate(elements):
        for side, end in enumerate(element[:2]):
            own = where[int(part[n])]
            local[n, 7 * side : 7 * side + 6] = [own[int(home[end.frame]) + k] for k in range(6)]
            if end.angle >= 0:
                local[n, 7 * side + 6] = own[int(angle_home[end.angle])]
    angle_local = [
        (number := numbers[find(frames - bodies + k)], where[number][int(angle_home[k])])
        for k in range(len(skeleton.angles))
    ]
    frame_local = [
        (len(members) + block_of[k], int(home[k] - inner) % width) for k in range(bodies)
    ] + [
        (number := numbers[find(k)], where[number][int(home[bodies + k])])
        for k in range(frames - bodies)
    ]
    points = _Points()
    ends = [element[:2] for element in elements]
    point = np.array([[points.at(end.frame, end.arm) for end in pair] for pair in ends])
    for number, rod in enumerate(layout.rods):
        for station, mass, _ in rod.masses:
            end = skeleton.end(number, station)
            points.add(end.frame, end.arm, mass)
    for number, body in enumerate(layout.bodies):
        for arm in tetrahedron(body.mass, body.centre, body.inertia):
            points.add(number, arm, 0.25 * body.mass)
    fixed = [int(home[body]) + k for body in skeleton.fixed for k in range(6)]
    return Mesh(
        frame=_table(ends, "frame", np.int64),
        angle=_table(ends, "angle", np.int64),
        arm=_table(ends, "arm", float),
        axes=_table(ends, "axes", float),
        point=point,
        length=np.array([element[2] for element in elements]),
        stiffness=np.array([element[3] for element in elements]),
        mass=np.array([element[4] for element in elements]),
        tau=float(rods.damping),
        point_frame=np.array(points.frames),
        point_arm=np.array(points.arms),
        point_mass=np.array(points.masses),
        home=home,
        angle_home=angle_home,
        part=part,
        local=local,
        angle_local=np.array(angle_local, dtype=np.int64).reshape(-1, 2),
        frame_local=np.array(frame_local, dtype=np.int64),
        gone=fronts.gone,
        size=fronts.size,
        spots=fronts.spots,
        parent=fronts.parent,
        up=fronts.up,
        fixed=np.array(fixed, dtype=np.int64),
        unknowns=inner + width * blocks,
    )


def _require_neighbours(blocks: set[int], count: int) -> None:
    if len(blocks) == 1:
        return
    low, high = min(blocks), max(blocks)
    if len(blocks) > 2 or high - low not in (1, count - 1):
        raise InputError(f"{_FRAME} rods between corners that are no neighbours: {_CURE}")


def _table(ends: Sequence[Sequence[End]], name: str, dtype: Any) -> Any:
    return np.array([[getattr(end, name) for end in pair] for pair in ends], dtype=dtype)


def stiffness_of(rod: Rod, rods: Rods, length: float) -> Array:
    """Stiffness of u and psi, shape (6,), N/m and N m; see ``ringsim.frame.element``."""
    young, area, second = rod.young_modulus, rod.tube.area, rod.tube.second_moment
    shear, bending = young * rods.shear_modulus_ratio, young * second
    direct = rod.tube.shear_factor(rods.poisson_ratio) * shear * area
    across = 1.0 / (1.0 / direct + length**2 / (12.0 * bending))
    return np.array([young * area, across, across, 2.0 * shear * second, bending, bending]) / length


def inertia_of(density: float, tube: Tube, length: float) -> Array:
    """Masses m_own, m_other of a rod between its end points, shape (2,), kg: an end's inertia force
    is m_own times its acceleration and m_other times that of the other end.

    (m / 6) (2, 1) is a thin rod, which moves linearly between its ends, and (mu, -mu) with
    mu L^2 = rho I L the inertia of its sections when it turns; that about its own axis is left out.
    """
    sixth, sections = density * tube.area * length / 6.0, density * tube.second_moment / length
    return np.array([2.0 * sixth + sections, sixth - sections])


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


class _Fronts:
    """The fronts of parts, then of blocks: each block is eliminated into the next one and the last,
    which a closed ring's first one is coupled to.
    """

    def __init__(
        self, inner: list[int], parts: list[list[int]], start: int, width: int, blocks: int
    ) -> None:
        def block(k: int) -> list[int]:
            return list(range(start + width * k, start + width * (k + 1)))

        lists = list(parts)
        for k in range(blocks):
            rest = sorted({k + 1, blocks - 1} & set(range(k + 1, blocks)))
            lists.append([spot for one in (k, *rest) for spot in block(one)])
        self.gone = np.array([*inner, *[width] * blocks])
        self.size = np.array([len(spots) for spots in lists])
        shape = len(lists), int(self.size.max())
        self.spots, self.up = np.full(shape, -1), np.full(shape, -1)
        self.parent = np.full(len(lists), -1)
        for n, spots in enumerate(lists):
            self.spots[n, : len(spots)] = spots
            rest = spots[int(self.gone[n]) :]
            if rest:
                first = min((spot - start) // width for spot in rest)
                self.parent[n] = len(parts) + first
                places = {spot: k for k, spot in enumerate(lists[len(parts) + first])}
                self.up[n, int(self.gone[n]) : len(spots)] = [places[spot] for spot in rest]


class _Points:
    """Points with mass; those of one frame at one place are one."""

    def __init__(self) -> None:
        self.frames: list[int] = []
        self.arms: list[Array] = []
        self.masses: list[float] = []
        self._known: dict[tuple[int, ...], int] = {}

    def at(self, frame: int, arm: Array) -> int:
        key = (frame, *np.round(arm * 1e9).astype(int))
        if key not in self._known:
            self._known[key] = len(self.frames)
            self.frames.append(frame)
            self.arms.append(np.asarray(arm, dtype=float))
            self.masses.append(0.0)
        return self._known[key]

    def add(self, frame: int, arm: Array, mass: float) -> None:
        self.masses[self.at(frame, arm)] += mass
