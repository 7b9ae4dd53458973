"""Finding the stowed angle from a measured deployment time."""

import math
from functools import cache

import scipy

from ringsim.cable.records import BarHalfBracket
from ringsim.choice import kind_of
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.scene.substituted import substituted
from ringsim.simulation import run_frame
from ringsim.structures.pantograph_ring import LEAST_OPENING

_WIDEST = 179.0
"""Opening angles that are tried, deg."""
_PATIENCE, _LONGEST = 2.0, 1e6
"""A run is stopped after this multiple of the wanted time, or after this time (s)."""
_CLOSE = 1e-3
"""Tolerance of the angle, deg: what it changes of the time is less than the error of the steps."""


def opening_angle_for(scene: Scene, time: float) -> float:
    """Initial opening angle in deg from which the scene deploys in ``time`` (s).

    Every angle that is tried is a run of the frame engine with all parts of the scene.

    Raises
    ------
    InputError
        If no angle between 1 and 179 deg gives that time, or the frame engine cannot represent the
        scene.
    """
    if "opening_angle" not in type(scene.structure).model_fields:
        raise InputError(
            f'structure.kind = "{kind_of(scene.structure)}" has no opening_angle to find'
        )
    opened: float = scene.structure.opening_angle  # type: ignore[attr-defined]
    if not (math.isfinite(time) and time > 0.0):
        raise InputError(f"a deployment time of {time:g} s must be finite and above 0 s")
    end = min(max(_PATIENCE * time, scene.solver.step), _LONGEST)
    plain = substituted(scene).with_values(
        {
            "limits.rod_stress": "none",
            "record.stress": False,
            "solver.error_bars": False,
            "solver.end_time": end,
        }
    )
    cables = [] if scene.cables is None else [cable for _, cable in scene.cables.present()]
    # From these angles on every cable's bracket opens the ring, and no stop is in contact.
    held = [c.bracket.angle - 90.0 for c in cables if isinstance(c.bracket, BarHalfBracket)]
    least = max(
        [LEAST_OPENING, *held, 0.0 if scene.stop is None else scene.stop.stowed_angle + _CLOSE]
    )

    @cache  # brentq begins with both ends again
    def excess(angle: float) -> float:
        outcome = run_frame(plain.with_values({"structure.opening_angle": angle}))
        if outcome.status.failed:
            raise InputError(f"from {angle:.4g} deg the run fails: {outcome.reason}")
        found = float(outcome.values["deployment_time"]) - time
        return found if math.isfinite(found) else math.inf

    low = high = min(max(opened, least), _WIDEST)
    slow = fast = excess(low)
    while fast > 0.0:
        if high == _WIDEST:
            raise InputError(
                f"a deployment time of {time:g} s is too short: from {_WIDEST:g} deg the ring "
                "takes longer or never opens: check loads, cables, net and friction"
            )
        low, slow, high = high, fast, min(0.5 * (high + 180.0), _WIDEST)
        fast = excess(high)
    while slow < 0.0:
        if low == least:
            raise InputError(
                f"a deployment time of {time:g} s is too long: even from {least:g} deg the ring "
                "deploys sooner; check loads, cables and masses"
            )
        low, high = max(0.7 * low, least), low
        slow = excess(low)
    while math.isinf(slow):
        middle = 0.5 * (low + high)
        if high - low < _CLOSE:
            raise InputError(
                f"a deployment time of {time:g} s is not possible: near {low:.6g} deg the "
                "deployment time jumps past it"
            )
        found = excess(middle)
        low, high, slow = (middle, high, found) if found >= 0.0 else (low, middle, slow)
    return float(scipy.optimize.brentq(excess, low, high, xtol=_CLOSE))
