"""Laws on places: what a layout lists, and engines, the margin and the energy balance all read.

An engine knows how to measure a place's coordinate and what its virtual work does; what resists
the coordinate is here.  So a spring, a net, a latch or a fault is one record that names its places.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.margin import Category
from ringsim.units import Model, at_section

Array = NDArray[np.float64]
Place = tuple[int, int]
"""Plane and section of a V-joint, both from 0."""

# Springs with dampers, of which nets, stops and contacts are made; each law is written once.
#
# A law takes the functions that it needs (``minimum``, ``maximum``, ``where``, ``tanh``, ``exp``,
# ``sqrt``, ``abs``, ``sign``) from ``xp``: numpy, or an engine's namespace of the same names for
# its own expressions.  Forces resist the growth of the law's coordinate.


class Reaction(NamedTuple):
    """What resists a coordinate; numbers, arrays or an engine's expressions."""

    elastic: Any
    """Derivative of ``stored`` after the coordinate, N (N m for an angle)."""
    damping: Any
    """The rest; times the rate it is the power lost, never negative, N (N m)."""
    stored: Any
    """Elastic energy, J."""

    @property
    def total(self) -> Any:
        """Elastic and damping part together."""
        return self.elastic + self.damping

    def times(self, factor: Any) -> "Reaction":
        """So many times as much."""
        return Reaction(factor * self.elastic, factor * self.damping, factor * self.stored)


def two_sided(stretch: Any, rate: Any, stiffness: Any, damping: Any) -> Reaction:
    """A linear spring and damper, for a stretch in m (rad) and its rate."""
    elastic = stiffness * stretch
    return Reaction(elastic, damping * rate, 0.5 * elastic * stretch)


def one_sided(
    stretch: Any, rate: Any, stiffness: Any, damping: Any, onset: float, xp: Any = np
) -> Reaction:
    """A spring that acts while its stretch is positive, with a damper that never turns it round.

    k s + d s' min(s / onset, 1), but not below 0: a damper in full force from the first touch
    would let the force jump, and Newton would find no solution in the step that meets it.
    """
    taut = xp.maximum(stretch, 0.0)
    elastic = stiffness * taut
    damper = xp.maximum(damping * rate * xp.minimum(taut / onset, 1.0), -elastic)
    return Reaction(elastic, damper, 0.5 * elastic * taut)


# Laws on the angles of V-joints.


class AngleRecord(Model):
    """Anything that turns V-joints, or keeps them from turning.

    Fields of a kind may be ``PerSection``; ``reaction`` is called on what ``at`` gives.
    """

    def at(self, where: int | NDArray[np.int64]) -> Self:
        """That of a section, or of several, counted from 0."""
        return at_section(self, where)

    def reaction(self, folded: Any, rate: Any, setting: Any, xp: Any = np) -> Reaction:
        """What resists folding, N m, and the energy stored, J.

        ``folded`` is the angle by which the joint is folded (pi - opening angle, rad), with its
        rate (rad/s); ``setting`` a number of the joint's own that faults and latches change.
        """
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class AngleLaw:
    """A record on V-joints; arrays have the shape (places,).

    ``group`` is its name in results and for faults; ``on`` is 1 where it acts when a run begins,
    else 0; ``setting`` the number that its record takes.  ``category`` is that of the standard for
    margins whose factor it takes: None for what the drive does not meet on its way.  One that
    ``holds`` stops a ring of rigid rods where it acts.
    """

    group: str
    record: AngleRecord
    places: tuple[Place, ...]
    on: Array
    setting: Array
    category: Category | None = None
    holds: bool = False

    @classmethod
    def everywhere(
        cls, group: str, record: AngleRecord, shape: tuple[int, int],
        category: Category | None = None,
    ) -> Self:  # fmt: skip
        """On all V-joints of so many planes and sections."""
        places = tuple(np.ndindex(*shape))
        return cls(group, record, places, np.ones(len(places)), np.zeros(len(places)), category)

    @property
    def own(self) -> AngleRecord:
        """The record with the values of all its places."""
        return self.record.at(np.array([section for _, section in self.places]))


class Switches:
    """What acts of angle laws, and with which settings, as faults and latches leave them.

    ``on`` and ``setting`` have an array for each law, shape (places,).
    """

    def __init__(self, laws: Sequence[AngleLaw]) -> None:
        self.laws = tuple(laws)
        self.on = [law.on.copy() for law in laws]
        self.setting = [law.setting.copy() for law in laws]

    def set(self, law: int, place: Place, on: float, setting: float = 0.0) -> None:
        """Let a law act at a V-joint, or not, and with which setting."""
        k = self.laws[law].places.index(place)
        self.on[law][k], self.setting[law][k] = on, setting

    def of_group(self, group: str) -> list[int]:
        """Numbers of the laws of a group."""
        return [k for k, law in enumerate(self.laws) if law.group == group]

    def of_record(self, record: AngleRecord) -> list[int]:
        """Numbers of the laws of a record."""
        return [k for k, law in enumerate(self.laws) if law.record is record]

    @property
    def hold(self) -> bool:
        """Whether any acts that stops a ring of rigid rods."""
        pairs = zip(self.laws, self.on, strict=True)
        return any(law.holds and bool(on.any()) for law, on in pairs)

    def reaction(self, law: int, folded: Array, rates: Array) -> Reaction:
        """Of a law at angles (rad) and rates (rad/s) of shape (planes, sections), (places,) each.

        What does not act is zero.
        """
        where = tuple(np.array(self.laws[law].places).T)
        own, setting = self.laws[law].own, self.setting[law]
        return own.reaction(folded[where], rates[where], setting).times(self.on[law])

    def torques(self, group: str, folded: Array, rates: Array) -> Array | None:
        """Of the law of a group on all V-joints, (planes, sections), N m; None without."""
        for law in self.of_group(group):
            return np.asarray(self.reaction(law, folded, rates).total.reshape(folded.shape))
        return None


