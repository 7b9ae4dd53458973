"""Integrating an ideal ring from its release to its end, by scipy's Radau IIA (order 5, stiff).

A stop is a kink of the equations: a step that meets or leaves one is repeated to end there.
Switching a winch, and every fault, restarts the integration.
"""

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from scipy.integrate import solve_ivp

from ringsim.cable.ropes import Ropes
from ringsim.layout.pose import Array
from ringsim.parts.limits import Limits
from ringsim.scene import Scene
from ringsim.stepping.events import Events
from ringsim.stepping.rest import GROWTH, MOVED, WINDOW, resting
from ringsim.stepping.run_control import TOLD, overstrained
from ringsim.theory.ideal_motion import IdealMotion, IdealState
from ringsim.variables import Cause, Fate, Reason, Status

RELATIVE = 3e-7
"""Local error of a step, relative to every part of the state."""
BEYOND = 1e-10
"""Angle in rad beyond a stop at which it counts as met, and before it as left: above round-off, so
that no step begins with the crossing that ended the one before it."""
MOST_EVALUATIONS = 400_000
"""Evaluations of the equations after which a run is given up."""
MOST_CONTACTS = 1000
"""How often steps end at a stop; beyond, the error control alone resolves the kink."""
_COLLOCATION = np.array([4.0 - math.sqrt(6.0), 4.0 + math.sqrt(6.0)]) / 10.0
"""Points of Radau IIA within a step."""
_ALIKE = 1e-13
_ROUND_OFF = 1e-9
"""Strain below a limit at which it counts as passed: steps end where it is passed."""


@dataclass
class Piece:
    """Steps between two events, while the same ropes and springs (``sprung``) are whole.

    ``times`` and ``states`` are those at the steps' ends, ``rates`` the states' derivatives,
    ``instants`` all that is known there;
    ``inner``, where cables are, times and states at the collocation points within the steps: what
    is stiff is in balance there, and nowhere else between a step's ends.
    """

    latched: bool
    ropes: Ropes | None
    sprung: Array
    times: list[float] = field(default_factory=list)
    states: list[Array] = field(default_factory=list)
    rates: list[Array] = field(default_factory=list)
    instants: list[IdealState] = field(default_factory=list)
    inner: list[tuple[float, Array]] = field(default_factory=list)


@dataclass
class _Crossing:
    """An event of scipy: the first coordinate passes a level."""

    level: float
    terminal: ClassVar = True

    def __call__(self, time: float, state: Array) -> float:
        return float(state[0]) - self.level


@dataclass
class _Strained:
    """An event of scipy: a rope becomes longer than the scene's limit."""

    motion: IdealMotion
    limit: float
    terminal: ClassVar = True
    direction: ClassVar = 1.0

    def __call__(self, time: float, state: Array) -> float:
        return self.motion.instant(time, state).stretch - self.limit


