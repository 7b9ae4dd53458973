"""The net's strings from corners to a hub, a point with three unknowns of its own."""

import numpy as np

from ringsim.layout.layout import HubNet
from ringsim.layout.pose import Array
from ringsim.parts.persection import at_section

_NUDGE = 1e-7
"""Change of stretch (m) and rate (m/s) by which the strings' slopes are measured."""


class Strings:
    """Strings between the hub and the origins of bodies, at places and rates of shape (n, 3)."""

    def __init__(self, held: HubNet) -> None:
        self.bodies = np.array(held.bodies)
        self.hub_mass, self._free = held.law.hub_mass, held.law.neutral_length
        self._law = at_section(held.law, np.arange(len(held.bodies)))

    def _read(self, ends: Array, rates: Array, hub: Array, hub_rate: Array):
        arms, moving = ends - hub, rates - hub_rate
        lengths = np.sqrt(np.einsum("ij,ij->i", arms, arms))
        units = arms / lengths[:, None]
        return lengths, units, np.einsum("ij,ij->i", units, moving)

    def pulls(
        self, ends: Array, rates: Array, hub: Array, hub_rate: Array
    ) -> tuple[Array, float, Array, Array]:
        """Forces that resist at the bodies, (n, 3), N; energy, J; dissipating forces, N, and the
        strings' lengths, m.
        """
        lengths, units, along = self._read(ends, rates, hub, hub_rate)
        reaction = self._law.tension(lengths - self._free, along)
        lost = np.broadcast_to(reaction.damping, lengths.shape)
        return reaction.total[:, None] * units, float(np.sum(reaction.stored)), lost, lengths

    def tangents(
        self, ends: Array, rates: Array, hub: Array, hub_rate: Array, rate_by_place: float
    ) -> Array:
        """Derivatives of the forces after the bodies' places, (n, 3, 3), N/m."""
        lengths, units, along = self._read(ends, rates, hub, hub_rate)
        stretch = lengths - self._free

        def force(x: Array, rate: Array) -> Array:
            return np.asarray(self._law.tension(x, rate).total)

        slope = force(stretch + _NUDGE, along) - force(stretch - _NUDGE, along)
        drag = force(stretch, along + _NUDGE) - force(stretch, along - _NUDGE)
        slope = (slope + rate_by_place * drag) / (2.0 * _NUDGE)
        both = units[:, :, None] * units[:, None, :]
        across = (force(stretch, along) / lengths)[:, None, None]
        return np.asarray(slope[:, None, None] * both + across * (np.eye(3) - both))
