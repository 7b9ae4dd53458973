"""Curves in time: piecewise cubics with slopes known or chosen, polynomials beyond the last step.

The cubics are what ``scipy.interpolate`` has as CubicHermiteSpline and PchipInterpolator, and agree
with these to round-off (tests/outputs/test_hermite.py).  Every run needs these two, and that
package takes nearly as long to load as a ring of 18 sections to run.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_AT_ONCE = 1 << 16
"""Numbers that are found at once: half a dozen arrays of all joints of a long ring at all times
took more memory than its run."""


def cubic(times: Array, values: Array, slopes: Array, where: Array) -> Array:
    """The cubics that fit values and slopes, (n, ...), at times (n,), n >= 2, at other times (m,).

    Shape (m, ...), in the values' unit; beyond the ends the outermost cubics go on.
    """
    found = np.empty((len(where), *values.shape[1:]))
    numbers = np.clip(np.searchsorted(times, where, side="right") - 1, 0, len(times) - 2)
    wide, rows = (-1, *[1] * (values.ndim - 1)), max(1, _AT_ONCE * len(where) // max(1, found.size))
    for begin in range(0, len(where), rows):
        own = slice(begin, begin + rows)
        k = numbers[own]
        step = (times[k + 1] - times[k]).reshape(wide)
        share = (where[own] - times[k]).reshape(wide) / step
        risen = values[k + 1] - values[k]
        first, last = slopes[k] * step - risen, slopes[k + 1] * step - risen
        # The line between both ends, and what bends it: (1 - s) s ((1 - s) first - s last).
        bent = (1.0 - share) * first - share * last
        found[own] = values[k] + share * risen + share * (1.0 - share) * bent
    return found


def monotone_slopes(times: Array, values: Array) -> Array:
    """Slopes with which the cubics rise and fall with the values (n, ...) at times (n,), n >= 2.

    Between two steps of one direction the weighted harmonic mean of their slopes, else none; at
    the ends the slope of the parabola through three values, as far as it keeps their direction.
    Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; C. Moler, Numerical
    Computing with MATLAB, section 3.4 (pchip).
    """
    step = np.diff(times).reshape(-1, *[1] * (values.ndim - 1))
    rise = np.diff(values, axis=0) / step
    if len(rise) == 1:
        return np.concatenate([rise, rise])
    slopes = np.zeros_like(values, dtype=float)
    before, after = rise[:-1], rise[1:]
    near, far = 2.0 * step[1:] + step[:-1], step[1:] + 2.0 * step[:-1]
    same = before * after > 0.0
    np.divide(
        (near + far) * before * after, near * after + far * before, out=slopes[1:-1], where=same
    )
    slopes[0] = _end_slope(step[0], step[1], rise[0], rise[1])
    slopes[-1] = _end_slope(step[-1], step[-2], rise[-1], rise[-2])
    return slopes


def _end_slope(step: Array, next_step: Array, rise: Array, next_rise: Array) -> Array:
    slope = ((2.0 * step + next_step) * rise - step * next_rise) / (step + next_step)
    slope = np.where(slope * rise > 0.0, slope, 0.0)
    over = (rise * next_rise <= 0.0) & (np.abs(slope) > 3.0 * np.abs(rise))
    return np.where(over, 3.0 * rise, slope)


def first_zero(step: float, values: Array, slopes: Array) -> float:
    """Least time (s) from 0 to ``step`` at which the cubic of two values and slopes is zero.

    ``step`` if round-off has put it beyond.
    """
    first, last = slopes * step - (values[1] - values[0])
    risen = values[1] - values[0]
    # Powers of the share s of the step, the highest first, of what ``cubic`` evaluates.
    roots = np.roots([first + last, -2.0 * first - last, first + risen, values[0]])
    real = roots.real[(np.abs(roots.imag) < 1e-12) & (roots.real >= 0.0) & (roots.real <= 1.0)]
    return step * float(real.min(initial=1.0))


# Where a step begins Newton's method: the last steps' motion, extrapolated.
#
# With q the way since the last state and t_0 = 0 > t_1 > ... the times of the states before, q is
# the polynomial through them in Newton's form, of the divided differences
#
#     q[t_j, t_j+1] = mean rate of the step between,   q[t_j ... t_j+k] by Neville's recursion.


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
