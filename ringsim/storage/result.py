"""One sample's result as bytes: a small header, and its arrays packed."""

import hashlib
import json
import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.variables import Cause, Code, Fate, Status

MISSING_COUNT = -1
"""Stands for a missing whole number."""

_DIGITS = 12
"""Coordinates are rounded to so many digits: the last bits would differ between samples."""
_COMPRESSION = 1
"""Higher levels of zlib take several times as long for a few percent."""


@dataclass(frozen=True)
class Result:
    """How one sample ended, and what it gave."""

    sample: int
    """Its number, or that of its check: see :func:`check_of`."""
    status: Status
    reason: str
    """One sentence: why it ended so."""
    cause: Cause = Cause.NONE
    """The same as a code."""
    log: str = ""
    """The last lines of output of a failed run."""
    seconds: float = float("nan")
    """Elapsed time of the run."""
    finished: float = 0.0
    """When it ended, as seconds since 1970."""
    form: str = ""
    """The same for results whose arrays have the same names, shapes and coordinates."""
    body: bytes = field(default=b"", repr=False)
    """The arrays, see :func:`pack`."""
    overrides: dict[str, Any] = field(default_factory=dict)
    """Settings by scene path that it was run with instead of the campaign's."""
    fate: Fate = Fate.NONE
    """The variable ``outcome``, which is told while a campaign runs; NONE where nobody knows."""
    run_with: str = ""
    """Digest of what it was run with: build, scene, solver, and the sample's own inputs."""

    def header(self) -> bytes:
        """Everything but the body."""
        table = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "body"}
        return json.dumps(table, separators=(",", ":")).encode()

    def settings(self) -> str:
        """The overrides in words.

        >>> Result(0, Status.OK, "", overrides={"solver.tolerance": 1e-4}).settings()
        'solver.tolerance = 0.0001'
        """
        return ", ".join(f"{path} = {json.dumps(v)}" for path, v in self.overrides.items())

    @classmethod
    def from_header(cls, header: bytes, body: bytes) -> "Result":
        """The result whose :meth:`header` is given."""
        table = json.loads(header)
        kinds: dict[str, type[Code]] = {"status": Status, "cause": Cause, "fate": Fate}
        codes = {name: kind(table[name]) for name, kind in kinds.items()}
        return cls(**table | codes, body=body)

    def arrays(self) -> dict[str, NDArray[Any]]:
        """The arrays by name."""
        for _, arrays in stacked([self.body]):
            return {name: values[0, ...] for name, values in arrays.items()}
        return {}


def stacked(bodies: Sequence[bytes]) -> Iterator[tuple[list[int], dict[str, NDArray[Any]]]]:
    """The arrays of several bodies, all together where they have the same names and shapes.

    Yields the places of such bodies, and their arrays by name with these along a first dimension.
    """
    alike: dict[bytes, tuple[list[int], list[bytes]]] = {}
    for k, body in enumerate(bodies):
        if body:
            head, _, planes = zlib.decompress(body).partition(b"\n")
            places, rows = alike.setdefault(head, ([], []))
            places.append(k)
            rows.append(planes)
    for head, (places, rows) in alike.items():
        content = np.frombuffer(b"".join(rows), "u1").reshape(len(rows), -1)
        yield places, _unshuffled(head, content)


def _unshuffled(head: bytes, content: NDArray[np.uint8]) -> dict[str, NDArray[Any]]:
    """The arrays that a head describes, from the bytes of several bodies, one in each row."""
    found: dict[str, NDArray[Any]] = {}
    start, bodies = 0, len(content)
    for name, dtype, shape in json.loads(head):
        kind = np.dtype(dtype)
        count = math.prod(shape)
        stop = start + kind.itemsize * count
        planes = content[:, start:stop].reshape(bodies, kind.itemsize, count)
        values = np.ascontiguousarray(planes.transpose(0, 2, 1)).view(kind)
        found[name], start = values.reshape(bodies, *shape), stop
    return found


def check_of(sample: int) -> int:
    """Number under which a sample's repetition with the judging engine runs and is kept."""
    return ~sample


def sample_of(number: int) -> int:
    """The sample that a number is of, its own or that of its check.

    >>> sample_of(7), sample_of(check_of(7))
    (7, 7)
    """
    return number if number >= 0 else ~number


def plain(text: str) -> str:
    r"""The text without what cannot be stored in a file: half characters and zero bytes.

    >>> plain("no text: \udcff, a zero byte: \0")
    'no text: ?, a zero byte:  '
    """
    return text.encode("utf-8", "replace").decode("utf-8").replace("\0", " ")


def pack(arrays: Mapping[str, NDArray[Any]]) -> tuple[str, bytes]:
    """Form and body of a run's values and coordinates, cast to their defined types.

    The body is compressed: a line of JSON with name, type and shape of each array, then their
    bytes, shuffled as by HDF5's filter since neighbouring numbers differ in their last bytes only.
    ValueError if a name has no definition, or an array does not span its coordinates.
    """
    sizes = {name: np.shape(values) for name, values in arrays.items() if name in COORDINATES}
    described, parts, same = [], [], []
    for name, values in arrays.items():
        wanted = COORDINATES.get(name) or VARIABLES.get(name)
        if wanted is None:
            raise ValueError(f"there is no variable {name}")
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
        planes = np.frombuffer(array.tobytes(), "u1").reshape(-1, array.itemsize).T.tobytes()
        parts.append(planes)
        if name in COORDINATES:
            same.append(planes)
    head = json.dumps(described, separators=(",", ":")).encode()
    form = hashlib.blake2b(b"\n".join([head, *same]), digest_size=8).hexdigest()
    return form, zlib.compress(b"".join([head, b"\n", *parts]), _COMPRESSION)


def _rounded(values: NDArray[Any]) -> NDArray[Any]:
    largest = float(np.abs(values).max(initial=0.0))
    if not 0.0 < largest < np.inf:
        return values
    return np.round(values, _DIGITS - math.ceil(math.log10(largest)))
