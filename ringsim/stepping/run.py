"""What happens between the steps of a run, whichever engine takes them."""

import math
from bisect import bisect_right
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ringsim.parts.faults import AT_ONCE, Faults, Struck
from ringsim.stepping.control import RunControl
from ringsim.stepping.guard import SLIGHT
from ringsim.stepping.instant import (
    Array,
    Energies,
    Instant,
    Remembering,
    Scales,
    Strained,
    Watch,
)
from ringsim.stepping.locks import Latches, locks_of

if TYPE_CHECKING:
    from ringsim.cable.chain import ChainState
    from ringsim.cable.records import Cable
    from ringsim.cable.ropes import Ropes
    from ringsim.core.winches import Winches
    from ringsim.outputs.recorder import Recorder
    from ringsim.parts.laws import Switches
    from ringsim.scene import Scene

# The times at which something begins, ends or breaks in a scene: steps end there.
#
# What acts in a step is smooth within it: a law counts by its left side up to an event, by its
# right side from there on.  Times that only a run finds, those of locks, are in
# ``ringsim.stepping.locks``.


class Events:
    """The events of a scene; ``times`` are increasing, s, and at ``switches`` winches start or
    stop, or their speeds jump.
    """

    def __init__(self, scene: "Scene") -> None:
        """Faults strike, loads turn round, winches start and stop, and their laws bend, see
        ``Winch.breaks``.
        """
        cables = () if scene.cables is None else (cable for _, cable in scene.cables.present())
        winches = [winch for cable in cables for winch in cable.winches]
        self.switches = {time for winch in winches for time in winch.jumps()}
        found = {fault.time for fault in scene.faults} | {scene.loads_turn_at} - {math.inf}
        found.update(time for winch in winches for time in winch.breaks())
        self.times = sorted(time for time in found if time > AT_ONCE)

    def after(self, time: float) -> float:
        """The first event behind a time, s, and not at once with it; infinite if there is none."""
        number = bisect_right(self.times, time + AT_ONCE)
        return self.times[number] if number < len(self.times) else math.inf

    def at(self, time: float) -> bool:
        """Whether there is an event at a time (s), or at once with it."""
        return self.after(time - 2.0 * AT_ONCE) <= time + AT_ONCE


def jolts_of(scene: "Scene") -> list[float]:
    """Times (s) at which forces jump: faults strike, or loads turn round."""
    return [*(fault.time for fault in scene.faults if fault.jolts), scene.loads_turn_at]


# What a run asks of an engine beside the state, which each has in its own form.


class Model(Protocol):
    """What is moved."""

    def turn_loads(self) -> None:
        """Let the forces of ``Loads`` act the other way round."""


class Meter(Protocol):
    """What counts the work that is done on the model."""

    def keep(self) -> None:
        """Go on from what was read last."""

    def go_on_from(self, work: Any, state: Any) -> None:
        """Count from a state on, with the work done until there."""


class Cables(Protocol):
    """Ropes and winches of the model."""

    ropes: "Ropes"
    winches: "Winches"

    @property
    def present(self) -> "list[tuple[int, Cable]]":
        """The cables with the planes that they are in."""

    def take(self, ropes: "Ropes") -> None:
        """Go on with ropes that a fault may have changed."""

    def begin(self, time: float, state: "ChainState", slopes: Array) -> None:
        """Begin a step at a time (s), with the slopes of the ideal paths, m/rad."""


class Laws(Protocol):
    """Laws on V-joints."""

    @property
    def switches(self) -> "Switches":
        """Which of them act."""

    def follow(self) -> None:
        """Take what acts from the switches."""


# The run.


