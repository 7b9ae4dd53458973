"""Laws of parts and cables as lists of operations, which the core plays back."""

import inspect
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from ringsim.core.chain import Seen
from ringsim.core.library import call
from ringsim.extensions import line_in
from ringsim.frame.mesh import CURE, NOT_HERE, Indices, Skeleton
from ringsim.layout.bodies import Array, JointOpening
from ringsim.parts.joints import JointFriction
from ringsim.parts.laws import AngleLaw, Reaction, Rub, Switches
from ringsim.refusal import InputError
from ringsim.units import at_section

# Laws of ringsim.parts and ringsim.cable as lists of operations, which the core plays (laws.c).
#
# A law is Python that numpy, exudyn's expressions and this module can follow: called once on rows
# that note what is done with them, it leaves a tape.  So one file serves all engines, and Newton's
# iterations do without the microsecond that numpy takes to begin each operation.
#
# A law that is to be taped works on each number by itself, by arithmetic and the functions of
# ``_KNOWN``, and does not branch on numbers: ``numpy.where`` does that.


_KNOWN = (
    np.add, np.subtract, np.multiply, np.divide, np.maximum, np.minimum, np.negative, np.absolute,
    np.sign, np.sqrt, np.square, np.power, np.exp, np.log, np.sin, np.cos, np.tanh, np.arctanh,
    np.greater, np.less, np.greater_equal, np.less_equal, np.arctan, np.expm1, np.log1p,
    np.positive, np.where,
)  # fmt: skip
Law = Callable[..., Any]


class Tape(NamedTuple):
    """What laws do, one behind the other, each on columns of its own.

    Operations, shape (m, 5): kind, rows of the result and of three operands; of every law the first
    operation, the last one and columns, (laws, 4); rows of numbers, (rows, columns): the inputs
    first, the results behind them, then constants and what comes in between.
    """

    code: Indices
    laws: Indices
    rows: Array


class Row(NDArrayOperatorsMixin):
    """A row that notes what is done with it; ``shape`` is that of what it stands for."""

    def __init__(self, notes: "_Notes", place: int) -> None:
        self._notes, self.place, self.shape = notes, place, notes.shape

    def __array_ufunc__(self, ufunc: Any, method: str, *given: Any, **options: Any) -> Any:
        """What numpy calls for its element-wise functions."""
        if method != "__call__" or options:
            raise TypeError(
                f"it calls numpy.{ufunc.__name__} with other arguments than plain numbers"
            )
        return self._notes.do(ufunc, given)

    def __array_function__(self, function: Any, _: Any, given: Any, options: Any) -> Any:
        """What numpy calls for its other functions."""
        if function in (np.zeros_like, np.ones_like):
            return float(function is np.ones_like)
        if function is np.full_like:
            return options["fill_value"] if "fill_value" in options else given[1]
        if function is np.clip and not options:
            return np.minimum(np.maximum(given[0], given[1]), given[2])
        return self._notes.do(function, given)

    def __bool__(self) -> bool:
        """Refused: a tape has one way through a law."""
        raise TypeError(
            "it branches on a value (if, and, or, min, max): use a smooth function, or numpy.where"
        )


class _Notes:
    """Operations of one law on values of a shape."""

    def __init__(self, shape: tuple[int, ...], inputs: int, results: int) -> None:
        self.shape = shape
        self.code: list[tuple[int, ...]] = []
        self.rows = [np.zeros(shape) for _ in range(inputs + results)]
        self.given = [Row(self, place) for place in range(inputs)]

    def do(self, function: Any, given: Sequence[Any]) -> Any:
        if function not in _KNOWN:
            raise TypeError(f"it calls numpy.{function.__name__}")
        operands = [self._place(each) for each in given]
        self.rows.append(np.zeros(self.shape))
        self._note(_KNOWN.index(function), len(self.rows) - 1, operands)
        return Row(self, len(self.rows) - 1)

    def end(self, found: Any, place: int) -> None:
        """Put a result into its row."""
        self._note(_KNOWN.index(np.positive), place, [self._place(found)])

    def _note(self, kind: int, to: int, operands: list[int]) -> None:
        self.code.append((kind, to, *operands, *[0] * (3 - len(operands))))

    def _place(self, value: Any) -> int:
        if isinstance(value, np.ndarray) and value.dtype == object:
            value = value.item()  # numpy.asarray of a row
        if isinstance(value, Row):
            return value.place
        self.rows.append(np.broadcast_to(np.asarray(value, dtype=float), self.shape))
        return len(self.rows) - 1


