"""What every engine reads of an accepted state for the outputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.cable.state import ChainState
from ringsim.stepping.instant import Energies

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reading:
    """The state of a run at the end of a step."""

    time: float
    """Since the start of the run, s."""
    angles: Array
    """Opening angles, shape (planes, sections), rad."""
    rates: Array
    """Their rates, rad/s."""
    energies: Energies
    """Outputs read ``work`` with what the winches put in, and ``lost``, since the start."""
    gap: float = 0.0
    """Largest distance of points that a joint holds together, m."""
    latched: NDArray[np.bool_] | None = None
    """Whether each V-joint's latch holds, shape (planes, sections)."""
    chain: ChainState | None = None
    """All cables; None if the scene has none."""
    planes: tuple[tuple[int, ...], ...] = ()
    """Planes of each cable of the chain: one may stand for two cables that pull alike."""
    stress: Array | None = None
    """Axial + bending stress, shape (rod halves, sections), Pa; None unless recorded."""
    strain: Array | None = None
    """Bending strain at the stations of the rod with the gauge, if the structure has one."""

    def by_plane(self, of_cables: NDArray[Any]) -> Array:
        """A number for each plane, from one for each cable; NaN where a plane has no cable."""
        found = np.full(len(self.angles), np.nan)
        for planes, value in zip(self.planes, of_cables, strict=True):
            found[list(planes)] = value
        return found
