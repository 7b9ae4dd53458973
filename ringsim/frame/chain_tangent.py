"""How tensions of the compiled chain change: the equations are told in ringsim.cable.tangent."""

import math

import numpy as np

from ringsim.frame.chain import Drums, RopeTable, Spans, force_of, path_of
from ringsim.frame.vectors import Vector, compiled, dot, minus, plus, put, times, vector
from ringsim.layout.pose import Array

PASSING = 2e-4
"""Slope of a pulley's friction over that at rest below which Newton's tangent does without it: more
than 0.9999 of the friction acts, and the rope's speed no longer changes it."""


def felt_slopes(slopes: Array, own: Array, slip_speed: Array) -> Array:
    """Slopes of the pulleys' friction, s/m, less those that tangents do without: of pulleys that
    slip, and that Newton has seen on one side alone (``ringsim.stepping.turning``): then slopes are
    their ``own``.  In a step of 0.1 us a light hinge assembly may turn to and fro at 300 m/s, and
    only a slope of a hundred-thousandth of that at rest leads it to its place.
    """
    return np.where((slopes * slip_speed > PASSING) | (slopes > own), slopes, 0.0)


@compiled
def _turns(table: RopeTable, slopes: Array, span: int) -> bool:
    """Whether the friction of the pulley before a span changes with speed."""
    return bool(table.pulley[span] >= 0 and slopes[table.pulley[span]] > 0.0)


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
