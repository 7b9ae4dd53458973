"""Finding the stowed angle from a measured deployment time."""

from __future__ import annotations

import math

from scipy.optimize import brentq

from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.theory.energy_quadrature import opening_time
from ringsim.theory.ideal_ring import IdealRing


def opening_angle_for(scene: Scene, time: float) -> float:
    """Initial opening angle in deg from which the scene's ideal ring deploys in ``time``.

    The energy quadrature of ringsim.theory.energy_quadrature, solved for its lower end.

    Raises
    ------
    InputError
        If no angle between 1 and 179 deg gives that time.
    """
    ring = IdealRing.of(scene)

    def excess(angle: float) -> float:
        try:
            return opening_time(ring, 0.5 * (math.pi - math.radians(angle))).time - time
        except ValueError:
            return math.inf

    widest = 179.0
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
