"""A process's own corner of a campaign's folder: its journal, and the shards it makes of it."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ringsim.files import DRAFT, writing
from ringsim.storage.journal import Journal, read_journal
from ringsim.storage.layout import NOT_RUN
from ringsim.storage.locks import GO_ON, locked
from ringsim.storage.record import Result, precedence
from ringsim.storage.shards import FOLDER, Shard, latest, read_shards, write_shards
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
        Share of the samples that this process runs, and its number among those that run it.
    shard_samples
        Samples in a shard, at most; large results make shards with fewer.
    """

    def __init__(self, folder: Path, campaign: str, writer: str, shard_samples: int) -> None:
        self._shard_samples = shard_samples
        self._folder, self._campaign = folder, campaign
        # No two processes share a journal, even where the file system has no locks.
        self._path = folder / JOURNALS / f"{writer}-{secrets.token_hex(4)}.journal"
        self._journal: Journal | None = None

    def keep(self, result: Result) -> None:
        """Store one result.

        Raises
        ------
        InputError
            If the disk is full; what was stored before remains.
        """
        with writing(self._path, GO_ON):
            if self._journal is None:
                self._journal = Journal(self._path)
            self._journal.append(result)
            if self._journal.samples >= self._shard_samples or self._journal.size >= SHARD_BYTES:
                self._seal()

    def close(self) -> None:
        """Turn what is in the journal into a shard.

        Raises
        ------
        InputError
            If the disk is full; the journal remains, and the next run takes it up.
        """
        with writing(self._path, GO_ON):
            self._seal()

    def _seal(self) -> None:
        if self._journal is None:
            return
        write_shards(self._folder, self._journal.records(), self._campaign)
        self._journal.remove()
        self._journal = None


def create_folders(folder: Path) -> None:
    """Create a campaign's folder and what is in it."""
    for name in (FOLDER, JOURNALS):
        (folder / name).mkdir(parents=True, exist_ok=True)


def recover(folder: Path, campaign: str, share: str) -> None:
    """Make shards of the journals that killed writers left behind.

    Parameters
    ----------
    folder
        The campaign's folder.
    campaign
        Identity of the campaign.
    share
        The share of samples that the caller has reserved, empty if it is alone in the folder;
        journals of other shares are taken up where nobody runs them.

    Raises
    ------
    InputError
        If the disk is full.
    """
    if not share:
        for draft in (folder / FOLDER).glob(f".*{DRAFT}"):
            draft.unlink(missing_ok=True)
    for path in sorted((folder / JOURNALS).glob("*.journal")):
        owner = path.name.rpartition("-rank")[0]
        with writing(path, GO_ON):
            if share in ("", owner):
                _adopt(path, folder, campaign)
                continue
            with locked(folder / f"lock-{owner}", unsure=False) as free:
                if free:
                    _adopt(path, folder, campaign)


def _adopt(path: Path, folder: Path, campaign: str) -> None:
    write_shards(folder, read_journal(path), campaign)
    path.unlink(missing_ok=True)


@dataclass(frozen=True)
class Survey:
    """What a folder holds of every sample.

    Attributes
    ----------
    status
        Status of each sample, NOT_RUN where there is no result.
    seconds
        Elapsed time of each sample, NaN where there is no result.
    sealed
        Whether the result of each sample is in a shard, not only in a journal.
    shards
        The whole shards.
    """

    status: NDArray[np.int8]
    seconds: NDArray[np.float64]
    sealed: NDArray[np.bool_]
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
    """Look through shards and journals; see :func:`precedence` for samples that were run twice.

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
    seconds, best = np.full(samples, np.nan), np.full(samples, -np.inf)
    # Journals first: one that becomes a shard meanwhile is met twice rather than never.
    journalled = [
        replace(result, log="")
        for path in sorted((folder / JOURNALS).glob("*.journal"))
        for result in read_journal(path, bodies=False)
        if 0 <= result.sample < samples
    ]
    shards = read_shards(folder, campaign, set_aside=set_aside)
    owner, row = latest(shards, samples)
    for number, shard in enumerate(shards):
        ids = np.flatnonzero(owner == number)
        rows = row[ids]
        status[ids], seconds[ids] = shard.status[rows], shard.seconds[rows]
        best[ids] = precedence(shard.status[rows], shard.finished[rows])
    for result in journalled:
        weight = float(precedence(result.status, result.finished))
        if weight > best[result.sample]:
            status[result.sample], seconds[result.sample] = result.status, result.seconds
            best[result.sample] = weight
    return Survey(status, seconds, owner >= 0, shards)
