"""Cables on frames: where their paths run, what they pull, how they change the tangent."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ringsim.cable.chain import ChainState
from ringsim.cable.friction import (
    LEAST_TENSION,
    MOST_SOLVED,
    SOLVED,
    PulleyFriction,
    Pulleys,
)
from ringsim.cable.records import BlockSheave, Cables, Sheave
from ringsim.cable.ropes import SHORTEST, Ropes
from ringsim.cable.winches import Winches
from ringsim.compiled.chain import Chain
from ringsim.compiled.tension import (
    Drums,
    RopeTable,
    Spans,
    factors_needed,
    felt_slopes,
    measure,
    slide,
    tension_changes,
    tighten,
    with_law_slopes,
)
from ringsim.compiled.vectors import (
    compiled,
    cross,
    dot,
    matrix,
    minus,
    mul,
    plus,
    times,
    turn,
    turned_about_z,
    vector,
)
from ringsim.frame.elimination import Border
from ringsim.frame.kernels import Pose, push
from ringsim.frame.laws import Tape, play, taped
from ringsim.frame.mesh import Indices, Mesh, Parts, Skeleton
from ringsim.layout.bodies import Array
from ringsim.stepping.locks import Turning

# Points of the cables' paths on frames, compiled.
#
# A point stands at X + R (arm + C Rz(share theta) b) of a frame X, R: a pulley on a hinge assembly
# has b = 0, one on a bar half turns with its joint (share 1, or 0 on the half that is the frame),
# and a block on the bisector of two halves turns half as far, b = (0, -sense h, 0): the bisector of
# ``ringsim.exudyn.cable_path`` for relative turns of the halves below three quarters of a turn.


class Lines(NamedTuple):
    """Points of all paths, of every one: frame, arm, axes C, b, angle (-1: none) and share.

    ``span`` are the spans between different frames, ``near`` their first points (the other is the
    next), ``front`` and ``local`` where their unknowns are (X, phi, angle of both points).
    """

    frame: Indices
    arm: Array
    axes: Array
    swung: Array
    angle: Indices
    share: Array
    span: Indices
    near: Indices
    front: Indices
    local: Indices


class Arms(NamedTuple):
    """Of all points at a pose, (points, 3) each: arms that turn with the frames, what turns with
    the angles, and about which axes.
    """

    whole: Array
    swung: Array
    axis: Array

    @classmethod
    def empty(cls, points: int) -> "Arms":
        """Of so many points."""
        return cls(*(np.zeros((points, 3)) for _ in range(3)))


def lines_of(
    skeleton: Skeleton, parts: Parts, paths: Sequence[Sequence[Sheave]], ropes: Ropes
) -> Lines:
    """The points of paths of a layout."""
    found = [_point(skeleton, sheave) for path in paths for sheave in path]
    frame, arm, axes, swung, angle, share = (np.array(each) for each in zip(*found, strict=True))
    spans, fronts, local = [], [], []
    for span, near in enumerate(ropes.near.tolist()):
        ends = near, near + 1
        if frame[near] == frame[near + 1]:
            continue
        front = parts.front_holding([int(frame[k]) for k in ends], "a cable's span")
        row = parts.local(front, [(int(frame[k]), int(angle[k])) for k in ends])
        spans.append(span)
        fronts.append(front)
        local.append(row)
    return Lines(
        frame, arm, axes, swung, angle, share, np.array(spans), ropes.near[spans],
        np.array(fronts), np.array(local),
    )  # fmt: skip


def no_lines() -> Lines:
    """Of a scene without cables."""
    three, whole, one = np.zeros((0, 3)), np.zeros(0, dtype=np.int64), np.zeros(0)
    return Lines(
        whole, three, np.zeros((0, 3, 3)), three, whole, one, whole, whole, whole,
        np.zeros((0, 14), dtype=np.int64),
    )  # fmt: skip


def _point(skeleton: Skeleton, sheave: Sheave) -> tuple[int, Array, Array, Array, int, float]:
    none = np.zeros(3)
    if isinstance(sheave, BlockSheave):
        first, second = (skeleton.end_of(mount) for mount in sheave.nodes)
        swung = np.array([0.0, -sheave.sense * sheave.offset, 0.0])
        turning = second if first.angle < 0 else first
        return first.frame, first.arm, turning.axes, swung, turning.angle, 0.5
    end = skeleton.end_of(sheave.node)
    if end.angle < 0:
        return end.frame, end.arm + end.axes @ sheave.arm, np.eye(3), none, -1, 0.0
    return end.frame, end.arm, end.axes, sheave.arm, end.angle, 1.0


@compiled
def place_lines(lines: Lines, pose: Pose, arms: Arms, out: Array) -> None:
    """Arms and places of all points, shape (points, 3), m."""
    for n in range(len(lines.frame)):
        frame, angle = lines.frame[n], lines.angle[n]
        axes = matrix(pose.axes[frame])
        arm, swung, axis = turn(axes, vector(lines.arm[n])), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if angle >= 0:
            own = mul(axes, matrix(lines.axes[n]))
            turned = turned_about_z(lines.share[n] * pose.angle[angle])
            swung = turn(own, turn(turned, vector(lines.swung[n])))
            axis = times(lines.share[n], (own[2], own[5], own[8]))
        arm = plus(arm, swung)
        for k in range(3):
            arms.whole[n, k], arms.swung[n, k], arms.axis[n, k] = arm[k], swung[k], axis[k]
            out[n, k] = pose.place[frame, k] + arm[k]


@compiled
def pull_lines(lines: Lines, mesh: Mesh, arms: Arms, forces: Array, out: Array, first: int) -> None:
    """Add what forces on all points, shape (n, points, 3), do to the unknowns, (unknowns, columns),
    from the ``first`` column on.
    """
    for n in range(len(lines.frame)):
        k, angle = mesh.home[lines.frame[n]], lines.angle[n]
        arm, turned = vector(arms.whole[n]), cross(vector(arms.axis[n]), vector(arms.swung[n]))
        for c in range(len(forces)):
            force = vector(forces[c, n])
            moment = cross(arm, force)
            for i in range(3):
                out[k + i, first + c] += force[i]
                out[k + 3 + i, first + c] += moment[i]
            if angle >= 0:
                out[mesh.angle_home[angle], first + c] += dot(turned, force)


@compiled
def pull_spans(lines: Lines, mesh: Mesh, arms: Arms, spans: Spans, g: Array) -> None:
    """Add what resists the pull of spans between frames to the unknowns, shape (unknowns,)."""
    for s in range(len(lines.span)):
        span = lines.span[s]
        force = times(spans.tension[span], vector(spans.unit[span]))
        for side in range(2):
            n = lines.near[s] + side
            pull = force if side == 1 else times(-1.0, force)
            k, angle = mesh.home[lines.frame[n]], lines.angle[n]
            push(g, k, pull, cross(vector(arms.whole[n]), pull))
            if angle >= 0:
                turned = cross(vector(arms.swung[n]), pull)
                g[mesh.angle_home[angle]] += dot(vector(arms.axis[n]), turned)


@compiled
def add_line_tangent(lines: Lines, arms: Arms, spans: Spans, fronts: Array) -> None:
    """Add how the pulls of spans between frames turn with the spans and the arms to the fronts."""
    legs, pulled = np.zeros((3, 14)), np.zeros((3, 14))
    for s in range(len(lines.span)):
        span, front = lines.span[s], fronts[lines.front[s]]
        for side in range(2):
            n, own, sign = lines.near[s] + side, 7 * side, 2.0 * side - 1.0
            a, b, z = vector(arms.whole[n]), vector(arms.swung[n]), vector(arms.axis[n])
            swing = cross(z, b)
            for i in range(3):
                for j in range(6):
                    legs[i, own + j] = 0.0
                legs[i, own + i] = sign
                legs[i, own + 6] = sign * swing[i]
            legs[0, own + 4], legs[0, own + 5] = sign * a[2], -sign * a[1]
            legs[1, own + 3], legs[1, own + 5] = -sign * a[2], sign * a[0]
            legs[2, own + 3], legs[2, own + 4] = sign * a[1], -sign * a[0]
            # Arms turn under a constant force f that resists: as for the ends of elements.
            f = times(sign * spans.tension[span], vector(spans.unit[span]))
            along, b_along, z_along = dot(f, a), dot(f, b), dot(f, z)
            lifted = cross(swing, f)
            local = lines.local[s]
            for i in range(3):
                row = local[own + 3 + i]
                for j in range(3):
                    front[row, local[own + 3 + j]] += a[i] * f[j]
                front[row, row] -= along
                if local[own + 6] >= 0:
                    k = local[own + 6]
                    front[row, k] += lifted[i]
                    front[k, row] += z_along * b[i] - b_along * z[i]
            if local[own + 6] >= 0:
                front[local[own + 6], local[own + 6]] += dot(z, cross(swing, f))
        # T (1 - u u^T) / L: the tension turns with the span.
        unit, stiffness = vector(spans.unit[span]), spans.tension[span] / spans.length[span]
        for j in range(14):
            leg = (legs[0, j], legs[1, j], legs[2, j])
            aside = minus(leg, times(dot(unit, leg), unit))
            for i in range(3):
                pulled[i, j] = stiffness * aside[i]
        for i in range(14):
            row = lines.local[s, i]
            if row >= 0:
                for j in range(14):
                    if lines.local[s, j] >= 0:
                        front[row, lines.local[s, j]] += (
                            legs[0, i] * pulled[0, j]
                            + legs[1, i] * pulled[1, j]
                            + legs[2, i] * pulled[2, j]
                        )


# Laws of the pulleys' friction, as recorded operations.


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
def pull_tight(
    table: RopeTable, behind: Indices, drums: Drums, laws: Laws, places: Array, rates: Array,
    spans: Spans,
) -> float:  # fmt: skip
    """Spans, with their tensions, at places and rates of the points; returns the least length, NaN
    if no tensions go with the friction (``ringsim.compiled.tension``).
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
def spread_changes(
    table: RopeTable, spans: Spans, pulls: Array, changes: Array, out: Array
) -> None:
    """Changes of tension in factors as pulls on all points, and what they change with after places
    of all points, (2, k, points, 3), from those of spans; see ``tension_changes``.
    """
    for row in range(len(pulls)):
        for i in range(len(spans.length)):
            near = table.near[i]
            for c in range(3):
                pull = pulls[row, i] * spans.unit[i, c]
                out[0, row, near, c] -= pull
                out[0, row, near + 1, c] += pull
                out[1, row, near, c] -= changes[row, i, c]
                out[1, row, near + 1, c] += changes[row, i, c]


