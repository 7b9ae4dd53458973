"""Which spans form one rope, and where ropes are slack."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

# Which spans form one rope: a cable is one rope until a fault splits it.
#
# The points of all cables stand behind one another, each cable's in order from its winch.  A
# cable of p points has p - 1 spans and p - 2 pulleys (its inner points); two of its ropes meet at a
# jammed pulley.


Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]
SHORTEST = 1e-9
"""Length in metre below which a span has no direction: rounding of coordinates, 1e-16 m, turns
it by 1e-7 rad there."""


@dataclass(frozen=True)
class Ropes:
    """The ropes of all cables."""

    points_per_cable: tuple[int, ...]
    """Points of every cable, at least 2 each."""
    starts: Indices
    """First span of each rope, increasing, shape (ropes,)."""
    content: Array
    """Natural length of each rope in metre, with what its winches have wound since the start
    (and without what they will still wind), shape (ropes,)."""
    alive: Flags
    """Whether the rope can carry tension, shape (ropes,)."""

    @cached_property
    def cable_starts(self) -> Indices:
        """First span of each cable, with the number of all spans behind, shape (cables + 1,)."""
        return np.cumsum([0, *(points - 1 for points in self.points_per_cable)], dtype=np.intp)

    @cached_property
    def spans(self) -> int:
        """Number of spans of all cables."""
        return int(self.cable_starts[-1])

    @cached_property
    def near(self) -> Indices:
        """Point at each span's end nearer to the winch, shape (spans,); the other: one more."""
        points = np.cumsum(self.points_per_cable)
        return np.delete(np.arange(points[-1]), points - 1)

    @cached_property
    def ends(self) -> Indices:
        """One more than the last span of each rope, shape (ropes,)."""
        return np.append(self.starts[1:], self.spans)

    @cached_property
    def of_span(self) -> Indices:
        """Rope of each span, shape (spans,)."""
        return np.repeat(np.arange(len(self.starts)), self.ends - self.starts)

    @cached_property
    def behind(self) -> Indices:
        """Span behind each pulley, seen from the winch, shape (pulleys,); before it: one less."""
        return np.setdiff1d(np.arange(self.spans), self.cable_starts[:-1])

    @cached_property
    def of_pulley(self) -> Indices:
        """Rope behind each pulley, shape (pulleys,)."""
        return self.of_span[self.behind]

    @cached_property
    def slips(self) -> Array:
        """1 where the rope slips over the pulley, 0 where it is jammed, shape (pulleys,)."""
        return np.asarray(~np.isin(self.behind, self.starts), dtype=float)

    @cached_property
    def of_end(self) -> Indices:
        """Rope at both ends of each cable, the first winch's first, shape (cables, 2)."""
        return self.of_span[np.stack([self.cable_starts[:-1], self.cable_starts[1:] - 1], axis=-1)]

    @cached_property
    def cable(self) -> Indices:
        """Cable of each rope, shape (ropes,)."""
        return np.searchsorted(self.cable_starts, self.starts, side="right") - 1

    def inner(self, rope: int) -> Flags:
        """Which pulleys the rope slips over, shape (pulleys,)."""
        return np.asarray((self.of_pulley == rope) & (self.slips > 0.0))

    def require_length(self, lengths: Array) -> None:
        """Raise a ValueError if a span, of these lengths (m), has none."""
        if lengths.min() > SHORTEST:
            return
        if not np.all(np.isfinite(lengths)):
            raise ValueError("the points of the cables are not finite")
        span = int(np.argmin(lengths))
        cable = self.cable[self.of_span[span]]
        number = span - self.cable_starts[cable] + 1
        raise ValueError(f"cable {cable + 1}: span {number} has no length, its two points coincide")

    def along(self, spans: Array) -> Array:
        """Sums over the spans of each rope; (spans,) -> (ropes,)."""
        return np.add.reduceat(spans, self.starts)

    def per_rope(self, ends: Array) -> Array:
        """Sum over a rope's ends of a quantity of the winches; (cables, 2) -> (ropes,)."""
        total = np.bincount(self.of_end.ravel(), ends.ravel(), len(self.starts))
        return np.asarray(total, dtype=float)

    def jam(self, cable: int, pulley: int, stored: Array, wound: Array) -> "Ropes":
        """The ropes after a pulley seizes the rope; cable and pulley count from 0 at the winch.

        At that instant ``stored`` is the natural length in each span, m, shape (spans,), and
        ``wound`` the rope wound at the two ends of each cable, m, shape (cables, 2).  ValueError if
        there is no such pulley.
        """
        start = self._span(cable, pulley, 2, "pulley") + 1
        if start in self.starts:
            return self
        k = int(self.of_span[start])
        content = np.insert(self.content, k, 0.0)  # of both parts: filled in below
        alive = np.insert(self.alive, k, self.alive[k])
        split = Ropes(self.points_per_cable, np.insert(self.starts, k + 1, start), content, alive)
        held = split.along(stored) + split.per_rope(wound)
        content[k : k + 2] = held[k : k + 2]
        return split

    def unjam(self, cable: int, pulley: int) -> "Ropes":
        """The ropes after a pulley that had seized the rope lets it slip again: the opposite of
        ``jam``.
        """
        start = self._span(cable, pulley, 2, "pulley") + 1
        if start not in self.starts:
            return self
        k = int(np.searchsorted(self.starts, start))
        content, alive = self.content.copy(), self.alive.copy()
        content[k - 1] += content[k]
        alive[k - 1] &= alive[k]
        starts = np.delete(self.starts, k)
        return Ropes(self.points_per_cable, starts, np.delete(content, k), np.delete(alive, k))

    def cut(self, cable: int, span: int) -> "Ropes":
        """The ropes after a span parts; both count from 0.  ValueError if there is no such span."""
        alive = self.alive.copy()
        alive[self.of_span[self._span(cable, span, 1, "span")]] = False
        return replace(self, alive=alive)

    def _span(self, cable: int, place: int, fewer: int, what: str) -> int:
        """The span at a place of a cable, among all cables'."""
        cables = len(self.points_per_cable)
        if not 0 <= cable < cables:
            raise ValueError(f"there is no cable {cable + 1} (there are 1 to {cables})")
        count = self.points_per_cable[cable] - fewer
        if not 0 <= place < count:
            raise ValueError(
                f"cable {cable + 1} has no {what} {place + 1} (there are 1 to {count})"
            )
        return int(self.cable_starts[cable]) + place


