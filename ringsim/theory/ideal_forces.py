"""Forces on the ideal ring but for its cables: V-joint loads, net, joint friction, stops.

A joint turns at the rate of its second part less that of its first.  With x the axis along a rod
and z that of the joint, a rod turns at z . (x x x'), bilinear in s and s' (ringsim.theory.
ideal_points); a swinging end assembly turns at psi'; other assemblies keep upright.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.bodies import Mount, OnRod
from ringsim.layout.free_hub import FreeHub
from ringsim.layout.joints import Joint
from ringsim.layout.layout import Layout
from ringsim.layout.pose import cross
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import at_section
from ringsim.scene import Scene
from ringsim.theory.ideal_mechanism import Configuration, Mechanism
from ringsim.theory.ideal_points import Points, body_of

Array = NDArray[np.float64]


class Acting(NamedTuple):
    """What acts at one instant.

    Attributes
    ----------
    force
        Generalised force on (q, psi), N m.
    couple
        Of the loads on the structure as one body, N m, shape (3,).
    elastic
        Energy in net and stops, J.
    work
        Work function of the loads, J.
    loss
        Power lost in joints, net and stops, W.
    """

    force: Array
    couple: Array
    elastic: float
    work: float
    loss: float


class _FrictionJoints:
    """Joints of one family and their law."""

    def __init__(self, points: Points, family: str, law: JointFriction) -> None:
        joints = [joint for joint in points.layout.joints if joint.family == family]
        self._law = at_section(law, np.array([joint.section for joint in joints]))
        axes = np.array([points.layout.pose(joint.first).axes[:, 2] for joint in joints])
        self._turning = _turning(points, joints, axes)
        # Relative rates per rate of each swing: 1, -1 or 0.
        self._swings = np.array(
            [
                [
                    float(axis @ normal)
                    * ((body_of(j.second) == body) - (body_of(j.first) == body))
                    for body, normal in zip(points.swinging, points.normals, strict=True)
                ]
                for j, axis in zip(joints, axes, strict=True)
            ]
        ).reshape(len(joints), -1)

    def act(self, now: Configuration) -> tuple[Array, float]:
        """Generalised force and power lost."""
        count = self._turning.shape[-1]
        s, by_q = now.values[:count], now.by_place[:count, 0]
        slopes = np.column_stack([self._turning @ by_q @ s, self._swings])
        speed = slopes @ now.rate
        torque = self._law.torque(speed)
        return -torque @ slopes, float(torque @ speed)


class Forces:
    """Everything that acts on the ideal ring of a scene, without its cables.

    Attributes
    ----------
    loaded
        Whether loads act.
    slowest
        Smallest characteristic rate of the joints' friction, rad/s; infinite without one.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        self._mechanism, self._stop = mechanism, scene.stop
        points = mechanism.points
        loads, places = points.forces()
        self.loaded = bool(loads.any())
        self._lift = np.tensordot(loads[:, 2], places, 1)
        self._net = None if scene.net is None else FreeHub(scene.net, len(mechanism.upper_corners))
        laws = scene.joints.present()
        self._joints = [_FrictionJoints(points, *item) for item in laws.items()]
        rates = [law.characteristic_rate() for law in laws.values()]
        self.slowest = min(rates, default=math.inf)
        self._stops = sum(map(len, points.layout.openings))

    def act(self, now: Configuration, up: Array, latched: bool) -> Acting:
        """Forces, energies and powers.

        Parameters
        ----------
        up
            Unit vector that points up in space, in the structure's axes: the loads' direction.
        latched
            Whether the latches hold.
        """
        lifted = self._lift @ now.values
        force, loss, elastic = up @ self._lift @ now.by_place, 0.0, 0.0
        for joints in self._joints:
            torque, lost = joints.act(now)
            force, loss = force + torque, loss + lost
        if self._net is not None:
            corners = self._mechanism.upper_corners
            net = self._net.forces(corners @ now.values, corners @ now.by_place, now.rate)
            force, elastic, loss = force + net.force, net.energy, loss + net.loss
        stop, folded, rate = self._stop, 2.0 * float(now.place[0]), 2.0 * float(now.rate[0])
        if stop is not None and (latched or not 0.0 <= folded <= stop.most_folded):
            reaction = stop.torque(folded, rate, latched)
            force[0] -= 2.0 * self._stops * float(reaction.total)
            elastic += self._stops * float(reaction.stored)
            loss += self._stops * float(reaction.damping) * rate
        return Acting(force, cross(lifted, up), elastic, float(up @ lifted), loss)


def _turning(points: Points, joints: list[Joint], axes: Array) -> Array:
    """Matrices K of all joints, whose relative rate is s^T K s'; (joints, functions, functions)."""

    def along(layout: Layout, mount: Mount) -> tuple[Array, Array]:
        if not isinstance(mount, OnRod):
            return np.zeros(3), np.zeros(3)
        pose = layout.rods[mount.rod].start
        return pose.axes[:, 0], cross(pose.turn, pose.axes[:, 0])

    def read(layout: Layout) -> tuple[Array, Array]:
        pairs = [[along(layout, m) for m in (joint.first, joint.second)] for joint in joints]
        found = np.array(pairs).reshape(len(joints), 2, 2, 3)
        return found[:, :, 0], found[:, :, 1]

    directions = points.fit(read)
    across = np.cross(axes[:, None, :, None], directions, axis=2)
    first, second = np.moveaxis(np.einsum("jmap,jmaq->jmpq", across, directions), 1, 0)
    return np.asarray(second - first)
