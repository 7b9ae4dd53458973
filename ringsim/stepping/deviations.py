"""Steps that resolve how a ring vibrates about its mean motion.

The loads set off vibrations of the ring itself (ovalisation, tilting of hinge assemblies), with
periods of the order of a second for 18 sections.  They hardly touch the mean opening angle, which
chooses the other steps, but as long as the ring opens slowly they are a large part of the joints'
deviations from it and of the rods' stresses.  A local error C h^3 d''' in the deviations d adds
up to C h^2 d''' T over a run of duration T; held to a share e of the largest deviation so far,

    h = sqrt(e |d| / (C T |d'''|)).

|d| and |d'''| are the largest of all V-joints.  Vibrations too fast to be followed in ``MOST``
steps are left alone: neither are their derivatives looked at, nor are steps shorter than T / MOST
asked for.  From the first lock on the stops choose the steps.
"""

from __future__ import annotations

import math

import numpy as np

from ringsim.stepping.instant import Array, Instant

_GLOBAL_ERROR = 0.1 / 15.0
"""C.  The integrator's local constant is 0.1, but local errors of a vibration cancel for the most
part: on rings of 6 and 18 sections errors against MBDyn are a fifteenth of what their sum would
be, so that ``solver.deviation_tolerance`` is the error found there (docs/cross_validation.md)."""
MOST = 2000.0
"""Steps that the deviations may ask for over a run.  The ovalisation of 18 sections takes 1300, and
a shorter step would follow what Newton leaves of the residual."""
_LEAST = math.radians(1e-4)
"""Deviations below this are what Newton's tolerance leaves, rad."""
_FADING = 20.0
"""Steps over which the largest d''' fades, so that its passage through zero opens no step."""


class DeviationSteps:
    """The largest step that keeps the joints' deviations from their mean right."""

    def __init__(self, tolerance: float, duration: float) -> None:
        """Start at rest; an error of so much of the largest deviation may add up over the run,
        which takes about ``duration`` (s).
        """
        self._share = tolerance / (_GLOBAL_ERROR * duration)
        self._shortest = duration / MOST
        self._past: list[tuple[float, Array]] = []
        self._largest, self._bend, self._limit = _LEAST, 0.0, math.inf

    def limit(self, now: Instant) -> float:
        """Largest next step, s; infinite until three readings far enough apart are known."""
        time, angles, rates = now[:3]
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
