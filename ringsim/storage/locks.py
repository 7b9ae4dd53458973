"""Locks: which process may run which samples of a campaign's folder."""

import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from pathlib import Path

from ringsim.files import writing
from ringsim.refusal import InputError

GO_ON = (
    "make room or choose another folder, then give the same command again: finished samples are "
    "kept"
)
"""What to do when a campaign's folder cannot be written to."""

_LOCK_TRIES, _LOCK_PAUSE = 10, 0.1


@contextlib.contextmanager
def locked(path: Path, *, shared: bool = False, wait: bool = False) -> Iterator[bool]:
    """Hold an advisory lock; False if another process holds it, unless it may ``wait``.

    Others may hold a shared lock, too.  OSError if its file is not there and cannot be created.
    """
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError:
        if not path.exists():
            raise
        descriptor = os.open(path, os.O_RDONLY)  # does as well, in folders that are read-only
    try:
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        held = True  # also on a file system without locks
        try:
            fcntl.flock(descriptor, kind if wait else kind | fcntl.LOCK_NB)
        except BlockingIOError:
            held = False
        except OSError:
            pass
        yield held
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def reserved(folder: Path, writer: str, *, alone: bool) -> Iterator[None]:
    """Keep other processes from the share ``writer``, or if ``alone`` from all; or InputError."""
    for _ in tries(folder):
        with contextlib.ExitStack() as held:
            with writing(folder / f"lock-{writer}", GO_ON):
                free = held.enter_context(locked(folder / "lock", shared=not alone)) and (
                    held.enter_context(locked(folder / f"lock-{writer}"))
                )
            if free:
                yield
                return


def tries(folder: Path) -> Iterator[int]:
    """Count up, with pauses, for as long as it pays to wait for a lock; after that InputError."""
    for number in range(_LOCK_TRIES):
        yield number
        time.sleep(_LOCK_PAUSE)
    raise InputError(
        f"{folder}: another process runs this campaign just now: wait for it, or stop it (ringsim "
        "status tells which it is)"
    )


def runs_in(folder: Path) -> bool:
    """Whether any process runs a campaign in a folder just now."""
    path = folder / "lock"
    if not path.exists():
        return False
    with locked(path) as free:
        return not free


def in_use(folder: Path, writer: str) -> bool:
    """Whether a process runs a share of a campaign just now."""
    path = folder / f"lock-{writer}"
    if not path.exists():
        return False
    with locked(path, shared=True) as free:
        return not free
