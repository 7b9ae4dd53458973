"""Journal of finished samples: each is on file at once, long before its shard is complete."""

from __future__ import annotations

import hashlib
import os
import struct
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ringsim.files import sync
from ringsim.storage.record import Result, from_header

_FRAME = struct.Struct("<8sIQ16s")
_MAGIC = b"ringsim1"
_SYNC_SECONDS = 1.0
"""Records are forced to the disk when this much time has passed since the last time."""


class Journal:
    """An append-only file with one writer.

    A record is complete or, if the writer was killed within it, recognised as torn and ignored.
    The writer reads its records back through its own descriptor: whatever happens to the file's
    name, they are there.

    Parameters
    ----------
    path
        The file; it must not exist.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.samples = 0
        self.size = 0
        self._synced = -_SYNC_SECONDS
        self._descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o666)
        sync(path.parent)

    def append(self, result: Result) -> None:
        """Add one result.

        Raises
        ------
        OSError
            If the disk is full; the records before remain whole.
        """
        header = result.header()
        check = hashlib.blake2b(header, digest_size=16)
        check.update(result.body)
        frame = _FRAME.pack(_MAGIC, len(header), len(result.body), check.digest())
        record = memoryview(b"".join((frame, header, result.body)))
        written = 0
        try:
            while written < len(record):
                written += os.write(self._descriptor, record[written:])
        except OSError:
            os.ftruncate(self._descriptor, self.size)
            raise
        self.size += len(record)
        self.samples += 1
        if time.monotonic() - self._synced >= _SYNC_SECONDS:
            os.fdatasync(self._descriptor)
            self._synced = time.monotonic()

    def records(self) -> Iterator[Result]:
        """What has been added so far."""
        with os.fdopen(os.dup(self._descriptor), "rb") as file:
            file.seek(0)
            yield from _records(file, bodies=True)

    def close(self) -> None:
        """Close the file and leave it."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1

    def remove(self) -> None:
        """Close and delete the file: its samples are in a shard now."""
        self.close()
        self.path.unlink(missing_ok=True)


def read_journal(path: Path, *, bodies: bool = True) -> Iterator[Result]:
    """The whole records of a journal in the order in which they were written.

    Parameters
    ----------
    path
        The file; it may still be growing.
    bodies
        Also read the arrays; without them only a torn header is noticed.
    """
    try:
        file = path.open("rb")
    except FileNotFoundError:
        return
    with file:
        yield from _records(file, bodies=bodies)


def _records(file: BinaryIO, *, bodies: bool) -> Iterator[Result]:
    """Records whose checksum is right; one that is damaged does not hide those behind it."""
    size = os.fstat(file.fileno()).st_size
    while True:
        frame = file.read(_FRAME.size)
        if len(frame) < _FRAME.size:
            return
        magic, header_size, body_size, expected = _FRAME.unpack(frame)
        if magic != _MAGIC or file.tell() + header_size + body_size > size:
            return
        header = file.read(header_size)
        body = b""
        if bodies:
            body = file.read(body_size)
            check = hashlib.blake2b(header, digest_size=16)
            check.update(body)
            if check.digest() != expected:
                continue
        else:
            file.seek(body_size, os.SEEK_CUR)
        try:
            result = from_header(header, body)
        except (ValueError, TypeError, KeyError):
            continue
        yield result
