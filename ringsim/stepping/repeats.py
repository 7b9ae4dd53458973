"""Steps that are repeated with a smaller one, and what they are judged by."""

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.faults import AT_ONCE
from ringsim.parts.solver import TENSION_BEND, Solver
from ringsim.stepping.instant import Array, Energies, Instant, Memory, Remembering, Scales
from ringsim.stepping.locks import StopContact, lock_times

# Steps across which an indicator exceeds its allowance are repeated with a smaller one.
#
# An indicator falls with the p-th power of the step.  The controller is the standard one of step
# sizes: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.4, where
# such a safety factor and bounds of the ratio stand, too.


GROWTH, FALL = 1.5, 0.2
"""Largest and smallest ratio of successive steps: a step behind a much shorter one would see that
one's vibrations, and what is found across a kink says little about the step that resolves it."""
SHORTEST = 1e-4
"""No step is repeated below this share of ``solver.step``: what is left then is a jump, which no
step resolves, and exudyn ends a run whose steps fall below 1e-9 s."""
_REFUSED = 2.0
"""Indicator over its allowance from which on a step is repeated.  Between 1 and 2 it only shortens
the next one: a repeated step costs as much as a new one."""
_SAFETY = 0.8
"""On the step that the power law asks for: half of the allowance at p = 3."""
_ENERGY = 0.3
"""Imbalance allowed in a step over the tolerance times the energy exchanged so far: three impacts
may take all of the tolerance."""
_ALIKE = 3e-4
"""Tolerance (the default) at which ropes are allowed as much as impacts."""
PATIENCE = 300
"""Steps of a ring without cables that are repeated at the tolerance 1e-4; impacts need fewer."""


class Indicator(Remembering, ABC):
    """Judges steps by a number that must not exceed its allowance; ``limit`` is the largest next
    step in s, infinite before the first.
    """

    changing: ClassVar[tuple[str, ...]] = ("limit",)

    def __init__(self, solver: Solver) -> None:
        self.limit = math.inf
        self._least = SHORTEST * solver.step
        self._judged: tuple[Instant | None, float] = None, 0.0

    @abstractmethod
    def ratio(self, before: Instant, after: Instant) -> float:
        """Indicator of a step over its allowance; NaN where it is unknown."""

    @abstractmethod
    def share(self, ratio: float) -> float:
        """The safety factor times ratio^(-1/p)."""

    def shorter(self, before: Instant, after: Instant) -> float | None:
        """A smaller step in s to repeat this one with, or None if it is good enough."""
        step, ratio = after.time - before.time, self.ratio(before, after)
        self._judged = after, ratio
        # A step comes back as a difference of times: a little more than what was asked for.
        if not ratio > _REFUSED or step <= self._least * (1.0 + 1e-6):
            return None
        return max(step * max(FALL, self.share(ratio)), self._least)

    def accept(self, before: Instant, after: Instant, *, cut: bool = False) -> None:
        """Learn from a step that is taken; one that was ``cut`` at a sample of a controller ends
        where little happens, and if it is good the limit stays.
        """
        judged, ratio = self._judged
        step = after.time - before.time
        if after is not judged:
            ratio = self.ratio(before, after)
        # 1e-3 stands for 0: from 0.2 on down ``GROWTH`` bounds the step, whatever the ratio is.
        growth = min(max(self.share(max(ratio, 1e-3)), FALL), GROWTH)
        limit = max(step * growth, self._least) if math.isfinite(ratio) else math.inf
        self.limit = max(limit, self.limit) if cut and ratio <= 1.0 else limit

    def note(self) -> str:
        """What a run's reason must add about this; empty if every step was judged."""
        return ""


