"""The tension chain of ringsim.cable.chain and its tangent, compiled."""

import math
from typing import NamedTuple

import numpy as np

from ringsim.cable.friction import LEAST_TENSION, MOST_SOLVED, SOLVED
from ringsim.cable.ropes import Ropes
from ringsim.frame.laws import Tape, play
from ringsim.frame.mesh import Indices
from ringsim.frame.vectors import Vector, compiled, dot, minus, plus, put, times, vector
from ringsim.layout.bodies import Array

# The tension chain of ringsim.cable.chain, compiled.
#
# The equations are told there; both agree to round-off (tests/frame/test_compiled_chain.py).


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


class Laws(NamedTuple):
    """What friction laws say of pulleys: ln(eta), and its derivatives after angle and speed; and
    whether any depends on the speed of the rope, or on its tension.
    """

    decays: Tape
    slopes: Tape
    moves: bool
    loads: bool


DECAY, BY_ANGLE, BY_SPEED = 3, 3, 4
"""Rows of the results of ``decays`` and of ``slopes``, behind what laws see."""


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
def slide(table: RopeTable, drums: Drums, spans: Spans) -> None:
    """Speeds of the ropes over the pulleys, and exponents of their friction."""
    for rope in range(len(table.starts)):
        first, last = table.starts[rope], table.ends[rope]
        path, path_rate = path_of(spans, first, last)
        natural, winding = drums.natural[rope], drums.winding[rope]
        beyond, rate_beyond = path, path_rate
        for i in range(first, last):
            j = table.pulley[i]
            if i > first:
                part = beyond / path
                moved = (rate_beyond - part * path_rate) * natural / path
                speed = drums.inflow[rope] + winding * part - moved
                spans.speed[j], spans.exponent[j] = speed, math.tanh(speed / table.slip_speed[j])
            beyond -= spans.length[i]
            rate_beyond -= spans.rate[i]


@compiled
def tighten(table: RopeTable, drums: Drums, log_decays: Array, spans: Spans) -> None:
    """Tensions of all spans, whose speeds are known."""
    for rope in range(len(table.starts)):
        first, last = table.starts[rope], table.ends[rope]
        path, path_rate = path_of(spans, first, last)
        natural, winding = drums.natural[rope], drums.winding[rope]
        log = most = 0.0
        for i in range(first, last):
            if i > first:
                j = table.pulley[i]
                log += spans.exponent[j] * log_decays[j]
                most = max(most, log)
            spans.share[i] = log
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
    table: RopeTable, behind: Indices, drums: Drums, laws: Laws, places: Array, rates: Array,
    spans: Spans,
) -> float:  # fmt: skip
    """Spans, with their tensions, at places and rates of the points; returns the least length, NaN
    if no tensions go with the friction (``ringsim.cable.chain``).
    """
    least, rows = measure(table, behind, places, rates, spans), laws.decays.rows
    slide(table, drums, spans)
    show(behind, spans, laws.decays)
    if not laws.loads:
        play(laws.decays)
        tighten(table, drums, rows[DECAY], spans)
        return least
    rows[DECAY] = 0.0
    tighten(table, drums, rows[DECAY], spans)
    before = np.zeros(len(behind))
    for _ in range(MOST_SOLVED):
        show(behind, spans, laws.decays)
        play(laws.decays)
        tighten(table, drums, rows[DECAY], spans)
        change = 0.0
        for j in range(len(behind)):
            change = max(change, abs(rows[DECAY, j] - before[j]))
            before[j] = rows[DECAY, j]
        if change < SOLVED:
            return least
    return math.nan


@compiled
def show(behind: Indices, spans: Spans, tape: Tape) -> None:
    """Let laws see the pulleys (``ringsim.cable.friction.Pulleys``)."""
    for j in range(len(behind)):
        both = 0.5 * (spans.tension[behind[j] - 1] + spans.tension[behind[j]])
        tape.rows[0, j], tape.rows[1, j] = spans.angle[j], abs(spans.speed[j])
        tape.rows[2, j] = max(both, LEAST_TENSION)


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


# How tensions of the compiled chain change: the equations are told in ringsim.cable.chain.


PASSING = 2e-4
"""Slope of a pulley's friction over that at rest below which Newton's tangent does without it: more
than 0.9999 of the friction acts, and the rope's speed no longer changes it."""


