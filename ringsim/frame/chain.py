"""The tension chain of ringsim.cable.chain, compiled.

The equations are told there; both agree to round-off (tests/frame/test_compiled_chain.py).
"""

import math
from typing import NamedTuple

import numpy as np

from ringsim.cable.ropes import Ropes
from ringsim.frame.parts import Indices
from ringsim.frame.tape import Tape, play
from ringsim.frame.vectors import compiled, dot, minus, plus, times, vector
from ringsim.layout.pose import Array


class RopeTable(NamedTuple):
    """What faults alone change: first span of each rope and one more than the last, first points of
    the spans, pulley before each span (-1: none, or jammed there), whether spans are felt, as they
    are between different frames, and whether a rope is whole; EA (N),
    Kelvin-Voigt time (s) and slack width (N) of each rope; slip speeds of the pulleys, m/s.
    """

    starts: Indices
    ends: Indices
    near: Indices
    pulley: Indices
    felt: Indices
    alive: Array
    material: Array
    slip_speed: Array

    @classmethod
    def of(cls, ropes: Ropes, material: Array, slip_speed: Array, felt: Indices) -> "RopeTable":
        """Of the ropes of a chain, whose spans of these numbers are felt."""
        pulley = np.full(ropes.spans, -1)
        slips = ropes.slips > 0.0
        pulley[ropes.behind[slips]] = np.flatnonzero(slips)
        own = np.zeros(ropes.spans, dtype=np.int64)
        own[felt] = 1
        return cls(
            ropes.starts, ropes.ends, ropes.near, pulley, own, ropes.alive.astype(float),
            material[:, ropes.cable].T.copy(), slip_speed,
        )  # fmt: skip


class Drums(NamedTuple):
    """Natural length (m) of each rope, what its winches take up and what comes in at its far end
    (m/s), shape (ropes,).
    """

    natural: Array
    winding: Array
    inflow: Array


class Spans(NamedTuple):
    """Lengths, their rates and directions of spans; angles at pulleys; tensions of spans, their
    share of the rope's mean; exponents of the pulleys' friction and speeds of the ropes over them.
    """

    length: Array
    rate: Array
    unit: Array
    angle: Array
    tension: Array
    share: Array
    exponent: Array
    speed: Array

    @classmethod
    def empty(cls, ropes: Ropes) -> "Spans":
        """Of so many spans and pulleys."""
        n, pulleys = ropes.spans, len(ropes.behind)
        one = np.zeros(n)
        return cls(one, one.copy(), np.zeros((n, 3)), np.zeros(pulleys), one.copy(), one.copy(),
                   np.zeros(pulleys), np.zeros(pulleys))  # fmt: skip


@compiled
def measure(table: RopeTable, behind: Indices, places: Array, rates: Array, spans: Spans) -> float:
    """Lengths, rates, directions and angles of places and rates of the points, (points, 3);
    returns the least length, m.
    """
    least = math.inf
    for i in range(len(spans.length)):
        k = table.near[i]
        d = minus(vector(places[k + 1]), vector(places[k]))
        length = math.sqrt(dot(d, d))
        unit = times(1.0 / length, d)
        spans.length[i], least = length, min(least, length)
        spans.unit[i, 0], spans.unit[i, 1], spans.unit[i, 2] = unit
        spans.rate[i] = dot(unit, minus(vector(rates[k + 1]), vector(rates[k])))
    for j in range(len(behind)):
        before, after = vector(spans.unit[behind[j] - 1]), vector(spans.unit[behind[j]])
        both, apart = plus(before, after), minus(after, before)
        spans.angle[j] = 2.0 * math.atan2(math.sqrt(dot(both, both)), math.sqrt(dot(apart, apart)))
    return least


@compiled
def path_of(spans: Spans, first: int, last: int) -> tuple[float, float]:
    """Length (m) and its rate (m/s) of the path along spans ``first`` to ``last`` - 1."""
    path = path_rate = 0.0
    for i in range(first, last):
        path += spans.length[i]
        path_rate += spans.rate[i]
    return path, path_rate


@compiled
def tighten(table: RopeTable, drums: Drums, log_decays: Array, spans: Spans) -> None:
    """Tensions of all spans."""
    for rope in range(len(table.starts)):
        first, last = table.starts[rope], table.ends[rope]
        path, path_rate = path_of(spans, first, last)
        natural, winding = drums.natural[rope], drums.winding[rope]
        beyond = path
        rate_beyond = path_rate
        log = most = 0.0
        for i in range(first, last):
            j = table.pulley[i]
            if i > first:
                part = beyond / path
                moved = (rate_beyond - part * path_rate) * natural / path
                speed = drums.inflow[rope] + winding * part - moved
                p = math.tanh(speed / table.slip_speed[j])
                spans.speed[j], spans.exponent[j] = speed, p
                log += p * log_decays[j]
                most = max(most, log)
            spans.share[i] = log
            beyond -= spans.length[i]
            rate_beyond -= spans.rate[i]
        mean = 0.0
        for i in range(first, last):
            spans.share[i] = math.exp(spans.share[i] - most)
            mean += spans.share[i] * spans.length[i] / path
        tension = table.alive[rope] * _tension(table, rope, path, path_rate, natural, winding)
        for i in range(first, last):
            spans.share[i] /= mean
            spans.tension[i] = tension * spans.share[i]


@compiled
def pull_tight(
    table: RopeTable, behind: Indices, drums: Drums, decays: Tape, places: Array, rates: Array,
    spans: Spans,
) -> float:  # fmt: skip
    """Spans, with their tensions, at places and rates of the points; returns the least length."""
    least = measure(table, behind, places, rates, spans)
    for j in range(len(behind)):
        decays.rows[0, j] = spans.angle[j]
    play(decays)
    tighten(table, drums, decays.rows[1], spans)
    return least


@compiled
def of_ropes(table: RopeTable, drums: Drums, spans: Spans) -> Array:
    """Of ropes whose spans are known, shape (6, ropes): paths and their rates, strains and theirs,
    forces before slack and mean tensions.
    """
    out = np.zeros((6, len(table.starts)))
    for rope in range(len(table.starts)):
        path, path_rate = path_of(spans, table.starts[rope], table.ends[rope])
        natural, winding = drums.natural[rope], drums.winding[rope]
        out[0, rope], out[1, rope], out[2, rope] = path, path_rate, path / natural - 1.0
        out[3, rope] = (path_rate + path / natural * winding) / natural
        out[4, rope] = force_of(table, rope, path, path_rate, natural, winding)
        tension = _tension(table, rope, path, path_rate, natural, winding)
        out[5, rope] = table.alive[rope] * tension
    return out


@compiled
def force_of(
    table: RopeTable, rope: int, path: float, path_rate: float, natural: float, winding: float
) -> float:
    """Elastic and viscous force of a rope before slack."""
    strain_rate = (path_rate + path / natural * winding) / natural
    stretch: float = path / natural - 1.0 + table.material[rope, 1] * strain_rate
    return stretch * float(table.material[rope, 0])


@compiled
def _tension(
    table: RopeTable, rope: int, path: float, path_rate: float, natural: float, winding: float
) -> float:
    force, width = force_of(table, rope, path, path_rate, natural, winding), table.material[rope, 2]
    smooth: float = width * math.log1p(math.exp(max(-abs(force) / width, -200.0)))
    return max(force, 0.0) + smooth
