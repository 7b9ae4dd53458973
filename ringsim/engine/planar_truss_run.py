"""Integrating a planar truss, and what is read at every step.

It is no ring: there are no V-joints to wait for, so a run lasts as long as its winding is
watched (``solver.end_time``), in constant steps that exudyn halves only where Newton fails.
"""

from __future__ import annotations

import math
from typing import Any

import exudyn as exu
import numpy as np
from numpy.typing import NDArray

from ringsim.cable.state import ChainState
from ringsim.engine import quaternions
from ringsim.engine.closing import close
from ringsim.engine.guard import Guard
from ringsim.engine.planar_truss import TrussModel, rest_force
from ringsim.engine.predictor import Predictor
from ringsim.engine.rod_dampers import STIFFENING
from ringsim.engine.settings import raise_own, solver_settings
from ringsim.engine.work import StepWork
from ringsim.outputs.instant import Energies, Instant
from ringsim.outputs.recorder import History, Recorder
from ringsim.variables import Cause, Reason, Status

Array = NDArray[np.float64]
_KINETIC = exu.OutputVariableType.KineticEnergy
_POTENTIAL = exu.OutputVariableType.PotentialEnergy
_TORQUE = exu.OutputVariableType.TorqueLocal
_FORCE = exu.OutputVariableType.ForceLocal
_RECOVERY = 10
"""Steps after which a halved step may grow again."""
_SLIGHT = 1e-3
"""Energy that does not matter, over the spring's largest force along a beam."""


class TrussIntegration:
    """One run of a built planar truss."""

    def __init__(self, model: TrussModel) -> None:
        self._model, self._system = model, model.assembly.system
        self._solver = exu.MainSolverImplicitSecondOrder()
        self._settings = solver_settings(model.scene, self._residual_tolerance())
        solver = model.scene.solver
        time = self._settings.timeIntegration
        time.numberOfSteps = math.ceil(solver.end_time / solver.step * (1.0 - 1e-12))
        time.adaptiveStepRecoverySteps = _RECOVERY
        self._reader = TrussReader(model)
        slight = _SLIGHT * self._push() * model.truss.beam_length
        slack = max(cable.slack_width for cable in model.cable.chain.cables)
        self._guard = Guard(solver, slight, model.truss.beam_length, slack)
        self.recorder = Recorder(model.scene, {"station": model.upper.places})
        self.history = self.recorder.history

    def run(self) -> History:
        """Integrate to the end time."""
        history, solver = self.history, self._solver
        self._system.SetPostStepUserFunction(self._after_step)
        self._system.SetPreNewtonResidualUserFunction(Predictor(self._model.assembly, solver).apply)
        self._read(0.0)
        try:
            if solver.InitializeSolver(self._system, self._settings):
                solver.SolveSteps(self._system, self._settings)
        except exu.ExudynError as error:
            raise_own(error, self._model.cable.refusal)
            self._fail(str(error).strip().splitlines()[0][:200])
        end = self._model.scene.solver.end_time
        if history.status == Status.UNFINISHED:
            if history.times[-1] < end * (1.0 - 1e-9):
                self._fail("it stopped before the end time")
            else:
                history.status = Status.OK
                history.reason = f"the cable was wound until solver.end_time = {end:g} s"
        self._guard.conclude(history)
        close(history, self._system, solver)
        return history

    def _fail(self, detail: str) -> None:
        """Note why the solver gave up, unless the reader knows better."""
        history = self.history
        if history.status == Status.UNFINISHED:
            reason = (
                f"the solver gave up at {history.times[-1]:.6g} s: reduce solver.step, or raise "
                f"solver.newton_tolerance ({self._model.cable.refusal or detail})"
            )
            history.end(Status.SOLVER_FAILED, Reason(Cause.NEWTON, reason))

    def _after_step(self, system: Any, time: float) -> bool:
        """Read the new state; False ends the run."""
        del system
        return time <= self.history.times[-1] or self._read(time)

    def _read(self, time: float) -> bool:
        now = self._reader.read(time)
        if now is not None:
            self.recorder.note(now)
            chain, slope = self._reader.chain, self._reader.path_slope
            step = self._model.scene.solver.step
            self._model.cable.advance(time, step, chain, np.array([slope]))
            return not self._guard.stops(self.history)
        reason = f"the state is not finite at {time:.6g} s: reduce solver.step"
        self.history.end(Status.DIVERGED, Reason(Cause.NOT_FINITE, reason))
        return False

    def _residual_tolerance(self) -> float:
        """Residual norm in N at which Newton stops, above what round-off lets it reach.

        ``newton_tolerance`` times the spring's largest force, or the stiffest element's rate
        times coordinates of order 1 m, per coordinate.
        """
        model, rods = self._model, self._model.scene.rods
        element = float(np.diff(model.upper.places).min())
        stiffest = float(np.max(rods.young_modulus)) * rods.bar.area / element
        if rods.damping > 0.0:
            stiffest *= STIFFENING
        size = self._system.systemData.ODE2Size()
        round_off = 4.0 * float(np.finfo(float).eps) * stiffest * math.sqrt(size)
        return max(model.scene.solver.newton_tolerance * self._push(), round_off)

    def _push(self) -> float:
        """The spring's largest force, N."""
        truss = self._model.truss
        shortest = float(truss.geometry().strut(truss.stowed_angle))
        return float(truss.spring.stiffness * abs(truss.spring.free_length - shortest))


