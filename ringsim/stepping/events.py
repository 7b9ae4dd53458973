"""The times at which something begins, ends or breaks in a scene: steps end there.

What acts in a step is smooth within it: a law counts by its left side up to an event, by its right
side from there on.  Times that only a run finds, those of locks, are in ``ringsim.stepping.locks``.
"""

import math
from bisect import bisect_right
from itertools import chain
from typing import Any

from ringsim.parts.faults.family import AT_ONCE


class Events:
    """The events of a scene; ``times`` are increasing, s."""

    def __init__(self, scene: Any) -> None:
        """Faults strike, loads turn round, winches start and stop, and their laws bend, see
        ``Winch.breaks``.
        """
        cables = () if scene.cables is None else (cable for _, cable in scene.cables.present())
        winches = chain.from_iterable(cable.winches for cable in cables)
        found = {fault.time for fault in scene.faults} | {scene.loads_turn_at} - {math.inf}
        found.update(chain.from_iterable(winch.breaks() for winch in winches))
        self.times = sorted(time for time in found if time > AT_ONCE)

    def after(self, time: float) -> float:
        """The first event behind a time, s, and not at once with it; infinite if there is none."""
        number = bisect_right(self.times, time + AT_ONCE)
        return self.times[number] if number < len(self.times) else math.inf

    def at(self, time: float) -> bool:
        """Whether there is an event at a time (s), or at once with it."""
        return self.after(time - 2.0 * AT_ONCE) <= time + AT_ONCE
