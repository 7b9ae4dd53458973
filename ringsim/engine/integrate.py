"""Integrating a built model: generalised-alpha with a step that follows the motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.section_path import path_slope
from ringsim.cable.state import ChainState
from ringsim.engine.build import Built
from ringsim.engine.energy import Energies, EnergyMeter
from ringsim.engine.joints import latch
from ringsim.engine.predictor import Predictor
from ringsim.engine.readings import JointGroup, Openings, State
from ringsim.engine.scales import contact_step, residual_tolerance, usual_rate
from ringsim.engine.settings import solver_settings
from ringsim.engine.stepping import StepControl, StopContact
from ringsim.engine.stress import StressMeter
from ringsim.variables import Status

Array = NDArray[np.float64]
_NEAR = 0.1
"""A locked V-joint counts as resting on its stop within this angle of it, rad."""


@dataclass
class History:
    """What was read at every accepted step; lists of equal length.

    Attributes
    ----------
    angles, rates
        Opening angles and rates, rad and rad/s, shape (2, sections) each.
    gaps
        Largest joint gap, m.
    stresses
        Shape (8, sections) each, Pa; empty unless recorded.
    tensions, slack, wound
        Tension of every span of all cables behind one another (N), whether each cable is
        slack at its winch, and the rope that its winches have wound (m); empty without cables.

    """

    times: list[float] = field(default_factory=list)
    angles: list[Array] = field(default_factory=list)
    rates: list[Array] = field(default_factory=list)
    energies: list[Energies] = field(default_factory=list)
    gaps: list[float] = field(default_factory=list)
    stresses: list[Array] = field(default_factory=list)
    tensions: list[Array] = field(default_factory=list)
    slack: list[Array] = field(default_factory=list)
    wound: list[Array] = field(default_factory=list)
    status: Status = Status.UNFINISHED
    reason: str = ""
    newton_iterations: int = 0
    jacobians: int = 0
    halvings: int = 0


class Integration:
    """One run of a built model."""

    def __init__(self, built: Built) -> None:
        ring, scene = built.ring, built.ring.scene
        self._built, self._scene = built, scene
        self._system = ring.assembly.system
        self._solver = exu.MainSolverImplicitSecondOrder()
        self._settings = solver_settings(scene, residual_tolerance(built))
        self._state = State(ring)
        self._openings = Openings(ring)
        self._energy = EnergyMeter(ring, built.net, built.forces)
        self._stress = StressMeter(ring) if scene.record.stress else None
        families = {joint.family for joint in ring.joints}
        self._gaps = [
            JointGroup(ring, [j for j in ring.joints if j.family == family])
            for family in sorted(families)
        ]
        sections = ring.geometry.sections
        self._latched = np.zeros((2, sections), dtype=bool)
        self._locked = np.zeros((2, sections), dtype=bool)
        self._settled_at = math.inf
        self._steps = StepControl(
            scene.solver,
            contact_step(built),
            usual_rate=usual_rate(scene),
        )
        self._fresh = True
        self._chain: ChainState | None = None
        self.history = History()

    def run(self) -> History:
        """Integrate until all V-joints have locked and settled, or to the end time."""
        history, solver, ring = self.history, self._solver, self._built.ring
        solver.SetUserFunctionUpdateCurrentTime(self._system, self._update_time)
        self._system.SetPostStepUserFunction(self._after_step)
        self._system.SetPreNewtonResidualUserFunction(Predictor(ring.assembly, solver).apply)
        self._read(0.0)
        try:
            if solver.InitializeSolver(self._system, self._settings):
                solver.SolveSteps(self._system, self._settings)
        except exu.ExudynError as error:
            if math.isfinite(self._settled_at):
                history.reason += f"; settling was cut short at {history.times[-1]:.6g} s"
            elif history.status != Status.DIVERGED:
                history.status = Status.SOLVER_FAILED
                history.reason = self._explain(error)
        if history.status == Status.UNFINISHED and not history.reason:
            history.status = Status.SOLVER_FAILED  # exudyn may give up without raising
            history.reason = self._explain(RuntimeError("it stopped before the end"))
        history.newton_iterations = int(solver.it.newtonStepsCount)
        history.jacobians = int(solver.it.newtonJacobiCount)
        return history

    def _path_slopes(self) -> Array:
        """Derivative of each cable's ideal path length after the opening angle, m/rad."""
        cables = self._scene.cables
        if cables is None:
            return np.zeros(0)
        ring = self._scene.structure
        angles = self.history.angles[-1]
        return np.array(
            [
                float(np.sum(path_slope(ring.half_bar, cable.block_offset, angles[plane])))
                for plane, cable in cables.present()
            ]
        )

    def _update_time(self, solver: Any, system: Any, settings: Any) -> None:
        """Set the step: the one chosen after the last step, or the reduced one of a retry."""
        if self._fresh:
            now = self.history.times[-1]
            left = min(self._scene.solver.end_time, self._built.faults.next_time) - now
            step = min(self._steps.step, left)
            solver.it.currentStepSize = step
            self._fresh = False
            if self._built.cables is not None and self._chain is not None:
                self._built.cables.advance(now, step, self._chain, self._path_slopes())
        else:
            self.history.halvings += 1
            self._steps.step = solver.it.currentStepSize
        solver.it.currentTime = solver.it.currentTime + solver.it.currentStepSize
        system.systemData.SetTime(solver.it.currentTime, exu.ConfigurationType.Current)

    def _after_step(self, system: Any, time: float) -> bool:
        """Read the new state; False ends the run."""
        if time <= self.history.times[-1]:
            return True
        self._fresh = True
        if not self._read(time):
            return False
        angles, rates = self.history.angles[-1], self.history.rates[-1]
        self._note_locks(angles, time)
        if time >= self._settled_at or self._finished(time) or self._exhausted(time):
            return False
        self._steps.advance(time, float(np.mean(rates)), self._stop_contact(angles, rates))
        return True

    def _read(self, time: float) -> bool:
        history, state = self.history, self._state
        state.refresh()
        if not state.finite():
            history.status = Status.DIVERGED
            history.reason = (
                f"the state is not finite at {time:.6g} s: reduce solver.step or solver.tolerance"
            )
            return False
        angles, rates = self._openings.read(state)
        history.times.append(time)
        history.angles.append(angles)
        history.rates.append(rates)
        chain = self._read_cables(time)
        reading = self._energy.read(time, state, angles, rates, self._latched, chain)
        if self._built.faults.strike(time, angles, chain):
            chain = self._read_cables(time)
            after = self._energy.read(time, state, angles, rates, self._latched, chain)
            # What a fault lets go is lost; nothing moves while it strikes.
            released = reading.elastic - after.elastic
            reading = after._replace(lost=reading.lost + released, driven=reading.driven)
        history.energies.append(reading)
        if chain is not None:
            history.tensions.append(chain.tensions)
            history.slack.append(chain.is_slack[chain.ropes.first].astype(float))
            history.wound.append(chain.wound.sum(axis=1))
            self._chain = chain
        history.gaps.append(max(float(group.gaps(state).max()) for group in self._gaps))
        if self._stress is not None:
            history.stresses.append(self._stress.read())
        return True

    def _read_cables(self, time: float) -> ChainState | None:
        cables = self._built.cables
        if cables is None:
            return None
        return cables.current(self._state.position, self._state.velocity, time)

    def _note_locks(self, angles: Array, time: float) -> None:
        stop, history = self._scene.stop, self.history
        deployed = angles >= math.pi
        fresh = deployed & ~self._locked
        self._locked |= deployed
        if stop is not None and stop.latch:
            for plane, section in np.argwhere(fresh):
                latch(self._built.ring, self._built.stops[plane][section])
                self._latched[plane, section] = True
        if math.isfinite(self._settled_at):
            return
        settling = self._scene.solver.settling_time if stop is not None else 0.0
        stowed = 0.0 if stop is None else math.radians(stop.stowed_angle)
        if self._locked.all():
            history.status, history.reason = Status.OK, "all V-joints have reached 180 deg"
            self._settled_at = time + settling
        elif np.all(angles <= stowed):
            history.status = Status.OK
            history.reason = "all V-joints have reached the stowed stop"
            self._settled_at = time + settling

    def _finished(self, time: float) -> bool:
        end = self._scene.solver.end_time
        if time < end * (1.0 - 1e-12):
            return False
        if self.history.status == Status.UNFINISHED:
            locked = int(self._locked.sum())
            self.history.reason = (
                f"solver.end_time = {end:g} s was reached with {locked} of "
                f"{self._locked.size} V-joints locked"
            )
        return True

    def _exhausted(self, time: float) -> bool:
        """Give up a run whose steps have become too small to end."""
        most = self._scene.solver.step_limit
        if len(self.history.times) <= most:
            return False
        if math.isfinite(self._settled_at):
            self.history.reason += f"; settling was cut short at {time:.6g} s"
            return True
        self.history.status = Status.SOLVER_FAILED
        self.history.reason = (
            f"solver.step_limit = {most} steps took the run to {time:.6g} s only, the last of "
            f"{time - self.history.times[-2]:.1e} s: raise solver.tolerance or solver.step_limit"
        )
        return True

    def _stop_contact(self, angles: Array, rates: Array) -> StopContact:
        """V-joints that are about to meet a stop, and those that rest on one."""
        stop = self._scene.stop
        stowed = 0.0 if stop is None else math.radians(stop.stowed_angle)
        with np.errstate(divide="ignore", invalid="ignore"):
            opening = np.where((rates > 0.0) & ~self._locked, (math.pi - angles) / rates, math.inf)
            folding = np.where(
                (rates < 0.0) & (angles > stowed), (stowed - angles) / rates, math.inf
            )
        waiting = np.minimum(opening, folding)
        first = np.unravel_index(int(np.argmin(waiting)), waiting.shape)
        resting = self._locked & (angles > math.pi - _NEAR)
        return StopContact(
            time_to_next=float(waiting[first]),
            rate_of_next=float(abs(rates[first])),
            resting_rate=float(np.max(np.abs(rates), where=resting, initial=0.0)),
        )

    def _explain(self, error: Exception) -> str:
        time = self.history.times[-1]
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        detail = next((line for line in lines if "step" in line.lower()), lines[0] if lines else "")
        return (
            f"the solver gave up at {time:.6g} s after {self.history.halvings} reductions of the "
            f"step: reduce solver.step or solver.tolerance, or raise solver.newton_tolerance "
            f"({self._refusal() or detail[:200]})"
        )

    def _refusal(self) -> str:
        """What the cables could not answer, if that is why a step failed."""
        cables = self._built.cables
        return "" if cables is None else cables.refusal