class TrussReader:
    """Reads a truss model's state.

    Attributes
    ----------
    chain
        The cable at the last reading.
    path_slope
        Derivative of the cable's length after the opening angle there, m/rad.
    """

    chain: ChainState
    path_slope: float

    def __init__(self, model: TrussModel) -> None:
        self._model = model
        self._data = model.assembly.system.systemData
        self._reference = np.array(self._data.GetODE2Coordinates(exu.ConfigurationType.Reference))
        place = model.assembly.coordinates_of
        self._upper = place(model.upper.nodes[0])[:3]
        self._bar, self._tubes = place(model.bar), [place(node) for node in model.tubes]
        self._pins = np.array(
            [
                [place(model.upper.nodes[-1])[:3], self._bar[:3]],
                [place(model.upper.nodes[model.head])[:3], self._tubes[1][:3]],
            ]
        )
        self._fixed = np.array([self._upper, place(model.lower.nodes[0])[:3], self._tubes[0][:3]])
        self._fixed_at = np.array([model.points.upper, model.points.lower, model.points.foot])
        self._lower_end = place(model.lower.nodes[-1])[:3]
        rods = model.scene.rods
        second = rods.bar.second_moment
        self._per_moment = 0.5 * rods.bar.outer_diameter / (np.max(rods.young_modulus) * second)
        self._since = StepWork()

    def read(self, time: float) -> Instant | None:
        """The current state; None if it is not finite."""
        position = np.asarray(self._data.GetODE2Coordinates()) + self._reference
        velocity = np.asarray(self._data.GetODE2Coordinates_t())
        if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
            return None
        arm = position[self._bar[:3]] - self._model.points.upper
        moving = velocity[self._bar[:3]]
        angle = math.atan2(arm[0], -arm[1])
        rate = float(arm[0] * moving[1] - arm[1] * moving[0]) / float(arm[:2] @ arm[:2])
        self.chain = self._model.cable.current(position, velocity, time)
        self.path_slope = float(self._model.truss.geometry().cable_rate(angle))
        return Instant(
            time,
            np.array([[angle]]),
            np.array([[rate]]),
            self._energies(time, position, velocity),
            gap=self._gap(position),
            chain=self.chain,
            planes=((0,),),
            strain=self._strains(),
        )

    def _strains(self) -> Array:
        """Strain of the fibre on the side away from the strut, at the nodes of the beam.

        exudyn gives the moment in the middle of an element; it follows the shear force to the ends,
        dM_z/dx = -Q_y.  Where two elements meet their moments differ by what turns the node alone;
        their mean counts.
        """
        output, centre = self._model.assembly.system.GetObjectOutputBody, [0.0, 0.0, 0.0]
        elements = self._model.upper.elements
        moments = np.array([output(e, _TORQUE, centre)[2] for e in elements])
        shear = np.array([output(e, _FORCE, centre)[1] for e in elements])
        change = 0.5 * shear * np.diff(self._model.upper.places)
        first, last = moments + change, moments - change
        at_nodes = np.concatenate([first[:1], 0.5 * (first[1:] + last[:-1]), last[-1:]])
        return np.asarray(-self._per_moment * at_nodes)

    def _energies(self, time: float, position: Array, velocity: Array) -> Energies:
        model, chain = self._model, self.chain
        output = model.assembly.system.GetObjectOutputBody
        kinetic = float(sum(output(body, _KINETIC) for body in model.assembly.bodies))
        beams = (*model.upper.elements, *model.lower.elements)
        elastic = float(sum(output(element, _POTENTIAL) for element in beams))
        foot, head = (position[tube[:3]] for tube in self._tubes)
        first, second = (velocity[tube[:3]] for tube in self._tubes)
        strut = float(np.linalg.norm(head - foot))
        closing = float((second - first) @ (head - foot)) / strut
        spring, rest = model.truss.spring, model.truss.rest
        distance, rate = float(position[self._bar[0]]), float(velocity[self._bar[0]])
        room = model.truss.rest_distance
        push, held = rest_force(rest, distance, rate, room)
        elastic += 0.5 * spring.stiffness * (strut - spring.free_length) ** 2
        elastic += 0.5 * rest.stiffness * max(room - distance, 0.0) ** 2
        elastic += float(chain.elastic_energy.sum())
        dampers = model.assembly.dampers
        in_beams = dampers.lost(model.assembly.system, time)
        forces = np.array([spring.damping * closing, held - push])
        passed = self._since.since(time, forces, np.array([closing, rate]), chain)
        self._since.keep()
        dampers.keep()
        return Energies(kinetic, elastic, 0.0, passed.lost + in_beams, passed.driven)

    def _gap(self, position: Array) -> float:
        """Largest distance of points that a joint holds together, m."""
        pins = position[self._pins[:, 0]] - position[self._pins[:, 1]]
        turn = quaternions.axes_of(position[self._bar[3:]][None])[0]
        hanging = position[self._bar[:3]] - self._model.truss.axis_length * turn[:, 1]
        ends = (position[self._lower_end] - hanging)[None]
        fixed = position[self._fixed] - self._fixed_at
        return float(np.linalg.norm(np.concatenate([pins, ends, fixed]), axis=1).max())
