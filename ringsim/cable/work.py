"""Work of the winches on the cables, and losses of the cables, between two instants.

The work of a force is its mean at both instants times the displacement: rope wound on a drum,
rope slipped over a pulley, strain of a rope.  The trapezoidal rule balances exactly these works;
products of force and rate at the instants alone miss the displacement between them.
Source: the energy balance of Belytschko, Liu and Moran, Nonlinear Finite Elements for Continua
and Structures (2000), sec. 6.2.3.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ringsim.cable.state import ChainState


class ChainWork(NamedTuple):
    """Energies in J: put in by the winches, less what is wound up; lost by friction, damping."""

    driven: float
    lost: float


def work_between(before: ChainState, after: ChainState) -> ChainWork:
    """Work on the cables from one instant to a later one.

    Nothing moves while a fault changes the ropes: states of different ropes have no work.
    """
    ropes = after.ropes
    if before.ropes is not ropes:
        return ChainWork(0.0, 0.0)
    wound = after.wound - before.wound
    pulls = 0.5 * (before.winch_forces + after.winch_forces)
    carried = 0.5 * (before.energy_density + after.energy_density) * ropes.per_rope(wound)
    slipped = before.held_beyond - after.held_beyond
    beyond = ropes.last[ropes.cable[ropes.of_pulley]] == ropes.of_pulley
    slipped -= beyond * wound[ropes.cable[ropes.of_pulley], 1]
    friction = 0.5 * (before.friction_forces + after.friction_forces) * slipped
    viscous = 0.5 * (before.viscous_forces + after.viscous_forces)
    viscous = viscous * 0.5 * (before.natural + after.natural) * (after.strains - before.strains)
    return ChainWork(
        driven=float(np.sum(pulls * wound) - np.sum(carried)),
        lost=float(np.sum(friction) + np.sum(viscous)),
    )
