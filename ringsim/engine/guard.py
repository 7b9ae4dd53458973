"""Guards of a run: blow-up, energy growth and loss, joints that come apart, stops passed.

They judge every accepted step and stop the run at the first that cannot be sound.  What they
compare is the balance

    B = kinetic + elastic - both at the start + lost - work of loads and winches

with the energy X exchanged so far, the largest of |work| and of the changes of kinetic and
elastic energy.  Generalised-alpha takes energy out of what it does not resolve (B < 0) and puts
in none, so that growth (B > 0) means more than loss.

Constant steps too long for a rope that swings on its load swallow the swing, which holds too
little energy for the balance to miss.  What is left of it shows: from one step to the next the
tension bends by

    |T(n-1) - 2 T(n) + T(n+1)| = 2 (1 - cos(w h)) |T - mean|,

with the swing's angular frequency w: by two to four times the deviation from the mean where less
than four steps make a period.  Such a run is judged at its end.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ringsim.outputs.instant import Energies
from ringsim.outputs.recorder import History
from ringsim.parts.solver import Solver
from ringsim.variables import Cause, Reason, Status

GROWTH, LOSS = 2.0, 5.0
"""B / X at which a run is stopped, over ``solver.energy_tolerance``.  Larger than at the end,
since X still grows: an error made early may be small beside all that follows."""
BLOW_UP = 10.0
"""Kinetic and elastic energy over what start, loads and winches could give."""
SLIGHT = 1e-3
"""Share of the usual energy below which a whole run has done nothing worth judging."""
GAP = 1e-4
"""Largest gap of a joint over the length of a bar."""
OVERRUN = math.radians(30.0)
"""Angle by which a V-joint may pass its stop: beyond it neither stop nor model mean anything."""
BEND, PEAK_BEND = 0.05, 0.4
"""Bend of a tension over the largest tension, its root mean square over the run and its value at
the largest: what constant steps do not resolve changes that by 5 % at most (a swing of amplitude
A that is not resolved bends by sqrt(2) A or more; a parabola rises by an eighth of its bend over
the largest reading)."""
STEPS = 50
"""Constant steps until the first V-joint locks, at least.  The integrator starts from rest without
an acceleration, which delays the motion by a third of the first step; steps that follow the motion
start small."""
_CURE = "reduce solver.step or solver.tolerance"

Array = NDArray[np.float64]


class Guard:
    """Watches one run from its first reading on."""

    def __init__(
        self,
        solver: Solver,
        least_energy: float,
        bar: float,
        least_bend: float = math.inf,
    ) -> None:
        """Set the bounds.

        Parameters
        ----------
        solver
            The scene's settings; ``energy_tolerance`` is the largest |B| / X of a sound run.
        least_energy
            X counts as this much at least during the run, J, and as ``SLIGHT`` of it at the end.
        bar
            Length in m against which gaps are measured.
        least_bend
            Bend of a tension in N that does not matter; infinite where steps follow the motion.
        """
        self._tolerance, self._least, self._bar = solver.energy_tolerance, least_energy, bar
        self._least_steps = STEPS if solver.step_control == "constant" else 0
        self._least_bend = least_bend
        self._start: Energies | None = None
        self._lost = self._driven = 0.0
        self._low = self._high = np.zeros(3)
        self._worst = (0.0, 0.0)
        self._until_lock = 0

    def stops(self, history: History, overrun: float = 0.0, opening: float = 0.0) -> bool:
        """Judge the last reading of a run; note in its history why it must stop there, if so.

        Parameters
        ----------
        history
            Of the run.
        overrun
            Largest angle by which a V-joint has passed its stops, rad.
        opening
            Largest opening angle of a V-joint, rad.
        """
        if opening >= math.pi and not self._until_lock:
            self._until_lock = len(history.times) - 1
        reason = self.judge(history.times[-1], history.energies[-1], history.gaps[-1], overrun)
        if reason:
            history.end(Status.DIVERGED, reason)
        return bool(reason)

    def conclude(self, history: History) -> None:
        """Note in the history of a run that ended by itself if it is not sound after all."""
        reason = self.verdict() or self._hasty(history) or self._bent(history)
        if reason and history.status in (Status.OK, Status.UNFINISHED):
            history.end(Status.DIVERGED, reason)

    def judge(self, time: float, now: Energies, gap: float, overrun: float = 0.0) -> Reason:
        """Why the run must stop here: cause, measured value, bound and cure; empty if it may go on.

        Parameters
        ----------
        time
            Of the reading, s.
        now
            Its energies.
        gap
            Largest gap in any joint, m.
        overrun
            Largest angle by which a V-joint has passed its stops, rad.
        """
        start = self._start = self._start or now
        self._lost += now.lost
        self._driven += now.driven
        work = now.work + self._driven
        stored = now.kinetic + now.elastic
        balance = stored - start.kinetic - start.elastic + self._lost - work
        changes = [now.kinetic - start.kinetic, now.elastic - start.elastic, work]
        self._low, self._high = np.fmin(self._low, changes), np.fmax(self._high, changes)
        if abs(balance) > abs(self._worst[1]):
            self._worst = (time, balance)

        available = max(abs(work), self._least) + start.kinetic + start.elastic
        if stored > BLOW_UP * available:
            return Reason(
                Cause.BLOW_UP,
                f"the motion blew up at {time:.6g} s: {now.kinetic:.3g} J of kinetic and "
                f"{now.elastic:.3g} J of elastic energy, more than {BLOW_UP:g} times the "
                f"{available:.3g} J that start, loads and winches have given: {_CURE}",
            )
        if gap > GAP * self._bar:
            return Reason(
                Cause.JOINT_GAP,
                f"the joints came apart by {gap:.2g} m at {time:.6g} s, more than "
                f"{GAP * self._bar:.2g} m: {_CURE}",
            )
        if overrun > OVERRUN:
            return Reason(
                Cause.STOP_PASSED,
                f"a V-joint swung {math.degrees(overrun):.3g} deg past its stop at {time:.6g} s, "
                f"more than {math.degrees(OVERRUN):.0f} deg: raise stop.stiffness, or lower what "
                "drives it",
            )
        factor = GROWTH if balance > 0.0 else LOSS
        exchanged = self._exchanged(self._least)
        if abs(balance) > factor * self._tolerance * exchanged:
            bound = f"{factor:g} times solver.energy_tolerance"
            return self._unbalanced(time, balance, exchanged, bound)
        return Reason()

    def verdict(self) -> Reason:
        """Why a run that ended by itself is not sound after all; empty if it is."""
        time, balance = self._worst
        exchanged = self._exchanged(SLIGHT * self._least)
        if abs(balance) <= self._tolerance * exchanged:
            return Reason()
        return self._unbalanced(time, balance, exchanged, "solver.energy_tolerance")

    def _hasty(self, history: History) -> Reason:
        """Why constant steps have not resolved the motion; empty if they have."""
        if not 0 < self._until_lock < self._least_steps:
            return Reason()
        return Reason(
            Cause.FEW_STEPS,
            f"the first V-joint locked within {self._until_lock} steps, at "
            f"{history.times[self._until_lock]:.3g} s, fewer than {STEPS} of constant length: "
            'reduce solver.step, or let it follow the motion (solver.step_control = "motion")',
        )

    def _bent(self, history: History) -> Reason:
        """Why constant steps have not resolved the tensions; empty if they have."""
        if len(history.tensions) < 3 or math.isinf(self._least_bend):
            return Reason()
        tensions, steps = np.array(history.tensions), np.diff(history.times)[:, None]
        bends = np.abs(np.diff(np.diff(tensions, axis=0) / steps, axis=0))
        bends = (bends * np.minimum(steps[1:], steps[:-1])).max(axis=1)
        largest, peak = float(tensions.max()), int(tensions.max(axis=1).argmax())
        usual = math.sqrt(float(np.mean(bends**2)))
        there = float(bends[peak - 1]) if 0 < peak < len(tensions) - 1 else 0.0
        for bend, share, where in (
            (usual, BEND, "in the root mean square"),
            (there, PEAK_BEND, f"at {history.times[peak]:.6g} s, where it is largest"),
        ):
            if bend > max(share * largest, self._least_bend):
                return Reason(
                    Cause.TENSION_BENDS,
                    f"a tension bends by {bend:.3g} N within a step {where}, "
                    f"{100.0 * bend / largest:.3g} % of its largest value and more than "
                    f"{100.0 * share:g} %: the steps do not resolve how the rope swings: "
                    "reduce solver.step",
                )
        return Reason()

    def _exchanged(self, least: float) -> float:
        """X, J."""
        work = max(self._high[2], -self._low[2])
        return float(max(least, work, *(self._high - self._low)[:2]))

    def _unbalanced(self, time: float, balance: float, exchanged: float, bound: str) -> Reason:
        what = "came as energy from nothing" if balance > 0.0 else "is energy got lost in the steps"
        return Reason(
            Cause.ENERGY_GREW if balance > 0.0 else Cause.ENERGY_LOST,
            f"{abs(balance):.3g} J, {100.0 * abs(balance) / exchanged:.3g} % of the energy "
            f"exchanged, {what} until {time:.6g} s, more than {bound} "
            f"({100.0 * self._tolerance:g} %): {_CURE}",
        )