class EnergyImbalance(Indicator):
    """Steps that add or lose energy: the imbalance

        change of kinetic and elastic energy + lost - work of loads and winches.

    Without ropes at most ``PATIENCE`` steps are repeated.
    """

    changing = (*Indicator.changing, "_refused", "_work", "_stored", "_exchanged")

    def __init__(self, solver: Solver, scales: Scales) -> None:
        super().__init__(solver)
        self._refused = 0
        self._work, self._stored = 0.0, math.nan
        if scales.slack_energy is None:
            self._patience = PATIENCE * math.sqrt(max(1e-4 / solver.tolerance, 1.0))
            self._allowed, self._exchanged = _ENERGY * solver.tolerance, scales.energy
        else:
            self._patience, self._exchanged = math.inf, scales.slack_energy
            # N ~ 1/h steps that lack h^3 each add up to h^2, which is to go with the tolerance.
            self._allowed = _ENERGY * solver.tolerance * math.sqrt(solver.tolerance / _ALIKE)

    def ratio(self, before: Instant, after: Instant) -> float:
        """See ``Indicator``."""
        first, last = before.energies, after.energies
        stored = last.kinetic - first.kinetic + last.elastic - first.elastic
        imbalance = abs(stored + last.lost - (last.work - first.work + last.driven))
        return imbalance / (self._allowed * self._exchange(first, last))

    def share(self, ratio: float) -> float:
        """Of third order."""
        return _SAFETY * math.pow(ratio, -1.0 / 3.0)

    def shorter(self, before: Instant, after: Instant) -> float | None:
        """See ``Indicator``; None once patience has ended."""
        found = super().shorter(before, after) if self._refused < self._patience else None
        self._refused += found is not None
        return found

    def accept(self, before: Instant, after: Instant, *, cut: bool = False) -> None:
        """See ``Indicator``; adds to the energy exchanged."""
        super().accept(before, after, cut=cut)
        if self._refused >= self._patience:
            self.limit = math.inf
        first, last = before.energies, after.energies
        self._exchanged = self._exchange(first, last)
        self._work += last.work - first.work + last.driven

    def note(self) -> str:
        """See ``Indicator``."""
        if self._refused < self._patience:
            return ""
        return (
            f"; steps repeated to keep the energy balance: {self._refused}, further ones were "
            "accepted as they were: see energy_error"
        )

    def _exchange(self, first: Energies, last: Energies) -> float:
        """Largest energy exchanged up to the end of a step, J."""
        work = self._work + last.work - first.work + last.driven
        if math.isnan(self._stored):
            self._stored = first.elastic
        return max(self._exchanged, abs(work), last.kinetic, abs(last.elastic - self._stored))


class TensionBend(Indicator):
    """Steps across which a tension T bends too far.

    Against the straight line through the step before, of length h1, it bends over one of length h2
    by |T2 - T1 - (T1 - T0) h2 / h1|.
    """

    changing = (*Indicator.changing, "_largest", "_past")

    def __init__(self, solver: Solver, slack_tension: float) -> None:
        super().__init__(solver)
        self._allowed = TENSION_BEND * solver.tolerance
        self._largest = slack_tension  # counts as reached, so that ropes may become taut
        self._past: tuple[float, Array] | None = None

    def ratio(self, before: Instant, after: Instant) -> float:
        """See ``Indicator``; 0 where the bend is not known yet."""
        first, last = before.tensions, after.tensions
        if self._past is None or first is None or last is None:
            return 0.0
        earlier, past = self._past
        step = after.time - before.time
        bend = np.abs(last - first - (first - past) * (step / earlier)).max()
        return float(bend) / (self._allowed * max(self._largest, float(last.max())))

    def share(self, ratio: float) -> float:
        """Of second order."""
        return _SAFETY / math.sqrt(ratio)

    def accept(self, before: Instant, after: Instant, *, cut: bool = False) -> None:
        """See ``Indicator``; remembers the tensions."""
        super().accept(before, after, cut=cut)
        if before.tensions is not None and after.tensions is not None:
            self._largest = max(self._largest, float(after.tensions.max()))
            self._past = after.time - before.time, before.tensions


# Steps that resolve the shocks of locks.


FRONT = 64.0
"""Steps in the period of the slowest rod at a lock, at the tolerance ``_FRONT_AT`` or above."""
_FRONT_AT = 3e-3
"""That of the scenes with cables; below it steps go with its square root, as all others do."""
_FINEST_FRONT = 512.0
"""The same at most: with 6000, round-off of the places of a spacecraft of 500 kg was 1 N of base
force, which falls with the square of steps."""
GRADE = 16.0
"""Time since a lock over the next step: as the shock spreads through the rods it lasts longer.
docs/evidence/benchmarks.md has errors and costs of other values, on random rings, too."""
_RINGING = 1.0
"""Periods of the slowest rod for which this holds."""


class ShockSteps(Remembering):
    """Steps that halve on the way to each lock, and grow with the time since it: longer ones would
    not see its shock, or make of it what no rod does.  ``limit`` is the largest next step, s.
    """

    changing = ("limit", "_next", "_last")

    def __init__(self, solver: Solver, period: float, jolts: Sequence[float] = ()) -> None:
        """For rods whose slowest one has such a period (s); forces jump at the times ``jolts`` (s),
        at which steps end.
        """
        self._jolts = np.array(jolts)
        finer = min(1.0, math.sqrt(solver.tolerance / _FRONT_AT))
        self._step = period * max(finer / FRONT, 1.0 / _FINEST_FRONT)
        self._ringing = _RINGING * period
        self.limit, self._next, self._last = math.inf, math.inf, -math.inf

    def begin(self, now: Instant) -> None:
        """Begin where forces jump: they shake the rods as a lock does."""
        self._next, self._last, self.limit = math.inf, now.time, self._step

    def shorter(self, before: Instant, found: Instant, deployed: NDArray[np.bool_]) -> float | None:
        """A smaller step in s to repeat one with that leads more than half-way to the next lock, or
        beyond; None if it is short enough.
        """
        step = found.time - before.time
        if step <= self._step * (1.0 + 1e-6):
            return None
        self._next = found.time + _time_to_lock(before, found, deployed)
        wanted = self._towards(before.time)
        return wanted if step > _HARDLY * wanted else None

    def accept(self, now: Instant, *, locked: bool) -> None:
        """Learn from a step that is taken, in which V-joints have ``locked`` or not."""
        if locked or (np.abs(self._jolts - now.time) <= AT_ONCE).any():
            self._next, self._last = math.inf, now.time
        ahead = self._towards(now.time) if now.time < self._next else math.inf
        passed = now.time - self._last
        behind = max(self._step, passed / GRADE) if passed < self._ringing else math.inf
        self.limit = min(ahead, behind)

    def _towards(self, time: float) -> float:
        return max(0.5 * (self._next - time), self._step)


