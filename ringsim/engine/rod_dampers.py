"""Kelvin-Voigt damping of geometrically exact rods, from how their strains change over a step.

The strain of an element is the displacement e (six components) between the frames of its ends,
both moved to its middle: exudyn's intrinsic measure, the logarithm of their relative motion, taken
and applied half-way between them.  Taken in the first frame, it would lack how that frame turns,
and a bent rod that turns would lose energy that nobody books.  Damping is the force C de/dt,
C = tau K / L, with

    de/dt at t2 = a0 e2 + a1 e1 + a2 e0,   r = (t2 - t1) / (t1 - t0),
    a0 = (1 + 2 r) / (h (1 + r)),  a1 = -(1 + r) / h,  a2 = r^2 / (h (1 + r)),  h = t2 - t1,

the backward difference of second order (BDF2; of first order in a run's first step).  It depends on
positions alone, so that a rod that turns without being strained is not damped, whatever the step.
The integrator's own velocities would not do: they follow the positions to second order in the step
only, and of a turning rod that error points along its axis, where C is largest.  With steps of a
twentieth of a second it was a force as large as those that drive a ring.

exudyn evaluates the force itself: it is a spring of stiffness a0 C whose unstretched length is
-(a1 e1 + a2 e0) / a0, both set before each attempt at a step.  In steps below tau / 4 such a spring
would be several times as stiff as the rod, and round-off of the positions would keep Newton from
converging.  There the velocities are good (their error is that of a step of tau / 4 at most) and
the force is C de/dt with them, in the first frame: there exudyn's velocities are those that its
damper works against, and in the intrinsic measure they are not.
"""

from collections.abc import Sequence
from typing import Any

import exudyn as exu
import exudyn.itemInterface as item
import numpy as np

from ringsim.engine.rotations import Array
from ringsim.stepping.losses import Passing, lost_between

_KIND = exu.OutputVariableType
_SHORT = 0.25
"""Steps below this share of tau take velocities: the spring is 1.5 / 0.25 times as stiff as the rod
there, which ``STIFFENING`` allows for."""
STIFFENING = 1.0 + 1.5 / _SHORT
"""Largest stiffness of a rod with its damper over that of the rod alone; 3/2 is a0 h of BDF2."""


class RodDampers:
    """The dampers of all elements of all rods of a model, in their order.

    ``latest`` are their forces and moments in the elements' middles, tension positive, N and N m,
    and the rates of strain that they resist, shape (dampers, 6), when they were read last.
    """

    def __init__(self, system: Any) -> None:
        self._system = system
        none = np.zeros((0, 6))
        self.latest, self._strains = Passing(-1.0, none, none), none
        self._dampers: list[Any] = []
        self._matrices: list[Array] = []
        self._short = 0.0
        self._past: list[tuple[float, Array]] = []
        self._prepared = (-1.0, -1.0)
        self._lead, self._offsets, self._by_velocity = 0.0, np.zeros(6), False
        self._kept: Passing | None = None

    def add(self, markers: list[Any], damping: Array, relaxation: float) -> None:
        """A damper C, shape (6, 6), N s/m and N m s, between two markers that coincide, of a rod's
        element with tau = ``relaxation``, s.
        """
        kind = item.ObjectConnectorRigidBodySpringDamper
        damper = kind(markerNumbers=markers, useIntrinsicFormulation=True)
        self._dampers.append(self._system.AddObject(damper))
        self._matrices.append(damping)
        self._short = max(self._short, _SHORT * relaxation)

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
            if self.latest.time != start:
                raise RuntimeError(f"the rods' dampers were not read at {start:.9g} s")
            self._past = [*self._past[-1:], (start, self._strains)]
        matrices, by_velocity = np.array(self._matrices), time - start < self._short
        if by_velocity != self._by_velocity:
            self._by_velocity = by_velocity
            self._intrinsic(wanted=not by_velocity)
            self._set("stiffness", np.zeros_like(matrices))
            self._set("damping", by_velocity * matrices)
        if not by_velocity:
            self._lead, self._offsets = _difference(time, self._past)
            self._set("stiffness", self._lead * matrices)
            self._set("offset", self._offsets)

    def lost(self, time: float) -> float:
        """Energy taken since the reading that was kept last, J; see ``lost_between``.

        ``time`` is that of the current state, s, which ends the step that was prepared last.
        """
        if not self._dampers:
            return 0.0
        if self._by_velocity:
            rates = self._outputs(_KIND.VelocityLocal, _KIND.AngularVelocityLocal)
            self._intrinsic(wanted=True)
        strains = self._outputs(_KIND.DisplacementLocal, _KIND.Rotation)
        if self._by_velocity:
            self._intrinsic(wanted=False)
        else:
            rates = self._lead * (strains - self._offsets)
        forces = np.einsum("nij,nj->ni", np.array(self._matrices), rates)
        # The rates that the forces are made of balance an impact twice as well as the strains.
        places = None if self._by_velocity else strains
        self.latest, self._strains = Passing(time, forces, rates, places), strains
        return 0.0 if self._kept is None else lost_between(self._kept, self.latest)

    def keep(self) -> None:
        """Count what is lost from the last reading on."""
        self._kept = self.latest

    def _intrinsic(self, *, wanted: bool) -> None:
        self._set("useIntrinsicFormulation", [wanted] * len(self._dampers))

    def _set(self, name: str, values: Sequence[Any] | Array) -> None:
        for damper, value in zip(self._dampers, values, strict=True):
            self._system.SetObjectParameter(damper, name, value)

    def _outputs(self, shift: Any, turn: Any) -> Array:
        output = self._system.GetObjectOutput
        return np.array([[*output(d, shift), *output(d, turn)] for d in self._dampers])


def _difference(time: float, past: list[tuple[float, Array]]) -> tuple[float, Array]:
    """Of a0 e2 + a1 e1 + a2 e0: a0 in 1/s, and the e2 at which it vanishes, shape (dampers, 6)."""
    now, last = past[-1]
    h = time - now
    if len(past) == 1:
        return 1.0 / h, last
    before, first = past[0]
    r = h / (now - before)
    lead = (1.0 + 2.0 * r) / (h * (1.0 + r))
    return lead, ((1.0 + r) * last - r**2 / (1.0 + r) * first) / (h * lead)
