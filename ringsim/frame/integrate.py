"""Time integration of a scene in joint coordinates; ``ringsim.stepping`` decides on the steps."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, cast

import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.cable.ropes import CableFault, Ropes
from ringsim.core.library import call
from ringsim.frame.laws import JointLaws
from ringsim.frame.model import FrameModel
from ringsim.frame.readings import CLOSE, EnergyMeter, FrameMeters
from ringsim.frame.state import State
from ringsim.hermite import extrapolated
from ringsim.layout.bodies import Array
from ringsim.outputs.meters import Reading
from ringsim.outputs.recorder import Recorder, States, StoredState, cleared, struck_by
from ringsim.parts.faults import Fault, Struck
from ringsim.parts.laws import Place, Switches
from ringsim.refusal import InputError
from ringsim.rigid.statics import scales_of
from ringsim.scene import Scene
from ringsim.scene.substituted import substituted
from ringsim.stepping.control import go_on
from ringsim.stepping.instant import Instant, Memory, Strained, Watch
from ringsim.stepping.run import Run
from ringsim.variables import Outcome

_EASY, _PATIENCE = 3, 4
"""Newton iterations up to which a step was easy, and steps after which, if they are not, the other
polynomial is tried that may foretell the motion: a cubic where it is smooth, as at the speed of a
flight, a parabola where ropes swing within a step."""
_SHORTEST = 1e-9
"""Step (s) below which Newton's failure ends a run, as of the full model."""


def solve(scene: Scene, watch: Watch | None = None) -> Outcome:
    """Run a scene.  A solve that fails is a status, not an exception.

    InputError if the scene has what frames do not represent.
    """
    return Integration(FrameModel(scene), watch).run().outcome()


class NoBalanceError(Exception):
    """Newton found no state in balance; why."""


class Integration(Run):
    """One run of a model."""

    changing = ("_moves", "_taken", "_cubic", "_tried", "_steps")
    model: FrameModel
    _energy: EnergyMeter

    def __init__(self, model: FrameModel, watch: Watch | None = None) -> None:
        scene = model.scene
        super().__init__(scene, watch)
        self.model, self._cables = model, model.cables
        # Two states take turns: the core has seen their tables.
        self._now, self._next = model.start.copy(), model.start.copy()
        self._energy = EnergyMeter(model)
        self._moves: list[tuple[float, Array]] = []
        self._taken, self._cubic, self._tried = [0, 0], True, 0
        self._steps: list[tuple[float, Array]] = []
        self._readings = FrameMeters(model)
        self.history = Recorder(scene, self._readings.coordinates(), model.layout)
        ropes = None if model.cables is None else model.cables.ropes.content
        first = self._measured(0.0)
        self._set_out(
            first,
            scales_of(scene, model.layout, model.ideal, ropes),
            Strained(self._energy.strained, model.prestress),
        )

    @property
    def state(self) -> State:
        """See ``Run``."""
        return self._now

    @property
    def _at(self) -> ChainState | None:
        """See ``Run``."""
        return self._now.chain

    @property
    def _laws(self) -> JointLaws:
        """See ``Run``."""
        return self.model.laws

    def run(self) -> Recorder:
        """Integrate until all V-joints have locked and settled, or to the end time."""
        control = self._control
        while control.goes_on:
            step = control.next_step(self._next_event())
            self._begin(control.now)
            while True:
                try:
                    after, found = self._try(step)
                except NoBalanceError as error:
                    step = control.retry(0.5 * step)
                    if step < _SHORTEST:
                        control.fail(str(error))
                        break
                    continue
                if control.shorter(found) is None:
                    self._accept(step, after, found)
                    break
                step = control.retry(step)
        return cast(Recorder, self._conclude())

    def _begin(self, now: Instant) -> None:
        """Let joints and winches begin a step."""
        self.model.laws.rubbing.forget()
        super()._begin(now)

    def _try(self, step: float) -> tuple[State, Instant]:
        """The state a step later."""
        time = self._control.now.time + step
        after = self._next
        call("set_out", self.model.mesh, self._now.table, after.table, self._guess(step))
        self._damp(step, after)
        self._newton(time, step, after)
        if self.model.cables is not None:
            after.chain = self.model.cables.balanced()
        return after, self._known(time, after)

    def _damp(self, step: float, after: State) -> None:
        """Let rates of strains follow from strains: the backward differences of second order of
        ringsim.exudyn.assembly.
        """
        _, out, lead = after.strains
        last, before = self._steps[-1] if self._steps else (math.inf, 0.0 * out)
        r = step / last
        lead[0] = (1.0 + 2.0 * r) / (step * (1.0 + r))
        np.multiply(r**2 / (1.0 + r), before, out=out)
        out -= (1.0 + r) * self._now.strains.now
        out /= step

    def _newton(self, time: float, step: float, after: State) -> None:
        """Newton's method with secants, in place."""
        found = self.model.balance(time, step, self._now, after)
        self.history.newton_iterations += found.iterations
        self.history.jacobians += found.tangents
        # A step that failed counts as one that took all iterations there are.
        self._choose(call("most_iterations") if found.why else found.iterations)
        if found.why:
            raise NoBalanceError(found.why)

    def _choose(self, taken: int) -> None:
        """Choose what foretells the next step: what has left Newton less to do, when it was tried
        last; this one took so many iterations.
        """
        self._taken[self._cubic] = taken
        self._tried += 1
        better = self._taken[True] <= self._taken[False]
        if better != self._cubic:
            self._cubic, self._tried = better, 0
        elif taken > _EASY and self._tried >= _PATIENCE:
            self._cubic, self._tried = not better, 0

    def _guess(self, step: float) -> Array:
        """Change of all unknowns over a step, from the last two steps or three."""
        if not self._moves:
            return 0.5 * step**2 * self.model.first
        return extrapolated(self._moves[-3 if self._cubic else -2 :], step)

    def _accept(self, step: float, after: State, found: Instant) -> None:
        """Go on from a state."""
        before, moved = self._now, np.zeros(self.model.size)
        call("arrive", self.model.mesh, before.table, after.table, moved)
        moved /= step
        # Before rest it came as it leaves: the even motion through the first state.
        self._moves = [*(self._moves[-2:] or [(step, -moved)]), (step, moved)]
        self._steps = [(step, before.strains.now.copy())]
        self._now, self._next = after, before
        self._accepted(found)

    def _reading(self, now: Instant) -> Reading:
        """See ``Run``."""
        meters = self._readings.at(self._now)
        return meters.reading(now, self._at, self._cables)

    def _measured(self, time: float) -> Instant:
        """See ``Run``."""
        cables, state = self.model.cables, self._now
        if cables is not None:
            state.chain = cables.state(time, state.place.paths, state.rate.paths)
        return self._known(time, state)

    def _known(self, time: float, state: State) -> Instant:
        """A state whose chain is known, and what has passed since the one that was kept last."""
        angles, rates = self.model.openings.read(state.pose.angle, state.rate.angles)
        energies, gap = self._energy.read(time, state)
        return self._told(time, angles, rates, energies, gap, state.chain)


