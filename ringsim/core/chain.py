"""The tension chain as both engines evaluate it, its state and its tangent; slopes of dry friction
for Newton, where ropes or joints turn round within a step.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ringsim.cable.chain import ChainState, pulley_tensions
from ringsim.cable.friction import MOST_SOLVED, SOLVED, UNSOLVED, Friction, Pulleys
from ringsim.cable.records import Cable
from ringsim.cable.ropes import Array, Indices, Ropes
from ringsim.core.library import call
from ringsim.core.tension import (
    PASSING,
    Drums,
    RopeTable,
    Spans,
    with_law_slopes,
)
from ringsim.refusal import InputError

_MOST_STRETCHED = 0.5
"""Share of its path by which a rope may be shorter at the start: a strain of 1, the largest that
``limits.rope_strain`` allows."""
_LEAST_SLOPE = 1e-300
"""A slope that counts and changes nothing, s/m."""


class Chain:
    """The cables of a scene, ready to be evaluated at any motion of their pulleys.

    ``points_per_cable`` counts the points of each path: winch, pulleys, far end.

    Raises
    ------
    ValueError
        If a cable has friction coefficients for another number of pulleys.

    Examples
    --------
    A rope of 2 m turns by 90 deg over one pulley; 1 mm of it is wound, at 5 mm/s.  The pulley's
    bearing takes 5.5 % of the tension at the winch.

    >>> from ringsim.cable.friction import BearingFriction
    >>> from ringsim.cable.records import Winch
    >>> from ringsim.cable.winding import ConstantWinding
    >>> winch = Winch(winding=ConstantWinding(speed=0.005))
    >>> chain = Chain([Cable(winch=winch, friction=BearingFriction(coefficient=4e-4))], [3])
    >>> points = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    >>> wound, speed = np.array([[0.001, 0.0]]), np.array([[0.005, 0.0]])
    >>> state = chain.state(chain.start(points), points, np.zeros((3, 3)), wound, speed)
    >>> state.tensions.round(2)
    array([51.44, 48.61])
    """

    def __init__(self, cables: Sequence[Cable], points_per_cable: Sequence[int]) -> None:
        self.cables, self._points_per_cable = tuple(cables), tuple(points_per_cable)
        ends = np.cumsum([points - 2 for points in points_per_cable])
        self.pulleys = [slice(*ends_of) for ends_of in pairwise([0, *ends])]
        """Pulleys of each cable."""
        slip = []
        for number, (cable, points) in enumerate(zip(cables, points_per_cable, strict=True), 1):
            given, pulleys = cable.friction.coefficients.shape, points - 2
            if given not in ((), (pulleys,)):
                raise ValueError(
                    f"cable {number}: friction.coefficient has {given[0]} values, but there "
                    f"are {pulleys} pulleys: give one value for all, or one for each"
                )
            slip += [cable.slip_speed_over(pulleys)] * pulleys
        self.slip_speed = np.array(slip)
        """Of all pulleys, m/s, shape (pulleys,)."""
        self.material = np.array(
            [[c.axial_stiffness, c.damping_time, c.slack_width] for c in cables]
        ).T
        """EA (N), Kelvin-Voigt time (s) and slack width (N) of each cable, shape (3, cables)."""
        self.friction = Friction(
            [(c.friction, c.pulley_radius, n) for c, n in zip(cables, self.pulleys, strict=True)]
        )
        self._known: tuple[Ropes, RopeTable, Spans] | None = None

    def start(self, points: Array) -> Ropes:
        """One rope per cable, as long as its path at the start plus its initial slack.

        The points are those of all cables behind one another, in metre, shape (points, 3).
        InputError if a rope would begin with more than twice its length.
        """
        spans = np.asarray(self._points_per_cable) - 1
        content = np.array([cable.initial_slack for cable in self.cables])
        alive = np.ones(len(spans), dtype=bool)
        ropes = Ropes(self._points_per_cable, np.cumsum(spans) - spans, content, alive)
        lengths = np.linalg.norm(points[ropes.near + 1] - points[ropes.near], axis=1)
        paths = ropes.along(lengths)
        for number, (path, slack) in enumerate(zip(paths.tolist(), content.tolist(), strict=True)):
            if slack <= -path * _MOST_STRETCHED:
                raise InputError(
                    f"cable {number + 1}: initial_slack = {slack:g} m must be above "
                    f"{-path * _MOST_STRETCHED:.4g} m, half of its path of {path:.4g} m: it would "
                    "begin with more than twice its length (raise it)"
                )
        return replace(ropes, content=paths + content)

    def state(
        self, ropes: Ropes, points: Array, velocities: Array, wound: Array, wound_rate: Array
    ) -> ChainState:
        """Evaluate the chain with ropes from ``start``, and after faults.

        Points and velocities are those of all cables behind one another, m and m/s, shape
        (points, 3); rope wound and its rate those of the winches at both ends of each cable, m and
        m/s, shape (cables, 2), zero at a fixed end.

        Raises
        ------
        ValueError
            If a span has no length, or a winch has wound up its whole rope, or no tensions go with
            the friction.
        """
        table, spans = self._measured(ropes, points, velocities)
        drums = Drums.still(len(ropes.starts))
        drums.wind(table, _whole(wound), _whole(wound_rate))
        if not drums.natural.min() > 0.0:
            short = int(np.argmin(drums.natural))
            raise ValueError(
                f"cable {ropes.cable[short] + 1}: {-drums.natural[short]:.4g} m more is wound "
                "than there is rope (limit the winding law, or give the winch a stop_time)"
            )
        call("slide", table, drums, spans)
        log_decays = np.zeros(len(ropes.behind))
        call("tighten", table, drums, log_decays, spans)
        for _ in range(MOST_SOLVED):
            tensions = pulley_tensions(ropes, spans.tension)
            previous = log_decays
            seen = Pulleys(spans.angle, np.abs(spans.speed), tensions)
            log_decays = _whole(self.friction.decays(seen))
            call("tighten", table, drums, log_decays, spans)
            if not self.friction.loads or np.abs(log_decays - previous).max(initial=0.0) < SOLVED:
                return self.read(ropes, table, drums, spans, log_decays, wound, wound_rate)
        raise ValueError(UNSOLVED)

    def paths(self, ropes: Ropes, points: Array, velocities: Array) -> tuple[Array, Array]:
        """Lengths (m) of the ropes' paths and their rates (m/s), shape (ropes,) each."""
        _, spans = self._measured(ropes, points, velocities)
        return ropes.along(spans.length), ropes.along(spans.rate)

    def table(self, ropes: Ropes, felt: Indices | None = None) -> RopeTable:
        """Ropes in numbers; ``felt`` are the spans that are, by default all."""
        every = np.arange(ropes.spans)
        return RopeTable.of(ropes, self.material, self.slip_speed, every if felt is None else felt)

    def read(
        self, ropes: Ropes, table: RopeTable, drums: Drums, spans: Spans, log_decays: Array,
        wound: Array, wound_rate: Array,
    ) -> ChainState:  # fmt: skip
        """What the spans tell, whose tensions are known."""
        ends = _whole(wound), _whole(wound_rate)
        numbers = np.empty(ropes.places["wound_rate"].stop)
        call("read_chain", table, drums, spans, log_decays, *ends, numbers)
        return ChainState(ropes, table, self.friction, numbers)

    def changes(
        self, state: ChainState, velocities: Array, slopes: Array, left: Array, by_place: float,
        by_rate: float, passing: float = PASSING,
    ) -> list[tuple[int, Array, Array]]:  # fmt: skip
        """Changes of tension in each rope that is whole, in factors (ropes.c).

        The velocities are those that the state was evaluated with, in m/s, shape (points, 3);
        ``slopes`` are those of the exponents after the speeds, in s/m, shape (pulleys,).  A rope
        none of whose pulleys has slopes above ``passing`` times that at rest has one factor, any
        other the ones of all its pulleys.

        Returns
        -------
        Rope, tensions in N, shape (k, spans of the rope), and what they change with, shape (k,
        spans, 3).
        """
        ropes, slip, friction = state.ropes, state.slip_speeds, state.friction
        slips, own = ropes.slips > 0.0, ropes.of_pulley
        if friction.moves:
            by_speed = friction.by_speed(state.pulleys)
            slopes = with_law_slopes(
                slopes, state.exponents, by_speed, state.log_decays, slip, passing
            )
        turning = np.zeros(len(ropes.starts), dtype=bool)
        turning[own[slips & (np.abs(slopes) * slip >= passing)]] = True
        slopes = np.where(turning[own], np.where(slopes == 0.0, _LEAST_SLOPE, slopes), 0.0)
        table = state.table
        spans = Spans(
            state.lengths, state.rates, state.directions, state.angles, state.tensions,
            state.shares, state.exponents, state.speeds,
        )  # fmt: skip
        drums = Drums(state.natural, state.wound_rates, np.zeros(len(ropes.starts)))
        tight = 0.5 + 0.5 * np.tanh(0.5 * state.forces / table.material[:, 2])
        count, n = call("factors_needed", table, _whole(slopes)), ropes.spans
        pulls, found = np.zeros((count, n)), np.zeros((count, n, 3))
        call(
            "tension_changes", table, drums, state.log_decays,
            _whole(friction.by_angle(state.pulleys)), _whole(slopes), spans, _whole(velocities),
            _whole(tight), _whole(left), by_place, by_rate, pulls, found,
        )  # fmt: skip
        told, row = [], 0
        for rope in np.flatnonzero(ropes.alive).tolist():
            turned = int(np.sum(slips & turning[own] & (own == rope)))
            rows, row = slice(row, row + 1 + turned + (turned > 0)), row + 1 + turned + (turned > 0)
            where = slice(int(ropes.starts[rope]), int(ropes.ends[rope]))
            told.append((rope, pulls[rows, where], found[rows, where]))
        return told

    def _measured(self, ropes: Ropes, points: Array, velocities: Array) -> tuple[RopeTable, Spans]:
        """The ropes' table, and spans with their lengths, rates and angles, until the next call."""
        if self._known is None or self._known[0] is not ropes:
            self._known = ropes, self.table(ropes), Spans.empty(ropes)
        _, table, spans = self._known
        call("measure", table, _whole(points), _whole(velocities), spans)
        ropes.require_length(spans.length)
        return table, spans