def _files_of(record: object) -> list[str]:
    """The file of a record's class; none of a class that was typed into a notebook."""
    try:
        return [inspect.getfile(type(record))]
    except (OSError, TypeError):
        return []


def taped(laws: Sequence[tuple[Law, tuple[int, ...], object]], inputs: int, results: int) -> Tape:
    """A tape of laws, each with the shape of its coordinates and the record that it belongs to.

    A law takes so many ``inputs`` and returns so many ``results``.  InputError if it does what
    tapes do not know.
    """
    code: list[tuple[int, ...]] = []
    table: list[tuple[int, ...]] = []
    blocks: list[Array] = []
    for law, shape, record in laws:
        notes = _Notes(shape, inputs, results)
        try:
            found = law(*notes.given)
            told = found if isinstance(found, tuple) else (found,)
            if len(told) != results:
                raise TypeError(f"it returns {len(told)} values, not {results}")
            for place, each in enumerate(told, inputs):
                notes.end(each, place)
        except (TypeError, AttributeError, NameError, ValueError) as error:
            where = line_in(_files_of(record), error)
            typo = isinstance(error, AttributeError) and not isinstance(error.obj, Row)
            if typo or isinstance(error, NameError):  # no engine could run it
                name = type(record).__name__
                raise InputError(f"the law of {name} does not work: {error}{where}") from error
            known = ", ".join(each.__name__ for each in _KNOWN)
            raise InputError(
                f"{NOT_HERE} the law of {type(record).__name__}: {error}{where} (write it with "
                f"arithmetic and numpy's {known} on each number, or {CURE})"
            ) from error
        left = sum(block.shape[1] for block in blocks)
        blocks.append(np.array([row.ravel() for row in notes.rows]))
        table.append((len(code), len(code) + len(notes.code), left, left + blocks[-1].shape[1]))
        code += notes.code
    rows = np.zeros(
        (max((len(block) for block in blocks), default=inputs + results),
         sum(block.shape[1] for block in blocks))
    )  # fmt: skip
    for block, (*_, left, right) in zip(blocks, table, strict=True):
        rows[: len(block), left:right] = block
    operations = np.array(code, dtype=np.int64).reshape(-1, 5)
    return Tape(operations, np.array(table, dtype=np.int64).reshape(-1, 4), rows)


def play(tape: Tape) -> None:
    """Compute the results from the inputs."""
    call("play", tape)


# Torques on joint angles: friction, stops and joints that stick, by the laws of ringsim.parts.


_ON, _SETTING = 2, 3
"""Rows of the laws' tape: whether the law acts, and its setting, behind coordinate and rate."""


class Acting(NamedTuple):
    """Laws on coordinates x = sense * angle, all shape (n,), and the angles' numbers.

    The first ``soft`` of them have slopes of their own; behind them is dry friction
    (``ringsim.core.chain``).
    """

    tape: Tape
    own: Indices
    sense: Array
    soft: int


