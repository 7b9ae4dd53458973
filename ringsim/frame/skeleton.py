"""Frames, joint angles and ends of rods of a layout: revolutes built into the unknowns.

A frame is a place and axes, six unknowns; a joint angle is one.  Every body is a frame.  Where two
rods cross or meet in a revolute, the first one's node is a frame and the second one's is turned
against it by an angle; where a rod hangs on a body, its end is turned against the body by one.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ringsim.layout.bodies import InSpace, Mount, OnBody, OnRod
from ringsim.layout.joints import Joint
from ringsim.layout.layout import BoomBeam, Layout
from ringsim.layout.pose import Array, Pose
from ringsim.parts.tube import Tube
from ringsim.refusal import InputError

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
        # Its sections' inertia is the top's (ringsim.layout.base).
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
