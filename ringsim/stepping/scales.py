"""Reference numbers of a structure, known before its run, from which steps and guards start."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np


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


def reference_rate(acceleration: float, travel: float, end_time: float) -> float:
    """Mean rate in rad/s over a travel (rad) if the first acceleration a (rad/s^2) lasted,
    sqrt(|a| travel / 2); at least that of a run that takes all of ``end_time`` (s).
    """
    return max(math.sqrt(0.5 * abs(acceleration) * travel), travel / end_time)


def swing_step(inertia: float, stiffness: float, steps: int) -> float:
    """Step in s that takes so many to the period 2 pi sqrt(I / k) of a swing (kg m^2, N m/rad).

    20 for a bounce on a stop: the period is right to (w h)^2 / 12 = 0.8 %.  50 for ropes: a winch
    that starts at once throws the structure into its swing on them, often with the largest tension
    of the run, and the first V-joint moves before the others, that is faster than the period says.
    """
    return 2.0 * math.pi * math.sqrt(inertia / stiffness) / steps


def residual_tolerance(share: float, drive: float, stiffest: float, unknowns: int) -> float:
    """Residual norm in N at which Newton stops: a share of the driving forces (N), but above what
    round-off lets it reach, the rate EA / L of the stiffest element (N/m) times coordinates of
    order 1 m, for so many unknowns.
    """
    return max(share * drive, 4.0 * float(np.finfo(float).eps) * stiffest * math.sqrt(unknowns))
