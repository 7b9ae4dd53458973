"""The net's strings from corners to a hub, a point with three unknowns of its own."""

import math

import numpy as np

from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import Indices
from ringsim.frame.tape import Tape, play, taped
from ringsim.frame.vectors import compiled, dot, minus, times, vector
from ringsim.layout.layout import HubNet
from ringsim.layout.pose import Array
from ringsim.parts.persection import at_section

_NUDGE = 1e-7
"""Change of stretch (m) and its rate (m/s) by which the slopes of the law are measured."""
_STRETCH, _RATE, _ELASTIC, _DAMPING, _STORED = range(5)
"""Rows of the law's tape."""


@compiled
def stretched(
    ends: Array, rates: Array, hub: Array, hub_rate: Array
) -> tuple[Array, Array, Array, float]:
    """Lengths (m), their rates (m/s) and directions of strings from the hub; the greatest."""
    n, most = len(ends), 0.0
    lengths, along, units = np.empty(n), np.empty(n), np.empty((n, 3))
    for k in range(n):
        arm = minus(vector(ends[k]), vector(hub))
        length = math.sqrt(dot(arm, arm))
        unit = times(1.0 / length, arm)
        lengths[k], along[k] = length, dot(unit, minus(vector(rates[k]), vector(hub_rate)))
        units[k, 0], units[k, 1], units[k, 2] = unit
        most = max(most, length)
    return lengths, along, units, most


@compiled
def _feel(
    tape: Tape, free: float, lengths: Array, along: Array, more: float, faster: float
) -> None:
    """Play the law at lengths and rates, all so much larger."""
    for k in range(len(lengths)):
        tape.rows[_STRETCH, k] = lengths[k] - free + more
        tape.rows[_RATE, k] = along[k] + faster
    play(tape)


@compiled
def pull_strings(
    tape: Tape, free: float, one_sided: bool, mesh: Mesh, bodies: Indices,
    ends: Array, rates: Array, hub: Array, hub_rate: Array, g: Array,
) -> None:  # fmt: skip
    """Add what resists at the bodies and, in the last three unknowns, at the hub."""
    lengths, along, units, most = stretched(ends, rates, hub, hub_rate)
    if one_sided and most <= free:
        return
    _feel(tape, free, lengths, along, 0.0, 0.0)
    at = len(g) - 3
    for n in range(len(bodies)):
        home, pull = mesh.home[bodies[n]], tape.rows[_ELASTIC, n] + tape.rows[_DAMPING, n]
        for i in range(3):
            g[home + i] += pull * units[n, i]
            g[at + i] -= pull * units[n, i]


@compiled
def string_tangents(
    tape: Tape, free: float, one_sided: bool, rate_by_place: float,
    ends: Array, rates: Array, hub: Array, hub_rate: Array,
) -> Array:  # fmt: skip
    """Derivatives of the forces after the bodies' places, (n, 3, 3), N/m; none, (0, 3, 3), while
    all strings are slack.
    """
    lengths, along, units, most = stretched(ends, rates, hub, hub_rate)
    n = 0 if one_sided and most <= free else len(lengths)
    out, slope = np.zeros((n, 3, 3)), np.zeros(n)
    if n == 0:
        return out
    for side in (1.0, -1.0):
        for what in range(2):
            _feel(tape, free, lengths, along, (1 - what) * side * _NUDGE, what * side * _NUDGE)
            share = side / (2.0 * _NUDGE) * (1.0 if what == 0 else rate_by_place)
            for k in range(n):
                slope[k] += share * (tape.rows[_ELASTIC, k] + tape.rows[_DAMPING, k])
    _feel(tape, free, lengths, along, 0.0, 0.0)
    for k in range(n):
        across = (tape.rows[_ELASTIC, k] + tape.rows[_DAMPING, k]) / lengths[k]
        for i in range(3):
            out[k, i, i] = across
            for j in range(3):
                out[k, i, j] += (slope[k] - across) * units[k, i] * units[k, j]
    return out


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

    def __init__(self, held: HubNet, mesh: Mesh) -> None:
        self.hub_mass, self._free = held.law.hub_mass, held.law.neutral_length
        self._one_sided, self._mesh = not held.law.two_sided, mesh
        self._bodies = np.array(held.bodies, dtype=np.int64)
        law = at_section(held.law, np.arange(len(held.bodies)))
        self._tape = taped([(law.tension, self._bodies.shape)], 2, 3)

    def pull(self, ends: Array, rates: Array, hub: Array, hub_rate: Array, g: Array) -> None:
        """Add what resists to the residual, whose last three unknowns are the hub's."""
        own = self._tape, self._free, self._one_sided, self._mesh, self._bodies
        pull_strings(*own, ends, rates, hub, hub_rate, g)

    def passing(
        self, ends: Array, rates: Array, hub: Array, hub_rate: Array
    ) -> tuple[float, Array, Array, Array]:
        """Energy stored (J), dissipating forces of the strings (N), their lengths (m) and rates of
        these (m/s).
        """
        lengths, along, _, _ = stretched(ends, rates, hub, hub_rate)
        _feel(self._tape, self._free, lengths, along, 0.0, 0.0)
        rows = self._tape.rows
        return float(rows[_STORED].sum()), rows[_DAMPING].copy(), lengths, along

    def tangents(
        self, ends: Array, rates: Array, hub: Array, hub_rate: Array, rate_by_place: float
    ) -> Array | None:
        """Derivatives of the forces after the bodies' places, (n, 3, 3), N/m; None while all are
        slack.
        """
        own = self._tape, self._free, self._one_sided, rate_by_place
        found: Array = string_tangents(*own, ends, rates, hub, hub_rate)
        return found if len(found) else None
