"""Energy that passes between two readings of a run: lost in the structure, put in by winches."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.state import ChainState
from ringsim.cable.work import ChainWork, work_between

Array = NDArray[np.float64]
_Instant = tuple[float, Array, Array, ChainState | None]


class StepWork:
    """Sums of mean force times displacement between two instants.

    The displacement of a damper is the mean of its rates times the step, which differs from that
    of generalised-alpha by a hundredth of the rates' change over the step at most.
    """

    def __init__(self) -> None:
        self._before: _Instant | None = None
        self._last: _Instant | None = None

    def since(
        self, time: float, forces: Array, rates: Array, chain: ChainState | None
    ) -> ChainWork:
        """Energies in J since the instant that was kept last; none before the first.

        Parameters
        ----------
        time
            Of the reading, s.
        forces, rates
            Of everything that damps, N or N m against m/s or rad/s, in the same order each time.
        chain
            The cables, if there are any.
        """
        self._last = (time, forces, rates, chain)
        if self._before is None:
            return ChainWork(0.0, 0.0)
        begin, old_forces, old_rates, old_chain = self._before
        lost = 0.25 * (time - begin) * float((forces + old_forces) @ (rates + old_rates))
        if chain is None or old_chain is None:
            return ChainWork(0.0, lost)
        driven, lost_in_cables = work_between(old_chain, chain)
        return ChainWork(driven, lost + lost_in_cables)

    def keep(self) -> None:
        """Count from the instant of the last call on."""
        self._before = self._last
