"""Time integration of a scene in joint coordinates; ``ringsim.stepping`` decides on the steps."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.cable.faults import CableFault
from ringsim.cable.ropes import Ropes
from ringsim.frame.kernels import Strains, move, moved_between, straighten
from ringsim.frame.laws import JointLaws
from ringsim.frame.model import FrameModel
from ringsim.frame.readings import EnergyMeter, Readings
from ringsim.frame.state import State
from ringsim.layout.bodies import Array
from ringsim.outputs.recorder import Recorder, States, StoredState, cleared, struck_by
from ringsim.parts.faults import AT_ONCE, Fault, Faults, Struck
from ringsim.parts.laws import Place, Switches
from ringsim.refusal import InputError
from ringsim.rigid.statics import scales_of
from ringsim.scene import Scene
from ringsim.stepping.control import RunControl, go_on
from ringsim.stepping.events import Events, extrapolated
from ringsim.stepping.instant import Instant, Memory, Remembering, Strained
from ringsim.stepping.locks import Latches, locks_of
from ringsim.variables import Outcome

# Broyden's method: what a tangent that is not renewed learns from the changes made with it.
#
# With changes s_0 ... s_n since the tangent was factored, and z = -K^-1 g of the newest residual,
#
#     z <- z + s_(j+1) (s_j . z) / (s_j . s_j),  j = 0 ... n - 1,
#     s_(n+1) = z / (1 - (s_n . z) / (s_n . s_n))
#
# (the product form of the good Broyden update: Kelley, Iterative Methods for Linear and Nonlinear
# Equations, SIAM 1995, section 7.3).  It costs some dot products, in which turns count by the way
# that they move a length: sums of metres and radians would depend on the unit of length.


_ALIKE = 0.7
"""Largest share of the last change in the next one for which the update is made: a change that
hardly differs from the last one says that the tangent is wrong there."""


class Secants:
    """The changes since a tangent."""

    def __init__(self, lengths: Array) -> None:
        """``lengths``, shape (unknowns,): by which turns become ways (m); 1 for what is one."""
        self._metric = lengths**2
        self._changes: list[Array] = []
        self._squares: list[float] = []

    def forget(self) -> None:
        """Begin with a new tangent, or after a change that was not taken whole."""
        self._changes, self._squares = [], []

    def corrected(self, change: Array) -> Array:
        """The change to make instead of the tangent's own, shape (unknowns,)."""
        last = len(self._changes) - 1
        for n, square in enumerate(self._squares):
            share = float((self._metric * self._changes[n]) @ change) / square
            if n < last:
                change = change + share * self._changes[n + 1]
            elif share < _ALIKE:
                change = change / (1.0 - share)
        self._changes.append(change)
        self._squares.append(float((self._metric * change) @ change))
        return change


# Time integration of a scene in joint coordinates; ``ringsim.stepping`` decides on the steps.


_MOST = 25
"""Newton iterations a step at most, as of the full model."""
_FALL = 0.3
"""Ratio of successive residuals above which the tangent is renewed: a tangent costs two iterations,
and secants teach the old one."""
_EASY = 3
"""Newton iterations up to which a step was easy: the motion is smooth, and a cubic foretells it
better than a parabola; where ropes swing within a step it does worse."""
_SHORTEST = 1e-9
"""Step (s) below which Newton's failure ends a run, as of the full model."""

Watch = Callable[[Instant], None]
"""What is shown every accepted state of a run."""


def solve(scene: Scene, watch: Watch | None = None) -> Outcome:
    """Run a scene.  A solve that fails is a status, not an exception.

    InputError if the scene has what frames do not represent.
    """
    return Integration(FrameModel(scene), watch).run().outcome()


class NoBalanceError(Exception):
    """Newton found no state in balance; why."""


