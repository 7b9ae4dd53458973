"""What an engine tells of a run before it, and of the states that it reaches."""

import math
from dataclasses import dataclass
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


def exchanged(kinds: Array) -> float:
    """Energy in J that a run has exchanged: the largest of the ranges of kinetic energy, of elastic
    energy, and of works, those of loads and of winches added.

    ``kinds`` has the shape (n, 4): these at n instants, or their lowest and highest values so far.
    It never falls: unlike the present work it is not emptied where loads change their sign, or
    where a winch takes what loads give.
    """
    kinetic, elastic, loads, winches = np.ptp(kinds, axis=0)
    return float(max(kinetic, elastic, loads + winches))


class Strained(NamedTuple):
    """Elastic energy (J) of rods and boom before a run: as the engine finds it, and as putting the
    structure together has left it.
    """

    found: float
    left: float


AS_DRAWN = Strained(0.0, 0.0)


@dataclass(frozen=True)
class Instant:
    """A state that a run has reached."""

    time: float
    """Since the start of the run, s."""
    angles: Array
    """Opening angles, shape (planes, sections), rad."""
    rates: Array
    """Their rates, rad/s."""
    energies: Energies
    gap: float = 0.0
    """Largest distance of points that a joint holds together, m."""
    tensions: Array | None = None
    """Of all spans, N; None without cables."""
    stretch: float = 0.0
    """Largest strain of a rope."""
    driven: bool = False
    """Whether a winch turns or will turn on its rope, or a fault is still to come."""


class Scales(NamedTuple):
    """Reference numbers of a structure, from which steps and guards start.

    Attributes
    ----------
    rate, energy
        Reference opening rate (rad/s) of the run, and the kinetic energy at it (J).
    travel, length
        Opening angle to be covered (rad), and what gaps of joints are measured against (m).
    contact_step, first_step
        Steps that resolve a bounce on a stop at the tolerance 1e-4, and ropes that swing as a winch
        starts, s; infinite without stops or cables.
    slack_tension, slack_energy
        Tension (N) that does not matter, and a tenth of it pulled along every path (J); None
        without cables.
    """

    rate: float
    energy: float
    travel: float
    length: float
    contact_step: float = math.inf
    first_step: float = math.inf
    slack_tension: float | None = None
    slack_energy: float | None = None
