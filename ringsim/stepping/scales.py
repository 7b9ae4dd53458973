"""Reference numbers of a structure, known before its run, from which steps and guards start."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Scales:
    """What a run's control must know of a structure.

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
