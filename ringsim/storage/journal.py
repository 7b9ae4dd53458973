"""Journals: every finished sample is in a file at once, one file for each process."""

from __future__ import annotations

import hashlib
import os
import secrets
import struct
import time
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ringsim.files import sync, writing
from ringsim.storage.locks import GO_ON
from ringsim.storage.result import Result

FOLDER = "journals"
_FRAME = struct.Struct("<8sIQ16s")
_MAGIC = b"ringsim2"
_SYNC_SECONDS = 1.0
"""Records are forced to the disk when this much time has passed since the last time: for samples
longer than that each is, for shorter ones it would cost more than the run."""


class Journal:
    """An append-only file with one writer.

    A record is complete or, if the writer was killed within it, recognised as torn and ignored.
    Its checksum is right for this campaign only.  The writer is named after its share of the
    samples, and its number among the processes that run it.
    """

    def __init__(self, folder: Path, campaign: str, writer: str) -> None:
        # No two processes share a journal, even where the file system has no locks.
        self.path = folder / FOLDER / f"{writer}-{secrets.token_hex(4)}.journal"
        self._campaign = campaign
        self._descriptor = -1
        self._size = 0
        self._synced = -_SYNC_SECONDS

    def append(self, result: Result) -> None:
        """Add one result; the first one creates the file.

        InputError if the disk is full; the records before remain whole.
        """
        header, body = result.header(), result.body
        check = _checksum(header, body, self._campaign)
        frame = _FRAME.pack(_MAGIC, len(header), len(body), check)
        record = memoryview(b"".join((frame, header, body)))
        with writing(self.path, GO_ON):
            if self._descriptor < 0:
                flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND
                self._descriptor = os.open(self.path, flags, 0o666)
                sync(self.path.parent)
            written = 0
            try:
                while written < len(record):
                    written += os.write(self._descriptor, record[written:])
            except OSError:
                os.ftruncate(self._descriptor, self._size)
                raise
            self._size += len(record)
            if time.monotonic() - self._synced >= _SYNC_SECONDS:
                self._sync()

    def close(self) -> None:
        """Force everything to the disk (InputError if it refuses) and leave the file."""
        if self._descriptor >= 0:
            with writing(self.path, GO_ON):
                self._sync()
                os.close(self._descriptor)
            self._descriptor = -1

    def _sync(self) -> None:
        os.fdatasync(self._descriptor)
        self._synced = time.monotonic()


def read_journal(path: Path, campaign: str) -> Iterator[tuple[int, Result | None]]:
    """The records of a journal in the order in which they were written, with their places.

    None stands for bytes between two records that are no record of this campaign: one that is
    damaged does not hide those behind it.  What a writer left unfinished at the end is left out:
    the file may still be growing.
    """
    with path.open("rb") as file:
        place, size = 0, os.fstat(file.fileno()).st_size
        while place < size:
            result = read_record(file, place, campaign)
            if result is not None:
                yield place, result
                place = file.tell()
                continue
            file.seek(place + 1)
            gap = file.read().find(_MAGIC)
            if gap < 0:
                return
            yield place, None
            place += 1 + gap


def read_record(file: BinaryIO, place: int, campaign: str) -> Result | None:
    """The record that begins at a place of a journal; None if there is no whole one."""
    file.seek(place)
    frame = file.read(_FRAME.size)
    if len(frame) < _FRAME.size:
        return None
    magic, header_size, body_size, expected = _FRAME.unpack(frame)
    # A damaged size must not be believed: it may be more than there is memory.
    if magic != _MAGIC or file.tell() + header_size + body_size > os.fstat(file.fileno()).st_size:
        return None
    header, body = file.read(header_size), file.read(body_size)
    if _checksum(header, body, campaign) != expected:
        return None
    return Result.from_header(header, body)


def _checksum(header: bytes, body: bytes, campaign: str) -> bytes:
    check = hashlib.blake2b(header, digest_size=16, key=campaign.encode())
    check.update(body)
    return check.digest()
