"""Laws on places: what a layout lists, and engines, the margin and the energy balance all read.

An engine knows how to measure a place's coordinate and what its virtual work does; what resists
the coordinate is here.  So a spring, a net, a latch or a fault is one record that names its places.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from ringsim.parts.margin import Category
from ringsim.parts.persection import at_section
from ringsim.units import Model

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
