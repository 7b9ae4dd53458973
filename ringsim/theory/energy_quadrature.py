"""Deployment time of the ideal ring by quadrature of its energy: no time integration at all.

    T = integral from phi to phi_0 of sqrt(I / (2 (W - W(phi_0)))) dphi

for a ring that starts at rest at phi_0 under position-only loads.  The substitution
phi = phi_0 - (phi_0 - phi_end) u^2 removes the singularity at the start; Gauss-Legendre panels do
the rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ringsim.theory.one_coordinate import OneCoordinate

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class OpeningTime:
    """A time in s and the difference to a quadrature with half as many panels."""

    time: float
    uncertainty: float


def opening_time(
    ring: OneCoordinate, phi_start: float, phi_end: float = 0.0, *, panels: int = 24
) -> OpeningTime:
    """Time from rest at ``phi_start`` until the bar angle ``phi_end`` is reached.

    Parameters
    ----------
    ring
        The ideal ring; friction is not represented.
    phi_start, phi_end
        Bar angles in rad; the default end is the deployed ring.
    panels
        Gauss-Legendre panels of 8 nodes each.

    Raises
    ------
    ValueError
        If the ring does not reach ``phi_end`` because the work done turns negative before.
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
