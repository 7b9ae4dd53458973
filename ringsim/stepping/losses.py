"""What friction, dampers and stops take in a step."""

from typing import NamedTuple

import numpy as np

from ringsim.stepping.instant import Array


class Passing(NamedTuple):
    """Time (s), forces that take energy, and the rates and places that they resist, shape (n,).

    Pairs of forces and places are N and m, or N m and rad; places of which only the rates are known
    are None.
    """

    time: float
    forces: Array
    rates: Array
    places: Array | None = None


def lost_between(before: Passing, after: Passing) -> float:
    """Work in J of forces in a step h in which they and the rates of their places go linearly:

        mean force times displacement + h (F2 - F1) (v2 - v1) / 12.

    Without the second part, never negative where friction grows with the rate, every change of
    speed would seem to cost energy.  A displacement that is not known is the mean rate times the
    step, which differs from generalised-alpha's by a hundredth of the rates' change at most.  Where
    steps do not resolve a vibration, rates change sign from end to end and too much counts as lost:
    the balance shows it as energy that was added.
    """
    step, rises = after.time - before.time, after.forces - before.forces
    if before.places is None or after.places is None:
        moved = 0.5 * step * (before.rates + after.rates)
    else:
        moved = after.places - before.places
    mean = 0.5 * float(np.vdot(before.forces + after.forces, moved))
    return mean + step / 12.0 * float(np.vdot(rises, after.rates - before.rates))
