"""Closed rings of rigid rods in motion, a truth for both engines: one coordinate, by scipy.

    I q'' + I' q'^2 / 2 = dW/dq + Q

with I and W of ``OneCoordinate``, and in Q friction of the V-joints, cables whose winches wind at
prescribed speeds, and what a test adds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from ringsim.cable.chain import ChainState
from ringsim.core.chain import Chain
from ringsim.rigid.mechanism import Mechanism
from ringsim.rigid.statics import OneCoordinate
from ringsim.scene import Scene
from ringsim.units import at_section

TIGHT = 1e-8
"""Local error of a step over the rate; the rates of angles and ropes are of order 0.01 to 1."""


class Course(NamedTuple):
    """Opening angle (deg) and tension at the winches (N, shape (cables, times)) at times (s), and
    when the ring is open (s, NaN if never)."""

    times: np.ndarray
    angle: np.ndarray
    tension: np.ndarray
    open_at: float


class RigidRing:
    def __init__(
        self, scene: Scene, more: Callable[[float, float, float], float] | None = None
    ) -> None:
        """``more`` is a force on the coordinate at a time, a coordinate and a rate, N m."""
        self._ring, self._start, self._more = OneCoordinate(scene), scene.structure.coordinate, more
        nodes = np.linspace(-0.05, self._start + 0.05, 400)
        self._inertia = CubicSpline(nodes, [self._ring.motion(q).inertia for q in nodes])
        law, sections = scene.joints.present().get("vjoint"), np.arange(scene.structure.sections)
        self._friction, self._sections = law and at_section(law, sections), len(sections)
        self._cables = [] if scene.cables is None else [one for _, one in scene.cables.present()]
        if self._cables:
            self._mechanism = Mechanism(scene)
            paths = [self._mechanism.points.path(k) for k in range(len(self._cables))]
            self._chain, self._paths = Chain(self._cables, list(map(len, paths))), np.vstack(paths)
            start = self._mechanism.at(self._start)
            self._ropes = self._chain.start(start.places(self._paths))

    def _pulled(self, time: float, q: float, rate: float) -> tuple[float, ChainState]:
        now = self._mechanism.at(q)
        wound, speed = np.zeros((2, len(self._cables), 2))
        for number, cable in enumerate(self._cables):
            for end, winch in enumerate(cable.winches):
                wound[number, end], speed[number, end] = winch.at(time)
        slopes = now.velocities(self._paths)
        places = now.places(self._paths)
        state = self._chain.state(self._ropes, places, rate * slopes, wound, speed)
        return float(np.sum(state.point_forces * slopes)), state

    def rates(self, time: float, state: np.ndarray) -> list[float]:
        q, rate = map(float, state)
        force = self._ring.work_rate(q) - 0.5 * float(self._inertia(q, 1)) * rate**2
        if self._friction is not None:  # two joints a section, which turn by twice the coordinate
            torque = np.broadcast_to(self._friction.torque(2.0 * rate), self._sections)
            force -= 4.0 * float(np.sum(torque))
        if self._cables:
            force += self._pulled(time, q, rate)[0]
        if self._more is not None:
            force += self._more(time, q, rate)
        return [rate, force / float(self._inertia(q))]

    def course(self, times: np.ndarray) -> Course:
        def is_open(_: float, state: np.ndarray) -> float:
            return float(state[0])

        is_open.terminal = True  # type: ignore[attr-defined]
        found = solve_ivp(
            self.rates, (0.0, float(times[-1])), [self._start, 0.0], method="Radau",
            t_eval=times, events=is_open, rtol=TIGHT, atol=TIGHT,
        )  # fmt: skip
        assert found.success
        tension = [
            self._pulled(t, *y)[1].winch_tensions[:, 0] if self._cables else []
            for t, y in zip(found.t, found.y.T, strict=True)
        ]
        ends = found.t_events[0]
        return Course(
            found.t,
            180.0 - 2.0 * np.degrees(found.y[0]),
            np.array(tension).T,
            float(ends[0]) if len(ends) else math.nan,
        )
