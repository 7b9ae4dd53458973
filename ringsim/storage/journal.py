"""Journals: every finished sample is in a file at once, one file for each process."""

import contextlib
import hashlib
import json
import logging
import os
import secrets
import struct
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from ringsim.files import DESIGN, sync, whole, writing
from ringsim.refusal import InputError
from ringsim.storage.netcdf import GO_ON
from ringsim.storage.result import Result
from ringsim.tables import counted
from ringsim.variables import NO_CODE, Fate, Status

# What was verified of the journals, so that nobody computes their checksums again.
#
# A journal only grows.  As long as one has the size and the time of change that it had, what was
# read of it holds; if it is longer, what was read before holds and the rest is read.


NAME = "journals-verified.npz"
RECORD = np.dtype(
    [
        ("place", "i8"), ("sample", "i8"), ("status", "i1"), ("fate", "i1"), ("seconds", "f8"),
        ("finished", "f8"), ("form", "S16"), ("run_with", "S16"),
    ]
)  # fmt: skip
"""What is remembered of a whole record; its form is one of ``ringsim.storage.result.pack``."""
_REMEMBERED = tuple(name for name in RECORD.names or () if name != "place")


@dataclass(frozen=True)
class Verified:
    """The records of one journal, up to the byte ``end``."""

    records: NDArray[np.void] = field(default_factory=lambda: np.empty(0, RECORD))
    size: int = 0
    changed: int = -1
    """When the journal was changed last, ns since 1970."""
    end: int = 0
    damaged: int = 0
    """Gaps between records that are no records."""


def recall(folder: Path) -> dict[str, Verified]:
    """What was verified in a campaign's folder, by name of journal."""
    if not (folder / NAME).is_file():  # to open a pipe would wait for its writer
        return {}
    # Lost or damaged it costs the time to read the journals, so that no fault of it counts.
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError, EOFError, BadZipFile):
        with (folder / NAME).open("rb") as opened, np.load(opened, allow_pickle=False) as file:
            if file["records"].dtype != RECORD:
                return {}
            names, numbers = file["names"].tolist(), file["numbers"]
            parts = np.split(file["records"], np.cumsum(numbers[:, 4])[:-1])
        rows = zip(names, numbers[:, :4].tolist(), parts, strict=True)
        return {name: Verified(part, *row) for name, row, part in rows}
    return {}


def remember(folder: Path, found: dict[str, Verified]) -> None:
    """Write it; never fail because of it, since folders may be read-only."""
    numbers = [(v.size, v.changed, v.end, v.damaged, len(v.records)) for v in found.values()]
    records = np.concatenate([np.empty(0, RECORD), *(v.records for v in found.values())])
    with (
        contextlib.suppress(OSError),
        whole(folder / NAME, lasting=False) as draft,
        draft.open("wb") as file,
    ):
        np.savez(file, names=list(found), numbers=numbers, records=records)


def forget(folder: Path) -> None:
    """Let the next look at the journals read all of them again."""
    with contextlib.suppress(OSError):
        (folder / NAME).unlink(missing_ok=True)


# Journals: every finished sample is in a file at once, one file for each process.


FOLDER = "journals"
_log = logging.getLogger(__name__)
_FRAME = struct.Struct("<8sIQ16s")
_MAGIC = b"ringsim3"
_SYNC_SECONDS = 1.0
"""Records are forced to the disk when this much time has passed since the last time: for samples
longer than that each is, for shorter ones it would cost more than the run."""
_READ_BYTES = 1 << 20
_AT_ONCE = 10_000
"""Records that are held one by one until they become rows of an array, which take a tenth."""


class DamagedError(InputError):
    """A record that was whole is no longer; the next survey finds which ones are."""


class Journal:
    """An append-only file with one writer.

    A record is complete or, if the writer was killed within it, recognised as torn and ignored.
    ``writer`` names the share and the rank.
    """

    def __init__(self, folder: Path, writer: str) -> None:
        # No two processes share a journal, even where the file system has no locks.
        self.path = folder / FOLDER / f"{writer}-{secrets.token_hex(4)}.journal"
        self._descriptor, self._size, self._synced = -1, 0, -_SYNC_SECONDS

    def append(self, result: Result) -> None:
        """Add a result; InputError if the disk is full, and the records before remain whole."""
        header, body = result.header(), result.body
        check = checksum(header, body)
        frame = _FRAME.pack(_MAGIC, len(header), len(body), check)
        record = memoryview(frame + header + body)
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


