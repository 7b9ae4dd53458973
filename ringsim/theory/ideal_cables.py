"""The cables of an ideal ring: ringsim.cable's chain on points that follow its coordinates.

Only the spans beside a V pulley change their lengths, with phi alone: hinge pulleys sit on the
pins about which the end assemblies swing, and a winch keeps its distance from its first pulley.
The generalised force on phi is - sum T_i dL_i/dphi.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.chain import Chain
from ringsim.cable.faults.family import CableFault
from ringsim.cable.records import Cable, Winch
from ringsim.cable.state import ChainState
from ringsim.cable.winding.family import FeedbackWinding, WinchState
from ringsim.scene import Scene
from ringsim.theory.ideal_mechanism import Mechanism, Pose
from ringsim.theory.ideal_points import UP

Array = NDArray[np.float64]


class Pull(NamedTuple):
    """The cables at one instant.

    Attributes
    ----------
    chain
        See ringsim.cable.
    force
        Generalised force on phi, N m.
    commands
        Speeds commanded by the laws of the winches with feedback, m/s.
    loss, power, elastic
        Power lost (W), power put in by the winches less the energy wound up with the rope (W),
        elastic energy (J).
    """

    chain: ChainState
    force: float
    commands: Array
    loss: float
    power: float
    elastic: float


class _Place(NamedTuple):
    """A winch: its cable (from 0), the end of it (0 first, 1 far), and what it is."""

    cable: int
    end: int
    winch: Winch


class IdealCables:
    """The cables of a scene on its ideal ring.

    Attributes
    ----------
    planes
        Planes of each cable: two where the cables of both planes are identical.
    ropes
        Which spans form one rope; ``strike`` changes them.
    spans
        Of the longest cable.
    answering
        The winches with feedback: their rope and speed are states of the motion.
    """

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        assert scene.cables is not None
        self._mechanism, present = mechanism, scene.cables.present()
        self.planes: list[tuple[int, ...]] = [(plane,) for plane, _ in present]
        alike = scene.structure.closed and len(present) == 2 and not scene.faults
        if alike and present[0][1] == present[1][1]:
            present, self.planes = present[:1], [(0, 1)]
        self._copies = np.array([float(len(planes)) for planes in self.planes])
        self._cables = [cable for _, cable in present]
        self._winch_distance = scene.cables.winch_distance
        paths = [self._path(plane, cable) for plane, cable in present]
        per_cable = [len(path) for path in paths]
        self._paths = np.concatenate(paths)
        self._starts, self._sizes = np.cumsum([0, *per_cable[:-1]]), per_cable
        self._hung = self._swinging()
        self._chain = Chain(self._cables, per_cable)
        start = mechanism.pose(_initial(scene, mechanism), np.zeros(mechanism.freedom))
        self.ropes = self._chain.start(self.points(start))
        self.spans = scene.spans
        self._slip = min(cable.slip_speed_over(scene.pulleys_of(cable)) for cable in self._cables)
        self._places = [
            _Place(number, end, winch)
            for number, cable in enumerate(self._cables)
            for end, winch in enumerate(cable.winches)
        ]
        self.answering = [place for place in self._places if place.winch.feedback]

    @property
    def breaks(self) -> list[float]:
        """Times at which a winch is switched on or off, s."""
        times = {t for p in self._places for t in (p.winch.start_time, p.winch.stop_time)}
        return sorted(time for time in times if time is not None and time > 0.0)

    @property
    def nudges(self) -> tuple[float, float]:
        """Increments of a length (m) and a rate (1/s) over which tensions are nearly linear.

        A slack rope becomes taut within slack_width / EA of strain; friction turns within the
        slip speed.
        """
        soft = min(cable.slack_width / cable.axial_stiffness for cable in self._cables)
        return min(max(1e-2 * soft, 1e-9), 1e-6), 1e-2 * self._slip

    def pull(self, time: float, pose: Pose, motors: Array) -> Pull:
        """Evaluate the cables.

        Parameters
        ----------
        time
            For the winches' laws, s.
        motors
            Rope wound by each winch with feedback and its speed, m and m/s, shape (2, winches).

        Raises
        ------
        ValueError
            If a span has no length, or a winch has wound up its whole rope.
        """
        points, slopes = self.points(pose), self._paths @ pose.basis[1]
        state = self._wind(time, points, slopes * pose.rate[0], motors)
        ropes = self.ropes
        longer = np.einsum("ij,ij->i", state.directions, slopes[ropes.far] - slopes[ropes.near])
        copies, cable, density = self._copies, ropes.cable, state.energy_density
        on_rope, on_pulley = copies[cable], copies[cable][ropes.of_pulley]
        return Pull(
            state,
            -float((on_rope[ropes.of_span] * state.tensions) @ longer),
            self._commands(time, pose, state),
            float(on_pulley @ state.friction_loss + on_rope @ state.damping_loss),
            float(copies @ state.winch_power.sum(axis=1) - on_rope @ (density * state.wound_rates)),
            float(on_rope @ (density * state.natural)),
        )

    def strike(self, fault: CableFault, state: ChainState) -> None:
        """Let a fault change the ropes."""
        self.ropes = fault.strike(self.ropes, state)

    def tensions(self, state: ChainState) -> Array:
        """Tensions by cable and span, N, shape (cables, spans); NaN beyond a cable's last span."""
        found = np.full((len(self.planes), self.spans), np.nan)
        edges = self.ropes.cable_starts
        for number, (first, end) in enumerate(pairwise(edges)):
            found[number, : end - first] = state.tensions[first:end]
        return found

    def stretches(self, state: ChainState) -> Array:
        """Path less natural length of the rope at each cable's first winch, m; -1 if it is cut."""
        first = self.ropes.first
        alive = self.ropes.alive[first]
        return np.where(alive, (state.paths - state.natural)[first], -1.0)

    def _wind(self, time: float, points: Array, velocities: Array, motors: Array) -> ChainState:
        """The chain with its winches' ropes and speeds."""
        wound, speed = np.zeros((2, len(self._cables), 2))
        for number, end, winch in self._places:
            if not winch.feedback:
                law = winch.at(time, WinchState())
                wound[number, end], speed[number, end] = law.wound, law.speed
        for place, length, rate in zip(self.answering, *motors, strict=True):
            wound[place.cable, place.end], speed[place.cable, place.end] = length, rate
        return self._chain.state(self.ropes, points, velocities, wound, speed)

    def _commands(self, time: float, pose: Pose, state: ChainState) -> Array:
        """Speeds commanded by the laws with feedback, m/s, shape (winches,).

        Winches on one rope share the length that the structure releases.
        """
        ring, opening = self._mechanism.geometry, math.pi - 2.0 * float(pose.place[0])
        on = [place for place in self.answering if place.winch.turns(time)]
        ends = (self.ropes.first, self.ropes.last)
        running = [int(ends[place.end][place.cable]) for place in on]
        rest = state.path_rates + state.wound_rates
        for place, rope in zip(on, running, strict=True):
            rest[rope] -= state.wound_rate[place.cable, place.end]
        found = np.zeros(len(self.answering))
        for number, place in enumerate(self.answering):
            law = place.winch.winding
            if place not in on or not isinstance(law, FeedbackWinding):
                continue
            rope = int(ends[place.end][place.cable])
            own = self._cables[place.cable].path_slope(ring.half_bar, opening)
            slope = ring.sections * float(own)
            reading = replace(
                state.reading(place.cable, place.end, slope),
                path_rate=float(rest[rope]) / running.count(rope),
            )
            tension = float(state.winch_tensions[place.cable, place.end])
            least, most = law.limits()
            found[number] = min(max(law.command(tension, reading), least), most)
        return found

    def points(self, pose: Pose) -> Array:
        """Points of all paths, winch, pulleys and far end, behind one another, shape (n, 3), m."""
        points: Array = self._paths @ pose.basis[0]
        if self._mechanism.ends is None:
            return points
        for winch, pulley, swing, along in self._hung:
            arm, angle = points[winch, 2] - points[pulley, 2], float(pose.place[1 + swing])
            turned = math.cos(angle) * UP - math.sin(angle) * along
            points[winch] = points[pulley] + arm * turned
        return points

    def _swinging(self) -> list[tuple[int, int, int, Array]]:
        """Each winch on an end assembly: its point and its pulley's, the swing that it shares, its
        section's way.
        """
        ways, found = self._mechanism.geometry.directions, []
        for start, size, cable, planes in zip(
            self._starts, self._sizes, self._cables, self.planes, strict=True
        ):
            last = cable.end == "last"
            first = int(start)
            found.append((first, first + 1, planes[0] + 2 * last, ways[-1 if last else 0]))
            if cable.end == "both":
                far = first + size - 1
                found.append((far, far - 1, planes[0] + 2, ways[-1]))
        return found

    def _path(self, plane: int, cable: Cable) -> Array:
        """Coefficients of a path's points: winch, pulleys, far end; shape (points, 3, 4)."""
        geometry, points = self._mechanism.geometry, self._mechanism.points
        inward = np.array([0.0, 0.0, -1.0 if plane == 0 else 1.0])
        left, right = points.left[plane], points.right[plane]
        aside, inwards = _in_basis(cable)
        drop = inwards + geometry.half_bar * np.eye(4)[2]
        blocks = 0.5 * (left + right) + np.outer(inward, drop)
        blocks += geometry.directions[:, :, None] * aside
        path = np.stack([left, blocks, right], axis=1).reshape(-1, 3, 4)
        if cable.end == "last":
            path = path[::-1]
        down = np.outer(self._winch_distance * inward, np.eye(4)[0])
        far = path[-1:] + down if cable.end == "both" else path[:0]
        return np.concatenate([path[:1] + down, path, far])


def _initial(scene: Scene, mechanism: Mechanism) -> Array:
    return np.append(scene.structure.coordinate, np.zeros(mechanism.freedom - 1))


def _in_basis(cable: Cable) -> tuple[Array, Array]:
    """Coefficients of the V pulley's place beside and inside of its joint, shape (4,) each, m.

    Brackets turn with the bars, so that both are linear in 1, cos(phi) and sin(phi).
    """
    at = cable.bracket.place(np.array([0.0, 0.5 * np.pi, np.pi]), cable.block_offset)
    found = []
    for zero, right, half_turn in at:
        mean = 0.5 * (zero + half_turn)
        found.append(np.array([mean, 0.5 * (zero - half_turn), right - mean, 0.0]))
    return found[0], found[1]
