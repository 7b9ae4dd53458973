"""The core in C: where it lies, and how tables and arrays are handed to it.

A table is a NamedTuple of arrays, numbers and further tables: the core sees it as a struct of the
same order, of which an array is its address, its length and how many numbers each of its rows has
(ringsim/core/c/core.h).
"""

import ctypes
import hashlib
import math
import platform
import struct
from collections.abc import Callable
from functools import cache
from importlib.metadata import distributions
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast, get_type_hints

import numpy as np
from numpy.typing import NDArray

from ringsim.refusal import NotBuiltError

FOLDER = Path(__file__).parent / "c"
"""Sources of the core, and where it is compiled to."""
_NONE, _WHOLE, _REAL, _TRUTH = None, ctypes.c_int64, ctypes.c_double, ctypes.c_bool
ASKED = ctypes.CFUNCTYPE(_WHOLE, _WHOLE)
"""What the core may ask Python: a function of a whole number that returns its complement, or 0 to
stop it."""
NOT_ASKED = ASKED()
_FUNCTIONS: dict[str, tuple[str, Any]] = {
    "compiled_from": ("", ctypes.c_char_p),
    "words_of_table": ("w", _WHOLE),
    "constant_of_fronts": ("w", _WHOLE),
    "room_for_loads": ("w", _WHOLE),
    "play": ("t", _NONE),
    "place_points": ("tta", _NONE),
    "move": ("tta", _NONE),
    "set_out": ("ttta", _NONE),
    "arrive": ("ttta", _NONE),
    "straighten": ("t", _NONE),
    "energies_of": ("taaa", _NONE),
    "add_forces": ("ttaataa", _NONE),
    "begin_tangent": ("ttaaarrt", _NONE),
    "put_in_place": ("ttttata", _NONE),
    "unbalance": ("ttwfrtt", _WHOLE),
    "stiffen": ("ttwfrt", _WHOLE),
    "relax": ("tta", _NONE),
    "most_iterations": ("", _WHOLE),
    "learn": ("aaawa", _NONE),
    "balance_step": ("ttwfrttra", _WHOLE),
    "note_rates": ("ta", _NONE),
    "rates_across": ("ta", _NONE),
    "slopes_between": ("taaaaa", _NONE),
    "read_energies": ("ttraaa", _NONE),
    "factor": ("tt", _TRUTH),
    "solve": ("tta", _NONE),
    "solve_one": ("tta", _NONE),
    "measure": ("taat", _REAL),
    "wind": ("taat", _NONE),
    "slide": ("ttt", _NONE),
    "tighten": ("ttat", _NONE),
    "read_chain": ("tttaaaa", _NONE),
    "work_of_ropes": ("taaa", _NONE),
    "pull_tight": ("tttaat", _REAL),
    "factors_needed": ("ta", _WHOLE),
    "tension_changes": ("ttaaataaarraa", _NONE),
    "spread_changes": ("ttaaa", _NONE),
    "find_slopes": ("tt", _WHOLE),
    "limit_of_ropes": ("w", _REAL),
    "answer_ropes": ("tf", _WHOLE),
    "turn_winches": ("ttf", _WHOLE),
    "find_left": ("ttfa", _WHOLE),
    "ratio_of_winch": ("ttfwr", _REAL),
}
"""What each takes: tables (t), arrays of real (a) and whole numbers (n), such numbers (r, w) and
functions (f); and what it returns.
"""
_TYPES: dict[str, list[Any]] = {
    "t": [ctypes.c_void_p], "a": [ctypes.c_void_p, _WHOLE], "n": [ctypes.c_void_p, _WHOLE],
    "r": [_REAL], "w": [_WHOLE], "f": [ASKED],
}  # fmt: skip
_KINDS = {NDArray[np.float64]: "a", NDArray[np.int64]: "n", float: "r", int: "w", bool: "w"}
"""The same of fields of tables, by their annotations."""
_RAISED = 5
"""How the core ends if an answer fails, see core.h."""
MOST_KNOWN = 64
"""Packed tables that are kept at most."""


def ask(answer: Callable[[int], None], called: Callable[[Any], int]) -> int:
    """Call a function of the core with what it may ask; what ``called`` with that returns.

    What ``answer`` raises goes on behind it: nothing may be raised into C, which stops instead.
    """
    raised: list[BaseException] = []

    def attempt(question: int) -> int:
        try:
            answer(question & 0xFFFF)  # the rest is its number
        except BaseException as error:
            raised.append(error)
        return 0 if raised else ~question

    found = called(ASKED(attempt))
    if raised:
        raise raised[0]
    # A signal that comes between the call and its ``try`` is raised where nobody can catch it.
    if found == _RAISED:
        raise KeyboardInterrupt
    return found


@cache
def _function(name: str) -> tuple[str, Any]:
    takes, returns = _FUNCTIONS[name]
    found = getattr(loaded(), name)
    found.argtypes = [each for letter in takes for each in _TYPES[letter]]
    found.restype = returns
    return takes, found


