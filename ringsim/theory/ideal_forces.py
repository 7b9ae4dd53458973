"""What acts on the ideal ring: V-joint loads, net, joint friction, stops, and its cables.

A joint turns at the rate of its second part less that of its first.  A part turns about the joint's
axis z at z . (x x x'), with x a direction of its own square to z.  The generalised force of a cable
is its force on each sheave times how that point moves with the coordinates.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ringsim.cable.chain import Chain
from ringsim.cable.state import ChainState
from ringsim.cable.winches import driving
from ringsim.cable.winding.family import FeedbackWinding
from ringsim.layout.pose import Array, cross
from ringsim.parts.joint_friction.family import JointFriction
from ringsim.parts.persection import at_section
from ringsim.scene import Scene
from ringsim.theory.configuration import Configuration
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.ideal_points import Points
from ringsim.theory.spring_energy import SpringEnergy


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
        self._joints = [friction_joints(points, *item) for item in laws.items()]
        rates = [law.characteristic_rate() for law in laws.values()]
        self.slowest = min(rates, default=math.inf)
        self._stops = sum(map(len, points.layout.openings))
        self.springs = SpringEnergy(scene)

    def act(self, now: Configuration, up: Array, latched: bool) -> Acting:
        """Forces, energies and powers, ``latched`` or not.

        The loads act along ``up``, the unit vector up in space, in the structure's axes.
        """
        lifted = self._lift @ now.values
        force, loss = up @ self._lift @ now.by_place, 0.0
        for law, turning in self._joints:
            slopes = turning.slopes(now)
            speed = slopes @ now.rate
            torque = law.torque(speed)
            force, loss = force - torque @ slopes, loss + float(torque @ speed)
        net = self._mechanism.net(now, now.rate)
        force, elastic, loss = force + net.force, net.energy, loss + net.loss
        stop, folded, rate = self._stop, 2.0 * float(now.place[0]), 2.0 * float(now.rate[0])
        if stop is not None and (latched or not 0.0 <= folded <= stop.most_folded):
            reaction = stop.torque(folded, rate, latched)
            force[0] -= 2.0 * self._stops * float(reaction.total)
            elastic += self._stops * float(reaction.stored)
            loss += self._stops * float(reaction.damping) * rate
        torque, stored = self.springs.at(folded)
        force[0] -= 2.0 * torque
        work = float(up @ lifted) + self._mechanism.weight_work(now)
        return Acting(force, cross(lifted, up), elastic + stored, work, loss)


class Turning:
    """How fast joints turn: z x x . x' of their second parts less that of their first.

    A product of two points' coefficients with the functions, of which the joint's axis and places
    are a constant part: formed once, shape (joints, functions, functions).
    """

    def __init__(self, aheads: list[tuple[Array, Array]]) -> None:
        first, second = (np.einsum("jaf,jag->jfg", *sides) for sides in aheads)
        joints, functions, _ = first.shape
        self._shape = joints, functions
        self._by_function = (second - first).transpose(0, 2, 1).reshape(-1, functions)

    def slopes(self, now: Configuration) -> Array:
        """Derivatives of the joints' angles after p, shape (joints, n)."""
        return np.asarray((self._by_function @ now.values).reshape(self._shape) @ now.by_place)


def friction_joints(
    points: Points, family: str, law: JointFriction
) -> tuple[JointFriction, Turning]:
    """The law at the joints of a family, and how they turn."""
    joints = [joint for joint in points.layout.joints if joint.family == family]
    axes = np.array([points.layout.pose(joint.first).axes[:, 2] for joint in joints])
    sides = [joint.first for joint in joints], [joint.second for joint in joints]
    alongs = map(points.directions, sides)
    sections = np.array([joint.section for joint in joints])
    aheads = [(np.cross(axes[:, :, None], along, axis=1), along) for along in alongs]
    return at_section(law, sections), Turning(aheads)


class Pull(NamedTuple):
    """The cables at one instant: their state; generalised force on (q, psi) (N m); speeds that laws
    with feedback command (m/s); power lost, and put in by the winches less the energy wound up with
    the rope (W); elastic energy (J).
    """

    chain: ChainState
    force: Array
    commands: Array
    loss: float
    power: float
    elastic: float


