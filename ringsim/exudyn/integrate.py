"""Integrating a built model with exudyn's generalised-alpha; ``ringsim.stepping`` decides on the
steps.
"""

import math
from typing import Any

import exudyn as exu
import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.exudyn.assembly import STIFFENING, Predictor
from ringsim.exudyn.build import Built, build
from ringsim.exudyn.laws import AngleForces
from ringsim.exudyn.meters import EnergyMeter, FullMeters
from ringsim.exudyn.model import Openings, State, joint_groups
from ringsim.layout.layout import Layout
from ringsim.outputs.meters import Reading
from ringsim.outputs.recorder import Recorder
from ringsim.rigid.statics import RopeReach, residual_tolerance, scales_of
from ringsim.scene import Scene
from ringsim.stepping.instant import Instant, Strained, Watch
from ringsim.stepping.run import Run
from ringsim.variables import Cause, Outcome, Reason

# When exudyn's modified Newton renews its Jacobian within a step, and when it gives up.
#
# exudyn renews where the residual does not halve, but never before the third iteration; where the
# residual doubles, or after eight iterations, it begins the step anew, without its extrapolated
# start, and renews the Jacobian in every iteration from then on.  Stops, and dry friction that
# turns round, let a residual grow by much more on the way to a solution.  So here
#
# - any iteration, the first ones included, renews the Jacobian where the residual falls too little,
#   and each does from the ninth on;
# - growth is no reason to begin anew, but for that of a run-away, by ``_RUNAWAY`` in an iteration:
#   there the step is given up, and repeated with a shorter one;
# - the second iteration has a Jacobian of its own where that of the start is worth nothing.  The
#   extrapolated start strains the rods; one that carries a force F by mistake is as if it had a
#   lateral stiffness F / L, which must not rule over its inertia m / h^2.
#
# exudyn offers no settings for this, but its solver's counters can be written before a residual.


_EXEMPT = 2
"""Iterations in which exudyn does not look at the residual's fall."""
_RUNAWAY = 1e6
_ROUGH = 30.0
"""Start's residual over that at which mistaken forces and inertia are alike.  1 renews Jacobians
for nothing (490 for 344 on ring18), 1e9 leaves them where a ring of 6 that stalls wants new ones.
"""


class Newton:
    """Newton's iterations of the steps of one run."""

    iterations = 25
    """Most iterations of a step."""
    fall = 0.6
    """Share of the last residual above which the Jacobian is renewed."""
    patience = 8
    """Iterations after which it is renewed in any case."""

    def __init__(self, solver: Any, layout: Layout) -> None:
        self._solver, self._count = solver, 0
        # The residual of a step's start is a norm over all rods, and so is this, kg m.
        self._rough = _ROUGH * float(np.linalg.norm([rod.mass * rod.length for rod in layout.rods]))

    @classmethod
    def configure(cls, newton: Any) -> None:
        """Settings of exudyn's that leave these decisions to an object of this class."""
        newton.useModifiedNewton = True
        newton.modifiedNewtonJacUpdatePerStep = True
        newton.maxIterations = newton.maxModifiedNewtonIterations = cls.iterations + _EXEMPT
        # exudyn's own limit for beginning anew is a growth by 2, of what stands in lastResidual.
        newton.modifiedNewtonContractivity = cls.fall / _RUNAWAY

    def apply(self) -> None:
        """Due before every residual."""
        now, found = self._solver.it, self._solver.conv
        if now.newtonSteps == 1:
            now.newtonSteps += _EXEMPT
            if found.residual * now.currentStepSize**2 > self._rough:
                found.jacobianUpdateRequested = True
        elif 0 < now.newtonSteps == self._count:
            found.stopNewton = True  # exudyn begins anew
        if now.newtonSteps > self.patience + _EXEMPT:
            found.jacobianUpdateRequested = True
        if now.newtonSteps > 0:
            found.lastResidual = found.lastResidual * _RUNAWAY
        self._count = now.newtonSteps


# Settings of exudyn's solver.


