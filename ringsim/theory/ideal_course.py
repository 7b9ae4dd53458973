"""Integrating an ideal ring from its release to its end.

Steps are those of scipy's Radau IIA (order 5, for stiff equations).  A stop is a kink of the
equations: a step that meets or leaves one is repeated to end there.  Switching a winch, and
every fault, restarts the integration.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import Radau
from scipy.interpolate import BPoly
from scipy.optimize import brentq

from ringsim.cable.ropes import Ropes
from ringsim.scene import Scene
from ringsim.theory.ideal_motion import IdealMotion
from ringsim.variables import Cause, Status

Array = NDArray[np.float64]

RELATIVE = 3e-7
"""Local error of a step, relative to every part of the state."""
AT_STOP = 1e-10
"""Angle in rad within which a stop counts as met."""
MOST_EVALUATIONS = 400_000
"""Evaluations of the equations after which a run is given up."""
MOST_CONTACTS = 1000
"""How often steps end at a stop; beyond, the error control alone resolves the kink."""
_COLLOCATION = np.array([4.0 - math.sqrt(6.0), 4.0 + math.sqrt(6.0)]) / 10.0
"""Points of Radau IIA within a step."""
_LOOKS = np.linspace(0.0, 1.0, 17)
_ALIKE = 1e-13


@dataclass
class Piece:
    """Steps between two events, with their latches and ropes.

    Attributes
    ----------
    times, states, rates
        Beginning and end of every step, the states there and their derivatives.
    inner
        Times and states at the collocation points within the steps, where cables are: what is
        stiff is in balance there, and nowhere else between a step's ends.
    """

    latched: bool
    ropes: Ropes | None
    times: list[float] = field(default_factory=list)
    states: list[Array] = field(default_factory=list)
    rates: list[Array] = field(default_factory=list)
    inner: list[tuple[float, Array]] = field(default_factory=list)


@dataclass
class Course:
    """Result of a run.

    Attributes
    ----------
    lock_time
        When the V-joints reached 180 deg, s; NaN if they never did.
    pieces
        Each begins in time where the one before it ends.
    evaluations, jacobians
        Of the equations.
    """

    motion: IdealMotion
    status: Status = Status.UNFINISHED
    reason: str = ""
    cause: Cause = Cause.NONE
    lock_time: float = math.nan
    pieces: list[Piece] = field(default_factory=list)
    evaluations: int = 0
    jacobians: int = 0


class _TooLongError(Exception):
    """The run takes too many evaluations."""


class Integration:
    """One run of a scene's ideal ring."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._motion = scene, IdealMotion(scene)
        self.course = Course(self._motion)
        self._time, self._state = 0.0, self._motion.start()
        self._end, self._contacts = scene.solver.end_time, 0
        stowed = 0.0 if scene.stop is None else scene.stop.stowed_angle
        self._stowed = 0.5 * (math.pi - math.radians(stowed))
        self._piece = Piece(False, None)

    def run(self) -> Course:
        """Integrate to the end; never raises."""
        faults = sorted(self._scene.faults, key=lambda fault: fault.time)
        cables = self._motion.cables
        breaks = [] if cables is None else cables.breaks
        marks = sorted({fault.time for fault in faults} | {*breaks, math.inf})
        try:
            for mark in marks:
                self._until(mark)
                over = self._time >= self._end * (1.0 - _ALIKE)
                if over or self.course.status.failed:
                    break
                for fault in (fault for fault in faults if fault.time == mark):
                    self._state = self._motion.strike(fault, self._time, self._state)
        except _TooLongError:
            self._fail(f"it took more than {MOST_EVALUATIONS} evaluations", Cause.STEP_LIMIT)
        except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:
            self._fail(str(error))
        if self.course.status == Status.UNFINISHED:
            joints = 2 * self._scene.structure.sections
            self.course.cause = Cause.END_TIME
            self.course.reason = (
                f"solver.end_time = {self._scene.solver.end_time:g} s was reached with 0 of "
                f"{joints} V-joints locked"
            )
        return self.course

    def _until(self, mark: float) -> None:
        self._motion.until = mark
        self._begin()
        while self._time < min(mark, self._end) * (1.0 - _ALIKE):
            if not self._go_on(min(mark, self._end)):
                return

    def _begin(self) -> None:
        """Open a piece at the present state."""
        cables = self._motion.cables
        self._piece = Piece(self._motion.latched, None if cables is None else cables.ropes)
        self.course.pieces.append(self._piece)
        self._file(self._time, self._state, self._rates(self._time, self._state))

    def _file(self, time: float, state: Array, rates: Array) -> None:
        self._piece.times.append(time)
        self._piece.states.append(state)
        self._piece.rates.append(rates)
        self._time, self._state = time, state

    def _file_step(self, solver: Radau) -> None:
        if self._motion.cables is not None:
            begin, curve = self._time, solver.dense_output()
            points = begin + _COLLOCATION * (solver.t - begin)
            self._piece.inner += [(float(time), curve(time)) for time in points]
        self._file(float(solver.t), solver.y.copy(), solver.f.copy())

    def _go_on(self, target: float) -> bool:
        """Take steps until ``target``, an event, or a failure; whether there is more to do."""
        solver = self._solver(target)
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                self._fail(self._motion.refusal or self._cause())
                return False
            contact = self._contact(solver)
            if contact is None:
                self._file_step(solver)
            else:
                self._reach(*contact)
            if self._judge():
                self._begin()
                return True
            if contact is not None:
                return True
        return True

    def _solver(self, target: float) -> Radau:
        self.course.jacobians += 1

        def jacobian(time: float, state: Array) -> Array:
            self.course.jacobians += 1
            return self._motion.jacobian(time, state)

        return Radau(
            self._rates, self._time, self._state, target, max_step=self._scene.solver.step,
            rtol=RELATIVE, atol=self._motion.tolerances(RELATIVE), jac=jacobian,
        )  # fmt: skip

    def _rates(self, time: float, state: Array) -> Array:
        self.course.evaluations += 1
        if self.course.evaluations > MOST_EVALUATIONS:
            raise _TooLongError
        return self._motion.rates(time, state)

    def _contact(self, solver: Radau) -> tuple[float, float] | None:
        """Time at which the step just taken first meets or leaves a stop, and that stop's phi."""
        if self._contacts >= MOST_CONTACTS:
            return None
        turn = self._motion.rate_of_phi
        curve = quintic(
            np.array([self._time, solver.t]),
            np.array([self._state, solver.y])[:, [0, turn]],
            np.array([self._piece.rates[-1], solver.f])[:, turn],
        )
        places = self._time + _LOOKS * (solver.t - self._time)
        found = []
        for level in (0.0, self._stowed):
            if level == 0.0 and self._motion.latched:
                continue
            above = curve(places) - level
            above[0] = above[0] if abs(above[0]) > AT_STOP else self._state[turn]
            crossed = np.flatnonzero((above[:-1] * above[1:] < 0.0) & (np.abs(above[1:]) > AT_STOP))
            crossed = crossed[(crossed > 0) | (abs(curve(places[0]) - level) > AT_STOP)]
            if len(crossed):
                begin, finish = places[crossed[0]], places[crossed[0] + 1]
                found.append((float(brentq(partial(_above, curve, level), begin, finish)), level))
        return min(found, default=None)

    def _reach(self, time: float, level: float) -> None:
        """Step to the instant at which phi is at ``level``, met near ``time``."""
        self._contacts += 1
        solver = self._solver(time)
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                raise ValueError("the step became too small at a stop")
            self._file_step(solver)
        self._state[0] = level if abs(self._state[0] - level) < 1e-6 else self._state[0]

    def _judge(self) -> bool:
        """Locks and ends; whether the equations change."""
        course, state = self.course, self._state
        phi, rate = float(state[0]), float(state[self._motion.rate_of_phi])
        stop = self._scene.stop
        if math.isnan(course.lock_time) and phi <= AT_STOP and rate < 0.0:
            course.lock_time = self._time - phi / rate
            course.status, course.reason = Status.OK, "all V-joints have reached 180 deg"
            self._motion.latched = stop is not None and stop.latch
            self._settle(course.lock_time)
            return self._motion.latched
        if course.status == Status.UNFINISHED and phi >= self._stowed - AT_STOP:
            course.status = Status.OK
            course.reason = "all V-joints have reached the stowed stop"
            self._settle(self._time)
        return False

    def _settle(self, time: float) -> None:
        settling = 0.0 if self._scene.stop is None else self._scene.solver.settling_time
        self._end = min(self._end, max(time, 0.0) + settling)

    def _cause(self) -> str:
        """Why steps became too small: a rope at twice its natural length has been wound up."""
        pull = self._motion.instant(self._time, self._state).pull
        if pull is not None and pull.chain.strains.max() > 1.0:
            return "a winch has wound up its whole rope (limit its winding law, or stop it)"
        return "the step became too small"

    def _fail(self, why: str, cause: Cause = Cause.NEWTON) -> None:
        self.course.status, self.course.cause = Status.SOLVER_FAILED, cause
        self.course.reason = f"the ideal ring's solver gave up at {self._time:.6g} s: {why}"


def _above(curve: BPoly, level: float, time: float) -> float:
    return float(curve(time)) - level


def quintic(times: Array, values: Array, bends: Array) -> BPoly:
    """Curve through values with their first two derivatives at times.

    Parameters
    ----------
    times
        Shape (n,).
    values
        Value and first derivative, shape (n, 2, ...).
    bends
        Second derivative, shape (n, ...).
    """
    known = np.concatenate([values, np.expand_dims(bends, 1)], axis=1)
    return BPoly.from_derivatives(times, known)
