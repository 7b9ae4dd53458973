"""What an engine tells of the states that it reaches."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Energies(NamedTuple):
    """Energies in J: kinetic, elastic and work of the loads at one instant; since the instant
    before, what was lost in friction, dampers and stops, and what the winches put in less the
    strain energy that they wind up.
    """

    kinetic: float
    elastic: float
    work: float
    lost: float
    driven: float = 0.0


class Instant(NamedTuple):
    """Time (s), opening angles (rad) and their rates (rad/s), shape (planes, sections); energies;
    largest gap of a joint (m); tensions of all spans (N), None without cables.
    """

    time: float
    angles: Array
    rates: Array
    energies: Energies
    gap: float = 0.0
    tensions: Array | None = None
