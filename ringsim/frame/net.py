"""The net's strings from corners to a hub, a point with three unknowns of its own."""

import math
from typing import NamedTuple

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


class Web(NamedTuple):
    """Strings from a hub: their law, the bodies at their ends, length without force (m), whether
    they only pull, and the mass of the hub (kg).
    """

    tape: Tape
    bodies: Indices
    free: float
    one_sided: bool
    hub_mass: float

    @classmethod
    def of(cls, held: HubNet | None) -> "Web":
        """Those of a net; none without."""
        if held is None:
            return cls(taped([], 2, 3), np.zeros(0, dtype=np.int64), 0.0, True, 0.0)
        law, bodies = held.law, np.array(held.bodies, dtype=np.int64)
        tension = at_section(law, np.arange(len(bodies))).tension
        tape = taped([(tension, bodies.shape, law)], 2, 3)
        return cls(tape, bodies, law.neutral_length, not law.two_sided, law.hub_mass)


@compiled
def stretched(
    ends: Array, rates: Array, hub: Array, hub_rate: Array
) -> tuple[Array, Array, Array, float]:
    """Lengths (m), their rates (m/s) and directions of strings from the hub, at places and rates of
    shape (n, 3) and (3,); the greatest length.
    """
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
def _feel(web: Web, lengths: Array, along: Array, more: float, faster: float) -> None:
    """Play the law at lengths and rates, all so much larger."""
    rows = web.tape.rows
    for k in range(len(lengths)):
        rows[_STRETCH, k], rows[_RATE, k] = lengths[k] - web.free + more, along[k] + faster
    play(web.tape)


@compiled
def _force(web: Web, k: int) -> float:
    return float(web.tape.rows[_ELASTIC, k] + web.tape.rows[_DAMPING, k])


@compiled
def pull_strings(
    web: Web, mesh: Mesh, ends: Array, rates: Array, hub: Array, hub_rate: Array, g: Array
) -> bool:
    """Add what resists at the bodies and, in the last three unknowns, at the hub; False while all
    strings are slack.
    """
    lengths, along, units, most = stretched(ends, rates, hub, hub_rate)
    if web.one_sided and most <= web.free:
        return False
    _feel(web, lengths, along, 0.0, 0.0)
    at = len(g) - 3
    for n in range(len(web.bodies)):
        home, pull = mesh.home[web.bodies[n]], _force(web, n)
        for i in range(3):
            g[home + i] += pull * units[n, i]
            g[at + i] -= pull * units[n, i]
    return True


@compiled
def add_strings(
    web: Web, mesh: Mesh, ends: Array, rates: Array, hub: Array, hub_rate: Array, by_rate: float,
    fronts: Array, columns: Array, rows: Array, corner: Array,
) -> None:  # fmt: skip
    """Add derivatives of the strings' pulls to the fronts, and those after the hub's place to the
    first three columns, rows and corner of the border; ``by_rate`` is the derivative of rates after
    places, 1/s.
    """
    lengths, along, units, _ = stretched(ends, rates, hub, hub_rate)
    slope, block = np.zeros(len(lengths)), np.zeros((3, 3))
    for side in (1.0, -1.0):
        for what in range(2):
            _feel(web, lengths, along, (1 - what) * side * _NUDGE, what * side * _NUDGE)
            share = side / (2.0 * _NUDGE) * (1.0 if what == 0 else by_rate)
            for n in range(len(slope)):
                slope[n] += share * _force(web, n)
    _feel(web, lengths, along, 0.0, 0.0)
    for n in range(len(slope)):
        body = web.bodies[n]
        number, first = mesh.frame_local[body, 0], mesh.frame_local[body, 1]
        across = _force(web, n) / lengths[n]
        for i in range(3):
            for j in range(3):
                block[i, j] = (slope[n] - across) * units[n, i] * units[n, j]
            block[i, i] += across
        for i in range(3):
            for j in range(3):
                fronts[number, first + i, first + j] += block[i, j]
                columns[mesh.home[body] + i, j] -= block[i, j]
                rows[mesh.home[body] + i, j] -= block[i, j]
                corner[i, j] += block[i, j]


def passing_strings(
    web: Web, ends: Array, rates: Array, hub: Array, hub_rate: Array
) -> tuple[float, Array, Array, Array]:
    """Energy stored (J), dissipating forces of the strings (N), their lengths (m) and rates of
    these (m/s).
    """
    lengths, along, _, _ = stretched(ends, rates, hub, hub_rate)
    _feel(web, lengths, along, 0.0, 0.0)
    rows = web.tape.rows
    return float(rows[_STORED].sum()), rows[_DAMPING].copy(), lengths, along
