"""Guards of a run, and what constant steps do not resolve."""

import math

import numpy as np

from ringsim.parts.solver import Solver
from ringsim.stepping.instant import (
    AS_DRAWN,
    Instant,
    Memory,
    Remembering,
    Scales,
    Strained,
    of_ranges,
)
from ringsim.stepping.locks import StopContact
from ringsim.variables import Cause, Reason

# Constant steps: what they are, and what shows that they do not resolve a run.


BEND, PEAK_BEND = 0.05, 0.4
"""Bend of a tension over the largest tension, its root mean square over the run and its value at
the largest: what constant steps do not resolve changes that by 5 % at most (a swing of amplitude
A that is not resolved bends by sqrt(2) A or more; a parabola rises by an eighth of its bend over
the largest reading)."""
STEPS = 50
"""Constant steps until the first V-joint locks, at least.  The integrator starts from rest without
an acceleration, which delays the motion by a third of the first step: by 2/3 % of so many."""

_RECOVERY = 10
"""Steps after which one that Newton had to shorten doubles, where no stop is ahead: enough for what
has made Newton fail to pass.  Before stops it stays as it is, or it would fail at the next."""


class ConstantSteps(Remembering):
    """Steps of one length, shortened only where Newton fails, which may ``recover`` it after that;
    ``step`` is the next wanted, s.
    """

    changing = ("step", "_last", "_since")

    def __init__(self, step: float, recover: bool) -> None:
        self.step = self._full = self._last = step
        self._since, self._recovery = 0, _RECOVERY if recover else math.inf

    def recall(self, memory: Memory) -> None:
        """See ``Remembering``."""
        super().recall(memory)
        self.step = min(self.step, self._full)

    def begin_anew(self) -> None:
        """Go on as from the start: what has made Newton fail may be gone."""
        self.step = self._full

    def advance(self, now: Instant, stops: StopContact) -> None:
        """Let a shortened step grow again."""
        self._since = self._since + 1 if self.step == self._last else 1
        if self._since >= self._recovery:
            self.step, self._since = min(2.0 * self.step, self._full), 0
        self._last = self.step

    def towards(self, left: float) -> float:
        """The next step in s if only so much time is left to an event."""
        return min(self.step, left)


def unresolved(
    run: list[Instant], slack_tension: float | None, *, from_rest: bool = True
) -> Reason:  # fmt: skip
    """Why constant steps have not resolved a run; empty if they have.

    A swing of the tension T with the angular frequency w bends it from one step to the next by
    |T(n-1) - 2 T(n) + T(n+1)| = 2 (1 - cos(w h)) |T - mean|.  Bends below the slack tension (N;
    None without cables) do not matter.
    """
    if not run:
        return Reason()
    times, angles = np.array([(one.time, one.angles.max()) for one in run]).T
    first = int(np.argmax(angles >= math.pi))
    if from_rest and 0 < first < STEPS:
        return Reason(
            Cause.FEW_STEPS,
            f"the first V-joint locked within {first} steps, at {times[first]:.3g} s, fewer than "
            f"{STEPS} of constant length: reduce solver.step, or let it follow the motion "
            '(solver.step_control = "motion")',
        )
    if len(times) < 3 or slack_tension is None:
        return Reason()
    tensions = np.array([one.tensions for one in run])
    steps = np.diff(times)[:, None]
    bends = np.abs(np.diff(np.diff(tensions, axis=0) / steps, axis=0))
    bends = (bends * np.minimum(steps[1:], steps[:-1])).max(axis=1)
    largest, peak = float(tensions.max()), int(tensions.max(axis=1).argmax())
    usual = math.sqrt(float(np.mean(bends**2)))
    there = float(bends[peak - 1]) if 0 < peak < len(times) - 1 else 0.0
    for bend, share, where in (
        (usual, BEND, "(root mean square)"),
        (there, PEAK_BEND, f"at {times[peak]:.6g} s, where it is largest"),
    ):
        if bend > max(share * largest, slack_tension):
            return Reason(
                Cause.TENSION_BENDS,
                f"a tension bends by {bend:.3g} N within a step {where}, "
                f"{100.0 * bend / largest:.3g} % of its largest value and more than "
                f"{100.0 * share:g} %: the steps do not resolve the vibration of the rope: "
                "reduce solver.step",
            )
    return Reason()


# Guards of a run: false start, blow-up, energy growth and loss, joints that come apart.
#
# They compare the balance B = kinetic + elastic - both at the start + lost - work of loads and
# winches with the energy X exchanged so far (``ringsim.stepping.instant.exchanged``).
# Generalised-alpha takes energy out of what it does not resolve (B < 0) and puts in none, so that
# growth (B > 0) means more than loss.


GAIN, LOSS = 2.0, 5.0
"""B / X at which a run is stopped, over ``solver.energy_tolerance``.  Larger than at the end,
since X still grows: an error made early may be small beside all that follows."""
BLOW_UP = 10.0
"""Kinetic and elastic energy over what start, loads and winches could give: a state so far beyond
any balance tells nothing of when the energy came, so that its cause has a name of its own."""
SLIGHT = 1e-3
"""Share of the reference energy below which a whole run has done nothing worth judging; share of it
and of the prestress by which a start may be strained otherwise than it was put together."""
GAP = 1e-4
"""Largest gap of a joint over the length of a bar: joints that hold are closed to 1e-12 m."""
_CURE = "reduce solver.step or solver.tolerance"


