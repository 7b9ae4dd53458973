"""Integrating a built model: generalised-alpha with a step that follows the motion."""

from __future__ import annotations

import math
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.state import ChainState
from ringsim.engine.build import Built
from ringsim.engine.closing import close
from ringsim.engine.deviation_steps import deviation_steps
from ringsim.engine.energy import EnergyMeter
from ringsim.engine.guard import Guard
from ringsim.engine.locks import Locks
from ringsim.engine.predictor import Predictor
from ringsim.engine.readings import JointGroup, Openings, State
from ringsim.engine.scales import (
    contact_step,
    residual_tolerance,
    rope_step,
    usual_energy,
    usual_rate,
)
from ringsim.engine.settings import raise_own, solver_settings
from ringsim.engine.step_judge import Reading, StepJudge
from ringsim.engine.stepping import StepControl
from ringsim.engine.stress import StressMeter
from ringsim.outputs.instant import Energies, Instant
from ringsim.outputs.recorder import History, Recorder
from ringsim.outputs.series import lock_times
from ringsim.variables import Cause, Reason, Status

Array = NDArray[np.float64]
_REFUSE = 10.0
"""Error that makes exudyn repeat a step; its tolerance is 1."""


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
        self._energy = EnergyMeter(ring, built.net, built.forces, built.faults)
        self._stress = StressMeter(ring) if scene.record.stress else None
        families = {joint.family for joint in ring.joints}
        self._gaps = [
            JointGroup(ring, [j for j in ring.joints if j.family == family])
            for family in sorted(families)
        ]
        self._state.refresh()
        self._locks = Locks(built, self._openings.read(self._state)[0])
        self._settled_at = math.inf
        self._steps = StepControl(
            scene.solver, contact_step(built), usual_rate(scene), rope_step(built)
        )
        constant = scene.solver.step_control == "constant"
        self._judge = None if constant else StepJudge(built)
        self._deviations = deviation_steps(scene)
        bend = math.inf
        if constant and built.cables is not None:
            bend = max(cable.slack_width for cable in built.cables.chain.cables)
        self._guard = Guard(scene.solver, usual_energy(scene), scene.structure.half_bar, bend)
        self._fresh = True
        self._weighed: Reading | None = None
        self._shorter: float | None = None
        self._chain: ChainState | None = None
        self.recorder = Recorder(scene)
        self.history = self.recorder.history

    def run(self) -> History:
        """Integrate until all V-joints have locked and settled, or to the end time."""
        history, solver, ring = self.history, self._solver, self._built.ring
        solver.SetUserFunctionUpdateCurrentTime(self._system, self._update_time)
        self._system.SetPostStepUserFunction(self._after_step)
        self._system.SetPreNewtonResidualUserFunction(Predictor(ring.assembly, solver).apply)
        if self._judge is not None:
            self._settings.timeIntegration.discontinuous.ignoreMaxIterations = False
            self._system.SetPostNewtonUserFunction(self._weigh)
        self._read(0.0)
        try:
            if solver.InitializeSolver(self._system, self._settings):
                solver.SolveSteps(self._system, self._settings)
        except exu.ExudynError as error:
            raise_own(error, self._refusal())
            if math.isfinite(self._settled_at):
                history.reason += f"; settling was cut short at {history.times[-1]:.6g} s"
            elif history.status != Status.DIVERGED:
                history.end(Status.SOLVER_FAILED, self._explain(error))
        if history.status == Status.UNFINISHED and not history.reason:
            # exudyn may give up without raising
            stopped = RuntimeError("it stopped before the end")
            history.end(Status.SOLVER_FAILED, self._explain(stopped))
        self._guard.conclude(history)
        history.reason += self._judge.note() if self._judge is not None else ""
        history.reason += self._energy.note()
        close(history, self._system, solver)
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
                float(np.sum(cable.path_slope(ring.half_bar, angles[plane])))
                for plane, cable in cables.present()
            ]
        )

    def _update_time(self, solver: Any, system: Any, settings: Any) -> None:
        """Set the step: the one chosen after the last step, or the reduced one of a retry."""
        if self._fresh:
            now = self.history.times[-1]
            if self._judge is not None:
                self._judge.locked = math.isfinite(self._settled_at)
                self._steps.step = min(self._steps.step, self._judge.limit)
            ends = (self._scene.solver.end_time, self._built.faults.next_time, self._settled_at)
            step = self._steps.towards(min(ends) - now)
            solver.it.currentStepSize = step
            self._fresh = False
            if self._built.cables is not None and self._chain is not None:
                self._built.cables.advance(now, step, self._chain, self._path_slopes())
        else:
            self.history.halvings += 1
            if self._shorter is not None:
                solver.it.currentStepSize = self._shorter
            self._steps.step = solver.it.currentStepSize
        self._weighed = self._shorter = None
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
        self._locks.note(angles)
        self._note_end(time)
        if time >= self._settled_at or self._finished(time) or self._exhausted(time):
            return False
        self._steps.advance(time, float(np.mean(rates)), self._locks.contact(angles, rates))
        if self._deviations is not None and not self._locks.deployed.any():
            self._steps.step = min(self._steps.step, self._deviations.limit(time, angles, rates))
        return True

    def _weigh(self, system: Any, time: float) -> list[float]:
        """Have exudyn repeat a step that has converged to a state that lacks energy."""
        before, judge = self.history.times[-1], self._judge
        if time > before and self._weighed is None and judge is not None:
            found = self._weighed = self._measure(time)
            if found is not None:
                self._shorter = judge.shorter(self.history, found) or self._steps.shorter_first(
                    time - before, self._locks.contact(found.angles, found.rates)
                )
        return [0.0 if self._shorter is None else _REFUSE, -1.0]

    def _measure(self, time: float) -> Reading | None:
        """The current state; None if it is not finite."""
        self._state.refresh()
        if not self._state.finite():
            return None
        angles, rates = self._openings.read(self._state)
        chain = self._read_cables(time)
        return Reading(time, angles, rates, self._energies(time, angles, rates, chain), chain)

    def _energies(
        self, time: float, angles: Array, rates: Array, chain: ChainState | None
    ) -> Energies:
        return self._energy.read(time, self._state, angles, rates, self._locks.latched, chain)

    def _read(self, time: float) -> bool:
        history = self.history
        found = self._weighed or self._measure(time)
        if found is None:
            reason = (
                f"the state is not finite at {time:.6g} s: reduce solver.step or solver.tolerance"
            )
            history.end(Status.DIVERGED, Reason(Cause.NOT_FINITE, reason))
            return False
        _, angles, rates, energies, chain = found
        if self._judge is not None and history.times:
            self._judge.accept(history, found)
        if self._built.faults.strike(time, angles, chain):
            chain = self._read_cables(time)
            after = self._energies(time, angles, rates, chain)
            # What a fault lets go is lost; nothing moves while it strikes.
            released = energies.elastic - after.elastic
            energies = after._replace(lost=energies.lost + released, driven=energies.driven)
        self._energy.keep()
        self._chain, cables = chain, self._built.cables
        self.recorder.note(
            Instant(
                time,
                angles,
                rates,
                energies,
                gap=max(float(group.gaps(self._state).max()) for group in self._gaps),
                latched=self._locks.latched.copy(),
                chain=chain,
                planes=() if cables is None else tuple((plane,) for plane in cables.planes),
                stress=None if self._stress is None else self._stress.read(),
            )
        )
        return not self._guard.stops(history, self._locks.overrun(angles), float(angles.max()))

    def _read_cables(self, time: float) -> ChainState | None:
        cables = self._built.cables
        if cables is None:
            return None
        return cables.current(self._state.position, self._state.velocity, time)

    def _note_end(self, time: float) -> None:
        """Let the run end once all V-joints have reached the same stop."""
        if math.isfinite(self._settled_at):
            return
        for reached, where in (
            (self._locks.deployed, "180 deg"),
            (self._locks.stowed, "the stowed stop"),
        ):
            if reached.all():
                self.history.status = Status.OK
                self.history.reason = f"all V-joints have reached {where}"
                settling = self._scene.solver.settling_time
                last = self._last_lock(time) + (0.0 if self._scene.stop is None else settling)
                self._settled_at = last if last > time * (1.0 + 1e-12) else time
                return

    def _last_lock(self, time: float) -> float:
        """When the last V-joint reached 180 deg within the step that ends at ``time``, s.

        Settling counts from there: what happens after it must not depend on where steps end.
        """
        history = self.history
        two = (np.array(part[-2:]) for part in (history.times, history.angles, history.rates))
        locks = lock_times(*two)
        return float(np.nanmax(locks)) if np.isfinite(locks).any() else time

    def _finished(self, time: float) -> bool:
        end = self._scene.solver.end_time
        if time < end * (1.0 - 1e-12):
            return False
        if self.history.status == Status.UNFINISHED:
            locked = int(self._locks.deployed.sum())
            self.history.end(
                Status.UNFINISHED,
                Reason(
                    Cause.END_TIME,
                    f"solver.end_time = {end:g} s was reached with {locked} of "
                    f"{self._locks.deployed.size} V-joints locked",
                ),
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
        reason = (
            f"solver.step_limit = {most} steps took the run to {time:.6g} s only, the last of "
            f"{time - self.history.times[-2]:.1e} s: raise solver.tolerance or solver.step_limit"
        )
        self.history.end(Status.SOLVER_FAILED, Reason(Cause.STEP_LIMIT, reason))
        return True

    def _explain(self, error: Exception) -> Reason:
        time = self.history.times[-1]
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        detail = next((line for line in lines if "step" in line.lower()), lines[0] if lines else "")
        return Reason(
            Cause.NEWTON,
            f"the solver gave up at {time:.6g} s after {self.history.halvings} reductions of the "
            f"step: reduce solver.step or solver.tolerance, or raise solver.newton_tolerance "
            f"({self._refusal() or detail[:200]})",
        )

    def _refusal(self) -> str:
        """What the cables could not answer, if that is why a step failed."""
        cables = self._built.cables
        return "" if cables is None else cables.refusal