def _whole(numbers: Array) -> Array:
    """As the core takes them: laws may give whole numbers, and callers parts of arrays."""
    return np.ascontiguousarray(numbers, dtype=float)


def work_between(before: ChainState, after: ChainState) -> tuple[float, float]:
    """Energies in J: put in by the winches, less what is wound up; lost by friction, damping.

    The work of a force is its mean at both instants times the displacement: rope wound on a drum,
    rope slipped over a pulley, strain of a rope.  Products of force and rate at the instants alone
    would miss the displacement between them.  Nothing moves while a fault changes the ropes.
    Source: the energy balance of Belytschko, Liu and Moran, Nonlinear Finite Elements for
    Continua and Structures (2000), sec. 6.2.3.
    """
    works = np.zeros(2)
    if before.ropes is after.ropes:
        rows = before.numbers, after.numbers
        call("work_of_ropes", after.table, *rows, works)
    return float(works[0]), float(works[1])


# What Newton's iterates of one step tell of dry friction (turning.c).
#
# A law like p = tanh(s / s_slip) is flat on both sides of the passage at s = 0.  Tangents jump
# across it to and fro for ever; a step that a rope stops in needs thousands of times s_slip.  Once
# Newton has seen a pulley, or a joint, on both sides, the slope is at least that of the secant to
# the last iterate on the other side, as in the method of false position.  Kept there it would
# converge from one side only, and slowly: it halves with every further iterate on the same side, as
# in the Illinois method (Dowell and Jarratt, BIT 11 (1971) 168).


