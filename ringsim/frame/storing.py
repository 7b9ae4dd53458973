"""Runs of the frame engine that store states on their way, or go on from one."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ringsim.cable.faults.family import CableFault
from ringsim.cable.ropes import Ropes
from ringsim.cable.state import ChainState
from ringsim.frame.integrate import Integration
from ringsim.frame.laws import JointLaws
from ringsim.frame.model import FrameModel
from ringsim.frame.state import State
from ringsim.outputs.stored import States, StoredState, cleared, struck_by
from ringsim.parts.faults.failed_spring import FailedSpring
from ringsim.parts.faults.family import Fault
from ringsim.parts.faults.stuck_vjoint import StuckVJoint
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.stepping.going_on import go_on
from ringsim.stepping.instant import Instant
from ringsim.stepping.memory import Memory
from ringsim.variables import Outcome

Watch = Callable[[Instant], None]


def solve(scene: Scene, watch: Watch | None = None, start: StoredState | None = None) -> Outcome:
    """As :func:`ringsim.frame.integrate.solve`, with states stored as the scene asks for, and from
    a stored state, which may be that of another scene.

    InputError if a run cannot go on so.
    """
    run = Storing(FrameModel(scene), watch, start)
    outcome = run.run().outcome()
    return replace(outcome, states=run.stored())


class Storing(Integration):
    """An integration that stores states, or goes on from one."""

    def __init__(
        self, model: FrameModel, watch: Watch | None = None, start: StoredState | None = None
    ) -> None:
        super().__init__(model, watch)
        interval = model.scene.record.state_interval
        self._states = None if interval is None else States(interval)
        if start is not None:
            self._go_on(start)
            if self._states is not None:
                self._states.skip(start.time)

    def stored(self) -> dict[str, np.ndarray[Any, Any]]:
        """All states, see ``ringsim.variables.Outcome``; none if the scene does not ask."""
        return {} if self._states is None else self._states.arrays(self.history, "frame")

    def _next_event(self) -> float:
        due = math.inf if self._states is None else self._states.next_time
        return min(super()._next_event(), due)

    def _accept(self, step: float, after: State, found: Instant) -> None:
        super()._accept(step, after, found)
        if self._states is not None and self._states.due(self._control):
            self._states.keep(self._control, self.history, self.memory())

    def _place(self, fault: StuckVJoint | FailedSpring) -> tuple[int, int]:
        return self._scene.structure.planes.index(fault.plane), fault.section - 1

    def memory(self) -> Memory:
        """See ``Remembering``: all that the next step depends on, but step control."""
        now, model, cables = self._now, self._model, self._model.cables
        memory = super().memory() | {
            "state": now.memory(),
            "latches": self._latches.memory(),
            "energy": self._energy.memory(),
            "reaction": getattr(model, "reaction", None),
            "stuck": [opening for *_, opening in model.laws.stuck],
        }
        if cables is not None and now.chain is not None:
            ropes = cables.ropes
            memory["ropes"] = [ropes.starts, ropes.content, ropes.alive]
            memory["wound"] = [now.chain.wound, now.chain.wound_rate]
            memory["winches"] = cables.winches.memory()
        return memory

    def recall(self, memory: Memory) -> None:
        """See ``Remembering``; faults and cables are left to ``_go_on``."""
        super().recall(memory)
        self._now = self._model.start.copy()
        self._now.recall(memory["state"])
        self._latches.recall(memory["latches"])
        self._energy.recall(memory["energy"])
        if memory["reaction"] is not None:
            self._model.reaction = memory["reaction"]

    def _go_on(self, start: StoredState) -> None:
        """Take a stored state over."""
        model, memory, changed = self._model, start.memory, start.changed_to(self._scene)
        self.recall(memory)
        state = self._now
        go_on(self._control, self._scene.solver, memory["stepping"], changed, start.name)
        self.history.take_over(start.history, memory["recorder"], start.scenes, start.name)
        gone = cleared(self._scene, start)
        self._strike_again(start, gone)
        if model.cables is not None:
            state.chain = self._chain_of(start, gone)
        self._turn_loads(start.time)
        before = self._control.now.energies
        if changed:
            self._energy.go_on_from(before.work, state)
        now = self._told(start.time, state)
        if not changed:
            self._energy.keep()
            return
        # What a change takes away is lost, as what a fault lets go: nothing moves meanwhile, so
        # that other loads do no work.
        after = now.energies
        lost = before.kinetic + before.elastic - after.kinetic - after.elastic
        energies = after._replace(lost=before.lost + lost, driven=before.driven)
        self.history.forget_last()
        self._control.begin_anew(self._read(replace(now, energies=energies)), lost)
        self._latch(start.time)

    def _strike_again(self, start: StoredState, gone: list[Fault]) -> None:
        """Let all faults have struck that had, but those that are gone."""
        model = self._model
        # Those of the start have struck this model already, where it stood then.
        model.laws = JointLaws(self._scene, model.skeleton, model.openings)
        openings = list(start.memory["stuck"])
        for fault in struck_by(start.scene.faults, start.time):
            opening = openings.pop(0) if isinstance(fault, StuckVJoint) else math.nan
            if fault in gone:
                continue
            if isinstance(fault, StuckVJoint):
                model.laws.stick(fault, self._place(fault), opening)
            elif isinstance(fault, FailedSpring):
                model.laws.fail(self._place(fault))
        left = len(struck_by(self._scene.faults, start.time))
        self._faults = sorted(self._scene.faults, key=lambda fault: fault.time)[left:]
        if self._locks is not None:
            model.laws.latch(self._latches.caught)

    def _chain_of(self, start: StoredState, gone: list[Fault]) -> ChainState:
        """The cables."""
        cables, memory, scene = self._model.cables, start.memory, start.scene
        assert cables is not None
        assert scene.cables is not None
        ropes = Ropes(cables.ropes.points_per_cable, *memory["ropes"])
        for fault in gone:
            if isinstance(fault, CableFault):
                try:
                    ropes = fault.clear(ropes)
                except ValueError as error:
                    raise InputError(str(error)) from error
        wound, rate = memory["wound"]
        before = [cable for _, cable in scene.cables.present()]
        cables.winches.go_on(memory["winches"], before, start.time, wound, rate)
        place, moving = self._now.place.lines, self._now.rate.lines
        return cables.go_on(ropes, place, moving, wound, rate)
