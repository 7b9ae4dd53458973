"""Time integration of a scene in joint coordinates; ``ringsim.stepping`` decides on the steps."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ringsim.cable.faults.family import CableFault
from ringsim.cable.state import work_between
from ringsim.frame.kernels import Strains, kinetic_energy, move, moved_between, straighten
from ringsim.frame.model import FrameModel, State
from ringsim.frame.stresses import StressMeter
from ringsim.layout.pose import Array
from ringsim.outputs.recorder import Recorder
from ringsim.outputs.series import Reading
from ringsim.parts.faults.stuck_vjoint import StuckVJoint
from ringsim.scene import Scene
from ringsim.stepping.instant import Energies, Instant
from ringsim.stepping.locks import Locks
from ringsim.stepping.run_control import RunControl
from ringsim.theory.scales import scales_of
from ringsim.variables import Outcome

_MOST = 25
"""Newton iterations a step at most, as of the full model."""
_FALL = 0.3
"""Ratio of successive residuals above which the tangent is renewed: one more iteration costs a
third of a tangent."""
_DESCENT = 0.9
"""Ratio of successive residuals above which half the change is tried, and half of that ..."""
_SMALLEST_SHARE = 0.1
"""... down to a sixteenth: by then the tangent of the other side is better."""
_SHORTEST = 1e-9
"""Step (s) below which a run is given up, as of the full model."""

Watch = Callable[[Instant], None]


def solve(scene: Scene, watch: Watch | None = None) -> Outcome:
    """Run a scene.  A solve that fails is a status, not an exception.

    InputError if the scene has what frames do not represent.
    """
    return Integration(FrameModel(scene), watch).run().outcome()


class _NoStep(Exception):
    """Newton found no balance; why."""


class Integration:
    """One run of a model."""

    def __init__(self, model: FrameModel, watch: Watch | None = None) -> None:
        self._model, self._scene, self._watch = model, model.scene, watch
        scene = model.scene
        self._now, self._past = model.start, []
        self._begun: list[tuple[float, Array]] = []
        self._faults = sorted(scene.faults, key=lambda fault: fault.time)
        elements = len(model.mesh.length)
        self._strains = Strains(np.zeros((elements, 6)), np.zeros((elements, 6)), 0.0)
        self._kept = (np.zeros((elements, 6)),) * 2
        stowed = None if scene.stop is None else math.radians(scene.stop.stowed_angle)
        self._reference = model.start.pose.place.copy()
        angles, _ = model.openings.read(
            model.start.pose.angle, np.zeros_like(model.start.pose.angle)
        )
        self._locks = (
            Locks(angles, stowed, scene.structure.planes) if scene.structure.locks else None
        )
        coordinates = {"rod": np.array(list(model.layout.halves()))}
        self.history = Recorder(scene, coordinates)
        self._stress = StressMeter(model.mesh, model.layout) if scene.record.stress else None
        self.newton_iterations = self.tangents = 0
        self._drift = 0.0
        self._lossy: tuple[Array, ...] | None = None
        ropes = None
        if model.cables is not None:
            ropes = model.cables.ropes.content
        self._control = RunControl(
            scene.solver,
            scales_of(scene, model.layout, ropes),
            self._read(self._measure(0.0, self._now, self._now, self._strains)),
            self._locks,
            limits=scene.limits,
            follow_deviations=scene.record.stress,
        )

    def run(self) -> Recorder:
        """Integrate until all V-joints have locked and settled, or to the end time."""
        control, model = self._control, self._model
        while control.goes_on:
            step = control.next_step(self._faults[0].time if self._faults else math.inf)
            self._begin()
            while True:
                try:
                    after, found = self._try(step)
                except _NoStep as reason:
                    step = control.retry(0.5 * step)
                    if step < _SHORTEST:
                        control.fail(str(reason))
                        break
                    continue
                if control.shorter(found) is None:
                    self._accept(step, after, found)
                    break
                step = control.retry(step)
        control.conclude()
        history = self.history
        history.status, history.fate = control.status, control.fate
        history.reason, history.repeats = control.reason, control.repeats
        history.newton_iterations, history.jacobians = self.newton_iterations, self.tangents
        return history

    def _begin(self) -> None:
        """Let the winches begin a step."""
        model, now = self._model, self._control.now
        if model.cables is not None and self._now.chain is not None:
            slope = self._scene.structure.path_slope
            slopes = [slope(cable, now.angles[plane]) for plane, cable in model.cables.present]
            model.cables.winches.advance(now.time, self._now.chain, np.array(slopes))

    def _try(self, step: float) -> tuple[State, Instant]:
        """The state a step later."""
        time = self._control.now.time + step
        after = self._now.copy()
        self._move(after, self._guess(step))
        self._strains = self._damped(step, after)
        self._newton(time, step, after)
        return after, self._measure(time, self._now, after, self._strains)

    def _damped(self, step: float, after: State) -> Strains:
        """How the rates of strains follow from strains: BDF2, as of ``engine.rod_dampers``."""
        now = self._now.strains
        if len(self._past) < 1:
            return Strains(after.strains, -now / step, 1.0 / step)
        last, before = self._past[-1]
        r = step / last
        lead = (1.0 + 2.0 * r) / (step * (1.0 + r))
        rest = -(1.0 + r) / step * now + r**2 / (step * (1.0 + r)) * before
        return Strains(after.strains, rest, lead)

    def _newton(self, time: float, step: float, after: State) -> None:
        """Newton's method with a line search, in place: where forces bend sharply, as of stops and
        of pulleys whose friction turns round, a whole step may lead as far to the other side.
        """
        model, factored, last, share = self._model, None, math.inf, 1.0
        begun, change, fresh = after.stand(), np.zeros(0), False
        tolerance = max(model.tolerance, model.reached(step, self._strains))
        for _ in range(_MOST):
            try:
                g = model.residual(time, step, self._now, after, self._strains)
            except ValueError as error:
                raise _NoStep(str(error)) from error
            norm = float(np.sqrt(g @ g))
            if not math.isfinite(norm):
                raise _NoStep("the state is not finite")
            if norm <= tolerance:
                return
            self.newton_iterations += 1
            if fresh and norm > _DESCENT * last and share > _SMALLEST_SHARE:
                share *= 0.5
                after.take(begun)
                self._move(after, share * change)
                continue
            fresh = factored is None or norm > _FALL * last
            if factored is None or fresh:
                factored = model.tangent(time, step, after, self._strains)
                self.tangents += 1
                if not factored.sound:
                    raise _NoStep("a pivot of the tangent is too small")
            last, share, begun = norm, 1.0, after.stand()
            change = factored.solve(g)
            self._move(after, change)
        raise _NoStep(
            f"Newton's residual is {norm:.3g} N after {_MOST} iterations, step {step:.3g} s"
        )

    def _move(self, state: State, by: Array) -> None:
        move(self._model.mesh, state.pose, by[: self._model.mesh.unknowns])
        if self._model.strings is not None:
            state.hub += by[-3:]

    def _guess(self, step: float) -> Array:
        """Change of all unknowns over a step: means over the last two steps, extrapolated."""
        if not self._begun:
            return 0.5 * step**2 * self._model.first
        last, moved = self._begun[-1]
        if len(self._begun) == 1:
            # From rest, twice the mean is the rate at the end.
            rate = (2.0 + step / last) * moved / last
            return step * rate
        before, earlier = self._begun[-2]
        bend = (moved / last - earlier / before) * (step + last) / (last + before)
        return step * (moved / last + bend)

    def _accept(self, step: float, after: State, found: Instant) -> None:
        model, before = self._model, self._now
        self._begun = [*self._begun[-1:], (step, self._between(before, after))]
        self._past = [*self._past[-1:], (step, before.strains)]
        self._drift = max(self._drift, float(straighten(after.pose)))
        self._now = after
        self._lossy = self._passing
        control = self._control
        goes_on = control.accept(found, self._read(found))
        if self._watch is not None:
            self._watch(control.now)
        if self._locks is not None:
            model.laws.latch(self._locks.deployed)
            if model.cables is not None and self._now.chain is not None:
                for number, (plane, _) in enumerate(model.cables.present):
                    if self._locks.deployed[plane].all():
                        model.cables.winches.lock(number, found.time, self._now.chain)
        del goes_on

    def _between(self, before: State, after: State) -> Array:
        """Changes of all unknowns."""
        found = np.zeros(self._model.size)
        moved_between(self._model.mesh, before.pose, after.pose, found)
        if self._model.strings is not None:
            found[-3:] = after.hub - before.hub
        return found

    def _read(self, now: Instant) -> Instant:
        """Note a state that the run goes on from; returns it as faults that strike leave it."""
        due = [one for one in self._faults if one.time <= now.time + 1e-12]
        if due:
            del self._faults[: len(due)]
            for fault in due:
                if isinstance(fault, StuckVJoint):
                    plane = self._scene.structure.planes.index(fault.plane)
                    place = plane, fault.section - 1
                    self._model.laws.stick(fault, place, float(now.angles[place]))
                elif isinstance(fault, CableFault) and self._model.cables is not None:
                    assert self._now.chain is not None
                    self._model.cables.strike(fault, self._now.chain)
            after = self._measure(now.time, self._now, self._now, self._strains)
            lost = now.energies.lost + (now.energies.elastic - after.energies.elastic)
            energies = after.energies._replace(lost=lost, driven=now.energies.driven)
            now = replace(after, energies=energies)
        chain, cables = self._now.chain, self._model.cables
        self.history.note(
            Reading(
                **vars(now),
                chain=chain,
                planes=() if cables is None else tuple((plane,) for plane, _ in cables.present),
                stress=None if self._stress is None else self._stress.read(self._strains),
                strain=None,
            )
        )
        return now

    def _measure(self, time: float, before: State, state: State, strains: Strains) -> Instant:
        """A state with its energies, and what has passed since ``before``."""
        model, mesh = self._model, self._model.mesh
        rate = state.followed.rate
        angles, rates = model.openings.read(state.pose.angle, model.part(rate, 2))
        kinetic = kinetic_energy(mesh, model.part(rate, 0))
        elastic = 0.5 * float(np.sum(mesh.stiffness * state.strains**2))
        torques = model.laws.torques(state.pose.angle, model.part(rate, 2))
        elastic += torques.stored + sum(slide.stored(state.pose) for slide in model.slides)
        pushing, moved = [torques.lost], [state.pose.angle]
        if model.strings is not None:
            _, stored, lost, lengths = model.strings.pulls(*model._net_at(state))
            elastic += stored
            hub_rate = model.part(rate, 4)[0]
            kinetic += 0.5 * model.strings.hub_mass * float(hub_rate @ hub_rate)
            pushing.append(lost)
            moved.append(lengths)
        if mesh.tau > 0.0:
            rates_of_strain = strains.lead * state.strains + strains.before
            pushing.append((mesh.tau * mesh.stiffness * rates_of_strain).ravel())
            moved.append(state.strains.ravel())
        forces, places = np.concatenate(pushing), np.concatenate(moved)
        lost = driven = 0.0
        if state is not before and self._lossy is not None:
            old_forces, old_places = self._lossy
            lost = 0.5 * float((forces + old_forces) @ (places - old_places))
        tensions, stretch = None, 0.0
        moving = bool(self._faults)
        if model.cables is not None:
            place = state.followed.place
            state.chain = model.cables.state(time, model.part(place, 1), model.part(rate, 1))
            elastic += float(state.chain.elastic_energy.sum())
            if state is not before and before.chain is not None:
                driven, rubbed = work_between(before.chain, state.chain)
                lost += rubbed
            tensions = state.chain.tensions
            alive = state.chain.ropes.alive
            stretch = float(np.max(state.chain.strains, where=alive, initial=0.0))
            moving = moving or model.cables.winches.driving(time, state.chain)
        self._passing = forces, places
        if state is before:
            self._lossy = self._passing
        work = sum(
            float(force @ (state.pose.place[f] - self._reference[f])) for f, force in model.loaded
        )
        energies = Energies(float(kinetic), elastic, work, lost, driven)
        gap = max((slide.size(state.pose) for slide in model.slides), default=0.0)
        return Instant(time, angles, rates, energies, gap, tensions, stretch, moving)
