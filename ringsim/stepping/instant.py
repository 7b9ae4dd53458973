"""What an engine tells of a run, of the states that it reaches, and how memory goes back."""

import json
import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ringsim.variables import Cause, Reason

# What an engine tells of a run before it, and of the states that it reaches.


Array = NDArray[np.float64]


class Energies(NamedTuple):
    """Energies in J: kinetic, elastic and work of the loads at one instant; since the instant
    before, what was lost in friction, dampers and stops, and what the winches put in less the
    strain energy that they wind up.
    """

    kinetic: float
    elastic: float
    work: float
    lost: float
    driven: float = 0.0


def exchanged(kinds: Array) -> float:
    """Energy in J that a run has exchanged: the largest of the ranges of kinetic energy, of elastic
    energy, and of works, those of loads and of winches added.

    ``kinds`` has the shape (n, 4): these at n instants, or their lowest and highest values so far.
    It never falls: unlike the present work it is not emptied where loads change their sign, or
    where a winch takes what loads give.
    """
    return of_ranges(*np.ptp(kinds, axis=0))


def of_ranges(kinetic: float, elastic: float, loads: float, winches: float) -> float:
    """``exchanged``, of the ranges of these energies (J)."""
    return float(max(kinetic, elastic, loads + winches))


class Strained(NamedTuple):
    """Elastic energy (J) of rods and boom before a run: as the engine finds it, and as putting the
    structure together has left it.
    """

    found: float
    left: float


AS_DRAWN = Strained(0.0, 0.0)


@dataclass(frozen=True)
class Instant:
    """A state that a run has reached."""

    time: float
    """Since the start of the run, s."""
    angles: Array
    """Opening angles, shape (planes, sections), rad."""
    rates: Array
    """Their rates, rad/s."""
    energies: Energies
    gap: float = 0.0
    """Largest distance of points that a joint holds together, m."""
    tensions: Array | None = None
    """Of all spans, N; None without cables."""
    stretch: float = 0.0
    """Largest strain of a rope."""
    driven: bool = False
    """Whether a winch turns or will turn on its rope, or a fault is still to come."""


Watch = Callable[[Instant], None]
"""What is shown every accepted state of a run."""


class Scales(NamedTuple):
    """Reference numbers of a structure, from which steps and guards start.

    Attributes
    ----------
    rate, energy
        Reference opening rate (rad/s) of the run, and the kinetic energy at it (J).
    travel, length
        Opening angle to be covered (rad), and what gaps of joints are measured against (m).
    contact_step, first_step
        Steps that resolve a bounce on a stop at the tolerance 1e-4, and ropes that swing as a winch
        starts, s; infinite without stops or cables.
    slack_tension, slack_energy
        Tension (N) that does not matter, and a tenth of it pulled along every path (J); None
        without cables.
    period
        Of the slowest rod, s.
    """

    rate: float
    energy: float
    travel: float
    length: float
    contact_step: float = math.inf
    first_step: float = math.inf
    slack_tension: float | None = None
    slack_energy: float | None = None
    period: float = math.inf


# What friction, dampers and stops take in a step.


class Passing(NamedTuple):
    """Time (s), forces that take energy, and the rates and places that they resist, shape (n,).

    Pairs of forces and places are N and m, or N m and rad; places of which only the rates are known
    are None.
    """

    time: float
    forces: Array
    rates: Array
    places: Array | None = None


def lost_between(before: Passing, after: Passing) -> float:
    """Work in J of forces in a step h in which they and the rates of their places go linearly:

        mean force times displacement + h (F2 - F1) (v2 - v1) / 12.

    Without the second part, never negative where friction grows with the rate, every change of
    speed would seem to cost energy.  A displacement that is not known is the mean rate times the
    step, which differs from generalised-alpha's by a hundredth of the rates' change at most.  Where
    steps do not resolve a vibration, rates change sign from end to end and too much counts as lost:
    the balance shows it as energy that was added.
    """
    step, rises = after.time - before.time, after.forces - before.forces
    if before.places is None or after.places is None:
        moved = 0.5 * step * (before.rates + after.rates)
    else:
        moved = after.places - before.places
    mean = 0.5 * float(np.vdot(before.forces + after.forces, moved))
    return mean + step / 12.0 * float(np.vdot(rises, after.rates - before.rates))


# What a run remembers, as numbers in a file and back: nothing of it is ever executed.
#
# ``pack`` makes of nested lists and tables one row of numbers, for all arrays, and a JSON text that
# says where each lies; Python writes floats so that they read back bit by bit.


Memory = dict[str, Any]
"""Names and values: None, numbers, texts, arrays, instants, reasons, lists and tables of these."""


def pack(memory: Any) -> tuple[str, Array]:
    """The form of a memory, JSON, and the numbers of all its arrays in a row.

    >>> form, numbers = pack({"step": 0.1, "places": np.eye(2)})
    >>> unpack(form, numbers)["places"].tolist()
    [[1.0, 0.0], [0.0, 1.0]]
    """
    rows: list[Array] = []
    form = json.dumps(_packed(memory, rows, [0]), separators=(",", ":"))
    return form, np.concatenate([np.zeros(0), *rows])


def unpack(form: str, numbers: Array) -> Any:
    """What ``pack`` was given; tuples are lists, codes numbers.

    Raises
    ------
    ValueError
        If text and numbers do not belong together.
    """
    return _unpacked(json.loads(form), numbers)


def _packed(value: Any, rows: list[Array], used: list[int]) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        begin = used[0]
        used[0] += value.size
        rows.append(value.ravel().astype(float))
        return {"array": [begin, list(value.shape), value.dtype.kind]}
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, Reason):
        return {"reason": [value.cause.value, str(value)]}
    if isinstance(value, Instant):
        return {"instant": [_packed(one, rows, used) for one in vars(value).values()]}
    if isinstance(value, Mapping):
        own = [[key, _packed(one, rows, used)] for key, one in value.items()]
        return {"items": own}
    if isinstance(value, (list, tuple, deque)):
        return [_packed(one, rows, used) for one in value]
    return value


def _unpacked(value: Any, numbers: Array) -> Any:
    if isinstance(value, list):
        return [_unpacked(one, numbers) for one in value]
    if not isinstance(value, dict):
        return value
    if "items" in value:
        return {key: _unpacked(one, numbers) for key, one in value["items"]}
    if "reason" in value:
        cause, text = value["reason"]
        return Reason(Cause(cause), text)
    if "instant" in value:
        time, angles, rates, energies, *more = _unpacked(value["instant"], numbers)
        return Instant(time, angles, rates, Energies(*energies), *more)
    begin, shape, kind = value["array"]
    types = {"f": np.float64, "i": np.int64, "b": np.bool_}
    end = begin + int(np.prod(shape))
    return numbers[begin:end].astype(types[kind]).reshape(shape)


class Remembering:
    """What a run changes in an object, for another one of its class to go on from.

    ``changing`` are the attributes that change; all others follow from the scene that goes on.
    """

    changing: ClassVar[tuple[str, ...]] = ()

    def memory(self) -> Memory:
        """What changes, to be packed before it changes again."""
        return {name: getattr(self, name) for name in self.changing}

    def recall(self, memory: Memory) -> None:
        """Take over what another one remembers, in the types that it has here."""
        for name in self.changing:
            setattr(self, name, _like(getattr(self, name), memory[name]))


def _like(present: Any, value: Any) -> Any:
    """A value in the type of the present one."""
    if isinstance(present, tuple) and hasattr(present, "_fields"):
        return type(present)(*value)
    return type(present)(value) if isinstance(present, (Enum, deque, tuple)) else value
