"""The core in C: where it lies, and how tables and arrays are handed to it.

A table is a NamedTuple of arrays, numbers and further tables: the core sees it as a struct of the
same order, of which an array is its address, its length and how many numbers each of its rows has
(ringsim/core/c/core.h).
"""

import ctypes
import platform
import struct
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_FOLDER = Path(__file__).parent / "c"
_NONE, _WHOLE, _REAL, _TRUTH = None, ctypes.c_int64, ctypes.c_double, ctypes.c_bool
_FUNCTIONS: dict[str, tuple[str, Any]] = {
    "numbers_of_a_load": ("", _WHOLE),
    "play": ("t", _NONE),
    "place_points": ("tta", _NONE),
    "move": ("tta", _NONE),
    "moved_between": ("ttta", _NONE),
    "straighten": ("t", _NONE),
    "energies_of": ("taaa", _NONE),
    "add_forces": ("ttaataa", _NONE),
    "begin_tangent": ("ttaaarrt", _NONE),
    "put_in_place": ("ttttata", _NONE),
    "balance": ("ttttttrttatttaa", _TRUTH),
    "differentiate": ("ttttttarrrwtaaa", _NONE),
    "passing_joints": ("taaa", _REAL),
    "stretched": ("taaaaaaa", _NONE),
    "passing_pairs": ("taaa", _REAL),
    "aside": ("twwraa", _WHOLE),
    "factor": ("tt", _TRUTH),
    "solve": ("tta", _NONE),
    "solve_one": ("tta", _NONE),
    "measure": ("taaat", _REAL),
    "slide": ("ttt", _NONE),
    "tighten": ("ttat", _NONE),
    "of_ropes": ("ttta", _NONE),
    "show": ("attt", _NONE),
    "pull_tight": ("tattaat", _REAL),
    "pull_cables": ("ttttattaata", _REAL),
    "factors_needed": ("ta", _WHOLE),
    "tension_changes": ("ttaaataarraa", _NONE),
    "spread_changes": ("ttaaa", _NONE),
    "add_cables": ("ttttttataarataaw", _NONE),
}
"""What each takes, tables (t), arrays (a), real (r) and whole numbers (w), and what it returns."""
_TYPES: dict[str, list[Any]] = {
    "t": [ctypes.c_void_p],
    "a": [ctypes.c_void_p, _WHOLE],
    "r": [_REAL],
    "w": [_WHOLE],
}
_MOST_KNOWN = 64
"""Packed tables that are kept at most."""


class NotBuiltError(RuntimeError):
    """The core has not been compiled where this package lies."""


@cache
def _function(name: str) -> Any:
    takes, returns = _FUNCTIONS[name]
    found = getattr(_library(), name)
    found.argtypes = [each for letter in takes for each in _TYPES[letter]]
    found.restype = returns
    return found


@cache
def _library() -> ctypes.PyDLL:
    """That for this processor.  It keeps Python's lock: nothing else runs meanwhile."""
    for name in ("_wide", "_core") if _has_wide_registers() else ("_core",):
        # A checkout may hold some, of other versions of Python.
        if found := list(_FOLDER.glob(f"{name}.*so")):
            return ctypes.PyDLL(str(max(found, key=lambda file: file.stat().st_mtime)))
    raise NotBuiltError(
        f"{_FOLDER}: the core of ringsim is not compiled here: install it (pip install .), or, to "
        "work on its sources, pip install -e ."
    )


def _has_wide_registers() -> bool:
    """Whether the processor takes four numbers at once (AVX2); results are the same without."""
    if platform.machine() not in ("x86_64", "AMD64"):
        return False
    try:
        return " avx2 " in Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace")
    except OSError:
        return False


def call(name: str, *given: Any) -> Any:
    """Call a function of the core with tables, arrays and numbers; it writes into the arrays.

    TypeError for an array that is not whole or of other numbers.
    """
    words: list[Any] = []
    held = []  # until the function returns, whatever is forgotten meanwhile
    for each in given:
        if isinstance(each, np.ndarray):
            words += _address(each), each.size
        elif isinstance(each, tuple):
            held.append(_packed(each))
            words.append(held[-1].address)
        else:
            words.append(each)
    return _function(name)(*words)


def _address(array: Any) -> int:
    if not array.flags.c_contiguous or array.dtype.char not in "dl":
        raise TypeError(
            f"the core takes whole arrays of 64 bits, not {array.dtype} {array.strides}"
        )
    return int(array.__array_interface__["data"][0])


# Tables of a model are handed over thousands of times: each is packed once.  It stays while it is
# known here, so that its ``id`` is that of no other.


class _Packed(NamedTuple):
    """A table, the words of its struct and their address."""

    table: Any
    words: Any
    address: int


_known: dict[int, _Packed] = {}


def _packed(table: Any) -> _Packed:
    found = _known.get(id(table))
    if found is None:
        if len(_known) >= _MOST_KNOWN:
            _known.clear()
        words = np.array(_words(table), dtype=np.int64)
        found = _known[id(table)] = _Packed(table, words, _address(words))
    return found


def _words(table: Any) -> list[int]:
    words: list[int] = []
    for each in table:
        if isinstance(each, np.ndarray):
            words += _address(each), len(each), int(np.prod(each.shape[1:], dtype=np.int64))
        elif isinstance(each, tuple):
            words += _words(each)
        elif isinstance(each, float):
            words += struct.unpack("q", struct.pack("d", each))
        else:
            words.append(int(each))
    return words