class Guard(Remembering):
    """Watches one run from its first instant on."""

    changing = ("_run", "_lost", "_driven", "_credit", "_low", "_high", "_worst", "_behind")

    def __init__(self, solver: Solver, scales: Scales, strained: Strained = AS_DRAWN) -> None:
        self._tolerance, self._scales, self._strained = solver.energy_tolerance, scales, strained
        self._constant = solver.step_control == "constant"
        self._run: list[Instant] = []
        self._lost = self._driven = self._credit = 0.0
        self._low, self._high = [math.inf] * 4, [-math.inf] * 4
        self._worst = (0.0, 0.0)
        self._behind = 0

    def go_on_with_constant_steps(self) -> None:
        """Judge them from here on: those before were of another kind."""
        self._behind = len(self._run)

    def judge(self, now: Instant) -> Reason:
        """Why the run must stop here: cause, measured value, bound and cure; empty if not."""
        first = not self._run
        if self._constant or first:  # constant steps are judged by all of a run
            self._run.append(now)
        stored, left = self._strained
        if first and abs(stored - left) > SLIGHT * (self._scales.energy + left):
            return Reason(
                Cause.STRAINED,
                f"rods and boom store {stored:.3g} J at the start, but {left:.3g} J after "
                "assembly: the model does not start from its assembled state, and results would "
                "be wrong (choose another fidelity, and report this scene)",
            )
        time, found, start = now.time, now.energies, self._run[0].energies
        if not first:  # what a fault takes at the start is not in it any more
            self._lost += found.lost
            self._driven += found.driven
        work = found.work + self._driven
        stored = found.kinetic + found.elastic
        balance = stored - start.kinetic - start.elastic + self._lost - work
        kinds = [found.kinetic, found.elastic, found.work, self._driven]
        self._low = [min(pair) for pair in zip(self._low, kinds, strict=True)]
        self._high = [max(pair) for pair in zip(self._high, kinds, strict=True)]
        if abs(balance) > abs(self._worst[1]):
            self._worst = (time, balance)

        # Works by their ways up and down: what loads gave stays in the structure when they turn
        # round, though their work passes zero later.
        supplied = sum(self._ranges()[2:])
        available = start.kinetic + start.elastic + self._credit
        available += max(supplied, self._scales.energy)
        if stored > BLOW_UP * available:
            return Reason(
                Cause.BLOW_UP,
                f"the motion blew up at {time:.6g} s: {found.kinetic:.3g} J of kinetic and "
                f"{found.elastic:.3g} J of elastic energy, more than {BLOW_UP:g} times the "
                f"{available:.3g} J that start, loads and winches have given: {_CURE}",
            )
        if now.gap > GAP * self._scales.length:
            return Reason(
                Cause.JOINT_GAP,
                f"the joints came apart by {now.gap:.2g} m at {time:.6g} s, more than "
                f"{GAP * self._scales.length:.2g} m: {_CURE}",
            )
        factor = GAIN if balance > 0.0 else LOSS
        words = f"{factor:g} times solver.energy_tolerance"
        return self._unbalanced(time, balance, self._scales.energy, factor, words)

    def begin_anew(self, now: Instant, lost: float) -> None:
        """Go on from how a change makes the present instant, which has taken so much energy, J;
        what it has put in is negative.
        """
        if len(self._run) > 1:
            self._run[-1] = now
        self._lost += lost
        self._credit += max(-lost, 0.0)

    def verdict(self) -> Reason:
        """Why a run that ended by itself is not sound after all; empty if it is."""
        least = SLIGHT * self._scales.energy
        reason = self._unbalanced(*self._worst, least, 1.0, "solver.energy_tolerance")
        if reason or not self._constant:
            return reason
        run, from_rest = self._run[self._behind :], not self._behind
        return unresolved(run, self._scales.slack_tension, from_rest=from_rest)

    def _ranges(self) -> list[float]:
        return [high - low for low, high in zip(self._low, self._high, strict=True)]

    def _unbalanced(
        self, time: float, balance: float, least: float, factor: float, bound: str
    ) -> Reason:
        """Why an imbalance B in J is too large; X counts as ``least`` (J) at least."""
        # Not <=: an unknown balance (NaN) stops nothing.
        if not abs(balance) > factor * self._tolerance * least:
            return Reason()
        scale = max(least, of_ranges(*self._ranges()))
        if not abs(balance) > factor * self._tolerance * scale:
            return Reason()
        share, limit = 100.0 * abs(balance) / scale, 100.0 * self._tolerance
        return Reason(
            Cause.ENERGY_GREW if balance > 0.0 else Cause.ENERGY_LOST,
            f"time integration {'added' if balance > 0.0 else 'lost'} {abs(balance):.3g} J, "
            f"{share:.3g} % of the energy exchanged, up to {time:.6g} s, more than {bound} "
            f"({limit:g} %): {_CURE}",
        )
