"""Any structure with rigid rods as one coordinate q: inertia, work, and its release from rest.

With rigid rods every point is a function of q, so

    I(q) q'' + I'(q) q'^2 / 2 = dW/dq,

I = sum m |dr/dq|^2 over all masses with the rigid-body motion taken out, W the work of the loads
less the energy of the net.  A free structure keeps momentum and angular momentum at zero (its loads
turn with it); a support holds its body.  The end assemblies of an open arc are held upright.  From
rest at q_0 the time until q_1 is

    T = integral from q_1 to q_0 of sqrt(I / (2 (W - W(q_0)))) dq.

The substitution q = q_0 - (q_0 - q_1) u^2 removes the singularity at the start.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ringsim.layout.layout import Layout
from ringsim.layout.pose import Array
from ringsim.scene import Scene
from ringsim.theory.configuration import Configuration
from ringsim.theory.ideal_mechanism import Mechanism
from ringsim.theory.spring_energy import SpringEnergy

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class Motion(NamedTuple):
    """Inertia I(q), kg m^2, and the rigid motion in the layout's rates: a point at r moves with
    r' - velocity - rotation x r, shapes (3,), m/rad and rad/rad.
    """

    inertia: float
    velocity: Array
    rotation: Array


class OneCoordinate:
    """Masses, loads, net and hinge springs of a scene, without joint friction, stops and cables."""

    def __init__(self, scene: Scene, start: Layout | None = None) -> None:
        """Everywhere; or, with the layout at the start, there alone and sooner."""
        self._springs = SpringEnergy(scene)
        if start is not None:
            begin = Mechanism(scene, scene.structure.coordinate, start)
            self._mechanism: Callable[[float], Mechanism] = lambda _: begin
            return
        known = scene.structure.basis(scene.structure.coordinate).size
        everywhere = Mechanism(scene) if known else None
        self._mechanism = lru_cache(maxsize=4)(lambda q: everywhere or Mechanism(scene, q))

    def motion(self, q: float) -> Motion:
        """Inertia and rigid-body part of the motion at ``q`` (rad)."""
        mechanism, now = self._at(q)
        rates = mechanism.rates(now)
        return Motion(mechanism.inertia(now), -rates[:3], -rates[3:6])

    def work(self, q: float) -> float:
        """Work function W(q) in J, up to a constant."""
        mechanism, now = self._at(q)
        done = np.tensordot(*mechanism.points.forces, 2) @ now.values
        done += mechanism.weight_work(now)
        stored = mechanism.net(now).energy + self._springs.at(2.0 * q)[1]
        return float(done) - stored

    def work_rate(self, q: float) -> float:
        """Generalised force dW/dq, J/rad."""
        mechanism, now = self._at(q)
        done = np.tensordot(*mechanism.points.forces, 2) @ now.slopes
        done += mechanism.rates(now) @ mechanism.weight(now)
        pulled = done + mechanism.net(now).force
        return float(pulled - 2.0 * self._springs.at(2.0 * q)[0])

    def _at(self, q: float) -> tuple[Mechanism, Configuration]:
        mechanism = self._mechanism(q)
        return mechanism, mechanism.at(q)


class OpeningTime(NamedTuple):
    """A time in s and the difference to a quadrature with half as many panels."""

    time: float
    uncertainty: float


def opening_time(
    ring: OneCoordinate, phi_start: float, phi_end: float = 0.0, *, panels: int = 24
) -> OpeningTime:
    """Time from rest at ``phi_start`` to ``phi_end`` (rad), by panels of 8 Gauss-Legendre nodes.

    Raises
    ------
    ValueError
        If the work done turns negative before the ring reaches ``phi_end``.
    """
    fine, coarse = (_integrate(ring, phi_start, phi_end, n) for n in (panels, panels // 2))
    return OpeningTime(fine, abs(fine - coarse))


def _integrate(ring: OneCoordinate, phi_start: float, phi_end: float, panels: int) -> float:
    span, work_start, total = phi_start - phi_end, ring.work(phi_start), 0.0
    places = (np.arange(panels)[:, None] + 0.5 + 0.5 * _NODES) / panels
    for u, weight in zip(places.ravel(), np.tile(0.5 * _WEIGHTS / panels, panels), strict=True):
        phi = phi_start - span * u**2
        gained = ring.work(phi) - work_start
        if gained <= 0.0:
            raise ValueError(
                f"the ring does not open: at an opening angle of "
                f"{180.0 - 2.0 * np.degrees(phi):.2f} deg the work done is {gained:.3g} J"
            )
        slowness = np.sqrt(ring.motion(phi).inertia / 2.0 / gained)
        total += weight * 2.0 * abs(span) * u * slowness
    return float(total)