class Course:
    """One run of a scene's ideal ring.

    ``lock_time`` is when the V-joints reached 180 deg, s, NaN if they never did.

    Raises
    ------
    ValueError
        If the cables have no answer at the start.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene, self.motion = scene, IdealMotion(scene)
        self.status, self.fate, self.reason = Status.OK, Fate.NONE, Reason()
        self.lock_time = math.nan
        self.pieces: list[Piece] = []
        self.evaluations, self.jacobians = 0, 0
        self._time, self._state = 0.0, self.motion.start()
        self.motion.instant(self._time, self._state)  # refuses what has no answer at the start
        self._end, self._contacts = scene.solver.end_time, 0
        self._window = WINDOW * scene.solver.end_time
        roped = self.motion.cables is not None
        self._strained = [_Strained(self.motion, scene.limits.rope_strain)] if roped else []
        self._stowed = 0.5 * (math.pi if scene.stop is None else scene.stop.most_folded)

    def run(self) -> "Course":
        """Integrate to the end; never raises."""
        faults = self._scene.faults
        marks = {fault.time for fault in faults} | {*Events(self._scene).times, math.inf}
        try:
            for mark in sorted(marks):
                self.motion.under(until=mark)
                self._begin()
                while self._time < min(mark, self._end) * (1.0 - _ALIKE):
                    # Joints that are not latched are looked at twice a window.
                    look = self._time + 0.5 * self._window if self._unlatched else math.inf
                    self._advance(min(mark, self._end, look))
                    self._judge()
                if self._time >= self._end * (1.0 - _ALIKE):
                    break
                for fault in (fault for fault in faults if fault.time == mark):
                    self._state = self.motion.strike(fault, self._time, self._state)
        except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
            too_long = self.evaluations > MOST_EVALUATIONS
            self.status, self.fate = Status.SOLVER_FAILED, Fate.NONE
            words = f"the ideal ring's solver gave up at {self._time:.6g} s: {error}"
            self.reason = Reason(Cause.STEP_LIMIT if too_long else Cause.NEWTON, words)
        if self._unlatched:
            self.fate = Fate.NOT_LATCHED
        if not self.reason:
            rests = self._rests()
            if not self._unlatched:
                self.fate = Fate.STALLED if rests else Fate.CUT_OFF
            self.reason = Reason(
                text=f"solver.end_time = {self._scene.solver.end_time:g} s was reached with "
                f"{self._missing()}{', at rest' if rests else ''}"
            )
        if self._scene.stop is not None and not self.status.failed:
            self._note_overrun(self._scene.limits)
        return self

    def _rests(self) -> bool:
        """Whether the ring has come to rest; see ``ringsim.stepping.rest``."""
        cables, rate = self.motion.cables, self.motion.mechanism.freedom
        pull = self.motion.instant(self._time, self._state).pull
        if cables is not None and pull is not None and cables.driving(self._time, pull.chain):
            return False
        # From the step's end at or before the window's begin on: a step may be longer than it.
        times = np.concatenate([piece.times for piece in self.pieces])
        states = [state for piece in self.pieces for state in piece.states]
        begun = np.searchsorted(times, self._time - self._window, side="right") - 1
        last = states[begun:]
        moved = max(2.0 * abs(float(state[0] - self._state[0])) for state in last)
        now, then = (abs(float(state[rate])) for state in (self._state, last[0]))
        return moved < MOVED and now**2 <= GROWTH * then**2

    def _note_overrun(self, limits: Limits) -> None:
        """Tell how far the V-joints went past their stops, and whether that was too far."""
        folded = [float(state[0]) for piece in self.pieces for state in piece.states]
        past = 2.0 * max(-min(folded), max(folded) - self._stowed)
        if past > TOLD:
            self.fate = Fate.OVERLOADED if past > limits.farthest else self.fate
            more = "more than " if past > limits.farthest else ""
            self.reason += (
                f"; the V-joints were up to {math.degrees(past):.3g} deg past their stops "
                f"({more}limits.overrun = {limits.overrun:g} deg)"
            )

    def _begin(self) -> None:
        """Open a piece at the present state."""
        cables = self.motion.cables
        ropes = None if cables is None else cables.ropes
        self.pieces.append(Piece(self.motion.latched, ropes, self.motion.forces.springs.alive))
        self._file(self._time, self._state)

    def _file(self, time: float, state: Array) -> None:
        piece = self.pieces[-1]
        piece.instants.append(self.motion.instant(time, state))
        piece.times.append(time)
        piece.states.append(state)
        piece.rates.append(self.motion.rates(time, state))
        self._time, self._state = time, state

    def _file_steps(self, found: Any, count: int) -> None:
        """Add the first steps of a solution to the present piece."""
        for k, curve in enumerate(found.sol.interpolants[:count]):
            if self.motion.cables is not None:
                points = found.t[k] + _COLLOCATION * (found.t[k + 1] - found.t[k])
                self.pieces[-1].inner += [(float(time), curve(time)) for time in points]
            self._file(float(found.t[k + 1]), found.y[:, k + 1].copy())

    def _advance(self, target: float) -> None:
        """Take steps until ``target``, or until a stop is met or left."""
        phi = float(self._state[0])
        stops = [self._stowed] if self.motion.latched else [self._stowed, 0.0]
        levels = [stop + math.copysign(BEYOND, stop - phi) for stop in stops]
        levels = levels if self._contacts < MOST_CONTACTS else []
        found = self._solve(target, levels)
        # Behind the levels comes the strain of ropes, with which the run ends.
        events = (found.t_events or [])[: len(levels)]
        crossed = [k for k, times in enumerate(events) if len(times)]
        if crossed:
            self._contacts += 1
            self._file_steps(found, len(found.t) - 2)
            found = self._solve(float(found.t[-1]), [])
            # The crossing was found on a cubic; the repeated step is far more accurate.
            rates = self.motion.rates(found.t[-1], found.y[:, -1])
            late = (levels[crossed[0]] - found.y[0, -1]) / rates[0]
            if abs(late) < 1e-3 * (found.t[-1] - self._time):
                found.t[-1] += late
                found.y[:, -1] += late * rates
        self._file_steps(found, len(found.t) - 1)
        if found.status < 0:
            raise ValueError(self.motion.refusal or "the step became too small")

    def _solve(self, target: float, levels: list[float]) -> Any:
        self.jacobians += 1
        return solve_ivp(
            self._rates, (self._time, target), self._state, method="Radau", jac=self._jacobian,
            max_step=self._scene.solver.step, rtol=RELATIVE,
            atol=self.motion.tolerances(RELATIVE), dense_output=True,
            events=[*(_Crossing(level) for level in levels), *self._strained],
        )  # fmt: skip

    def _rates(self, time: float, state: Array) -> Array:
        self.evaluations += 1
        if self.evaluations > MOST_EVALUATIONS:
            self.motion.refusal = f"it took more than {MOST_EVALUATIONS} evaluations"
            return np.full(len(state), math.nan)
        return self.motion.rates(time, state)

    def _jacobian(self, time: float, state: Array) -> Array:
        self.jacobians += 1
        return self.motion.jacobian(time, state)

    def _judge(self) -> None:
        if any(event(self._time, self._state) > -_ROUND_OFF for event in self._strained):
            strain = self.motion.instant(self._time, self._state).stretch
            words = overstrained(strain, self._time, self._scene.limits, self._missing())
            self.fate, self.reason, self._end = Fate.OVERLOADED, Reason(text=words), self._time
            return
        phi, rate = float(self._state[0]), float(self._state[self.motion.mechanism.freedom])
        if math.isnan(self.lock_time) and phi <= 0.0 and rate < 0.0:
            self.lock_time = self._time - phi / rate
            self._lock(self.lock_time, -2.0 * rate)
        elif phi <= 0.0 and not self.motion.latched and self._catches(-2.0 * rate):
            self._lock(self._time, -2.0 * rate)
        elif not self.reason and math.isnan(self.lock_time) and phi >= self._stowed:
            self.fate = Fate.FOLDED
            self.reason = Reason(text="all V-joints have reached the stowed stop")
            self._settle(self._time)
        elif self._unlatched and self._time >= self.lock_time + self._window:
            coming = any(fault.time > self._time for fault in self._scene.faults)
            if not coming and self._rests():
                self.fate, self._end = Fate.NOT_LATCHED, self._time
                self.reason = Reason(text=resting(self._missing(), self._window))

    @property
    def _unlatched(self) -> bool:
        """Whether the V-joints have come to their latches, and these have not caught."""
        return math.isfinite(self.lock_time) and not self.reason

    def _missing(self) -> str:
        count = 2 * self._scene.structure.sections
        word = "at 180 deg" if self._unlatched else "locked"
        return f"{0 if math.isnan(self.lock_time) else count} of {count} V-joints {word}"

    def _lock(self, time: float, rate: float) -> None:
        """The V-joints are at 180 deg at a time (s), which they came to at an opening rate (rad/s).

        They have locked, unless there are latches, which have not caught.
        """
        caught, stop = self._catches(rate), self._scene.stop
        if caught or stop is None or not stop.latch:
            self.fate = Fate.DEPLOYED
            self.reason = Reason(text="all V-joints have reached 180 deg")
            self._settle(time)
            self.motion.lock(self._time)
        self.motion.under(latched=caught)
        self._begin()

    def _catches(self, rate: float) -> bool:
        """Whether latches catch that joints meet at an opening rate (rad/s)."""
        stop, latch = self._scene.stop, self._scene.latch
        if stop is None or not stop.latch or rate <= 0.0:
            return False
        return latch is None or rate >= np.max(latch.min_rate)

    def _settle(self, time: float) -> None:
        settling = 0.0 if self._scene.stop is None else self._scene.solver.settling_time
        self._end = min(self._end, max(time, 0.0) + settling)
