"""Files that appear whole or not at all, and locks on folders."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import secrets
import time
from collections.abc import Iterator
from pathlib import Path

from ringsim.refusal import InputError

DRAFT = ".draft"
_LOCK_TRIES, _LOCK_PAUSE = 10, 0.1


@contextlib.contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A draft to write to; it gets its name once it is complete and on the disk.

    Parameters
    ----------
    path
        The final name; an older file of that name is replaced.
    """
    draft = path.with_name(f".{path.name}.{secrets.token_hex(4)}{DRAFT}")
    try:
        yield draft
        sync(draft)
        os.replace(draft, path)
        sync(path.parent)
    finally:
        draft.unlink(missing_ok=True)


def sync(path: Path) -> None:
    """Make the operating system write a file or folder to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def digest(path: Path) -> str:
    """BLAKE2 checksum of a file's bytes, 32 hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=16)).hexdigest()


@contextlib.contextmanager
def locked(path: Path, *, shared: bool = False, unsure: bool = True) -> Iterator[bool]:
    """Hold an advisory lock; gives False at once if another process holds it.

    Parameters
    ----------
    path
        The file that carries the lock; created if it is not there.
    shared
        Whether others may hold it at the same time, shared as well.
    unsure
        What is given on a file system without locks.

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
            held = unsure
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
                try:
                    free = wanted.enter_context(locked(folder / "lock", shared=not alone)) and (
                        wanted.enter_context(locked(folder / f"lock-{writer}"))
                    )
                except OSError as error:
                    raise unwritable(folder / f"lock-{writer}", error) from error
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


def unwritable(path: Path, error: BaseException) -> InputError:
    """The refusal for a file that cannot be written, with the cure."""
    reason = getattr(error, "strerror", None) or str(error)
    return InputError(
        f"{path}: cannot be written: {reason}; make room or choose another folder, then give the "
        "same command again: finished samples are kept"
    )
