"""What a run remembers, as numbers in a file and back: nothing of it is ever executed.

``pack`` makes of nested lists and tables one row of numbers, for all arrays, and a JSON text that
says where each lies; Python writes floats so that they read back bit by bit.
"""

import json
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np

from ringsim.stepping.instant import Array, Energies, Instant

Memory = dict[str, Any]
"""Names and values: None, numbers, texts, arrays, lists and tables of these."""


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
    """What ``pack`` was given; tuples are lists, dataclasses tables.

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
    if is_dataclass(value) and not isinstance(value, type):
        value = {one.name: getattr(value, one.name) for one in fields(value)}
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
    begin, shape, kind = value["array"]
    types = {"f": np.float64, "i": np.int64, "b": np.bool_}
    end = begin + int(np.prod(shape))
    return numbers[begin:end].astype(types[kind]).reshape(shape)


def kept(thing: Any, names: Sequence[str]) -> Memory:
    """Attributes of an object."""
    return {name: getattr(thing, name) for name in names}


def restore(thing: Any, memory: Memory) -> None:
    """Give an object its attributes back, in the types that they have there."""
    for name, value in memory.items():
        setattr(thing, name, _like(getattr(thing, name), value))


def _like(present: Any, value: Any) -> Any:
    """A value in the type of the present one."""
    if isinstance(present, Instant):
        return instant(value)
    if isinstance(present, deque):
        return deque(value)
    if isinstance(present, Enum):
        return type(present)(value)
    if isinstance(present, tuple) and hasattr(present, "_fields"):
        return type(present)(*value)
    return value


def instant(memory: Memory) -> Instant:
    """An instant from its table."""
    return Instant(**(memory | {"energies": Energies(*memory["energies"])}))
