"""Finding the stowed angle from a measured deployment time."""

from __future__ import annotations

import math

from scipy.optimize import brentq

from ringsim.parts.structure.pantograph_ring import PantographRing
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.theory.energy_quadrature import opening_time
from ringsim.theory.ideal_ring import IdealRing

_WIDEST = 179.0
"""Largest opening angle that is tried, deg."""


def opening_angle_for(scene: Scene, time: float) -> float:
    """Initial opening angle in deg from which the scene's ideal ring deploys in ``time``.

    The energy quadrature of ringsim.theory.energy_quadrature, solved for its lower end.

    Raises
    ------
    InputError
        If no angle between 1 and 179 deg gives that time.
    """
    if not isinstance(scene.structure, PantographRing):
        raise InputError(
            f"scene {scene.name} is no pantograph ring: only those have a stowed angle to find"
        )
    if not (math.isfinite(time) and time > 0.0):
        raise InputError(f"a deployment time of {time:g} s must be finite and above 0 s")
    ring = IdealRing.of(scene)
    if ring.acceleration_from_rest(0.5 * (math.pi - math.radians(_WIDEST))) >= 0.0:
        raise InputError(
            f"scene {scene.name} does not open by its loads: give it loads.force > 0 "
            "(cables are not part of this calculation)"
        )

    def excess(angle: float) -> float:
        try:
            return opening_time(ring, 0.5 * (math.pi - math.radians(angle))).time - time
        except ValueError:
            return math.inf

    widest = _WIDEST
    if excess(widest) > 0.0:
        raise InputError(
            f"a deployment time of {time:g} s is too short: from {widest:g} deg the ideal ring "
            "already takes longer, or it does not open at all; check loads and net"
        )
    angle = widest
    while excess(angle) < 0.0:
        angle *= 0.9
        if angle < 1.0:
            raise InputError(
                f"a deployment time of {time:g} s is too long: even from 1 deg the ideal ring "
                "deploys sooner; check loads and masses"
            )
    low, high = angle, angle / 0.9
    while math.isinf(excess(low)):
        low = 0.5 * (low + high)
    return float(brentq(excess, low, min(high, widest), xtol=1e-9))
