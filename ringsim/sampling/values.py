"""Values of inputs: numbers, words, whole tables and lists of them, in arrays and in words."""

import json
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.overrides import section_of
from ringsim.scene import Scene

Values = NDArray[Any]
"""Numbers, words, true and false; of dtype object where they are mixed, tables or lists."""

_WORD = re.compile(r"(?!(true|false|inf|nan)$)[^\W\d_][\w .:/+-]*(?<! )")
"""Texts that need no quotes in a label: others might read as several values, or as a number."""

_ALIKE: tuple[tuple[type, ...], ...] = ((bool,), (int,), (int, float), (str,))


def array_of(values: Sequence[Any]) -> Values:
    """One entry for each value, of the narrowest type that holds them unchanged.

    >>> array_of([1, 2.5]).tolist(), array_of([5.0, "none"]).tolist()
    ([1.0, 2.5], [5.0, 'none'])
    """
    if any(all(type(value) in kinds for value in values) for kinds in _ALIKE):
        return np.array(values)
    # Entry by entry: numpy would take lists apart and turn numbers beside words into words.
    array = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        array[k] = value
    return array


def plain(entry: Any) -> Any:
    """An entry or row of an array as TOML would give it."""
    return entry.tolist() if isinstance(entry, (np.generic, np.ndarray)) else entry


def label_of(value: Any) -> str:
    """A value in a few words, the same ones for equal values and others for others.

    Lists of tables, as of faults, have no brackets: no field takes both a table and a list of one,
    and an empty list is what "none" gives.

    >>> label_of([{"kind": "stall", "max_tension": 20.0}]), label_of([]), label_of([5.0, "x"])
    ('stall(max_tension=20.0)', 'none', '[5.0, x]')
    """
    match value:
        case list() | tuple() if value and all(isinstance(each, dict) for each in value):
            return ", ".join(map(_part, value))
        case list() | tuple() if not value:
            return "none"
        case _:
            return _part(value)


def _part(value: Any) -> str:
    match value:
        case dict():
            parts = {key: _part(value[key]) for key in sorted(value)}
            kind = parts.pop("kind", "")
            return f"{kind}({', '.join(f'{_part(key)}={part}' for key, part in parts.items())})"
        case list() | tuple():
            return f"[{', '.join(map(_part, value))}]"
        case bool():
            return str(value).lower()
        case str() if not _WORD.fullmatch(value):
            return json.dumps(value)
        case _:
            return str(value)


def labels_of(values: Values) -> Values:
    """The labels of all values, same shape."""
    labels: Values = np.array([label_of(plain(each)) for each in values.ravel()], dtype=str)
    return labels.reshape(values.shape)


def extremes_of(values: Values) -> set[int]:
    """Samples, along the first axis, with the least and the greatest number and each other value.

    >>> sorted(extremes_of(array_of([2.0, "none", 3.0, 1.0, "none"])))
    [1, 2, 3]
    """
    width, flat = values[0].size if values.ndim > 1 else 1, values.ravel()
    if flat.dtype.kind in "iuf":
        return {int(flat.argmin()) // width, int(flat.argmax()) // width}
    # Beside words numbers are many, and only their ends tell anything.
    numbers = [float(v) if type(v) in (int, float) else np.nan for v in map(plain, flat)]
    words = np.flatnonzero(~np.isfinite(numbers))
    found = set(words[np.unique(labels_of(flat[words]), return_index=True)[1]].tolist())
    if np.isfinite(numbers).any():
        found |= {int(np.nanargmin(numbers)), int(np.nanargmax(numbers))}
    return {int(k) // width for k in found}


def is_label(name: str) -> bool:
    """Whether a column of that name can only tell samples apart, as no scene has such a field."""
    return "." not in name and section_of(name)[0] not in Scene.model_fields
