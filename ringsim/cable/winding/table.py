"""Winding by a table of measured or optimised lengths."""

from functools import cached_property
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from ringsim.cable.winding.family import PrescribedWinding
from ringsim.units import ListIn, SecondOrZero, SignedMetre


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
    def _usable(self) -> "TableWinding":
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
    def _curve(self) -> Any:
        from scipy.interpolate import PchipInterpolator  # here: reading scenes must not load scipy

        return PchipInterpolator(self.times, self.lengths)

    def usual_speed(self) -> float:
        """Median over time of the mean speeds between the table's times at which it moves, m/s."""
        step, speed = np.diff(self.times), np.abs(np.diff(self.lengths) / np.diff(self.times))
        order = [k for k in np.argsort(speed) if speed[k] > 0.0]
        if not order:
            return 0.0
        elapsed = np.cumsum(step[order])
        return float(speed[order[np.searchsorted(elapsed, 0.5 * elapsed[-1])]])

    def breaks(self) -> tuple[float, ...]:
        """The times of the table, s."""
        return self.times

    def rests_from(self) -> float:
        """The last time of the table, s."""
        return self.times[-1]

    def wound(self, time: float) -> float:
        """Rope taken up, in metre."""
        return float(self._curve(min(max(time, self.times[0]), self.times[-1])))

    def wound_rate(self, time: float) -> float:
        """Its rate, in m/s; 0 outside the table."""
        inside = self.times[0] <= time < self.times[-1]
        return float(self._curve(time, 1)) if inside else 0.0