def read_journal(path: Path, place: int = 0) -> Iterator[tuple[int, int, Result | None]]:
    """The records of a journal in their order from a place on, each with its place and its end.

    None stands for bytes between two records that are no record.  What a writer
    left unfinished at the end is left out: the file may still be growing.
    """
    for begin, end, content in _records(path, place):
        yield begin, end, None if content is None else Result.from_header(*content)


_Content = tuple[bytes, bytes]
"""Header and body of a record."""


def _records(path: Path, place: int) -> Iterator[tuple[int, int, _Content | None]]:
    """As :func:`read_journal`, with the bytes of the records."""
    with path.open("rb", buffering=_READ_BYTES) as file:
        size = os.fstat(file.fileno()).st_size
        file.seek(place)
        while place < size:
            if (content := _read_content(file, size - place)) is not None:
                end = file.tell()
                yield place, end, content
                place = end
                continue
            file.seek(place + 1)
            # Beyond that size a writer may have gone on since: it has not left a gap.
            if (gap := file.read(size - place - 1).find(_MAGIC)) < 0:
                return
            yield place, place + 1 + gap, None
            place += 1 + gap
            file.seek(place)


def _read_content(file: BinaryIO, left: int) -> _Content | None:
    """The record that begins where a file stands, ``left`` bytes before its end; None if there is
    no whole one.
    """
    frame = file.read(_FRAME.size)
    if len(frame) < _FRAME.size:
        return None
    magic, header_size, body_size, expected = _FRAME.unpack(frame)
    # A damaged size must not be believed: it may be more than there is memory.
    if magic != _MAGIC or _FRAME.size + header_size + body_size > left:
        return None
    header, body = file.read(header_size), file.read(body_size)
    return (header, body) if checksum(header, body) == expected else None


def _read_record(file: BinaryIO, place: int) -> Result | None:
    """The record that begins at a place of a journal; None if there is no whole one."""
    file.seek(place)
    content = _read_content(file, os.fstat(file.fileno()).st_size - place)
    return None if content is None else Result.from_header(*content)


def checksum(header: bytes, body: bytes) -> bytes:
    """Of one record, 16 bytes."""
    found = hashlib.blake2b(header, digest_size=16)
    found.update(body)
    return found.digest()


@dataclass(frozen=True)
class Survey:
    """What a folder holds of every sample."""

    journals: list[Path]
    status: NDArray[np.int8]
    """Status of each sample, NO_CODE where there is no result."""
    fate: NDArray[np.int8]
    """What the antenna did in each sample; NONE where nobody knows."""
    seconds: NDArray[np.float64]
    """Elapsed time of each sample, NaN where there is no result."""
    form: NDArray[np.int64]
    """Number of the form of each sample's result; -1 where there is no result."""
    owner: NDArray[np.int64]
    """Journal with the result that counts of each sample, -1 where there is none."""
    place: NDArray[np.int64]
    attempts: NDArray[np.int64]
    """Results of each sample in all journals, also those that do not count."""

    @property
    def missing(self) -> NDArray[np.int64]:
        """Samples without a result."""
        return np.flatnonzero(self.status == NO_CODE)

    @property
    def failed(self) -> NDArray[np.int64]:
        """Samples whose run failed."""
        return np.flatnonzero(self.status >= Status.SOLVER_FAILED)

    def results(self, samples: Sequence[int] | NDArray[np.int64]) -> Iterator[Result]:
        """The results that count of some samples, in any order; nothing of missing ones."""
        owner = self.owner[samples]
        for number in np.unique(owner[owner >= 0]):
            with self.journals[number].open("rb") as file:
                for place in np.sort(self.place[samples][owner == number]):
                    if (result := _read_record(file, int(place))) is None:
                        forget(self.journals[number].parents[1])
                        raise DamagedError(
                            f"{self.journals[number]} was damaged while it was read: run the "
                            "same command again"
                        )
                    yield result


