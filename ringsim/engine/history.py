"""What a run leaves behind, step by step."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ringsim.stepping.instant import Energies
from ringsim.variables import Status

Array = NDArray[np.float64]


@dataclass
class History:
    """What was read at every accepted step; lists of equal length.

    Attributes
    ----------
    angles, rates
        Opening angles and rates, rad and rad/s, shape (2, sections) each.
    gaps
        Largest joint gap, m.
    stresses
        Shape (8, sections) each, Pa; empty unless recorded.
    tensions, slack, wound
        Tension of every span of all cables behind one another (N), whether each cable is
        slack at its winch, and the rope that its winches have wound (m); empty without cables.

    """

    times: list[float] = field(default_factory=list)
    angles: list[Array] = field(default_factory=list)
    rates: list[Array] = field(default_factory=list)
    energies: list[Energies] = field(default_factory=list)
    gaps: list[float] = field(default_factory=list)
    stresses: list[Array] = field(default_factory=list)
    tensions: list[Array] = field(default_factory=list)
    slack: list[Array] = field(default_factory=list)
    wound: list[Array] = field(default_factory=list)
    lengths: list[Array] = field(default_factory=list)
    strains: list[Array] = field(default_factory=list)
    status: Status = Status.UNFINISHED
    reason: str = ""
    newton_iterations: int = 0
    jacobians: int = 0
    halvings: int = 0
