"""One thread of linear algebra while a run lasts."""

import contextlib
import ctypes
from collections.abc import Callable, Iterator
from pathlib import Path

_PREFIXES = ("scipy_openblas", "openblas")
_SUFFIXES = ("64_", "")
"""How builds of OpenBLAS name their functions: numpy's and scipy's wheels, and Linux packages."""


def thread_counts() -> list[tuple[Callable[[], int], Callable[[int], None]]]:
    """Functions that get and set the number of threads, for each OpenBLAS in this process."""
    # Field by field: address range, rights, offset, device, inode, and the file if there is one.
    lines = (line.split(maxsplit=5) for line in Path("/proc/self/maps").read_text().splitlines())
    files = {fields[5] for fields in lines if len(fields) > 5 and ".so" in fields[5]}
    found = []
    for file in sorted(file for file in files if "openblas" in Path(file).name):
        library = ctypes.CDLL(file)
        for prefix in _PREFIXES:
            for suffix in _SUFFIXES:
                with contextlib.suppress(AttributeError):
                    get = getattr(library, f"{prefix}_get_num_threads{suffix}")
                    found.append((get, getattr(library, f"{prefix}_set_num_threads{suffix}")))
    return found


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Give OpenBLAS one thread, and back what it had.

    The matrices of a run have at most some hundred rows: threads that wait for each other cost more
    than they save, on a busy machine many times the run.  The command ``ringsim`` sets the
    environment instead, which only helps before numpy is loaded.
    """
    counts = [(give, get()) for get, give in thread_counts()]
    try:
        for give, _ in counts:
            give(1)
        yield
    finally:
        for give, before in counts:
            give(before)
