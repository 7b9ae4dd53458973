"""Whether a drive has a limit, without which it has no margin."""

import math

from ringsim.cable.records import Cables
from ringsim.choice import kind_of


def why_unlimited(cables: Cables | None, planes: tuple[str, ...]) -> str:
    """Which winch pulls with any force, and the cure; empty if none does."""
    for plane, cable in [] if cables is None else cables.present():
        for end, winch in zip(("winch", "far_winch"), cable.winches, strict=False):
            if not math.isfinite(winch.winding.available_tension()):
                return (
                    f'cables.{planes[plane]}.{end}.winding.kind = "{kind_of(winch.winding)}": it '
                    'pulls with any force, so that the drive has no margin (choose kind = "motor" '
                    'or "stall", or leave margin out)'
                )
    return ""