def felt_slopes(slopes: Array, own: Array, slip_speed: Array) -> Array:
    """Slopes of the pulleys' friction, s/m, less those that tangents do without: of pulleys that
    slip, and that Newton has seen on one side alone (``ringsim.stepping.locks``): then slopes are
    their ``own``.  In a step of 0.1 us a light hinge assembly may turn to and fro at 300 m/s, and
    only a slope of a hundred-thousandth of that at rest leads it to its place.
    """
    return np.where((slopes * slip_speed > PASSING) | (slopes > own), slopes, 0.0)


@compiled
def _turns(table: RopeTable, slopes: Array, span: int) -> bool:
    """Whether the friction of the pulley before a span changes with speed."""
    return bool(table.pulley[span] >= 0 and slopes[table.pulley[span]] != 0.0)


@compiled
def factors_needed(table: RopeTable, slopes: Array) -> int:
    """Number of factors that ``border`` finds."""
    count = 0
    for rope in range(len(table.starts)):
        if table.alive[rope] > 0.0:
            own, begun = 0, False
            for b in range(table.starts[rope] + 1, table.ends[rope]):
                begun = begun and table.felt[b - 1] == 0
                if _turns(table, slopes, b):
                    own += not begun
                    begun = True
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
    rate_by_place: float,
    out: Array,
) -> None:
    """Changes of tension in factors: pulls on points and what they change with, (2, k, p, 3).

    A pulley's friction pulls with all spans behind it, less their share of the path.  Pulleys
    between which no span is felt pull with the same ones, and have one factor; their shares of the
    path go to the last factor of the rope.
    """
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
        path, path_rate = path_of(spans, first, last)
        natural, winding = drums.natural[rope], drums.winding[rope]
        force = force_of(table, rope, path, path_rate, natural, winding)
        slack = 0.5 + 0.5 * math.tanh(0.5 * force / table.material[rope, 2])
        elastic = table.material[rope, 0] / natural * slack
        viscous = elastic * table.material[rope, 1]
        stretched = left[rope] * (elastic + viscous * winding / natural) + rate_by_place * viscous
        for i in range(first, last):
            unit = vector(spans.unit[i])
            change = plus(times(stretched, unit), times(left[rope] * viscous, vector(swing[i])))
            _pair(out, row, table.near[i], times(spans.share[i], unit), change)
        row += 1
        ratio, turned, begun = natural / path, False, False
        steadily = winding + ratio * path_rate
        part, part_rate, tail = path, path_rate, path
        longer = np.zeros((last - first, 3))
        for b in range(first + 1, last):
            j = table.pulley[b]
            part -= spans.length[b - 1]
            part_rate -= spans.rate[b - 1]
            tail -= spans.share[b - 1] * spans.length[b - 1]
            if begun and table.felt[b - 1] > 0:
                row, begun = row + 1, False
            if not _turns(table, slopes, b):
                continue
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
                    times(by_length + rate_by_place * by_rate, unit),
                    times(by_rate, vector(swing[i])),
                )
                pull = (0.0, 0.0, 0.0) if begun or i < b else times(spans.tension[i], unit)
                _pair(out, row, table.near[i], pull, change)
                put(longer[i - first], times(-tail / path, change))
            turned = begun = True
            before, after = vector(spans.unit[b - 1]), vector(spans.unit[b])
            cosine = dot(before, after)
            aside = minus(after, times(cosine, before))
            sine = math.sqrt(dot(aside, aside))
            if sine > 1e-7:
                bent, none = spans.exponent[j] * log_slopes[j] / sine, (0.0, 0.0, 0.0)
                ahead = times(bent / spans.length[b - 1], aside)
                back = times(bent / spans.length[b], minus(before, times(cosine, after)))
                _pair(out, row, table.near[b - 1], none, ahead)
                _pair(out, row, table.near[b], none, back)
                put(longer[b - 1 - first], times(-tail / path, ahead))
                put(longer[b - first], times(-tail / path, back))
        if turned:
            row += begun
            for i in range(first, last):
                unit = vector(spans.unit[i])
                whole = plus(times((1.0 - spans.share[i]) / path, unit), vector(longer[i - first]))
                _pair(out, row, table.near[i], times(spans.tension[i], unit), whole)
            row += 1


@compiled
def _pair(out: Array, row: int, near: int, pull: Vector, change: Vector) -> None:
    """Add a span's pull and change to those of its points."""
    for c in range(3):
        out[0, row, near, c] -= pull[c]
        out[0, row, near + 1, c] += pull[c]
        out[1, row, near, c] -= change[c]
        out[1, row, near + 1, c] += change[c]
