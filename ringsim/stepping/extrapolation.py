"""Where a step begins Newton's method: the last steps' motion, extrapolated.

With q the way since the last state and t_0 = 0 > t_1 > ... the times of the states before, q is the
polynomial through them in Newton's form, of the divided differences

    q[t_j, t_j+1] = mean rate of the step between,   q[t_j ... t_j+k] by Neville's recursion.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

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
