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
def locked(path: Path, *, shared: bool = False) -> Iterator[bool]:
    """Hold an advisory lock; gives False at once if another process holds it.

    On file systems without locks everybody gets it.
    """
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    try:
        try:
            fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
            held = True
        except BlockingIOError:
            held = False
        except OSError:
            held = True
        yield held
    finally:
        os.close(descriptor)


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
        If another process runs them already.
    """
    for _ in range(_LOCK_TRIES):
        with contextlib.ExitStack() as held:
            if held.enter_context(locked(folder / "lock", shared=not alone)) and (
                held.enter_context(locked(folder / f"lock-{writer}"))
            ):
                yield
                return
        time.sleep(_LOCK_PAUSE)
    raise InputError(
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
