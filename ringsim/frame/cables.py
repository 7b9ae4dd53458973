"""The cables on frames: the chain of ringsim.cable, its pulls on the unknowns and its tangent.

Spans between two frames pull on them; that their directions turn is part of the fronts.  How
tensions change couples all spans of a rope: dT = A dlog with few columns A (one for the mean
tension, one for its share along the path, and one for the pulleys of a body whose friction turns
round), so that it enters as a border of the system, not as its entries.
"""

import math
from functools import partial
from typing import NamedTuple

import numpy as np

from ringsim.cable.chain import Chain
from ringsim.cable.faults.family import CableFault
from ringsim.cable.records import Cables
from ringsim.cable.ropes import SHORTEST, Ropes
from ringsim.cable.state import ChainState
from ringsim.cable.winches import Winches
from ringsim.frame.chain import Drums, RopeTable, Spans, measure, of_ropes, pull_tight
from ringsim.frame.chain_tangent import factors_needed, felt_slopes
from ringsim.frame.factored import Border
from ringsim.frame.lines import Arms, lines_of
from ringsim.frame.mesh import Mesh
from ringsim.frame.parts import Parts
from ringsim.frame.pulling import add_cables, pull_cables
from ringsim.frame.skeleton import Skeleton
from ringsim.frame.tape import Tape, taped
from ringsim.layout.pose import Array
from ringsim.stepping.turning import Turning


class _Turned(NamedTuple):
    """Rope wound (m) and its rate (m/s) at both ends of each cable, shape (cables, 2)."""

    wound: Array
    rate: Array


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
        self._turned_at, self._turned = math.nan, _Turned(*np.zeros((2, len(own), 2)))
        self._drums = Drums(*np.zeros((3, 0)))
        self._turning = Turning()
        self._decays, self._log_slopes = self._taped("log_decay"), self._taped("log_slope")
        self._left, self._slopes = np.ones(0), np.ones(0)
        self._retable()

    def _taped(self, name: str) -> Tape:
        """A law of the pulleys' friction, over the angles of all cables."""
        laws = []
        for cable, own in zip(self._chain.cables, self._chain.pulleys, strict=True):
            law = partial(getattr(cable.friction, name), radius=cable.pulley_radius)
            laws.append((law, (own.stop - own.start,), cable.friction))
        return taped(laws, 1, 1)

    def state(self, time: float, places: Array, rates: Array) -> ChainState:
        """The chain at places and rates of all points; ValueError if it has no answer."""
        self._turn(time, places, rates)
        return self._tightened(places, rates)

    def _tightened(self, places: Array, rates: Array) -> ChainState:
        """The chain with its winches as they have turned."""
        ropes, spans, turned = self.ropes, self._spans, self._turned
        least = pull_tight(
            self._table, ropes.behind, self._drums, self._decays, places, rates, spans
        )
        self._require(least, places, rates)
        paths, path_rates, strains, strain_rates, forces, means = of_ropes(
            self._table, self._drums, spans
        )
        angles = spans.angle.copy()
        return ChainState(
            ropes=ropes,
            material=self._chain.material[:, ropes.cable],
            lengths=spans.length.copy(),
            rates=spans.rate.copy(),
            directions=spans.unit.copy(),
            angles=angles,
            log_decays=self._decays.rows[1].copy(),
            friction_slopes=partial(self._chain.log_slopes, angles),
            speeds=spans.speed.copy(),
            exponents=spans.exponent.copy(),
            slip_speeds=self._chain.slip_speed,
            shares=spans.share.copy(),
            tensions=spans.tension.copy(),
            paths=paths,
            path_rates=path_rates,
            natural=self._drums.natural,
            wound_rates=self._drums.winding,
            strains=strains,
            strain_rates=strain_rates,
            forces=forces,
            mean_tensions=means,
            wound=turned.wound,
            wound_rate=turned.rate,
        )

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

    def strike(self, fault: CableFault, state: ChainState) -> None:
        """Let a fault change the ropes."""
        self.ropes = fault.strike(self.ropes, state)
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
            self._decays, places, rates, self._spans, g,
        )  # fmt: skip
        self._require(least, places, rates)
        self._turning.note(self.ropes, self._spans.speed)

    def _require(self, least: float, places: Array, rates: Array) -> None:
        """ValueError if a span is shorter than can be, or more rope is wound than there is."""
        if not (least > SHORTEST and self._enough):
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
        ropes = self.ropes
        inflow = np.zeros(len(ropes.starts))
        inflow[ropes.of_end[:, 1]] = -rate[:, 1]
        natural = ropes.content - ropes.per_rope(wound)
        self._drums = Drums(natural, ropes.per_rope(rate), inflow)
        self._enough, self._turned = bool(natural.min() > 0.0), _Turned(wound, rate)

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
            self.lines, self._mesh, arms, self._table, self._drums, self._decays, self._log_slopes,
            self._slopes, self._spans, rates, self._left, rate_by_place,
            np.zeros((2, count, self.points, 3)), fronts, border.columns, border.rows,
            border.first,
        )  # fmt: skip

    def _retable(self) -> None:
        chain = self._chain
        self._table = RopeTable.of(self.ropes, chain.material, chain.slip_speed, self.lines.span)
        self._spans = Spans.empty(self.ropes)
        self._turned_at = math.nan
