"""Constant steps: what they are, and what shows that they do not resolve a run."""

import math

import numpy as np

from ringsim.stepping.instant import Instant
from ringsim.stepping.locks import StopContact
from ringsim.stepping.memory import Memory, Remembering
from ringsim.variables import Cause, Reason

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


def unresolved(run: list[Instant], slack_tension: float | None) -> Reason:
    """Why constant steps have not resolved a run; empty if they have.

    A swing of the tension T with the angular frequency w bends it from one step to the next by
    |T(n-1) - 2 T(n) + T(n+1)| = 2 (1 - cos(w h)) |T - mean|.  Bends below the slack tension (N;
    None without cables) do not matter.
    """
    times, angles = np.array([(one.time, one.angles.max()) for one in run]).T
    first = int(np.argmax(angles >= math.pi))
    if 0 < first < STEPS:
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
        (usual, BEND, "in the root mean square"),
        (there, PEAK_BEND, f"at {times[peak]:.6g} s, where it is largest"),
    ):
        if bend > max(share * largest, slack_tension):
            return Reason(
                Cause.TENSION_BENDS,
                f"a tension bends by {bend:.3g} N within a step {where}, "
                f"{100.0 * bend / largest:.3g} % of its largest value and more than "
                f"{100.0 * share:g} %: the steps do not resolve how the rope swings: "
                "reduce solver.step",
            )
    return Reason()