class Openings(NamedTuple):
    """Joint angles and senses of the opening angles, shape (planes, sections)."""

    angle: Indices
    sense: Array

    @classmethod
    def of(cls, skeleton: Skeleton) -> "Openings":
        """Those of a layout."""
        found = [
            [_followed(skeleton, one) for one in plane if isinstance(one, JointOpening)]
            for plane in skeleton.layout.openings
        ]
        if not all(found):
            raise InputError(f"{NOT_HERE} openings without joints: {CURE}")
        table = np.array(found)
        return cls(table[..., 0].astype(np.int64), table[..., 1])

    def unwrapped(self, angles: Array) -> None:
        """Turn angles so that folded ones lie between -pi/2 and 3 pi/2; in place."""
        folded = self.sense * angles[self.angle]
        angles[self.angle] += self.sense * np.where(folded < -0.5 * np.pi, 2.0 * np.pi, 0.0)

    def read(self, angles: Array, rates: Array) -> tuple[Array, Array]:
        """Opening angles and rates, rad and rad/s."""
        return np.pi - self.sense * angles.take(self.angle), -self.sense * rates.take(self.angle)


def _followed(skeleton: Skeleton, opening: JointOpening) -> tuple[int, float]:
    """Number of its angle, and the sense in which it opens with it."""
    number = skeleton.angle_of[opening.joint]
    return number, opening.sense * skeleton.angles[number].sense


class JointLaws:
    """All torques of a layout's joints.

    ``switches`` say which laws act, with which settings; ``damping`` is the torque over the rate of
    each angle where friction is linear, N m s/rad, ``acting`` are all other laws, and ``rubbing``
    is what Newton's iterates tell of dry friction.
    """

    def __init__(self, skeleton: Skeleton, openings: Openings) -> None:
        layout, own, sense = skeleton.layout, *openings
        self.switches = Switches(layout.angle_laws)
        self.damping = np.zeros(len(skeleton.angles))
        self._friction: list[tuple[JointFriction, Indices, Array]] = []
        for rub in layout.rubs:
            self._rub(rub, skeleton)
        laws: list[tuple[Law, object, Indices, Array]] = []
        for law in layout.angle_laws:
            at = tuple(np.array(law.places).T)
            laws.append((_switched(law), law.record, own[at], sense[at]))
        soft = sum(each.size for _, _, each, _ in laws)
        for friction, where, senses in self._friction:
            laws.append((_rubbing(friction), friction, where, senses))
        self.acting = Acting(
            taped([(law, each.shape, record) for law, record, each, _ in laws], 4, 3),
            np.concatenate([np.zeros(0, np.int64), *(each for _, _, each, _ in laws)]),
            np.concatenate([np.zeros(0), *(senses for *_, senses in laws)]),
            soft,
        )
        self.rubbing = Seen.empty(len(self.acting.own) - soft)
        self.follow()

    def _rub(self, rub: Rub, skeleton: Skeleton) -> None:
        rest = []
        for k, joint in enumerate(rub.joints):
            linear = at_section(rub.law, int(rub.sections[k])).linear_damping()
            if linear is None:
                rest.append(k)
            else:
                self.damping[skeleton.angle_of[joint]] += linear
        if rest:
            own = np.array([skeleton.angle_of[rub.joints[k]] for k in rest])
            senses = np.array([skeleton.angles[n].sense for n in own])
            self._friction.append((rub.of(rest), own, senses))

    def follow(self) -> None:
        """Take over what faults and latches have changed; due after each change."""
        rows, last = self.acting.tape.rows, self.acting.soft
        rows[_ON, :last] = np.concatenate([np.zeros(0), *self.switches.on])
        rows[_SETTING, :last] = np.concatenate([np.zeros(0), *self.switches.setting])


def _switched(law: AngleLaw) -> Law:
    """What a tape is made of: a law on its places, as far as they are switched on."""
    own = law.own

    def reacting(folded: Any, rate: Any, on: Any, setting: Any) -> Reaction:
        return own.reaction(folded, rate, setting).times(on)

    return reacting


def _rubbing(friction: JointFriction) -> Law:
    return lambda _folded, rate, _on, _setting: (0.0, friction.torque(rate), 0.0)