# Runs of the frame engine that store states on their way, or go on from one.


def solve_and_store(
    scene: Scene, watch: Watch | None = None, start: StoredState | None = None
) -> Outcome:
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

    def _settings(self) -> dict[tuple[Any, ...], float]:
        """Those of laws that faults have switched on."""
        switches = self.model.laws.switches
        return {
            key: float(switches.setting[number][switches.laws[number].places.index(place)])
            for number, place, key in _of_faults(switches)
            if switches.on[number].any()
        }

    def memory(self) -> Memory:
        """See ``Remembering``: all that the next step depends on, but step control."""
        now, model, cables = self._now, self.model, self.model.cables
        memory = super().memory() | {
            "state": now.memory(),
            "latches": self._latches.memory(),
            "energy": self._energy.memory(),
            "reaction": model.reaction,
            "settings": [[*key, value] for key, value in self._settings().items()],
        }
        if cables is not None and now.chain is not None:
            ropes = cables.ropes
            memory["ropes"] = [ropes.starts, ropes.content, ropes.alive]
            memory["wound"] = [now.chain.wound, now.chain.wound_rate]
            memory["winches"] = cables.winches.memory()
        if self._sampler is not None:
            memory["sampler"] = self._sampler.memory()
        return memory

    def recall(self, memory: Memory) -> None:
        """See ``Remembering``; faults and cables are left to ``_go_on``."""
        super().recall(memory)
        self._now.recall(memory["state"])
        self._latches.recall(memory["latches"])
        self._energy.recall(memory["energy"])
        self.model.reaction[:] = memory["reaction"]

    def _go_on(self, start: StoredState) -> None:
        """Take a stored state over."""
        model, memory, changed = self.model, start.memory, start.changed_to(self._scene)
        shares = self._points_of(start) if changed else None
        self.recall(memory)
        state = self._now
        if shares is not None:
            for each in state.followed:
                points = each[: 3 * len(shares)].reshape(-1, 3)
                points[:] = shares @ points
            model.place(state)
        go_on(self._control, self._scene.solver, memory["stepping"], changed, start.name)
        self.history.take_over(start.history, memory["recorder"], start.scenes, start.name)
        if self._sampler is not None:
            same = self._scene.controller == start.scene.controller
            self._sampler.recall(memory.get("sampler"), start.time, same=same)
        gone = cleared(self._scene, start)
        self._strike_again(start, gone)
        if model.cables is not None:
            state.chain = self._chain_of(start, gone)
        self._turn_loads(start.time)
        before = self._control.now.energies
        if changed:
            self._energy.go_on_from(before.work, state)
        now = self._known(start.time, state)
        if not changed:
            self._energy.keep()
            return
        # What a change takes away is lost, as what a fault lets go: nothing moves meanwhile, so
        # that other loads do no work.
        after = now.energies
        lost = before.kinetic + before.elastic - after.kinetic - after.elastic
        now = replace(now, energies=after._replace(lost=lost, driven=0.0))
        self._control.begin_anew(self._read(now, arrived=False), lost)
        self._latch(start.time)

    def _points_of(self, start: StoredState) -> Array | None:
        """Shares of the points of the state's scene in those that carry the masses of bodies here,
        where these stand elsewhere in their bodies, of whose (arm, 1) sums are taken; else None.
        """
        own, before = self.model.mesh, FrameModel(substituted(start.scene)).mesh
        if np.array_equal(own.point_arm, before.point_arm):
            return None
        refused = InputError(
            f"{start.name}: the masses of a body spread in a direction in which they had no "
            "extent, or no longer do, so that how they moved there is not known: begin anew"
        )
        if not np.array_equal(own.point_frame, before.point_frame):
            raise refused
        shares = np.eye(len(own.point_frame))
        for frame in np.unique(own.point_frame[(own.point_arm != before.point_arm).any(axis=1)]):
            k = np.flatnonzero(own.point_frame == frame)
            new, old = (np.vstack([each.point_arm[k].T, np.ones(len(k))]) for each in (own, before))
            found = np.linalg.lstsq(old, new, rcond=None)[0]
            if np.abs(old @ found - new).max() > CLOSE:
                raise refused
            shares[np.ix_(k, k)] = found.T
        return shares

    def _strike_again(self, start: StoredState, gone: list[Fault]) -> None:
        """Let all faults have struck that had, but those that are gone."""
        model = self.model
        # Those of the start have struck this model already, where it stood then.
        model.begin_laws(JointLaws(model.skeleton, model.openings))
        switches, planes = model.laws.switches, self._scene.structure.planes
        unknown = np.full(self._control.now.angles.shape, math.nan)
        own = Struck(planes, switches, unknown)
        own.encoders = None if self._sampler is None else self._sampler.encoders
        for fault in struck_by(self._scene.faults, start.time):
            if not isinstance(fault, CableFault):
                fault.strike(own)
        # Settings are those of the state: at which angle a joint has stuck.
        held = {tuple(key): value for *key, value in start.memory["settings"]}
        for number, place, key in _of_faults(switches):
            if key in held:
                switches.set(number, place, on=1.0, setting=held[key])
        self._faults.due(start.time)
        if self._locks is not None:
            self._latches.hold(switches)
        model.laws.follow()

    def _chain_of(self, start: StoredState, gone: list[Fault]) -> ChainState:
        """The cables."""
        cables, memory, scene = self.model.cables, start.memory, start.scene
        assert cables is not None
        assert scene.cables is not None
        ropes = Ropes(cables.ropes.points_per_cable, *memory["ropes"])
        own = Struck(
            scene.structure.planes,
            self.model.laws.switches,
            np.pi - self._control.now.angles,
            ropes,
        )
        struck = struck_by(self._scene.faults, start.time)
        kept = {each.held for each in struck if isinstance(each, CableFault)} - {None}
        for fault in gone:
            if isinstance(fault, CableFault) and fault.held in kept:
                continue
            try:
                fault.clear(own)
            except ValueError as error:
                raise InputError(str(error)) from error
        wound, rate = memory["wound"]
        before = [cable for _, cable in scene.cables.present()]
        cables.winches.go_on(memory["winches"], before, start.time, wound, rate)
        place, moving = self._now.place.paths, self._now.rate.paths
        return cables.go_on(own.ropes, place, moving, wound, rate)


def _of_faults(switches: Switches) -> Iterator[tuple[int, Place, tuple[Any, ...]]]:
    """Numbers of the laws that faults bring, with their V-joints and what tells them apart."""
    for number, law in enumerate(switches.laws):
        record = cast("object", law.record)
        if isinstance(record, Fault):
            for place in law.places:
                yield number, place, (law.group, *place, record.time)