class Run(Remembering):
    """Faults, loads that turn round, winches, latches and records of one run.

    An engine takes the steps, and gives what the methods below that raise ask it for.  Between two
    steps the state stays where it is while faults strike and laws change.

    Attributes
    ----------
    _scene, _watch
        What is run; what is shown every state that it goes on from, or None.
    model, _energy, _cables
        The engine's model, its meter of energies, and its cables, None without.
    history
        The recorder of the run.
    """

    model: Model
    _energy: Meter
    _cables: Cables | None
    history: "Recorder"

    def __init__(self, scene: "Scene", watch: Watch | None) -> None:
        self._scene, self._watch = scene, watch
        self._faults, self._events = Faults(scene.faults), Events(scene)
        self._sampler = None if scene.controller is None else scene.controller.sampler(scene)
        self._turn = scene.loads_turn_at
        self._held = np.zeros(0, dtype=bool)

    def _set_out(self, first: Instant, scales: Scales, strained: Strained) -> None:
        """Begin with the first state; a ``history`` stands ready."""
        scene = self._scene
        self.history.slight = SLIGHT * scales.energy
        self._latches = Latches(scene)
        self._locks = locks_of(scene, first.angles, self._latches)
        self._control = RunControl(
            scene.solver,
            scales,
            self._read(first, arrived=False),
            self._locks,
            limits=scene.limits,
            follow_deviations=scene.record.stress,
            turn=scene.loads_turn_at,
            strained=strained,
            sampled=self._sampler is not None,
            jolts=jolts_of(scene) if scene.record.reactions or scene.record.accelerations else None,
        )

    # What an engine gives.

    @property
    def state(self) -> Any:
        """The state that the run goes on from, as the meter of energies takes it."""
        raise NotImplementedError

    @property
    def _at(self) -> "ChainState | None":
        """The chain of the cables there, None without."""
        raise NotImplementedError

    @property
    def _laws(self) -> Laws:
        """The laws on V-joints, with their ``switches`` and what lets the engine ``follow``."""
        raise NotImplementedError

    def _measured(self, time: float) -> Instant:
        """That state, after what has changed."""
        raise NotImplementedError

    def _reading(self, now: Instant) -> Any:
        """What outputs read of it."""
        raise NotImplementedError

    # What happens.

    def _next_event(self) -> float:
        """Time that no step may pass, s."""
        now = self._control.now.time
        due = self._events.after(now)
        if self._sampler is None:
            return due
        bend = math.inf if self._cables is None else self._cables.winches.next_bend(now)
        return min(due, bend, self._sampler.next_time)

    def _begin(self, now: Instant) -> None:
        """Let winches begin a step."""
        cables, chain = self._cables, self._at
        if cables is None or chain is None:
            return

        def path_slope(number: int) -> float:
            plane, cable = cables.present[number]
            return float(self._scene.structure.path_slope(cable, now.angles[plane]))

        cables.begin(now.time, chain, cables.winches.path_slopes(path_slope))

    def _told(
        self,
        time: float,
        angles: Array,
        rates: Array,
        energies: Energies,
        gap: float,
        chain: "ChainState | None",
    ) -> Instant:
        """A state with its ropes, and whether anything still drives it."""
        # What comes behind the end drives nothing.
        end = self._scene.solver.end_time
        tensions, stretch, driven = None, 0.0, self._faults.next_time < end
        if self._cables is not None and chain is not None:
            tensions = chain.tensions
            stretch = max([0.0, *chain.strains[chain.ropes.alive].tolist()])
            driven = driven or self._cables.winches.driving(time, chain, end)
        return Instant(time, angles, rates, energies, gap, tensions, stretch, driven)

    def _read(self, now: Instant, *, arrived: bool = True) -> Instant:
        """Note a state that the run goes on from; returns it as events leave it.

        One that a step has ``arrived`` at is noted before events that may jump, and after those
        that have: two readings of one time.
        """
        noted = arrived and self._may_jump(now.time)
        if noted:
            self.history.note(self._reading(now))
        changed = self._strike(now) | self._turn_loads(now.time) | self._command(now)
        if changed or self._events.at(now.time):
            self._energy.go_on_from(now.energies.work, self.state)
            self._begin(now)
            after, before = self._measured(now.time), now.energies
            # What a fault lets go is lost; nothing moves while it strikes.
            gone = before.elastic - after.energies.elastic
            energies = after.energies._replace(lost=before.lost + gone, driven=before.driven)
            now = replace(after, energies=energies)
            if noted:
                own = replace(now, energies=energies._replace(lost=gone, driven=0.0))
                self.history.note(self._reading(own))
        self._energy.keep()
        if not noted:
            self.history.note(self._reading(now))
        return now

    def _may_jump(self, time: float) -> bool:
        """Whether forces, or what winches do, may jump at a time (s)."""
        due = [self._faults.next_time, self._turn]
        due += [] if self._sampler is None else [self._sampler.next_time]
        switched = any(abs(time - each) <= AT_ONCE for each in self._events.switches)
        return switched or min(due) <= time + AT_ONCE

    def _strike(self, now: Instant) -> bool:
        """Strike all faults that are due; returns whether there was one."""
        due, chain = self._faults.due(now.time), self._at
        if not due:
            return False
        hit = Struck(self._scene.structure.planes, self._laws.switches, np.pi - now.angles)
        if self._cables is not None and chain is not None:
            hit.ropes, hit.stored, hit.wound = self._cables.ropes, chain.stored, chain.wound
        hit.encoders = None if self._sampler is None else self._sampler.encoders
        for fault in due:
            fault.strike(hit)
        self._laws.follow()
        if self._cables is not None:
            self._cables.take(hit.ropes)
        return True

    def _command(self, now: Instant) -> bool:
        """Let the controller sample; returns whether a winch has another law since."""
        if self._sampler is None:
            return False
        speeds = self._sampler.due(now.time, now.angles, self._at)
        if self._cables is None or not speeds:  # who looks on has no winches
            return False
        return self._cables.winches.command(now.time, speeds)

    def _turn_loads(self, time: float) -> bool:
        """Turn the loads round if it is time (s); returns whether it was."""
        due = self._turn <= time + AT_ONCE
        if due:
            self._turn = math.inf
            self.model.turn_loads()
        return bool(due)

    def _accepted(self, found: Instant) -> bool:
        """Go on from a state that a step has led to; returns whether the run goes on."""
        goes_on = self._control.accept(found, self._read(found))
        if self._watch is not None:
            self._watch(self._control.now)
        self._latch(found.time)
        return goes_on

    def _latch(self, time: float) -> None:
        """Latch the V-joints that have locked, and let winches know whose plane has."""
        if self._locks is None:
            return
        locked, chain = self._latches.locked(self._locks.deployed), self._at
        if np.array_equal(locked, self._held):
            return
        self._held = locked.copy()
        self._latches.hold(self._laws.switches)
        self._laws.follow()
        if self._cables is not None and chain is not None:
            for number, (plane, _) in enumerate(self._cables.present):
                if locked[plane].all():
                    self._cables.winches.lock(number, time, chain)

    def _conclude(self, note: str = "") -> Any:
        """The history, with how the run has ended; ``note`` follows the reason."""
        control, history = self._control, self.history
        control.conclude()
        history.status, history.fate = control.status, control.fate
        history.reason, history.repeats = control.reason + note, control.repeats
        history.caught = self._latches.caught
        return history
