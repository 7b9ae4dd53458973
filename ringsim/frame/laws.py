"""Torques on joint angles: friction, stops and joints that stick, by the laws of ringsim.parts."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.frame.parts import Indices
from ringsim.frame.skeleton import CURE, NOT_HERE, Skeleton
from ringsim.frame.vectors import compiled
from ringsim.layout.joints import JointOpening
from ringsim.layout.pose import Array
from ringsim.parts.faults.stuck_vjoint import StuckVJoint
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import at_section
from ringsim.parts.springs import Reaction
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.stepping.turning import Turning

_NUDGE = 1e-7
"""Change of place (m, rad) and rate by which the slopes of laws are measured."""
_SIDES = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, -1.0]])
Law = Callable[[Array, Array], Reaction]


def slope_of(
    law: Callable[[Array, Array], Array], x: Array, rate: Array, rate_by_place: float
) -> Array:
    """Derivative of a force after its coordinate, whose rate follows it, by central differences."""
    moved = _NUDGE * _SIDES[0].reshape(-1, *[1] * x.ndim)
    hurried = _NUDGE * _SIDES[1].reshape(-1, *[1] * x.ndim)
    # All at once: numpy's calls cost more than its numbers.
    ahead, behind, faster, slower = law(x + moved, rate + hurried)
    return np.asarray((ahead - behind + rate_by_place * (faster - slower)) / (2.0 * _NUDGE))


@compiled
def folded_between(angles: Array, own: Indices, sense: Array) -> tuple[float, float]:
    """How far the least and the most folded V-joint are, rad.

    Of angles (a,), rad; their numbers and senses are arrays (planes, sections).
    """
    least, most = math.inf, -math.inf
    for plane in range(own.shape[0]):
        for section in range(own.shape[1]):
            folded = sense[plane, section] * angles[own[plane, section]]
            least, most = min(least, folded), max(most, folded)
    return least, most


class Torques(NamedTuple):
    """Torques on all angles that dissipate, shape (a,), N m, and energy stored, J."""

    lost: Array
    stored: float


class Openings(NamedTuple):
    """Joint angles and senses of the opening angles, shape (planes, sections)."""

    angle: Indices
    sense: Array

    @classmethod
    def of(cls, skeleton: Skeleton) -> "Openings":
        """Those of a layout."""
        found = [
            [(skeleton.angle_of[o.joint], o.sense) for o in plane if isinstance(o, JointOpening)]
            for plane in skeleton.layout.openings
        ]
        if not all(found):
            raise InputError(f"{NOT_HERE} openings without joints: {CURE}")
        table = np.array(found)
        return cls(table[..., 0].astype(np.int64), table[..., 1])

    def unwrapped(self, angles: Array) -> None:
        """Turn angles so that folded ones lie between -pi/2 and 3 pi/2; in place."""
        folded = self.sense * angles[self.angle]
        angles[self.angle] += self.sense * np.where(folded < -0.5 * np.pi, 2.0 * np.pi, 0.0)

    def read(self, angles: Array, rates: Array) -> tuple[Array, Array]:
        """Opening angles and rates, rad and rad/s."""
        return np.pi - self.sense * angles[self.angle], -self.sense * rates[self.angle]


class JointLaws:
    """All torques of a scene's joints.

    ``damping`` is the torque over the rate of each angle where friction is linear, N m s/rad, and
    ``stuck`` are the faults that hold V-joints, (plane, section), at opening angles, rad.
    """

    def __init__(self, scene: Scene, skeleton: Skeleton, openings: Openings) -> None:
        self._openings, self._stop = openings, scene.stop
        self.damping = np.zeros(len(skeleton.angles))
        self._friction: list[tuple[JointFriction, Indices, Array, Turning]] = []
        for family, law in scene.joints.present().items():
            self._rub(family, law, skeleton)
        spring, sections = scene.hinge_spring, openings.angle.shape[1]
        self._spring = None if spring is None else spring.at(np.arange(sections))
        self._sprung = np.ones(openings.angle.shape)
        latch = scene.latch
        self._pawl = latch.at(np.arange(sections)) if latch is not None and latch.pushes else None
        self.latched = np.zeros(openings.angle.shape, dtype=bool)
        self._latches = False
        self.stuck: list[tuple[StuckVJoint, tuple[int, int], float]] = []

    def _rub(self, family: str, law: JointFriction, skeleton: Skeleton) -> None:
        joints = skeleton.layout.joints
        own = [n for n, one in enumerate(skeleton.angles) if joints[one.joint].family == family]
        if not own:
            known = ", ".join(sorted({joint.family for joint in joints} - {""}))
            raise InputError(
                f"joints.{family}: this structure has no joint of that family (it has: "
                f'{known or "none"}): leave it out (joints.{family} = "none")'
            )
        rest = []
        for n in own:
            linear = at_section(law, joints[skeleton.angles[n].joint].section).linear_damping()
            if linear is None:
                rest.append(n)
            else:
                self.damping[n] += linear
        if rest:
            sections = np.array([joints[skeleton.angles[n].joint].section for n in rest])
            senses = np.array([skeleton.angles[n].sense for n in rest])
            self._friction.append((at_section(law, sections), np.array(rest), senses, Turning()))

    def latch(self, deployed: NDArray[np.bool_]) -> None:
        """Hold these V-joints from both sides from now on, if the stop latches."""
        if self._stop is not None and self._stop.latch:
            self.latched |= deployed
            self._latches = bool(self.latched.any())

    def begin(self) -> None:
        """Begin a step."""
        for *_, turning in self._friction:
            turning.forget()

    def stick(self, fault: StuckVJoint, place: tuple[int, int], opening: float) -> None:
        """Hold a V-joint, (plane, section), at an opening angle (rad)."""
        self.stuck.append((fault, place, opening))

    def fail(self, place: tuple[int, int]) -> None:
        """Break the spring of a V-joint, (plane, section)."""
        self._sprung[place] = 0.0

    def _acting(
        self, angles: Array, rates: Array
    ) -> list[tuple[Indices, Array, Array, Array, Law]]:
        """Angles, senses, coordinates and rates of every law that acts, and the law."""
        found: list[tuple[Indices, Array, Array, Array, Law]] = []
        own, sense = self._openings
        if self._stop is not None:
            least, most = folded_between(angles, own, sense)
            free = least > _NUDGE and most < self._stop.most_folded - _NUDGE
            if self._latches or not free:
                stop, latched, folded = self._stop, self.latched, sense * angles[own]

                def hold(x: Array, rate: Array) -> Reaction:
                    return stop.torque(x, rate, latched)

                found.append((own, sense, folded, sense * rates[own], hold))
        if self._spring is not None:
            spring, alive = self._spring, self._sprung

            def drive(x: Array, rate: Array) -> Reaction:
                return Reaction(*(alive * part for part in spring.torque(x)))

            found.append((own, sense, sense * angles[own], sense * rates[own], drive))
        if self._pawl is not None:
            pawl = self._pawl

            def lift(x: Array, _: Array) -> Reaction:
                return pawl.torque(x)

            found.append((own, sense, sense * angles[own], sense * rates[own], lift))
        for fault, place, opening in self.stuck:
            where = np.array([own[place]])
            turned = np.pi - sense[place] * angles[where] - opening
            found.append(
                (where, np.array([-sense[place]]), turned, -sense[place] * rates[where],
                 fault.torque)
            )  # fmt: skip
        return found

    def push(self, angles: Array, rates: Array, g: Array, home: Indices) -> None:
        """Add all torques but those of linear friction to a residual, whose unknowns of the angles
        are at ``home``; angles in rad and rates in rad/s, shape (a,).
        """
        for friction, own, sense, turning in self._friction:
            turned = sense * rates[own]
            turning.note(friction, turned)
            g[home[own]] += sense * friction.torque(turned)
        for own, sense, x, rate, law in self._acting(angles, rates):
            g[home[own]] += sense * law(x, rate).total

    def passing(self, angles: Array, rates: Array) -> Torques:
        """What all torques take and store."""
        lost, stored = self.damping * rates, 0.0
        for friction, own, sense, _ in self._friction:
            lost[own] += sense * friction.torque(sense * rates[own])
        for own, sense, x, rate, law in self._acting(angles, rates):
            reaction = law(x, rate)
            lost[own] += sense * reaction.damping
            stored += float(np.sum(reaction.stored))
        return Torques(lost, stored)

    def stop_torques(self, angles: Array, rates: Array) -> Array | None:
        """Torques of the stop, (planes, sections), N m; None without."""
        if self._stop is None:
            return None
        own, sense = self._openings
        folded, rate = sense * angles[own], sense * rates[own]
        return np.asarray(self._stop.torque(folded, rate, self.latched).total)

    def slopes(self, angles: Array, rates: Array, rate_by_angle: float) -> Array:
        """Derivatives of the torques after the angles, whose rates follow them, N m/rad: (a,)."""
        found = self.damping * rate_by_angle
        for friction, own, sense, turning in self._friction:
            turned = sense * rates[own]
            found[own] += rate_by_angle * turning.tangents(friction, turned, friction.torque)
        for own, _, x, rate, law in self._acting(angles, rates):
            found[own] += slope_of(lambda *at, law=law: law(*at).total, x, rate, rate_by_angle)
        return found
