"""One thread of linear algebra, whoever runs what: the same bits from every command and process."""

import contextlib
import ctypes
import importlib
import os
import sys
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path

ENVIRONMENT = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""What libraries of linear algebra ask for their number of threads, once, when they are loaded."""
_PREFIXES = ("scipy_openblas", "openblas")
_SUFFIXES = ("64_", "")
"""How builds of OpenBLAS name their functions: numpy's and scipy's wheels, and Linux packages."""


def one_thread_from_here_on() -> None:
    """Give one thread to what this process and its children load from now on.

    For commands, before numpy is loaded.  Whatever the user has set is replaced, as for the solver
    processes of campaigns: other sums in other threads end in other digits, and results are to be
    the same wherever they were computed.
    """
    os.environ.update(dict.fromkeys(ENVIRONMENT, "1"))


Counts = list[tuple[Callable[[], int], Callable[[int], None]]]
"""Functions that get and set the number of threads of libraries."""


def thread_counts() -> Counts:
    """Those of each OpenBLAS in this process."""
    # To look for them takes 3 % of a fast run; libraries come with modules that need them.
    return _counts(len(sys.modules))


@lru_cache(maxsize=1)
def _counts(modules: int) -> Counts:
    """Those of each OpenBLAS that is loaded together with so many modules."""
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

    For runs that a script calls, which has loaded numpy with as many threads as there are cores:
    sums in several threads end in other digits.  The matrices of a run have at most some hundred
    rows: threads that wait for each other cost more than they save, on a busy machine many times
    the run.
    """
    if any(os.environ.get(name) != "1" for name in ENVIRONMENT):
        # Else its OpenBLAS may come later, with all its threads.
        importlib.import_module("scipy.linalg")
    counts = [(give, get()) for get, give in thread_counts()]
    try:
        for give, _ in counts:
            give(1)
        yield
    finally:
        for give, before in counts:
            give(before)
