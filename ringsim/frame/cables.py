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
from ringsim.core.chain import Chain, Seen
from ringsim.core.library import call
from ringsim.core.tension import Drums, RopeTable, Spans
from ringsim.core.winches import Answering, Winches
from ringsim.frame.elimination import Border
from ringsim.frame.laws import Tape, taped
from ringsim.frame.mesh import Indices, Mesh, Parts, Skeleton
from ringsim.layout.bodies import Array

# Points of the cables' paths on frames (ropes.c).
#
# A point stands at X + R (arm + C Rz(share theta) b) of a frame X, R: a pulley on a hinge assembly
# has b = 0, one on a bar half turns with its joint (share 1, or 0 on the half that is the frame),
# and a block on the bisector of two halves turns half as far, b = (0, -sense h, 0): the bisector of
# ``ringsim.exudyn.cable_path`` for relative turns of the halves below three quarters of a turn.


class PathPoints(NamedTuple):
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


def path_points_of(
    skeleton: Skeleton, parts: Parts, paths: Sequence[Sequence[Sheave]], ropes: Ropes
) -> PathPoints:
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
    return PathPoints(
        frame, arm, axes, swung, angle, share, np.array(spans), ropes.near[spans],
        np.array(fronts), np.array(local),
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


class PulleyLaws(NamedTuple):
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


_DECAY = 3
"""Row of the result of ``decays``, behind what laws see."""


class Roped(NamedTuple):
    """Ropes as faults leave them, with what their winches do and how they run: what Newton has
    seen of speeds over pulleys and of forces of ropes, slopes of the pulleys' friction (s/m) and of
    tensions after forces, the share of a change of path that stretches each rope, room for changes
    of tension in factors, and the border of the fronts that they make.
    """

    ropes: RopeTable
    winches: Answering
    drums: Drums
    spans: Spans
    seen: Seen
    drawn: Seen
    slopes: Array
    tight: Array
    left: Array
    pulls: Array
    changes: Array
    factors: Array
    border: Border

    @classmethod
    def of(
        cls,
        ropes: Ropes,
        table: RopeTable,
        winches: Answering,
        points: int,
        unknowns: int,
        *,
        hub: bool,
    ) -> "Roped":
        """Not yet measured, on so many unknowns."""
        pulleys, spans, count = len(ropes.behind), ropes.spans, len(table.starts)
        most = call("factors_needed", table, np.ones(pulleys))
        return cls(
            table, winches, Drums.still(count), Spans.empty(ropes),
            Seen.empty(pulleys), Seen.empty(count), np.zeros(pulleys), np.ones(count),
            np.ones(count), np.zeros((most, spans)),
            np.zeros((most, spans, 3)), np.zeros((2, most, points, 3)),
            Border.empty(unknowns, most, points, hub),
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
    chain
        The laws of the ropes, of which the core's are the same.
    path_points, points
        What the paths run over; number of their points.
    laws, roped
        As tables.
    """

    def __init__(self, cables: Cables, skeleton: Skeleton, mesh: Mesh, parts: Parts) -> None:
        self.present = cables.present()
        own, paths = [cable for _, cable in self.present], skeleton.layout.paths
        self.chain = Chain(own, [len(path) for path in paths])
        self.winches = Winches(own)
        self._unknowns, self._hub = mesh.unknowns, skeleton.layout.hub is not None
        self.points = sum(len(path) for path in paths)
        start = np.array([skeleton.layout.sheave(s)[0] for path in paths for s in path])
        self.ropes = self.chain.start(start)
        self.path_points = path_points_of(skeleton, parts, paths, self.ropes)
        self._turned_at, self._turned = math.nan, _Turned(*np.zeros((2, len(own), 2)))
        friction = self.chain.friction
        self.laws = PulleyLaws(
            self._taped(1, "decay"), self._taped(2, "by_angle", "by_speed"), friction.moves,
            friction.loads,
        )  # fmt: skip
        self.roped = self._retabled()

    def _taped(self, results: int, *names: str) -> Tape:
        """What the laws of the pulleys' friction say of all pulleys."""
        laws = []
        for cable, own in zip(self.chain.cables, self.chain.pulleys, strict=True):
            law = partial(_told, cable.friction, cable.pulley_radius, names)
            laws.append((law, (own.stop - own.start,), cable.friction))
        return taped(laws, 3, results)

    def state(self, time: float, places: Array, rates: Array) -> ChainState:
        """The chain at places and rates of all points; ValueError if it has no answer."""
        self.turn(time)
        if self.winches.answering:
            call("measure", self.roped.ropes, places, rates, self.roped.spans)
            self.winches.answer_in(lambda function: call("answer_ropes", self.roped, function))
            self._take_answers()
        return self._tightened(places, rates)

    def _tightened(self, places: Array, rates: Array) -> ChainState:
        """The chain with its winches as they have turned."""
        roped = self.roped
        least = call(
            "pull_tight", roped.ropes, roped.drums, self.laws, places, rates, roped.spans,
        )  # fmt: skip
        if not (least > SHORTEST and roped.drums.natural.min() > 0.0):  # NaN without an answer
            self.refuse(places, rates)
        return self._read()

    def balanced(self) -> ChainState:
        """The chain as Newton's last residual of a step has left it."""
        self._take_answers()
        return self._read()

    def _take_answers(self) -> None:
        if self.winches.answering:
            self._turned = _Turned(*self.roped.winches.turned.copy())

    def _read(self) -> ChainState:
        roped, log_decays = self.roped, self.laws.decays.rows[_DECAY]
        return self.chain.read(
            self.ropes, roped.ropes, roped.drums, roped.spans, log_decays, *self._turned
        )

    def go_on(
        self, ropes: Ropes, places: Array, rates: Array, wound: Array, speed: Array
    ) -> ChainState:
        """Go on with these ropes; the chain at places and rates of all points, from what the
        winches have wound (m) and how fast they turn (m/s), shape (cables, 2).
        """
        self.ropes = ropes
        self.roped = self._retabled()
        self._wind(wound, speed)
        return self._tightened(places, rates)

    def take(self, ropes: Ropes) -> None:
        """Go on with ropes that a fault may have changed."""
        if ropes is not self.ropes:
            self.ropes = ropes
            self.roped = self._retabled()

    def begin(self, time: float, state: ChainState, slopes: Array) -> None:
        """Begin a step at a time (s) in a state of the chain; ``slopes`` are the derivatives of the
        cables' ideal paths after the opening angle, m/rad.
        """
        self.roped.seen.forget()
        self.roped.drawn.forget()
        self._turned_at = math.nan
        self.winches.advance(time, state, slopes, self.ropes, self.roped.ropes)

    def refuse(self, places: Array, rates: Array) -> None:
        """ValueError, with what is wrong, where Newton's last residual has no chain."""
        self._take_answers()
        self.chain.state(self.ropes, places, rates, *self._turned)

    def turn(self, time: float) -> None:
        """Let winches turn up to a time (s) that do not answer to their ropes: alike in all
        iterations of a step.
        """
        if time == self._turned_at:
            return
        self._turned_at = time
        if self.winches.answering:
            self.winches.hold(time)
        else:
            self._wind(*self.winches.at(time))
            self.roped.left[:] = 1.0

    def _wind(self, wound: Array, rate: Array) -> None:
        """Let the winches have wound so much (m), at rates (m/s), shape (cables, 2)."""
        self.roped.drums.wind(self.roped.ropes, wound, rate)
        self._turned = _Turned(wound, rate)

    def _retabled(self) -> Roped:
        table = self.chain.table(self.ropes, self.path_points.span)
        winches = self.winches.table(self.ropes)
        self._turned_at = math.nan
        return Roped.of(self.ropes, table, winches, self.points, self._unknowns, hub=self._hub)


def _told(
    law: PulleyFriction, radius: float, names: Sequence[str], angle: Any, speed: Any, tension: Any
) -> tuple[Any, ...]:
    return tuple(getattr(law, name)(Pulleys(angle, speed, tension), radius) for name in names)