# What cables do to the residual and its tangent, in one call each: numba takes longer to receive
# these tables than to go through them.


@compiled
def pull_cables(
    lines: Lines, mesh: Mesh, arms: Arms, table: RopeTable, behind: Indices, drums: Drums,
    laws: Laws, places: Array, rates: Array, spans: Spans, g: Array,
) -> float:  # fmt: skip
    """Tighten the spans at places and rates of the points, and add what resists their pull to the
    residual, shape (unknowns,); returns the least length of a span, m.
    """
    least = pull_tight(table, behind, drums, laws, places, rates, spans)
    pull_spans(lines, mesh, arms, spans, g)
    return least


@compiled
def add_cables(
    lines: Lines, mesh: Mesh, arms: Arms, table: RopeTable, drums: Drums, laws: Laws, slopes: Array,
    spans: Spans, rates: Array, left: Array, rate_by_place: float, factors: Array, fronts: Array,
    columns: Array, rows: Array, first: int,
) -> None:  # fmt: skip
    """Add how spans turn to the fronts, and how tensions change to the border's columns and rows,
    from the ``first`` on.

    ``laws`` are those of the pulleys' friction, played last for the spans; ``slopes`` those of its
    exponents after the ropes' speeds (s/m), ``rates`` of the points (m/s), ``left`` the share of a
    change of path that stretches each rope, ``rate_by_place`` the derivative of rates after places
    (1/s), ``factors`` zeros, shape (2, k, points, 3).
    """
    count, n = factors.shape[1], len(spans.length)
    pulls, changes = np.zeros((count, n)), np.zeros((count, n, 3))
    tension_changes(
        table, drums, laws.decays.rows[DECAY], laws.slopes.rows[BY_ANGLE], slopes, spans, rates,
        left, 1.0, rate_by_place, pulls, changes,
    )  # fmt: skip
    spread_changes(table, spans, pulls, changes, factors)
    add_line_tangent(lines, arms, spans, fronts)
    pull_lines(lines, mesh, arms, factors[0], columns, first)
    pull_lines(lines, mesh, arms, factors[1], rows, first)