# Tension without compression: a smooth passage from slack to taut, and its energy.
#
# With width b (N) the elastic force y (N, negative when the rope is longer than its path) gives
#
#     tension   q(y) = b ln(1 + exp(y / b)),           q(0) = 0.693 b,
#     slope     q'(y) = 1 / (1 + exp(-y / b)),
#     energy    integral of q dy from -inf = b^2 (-Li2(-exp(y / b))).
#
# Above y = 10 b the tension exceeds y by less than 5e-5 b, below y = -10 b it is less than that.


_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)
_NODES, _WEIGHTS = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS

_SLACKEST = -200.0
"""y / b below which the tension stays as it is: exp(-200) = 1e-87 is nothing beside any force, and
its square and its inverse are still doubles."""

_TAUT = 40.0
"""y / b above which exp(-y / b) is lost in the round-off of y^2."""


def tension(force: Array, width: Array) -> Array:
    """q(y) in N.

    >>> tension(np.array([-1.0, 0.0, 1.0]), np.array(0.05)).round(4)
    array([0.    , 0.0347, 1.    ])
    """
    return np.asarray(width * np.logaddexp(0.0, np.maximum(force / width, _SLACKEST)))


def energy(force: Array, width: Array) -> Array:
    """Integral of q from -inf to y, in N^2; divided by EA it is an energy per length.

    The dilogarithm comes from -Li2(-s) = integral of ln(1 + s v) / v dv over (0, 1) for
    s <= 1, by 24 Gauss-Legendre nodes (error below 1e-14), and beyond that from its inversion
    -Li2(-exp z) = z^2 / 2 + pi^2 / 6 + Li2(-exp(-z)).
    """
    z = np.asarray(force / width, dtype=float)
    if z.min() > _TAUT:
        return np.asarray(width**2 * (0.5 * z**2 + np.pi**2 / 6.0))
    small = np.exp(-np.abs(z))
    kernel = np.log1p(small[..., None] * _NODES) / _NODES
    tail = np.asarray(kernel @ _WEIGHTS)
    whole = np.where(z > 0.0, 0.5 * z**2 + np.pi**2 / 6.0 - tail, tail)
    return np.asarray(width**2 * whole)
