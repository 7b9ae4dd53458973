"""The net's strings from corners to a hub, a point with three unknowns of its own."""

import math

import numpy as np

from ringsim.frame.laws import slope_of
from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import Indices
from ringsim.frame.vectors import compiled, dot, minus, times, vector
from ringsim.layout.layout import HubNet
from ringsim.layout.pose import Array
from ringsim.parts.persection import at_section


@compiled
def stretched(ends: Array, rates: Array, hub: Array, hub_rate: Array) -> tuple[Array, Array, Array]:
    """Lengths (m), their rates (m/s) and directions of strings from the hub."""
    n = len(ends)
    lengths, along, units = np.empty(n), np.empty(n), np.empty((n, 3))
    for k in range(n):
        arm = minus(vector(ends[k]), vector(hub))
        length = math.sqrt(dot(arm, arm))
        unit = times(1.0 / length, arm)
        lengths[k], along[k] = length, dot(unit, minus(vector(rates[k]), vector(hub_rate)))
        units[k, 0], units[k, 1], units[k, 2] = unit
    return lengths, along, units


@compiled
def add_strings(mesh: Mesh, ends: Indices, blocks: Array, fronts: Array, columns: Array) -> None:
    """Add derivatives of the strings' pulls, (n, 3, 3), to the fronts, and those after the hub's
    place to the first three columns.
    """
    for n in range(len(ends)):
        number, first = mesh.frame_local[ends[n], 0], mesh.frame_local[ends[n], 1]
        home = mesh.home[ends[n]]
        for i in range(3):
            for j in range(3):
                fronts[number, first + i, first + j] += blocks[n, i, j]
                columns[home + i, j] -= blocks[n, i, j]


class Strings:
    """Strings between the hub and the origins of bodies, at places and rates of shape (n, 3)."""

    def __init__(self, held: HubNet) -> None:
        self.hub_mass, self._free = held.law.hub_mass, held.law.neutral_length
        self._one_sided = not held.law.two_sided
        self._law = at_section(held.law, np.arange(len(held.bodies)))

    def pulls(self, ends: Array, rates: Array, hub: Array, hub_rate: Array) -> Array | None:
        """Forces that resist at the bodies, (n, 3), N; None while all are slack."""
        lengths, along, units = stretched(ends, rates, hub, hub_rate)
        if self._one_sided and lengths.max() <= self._free:
            return None
        return np.asarray(self._law.tension(lengths - self._free, along).total[:, None] * units)

    def passing(
        self, ends: Array, rates: Array, hub: Array, hub_rate: Array
    ) -> tuple[float, Array, Array, Array]:
        """Energy stored (J), dissipating forces of the strings (N), their lengths (m) and rates of
        these (m/s).
        """
        lengths, along, _ = stretched(ends, rates, hub, hub_rate)
        reaction = self._law.tension(lengths - self._free, along)
        lost = np.broadcast_to(reaction.damping, lengths.shape)
        return float(np.sum(reaction.stored)), lost, lengths, along

    def tangents(
        self, ends: Array, rates: Array, hub: Array, hub_rate: Array, rate_by_place: float
    ) -> Array | None:
        """Derivatives of the forces after the bodies' places, (n, 3, 3), N/m; None while all are
        slack.
        """
        lengths, along, units = stretched(ends, rates, hub, hub_rate)
        if self._one_sided and lengths.max() <= self._free:
            return None
        stretch = lengths - self._free

        def force(x: Array, rate: Array) -> Array:
            return np.asarray(self._law.tension(x, rate).total)

        slope = slope_of(force, stretch, along, rate_by_place)
        both = units[:, :, None] * units[:, None, :]
        across = (force(stretch, along) / lengths)[:, None, None]
        return np.asarray(slope[:, None, None] * both + across * (np.eye(3) - both))