def solver_settings(scene: Scene, tolerance: float) -> Any:
    """Generalised-alpha with modified Newton, which stops at a residual norm ``tolerance`` (N); the
    step is set by a user function.
    """
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
    time = settings.timeIntegration
    time.verboseMode = 0
    time.endTime = scene.solver.end_time
    time.numberOfSteps = 1
    time.adaptiveStep = True
    time.adaptiveStepRecoverySteps = 10**6
    time.minimumStepSize = 1e-9
    time.generalizedAlpha.spectralRadius = scene.solver.spectral_radius
    time.generalizedAlpha.computeInitialAccelerations = False
    time.generalizedAlpha.resetAccelerations = False
    Newton.configure(time.newton)
    time.newton.relativeTolerance = 1e-14
    time.newton.absoluteTolerance = tolerance
    return settings


def newton_norm(built: Built) -> float:
    """Residual norm in N at which Newton stops; see ``residual_tolerance``."""
    scene, layout = built.model.scene, built.model.layout
    size = built.model.assembly.system.systemData.ODE2Size()
    rounded = 4.0 * float(np.finfo(float).eps)
    reached = rounded * math.sqrt(size)
    if scene.rods.damping > 0.0:
        reached *= STIFFENING
    return max(residual_tolerance(scene, layout, reached), rounded * RopeReach(scene).at(0.0))


# Integrating a built model with exudyn's generalised-alpha; ``ringsim.stepping`` decides on the
# steps and on the end.


_REFUSE = 10.0
"""Error that makes exudyn repeat a step; its tolerance is 1."""


def solve(scene: Scene, watch: Watch | None = None) -> Outcome:
    """Run a scene.  A solve that fails is a status, not an exception."""
    built = build(scene)
    history = Integration(built, watch).run()
    built.model.assembly.container.Reset()
    return history.outcome()


