"""The ideal ring in motion: one system of ordinary differential equations.

The state holds the free coordinates and their rates; the direction up along the core's axes and the
core's rotation, where loads act on a base that floats (they stay vertical while the ring tilts;
without them it has no angular momentum); the rope wound by each winch with feedback, and its speed;
and the energies lost and supplied so far.
"""

import math
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np

from ringsim.cable.faults.family import CableFault
from ringsim.cable.ropes import Ropes
from ringsim.layout.pose import Array, skew
from ringsim.parts.faults.failed_spring import FailedSpring
from ringsim.parts.faults.family import Fault
from ringsim.scene import Scene
from ringsim.theory.ideal_forces import Acting, Forces, IdealCables, Pull
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.ideal_points import UP

MOTOR_LAG = 1e-6
"""Time constant in s with which a motor follows its law's command: the law depends on the tension,
which depends on the speed, and without this lag both would have to be solved together.  Cables
oscillate within milliseconds."""
_ANGLE, _RATE = 1e-6, 1e-4
"""Largest increments of angles (rad) and rates (rad/s) for derivatives of the equations."""


class IdealState(NamedTuple):
    """Accelerations of the free coordinates and of the core's rotation (rad/s^2), that rotation
    (rad/s), kinetic energy (J), and what acts.
    """

    acceleration: Array
    spin_rate: Array
    spin: Array
    kinetic: float
    acting: Acting
    pull: Pull | None
    reaction: Array | None = None
    """Force (N) and torque (N m) of a fixed base, shape (2, 3); None unless recorded."""

    @property
    def stretch(self) -> float:
        """Largest strain of a rope that is not cut; 0 without cables."""
        if self.pull is None:
            return 0.0
        chain = self.pull.chain
        return float(np.max(chain.strains, where=chain.ropes.alive, initial=0.0))

    @property
    def elastic(self) -> float:
        """Energy stored in net, stops and cables, J."""
        return self.acting.elastic + (0.0 if self.pull is None else self.pull.elastic)


