r"""Slip speed that regularises pulley friction, and the error that it causes at low speed.

Friction reverses with the rope; p_j = tanh(s_j / s_slip) of the full decay makes that smooth
(``ringsim.cable.chain``).  On a ring of N sections that open evenly the 2 N spans beside the V
pulleys give the rope free, so a pulley with m of them beyond it sees

    s = m v,   v = winding speed / (2 N) = 1.5 winding speed / (spans of the cable),

falling to v at the V pulley next to the fixed end; with two winches m counts from where the rope
rests between them.  The tension there is too high by

    exp(sum over pulleys of \|ln eta\| (1 - tanh(m v / s_slip))) - 1,

which hardly depends on N; docs/cables.md lists it.
"""

import math

import numpy as np

from ringsim.cable.ropes import Array

LARGEST_SLIP_SPEED = 2e-4
"""Metre per second; the slip speed of rope that is wound fast, or not at all."""
SHARE = 0.5
"""Slip speed over the winding speed per span: the slowest pulley has tanh(3) = 0.995 of its
friction, an excess of 0.03 % at f / R = 0.04 and below 1 % up to f / R = 0.9."""
TOLERATED = 0.01
"""Relative error of the far end's tension below which a run does not mention it."""
_MOVES = 1e-3
"""Share of the largest winding speed above which a winch counts as turning."""


def slip_speed(winding: float, pulleys: int) -> float:
    """The slip speed (m/s) that suits a winding speed (m/s, of all winches of a cable).

    >>> round(slip_speed(winding=6e-4, pulleys=5), 9)
    5e-05
    """
    if winding <= 0.0:
        return LARGEST_SLIP_SPEED
    return min(LARGEST_SLIP_SPEED, SHARE * winding / (pulleys + 1))


def excess(slip: float, winding: float, pulleys: int, decay: float) -> float:
    """Relative excess of the tension where the rope is slowest.

    Slip speed and winding speed are in m/s; ``decay`` is the largest -ln(eta) of the pulleys.
    """
    spans = np.arange(1, max(2 * (pulleys + 1) // 3, 2))
    alike = 2.0 - spans % 2  # one V pulley, then the two hinge pulleys of neighbouring sections
    faded = 1.0 - np.tanh(spans * 1.5 * winding / (pulleys + 1) / slip)
    return math.expm1(decay * float(alike @ faded))


def usual_winding(times: Array, wound: Array) -> float:
    """Median speed (m/s) of winches while they turn, from rope wound (m) at times (s)."""
    known = np.isfinite(wound)
    speed = np.abs(np.diff(wound[known])) / np.diff(times[known])
    moving = speed[speed > _MOVES * speed.max(initial=0.0)]
    return float(np.median(moving)) if len(moving) else 0.0