class Integration(Run):
    """One run of a built model."""

    _energy: EnergyMeter

    def __init__(self, built: Built, watch: Watch | None = None) -> None:
        model, scene = built.model, built.model.scene
        super().__init__(scene, watch)
        self._built, self.model, self._cables = built, model, built.cables
        self._system = model.assembly.system
        self._solver = exu.MainSolverImplicitSecondOrder()
        self._settings = solver_settings(scene, newton_norm(built))
        self._now = State(model)
        self._openings = Openings(model)
        self._energy = EnergyMeter(built)
        self._readings = FullMeters(built, self._now)
        self._gaps = joint_groups(model)
        self._fresh, self._refused = True, False
        self._weighed: Instant | None = None
        self._chain: ChainState | None = None
        self._raised: BaseException | None = None
        self.history = Recorder(scene, self._readings.coordinates(), model.layout)
        ropes = None if built.cables is None else built.cables.ropes.content
        self._set_out(
            self._measured(0.0),
            scales_of(scene, model.layout, model.ideal, ropes),
            Strained(self._energy.strain_energy(), model.prestress),
        )

    @property
    def state(self) -> State:
        """See ``Run``."""
        return self._now

    @property
    def _at(self) -> ChainState | None:
        """See ``Run``: of the state that was measured last."""
        return self._chain

    @property
    def _laws(self) -> AngleForces:
        """See ``Run``."""
        return self._built.angles

    def run(self) -> Recorder:
        """Integrate until all V-joints have locked and settled, or to the end time."""
        solver, control, system = self._solver, self._control, self._system
        solver.SetUserFunctionUpdateCurrentTime(system, self._update_time)
        system.SetPostStepUserFunction(self._after_step)
        model = self._built.model
        assembly, newton, boom = model.assembly, Newton(solver, model.layout), self._built.boom
        predictor = Predictor(assembly, solver)

        def before_residual(system: Any, time: float, count: int, discontinuous: int) -> None:
            # The rods' dampers read the state that the step starts from, before it is moved.
            assembly.dampers.prepare(system, time, count, discontinuous)
            predictor.apply(time, count, discontinuous)
            if boom is not None:
                boom.settle()
            assembly.dry_joints.follow()
            newton.apply()

        system.SetPreNewtonResidualUserFunction(before_residual)
        if self._scene.solver.step_control == "motion":
            # A step is judged once: each further look would solve a refused step anew.
            self._settings.timeIntegration.discontinuous.maxIterations = 1
            self._settings.timeIntegration.discontinuous.ignoreMaxIterations = False
            system.SetPostNewtonUserFunction(self._weigh)
        cause = "it stopped before the end"  # exudyn may give up without raising
        try:
            if control.goes_on and solver.InitializeSolver(system, self._settings):
                solver.SolveSteps(system, self._settings)
            if (raised := self._raised) is not None:
                self._raised = None  # its traceback holds this run
                raise raised
        except exu.ExudynError as error:
            if "KeyboardInterrupt" in str(error):  # Ctrl-C within one of our own functions
                raise KeyboardInterrupt from error
            # What our own functions raise is no failure of the solver, as exudyn calls it: smaller
            # steps would not help.  Cables that have no answer say so in this way, too.
            if "USER FUNCTION" in str(error) and not self._refusal():
                raise RuntimeError(" ".join(str(error).split())) from error
            cause = _detail(str(error))
        finally:
            self._let_go()
        if control.goes_on:
            control.fail(self._refusal() or cause)
        history: Recorder = self._conclude(self._energy.note())
        history.newton_iterations = int(solver.it.newtonStepsCount)
        history.jacobians = int(solver.it.newtonJacobiCount)
        return history

    def _let_go(self) -> None:
        """Take the callbacks from exudyn, which keeps them, and they keep the system that they were
        given to.  Such a circle through C++ is invisible to Python's garbage collector: unless it
        is cut, every run leaves its system behind (10 MB for a ring of 18 sections, 20 MB with
        cables).
        """
        self._solver.SetUserFunctionUpdateCurrentTime(self._system, lambda *_: None)
        self._system.SetPostStepUserFunction(0)
        self._system.SetPreNewtonResidualUserFunction(0)
        self._system.SetPostNewtonUserFunction(0)

    def _refusal(self) -> str:
        """What the cables could not answer, if that is why a step failed."""
        return "" if self._built.cables is None else self._built.cables.refusal

    def _update_time(self, solver: Any, system: Any, settings: Any) -> None:
        """Set the step: the next one, or the reduced one of a retry."""
        control = self._control
        if self._fresh:
            solver.it.currentStepSize = control.next_step(self._next_event())
            self._fresh = False
            self._begin(control.now)
        else:
            solver.it.currentStepSize = control.retry(solver.it.currentStepSize)
        self._built.model.assembly.dry_joints.begin()
        self._weighed, self._refused = None, False
        solver.it.currentTime = solver.it.currentTime + solver.it.currentStepSize
        system.systemData.SetTime(solver.it.currentTime, exu.ConfigurationType.Current)

    def _weigh(self, system: Any, time: float) -> list[float]:
        """Have exudyn repeat a step that has converged to a state that is not good enough."""
        if time > self._control.now.time and self._weighed is None:
            self._now.refresh()
            if self._now.finite():
                self._weighed = self._measured(time)
                self._refused = self._control.shorter(self._weighed) is not None
        return [_REFUSE if self._refused else 0.0, -1.0]

    def _after_step(self, system: Any, time: float) -> bool:
        """Read the new state; False ends the run."""
        if time <= self._control.now.time:
            return True
        self._fresh = True
        self._now.refresh()
        if not self._now.finite():
            text = (
                f"the state is not finite at {time:.6g} s: reduce solver.step or solver.tolerance"
            )
            self._control.diverge(Reason(Cause.NOT_FINITE, text))
            return False
        try:
            return self._accepted(self._weighed or self._measured(time))
        except BaseException as error:  # as of a controller: it is told as it is, see ``run``
            self._raised = error
            return False

    def _reading(self, now: Instant) -> Reading:
        """See ``Run``."""
        return self._readings.reading(now, self._chain, self._cables)

    def _measured(self, time: float) -> Instant:
        """See ``Run``: the state that was refreshed last."""
        state, cables = self._now, self._built.cables
        angles, rates = self._openings.read(state)
        if cables is not None:
            self._chain = cables.current(state.position, state.velocity, time)
        energies = self._energy.read(time, state, angles, rates, self._chain)
        gap = max(float(group.gaps(state).max()) for group in self._gaps)
        return self._told(time, angles, rates, energies, gap, self._chain)


def _detail(message: str) -> str:
    """The line of exudyn's message that names the step that failed, or its first."""
    lines = [line.strip() for line in message.splitlines() if line.strip()]
    return next((line for line in lines if "step" in line.lower()), [*lines, ""][0])[:200]