def survey(folder: Path, run_with: Sequence[str], *, checks: bool = False) -> Survey:
    """Look through the journals of a campaign's folder, for samples or for their ``checks``.

    ``run_with`` tells for each sample what its records must say that it was run with; InputError
    if one says something else, as those of another campaign do.

    Of several results of one sample, one that went well counts before one that failed, whatever
    the clocks said; otherwise the later one does.  A warning in the log tells of records that are
    damaged.  What was verified once is remembered in the folder.
    """
    journals = sorted((folder / FOLDER).glob("*.journal"))
    if no_files := [path for path in journals if not path.is_file()]:
        raise InputError(
            f"{no_files[0]}: must be a journal of the campaign, and is no file: put the file back, "
            "or remove this: the samples that it held run again"
        )
    before = recall(folder)
    known = {path.name: _verified(path, before.get(path.name)) for path in journals}
    if any(known[name] is not before.get(name) for name in known):
        remember(folder, known)
    for name, found in known.items():
        if found.damaged:
            told = "%s is damaged: %d of its results cannot be read, and their samples run again"
            _log.warning(told, name, found.damaged)
    records = np.concatenate([np.empty(0, RECORD), *(each.records for each in known.values())])
    counts = np.array([len(each.records) for each in known.values()], dtype=np.int64)
    owner = np.repeat(np.arange(len(known)), counts)
    samples, expected = len(run_with), np.array(run_with, dtype=RECORD["run_with"])
    number = ~records["sample"] if checks else records["sample"]  # see result.check_of
    inside = (number >= 0) & (number < samples)
    records, owner, number = records[inside], owner[inside], number[inside]
    if len(strange := np.flatnonzero(records["run_with"] != expected[number])):
        first = strange[np.argmin(number[strange])]
        raise InputError(
            f"{journals[owner[first]]}: its record of sample {number[first]} was run with other "
            f"inputs than {DESIGN} of this folder gives, or with another scene or build "
            f"({counted(len(strange), 'record')} of other runs here): take that file out of the "
            f"folder, or bring back the {DESIGN} that it was run with"
        )
    # No clock is 1e12 s (30,000 years) wrong.
    weight = records["finished"] + 1e12 * (records["status"] < Status.SOLVER_FAILED)
    order = np.lexsort((-np.arange(len(records)), weight, number))
    which, attempts = np.unique(number, return_counts=True)
    best = order[np.cumsum(attempts) - 1]  # the last of each sample's

    def of_each(values: NDArray[Any], missing: Any) -> NDArray[Any]:
        found = np.full(samples, missing, dtype=values.dtype)
        found[which] = values
        return found

    return Survey(
        journals,
        status=of_each(records["status"][best], NO_CODE),
        fate=of_each(records["fate"][best], Fate.NONE),
        seconds=of_each(records["seconds"][best], np.nan),
        form=of_each(np.unique(records["form"][best], return_inverse=True)[1], -1),
        owner=of_each(owner[best], -1), place=of_each(records["place"][best], -1),
        attempts=of_each(attempts, 0),
    )  # fmt: skip


def _verified(path: Path, before: Verified | None) -> Verified:
    """The records of a journal: those that were verified before, and what has come since."""
    now, old = path.stat(), before or Verified()
    if (now.st_size, now.st_mtime_ns) == (old.size, old.changed):
        return old
    if now.st_size <= old.size:  # it has not grown: somebody else wrote to it
        old = Verified()
    end, damaged, parts, new = old.end, old.damaged, [old.records], list[tuple[Any, ...]]()
    for place, after, content in _records(path, old.end):
        end = after
        if content is None:
            damaged += 1
            continue
        new.append((place, *_told(content[0])))
        if len(new) == _AT_ONCE:
            parts.append(np.array(new, dtype=RECORD))
            new.clear()
    records = np.concatenate([*parts, np.array(new, dtype=RECORD)])
    return Verified(records, now.st_size, now.st_mtime_ns, end, damaged)


def _told(header: bytes) -> tuple[Any, ...]:
    """What is remembered of a record beside its place; a whole result takes thrice as long."""
    table = json.loads(header.decode())
    return tuple(map(table.__getitem__, _REMEMBERED))