# The cables on frames: the chain of ringsim.compiled, its pulls on the unknowns and its tangent.
#
# Spans between two frames pull on them; that their directions turn is part of the fronts.  How
# tensions change couples all spans of a rope: dT = A dlog with few columns A (one for the mean
# tension, one for its share along the path, and one for the pulleys of a body whose friction turns
# round), so that it enters as a border of the system, not as its entries.


class _Turned(NamedTuple):
    """Rope wound (m) and its rate (m/s) at both ends of each cable, shape (cables, 2)."""

    wound: Array
    rate: Array


class FrameCables:
    """The cables of a scene on the frames of a mesh.

    Attributes
    ----------
    present, winches, ropes
        As of ``ringsim.exudyn.cables.CableDrive``.
    lines, points
        What the paths run over; number of their points.
    """

    def __init__(self, cables: Cables, skeleton: Skeleton, mesh: Mesh, parts: Parts) -> None:
        self.present = cables.present()
        own, paths = [cable for _, cable in self.present], skeleton.layout.paths
        self._chain = Chain(own, [len(path) for path in paths])
        self.winches, self._mesh = Winches(own), mesh
        self.points = sum(len(path) for path in paths)
        start = np.array([skeleton.layout.sheave(s)[0] for path in paths for s in path])
        self.ropes = self._chain.start(start)
        self.lines = lines_of(skeleton, parts, paths, self.ropes)
        self._turned_at, self._turned = math.nan, _Turned(*np.zeros((2, len(own), 2)))
        self._drums = Drums(*np.zeros((3, 0)))
        self._turning = Turning()
        friction = self._chain.friction
        self._laws = Laws(
            self._taped(1, "decay"), self._taped(2, "by_angle", "by_speed"), friction.moves,
            friction.loads,
        )  # fmt: skip
        self._left, self._slopes = np.ones(0), np.ones(0)
        self._retable()

    def _taped(self, results: int, *names: str) -> Tape:
        """What the laws of the pulleys' friction say of all pulleys."""
        laws = []
        for cable, own in zip(self._chain.cables, self._chain.pulleys, strict=True):
            law = partial(_told, cable.friction, cable.pulley_radius, names)
            laws.append((law, (own.stop - own.start,), cable.friction))
        return taped(laws, 3, results)

    def state(self, time: float, places: Array, rates: Array) -> ChainState:
        """The chain at places and rates of all points; ValueError if it has no answer."""
        self._turn(time, places, rates)
        return self._tightened(places, rates)

    def _tightened(self, places: Array, rates: Array) -> ChainState:
        """The chain with its winches as they have turned."""
        ropes, spans, turned = self.ropes, self._spans, self._turned
        least = pull_tight(self._table, ropes.behind, self._drums, self._laws, places, rates, spans)
        self._require(least, places, rates)
        log_decays = self._laws.decays.rows[DECAY].copy()
        return self._chain.read(ropes, self._table, self._drums, spans, log_decays, *turned)

    def go_on(
        self, ropes: Ropes, places: Array, rates: Array, wound: Array, speed: Array
    ) -> ChainState:
        """Go on with these ropes; the chain at places and rates of all points, from what the
        winches have wound (m) and how fast they turn (m/s), shape (cables, 2).
        """
        self.ropes = ropes
        self._retable()
        self._wind(wound, speed)
        return self._tightened(places, rates)

    def take(self, ropes: Ropes) -> None:
        """Go on with ropes that a fault may have changed."""
        if ropes is not self.ropes:
            self.ropes = ropes
            self._retable()

    def begin(self, time: float, state: ChainState, slopes: Array) -> None:
        """Begin a step at a time (s) in a state of the chain; ``slopes`` are the derivatives of the
        cables' ideal paths after the opening angle, m/rad.
        """
        self._turning.forget()
        self._turned_at = math.nan
        self.winches.advance(time, state, slopes)

    def pull(self, time: float, arms: Arms, places: Array, rates: Array, g: Array) -> None:
        """Add what resists the cables' pull to the residual, shape (unknowns,); ValueError if the
        chain has no answer.
        """
        self._turn(time, places, rates)
        least = pull_cables(
            self.lines, self._mesh, arms, self._table, self.ropes.behind, self._drums,
            self._laws, places, rates, self._spans, g,
        )  # fmt: skip
        self._require(least, places, rates)
        self._turning.note(self.ropes, self._spans.speed)

    def _require(self, least: float, places: Array, rates: Array) -> None:
        """ValueError if a span is shorter than can be, or more rope is wound than there is."""
        if not (least > SHORTEST and self._enough):  # NaN without an answer
            self._chain.state(self.ropes, places, rates, *self._turned)  # says what is wrong

    def _turn(self, time: float, places: Array, rates: Array) -> None:
        """What the winches have done by a time (s)."""
        ropes, spans, path, path_rate = self.ropes, self._spans, None, None
        # Winches that do not answer to their ropes turn alike in all iterations of a step.
        if time == self._turned_at and not self.winches.answering:
            return
        if self.winches.answering:
            measure(self._table, ropes.behind, places, rates, spans)
            path, path_rate = ropes.along(spans.length), ropes.along(spans.rate)
        self._wind(*self.winches.at(time, ropes, path, path_rate))
        self._turned_at = time

    def _wind(self, wound: Array, rate: Array) -> None:
        """Let the winches have wound so much (m), at rates (m/s), shape (cables, 2)."""
        self._drums = self._chain.drums(self.ropes, wound, rate)
        self._enough = bool(self._drums.natural.min() > 0.0)
        self._turned = _Turned(wound, rate)

    def factors(self, time: float) -> int:
        """Number of factors in which tensions change in the state of the last ``pull``."""
        spans, drums, slip = self._spans, self._drums, self._table.slip_speed
        self._left = np.ones(len(drums.natural))
        if self.winches.answering:
            path, path_rate = self.ropes.along(spans.length), self.ropes.along(spans.rate)
            self._left = self.winches.stiffness_left(time, self.ropes, path, path_rate)
        own = (1.0 - spans.exponent**2) / slip
        turning = self._turning
        found = turning.slopes(self.ropes, spans.speed, own, lambda s: np.tanh(s / slip))
        self._slopes = felt_slopes(found, own, slip)
        show(self.ropes.behind, spans, self._laws.slopes)
        play(self._laws.slopes)
        if self._laws.moves:
            by_speed, decays = self._laws.slopes.rows[BY_SPEED], self._laws.decays.rows[DECAY]
            self._slopes = with_law_slopes(self._slopes, spans.exponent, by_speed, decays, slip)
        return factors_needed(self._table, self._slopes)

    def add_tangent(
        self,
        arms: Arms,
        rates: Array,
        rate_by_place: float,
        count: int,
        fronts: Array,
        border: Border,
    ) -> None:
        """Add to the fronts and, for each of so many factors, to the last columns and rows of a
        border; ``rate_by_place`` is the derivative of the points' rates after places, 1/s.
        """
        add_cables(
            self.lines, self._mesh, arms, self._table, self._drums, self._laws, self._slopes,
            self._spans, rates, self._left, rate_by_place,
            np.zeros((2, count, self.points, 3)), fronts, border.columns, border.rows,
            border.first,
        )  # fmt: skip

    def _retable(self) -> None:
        self._table = self._chain.table(self.ropes, self.lines.span)
        self._spans = Spans.empty(self.ropes)
        self._turned_at = math.nan


def _told(
    law: PulleyFriction, radius: float, names: Sequence[str], angle: Any, speed: Any, tension: Any
) -> tuple[Any, ...]:
    return tuple(getattr(law, name)(Pulleys(angle, speed, tension), radius) for name in names)
