"""One sample's result as bytes: a small header and the raw arrays behind it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.variables import Cause, Status

_DIGITS = 12
"""Coordinates are rounded to so many digits: the last bits would differ between samples."""

MISSING_COUNT = -1
"""Stands for a missing whole number."""


@dataclass(frozen=True)
class Result:
    """How one sample ended, and what it gave.

    Attributes
    ----------
    sample
        Index of the sample.
    status
        How the run ended.
    reason
        One sentence: why it ended so.
    cause
        The same as a code.
    log
        The end of what a failed run printed.
    attempts
        Runs that were made; more than one if a failed run was repeated.
    step
        Largest time step of the run that counts, in s.
    seconds
        Elapsed time of all attempts.
    finished
        When it ended, as seconds since 1970.
    arrays
        Name, dtype and shape of each array in ``body``.
    body
        The arrays' bytes one behind the other.
    """

    sample: int
    status: Status
    reason: str
    cause: Cause = Cause.NONE
    log: str = ""
    attempts: int = 1
    step: float = float("nan")
    seconds: float = float("nan")
    finished: float = 0.0
    arrays: tuple[tuple[str, str, tuple[int, ...]], ...] = ()
    body: bytes = field(default=b"", repr=False)

    def unpack(self) -> dict[str, NDArray[Any]]:
        """The arrays by name."""
        found: dict[str, NDArray[Any]] = {}
        start = 0
        for name, dtype, shape in self.arrays:
            kind = np.dtype(dtype)
            count = int(np.prod(shape, dtype=np.int64))
            found[name] = np.frombuffer(self.body, kind, count, start).reshape(shape)
            start += count * kind.itemsize
        return found

    def header(self) -> bytes:
        """Everything but the arrays' bytes."""
        table = {name: getattr(self, name) for name in _FIELDS}
        table["status"], table["cause"] = int(self.status), int(self.cause)
        return json.dumps(table, separators=(",", ":")).encode()


_FIELDS = (
    "sample", "status", "reason", "cause", "log", "attempts", "step", "seconds", "finished",
    "arrays",
)  # fmt: skip


def precedence(status: Any, finished: Any) -> Any:
    """Which of several results of one sample counts: that with the greatest number.

    A run that went well counts before one that failed, whatever the clocks said; otherwise the
    later one does.

    Parameters
    ----------
    status, finished
        Of the results, numbers or arrays.
    """
    return np.asarray(finished) + 1e12 * (np.asarray(status) < Status.SOLVER_FAILED)


def plain(text: str) -> str:
    """The text without what cannot be stored in a file: half characters and zero bytes."""
    return text.encode("utf-8", "replace").decode("utf-8").replace("\0", " ")


def from_header(header: bytes, body: bytes) -> Result:
    """The result whose :meth:`Result.header` is given."""
    table = json.loads(header)
    table["status"], table["cause"] = Status(table["status"]), Cause(table.get("cause", 0))
    table["arrays"] = tuple((name, dtype, tuple(shape)) for name, dtype, shape in table["arrays"])
    return Result(**table, body=body)


def pack(
    arrays: Mapping[str, NDArray[Any]],
) -> tuple[tuple[tuple[str, str, tuple[int, ...]], ...], bytes]:
    """Bytes of a run's values and coordinates, cast to their defined types.

    Raises
    ------
    ValueError
        If a name has no definition, or an array does not span its coordinates.
    """
    defined = COORDINATES | VARIABLES
    sizes = {name: np.shape(values) for name, values in arrays.items() if name in COORDINATES}
    described: list[tuple[str, str, tuple[int, ...]]] = []
    parts: list[bytes] = []
    for name, values in arrays.items():
        if name not in defined:
            raise ValueError(f"there is no variable {name}")
        wanted = defined[name]
        array = np.asarray(values)
        if array.ndim != len(wanted.dims):
            raise ValueError(
                f"{name} has shape {array.shape}, but its dimensions are {wanted.dims}"
            )
        for dim, length in zip(wanted.dims, array.shape, strict=True):
            if sizes.get(dim) != (length,):
                raise ValueError(
                    f"{name} has {length} values along {dim}, whose coordinate has the shape "
                    f"{sizes.get(dim, 'of nothing: it is missing')}"
                )
        if wanted.dtype == "str":
            array = array.astype(str)
        elif np.dtype(wanted.dtype).kind in "iu" and array.dtype.kind == "f":
            array = np.where(np.isfinite(array), array, MISSING_COUNT).astype(wanted.dtype)
        else:
            array = array.astype(wanted.dtype)
            if name in COORDINATES and array.dtype.kind == "f":
                array = _rounded(array)
        described.append((name, array.dtype.str, array.shape))
        parts.append(np.ascontiguousarray(array).tobytes())
    return tuple(described), b"".join(parts)


def _rounded(values: NDArray[Any]) -> NDArray[Any]:
    largest = float(np.abs(values).max(initial=0.0))
    if not 0.0 < largest < np.inf:
        return values
    return np.round(values, _DIGITS - math.ceil(math.log10(largest)))
