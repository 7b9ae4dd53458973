"""What a run remembers, as numbers in a file and back: nothing of it is ever executed.

``pack`` makes of nested lists and tables one row of numbers, for all arrays, and a JSON text that
says where each lies; Python writes floats so that they read back bit by bit.
"""

import json
from collections import deque
from collections.abc import Mapping
from enum import Enum
from typing import Any, ClassVar

import numpy as np

from ringsim.stepping.instant import Array, Energies, Instant
from ringsim.variables import Cause, Reason

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
