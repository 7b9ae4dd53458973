"""The tension chain of ringsim.cable.chain and its tangent, compiled.

The equations are told there and in ringsim.cable.tangent; both agree to round-off
(tests/frame/test_compiled_chain.py).
"""

import math
from typing import NamedTuple

import numpy as np

from ringsim.cable.ropes import Ropes
from ringsim.frame.parts import Indices
from ringsim.frame.tape import Tape, play
from ringsim.frame.vectors import Vector, compiled, dot, minus, plus, times, vector
from ringsim.layout.pose import Array

PASSING = 2e-4
"""Slope of a pulley's friction over that at rest below which Newton's tangent does without it: more
than 0.9999 of the friction acts, and the rope's speed no longer changes it."""


class RopeTable(NamedTuple):
    """What faults alone change: first span of each rope and one more than the last, first points of
    the spans, pulley before each span (-1: none, or jammed there), whether a rope is whole; EA (N),
    Kelvin-Voigt time (s) and slack width (N) of each rope; slip speeds of the pulleys, m/s.
    """

    starts: Indices
    ends: Indices
    near: Indices
    pulley: Indices
    alive: Array
    material: Array
    slip_speed: Array

    @classmethod
    def of(cls, ropes: Ropes, material: Array, slip_speed: Array) -> "RopeTable":
        """Of the ropes of a chain."""
        pulley = np.full(ropes.spans, -1)
        slips = ropes.slips > 0.0
        pulley[ropes.behind[slips]] = np.flatnonzero(slips)
        return cls(
            ropes.starts, ropes.ends, ropes.near, pulley, ropes.alive.astype(float),
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
def tighten(table: RopeTable, drums: Drums, log_decays: Array, spans: Spans) -> None:
    """Tensions of all spans."""
    for rope in range(len(table.starts)):
        first, last = table.starts[rope], table.ends[rope]
        path = path_rate = 0.0
        for i in range(first, last):
            path += spans.length[i]
            path_rate += spans.rate[i]
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
def pull_cables(
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
    """Paths and their rates, strains and theirs, forces before slack and mean tensions of ropes whose
    spans are known, shape (6, ropes).
    """
    out = np.zeros((6, len(table.starts)))
    for rope in range(len(table.starts)):
        path = path_rate = 0.0
        for i in range(table.starts[rope], table.ends[rope]):
            path += spans.length[i]
            path_rate += spans.rate[i]
        natural, winding = drums.natural[rope], drums.winding[rope]
        out[0, rope], out[1, rope], out[2, rope] = path, path_rate, path / natural - 1.0
        out[3, rope] = (path_rate + path / natural * winding) / natural
        out[4, rope] = _force(table, rope, path, path_rate, natural, winding)
        tension = _tension(table, rope, path, path_rate, natural, winding)
        out[5, rope] = table.alive[rope] * tension
    return out


@compiled
def _force(
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
    force, width = _force(table, rope, path, path_rate, natural, winding), table.material[rope, 2]
    smooth: float = width * math.log1p(math.exp(max(-abs(force) / width, -200.0)))
    return max(force, 0.0) + smooth


@compiled
def turning_pulleys(table: RopeTable, slopes: Array) -> int:
    """Number of pulleys of whole ropes whose friction changes with speed, and ropes with one."""
    count = 0
    for rope in range(len(table.starts)):
        if table.alive[rope] > 0.0:
            own = 0
            for i in range(table.starts[rope] + 1, table.ends[rope]):
                j = table.pulley[i]
                own += slopes[j] * table.slip_speed[j] > PASSING
            count += own + 1 + (own > 0)
    return count


@compiled
def border(
    table: RopeTable,
    drums: Drums,
    log_decays: Array,
    log_slopes: Array,
    slopes: Array,
    spans: Spans,
    velocities: Array,
    left: Array,
    by_velocity: float,
    out: Array,
) -> None:
    """Changes of tension in factors: pulls on points and what they change with, (2, k, p, 3)."""
    n = len(spans.length)
    swing = np.empty((n, 3))
    for i in range(n):
        k = table.near[i]
        moving = minus(vector(velocities[k + 1]), vector(velocities[k]))
        aside = minus(moving, times(spans.rate[i], vector(spans.unit[i])))
        for c in range(3):
            swing[i, c] = aside[c] / spans.length[i]
    row = 0
    for rope in range(len(table.starts)):
        if table.alive[rope] == 0.0:
            continue
        first, last = table.starts[rope], table.ends[rope]
        path = path_rate = 0.0
        for i in range(first, last):
            path += spans.length[i]
            path_rate += spans.rate[i]
        natural, winding = drums.natural[rope], drums.winding[rope]
        force = _force(table, rope, path, path_rate, natural, winding)
        slack = 0.5 + 0.5 * math.tanh(0.5 * force / table.material[rope, 2])
        elastic = table.material[rope, 0] / natural * slack
        viscous = elastic * table.material[rope, 1]
        stretched = left[rope] * (elastic + viscous * winding / natural) + by_velocity * viscous
        for i in range(first, last):
            unit = vector(spans.unit[i])
            change = plus(times(stretched, unit), times(left[rope] * viscous, vector(swing[i])))
            _pair(out, row, table.near[i], times(spans.share[i], unit), change)
        row += 1
        ratio, turned = natural / path, False
        steadily = winding + ratio * path_rate
        part, part_rate, tail = path, path_rate, path
        for b in range(first + 1, last):
            j = table.pulley[b]
            part -= spans.length[b - 1]
            part_rate -= spans.rate[b - 1]
            tail -= spans.share[b - 1] * spans.length[b - 1]
            p = spans.exponent[j]
            if not slopes[j] * table.slip_speed[j] > PASSING:
                continue
            turned = True
            felt = log_decays[j] * slopes[j]
            share = part / path
            for i in range(first, last):
                unit = vector(spans.unit[i])
                here = 1.0 if i >= b else 0.0
                by_rate = -ratio * felt * (here - share)
                by_length = felt * (
                    steadily / path * (here - share)
                    + ratio / path * (part_rate - share * path_rate)
                )
                change = plus(
                    times(by_length + by_velocity * by_rate, unit), times(by_rate, vector(swing[i]))
                )
                lifted = spans.tension[i] * (here - tail / path)
                _pair(out, row, table.near[i], times(lifted, unit), change)
            before, after = vector(spans.unit[b - 1]), vector(spans.unit[b])
            cosine = dot(before, after)
            aside = minus(after, times(cosine, before))
            sine = math.sqrt(dot(aside, aside))
            if sine > 1e-7:
                bent = p * log_slopes[j] / sine
                none = (0.0, 0.0, 0.0)
                _pair(out, row, table.near[b - 1], none, times(bent / spans.length[b - 1], aside))
                aside = minus(before, times(cosine, after))
                _pair(out, row, table.near[b], none, times(bent / spans.length[b], aside))
            row += 1
        if turned:
            for i in range(first, last):
                unit = vector(spans.unit[i])
                longer = times((1.0 - spans.share[i]) / path, unit)
                _pair(out, row, table.near[i], times(spans.tension[i], unit), longer)
            row += 1


@compiled
def _pair(out: Array, row: int, near: int, pull: Vector, change: Vector) -> None:
    """Add a span's pull and change to those of its points."""
    for c in range(3):
        out[0, row, near, c] -= pull[c]
        out[0, row, near + 1, c] += pull[c]
        out[1, row, near, c] -= change[c]
        out[1, row, near + 1, c] += change[c]
