"""A process's own corner of a campaign's folder: its journal, and the shards it makes of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ringsim.storage.files import unwritable
from ringsim.storage.journal import Journal, read_journal
from ringsim.storage.layout import NOT_RUN
from ringsim.storage.record import Result
from ringsim.storage.shards import FOLDER, Shard, read_shards, write_shard
from ringsim.variables import Status

JOURNALS = "journals"
SHARD_BYTES = 16 << 20


class Store:
    """Keeps results: at once in a journal, many together in a shard.

    Parameters
    ----------
    folder
        The campaign's folder.
    campaign
        Identity of the campaign.
    writer
        Name of this process among those that write to the folder.
    shard_samples
        Samples in a shard, at most; large results make shards with fewer.
    """

    def __init__(self, folder: Path, campaign: str, writer: str, shard_samples: int) -> None:
        self._shard_samples = shard_samples
        self._folder, self._campaign = folder, campaign
        self._path = folder / JOURNALS / f"{writer}.journal"
        self._journal: Journal | None = None

    def keep(self, result: Result) -> None:
        """Store one result.

        Raises
        ------
        InputError
            If the disk is full; what was stored before remains.
        """
        try:
            if self._journal is None:
                self._journal = Journal(self._path)
            self._journal.append(result)
            if self._journal.samples >= self._shard_samples or self._journal.size >= SHARD_BYTES:
                self._seal()
        except OSError as error:
            raise unwritable(self._path, error) from error

    def close(self) -> None:
        """Turn what is in the journal into a shard.

        Raises
        ------
        InputError
            If the disk is full; the journal remains, and the next run takes it up.
        """
        try:
            self._seal()
        except OSError as error:
            raise unwritable(self._path, error) from error

    def _seal(self) -> None:
        if self._journal is None:
            return
        write_shard(self._folder, read_journal(self._path), self._campaign)
        self._journal.remove()
        self._journal = None


def create_folders(folder: Path) -> None:
    """Create a campaign's folder and what is in it."""
    for name in (FOLDER, JOURNALS):
        (folder / name).mkdir(parents=True, exist_ok=True)


def recover(folder: Path, campaign: str, prefix: str) -> None:
    """Make shards of the journals that killed writers left behind.

    Parameters
    ----------
    folder
        The campaign's folder.
    campaign
        Identity of the campaign.
    prefix
        Start of the writers' names; none of them may be running.

    Raises
    ------
    InputError
        If the disk is full.
    """
    for draft in (folder / FOLDER).glob(".*.draft"):
        if not prefix:
            draft.unlink(missing_ok=True)
    for path in sorted((folder / JOURNALS).glob(f"{prefix}*.journal")):
        try:
            write_shard(folder, read_journal(path), campaign)
            path.unlink(missing_ok=True)
        except OSError as error:
            raise unwritable(path, error) from error


@dataclass(frozen=True)
class Survey:
    """What a folder holds of every sample.

    Attributes
    ----------
    status
        Status of each sample, NOT_RUN where there is no result.
    seconds
        Elapsed time of each sample, NaN where there is no result.
    shards
        The whole shards.
    """

    status: NDArray[np.int8]
    seconds: NDArray[np.float64]
    shards: list[Shard]

    @property
    def missing(self) -> NDArray[np.int64]:
        """Samples without a result."""
        return np.flatnonzero(self.status == NOT_RUN)

    @property
    def failed(self) -> NDArray[np.int64]:
        """Samples whose run failed."""
        return np.flatnonzero(self.status >= Status.SOLVER_FAILED)


def survey(folder: Path, campaign: str, samples: int, *, set_aside: bool) -> Survey:
    """Look through shards and journals; of a sample that was run twice the later result counts.

    Parameters
    ----------
    folder
        The campaign's folder.
    campaign
        Identity of the campaign.
    samples
        Number of samples in its design.
    set_aside
        Move broken shards out of the way.
    """
    status = np.full(samples, NOT_RUN, dtype=np.int8)
    seconds, when = np.full(samples, np.nan), np.full(samples, -np.inf)
    shards = read_shards(folder, campaign, set_aside=set_aside)
    for shard in shards:
        rows = np.flatnonzero(shard.samples < samples)
        rows = rows[shard.finished[rows] > when[shard.samples[rows]]]
        ids = shard.samples[rows]
        status[ids], seconds[ids] = shard.status[rows], shard.seconds[rows]
        when[ids] = shard.finished[rows]
    for path in sorted((folder / JOURNALS).glob("*.journal")):
        for result in read_journal(path, bodies=False):
            if result.sample < samples and result.finished > when[result.sample]:
                status[result.sample], seconds[result.sample] = result.status, result.seconds
                when[result.sample] = result.finished
    return Survey(status, seconds, shards)
