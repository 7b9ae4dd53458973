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
from ringsim.core.chain import Chain
from ringsim.core.library import call
from ringsim.core.tension import (
    Drums,
    RopeTable,
    Spans,
    factors_needed,
    felt_slopes,
    measure,
    with_law_slopes,
)
from ringsim.frame.elimination import Border, Fronts
from ringsim.frame.laws import Tape, play, taped
from ringsim.frame.mesh import Indices, Mesh, Parts, Skeleton
from ringsim.layout.bodies import Array
from ringsim.stepping.locks import Turning

# Points of the cables' paths on frames (ropes.c).
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


# Laws of the pulleys' friction, as recorded operations.


class Laws(NamedTuple):
    """What friction laws say of pulleys: ln(eta), and its derivatives after angle and speed; and
    whether any depends on the speed of the rope, or on its tension; then how often tensions are
    sought at most, the least that laws see (N), and change of ln(eta) at which they are found.
    """

    decays: Tape
    slopes: Tape
    moves: bool
    loads: bool
    most: int = MOST_SOLVED
    least_tension: float = LEAST_TENSION
    solved: float = SOLVED


_DECAY, _BY_SPEED = 3, 4
"""Rows of the results of ``decays`` and of ``slopes``, behind what laws see."""


def pull_tight(
    table: RopeTable, behind: Indices, drums: Drums, laws: Laws, places: Array, rates: Array,
    spans: Spans,
) -> float:  # fmt: skip
    """Spans, with their tensions, at places and rates of the points; returns the least length, NaN
    if no tensions go with the friction (``ringsim.core.tension``).
    """
    return float(call("pull_tight", table, behind, drums, laws, places, rates, spans))


def spread_changes(
    table: RopeTable, spans: Spans, pulls: Array, changes: Array, out: Array
) -> None:
    """Changes of tension in factors as pulls on all points, and what they change with after places
    of all points, (2, k, points, 3), from those of spans; see ``tension_changes``.
    """
    call("spread_changes", table, spans, pulls, changes, out)


def pull_cables(
    lines: Lines, mesh: Mesh, arms: Arms, table: RopeTable, behind: Indices, drums: Drums,
    laws: Laws, places: Array, rates: Array, spans: Spans, g: Array,
) -> float:  # fmt: skip
    """Tighten the spans at places and rates of the points, and add what resists their pull to the
    residual, shape (unknowns,); returns the least length of a span, m.
    """
    return float(
        call("pull_cables", lines, mesh, arms, table, behind, drums, laws, places, rates, spans, g)
    )


def add_cables(
    lines: Lines, mesh: Mesh, arms: Arms, table: RopeTable, drums: Drums, laws: Laws, slopes: Array,
    spans: Spans, rates: Array, left: Array, rate_by_place: float, count: int, fronts: Fronts,
    border: Border,
) -> None:  # fmt: skip
    """Add how spans turn to the fronts, and how tensions change to the border's columns and rows
    behind those of a hub.

    ``laws`` are those of the pulleys' friction, played last for the spans; ``slopes`` those of its
    exponents after the ropes' speeds (s/m), ``rates`` of the points (m/s), ``left`` the share of a
    change of path that stretches each rope, ``rate_by_place`` the derivative of rates after places
    (1/s), ``count`` the number of factors.
    """
    n = len(spans.length)
    pulls, changes = np.zeros((count, n)), np.zeros((count, n, 3))
    factors = np.zeros((2, count, len(lines.frame), 3))
    call(
        "add_cables", lines, mesh, arms, table, drums, laws, slopes, spans, rates, left,
        rate_by_place, pulls, changes, factors, fronts, border.columns, border.rows, border.first,
    )  # fmt: skip


# The cables on frames: the chain of ringsim.core, its pulls on the unknowns and its tangent.
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
        log_decays = self._laws.decays.rows[_DECAY].copy()
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
        call("show", self.ropes.behind, spans, self._laws, self._laws.slopes)
        play(self._laws.slopes)
        if self._laws.moves:
            by_speed, decays = self._laws.slopes.rows[_BY_SPEED], self._laws.decays.rows[_DECAY]
            self._slopes = with_law_slopes(self._slopes, spans.exponent, by_speed, decays, slip)
        return factors_needed(self._table, self._slopes)

    def add_tangent(
        self,
        arms: Arms,
        rates: Array,
        rate_by_place: float,
        count: int,
        fronts: Fronts,
        border: Border,
    ) -> None:
        """Add to the fronts and, for each of so many factors, to the last columns and rows of a
        border; ``rate_by_place`` is the derivative of the points' rates after places, 1/s.
        """
        add_cables(
            self.lines, self._mesh, arms, self._table, self._drums, self._laws, self._slopes,
            self._spans, rates, self._left, rate_by_place,
            count, fronts, border,
        )  # fmt: skip

    def _retable(self) -> None:
        self._table = self._chain.table(self.ropes, self.lines.span)
        self._spans = Spans.empty(self.ropes)
        self._turned_at = math.nan


def _told(
    law: PulleyFriction, radius: float, names: Sequence[str], angle: Any, speed: Any, tension: Any
) -> tuple[Any, ...]:
    return tuple(getattr(law, name)(Pulleys(angle, speed, tension), radius) for name in names)
