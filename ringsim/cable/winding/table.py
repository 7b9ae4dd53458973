"""Winding by a table of measured or optimised lengths."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ringsim.cable.winding.family import PrescribedWinding
from ringsim.units import ListIn, SecondOrZero, SignedMetre

Array = NDArray[np.float64]


class TableWinding(PrescribedWinding):
    """Lengths at times, joined by monotone cubics (PCHIP); held before the first, after the last.

    The speed is continuous between the first and the last time, and the length never
    overshoots the table: slopes are the weighted harmonic means of neighbouring secants, 0 at
    an extremum.  Source: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984), with the
    three-point end slopes of Moler, Numerical Computing with MATLAB (2004), sec. 3.6.
    """

    kind: Literal["table"] = "table"
    times: Annotated[tuple[SecondOrZero, ...], ListIn, Field(min_length=2)]
    """Increasing, in s after the start of the winch."""
    lengths: Annotated[tuple[SignedMetre, ...], ListIn]
    """Rope wound at those times, in metre; the first is 0."""

    @model_validator(mode="after")
    def _usable(self) -> TableWinding:
        if len(self.lengths) != len(self.times):
            raise ValueError(
                f"lengths has {len(self.lengths)} values, but times has {len(self.times)}: "
                "give one length for each time"
            )
        late = [b for a, b in zip(self.times, self.times[1:], strict=False) if b <= a]
        if late:
            raise ValueError(f"times = ... {late[0]:g} s must be above the time before it")
        if self.lengths[0] != 0.0:
            raise ValueError(
                f"lengths = {self.lengths[0]:g} m, ... must start at 0: the rope wound before "
                "the start belongs to the cable's initial slack"
            )
        return self

    @cached_property
    def _cubics(self) -> tuple[Array, Array]:
        """Times, and coefficients of (t - time)^0..3 in each interval, shape (intervals, 4)."""
        time, length = np.array(self.times), np.array(self.lengths)
        step, secant = np.diff(time), np.diff(length) / np.diff(time)
        slope = np.empty_like(time)
        if len(step) == 1:
            slope[:] = secant[0]
        else:
            slope[1:-1] = _inner_slopes(step, secant)
            slope[0] = _end_slope(step[0], step[1], secant[0], secant[1])
            slope[-1] = _end_slope(step[-1], step[-2], secant[-1], secant[-2])
        bend = (3.0 * secant - 2.0 * slope[:-1] - slope[1:]) / step
        twist = (slope[:-1] + slope[1:] - 2.0 * secant) / step**2
        return time, np.stack([length[:-1], slope[:-1], bend, twist], axis=-1)

    def usual_speed(self) -> float:
        """Median over time of the mean speeds between the table's times at which it moves, m/s."""
        step, speed = np.diff(self.times), np.abs(np.diff(self.lengths) / np.diff(self.times))
        order = np.argsort(speed)
        order = order[speed[order] > 0.0]
        elapsed = np.cumsum(step[order])
        if not len(order):
            return 0.0
        return float(speed[order[np.searchsorted(elapsed, 0.5 * elapsed[-1])]])

    def wound(self, time: float) -> float:
        """Rope taken up, in metre."""
        times, cubics = self._cubics
        clipped = min(max(time, self.times[0]), self.times[-1])
        k = min(int(np.searchsorted(times, clipped, side="right")) - 1, len(cubics) - 1)
        s = clipped - self.times[k]
        c = cubics[k]
        return float(c[0] + s * (c[1] + s * (c[2] + s * c[3])))

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s; 0 outside the table."""
        times, cubics = self._cubics
        if not self.times[0] <= time < self.times[-1]:
            return 0.0
        k = int(np.searchsorted(times, time, side="right")) - 1
        s = time - self.times[k]
        c = cubics[k]
        return float(c[1] + s * (2.0 * c[2] + s * 3.0 * c[3]))


def _inner_slopes(step: Array, secant: Array) -> Array:
    before, after = secant[:-1], secant[1:]
    near, far = step[1:] + 2.0 * step[:-1], 2.0 * step[1:] + step[:-1]
    same = before * after > 0.0
    first, second = np.where(same, before, 1.0), np.where(same, after, 1.0)
    return np.where(same, (near + far) / (far / first + near / second), 0.0)


def _end_slope(near: float, far: float, secant: float, following: float) -> float:
    slope = ((2.0 * near + far) * secant - near * following) / (near + far)
    if slope * secant <= 0.0:
        return 0.0
    if secant * following <= 0.0 and abs(slope) > 3.0 * abs(secant):
        return 3.0 * secant
    return slope
