"""Steps across which an indicator exceeds its allowance are repeated with a smaller one.

An indicator falls with the p-th power of the step.  The controller is the standard one of step
sizes: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.4, where such
a safety factor and bounds of the ratio stand, too.
"""

import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from ringsim.parts.solver import TENSION_BEND, Solver
from ringsim.stepping.instant import Array, Energies, Instant, Scales
from ringsim.stepping.memory import Remembering

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

    @abstractmethod
    def ratio(self, before: Instant, after: Instant) -> float:
        """Indicator of a step over its allowance; NaN where it is unknown."""

    @abstractmethod
    def share(self, ratio: float) -> float:
        """The safety factor times ratio^(-1/p)."""

    def shorter(self, before: Instant, after: Instant) -> float | None:
        """A smaller step in s to repeat this one with, or None if it is good enough."""
        step, ratio = after.time - before.time, self.ratio(before, after)
        # A step comes back as a difference of times: a little more than what was asked for.
        if not ratio > _REFUSED or step <= self._least * (1.0 + 1e-6):
            return None
        return max(step * max(FALL, self.share(ratio)), self._least)

    def accept(self, before: Instant, after: Instant) -> None:
        """Learn from a step that is taken."""
        step, ratio = after.time - before.time, self.ratio(before, after)
        # 1e-3 stands for 0: from 0.2 on down ``GROWTH`` bounds the step, whatever the ratio is.
        growth = min(max(self.share(max(ratio, 1e-3)), FALL), GROWTH)
        self.limit = max(step * growth, self._least) if math.isfinite(ratio) else math.inf

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

    def accept(self, before: Instant, after: Instant) -> None:
        """See ``Indicator``; adds to the energy exchanged."""
        super().accept(before, after)
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
            f"; energy repeated a step {self._refused} times and was left alone after that: see "
            "energy_error"
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

    def accept(self, before: Instant, after: Instant) -> None:
        """See ``Indicator``; remembers the tensions."""
        super().accept(before, after)
        if before.tensions is not None and after.tensions is not None:
            self._largest = max(self._largest, float(after.tensions.max()))
            self._past = after.time - before.time, before.tensions
