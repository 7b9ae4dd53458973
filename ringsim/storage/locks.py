"""Locks: which process may run which samples of a campaign's folder."""

from __future__ import annotations

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
def locked(path: Path, *, shared: bool = False) -> Iterator[bool]:
    """Hold an advisory lock; gives False at once if another process holds it.

    Parameters
    ----------
    path
        The file that carries the lock; created if it is not there.
    shared
        Whether others may hold it at the same time, shared as well.

    Raises
    ------
    OSError
        If the file cannot be created.
    """
    descriptor = _open_lock(path)
    try:
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
            held = True
        except BlockingIOError:
            held = False
        except OSError:
            held = True  # a file system without locks
        yield held
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def in_turn(path: Path) -> Iterator[None]:
    """Wait for an advisory lock and hold it.

    Raises
    ------
    OSError
        If the file that carries the lock cannot be created.
    """
    descriptor = _open_lock(path)
    try:
        with contextlib.suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def _open_lock(path: Path) -> int:
    """A descriptor for a lock; one for reading does as well, in folders that are read-only."""
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError:
        if not path.exists():
            raise
        return os.open(path, os.O_RDONLY)


@contextlib.contextmanager
def reserved(folder: Path, writer: str, *, alone: bool) -> Iterator[None]:
    """Keep a second process from running the same samples.

    Parameters
    ----------
    folder
        The campaign's folder.
    writer
        Name of the share of samples that is run.
    alone
        Whether no other share may run at the same time.

    Raises
    ------
    InputError
        If another process runs them already, or if the folder cannot be written to.
    """
    with contextlib.ExitStack() as held:
        for _ in tries():
            with contextlib.ExitStack() as wanted:
                with writing(folder / f"lock-{writer}", GO_ON):
                    free = wanted.enter_context(locked(folder / "lock", shared=not alone)) and (
                        wanted.enter_context(locked(folder / f"lock-{writer}"))
                    )
                if free:
                    held.enter_context(wanted.pop_all())
                    break
        else:
            raise busy(folder)
        yield


def tries() -> Iterator[int]:
    """Count up, with pauses, for as long as it pays to wait for a lock."""
    for number in range(_LOCK_TRIES):
        yield number
        time.sleep(_LOCK_PAUSE)


def busy(folder: Path) -> InputError:
    """The refusal for a campaign that another process runs."""
    return InputError(
        f"{folder}: another process runs this campaign just now: wait for it, or stop it (ringsim "
        "status tells which it is)"
    )


def in_use(folder: Path, writer: str) -> bool:
    """Whether a process runs a share of a campaign just now."""
    path = folder / f"lock-{writer}"
    if not path.exists():
        return False
    with locked(path, shared=True) as free:
        return not free