class Integration(Remembering):
    """One run of a model."""

    changing = ("_moves", "_easy", "_steps", "_strains")

    def __init__(self, model: FrameModel, watch: Watch | None = None) -> None:
        self._model, self._watch = model, watch
        scene, elements = model.scene, len(model.mesh.length)
        self._scene, self._now, self._energy = scene, model.start, EnergyMeter(model)
        self._moves: list[tuple[float, Array]] = []
        self._easy = False
        self._steps: list[tuple[float, Array]] = []
        self._faults, self._events = Faults(scene.faults), Events(scene)
        self._turn = scene.loads_turn_at
        self._strains = Strains(model.start.strains, np.zeros((elements, 6)), 0.0)
        self._readings = Readings(model)
        first = self._measure(0.0, self._now)
        self._latches = Latches(scene)
        self._locks = locks_of(scene, first.angles, self._latches)
        self.history = Recorder(scene, self._readings.coordinates)
        ropes = None if model.cables is None else model.cables.ropes.content
        self._control = RunControl(
            scene.solver,
            scales_of(scene, model.layout, model.ideal, ropes),
            self._read(first),
            self._locks,
            limits=scene.limits,
            follow_deviations=scene.record.stress,
            turn=scene.loads_turn_at,
            strained=Strained(self._energy.strain_energy(model.start), model.prestress),
        )

    def run(self) -> Recorder:
        """Integrate until all V-joints have locked and settled, or to the end time."""
        control, history = self._control, self.history
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
        control.conclude()
        history.status, history.fate = control.status, control.fate
        history.reason, history.repeats = control.reason, control.repeats
        history.caught = self._latches.caught
        return history

    def _next_event(self) -> float:
        """Time that no step may pass, s."""
        return self._events.after(self._control.now.time)

    def _begin(self, now: Instant) -> None:
        """Let joints and winches begin a step."""
        self._model.laws.begin()
        cables, chain = self._model.cables, self._now.chain
        if cables is None or chain is None:
            return

        def path_slope(number: int) -> float:
            plane, cable = cables.present[number]
            return self._scene.structure.path_slope(cable, now.angles[plane])

        cables.begin(now.time, chain, cables.winches.path_slopes(path_slope))

    def _try(self, step: float) -> tuple[State, Instant]:
        """The state a step later."""
        time = self._control.now.time + step
        after = self._now.copy()
        self._move(after, self._guess(step))
        self._strains = self._damped(step, after)
        self._newton(time, step, after)
        return after, self._measure(time, after)

    def _damped(self, step: float, after: State) -> Strains:
        """How the rates of strains follow from strains: the backward differences of second order
        of ringsim.exudyn.assembly.
        """
        now = self._now.strains
        if not self._steps:
            return Strains(after.strains, -now / step, 1.0 / step)
        last, before = self._steps[-1]
        r = step / last
        lead = (1.0 + 2.0 * r) / (step * (1.0 + r))
        return Strains(after.strains, (r**2 / (1.0 + r) * before - (1.0 + r) * now) / step, lead)

    def _newton(self, time: float, step: float, after: State) -> None:
        """Newton's method with secants, in place.

        Changes are taken whole.  Where forces bend sharply, as of stops and of dry friction that
        turns round, the residual may grow for an iteration: what it finds there is what tells the
        way back (``ringsim.stepping.locks``), and shorter changes would only find it later.
        """
        model, factored, last = self._model, None, math.inf
        secants = Secants(model.lengths)
        tolerance = model.tolerance(step, self._strains)
        for taken in range(_MOST):
            try:
                g = model.residual(time, step, self._now, after, self._strains)
            except ValueError as error:
                raise NoBalanceError(str(error)) from error
            forces = g / model.lengths
            norm = math.sqrt(forces @ forces)
            if not math.isfinite(norm):
                raise NoBalanceError("the state is not finite")
            if norm <= tolerance:
                self._easy = taken <= _EASY
                return
            self.history.newton_iterations += 1
            if factored is None or norm > _FALL * last:
                factored = model.tangent(time, step, after, self._strains)
                secants.forget()
                self.history.jacobians += 1
                if not factored.sound:
                    raise NoBalanceError("a pivot of the tangent is too small")
            last = norm
            self._move(after, secants.corrected(factored.solve(g)))
        raise NoBalanceError(
            f"Newton's residual is {norm:.3g} N after {_MOST} iterations, step {step:.3g} s"
        )

    def _move(self, state: State, by: Array) -> None:
        move(self._model.mesh, state.pose, by[: self._model.mesh.unknowns])
        if self._model.with_hub:
            state.hub += by[-3:]

    def _guess(self, step: float) -> Array:
        """Change of all unknowns over a step, from two steps or, where the last was easy, three."""
        if not self._moves:
            return 0.5 * step**2 * self._model.first
        return extrapolated(self._moves[-3 if self._easy else -2 :], step)

    def _accept(self, step: float, after: State, found: Instant) -> None:
        """Go on from a state."""
        control, before = self._control, self._now
        moved = self._between(before, after) / step
        # Before rest it came as it leaves: the even motion through the first state.
        self._moves = [*(self._moves[-2:] or [(step, -moved)]), (step, moved)]
        self._steps = [(step, before.strains)]
        straighten(after.pose)
        self._now = after
        control.accept(found, self._read(found))
        if self._watch is not None:
            self._watch(control.now)
        self._latch(found.time)

    def _latch(self, time: float) -> None:
        """Latch V-joints that have locked, and let winches know whose plane has."""
        model, chain = self._model, self._now.chain
        if self._locks is None:
            return
        locked = self._latches.locked(self._locks.deployed)
        self._latches.hold(model.laws.switches)
        model.laws.follow()
        if model.cables is not None and chain is not None:
            for number, (plane, _) in enumerate(model.cables.present):
                if locked[plane].all():
                    model.cables.winches.lock(number, time, chain)

    def _between(self, before: State, after: State) -> Array:
        """Changes of all unknowns."""
        found = np.zeros(self._model.size)
        moved_between(self._model.mesh, before.pose, after.pose, found)
        if self._model.with_hub:
            found[-3:] = after.hub - before.hub
        return found

    def _read(self, now: Instant) -> Instant:
        """Note a state that the run goes on from; returns it as events leave it."""
        if self._strike(now) | self._turn_loads(now.time) or self._events.at(now.time):
            self._energy.go_on_from(now.energies.work, self._now)
            self._begin(now)
            after = self._measure(now.time, self._now)
            # What a fault lets go is lost; nothing moves while it strikes.
            lost = now.energies.lost + (now.energies.elastic - after.energies.elastic)
            energies = after.energies._replace(lost=lost, driven=now.energies.driven)
            now = replace(after, energies=energies)
        self._energy.keep()
        self.history.note(self._readings.read(now, self._now, self._strains))
        return now

    def _turn_loads(self, time: float) -> bool:
        """Turn the loads round if it is time (s); returns whether it was."""
        due = self._turn <= time + AT_ONCE
        if due:
            self._turn = math.inf
            self._model.turn_loads()
        return due

    def _strike(self, now: Instant) -> bool:
        """Strike all faults that are due; returns whether there was one."""
        due, model, chain = self._faults.due(now.time), self._model, self._now.chain
        if not due:
            return False
        hit = Struck(self._scene.structure.planes, model.laws.switches, np.pi - now.angles)
        if model.cables is not None and chain is not None:
            hit.ropes, hit.stored, hit.wound = model.cables.ropes, chain.stored, chain.wound
        for fault in due:
            fault.strike(hit)
        model.laws.follow()
        if model.cables is not None:
            model.cables.take(hit.ropes)
        return True

    def _measure(self, time: float, state: State) -> Instant:
        """A state, with its cables, and what has passed since the one that was kept last."""
        cables = self._model.cables
        if cables is not None:
            state.chain = cables.state(time, state.place.lines, state.rate.lines)
        return self._told(time, state)

    def _told(self, time: float, state: State) -> Instant:
        """A state whose chain is known."""
        model, chain = self._model, state.chain
        tensions, stretch, driven = None, 0.0, math.isfinite(self._faults.next_time)
        if model.cables is not None and chain is not None:
            tensions = chain.tensions
            stretch = float(np.max(chain.strains, where=chain.ropes.alive, initial=0.0))
            driven = driven or model.cables.winches.driving(time, chain)
        angles, rates = model.openings.read(state.pose.angle, state.rate.angles)
        energies = self._energy.read(time, state, self._strains)
        gap = model.gap(state.pose)
        return Instant(time, angles, rates, energies, gap, tensions, stretch, driven)


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
        switches = self._model.laws.switches
        return {
            key: float(switches.setting[number][switches.laws[number].places.index(place)])
            for number, place, key in _of_faults(switches)
            if switches.on[number].any()
        }

    def memory(self) -> Memory:
        """See ``Remembering``: all that the next step depends on, but step control."""
        now, model, cables = self._now, self._model, self._model.cables
        memory = super().memory() | {
            "state": now.memory(),
            "latches": self._latches.memory(),
            "energy": self._energy.memory(),
            "reaction": getattr(model, "reaction", None),
            "settings": [[*key, value] for key, value in self._settings().items()],
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
        model.laws = JointLaws(model.skeleton, model.openings)
        switches, planes = model.laws.switches, self._scene.structure.planes
        unknown = np.full(self._control.now.angles.shape, math.nan)
        own = Struck(planes, switches, unknown)
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
        cables, memory, scene = self._model.cables, start.memory, start.scene
        assert cables is not None
        assert scene.cables is not None
        ropes = Ropes(cables.ropes.points_per_cable, *memory["ropes"])
        own = Struck(
            scene.structure.planes,
            self._model.laws.switches,
            np.pi - self._control.now.angles,
            ropes,
        )
        for fault in gone:
            try:
                fault.clear(own)
            except ValueError as error:
                raise InputError(str(error)) from error
        wound, rate = memory["wound"]
        before = [cable for _, cable in scene.cables.present()]
        cables.winches.go_on(memory["winches"], before, start.time, wound, rate)
        place, moving = self._now.place.lines, self._now.rate.lines
        return cables.go_on(own.ropes, place, moving, wound, rate)


def _of_faults(switches: Switches) -> Iterator[tuple[int, Place, tuple[Any, ...]]]:
    """Numbers of the laws that faults bring, with their V-joints and what tells them apart."""
    for number, law in enumerate(switches.laws):
        if isinstance(law.record, Fault):
            for place in law.places:
                yield number, place, (law.group, *place, law.record.time)