@cache
def loaded() -> ctypes.PyDLL:
    """That for this processor.  It keeps Python's lock: nothing else runs meanwhile."""
    whys = ["is not compiled here"]
    for name in ("_wide", "_core") if has_wide_registers() else ("_core",):
        for file in files_of(name):
            try:
                found = ctypes.PyDLL(str(file))
            except OSError as error:  # of another machine that shares the folder
                whys.append(f"cannot be loaded ({error})")
                continue
            found.compiled_from.restype = ctypes.c_char_p
            if found.compiled_from().decode() == digest():
                return found
            whys.append("was compiled from other sources")
    raise NotBuiltError(
        f"{FOLDER}: the compiled core of ringsim {whys[-1]}: run pip install . (developers: pip "
        "install -e . after each change of the C sources)"
    )


def files_of(name: str) -> list[Path]:
    """The libraries of a name, the youngest first; a checkout may hold some for other versions of
    Python, and one that is not compiled takes what is installed of the same sources: Python finds
    the package of the folder that it is started in before the one that is installed.
    """
    # Of several: building leaves one in the checkout that says nothing of the installed one.
    installed = [each.locate_file("ringsim/core/c") for each in distributions(name="ringsim")]
    folders = dict.fromkeys([FOLDER, *(Path(str(each)) for each in installed)])
    return [
        file for folder in folders
        for file in sorted(folder.glob(f"{name}.*so"), key=lambda file: -file.stat().st_mtime)
    ]  # fmt: skip


def digest() -> str:
    """Of the sources, as setup.py takes it."""
    files = sorted([*FOLDER.glob("*.c"), *FOLDER.glob("*.h")])
    whole = b"".join(file.read_bytes() for file in files)
    return hashlib.blake2b(whole, digest_size=8).hexdigest()


def has_wide_registers() -> bool:
    """Whether the processor takes four numbers at once (AVX2); results are the same without."""
    if platform.machine() not in ("x86_64", "AMD64"):
        return False
    try:
        with open("/proc/cpuinfo", encoding="ascii", errors="replace") as file:
            return any(" avx2 " in line for line in file if line.startswith("flags"))
    except OSError:
        return False


def call(name: str, *given: Any) -> Any:
    """Call a function of the core with tables, arrays and numbers; it writes into the arrays.

    TypeError for an array that is not whole or of other numbers.
    """
    takes, function = _function(name)
    words: list[Any] = []
    held = []  # until the function returns, whatever is forgotten meanwhile
    for letter, each in zip(takes, given, strict=True):
        if letter == "t":
            table = _known.get(id(each)) or _packed(each)
            held.append(table)
            words.append(table[2])
        elif letter in "an":
            words += _address(each, letter), each.size
        else:
            words.append(each)
    return function(*words)


def _address(array: Any, letter: str) -> int:
    if not array.size:  # of no other use than not to be NULL
        return int(array.__array_interface__["data"][0])
    if not (array.flags.c_contiguous and array.dtype.char == ("d" if letter == "a" else "l")):
        wanted = "real" if letter == "a" else "whole"
        raise TypeError(
            f"the core takes whole arrays of {wanted} numbers of 64 bits, not {array.dtype} "
            f"{array.shape} with strides {array.strides}"
        )
    if not array.flags.writeable:
        return int(array.__array_interface__["data"][0])
    # numpy's own ways to tell it take several times as long.
    return ctypes.addressof(ctypes.c_char.from_buffer(array))


# Tables of a model are handed over thousands of times: each is packed once.  It stays while it is
# known here, so that its ``id`` is that of no other.


class _Packed(NamedTuple):
    """A table, the words of its struct and their address."""

    table: Any
    words: Any
    address: int


_known: dict[int, _Packed] = {}


def _packed(table: Any) -> _Packed:
    if len(_known) >= MOST_KNOWN:
        _known.clear()
    words = np.array(_words(table), dtype=np.int64)
    found = _known[id(table)] = _Packed(table, words, _address(words, "n"))
    return found


@cache
def _annotations(kind: type) -> tuple[Any, ...]:
    """Annotations of a kind of table."""
    return tuple(get_type_hints(kind).values())


@cache
def _fields(kind: type) -> list[str]:
    """What the fields of a kind of table are, as of ``_FUNCTIONS``."""
    return [_KINDS.get(each, "t") for each in _annotations(kind)]


def words_of(kind: type) -> int:
    """Words of a kind of table."""
    nested = iter(each for each in _annotations(kind) if each not in _KINDS)
    each = {"a": 3, "n": 3, "r": 1, "w": 1}
    return sum(each.get(letter) or words_of(next(nested)) for letter in _fields(kind))


Table = TypeVar("Table", bound=tuple[Any, ...])


def empty_of(kind: type[Table]) -> Table:
    """A table whose arrays have no rows, and whose numbers are zero: of what a scene has not."""
    kinds = {"a": np.zeros(0), "n": np.zeros(0, np.int64), "r": 0.0, "w": 0}
    found = (kinds[_KINDS[k]] if k in _KINDS else empty_of(k) for k in _annotations(kind))
    return cast(Table, cast(Any, kind)(*found))


def _words(table: Any) -> list[int]:
    words: list[int] = []
    for letter, each in zip(_fields(table.__class__), table, strict=True):
        if letter in "an":
            words += _address(each, letter), len(each), math.prod(each.shape[1:])
        elif letter == "t":
            words += _words(each)
        elif letter == "r":
            words += struct.unpack("q", struct.pack("d", each))
        else:
            words.append(int(each))
    return words