class IdealMotion:
    """The equations of a scene's ideal ring.

    ``latched`` is whether latches hold; ``refusal`` why the cables could last not be evaluated.
    """

    def __init__(self, scene: Scene) -> None:
        self.mechanism = Mechanism(scene)
        self.forces = Forces(scene, self.mechanism)
        self.cables = None if scene.cables is None else IdealCables(scene, self.mechanism)
        self.latched, self._until, self.refusal = False, math.inf, ""
        self._last: tuple[tuple[float, bytes], IdealState] | None = None
        self._initial = scene.structure.coordinate
        n = self.mechanism.freedom
        self._reacts = self.mechanism.fixed and scene.record.reactions
        self._tilts = not self.mechanism.fixed and self.forces.loaded
        tilt = 3 if self._tilts else 0
        motors = 0 if self.cables is None else 2 * len(self.cables.answering)
        ends = accumulate([0, n, n, tilt, tilt, motors])
        parts = [slice(*pair) for pair in pairwise(ends)]
        self._place, self._rate, self._up, self._spin, self._motors = parts
        self.size = parts[-1].stop + 2

    def start(self) -> Array:
        """State of the ring released at rest."""
        state = np.zeros(self.size)
        state[0] = self._initial
        if self._tilts:
            state[self._up] = UP
        return state

    def instant(self, time: float, state: Array) -> IdealState:
        """Evaluate everything; ValueError if the cables have no answer (ringsim.cable.chain)."""
        # The solver, its Jacobian and its events ask for the same end of a step.
        asked = time, state.tobytes()
        if self._last is None or self._last[0] != asked:
            self._last = asked, self._evaluated(time, state)
        return self._last[1]

    def under(
        self, *, latched: bool | None = None, until: float | None = None,
        ropes: Ropes | None = None, sprung: Array | None = None,
    ) -> None:  # fmt: skip
        """Go on with what is given: whether latches hold, the time (s) of the next switching from
        before which laws of winches are taken, ropes, and springs that are ``alive``.
        """
        self._last = None
        self.latched = self.latched if latched is None else latched
        self._until = self._until if until is None else until
        if sprung is not None:
            self.forces.springs.alive = sprung
        if self.cables is not None and ropes is not None:
            self.cables.ropes = ropes

    def lock(self, time: float) -> None:
        """All V-joints have locked at a time (s)."""
        self._last = None
        if self.cables is not None:
            self.cables.lock(time)

    def _evaluated(self, time: float, state: Array) -> IdealState:
        mechanism = self.mechanism
        now = mechanism.configuration(state[self._place], state[self._rate])
        rigid = mechanism.rigid_rates(now, state[self._spin] if self._tilts else None)
        up = state[self._up] if self._tilts else mechanism.vertical(now)
        acting = self.forces.act(now, up, self.latched)
        force, pull = acting.force, None
        if self.cables is not None:
            earlier = min(time, self._until * (1.0 - 1e-12))
            pull = self.cables.pull(earlier, now, state[self._motors].reshape(2, -1))
            force = force + pull.force
        moving, turning = mechanism.accelerations(now, rigid[3:], acting.couple, force)
        rates = np.concatenate([rigid, now.rate])
        kinetic = 0.5 * float(rates @ now.matrix @ rates)
        held = None
        if self._reacts:
            held = mechanism.reaction(now, rigid[3:], acting.couple, force, moving)
        return IdealState(moving, turning, rigid[3:], kinetic, acting, pull, held)

    def edge_tensions(self, state: Array) -> Array | None:
        """Of cables along a net's edge, N, shape (planes, sections); None without."""
        if self.mechanism.points.layout.edge is None:
            return None
        now = self.mechanism.configuration(state[self._place], state[self._rate])
        return self.mechanism.net_tensions(now)

    def rates(self, time: float, state: Array) -> Array:
        """Derivative of the state; NaN where the cables have no answer."""
        if not np.isfinite(state).all():
            return np.full(self.size, math.nan)
        try:
            now = self.instant(time, state)
        except ValueError as error:
            self.refusal = str(error)
            return np.full(self.size, math.nan)
        found = np.empty(self.size)
        found[self._place] = state[self._rate]
        found[self._rate] = now.acceleration
        if self._tilts:
            found[self._up] = -skew(now.spin) @ state[self._up]
            found[self._spin] = now.spin_rate
        found[-2:] = now.acting.loss, 0.0
        if now.pull is not None:
            speeds = state[self._motors].reshape(2, -1)[1]
            found[self._motors] = [*speeds, *((now.pull.commands - speeds) / MOTOR_LAG)]
            found[-2:] += now.pull.loss, now.pull.power
        return found

    def jacobian(self, time: float, state: Array) -> Array:
        """Derivatives of the rates by differences; nothing depends on the energies."""
        found = np.zeros((self.size, self.size))
        here = self.rates(time, state)
        kept = self._last
        length, slip = (math.inf, math.inf) if self.cables is None else self.cables.nudges
        steps = np.full(self.size - 2, _ANGLE)
        steps[0] = steps[self._motors] = min(_ANGLE, length)
        steps[self._rate] = min(_RATE, slip, 1e-3 * self.forces.slowest)
        for k, step in enumerate(steps):
            moved = state.copy()
            moved[k] += step
            found[:, k] = (self.rates(time, moved) - here) / (moved[k] - state[k])
        self._last = kept
        return found

    def strike(self, fault: Fault, time: float, state: Array) -> Array:
        """The state after a fault; the energy that it lets go counts as lost."""
        before = self.instant(time, state)
        if isinstance(fault, FailedSpring):
            self.forces.springs.fail(fault.plane, fault.section)
        elif isinstance(fault, CableFault) and self.cables is not None:
            assert before.pull is not None
            self.cables.ropes = fault.strike(self.cables.ropes, before.pull.chain)
        self._last = None
        found = state.copy()
        found[-2] += before.elastic - self.instant(time, state).elastic
        return found

    def tolerances(self, relative: float) -> Array:
        """Absolute tolerance of every part of the state, for a relative one."""
        n = self.mechanism.freedom
        found = np.full(self.size, 0.01 * relative)
        # Coarser for the swings: an end assembly is light, and friction on its pins is stiff.
        found[1:n], found[n + 1 : 2 * n] = 0.3 * relative, 3.0 * relative
        found[-2:] = 1e-3 * relative
        return found
