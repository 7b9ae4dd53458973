"""What the journals of a campaign hold of every sample."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ringsim.storage.journal import FOLDER, read_journal, read_record
from ringsim.storage.netcdf import NOT_RUN
from ringsim.storage.result import Result, precedence
from ringsim.variables import Status

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Survey:
    """What a folder holds of every sample."""

    campaign: str
    journals: list[Path]
    status: NDArray[np.int8]
    """Status of each sample, NOT_RUN where there is no result."""
    seconds: NDArray[np.float64]
    """Elapsed time of each sample, NaN where there is no result."""
    form: NDArray[np.int64]
    """Form of each sample's result, an index of ``forms``; -1 where there is no result."""
    forms: list[str]
    """See :class:`Result`."""
    owner: NDArray[np.int64]
    """Journal with the result that counts of each sample, -1 where there is none."""
    place: NDArray[np.int64]
    """Where it begins there."""

    @property
    def missing(self) -> NDArray[np.int64]:
        """Samples without a result."""
        return np.flatnonzero(self.status == NOT_RUN)

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
                    result = read_record(file, int(place), self.campaign)
                    if result is None:
                        raise OSError(f"{self.journals[number]} has been damaged meanwhile")
                    yield result


def survey(folder: Path, campaign: str, samples: int) -> Survey:
    """Look through the journals; see :func:`precedence` for samples that were run twice.

    Records that are damaged, or of a campaign with another identity than ``campaign``, are told in
    a warning of the log.
    """
    journals = sorted((folder / FOLDER).glob("*.journal"))
    status = np.full(samples, NOT_RUN, dtype=np.int8)
    seconds, best = np.full(samples, np.nan), np.full(samples, -np.inf)
    form, owner, place = (np.full(samples, -1, dtype=np.int64) for _ in range(3))
    forms: dict[str, int] = {}
    for number, path in enumerate(journals):
        damaged = 0
        for start, result in read_journal(path, campaign):
            if result is None:
                damaged += 1
                continue
            k, weight = result.sample, float(precedence(result.status, result.finished))
            if 0 <= k < samples and weight > best[k]:
                status[k], seconds[k], best[k] = result.status, result.seconds, weight
                form[k] = forms.setdefault(result.form, len(forms))
                owner[k], place[k] = number, start
        if damaged:
            _log.warning(
                "%s is damaged: %d of its records cannot be used, their samples run again",
                path.name,
                damaged,
            )
    return Survey(campaign, journals, status, seconds, form, list(forms), owner, place)