_HARDLY = 1.2
"""Ratio of steps up to which one is not repeated."""


def _time_to_lock(before: Instant, found: Instant, deployed: NDArray[np.bool_]) -> float:
    """Time (s) from the end of a step until the first V-joint locks that had not before, at the
    mean acceleration of the step; negative if one has locked in it, infinite if none will.
    """
    step, way = found.time - before.time, math.pi - found.angles
    ends = np.array([before.rates, found.rates])
    bend = (ends[1] - ends[0]) / step
    with np.errstate(invalid="ignore", divide="ignore"):
        left = 2.0 * way / (ends[1] + np.sqrt(ends[1] ** 2 + 2.0 * bend * way))
    left = np.where((left >= 0.0) & (way > 0.0), left, math.inf)
    if (crossed := (way <= 0.0) & ~deployed).any():
        known = np.array([before.time, found.time]), np.array([before.angles, found.angles]), ends
        left = np.where(crossed, lock_times(*known) - found.time, left)
    return float(np.where(deployed, math.inf, left).min())


# Steps that follow the mean opening angle and the joints' deviations from it, and meet stops.


_LOCAL_ERROR = 0.1
"""Local error constant C of the integrator, error = C h^3 d3(angle)/dt3.  Generalised-alpha has
beta - (alpha_f - alpha_m) / 2 - 1/6: 0.086 at the spectral radius 0.8, 1/12 at 1, 1/3 at 0."""
_FINEST = 400.0
"""The motion alone asks for no step below ``solver.step`` over this: noise of the rates must not
stop a run."""
_AT = 1e-4
"""Tolerance at which ``_DEPTH``, ``Scales.contact_step`` and the distance of readings hold; the
first two go with its square root, as all steps do."""
_DEPTH = math.radians(0.05)
"""Angle by which a V-joint may pass its stop within one step, at the tolerance ``_AT``.  On a ring
of 6 sections with cables four times as much moves the largest asynchrony by 2 % and trebles the
energy error; a quarter of it moves the asynchrony by 0.5 %."""
_FIRST = 20.0
"""The first step is ``solver.step`` over this at most: generalised-alpha starts from rest without
an acceleration, which delays the motion by a third of the first step."""
_ANEW = 10.0
"""The first step under other forces is so much shorter than one from rest: the integrator's
accelerations are still those of the forces before, also where these moved it."""
_APPROACH = 0.02
"""Largest first step over the time to the first stop, as it is chosen without knowing the motion: a
winch may take a ring that is nearly open to its stops within it."""
_GLOBAL_ERROR = _LOCAL_ERROR / 15.0
"""C of deviations.  Local errors of a vibration cancel for the most part: on rings of 6 and 18
sections errors against MBDyn are a fifteenth of what their sum would be, so that
``solver.deviation_tolerance`` is the error found there (docs/evidence/cross_validation.md)."""
MOST = 2000.0
"""Steps that the deviations may ask for over a run.  The ovalisation of 18 sections takes 1300, and
a shorter step would follow what Newton leaves of the residual."""
_LEAST = math.radians(1e-4)
"""Deviations below this are what Newton's tolerance leaves, rad."""
_FADING = 20.0
"""Steps over which the largest d''' fades, so that its passage through zero opens no step."""