class Seen(NamedTuple):
    """Rates of pulleys or joints: the last ones ahead and back, shape (2, n); whether the newest is
    back; iterates on its side in a row, less one; and whether there is any, shape (1,).
    """

    last: Array
    back: Indices
    stayed: Indices
    begun: Indices

    @classmethod
    def empty(cls, n: int) -> "Seen":
        """Of so many."""
        whole = np.zeros((2, n), dtype=np.int64)
        return cls(np.zeros((2, n)), whole[0], whole[1], np.zeros(1, dtype=np.int64))

    def forget(self) -> None:
        """Begin a step."""
        self.begun[0] = 0


_NUDGE = 1e-7
"""Change of rate (rad/s) by which tangents of laws are measured."""
_ENDS = np.array([[1.0], [-1.0]])


class Turning:
    """Newton's iterates of one step, and slopes of laws that Python evaluates."""

    def __init__(self) -> None:
        self._owner: object = None
        self._seen = Seen.empty(0)

    def forget(self) -> None:
        """Begin a step."""
        self._owner = None

    def note(self, owner: object, rates: Array) -> None:
        """Remember an iterate: rates, shape (n,), of pulleys or joints, whose meaning changes with
        their ``owner``, as speeds (m/s) of the ropes that a fault may split.
        """
        if self._owner is not owner:
            self._owner, self._seen = owner, Seen.empty(len(rates))
        call("note_rates", self._seen, np.ascontiguousarray(rates))

    def slopes(
        self, owner: object, rates: Array, own: Array, law: Callable[[Array], Array]
    ) -> Array:
        """Slopes of a law at the iterate noted last, shape (n,), in its unit over that of the
        rates: ``own``, its derivatives there, or what the other side asks for.
        """
        if self._owner is not owner:
            return own
        other, out = np.empty((2, len(rates)))
        call("rates_across", self._seen, other)
        given = (np.ascontiguousarray(each) for each in (rates, own, law(rates), law(other)))
        call("slopes_between", self._seen, *given, out)
        return out

    def tangents(self, owner: object, rates: Array, law: Callable[[Array], Array]) -> Array:
        """``slopes`` of a law whose derivatives are those of central differences."""
        ahead, behind = law(rates + _NUDGE * _ENDS)
        return self.slopes(owner, rates, (ahead - behind) / (2.0 * _NUDGE), law)
