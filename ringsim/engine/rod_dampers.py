"""Kelvin-Voigt damping of geometrically exact rods, from how their strains change over a step.

The strain of an element is the displacement e (six components) between the frames of its ends,
both moved to its middle.  Damping is the force C de/dt, C = tau K / L, with

    de/dt at t2 = a0 e2 + a1 e1 + a2 e0,   r = (t2 - t1) / (t1 - t0),
    a0 = (1 + 2 r) / (h (1 + r)),  a1 = -(1 + r) / h,  a2 = r^2 / (h (1 + r)),  h = t2 - t1,

the backward difference of second order (BDF2; of first order in a run's first step).  It depends on
positions alone, so that a rod that turns without being strained is not damped, whatever the step.
The integrator's own velocities would not do: they follow the positions to second order in the step
only, and of a turning rod that error points along its axis, where C is largest.  With steps of a
tenth of a second it was a force as large as the one that drives the ring.

exudyn evaluates the force itself: it is a spring of stiffness a0 C whose unstretched length is
-(a1 e1 + a2 e0) / a0, both set before each attempt at a step.
"""

from __future__ import annotations

from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SHIFT = exu.OutputVariableType.DisplacementLocal
_TURN = exu.OutputVariableType.Rotation


class RodDampers:
    """The dampers of all rods of a model.

    Attributes
    ----------
    numbers
        Damper of each damped element, by the element's number.
    latest
        Forces and moments in the elements' middles at the last reading, tension positive, N and
        N m, shape (dampers, 6).
    """

    def __init__(self) -> None:
        self.numbers: dict[int, int] = {}
        self.latest = np.zeros((0, 6))
        self._dampers: list[Any] = []
        self._rows: list[Array] = []
        self._past: list[tuple[float, Array]] = []
        self._prepared = (-1.0, -1.0)
        self._stiffness, self._offsets = np.zeros((0, 6, 6)), np.zeros((0, 6))
        self._read: tuple[float, Array] | None = None
        self._kept: tuple[Array, Array] | None = None

    def add(self, system: Any, markers: list[Any], damping: Array) -> int:
        """A damper between two markers that coincide; ``damping`` C has the shape (6, 6).

        Returns
        -------
        int
            Its row in ``latest``.
        """
        self._dampers.append(
            system.AddObject(item.ObjectConnectorRigidBodySpringDamper(markerNumbers=markers))
        )
        self._rows.append(damping)
        return len(self._dampers) - 1

    def prepare(self, system: Any, time: float, newton: int, discontinuous: int) -> None:
        """Called by exudyn before every residual; acts before the first of each attempt."""
        if not self._dampers or newton != 0 or discontinuous != 0:
            return
        start = system.systemData.GetTime(exu.ConfigurationType.StartOfStep)
        if time <= start or (start, time) == self._prepared:
            return
        self._prepared = start, time
        if not self._past or start > self._past[-1][0]:
            # By now exudyn has moved the current state on: only a reading knows the start's.
            if self._read is None or self._read[0] != start:
                raise RuntimeError(f"the rods' dampers were not read at {start:.9g} s")
            self._past = [*self._past[-1:], self._read]
        lead, self._offsets = _difference(time, self._past)
        self._stiffness = lead * np.array(self._rows)
        for damper, stiffness, offset in zip(
            self._dampers, self._stiffness, self._offsets, strict=True
        ):
            system.SetObjectParameter(damper, "stiffness", stiffness)
            system.SetObjectParameter(damper, "offset", offset)

    def lost(self, system: Any, time: float) -> float:
        """Energy taken since the reading that was kept last, J: mean force times change of strain.

        Parameters
        ----------
        time
            Of the current state, s, which ends the step that was prepared last.
        """
        if not self._dampers:
            return 0.0
        strains = self._strains(system)
        self._read = time, strains
        self.latest = np.zeros_like(strains)
        if len(self._stiffness):
            self.latest = np.einsum("nij,nj->ni", self._stiffness, strains - self._offsets)
        if self._kept is None:
            return 0.0
        before, force = self._kept
        return 0.5 * float(np.sum((force + self.latest) * (strains - before)))

    def keep(self) -> None:
        """Count what is lost from the last reading on."""
        if self._read is not None:
            self._kept = self._read[1], self.latest

    def _strains(self, system: Any) -> Array:
        output = system.GetObjectOutput
        return np.array([[*output(d, _SHIFT), *output(d, _TURN)] for d in self._dampers])


def _difference(time: float, past: list[tuple[float, Array]]) -> tuple[float, Array]:
    """A0 (1/s) and the strain at which a0 e2 + a1 e1 + a2 e0 vanishes, shape (dampers, 6)."""
    now, last = past[-1]
    h = time - now
    if len(past) == 1:
        return 1.0 / h, last
    before, first = past[0]
    r = h / (now - before)
    lead = (1.0 + 2.0 * r) / (h * (1.0 + r))
    return lead, ((1.0 + r) * last - r**2 / (1.0 + r) * first) / (h * lead)
