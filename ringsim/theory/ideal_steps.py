"""Integrating many ideal rings at once, each with its own steps.

Every pass tries one step of Radau IIA (ringsim.theory.radau) for all samples that are still
under way, each at its own time and with its own step; a sample whose error is too large, or whose
Newton iteration fails, goes on with a smaller step of its own.  Faults split the run: all samples
are brought to their own time of the next fault before any goes on, because it changes which spans
form one rope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.faults.family import CableFault
from ringsim.theory import radau
from ringsim.theory.ideal_batch import Batch, Equation
from ringsim.theory.ideal_course import Course, Piece
from ringsim.theory.ideal_winches import Winches, Winding
from ringsim.variables import Status

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

RELATIVE, ANGLE, RATE = 1e-7, 1e-9, 1e-9
"""Local error of a step: RELATIVE of the value + ANGLE (rad) or RATE (rad/s)."""
AT_STOP = 1e-7
"""A step ends at the event if it comes this close to it, rad."""
SHORTEST = 1e-11
"""Step in s below which a sample is given up."""
MOST_STEPS = 200_000
_GROWTH, _SAFETY = 6.0, 0.9


@dataclass
class _Taken:
    """Accepted steps of all samples, in the order of the passes."""

    sample: list[Indices] = field(default_factory=list)
    columns: list[tuple[Array, ...]] = field(default_factory=list)


class Integration:
    """One run of a batch; ``courses`` are the results, one per scene."""

    def __init__(self, batch: Batch) -> None:
        self._batch, self._winches = batch, Winches(batch)
        scenes = batch.scenes
        count = len(scenes)
        self.courses = [Course() for _ in scenes]
        self.time, self.rate = np.zeros(count), np.zeros(count)
        self.phi = np.array([s.structure.initial_phi for s in scenes])
        self._step = np.array([0.01 * s.solver.step for s in scenes])
        self._most = np.array([s.solver.step for s in scenes])
        self._last_step = np.ones(count)
        self._pull = np.full((count, 3), np.nan)
        self._latched, self._locked = np.zeros((2, count), dtype=bool)
        self._end = np.array([s.solver.end_time for s in scenes])
        self._latches = np.array([s.stop is not None and s.stop.latch for s in scenes])
        self._settling = np.array([s.solver.settling_time if s.stop else 0.0 for s in scenes])
        stowed = [0.0 if s.stop is None else math.radians(s.stop.stowed_angle) for s in scenes]
        self._stowed = 0.5 * (math.pi - np.array(stowed))
        self._live = np.ones(count, dtype=bool)
        self._breaks = [[*self._winches.breaks(k), math.inf] for k in range(count)]
        self._faults = [
            sorted((f for f in s.faults if isinstance(f, CableFault)), key=lambda f: f.time)
            for s in scenes
        ]

    def run(self) -> list[Course]:
        """Bring all samples to their ends."""
        for number in range(len(self._faults[0]) + 1):
            waiting = np.array(
                [own[number].time if number < len(own) else math.inf for own in self._faults]
            )
            self._until(waiting)
            for sample in np.flatnonzero(self._live):
                self._strike(int(sample), self._faults[sample][number])
            if not self._live.any():
                break
        for k, course in enumerate(self.courses):
            course.end = float(self.time[k]), float(self.phi[k]), float(self.rate[k])
        return self.courses

    def _strike(self, sample: int, fault: CableFault) -> None:
        ropes, equation = self._batch.ropes, self._batch.equation().take(np.array([sample]))
        place = float(self.time[sample]), float(self.phi[sample]), float(self.rate[sample])
        state = self._winches.chain_now(equation, sample, *place)
        ropes[sample] = fault.strike(ropes[sample], state)
        self._restart(sample)

    def _restart(self, sample: int) -> None:
        self._pull[sample] = np.nan
        self._step[sample] = min(self._step[sample], 0.01 * self._most[sample])

    def _until(self, waiting: Array) -> None:
        """Take steps until all living samples have come to their time in ``waiting``."""
        whole = self._batch.equation()
        taken = _Taken()
        chosen: Indices = np.zeros(0, dtype=np.intp)
        equation = whole
        while True:
            going = np.flatnonzero(self._live & (self.time < waiting * (1.0 - 1e-13)))
            if len(going) == 0:
                break
            if not np.array_equal(going, chosen):
                chosen, equation = going, whole.take(going)
            self._try(equation, chosen, waiting, taken)
        self._file(whole, taken)

    def _try(self, equation: Equation, who: Indices, waiting: Array, taken: _Taken) -> None:
        """One step of the samples ``who``, kept where it is good enough."""
        time, phi, rate = self.time[who], self.phi[who], self.rate[who]
        target = np.minimum(np.minimum(self._end[who], waiting[who]), self._next_break(who))
        wanted = np.minimum(self._step[who], self._most[who])
        left = target - time
        step = np.where(1.01 * wanted >= left, left, wanted)
        self._winches.begin(equation, who, time, phi, rate)
        latched = self._latched[who][:, None]
        moments = time[:, None] + step[:, None] * np.array([0.0, *radau.NODES[:2], 1.0 - 1e-9])
        winding = Winding(self._winches, equation, who, moments)
        nudge = equation.nudges()

        def force(x: Array, v: Array, instants: list[int]) -> Array:
            return equation.acceleration(x, v, *winding.at(x, v, instants), latched)

        def at_stages(x: Array, v: Array) -> Array:
            return force(x, v, [1, 2, 3] * (x.shape[1] // 3))

        dx, dv = nudge
        begin = force(
            np.stack([phi, phi + dx, phi], axis=1),
            np.stack([rate, rate, rate + dv], axis=1),
            [0] * 3,
        )
        start = begin[:, 0], (begin[:, 1] - begin[:, 0]) / dx, (begin[:, 2] - begin[:, 0]) / dv
        known = np.isfinite(self._pull[who]).all(axis=1)
        ratio = np.where(known, step / self._last_step[who], 0.0)
        guess = radau.extrapolated(np.where(known[:, None], self._pull[who], 0.0), ratio)
        guess = np.where(known[:, None], guess, start[0][:, None])
        state = phi, rate, step
        scale = ANGLE + RELATIVE * np.abs(phi), RATE + RELATIVE * np.abs(rate)
        with np.errstate(all="ignore"):
            pull, good, iterations = radau.solve_stages(at_stages, state, guess, nudge, scale)
            error = radau.error_size(state, pull, start, scale)
            error = np.where(good & np.isfinite(error), error, np.inf)
            smooth = _SAFETY * 25.0 / (24.0 + np.maximum(iterations, 1.0))
            factor = smooth * np.maximum(error, 1e-10) ** -0.25
        factor = np.where(np.isfinite(error), np.clip(factor, 0.2, _GROWTH), 0.25)
        xs, vs = radau.stage_states(phi, rate, step, pull)
        fine = error <= 1.0
        share = self._to_contact(who, phi, step, rate, xs[:, 2], pull)
        events = fine & (share < 1.0)
        fine &= ~events
        step = np.where(events, share * step, step)
        factor = np.where(events, 1.0, factor)
        truncated = step < wanted
        next_step = np.where(fine & truncated, np.maximum(wanted, step * factor), step * factor)
        self._step[who] = np.where(fine, np.minimum(next_step, self._most[who]), step * factor)
        self._pull[who[~fine & ~events]] = np.nan
        self._count(who, iterations)
        rows = np.flatnonzero(fine)
        kept = who[rows]
        taken.sample.append(kept)
        whole = [np.column_stack([b, s]) for b, s in ((phi, xs), (rate, vs), (start[0], pull))]
        wound, speed = winding.taken(whole[0], whole[1])
        columns = (time, step, *whole, wound, speed, self._latched[who])
        taken.columns.append(tuple(column[rows] for column in columns))
        self.time[kept] = np.where(step[rows] == left[rows], target[rows], (time + step)[rows])
        self.phi[kept], self.rate[kept] = xs[rows, 2], vs[rows, 2]
        self._pull[kept], self._last_step[kept] = pull[rows], step[rows]
        for sample in kept:
            self._judge(int(sample))
        for row in np.flatnonzero(~fine & (self._step[who] < SHORTEST)).tolist():
            self._give_up(int(who[row]), wound[row])

    def _to_contact(
        self, who: Indices, phi: Array, step: Array, rate: Array, end: Array, pull: Array
    ) -> Array:
        """Share of the step until a stop is met or left; 1 where neither happens.

        The stops' torque has a kink there, which the error estimate of a long step can miss.
        """
        share = np.ones(len(who))
        for level in (np.zeros(len(who)), self._stowed[who]):
            before, after = phi - level, end - level
            crossed = (before * after < 0.0) & ~self._latched[who]
            crossed &= (np.abs(before) > AT_STOP) & (np.abs(after) > AT_STOP)
            for k in np.flatnonzero(crossed):
                reached = _first_reach(level[k], phi[k], rate[k], step[k], pull[k])
                share[k] = min(share[k], reached)
        return share

    def _next_break(self, who: Indices) -> Array:
        for sample in who:
            own = self._breaks[sample]
            while own[0] <= self.time[sample] * (1.0 + 1e-13):
                own.pop(0)
                self._restart(int(sample))
        return np.array([self._breaks[sample][0] for sample in who])

    def _judge(self, sample: int) -> None:
        """Locks and ends of a sample that has just taken a step."""
        course, time = self.courses[sample], float(self.time[sample])
        phi, rate = float(self.phi[sample]), float(self.rate[sample])
        if min(abs(phi), abs(phi - self._stowed[sample])) <= AT_STOP:
            self._restart(sample)
        if not self._locked[sample] and phi <= AT_STOP and rate < 0.0:
            self._locked[sample] = True
            course.lock_time = time - phi / rate
            course.status, course.reason = Status.OK, "all V-joints have reached 180 deg"
            self._latched[sample] = self._latches[sample]
            self._settle(sample, course.lock_time)
        elif course.status == Status.UNFINISHED and phi >= self._stowed[sample]:
            course.status = Status.OK
            course.reason = "all V-joints have reached the stowed stop"
            self._settle(sample, time)
        if time >= self._end[sample] * (1.0 - 1e-12):
            self._live[sample] = False
            if course.status == Status.UNFINISHED:
                joints = 2 * self._batch.scenes[sample].structure.sections
                course.reason = (
                    f"solver.end_time = {self._end[sample]:g} s was reached with 0 of "
                    f"{joints} V-joints locked"
                )

    def _settle(self, sample: int, time: float) -> None:
        self._end[sample] = min(self._end[sample], max(time, 0.0) + self._settling[sample])
        self._restart(sample)

    def _count(self, who: Indices, iterations: Array) -> None:
        for sample, number in zip(who, iterations, strict=True):
            course = self.courses[sample]
            course.newton_iterations += int(number)
            course.tries += 1
            if course.tries >= MOST_STEPS:
                self._fail(int(sample), f"it took more than {MOST_STEPS} steps")

    def _give_up(self, sample: int, wound: Array) -> None:
        cause = "the step became too small"
        if self._batch.planes:
            left = self._batch.ropes[sample].content - self._batch.ropes[sample].per_rope(wound[-1])
            if left.min() <= 0.0:
                cause = "a winch has wound up its whole rope (limit its winding law, or stop it)"
        self._fail(sample, cause)

    def _fail(self, sample: int, cause: str) -> None:
        course = self.courses[sample]
        course.status = Status.SOLVER_FAILED
        course.reason = f"the ideal ring's solver gave up at {self.time[sample]:.6g} s: {cause}"
        self._live[sample] = False

    def _file(self, equation: Equation, taken: _Taken) -> None:
        """Sort the steps by sample."""
        if not taken.sample:
            return
        sample = np.concatenate(taken.sample)
        columns = [np.concatenate(parts) for parts in zip(*taken.columns, strict=True)]
        for k, course in enumerate(self.courses):
            rows = np.flatnonzero(sample == k)
            if len(rows):
                own = equation.take(np.array([k]))
                course.pieces.append(Piece(own, *(column[rows] for column in columns)))


def _first_reach(level: float, phi: float, rate: float, step: float, pull: Array) -> float:
    """Share of the step at which the collocation polynomial reaches an angle that it crosses."""
    curve = np.linalg.solve(np.vander(radau.NODES, 3, increasing=True), pull)
    terms = np.array([phi - level, step * rate, *(step**2 * curve / [2.0, 6.0, 12.0])])
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if float(np.polynomial.polynomial.polyval(middle, terms)) * terms[0] > 0.0:
            low = middle
        else:
            high = middle
    return high
