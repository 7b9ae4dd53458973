"""Times at which something begins, ends or breaks in a scene, and values beyond the last step."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from itertools import chain, pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.faults import AT_ONCE

if TYPE_CHECKING:
    from ringsim.scene import Scene

# The times at which something begins, ends or breaks in a scene: steps end there.
#
# What acts in a step is smooth within it: a law counts by its left side up to an event, by its
# right side from there on.  Times that only a run finds, those of locks, are in
# ``ringsim.stepping.locks``.


class Events:
    """The events of a scene; ``times`` are increasing, s."""

    def __init__(self, scene: "Scene") -> None:
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


# Where a step begins Newton's method: the last steps' motion, extrapolated.
#
# With q the way since the last state and t_0 = 0 > t_1 > ... the times of the states before, q is
# the polynomial through them in Newton's form, of the divided differences
#
#     q[t_j, t_j+1] = mean rate of the step between,   q[t_j ... t_j+k] by Neville's recursion.


Array = NDArray[np.float64]


def extrapolated(moves: Sequence[tuple[float, Array]], step: float) -> Array:
    """Change over the next ``step`` (s) of what has moved in steps of so many seconds at such mean
    rates, the latest last: exact for polynomials up to as many degrees as there are moves.
    """
    times, level = [0.0], []
    for duration, rate in reversed(moves):
        times.append(times[-1] - duration)
        level.append(rate)
    power = step
    found = power * level[0]
    for order in range(2, len(times)):
        power *= step - times[order - 1]
        level = [
            (later - earlier) / (times[n] - times[n + order])
            for n, (later, earlier) in enumerate(pairwise(level))
        ]
        found = found + power * level[0]
    return found
