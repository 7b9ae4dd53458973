"""The cables on frames: the chain of ringsim.cable, its pulls on the unknowns and its tangent.

Spans between two frames pull on them; that their directions turn is part of the fronts.  How
tensions change couples all spans of a rope: dT = A dlog with few columns A (one for the mean
tension, one for its share along the path, and one for every pulley whose friction turns round), so
that it enters as a border of the system, not as its entries.
"""

import math

import numpy as np

from ringsim.cable.chain import Chain
from ringsim.cable.faults.family import CableFault
from ringsim.cable.records import Cables
from ringsim.cable.ropes import SHORTEST, Ropes
from ringsim.cable.state import ChainState
from ringsim.cable.winches import Winches
from ringsim.frame.chain import (
    Drums,
    RopeTable,
    Spans,
    border,
    measure,
    tighten,
    turning_pulleys,
)
from ringsim.frame.lines import (
    Arms,
    add_line_tangent,
    lines_of,
    pull_lines,
    pull_spans,
)
from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import Parts
from ringsim.frame.skeleton import Skeleton
from ringsim.layout.pose import Array
from ringsim.stepping.turning import Turning


class FrameCables:
    """The cables of a scene on the frames of a mesh.

    Attributes
    ----------
    present, winches, ropes
        As of ``ringsim.engine.cables.CableDrive``.
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
        self._drums_at, self._drums = math.nan, Drums(*np.zeros((3, 0)))
        self._turning = Turning()
        self._retable()

    def state(self, time: float, places: Array, rates: Array) -> ChainState:
        """The chain at places and rates of all points; ValueError if it has no answer."""
        path = path_rate = None
        if self.winches.answering:
            lengths, _, moving = self.ropes.measured(places, rates)
            path, path_rate = self.ropes.along(lengths), self.ropes.along(moving)
        wound, wound_rate = self.winches.at(time, self.ropes, path, path_rate)
        return self._chain.state(self.ropes, places, rates, wound, wound_rate)

    def go_on(
        self, ropes: Ropes, places: Array, rates: Array, wound: Array, speed: Array
    ) -> ChainState:
        """Go on with these ropes; the chain at places and rates of all points, from what the
        winches have wound (m) and how fast they turn (m/s), shape (cables, 2).
        """
        self.ropes = ropes
        self._retable()
        return self._chain.state(ropes, places, rates, wound, speed)

    def strike(self, fault: CableFault, state: ChainState) -> None:
        """Let a fault change the ropes."""
        self.ropes = fault.strike(self.ropes, state)
        self._retable()

    def begin(self, time: float, state: ChainState, slopes: Array) -> None:
        """Begin a step at a time (s) in a state of the chain; ``slopes`` are the derivatives of the
        cables' ideal paths after the opening angle, m/rad.
        """
        self._turning.forget()
        self.winches.advance(time, state, slopes)

    def pull(
        self, time: float, arms: Arms, places: Array, rates: Array, g: Array
    ) -> tuple[Drums, Array]:
        """Add what resists the cables' pull to the residual, shape (unknowns,); ValueError if the
        chain has no answer.  Returns what the tangent needs, with the logarithms of the decays.
        """
        ropes, spans, table = self.ropes, self._spans, self._table
        least = measure(table, ropes.behind, places, rates, spans)
        # Winches that do not answer to their ropes turn alike in all iterations of a step.
        if self.winches.answering or time != self._drums_at:
            self._drums, self._drums_at = self._turned(time), time
        drums = self._drums
        if not (drums.natural.min() > 0.0 and least > SHORTEST):
            self.state(time, places, rates)  # says what is wrong
        log_decays = self._chain.log_decays(spans.angle)
        tighten(table, drums, log_decays, spans)
        self._turning.note(ropes, spans.speed)
        pull_spans(self.lines, self._mesh, arms, spans, g)
        return drums, log_decays

    def _turned(self, time: float) -> Drums:
        """What the winches have done by a time (s), for spans that have been measured."""
        ropes, spans, path, path_rate = self.ropes, self._spans, None, None
        if self.winches.answering:
            path, path_rate = ropes.along(spans.length), ropes.along(spans.rate)
        wound, wound_rate = self.winches.at(time, ropes, path, path_rate)
        inflow = np.zeros(len(ropes.starts))
        inflow[ropes.of_end[:, 1]] = -wound_rate[:, 1]
        natural = ropes.content - ropes.per_rope(wound)
        return Drums(natural, ropes.per_rope(wound_rate), inflow)

    def factor(
        self, time: float, drums: Drums, log_decays: Array, rates: Array, by_place: float
    ) -> int:
        """Factor how tensions change in the state of the last ``pull``; returns the number of
        factors.  ``by_place`` is the derivative of the points' rates after their places, 1/s.
        """
        spans, table, left = self._spans, self._table, np.ones(len(drums.natural))
        if self.winches.answering:
            path, path_rate = self.ropes.along(spans.length), self.ropes.along(spans.rate)
            left = self.winches.stiffness_left(time, self.ropes, path, path_rate)
        slip = table.slip_speed
        own = (1.0 - spans.exponent**2) / slip
        slopes = self._turning.slopes(self.ropes, spans.speed, own, lambda s: np.tanh(s / slip))
        count = turning_pulleys(table, slopes)
        self._factors = factors = np.zeros((2, count, self.points, 3))
        log_slopes = self._chain.log_slopes(spans.angle)
        border(table, drums, log_decays, log_slopes, slopes, spans, rates, left, by_place, factors)
        return count

    def add_tangent(
        self, arms: Arms, fronts: Array, columns: Array, rows: Array, first: int
    ) -> None:
        """Add to the fronts and, for each factor from the ``first`` column on, to a column and a
        row, shape (unknowns, columns).
        """
        add_line_tangent(self.lines, arms, self._spans, fronts)
        pull_lines(self.lines, self._mesh, arms, self._factors[0], columns, first)
        pull_lines(self.lines, self._mesh, arms, self._factors[1], rows, first)

    def _retable(self) -> None:
        chain = self._chain
        self._table = RopeTable.of(self.ropes, chain.material, chain.slip_speed)
        self._spans = Spans.empty(self.ropes)
        self._drums_at = math.nan
