"""Forces on the ideal ring but for its cables: V-joint loads, net, joint friction, stops.

Per unit rate of (phi, psi_1 .. psi_4), theta the diagonals' angle and e = +-1 the sense in which
the rods of an end assembly turn (ringsim.theory.ideal_ends), N sections have

    V-joints (2 N)              2 phi'
    pivots (N)                  2 theta'
    hinges (8 N)                phi' of bars, theta' of diagonals, on assemblies that keep upright,
    four of each at the ends    e phi' - psi', e theta' - psi',

each with the torque of its family's law against its rate.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.free_hub import FreeHub
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import at_section, spread
from ringsim.scene import Scene
from ringsim.theory.ideal_ends import SENSE
from ringsim.theory.ideal_mechanism import Mechanism, Pose

Array = NDArray[np.float64]


class Acting(NamedTuple):
    """What acts at one instant.

    Attributes
    ----------
    force
        Generalised force on (phi, psi), N m.
    couple
        Of the loads on the core, N m, shape (3,).
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


class Forces:
    """Everything that acts on the ideal ring of a scene, without its cables.

    Attributes
    ----------
    slowest
        Smallest characteristic rate of the joints' friction, rad/s; infinite without one.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        self._mechanism, self._stop = mechanism, scene.stop
        sections = scene.structure.sections
        loads = 0.0 if scene.loads is None else scene.loads.force
        self.load = float(spread(loads, sections).sum())
        corners = mechanism.points.corners.shape[1]
        self._net = None if scene.net is None else FreeHub(scene.net, corners)
        self._joints = _joints(scene, sections)
        laws = scene.joints.present().values()
        self.slowest = min((law.characteristic_rate() for law in laws), default=math.inf)
        self._stops = 2 * sections

    def act(self, pose: Pose, up: Array, latched: bool) -> Acting:
        """Forces, energies and powers.

        Parameters
        ----------
        up
            Unit vector that points up in space, in the core's axes: the loads' direction.
        latched
            Whether the latches hold.
        """
        ring = self._mechanism.geometry
        s, phi, rate = pose.basis, float(pose.place[0]), float(pose.rate[0])
        rise = 2.0 * (ring.half_diagonal * s[:, 3] - ring.half_bar * s[:, 2])
        force, loss = np.zeros(len(pose.place)), 0.0
        force[0] = self.load * up[2] * rise[1]
        couple = self.load * rise[0] * np.array([-up[1], up[0], 0.0])
        turn = (ring.half_bar / ring.half_diagonal) * float(s[0, 2] / s[0, 3])
        for law, (by_phi, by_theta), number in self._joints:
            slopes = by_phi + turn * by_theta
            speed = slopes @ pose.rate
            torque = (number * law.torque(speed[:, None])).sum(axis=1)
            force, loss = force - torque @ slopes, loss + float(torque @ speed)
        elastic = 0.0
        if self._net is not None:
            net = self._net.forces(*self._mechanism.corner_motion(pose), pose.rate)
            force, elastic, loss = force + net.force, net.energy, loss + net.loss
        stop, folded = self._stop, 2.0 * phi
        if stop is not None and (latched or not 0.0 <= folded <= stop.most_folded):
            reaction = stop.torque(folded, 2.0 * rate, latched)
            force[0] -= 2.0 * self._stops * reaction.total
            elastic += self._stops * float(reaction.stored)
            loss += self._stops * float(reaction.damping) * 2.0 * rate
        return Acting(force, couple, elastic, self.load * float(up[2] * rise[0]), loss)


def _joints(scene: Scene, sections: int) -> list[tuple[JointFriction, Array, Array]]:
    """Law of each family; its rates per phi' and theta', shape (2, kinds, coordinates), one for
    joints that turn alike; how many of them each section has, shape (kinds, sections).
    """
    closed = scene.structure.closed
    width = 1 if closed else 5
    fold, swings = np.eye(width)[0], np.eye(width)[1:]
    every, nothing = np.ones(sections), np.zeros(width)
    found = []
    for family, law in scene.joints.present().items():
        if family == "vjoint":
            kinds, where = [(2.0 * fold, nothing)], [2.0 * every]
        elif family == "pivot":
            kinds, where = [(nothing, 2.0 * fold)], [every]
        else:
            upright = 4.0 * every
            kinds, where = [(fold, nothing), (nothing, fold)], [upright, upright]
            for k, swing in enumerate(swings):
                place = np.zeros(sections)
                place[0 if k < 2 else -1] = 1.0
                upright -= place
                kinds += [(SENSE[k] * fold - swing, nothing), (-swing, SENSE[k] * fold)]
                where += [place, place]
        each = at_section(law, np.arange(sections))
        found.append((each, np.array(kinds).transpose(1, 0, 2), np.array(where)))
    return found