# Laws on distances between the origins of two bodies.


FREE_HUB = -1
"""Stands for a body: the free point of a net, where its strings balance."""


class PairRecord(Model):
    """Anything that pulls two bodies together, or pushes them apart.

    Fields of a kind may be ``PerSection``; its methods are called on what ``at`` gives.
    """

    def at(self, where: int | NDArray[np.int64]) -> Self:
        """That of a section (or corner), or of several, counted from 0."""
        return at_section(self, where)

    def reaction(self, stretch: Any, rate: Any, natural: Any, xp: Any = np) -> Reaction:
        """What resists a distance longer than ``natural`` (m) by ``stretch`` (m), at its rate
        (m/s), N; and the energy stored, J.
        """
        raise NotImplementedError

    def linear(self) -> tuple[float, float] | None:
        """Stiffness (N/m) and damping (N s/m) of what is a linear spring and damper; else None."""
        return None


@dataclass(frozen=True, eq=False)
class PairLaw:
    """A record between bodies; arrays have the shape (pairs,).

    ``bodies`` are their numbers, or ``FREE_HUB`` first, shape (pairs, 2); ``sections`` pick the
    values of the record; ``lengths`` gives the natural lengths, m, when they are asked for.
    ``places`` are the plane and section that results tell the tension of each pair at; empty: they
    do not.
    ``category`` is that of the standard for margins; None for what the drive does not meet.
    """

    group: str
    record: PairRecord
    bodies: NDArray[np.int64]
    sections: NDArray[np.int64]
    lengths: Callable[[], Array]
    category: Category | None = None
    places: tuple[Place, ...] = ()

    @cached_property
    def natural(self) -> Array:
        """Natural lengths, m."""
        return self.lengths()

    @cached_property
    def own(self) -> PairRecord:
        """The record with the values of all its pairs."""
        return self.record.at(self.sections)

    @property
    def hung(self) -> bool:
        """Whether its pairs are strings from the hub."""
        return bool((self.bodies == FREE_HUB).any())

    def reaction(self, lengths: Array, rates: Array) -> Reaction:
        """At lengths (m) and rates (m/s) of all pairs."""
        return self.own.reaction(lengths - self.natural, rates, self.natural)

    def moved(self, places: Array, velocities: Array) -> tuple[Array, Array]:
        """Lengths (m) and rates (m/s) at places and velocities of all bodies, the hub's last,
        shape (bodies, 3).
        """
        arms, moving = (x[self.bodies[:, 1]] - x[self.bodies[:, 0]] for x in (places, velocities))
        lengths = np.linalg.norm(arms, axis=1)
        return lengths, np.sum(arms * moving, axis=1) / lengths

    def tensions(self, places: Array, velocities: Array, shape: tuple[int, int]) -> Array:
        """N, in a table of planes and sections, NaN where there is no pair; see ``moved``."""
        found = np.full(shape, np.nan)
        total = self.reaction(*self.moved(places, velocities)).total
        found[tuple(np.array(self.places).T)] = total
        return found


class Corners(NamedTuple):
    """What a net may be fastened to: bodies of the corners by plane, and the number of sections.

    ``distances`` gives those of pairs of bodies, (n, 2), in the deployed structure, (n,), m.
    """

    rows: tuple[tuple[int, ...], ...]
    sections: int
    distances: Callable[[NDArray[np.int64]], Array]

    def row(self, plane: int) -> NDArray[np.int64]:
        """Bodies of a plane; ValueError where the structure has no corners there."""
        if plane >= len(self.rows):
            raise ValueError(
                f"net: this structure has no corners to hold one in {plane + 1} of its planes: "
                'leave it out (net = "none")'
            )
        return np.array(self.rows[plane], dtype=np.int64)


# Friction, which depends on the rate alone.


class Rub(NamedTuple):
    """A friction law on joints by their numbers; ``sections`` pick its values, (joints,)."""

    family: str
    law: Any
    joints: tuple[int, ...]
    sections: NDArray[np.int64]

    def of(self, where: Sequence[int] | slice) -> Any:
        """The law of some of the joints, with their values."""
        return at_section(self.law, self.sections[where])
