"""Which spans form one rope, and the faults that cut or jam it."""

import itertools
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from ringsim.parts.faults import Fault, Struck

if TYPE_CHECKING:
    from ringsim.scene import Scene

# Which spans form one rope: a cable is one rope until a fault splits it.
#
# The points of all cables stand behind one another, each cable's in order from its winch.  A
# cable of p points has p - 1 spans and p - 2 pulleys (its inner points); two of its ropes meet at a
# jammed pulley.


Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]
CHAIN_PARTS = {
    "lengths": ("span", 1), "rates": ("span", 1), "tensions": ("span", 1), "shares": ("span", 1),
    "directions": ("span", 3), "angles": ("pulley", 1), "speeds": ("pulley", 1),
    "exponents": ("pulley", 1), "log_decays": ("pulley", 1), "friction_forces": ("pulley", 1),
    "held_beyond": ("pulley", 1), "natural": ("rope", 1), "wound_rates": ("rope", 1),
    "paths": ("rope", 1), "path_rates": ("rope", 1), "strains": ("rope", 1),
    "strain_rates": ("rope", 1), "forces": ("rope", 1), "mean_tensions": ("rope", 1),
    "viscous_forces": ("rope", 1), "energy_density": ("rope", 1), "wound": ("cable", 2),
    "wound_rate": ("cable", 2),
}  # fmt: skip
"""What a chain tells (``ringsim.cable.chain.ChainState``), in the order in which the core puts it
into a row: so many numbers for each span, pulley, rope or cable."""
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
    def edges(self) -> list[int]:
        """``cable_starts`` as a list."""
        return [int(start) for start in self.cable_starts]

    @cached_property
    def pulley_edges(self) -> list[int]:
        """First pulley of each cable, with the number of all pulleys behind."""
        return list(
            itertools.accumulate((points - 2 for points in self.points_per_cable), initial=0)
        )

    @cached_property
    def spans(self) -> int:
        """Number of spans of all cables."""
        return int(self.cable_starts[-1])

    @cached_property
    def places(self) -> dict[str, slice]:
        """Where each of ``CHAIN_PARTS`` stands in the row of all."""
        cables, ropes = len(self.points_per_cable), len(self.starts)
        counts = {"span": self.spans, "pulley": len(self.behind), "rope": ropes, "cable": cables}
        sizes = [counts[of] * each for of, each in CHAIN_PARTS.values()]
        cuts = itertools.pairwise(itertools.accumulate(sizes, initial=0))
        return {name: slice(*own) for name, own in zip(CHAIN_PARTS, cuts, strict=True)}

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


# Faults of cables: what is cut or jammed, where and when.


class CableFault(Fault):
    """Something that breaks at a given time and place."""

    cable: Annotated[int, Field(ge=1)] = 1
    """Which cable of the scene, "upper" or "lower", or its number from 1: the upper one first."""

    def strike(self, now: Struck) -> None:
        """See ``Fault``."""
        now.ropes = self.change(now.ropes, now.stored, now.wound)

    def clear(self, now: Struck) -> None:
        """See ``Fault``."""
        now.ropes = self.whole(now.ropes)

    def check(self, scene: "Scene") -> None:
        """See ``Fault``."""
        if scene.cables is None:
            raise ValueError(
                "is a fault of a cable, but the scene has none: add [cables.upper], or leave the "
                "fault out"
            )

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """The ropes after the fault, with the natural length in each span, m, shape (spans,), and
        the rope wound at both ends of each cable, m, shape (cables, 2), at that instant.

        ValueError if the cable or the place on it does not exist.
        """
        raise NotImplementedError

    def whole(self, ropes: Ropes) -> Ropes:
        """The ropes after the fault is cleared; ValueError if it cannot be."""
        raise NotImplementedError

    @property
    def held(self) -> tuple[int, int] | None:
        """Cable and pulley at which it holds the rope, None if it holds none: as long as another
        fault holds it there, clearing this one frees nothing.
        """
        return None


# A cable that breaks.


class CutCable(CableFault):
    """The rope parts in one span and loses its tension on both sides, up to the next jam.

    Both new ends are free, and a rope without mass carries nothing to a free end.
    """

    kind: Literal["cut-cable"] = "cut-cable"
    span: Annotated[int, Field(ge=1)]
    """Name, as "section 6 V to second hinge", or number, counted from 1 at the winch."""

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """Let go of the rope that holds the span."""
        return ropes.cut(self.cable - 1, self.span - 1)

    def whole(self, ropes: Ropes) -> Ropes:
        """Never."""
        raise ValueError(
            f"faults: the rope of cable {self.cable} that parted at {self.time:g} s cannot be "
            "undone: keep that fault, or start from an earlier state (--at)"
        )


# A pulley that seizes the rope.


class JammedPulley(CableFault):
    """The rope no longer slips over the pulley: two ropes of fixed content meet there."""

    kind: Literal["jammed-pulley"] = "jammed-pulley"
    pulley: Annotated[int, Field(ge=1)]
    """Name, as "section 6 V", or number, counted from 1 at the winch."""

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """Split the rope at the pulley; each part keeps the rope that its spans hold."""
        return ropes.jam(self.cable - 1, self.pulley - 1, stored, wound)

    def whole(self, ropes: Ropes) -> Ropes:
        """Let the rope slip again: both parts become one."""
        return ropes.unjam(self.cable - 1, self.pulley - 1)

    @property
    def held(self) -> tuple[int, int] | None:
        """See ``CableFault``."""
        return self.cable, self.pulley


# A rope that leaves its pulley.


class OffSheave(CableFault):
    """The rope has left the groove of a pulley, as a slack one may (``limits.slack_duration``).

    Either it is wedged between pulley and bracket, which holds it as a jammed pulley does, or it
    hangs free: what the pulley held of its path is then more than winches take up soon, so that
    the whole rope carries nothing any more, up to the next jam.
    """

    kind: Literal["off-sheave"] = "off-sheave"
    pulley: Annotated[int, Field(ge=1)]
    """Name, as "section 6 V", or number, counted from 1 at the winch."""
    rope: Literal["wedged", "free"] = "wedged"
    """Where the rope is."""

    def change(self, ropes: Ropes, stored: Array, wound: Array) -> Ropes:
        """Hold the rope at the pulley, or let it go."""
        if self.rope == "wedged":
            return ropes.jam(self.cable - 1, self.pulley - 1, stored, wound)
        for span in (self.pulley - 1, self.pulley):  # before and behind it, two ropes after a jam
            ropes = ropes.cut(self.cable - 1, span)
        return ropes

    def whole(self, ropes: Ropes) -> Ropes:
        """Let a wedged rope slip again; nobody puts a free one back."""
        if self.rope == "wedged":
            return ropes.unjam(self.cable - 1, self.pulley - 1)
        raise ValueError(
            f"faults: the rope of cable {self.cable} that left its pulley at {self.time:g} s "
            "cannot be undone: keep that fault, or start from an earlier state (--at)"
        )

    @property
    def held(self) -> tuple[int, int] | None:
        """See ``CableFault``."""
        return (self.cable, self.pulley) if self.rope == "wedged" else None
