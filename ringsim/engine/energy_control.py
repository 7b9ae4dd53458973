"""Steps that conjure up or swallow energy are repeated with a smaller one.

A rope becomes taut within a small part of the step that the motion asks for, and throws what it
pulls.  A step across that balances neither the work of the winch nor the energy of the rope: the
integrator swallows what it cannot resolve.  The imbalance of a step,

    change of kinetic and elastic energy + lost - work of loads and winches,

is known from its two ends.  It falls with the third power of the step where the step resolves
the motion, so that a refused step is repeated with h (allowed / imbalance)^(1/3), and the next
one may be no larger than that.

What is allowed goes with the tolerance where an impact or two are all that matters.  Ropes catch
all the time: N ~ 1/h steps with an imbalance of h^3 each add up to h^2, which is to go with the
tolerance, so that a step may lack tolerance^(3/2).
"""

from __future__ import annotations

import math

from ringsim.outputs.instant import Energies
from ringsim.parts.solver import Solver

_SHARE = 0.3
"""Imbalance allowed in a step over the tolerance times the energy exchanged so far."""
_USUAL = 3e-4
"""Tolerance at which that holds for ropes, too."""
_REFUSED = 2.0
"""Imbalance over the allowed one from which on a step is repeated."""
_SAFETY = 0.8
_FALL, _RISE = 0.2, 1.5
"""Smallest and largest ratio of successive steps."""
_FINEST = 1e-4
"""No step is repeated below this share of the largest step."""
_PATIENCE = 300
"""Steps of a ring without cables that are repeated at the tolerance 1e-4; impacts need fewer."""


class EnergyControl:
    """Judges steps by their energy balance.

    Attributes
    ----------
    limit
        Largest next step in s; infinite before the first.
    refused
        Number of steps that were repeated.
    """

    def __init__(self, solver: Solver, slight: float, *, tireless: bool) -> None:
        """Start with nothing exchanged.

        Parameters
        ----------
        slight
            Energy in J that does not matter; it counts as exchanged from the start.
        tireless
            Whether any number of steps may be repeated, as ropes need it.  A structure without
            ropes that vibrates on and on, faster than anybody wants to resolve, would be followed
            forever; its energy error tells instead.
        """
        more = math.sqrt(max(1e-4 / solver.tolerance, 1.0))
        self._patience = math.inf if tireless else _PATIENCE * more
        self.limit, self.refused = math.inf, 0
        often = math.sqrt(solver.tolerance / _USUAL) if tireless else 1.0
        self._allowed = _SHARE * solver.tolerance * often
        self._least = _FINEST * solver.step
        self._exchanged, self._work = slight, 0.0
        self._stored: float | None = None

    def note(self) -> str:
        """What a run's reason must add about this; empty if every step was judged."""
        if self.refused < self._patience:
            return ""
        return (
            f"; energy repeated a step {self.refused} times and was left alone after that: see "
            "energy_error"
        )

    def shorter(self, step: float, before: Energies, after: Energies) -> float | None:
        """A smaller step in s to repeat this one with, or None if it is good enough."""
        ratio = self._ratio(before, after)
        # A step comes back as a difference of times: a little more than what was asked for.
        least = step <= self._least * (1.0 + 1e-6)
        if not ratio > _REFUSED or least or self.refused >= self._patience:
            return None
        self.refused += 1
        share = max(_FALL, _SAFETY * math.pow(ratio, -1.0 / 3.0))
        return max(step * share, self._least)

    def accept(self, step: float, before: Energies, after: Energies) -> None:
        """Learn from a step that was taken."""
        ratio = max(self._ratio(before, after), 1e-3)
        growth = min(max(_SAFETY * math.pow(ratio, -1.0 / 3.0), _FALL), _RISE)
        judged = math.isfinite(ratio) and self.refused < self._patience
        self.limit = max(step * growth, self._least) if judged else math.inf
        self._exchanged = self._exchange(before, after)
        self._work += after.work - before.work + after.driven
        if self._stored is None:
            self._stored = before.elastic

    def _exchange(self, before: Energies, after: Energies) -> float:
        """Largest energy exchanged up to the end of a step, J."""
        work = self._work + after.work - before.work + after.driven
        stored = before.elastic if self._stored is None else self._stored
        return max(self._exchanged, abs(work), after.kinetic, abs(after.elastic - stored))

    def _ratio(self, before: Energies, after: Energies) -> float:
        """Imbalance of a step over what is allowed; NaN where the balance is unknown."""
        stored = after.kinetic - before.kinetic + after.elastic - before.elastic
        supplied = after.work - before.work + after.driven
        allowed = self._allowed * self._exchange(before, after)
        return abs(stored + after.lost - supplied) / allowed