class IdealCables:
    """The cables of a scene on its ideal ring.

    ``planes`` are those of each cable, two where the cables of both planes are identical; ``paths``
    the coefficients of all paths' points behind one another, shape (points, 3, functions), m;
    ``ropes`` which spans form one rope, which faults change; ``answering`` cable and end (0 first,
    1 far) of the winches with feedback, whose rope and speed are states of the motion.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        assert scene.cables is not None
        present = scene.cables.present()
        self.planes: list[tuple[int, ...]] = [(plane,) for plane, _ in present]
        alike = scene.structure.closed and len(present) == 2 and not scene.faults
        if alike and present[0][1] == present[1][1]:
            present, self.planes = present[:1], [(0, 1)]
        self._copies = np.array([float(len(planes)) for planes in self.planes])
        self._structure, self._cables = scene.structure, [cable for _, cable in present]
        paths = [mechanism.points.path(number) for number in range(len(present))]
        self.paths = np.concatenate(paths)
        self._chain = Chain(self._cables, [len(path) for path in paths])
        released = np.eye(mechanism.freedom)[0] * scene.structure.coordinate
        start = mechanism.configuration(released, 0.0 * released)
        self.ropes = self._chain.start(self.paths @ start.values)
        self._slip = min(cable.slip_speed_over(scene.pulleys_of(cable)) for cable in self._cables)
        self._winches = {
            (number, end): winch
            for number, cable in enumerate(self._cables)
            for end, winch in enumerate(cable.winches)
        }
        self.answering = [
            place
            for place, winch in self._winches.items()
            if isinstance(winch.winding, FeedbackWinding)
        ]

    @property
    def nudges(self) -> tuple[float, float]:
        """Increments of a length (m) and a rate (1/s) over which tensions are nearly linear."""
        # A slack rope becomes taut within this strain; friction turns within the slip speed.
        soft = min(cable.slack_width / cable.axial_stiffness for cable in self._cables)
        return min(max(1e-2 * soft, 1e-9), 1e-6), 1e-2 * self._slip

    def lock(self, time: float) -> None:
        """All V-joints have locked at a time (s): winches rest but for those that pull on.

        Of rods that do not give, rope held at a tension and rope held as it is are the same.
        """
        for place, winch in self._winches.items():
            if winch.after_lock != "pull":
                stop = winch.model_copy(update={"after_lock": "stop"})
                self._winches[place] = stop.locked(time, 0.0)

    def driving(self, time: float, chain: ChainState) -> bool:
        """Whether a winch turns or will turn on a rope that is whole."""
        return driving(self._winches, time, chain)

    def pull(self, time: float, now: Configuration, motors: Array) -> Pull:
        """Evaluate the cables; ``time`` (s) is that of the winches' laws, ``motors`` the rope wound
        by each winch with feedback and its speed, m and m/s, shape (2, winches).

        Raises
        ------
        ValueError
            If a span has no length, or a winch has wound up its whole rope.
        """
        points, velocities = now.places(self.paths), now.velocities(self.paths)
        ropes, copies = self.ropes, self._copies
        wound, speed = np.zeros((2, len(copies), 2))
        for place, winch in self._winches.items():
            wound[place], speed[place] = winch.at(time)
        for place, *motor in zip(self.answering, *motors, strict=True):
            wound[place], speed[place] = motor
        state = self._chain.state(ropes, points, velocities, wound, speed)
        on_rope, density = copies[ropes.cable], state.energy_density
        of_points = np.repeat(copies, ropes.points_per_cable)[:, None] * state.point_forces
        return Pull(
            state,
            now.along(self.paths, of_points),
            self._commands(time, now, state),
            float(on_rope[ropes.of_pulley] @ state.friction_loss + on_rope @ state.damping_loss),
            float(copies @ state.winch_power.sum(axis=1) - on_rope @ (density * state.wound_rates)),
            float(on_rope @ (density * state.natural)),
        )

    def _commands(self, time: float, now: Configuration, state: ChainState) -> Array:
        """Speeds commanded by the laws with feedback, m/s, shape (winches,)."""
        if not self.answering:
            return np.zeros(0)
        opening = np.full(self._structure.sections, math.pi - 2.0 * float(now.place[0]))
        on = [place for place in self.answering if self._winches[place].turns(time)]
        running = [self.ropes.of_end[place] for place in on]
        rest = state.path_rates + state.wound_rates
        for place, rope in zip(on, running, strict=True):
            rest[rope] -= state.wound_rate[place]
        found = dict.fromkeys(self.answering, 0.0)
        for place, rope in zip(on, running, strict=True):
            law = self._winches[place].winding
            assert isinstance(law, FeedbackWinding)
            slope = self._structure.path_slope(self._cables[place[0]], opening)
            # Winches on one rope share the length that the structure releases.
            shared = float(rest[rope]) / running.count(rope)
            reading = replace(state.reading(*place, slope), path_rate=shared)
            command = law.command(float(state.winch_tensions[place]), reading)
            found[place] = float(np.clip(command, *law.limits()))
        return np.array(list(found.values()))
