"""The winches of all cables, turning within every Newton iteration.

A prescribed law gives the length wound at any time.  A feedback law depends on the tension at the
end of the step, which depends on the rope wound during the step and on where the structure gets
to: with V the speed of all such winches of a rope, h the time into the step, S its path and M its
natural length without V,

    V = sum_i command_i(r_i(V) q(y)),   y = EA (S / (M - V h) - 1 + t_d de/dt),

r_i(V) the ratio of the tension at a winch to the rope's mean tension, were the n winches of the
rope to turn at V / n each while the structure moves as at the beginning of the step: a motor that
comes to rest takes the friction of its pulleys with it.  Commands fall with the tension and y
grows with V, so there is one solution for any EA and step.
A law that follows the structure uses the path taken up so far in the step, S_0 - S, not the rate
at its start: its tension then answers to its own correction alone, whatever the structure does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from ringsim.cable.records import Cable, Winch
from ringsim.cable.ropes import Array, Ropes
from ringsim.cable.state import ChainState
from ringsim.cable.winding.family import FeedbackWinding, WinchReading, WinchState

_NUDGE = 1e-8
"""Change of path in m by which the answer of the winches to the structure is measured: a hundred
million roundings of a path of 1 m, and still a force of 1e-3 N at EA = 1e5 N."""


@dataclass(frozen=True)
class _Member:
    """A winch with feedback that runs in this step."""

    number: int
    law: FeedbackWinding
    reading: WinchReading


@dataclass(frozen=True)
class _Rope:
    """A rope that such winches wind in this step, as it was at the beginning."""

    members: list[_Member]
    start: float
    path: float
    """Beginning of the step (s) and path of the rope then (m)."""
    material: tuple[float, ...]
    """EA (N), Kelvin-Voigt time (s) and width of the passage from slack to taut (N)."""

    def speeds(self, time: float, path: float, rate: float, natural: float, rest: float) -> Array:
        """Speed of every member, m/s.

        Parameters
        ----------
        path, rate
            Path of the rope and its rate, m and m/s.
        natural
            Natural length if the members had not wound since the start of the step, m.
        rest
            Speed of the other winches on the rope, m/s.
        """
        elapsed, count = time - self.start, len(self.members)
        follow = (path - self.path) / elapsed if elapsed > 0.0 else rate
        laws = [
            (m.law, replace(m.reading, path_rate=(follow + rest) / count), m.law.limits())
            for m in self.members
        ]
        stiffness, damping_time, width = self.material

        def commands(total: float) -> list[float]:
            left = natural - total * elapsed
            strain_rate = (rate + path / left * (total + rest)) / left
            force = stiffness * (path / left - 1.0 + damping_time * strain_rate)
            # slack.tension of one number: numpy takes ten times as long in the root finder.
            mean = max(force, 0.0) + width * math.log1p(math.exp(-abs(force) / width))
            return [
                min(
                    max(law.command(mean * reading.tension_ratio(total / count), reading), least),
                    most,
                )
                for law, reading, (least, most) in laws
            ]

        low = sum(limits[0] for *_, limits in laws)
        high = sum(limits[1] for *_, limits in laws)
        if sum(commands(high)) >= high:
            total = high
        elif sum(commands(low)) <= low:
            total = low
        else:
            total = brentq(lambda v: v - sum(commands(v)), low, high, xtol=1e-16, rtol=1e-14)
        found = np.array(commands(total))
        # Steep commands amplify the last bits of the total: share these out.
        return np.asarray(found + (total - found.sum()) / count)


class Winches:
    """Rope wound and speeds at both ends of each cable."""

    def __init__(self, cables: Sequence[Cable]) -> None:
        self._cables = len(cables)
        self._winches: list[tuple[int, int, Winch]] = [
            (number, end, winch)
            for number, cable in enumerate(cables)
            for end, winch in enumerate(cable.winches)
        ]
        self._held = [WinchState() for _ in self._winches]
        self._ropes: dict[int, _Rope] = {}
        self._speeds: dict[int, float] = {}
        self._prescribed: tuple[float, Array, Array] | None = None

    @property
    def answering(self) -> bool:
        """Whether any winch answers to its rope in this step."""
        return bool(self._ropes)

    def at(
        self, time: float, ropes: Ropes, paths: Array | None, rates: Array | None
    ) -> tuple[Array, Array]:
        """Rope wound (m) and its rate (m/s) at both ends of each cable, shape (cables, 2) each.

        The paths of the ropes (m) and their rates (m/s) are not needed if no winch answers.
        """
        if not self._ropes and self._prescribed is not None and self._prescribed[0] == time:
            return self._prescribed[1:]
        wound, speed = np.zeros((self._cables, 2)), np.zeros((self._cables, 2))
        answering = {m.number for rope in self._ropes.values() for m in rope.members}
        for place, ((number, end, winch), held) in enumerate(
            zip(self._winches, self._held, strict=True)
        ):
            state = WinchState(time, held.wound) if place in answering else winch.at(time, held)
            wound[number, end], speed[number, end] = state.wound, state.speed
        if not self._ropes or paths is None or rates is None:
            self._prescribed = time, wound, speed
            return wound, speed
        natural, rest = ropes.content - ropes.per_rope(wound), ropes.per_rope(speed)
        for k, rope in self._ropes.items():
            found = rope.speeds(
                time, float(paths[k]), float(rates[k]), float(natural[k]), float(rest[k])
            )
            for member, value in zip(rope.members, found, strict=True):
                number, end, _ = self._winches[member.number]
                speed[number, end] = self._speeds[member.number] = float(value)
                wound[number, end] += float(value) * (time - rope.start)
        return wound, speed

    def stiffness_left(self, time: float, ropes: Ropes, paths: Array, rates: Array) -> Array:
        """Share of a change of path that stretches the rope, not answered by its winches."""
        left = np.ones(len(ropes.starts))
        near = ropes.per_rope(self.at(time, ropes, paths, rates)[0])
        for k in self._ropes:
            moved = paths.copy()
            moved[k] += _NUDGE
            far = ropes.per_rope(self.at(time, ropes, moved, rates)[0])
            left[k] += (far - near)[k] / _NUDGE
        return np.clip(left, 0.0, 1.0)

    def advance(self, time: float, state: ChainState, slopes: Array) -> None:
        """Begin a step at ``time`` (s) in a state of the chain.

        ``slopes`` are the derivatives of the cables' ideal paths after the opening angle, m/rad.
        """
        self._prescribed = None
        self._held = [
            WinchState(time, float(state.wound[number, end]), self._speeds.get(place, 0.0))
            for place, (number, end, _) in enumerate(self._winches)
        ]
        self._ropes = {}
        for place, (number, end, winch) in enumerate(self._winches):
            law = winch.winding
            if not isinstance(law, FeedbackWinding):
                continue
            if not winch.turns(time):
                self._held[place] = WinchState(time, self._held[place].wound, 0.0)
                continue
            k = int((state.ropes.last if end else state.ropes.first)[number])
            if k not in self._ropes:
                material = tuple(float(values[k]) for values in state.material)
                self._ropes[k] = _Rope([], time, float(state.paths[k]), material)
            reading = state.reading(number, end, float(slopes[number]))
            self._ropes[k].members.append(_Member(place, law, reading))