class MotionSteps(Remembering):
    """Steps that keep the relative error in time of the mean opening angle a near a tolerance,

        h = sqrt(tolerance |a'| / (C |a'''|)),

    and that meet stops with small ones.  ``step`` is the one wanted next, s.
    """

    changing = ("step", "_bend", "_past")

    def __init__(self, solver: Solver, scales: Scales) -> None:
        self._solver, self._reference, self._bend = solver, scales.rate, 0.0
        finer, contact = math.sqrt(solver.tolerance / _AT), scales.contact_step
        contact = contact if math.isfinite(contact) else solver.step
        self._contact, self._depth = min(contact * finer, solver.step), _DEPTH * finer
        # Below ``_AT`` readings stay as far apart as at it: closer ones would see the rods vibrate.
        self._stride = max(1.0, math.sqrt(_AT / solver.tolerance))
        self._past: deque[tuple[float, float]] = deque()
        self.step = self._first = min(solver.step / _FIRST, scales.first_step)

    def recall(self, memory: Memory) -> None:
        """See ``Remembering``."""
        super().recall(memory)
        self.step = min(self.step, self._solver.step)

    def begin_anew(self) -> None:
        """Go on with other forces: nothing that is known tells how they move it."""
        self._past.clear()
        self.step = min(self.step, self._first / _ANEW)

    def advance(self, now: Instant, stops: StopContact) -> None:
        """Choose the step after an accepted one."""
        self._past.append((now.time, float(now.rates.sum()) / now.rates.size))
        wanted = max(self._from_motion(), self._solver.step / _FINEST)
        if stops.resting_rate > 0.0:
            wanted = max(min(wanted, self._depth / stops.resting_rate), self._contact)
        if math.isfinite(stops.time_to_next):
            meeting = max(self._depth / stops.rate_of_next, self._contact)
            wanted = min(wanted, max(0.5 * stops.time_to_next, meeting))
        self.step = min(wanted, GROWTH * self.step, self._solver.step)

    def towards(self, left: float) -> float:
        """The next step in s if only so much time is left to an event.

        It shares the rest with the one after it: behind a long step a tiny one would read
        velocities that are still the long one's.
        """
        if left <= self.step or left >= 2.0 * self.step:
            return min(self.step, left)
        return 0.5 * left

    def shorter_first(self, step: float, stops: Callable[[], StopContact]) -> float | None:
        """A smaller first step in s, where this one leads too close to a stop; else None."""
        if self._past or step <= SHORTEST * self._solver.step:
            return None
        return FALL * step if step > _APPROACH * (step + stops().time_to_next) else None

    def _from_motion(self) -> float:
        t2, r2 = self._past[-1]
        apart = (self._stride - 0.5) * self.step
        middle = self._before(t2 - apart)
        first = None if middle is None else self._before(middle[0] - apart)
        if middle is None or first is None:
            return self.step
        (t0, r0), (t1, r1) = first, middle
        while self._past[0][0] < t0:
            self._past.popleft()
        early, late = (r1 - r0) / (t1 - t0), (r2 - r1) / (t2 - t1)
        third = abs(2.0 * (late - early) / (t2 - t0))
        bend = third / max(abs(r2), self._reference)
        fading = max(0.0, 1.0 - (t2 - t1) * math.sqrt(self._bend))
        self._bend = max(bend, fading * self._bend)
        if self._bend == 0.0:
            return self._solver.step
        return math.sqrt(self._solver.tolerance / _LOCAL_ERROR / self._bend)

    def _before(self, time: float) -> tuple[float, float] | None:
        """The latest reading not after ``time``."""
        return next((past for past in reversed(self._past) if past[0] <= time), None)


class DeviationSteps(Remembering):
    """Steps that resolve how a ring vibrates about its mean motion over a run of duration T,

        h = sqrt(e |d| / (C T |d'''|)),

    at least T / MOST, with the largest deviation d from the mean angle of all V-joints.
    """

    changing = ("_past", "_largest", "_bend", "_limit")

    def __init__(self, tolerance: float, duration: float) -> None:
        """Let errors add up to so much of the largest deviation over the ``duration`` (s)."""
        self._share = tolerance / (_GLOBAL_ERROR * duration)
        self._shortest = duration / MOST
        self._past: list[tuple[float, Array]] = []
        self._largest, self._bend, self._limit = _LEAST, 0.0, math.inf

    def limit(self, now: Instant) -> float:
        """Largest next step, s; infinite until three readings far enough apart are known."""
        time, angles, rates = now.time, now.angles, now.rates
        self._largest = max(self._largest, float(np.max(np.abs(angles - angles.mean()))))
        if self._past and time - self._past[-1][0] < 0.9 * self._shortest:
            return self._limit
        self._past = [*self._past[-2:], (time, rates - rates.mean())]
        if len(self._past) < 3:
            return self._limit
        (t0, r0), (t1, r1), (t2, r2) = self._past
        third = 2.0 * ((r2 - r1) / (t2 - t1) - (r1 - r0) / (t1 - t0)) / (t2 - t0)
        self._bend = max(float(np.max(np.abs(third))), self._bend * (1.0 - 1.0 / _FADING))
        if self._bend > 0.0:
            wanted = math.sqrt(self._share * self._largest / self._bend)
            self._limit = max(wanted, self._shortest)
        return self._limit
