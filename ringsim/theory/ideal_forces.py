"""Forces on the ideal ring but for its cables: V-joint loads, net, joint friction, stops.

Per unit rate of (phi, psi_1 .. psi_4), theta the diagonals' angle and e = +-1 the sense in which
the rods of an end assembly turn (ringsim.theory.ideal_ends), N sections have

    V-joints (2 N)              2 phi'
    pivots (N)                  2 theta'
    hinges (8 N)                phi' of bars, theta' of diagonals, on assemblies that keep upright,
    four of each at the ends    e phi' - psi', e theta' - psi',

each with a torque viscous w + coulomb tanh(w / rate) against its rate w.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.layout.free_hub import FreeHub
from ringsim.parts.joints import JointFriction, Stop
from ringsim.parts.persection import spread
from ringsim.scene import Scene
from ringsim.theory.ideal_ends import SENSE
from ringsim.theory.ideal_mechanism import Mechanism, Pose

Array = NDArray[np.float64]

_ONSET = 1e-3
"""Depth in rad over which the damping of a stop comes in."""


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


class _Joints:
    """Joints of one family that turn alike or not: slopes (joints, p), and their law."""

    def __init__(self, law: JointFriction, kinds: Array, sections: int, where: list[Array]) -> None:
        viscous, coulomb = spread(law.viscous, sections), spread(law.coulomb, sections)
        self.kinds, self._rate = kinds, law.rate
        self._viscous = np.array([float(viscous @ share) for share in where])
        self._coulomb = np.array([float(coulomb @ share) for share in where])

    def act(self, turn: float, rates: Array) -> tuple[Array, float]:
        """Generalised force and power lost; ``turn`` is dtheta/dphi."""
        slopes = self.kinds[0] + turn * self.kinds[1]
        speed = slopes @ rates
        torque = self._viscous * speed + self._coulomb * np.tanh(speed / self._rate)
        return -torque @ slopes, float(torque @ speed)


class Forces:
    """Everything that acts on the ideal ring of a scene, without its cables.

    Attributes
    ----------
    slowest
        Smallest rate at which friction turns, rad/s; infinite without Coulomb friction.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        self._mechanism, self._stop = mechanism, scene.stop
        sections = scene.structure.sections
        loads = 0.0 if scene.loads is None else scene.loads.force
        self.load = float(spread(loads, sections).sum())
        corners = mechanism.points.corners.shape[1]
        self._net = None if scene.net is None else FreeHub(scene.net, corners)
        self._joints = _joints(scene, sections)
        laws = [law for law, *_ in _families(scene)]
        self.slowest = min((law.rate for law in laws if np.any(law.coulomb)), default=math.inf)
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
        for joints in self._joints:
            torque, lost = joints.act(turn, pose.rate)
            force, loss = force + torque, loss + lost
        elastic = 0.0
        if self._net is not None:
            net = self._net.forces(*self._mechanism.corner_motion(pose), pose.rate)
            force, elastic, loss = force + net.force, net.energy, loss + net.loss
        if self._stop is not None:
            spring, damper, stored = _stop(self._stop, 2.0 * phi, 2.0 * rate, latched)
            force[0] += 2.0 * self._stops * (spring + damper)
            elastic += self._stops * stored
            loss -= self._stops * damper * 2.0 * rate
        return Acting(force, couple, elastic, self.load * float(up[2] * rise[0]), loss)


def _stop(stop: Stop, folded: float, rate: float, latched: bool) -> tuple[float, float, float]:
    """Spring and damper torque (N m) against folding of one V-joint's stop, and its energy (J)."""
    k, d = stop.stiffness, stop.damping
    if latched:
        return -k * folded, -d * rate, 0.5 * k * folded**2
    deep = max(-folded, 0.0)
    high = max(folded - (math.pi - math.radians(stop.stowed_angle)), 0.0)
    below = max(k * deep - d * rate * min(deep / _ONSET, 1.0), 0.0)
    above = max(k * high + d * rate * min(high / _ONSET, 1.0), 0.0)
    spring = k * (deep - high)
    return spring, below - above - spring, 0.5 * k * (deep**2 + high**2)


def _families(scene: Scene) -> list[tuple[JointFriction, str]]:
    joints = scene.joints
    named = ((joints.vjoint, "vjoint"), (joints.pivot, "pivot"), (joints.hinge, "hinge"))
    return [(law, name) for law, name in named if law is not None]


def _joints(scene: Scene, sections: int) -> list[_Joints]:
    """Each family's joints that turn alike, with how many of them every section has."""
    closed = scene.structure.closed
    width = 1 if closed else 5
    fold, swings = np.eye(width)[0], np.eye(width)[1:]
    every, nothing = np.ones(sections), np.zeros(width)
    found = []
    for law, name in _families(scene):
        if name == "vjoint":
            kinds, where = [(2.0 * fold, nothing)], [2.0 * every]
        elif name == "pivot":
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
        found.append(_Joints(law, np.array(kinds).transpose(1, 0, 2), sections, where))
    return found
