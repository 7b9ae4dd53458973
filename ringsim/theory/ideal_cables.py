"""The cables of an ideal ring: ringsim.cable's chain on points that follow its coordinates.

Sheaves are points like all others; the generalised force of a cable is its force on each of them
times how that point moves with the coordinates.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ringsim.cable.chain import Chain
from ringsim.cable.state import ChainState
from ringsim.cable.winding.family import FeedbackWinding, WinchState
from ringsim.layout.pose import Array
from ringsim.scene import Scene
from ringsim.theory.ideal_mechanism import Configuration, Mechanism


class Pull(NamedTuple):
    """The cables at one instant: their state; generalised force on (q, psi) (N m); speeds
    commanded by the laws of the winches with feedback (m/s); power lost, and put in by the winches
    less the energy wound up with the rope (W); elastic energy (J).
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
    the coefficients of all paths' points, winch, sheaves and far end, behind one another, shape
    (points, 3, functions), m; ``ropes`` which spans form one rope, which faults change;
    ``answering`` cable and end (0 first, 1 far) of the winches with feedback, whose rope and speed
    are states of the motion.
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
        self.answering = [place for place, winch in self._winches.items() if winch.feedback]

    @property
    def breaks(self) -> list[float]:
        """Times at which a winch is switched on or off, s."""
        switched = [(w.start_time, w.stop_time) for w in self._winches.values()]
        return [time for times in switched for time in times if time is not None and time > 0.0]

    @property
    def nudges(self) -> tuple[float, float]:
        """Increments of a length (m) and a rate (1/s) over which tensions are nearly linear."""
        # A slack rope becomes taut within this strain; friction turns within the slip speed.
        soft = min(cable.slack_width / cable.axial_stiffness for cable in self._cables)
        return min(max(1e-2 * soft, 1e-9), 1e-6), 1e-2 * self._slip

    def pull(self, time: float, now: Configuration, motors: Array) -> Pull:
        """Evaluate the cables at a time (s), that of the winches' laws.

        ``motors`` are the rope wound by each winch with feedback and its speed, m and m/s, shape
        (2, winches).

        Raises
        ------
        ValueError
            If a span has no length, or a winch has wound up its whole rope.
        """
        points, slopes, velocities = now.moved(self.paths)
        ropes, copies = self.ropes, self._copies
        wound, speed = np.zeros((2, len(copies), 2))
        for place, winch in self._winches.items():
            if not winch.feedback:
                law = winch.at(time, WinchState())
                wound[place], speed[place] = law.wound, law.speed
        for place, *motor in zip(self.answering, *motors, strict=True):
            wound[place], speed[place] = motor
        state = self._chain.state(ropes, points, velocities, wound, speed)
        on_rope, density = copies[ropes.cable], state.energy_density
        of_points = np.repeat(copies, ropes.points_per_cable)[:, None] * state.point_forces
        return Pull(
            state,
            np.tensordot(of_points, slopes, 2),
            self._commands(time, now, state),
            float(on_rope[ropes.of_pulley] @ state.friction_loss + on_rope @ state.damping_loss),
            float(copies @ state.winch_power.sum(axis=1) - on_rope @ (density * state.wound_rates)),
            float(on_rope @ (density * state.natural)),
        )

    def _commands(self, time: float, now: Configuration, state: ChainState) -> Array:
        """Speeds commanded by the laws with feedback, m/s, shape (winches,).

        Winches on one rope share the length that the structure releases.
        """
        if not self.answering:
            return np.zeros(0)
        opening = np.full(self._structure.sections, math.pi - 2.0 * float(now.place[0]))
        rope_of = np.stack([self.ropes.first, self.ropes.last], axis=1)
        on = [place for place in self.answering if self._winches[place].turns(time)]
        running = [rope_of[place] for place in on]
        rest = state.path_rates + state.wound_rates
        for place, rope in zip(on, running, strict=True):
            rest[rope] -= state.wound_rate[place]
        found = dict.fromkeys(self.answering, 0.0)
        for place, rope in zip(on, running, strict=True):
            law = self._winches[place].winding
            assert isinstance(law, FeedbackWinding)
            slope = self._structure.path_slope(self._cables[place[0]], opening)
            shared = float(rest[rope]) / running.count(rope)
            reading = replace(state.reading(*place, slope), path_rate=shared)
            least, most = law.limits()
            command = law.command(float(state.winch_tensions[place]), reading)
            found[place] = min(max(command, least), most)
        return np.array(list(found.values()))
