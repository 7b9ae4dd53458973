"""Forces on the ideal ring but for its cables: V-joint loads, net, joint friction, stops.

A joint turns at the rate of its second part less that of its first.  A part turns about the joint's
axis z at z . (x x x'), with x a direction of its own square to z; x is linear in the functions of
ringsim.theory.ideal_points.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ringsim.layout.pose import Array, cross
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import at_section
from ringsim.scene import Scene
from ringsim.theory.ideal_mechanism import Configuration, Mechanism
from ringsim.theory.ideal_points import Points


class Acting(NamedTuple):
    """What acts at one instant: generalised force on (q, psi), and couple of the loads on the whole
    structure, shape (3,) (N m); energy in net and stops, and work function of the loads (J); power
    lost in joints, net and stops (W).
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
        sides = [joint.first for joint in joints], [joint.second for joint in joints]
        alongs = map(points.directions, sides)
        self._sides = [(np.cross(axes[:, :, None], along, axis=1), along) for along in alongs]

    def act(self, now: Configuration) -> tuple[Array, float]:
        """Generalised force and power lost."""
        first, second = (
            np.einsum("ja,jap->jp", now.moved(ahead)[0], now.moved(along)[1])
            for ahead, along in self._sides
        )
        slopes = second - first
        speed = slopes @ now.rate
        torque = self._law.torque(speed)
        return -torque @ slopes, float(torque @ speed)


class Forces:
    """Everything that acts on the ideal ring of a scene but its cables.

    ``slowest`` is the least characteristic rate of the joints' friction, rad/s; infinite without.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        self._mechanism, self._stop = mechanism, scene.stop
        points = mechanism.points
        loads, places = points.forces
        self.loaded = bool(loads.any())
        self._lift = np.tensordot(loads[:, 2], places, 1)
        laws = scene.joints.present()
        self._joints = [_FrictionJoints(points, *item) for item in laws.items()]
        rates = [law.characteristic_rate() for law in laws.values()]
        self.slowest = min(rates, default=math.inf)
        self._stops = sum(map(len, points.layout.openings))

    def act(self, now: Configuration, up: Array, latched: bool) -> Acting:
        """Forces, energies and powers, ``latched`` or not.

        The loads act along ``up``, the unit vector up in space, in the structure's axes.
        """
        lifted = self._lift @ now.values
        force, loss = up @ self._lift @ now.by_place, 0.0
        for joints in self._joints:
            torque, lost = joints.act(now)
            force, loss = force + torque, loss + lost
        net = self._mechanism.net(now, now.rate)
        force, elastic, loss = force + net.force, net.energy, loss + net.loss
        stop, folded, rate = self._stop, 2.0 * float(now.place[0]), 2.0 * float(now.rate[0])
        if stop is not None and (latched or not 0.0 <= folded <= stop.most_folded):
            reaction = stop.torque(folded, rate, latched)
            force[0] -= 2.0 * self._stops * float(reaction.total)
            elastic += self._stops * float(reaction.stored)
            loss += self._stops * float(reaction.damping) * rate
        return Acting(force, cross(lifted, up), elastic, float(up @ lifted), loss)
