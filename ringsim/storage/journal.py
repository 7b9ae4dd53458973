"""Journal of finished samples: each is on file at once, long before its shard is complete."""

from __future__ import annotations

import hashlib
import os
import struct
from collections.abc import Iterator
from pathlib import Path

from ringsim.storage.record import Result, from_header

_FRAME = struct.Struct("<8sIQ16s")
_MAGIC = b"ringsim1"


class Journal:
    """An append-only file with one writer.

    A record is complete or, if the writer was killed within it, recognised as torn and ignored.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.samples = 0
        self.size = 0
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)

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
            os.lseek(self._descriptor, self.size, os.SEEK_SET)
            raise
        self.size += len(record)
        self.samples += 1

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
        size = os.fstat(file.fileno()).st_size
        while True:
            frame = file.read(_FRAME.size)
            if len(frame) < _FRAME.size:
                return
            magic, header_size, body_size, expected = _FRAME.unpack(frame)
            if magic != _MAGIC or file.tell() + header_size + body_size > size:
                return
            header = file.read(header_size)
            if bodies:
                body = file.read(body_size)
                check = hashlib.blake2b(header, digest_size=16)
                check.update(body)
                if check.digest() != expected:
                    return
            else:
                body = b""
                file.seek(body_size, os.SEEK_CUR)
            try:
                result = from_header(header, body)
            except (ValueError, TypeError, KeyError):
                return
            yield result
