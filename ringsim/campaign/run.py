"""Running a campaign: prepare its folder, run what is missing, merge."""

from __future__ import annotations

import contextlib
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ringsim.campaign.folder import Folder, open_folder
from ringsim.campaign.watch import Progress, Stop, stopping_on_signals
from ringsim.execution.cost import longest_first, relative_cost
from ringsim.execution.launch import polite_barrier
from ringsim.execution.work import Limits, Scheduler, Work
from ringsim.refusal import InputError
from ringsim.storage.files import reserved, unwritable
from ringsim.storage.merge import NAME as MERGED
from ringsim.storage.merge import merge_shards
from ringsim.storage.provenance import provenance
from ringsim.storage.record import Result
from ringsim.storage.store import Store, Survey, recover, survey

DONE, TOO_MANY_FAILED, INTERRUPTED = 0, 3, 130


@dataclass(frozen=True)
class Part:
    """A share of a campaign's samples: every ``count``-th one, starting at ``number`` - 1."""

    number: int = 1
    count: int = 1

    @property
    def whole(self) -> bool:
        """Whether it is all samples."""
        return self.count == 1

    @property
    def writer(self) -> str:
        """Start of the names of files that belong to this share alone."""
        return "all" if self.whole else f"part{self.number}of{self.count}"

    def holds(self, samples: Any) -> Any:
        """Which of the samples belong to the share."""
        return samples % self.count == self.number - 1


@dataclass(frozen=True)
class Choices:
    """How a campaign is to be run this time.

    Attributes
    ----------
    scheduler
        Who computes.
    workers
        Samples that run at the same time.
    limits
        Bounds on each run.
    max_failed
        Failures that are put up with, in the whole campaign; None for any number.
    part
        The share of this process.
    retry_failed
        Run the failed samples again.
    communicator
        From mpi4py, if several ranks run this campaign together.
    description
        Who computes, in words, for the merged file.
    """

    scheduler: Scheduler
    workers: int
    limits: Limits
    max_failed: int | None = None
    part: Part = Part()
    retry_failed: bool = False
    communicator: Any = None
    description: str = ""

    @property
    def rank(self) -> int:
        """Number of this process among those that run the campaign together."""
        return 0 if self.communicator is None else int(self.communicator.Get_rank())


def run_campaign(folder: Path, choices: Choices) -> int:
    """Run the missing samples of a prepared folder, on every rank that takes part.

    Returns
    -------
    int
        Exit code: 0 all samples have run, 3 too many (or all) of them failed, 130 stopped by a
        signal.

    Raises
    ------
    InputError
        If the folder is in use or cannot be written.
    """
    with contextlib.ExitStack() as held:
        fault = ""
        if choices.rank == 0:
            try:
                held.enter_context(reserved(folder, choices.part.writer, alone=choices.part.whole))
                prefix = "" if choices.part.whole else f"{choices.part.writer}-"
                recover(folder, open_folder(folder).identity, prefix)
            except InputError as error:
                fault = str(error)
        if choices.communicator is not None:
            fault = choices.communicator.bcast(fault)
        if fault:
            raise InputError(fault)
        return _run_prepared(open_folder(folder), choices)


def _run_prepared(campaign: Folder, choices: Choices) -> int:
    writer = f"{choices.part.writer}-rank{choices.rank}"
    store = Store(campaign.path, campaign.identity, writer, campaign.output.shard_samples)
    before = _survey(campaign, choices)
    with stopping_on_signals() as stop:
        progress = _progress(campaign, choices, before) if before is not None else None
        reason = fault = ""
        try:
            reason = choices.scheduler.run(
                _to_run(campaign, choices, before), _work(campaign, choices, store, stop, progress)
            )
        except InputError as error:
            fault = str(error)
        try:
            store.close()
        except InputError as error:
            fault = fault or str(error)
        if choices.communicator is not None:
            polite_barrier(choices.communicator)
            faults = choices.communicator.allgather(fault)
            fault = next((each for each in faults if each), "")
        if progress is not None:
            progress.close("failed" if fault else "stopped" if reason else "finished")
    if fault:
        raise InputError(fault)
    if choices.rank != 0:
        return DONE
    return _conclude(campaign, choices, reason, stop)


def _survey(campaign: Folder, choices: Choices) -> Survey | None:
    if choices.rank != 0:
        return None
    return survey(
        campaign.path, campaign.identity, campaign.table.samples, set_aside=choices.part.whole
    )


def _to_run(campaign: Folder, choices: Choices, before: Survey | None) -> list[int]:
    if before is None:
        return []
    samples = before.missing
    if choices.retry_failed:
        samples = np.union1d(samples, before.failed)
    samples = samples[choices.part.holds(samples)]
    return longest_first(samples, relative_cost(campaign.table, campaign.scene))


def _progress(campaign: Folder, choices: Choices, before: Survey) -> Progress:
    mine = np.arange(campaign.table.samples)
    mine = mine[choices.part.holds(mine)]
    missing, failed = (np.intersect1d(mine, those) for those in (before.missing, before.failed))
    if choices.retry_failed:
        missing, failed = np.union1d(missing, failed), failed[:0]
    return Progress(
        path=campaign.path / f"progress-{choices.part.writer}.json",
        name=campaign.attributes["campaign_name"],
        total=len(mine),
        done=len(mine) - len(missing),
        failed=len(failed),
        workers=choices.workers,
    )


def _work(
    campaign: Folder, choices: Choices, store: Store, stop: Stop, progress: Progress | None
) -> Work:
    most = choices.max_failed

    def check_budget() -> None:
        if progress is not None and most is not None and progress.failed > most:
            stop.reason = (
                stop.reason or f"{progress.failed} samples failed, more than max_failed = {most}"
            )

    def finished(result: Result) -> None:
        if progress is not None:
            progress.finished(result)
            check_budget()

    check_budget()
    return Work(
        solver=campaign.solver,
        scene=campaign.scene.to_table(),
        values_of=campaign.table.values_of,
        limits=choices.limits,
        retry=campaign.retry,
        keep=store.keep,
        started=progress.started if progress is not None else lambda sample: None,
        finished=finished,
        stop=stop.asked,
    )


def _conclude(campaign: Folder, choices: Choices, reason: str, stop: Stop) -> int:
    after = _survey(campaign, choices)
    if after is None:
        raise RuntimeError("only rank 0 concludes a campaign")
    left, failed = len(after.missing), len(after.failed)
    if left == 0:
        path = merge(campaign, after, execution=choices.description)
        print(f"{path}: {campaign.table.samples} samples, {failed} failed", file=sys.stderr)
    elif reason:
        print(
            f"{reason}; {left} samples are left: the same command goes on with them",
            file=sys.stderr,
        )
    else:
        print(f"this part is done; {left} samples of other parts are left", file=sys.stderr)
    if stop.signalled and left:
        return INTERRUPTED
    if reason or failed == campaign.table.samples:
        return TOO_MANY_FAILED
    return DONE


def merge(campaign: Folder, found: Survey, *, execution: str) -> Path:
    """Write ``campaign.nc`` from the shards of a folder.

    Parameters
    ----------
    campaign
        The folder.
    found
        What it holds.
    execution
        Who computed it, in words.

    Raises
    ------
    InputError
        If the shards do not fit together, or the disk is full.
    """
    kept = (
        "identity", "seed", "solver", "campaign", "campaign_name", "scene", "output",
    )  # fmt: skip
    attributes = provenance(
        name=campaign.attributes["campaign_name"],
        title=campaign.attributes["title"],
        action="merged",
    )
    attributes |= {name: campaign.attributes[name] for name in kept if name in campaign.attributes}
    attributes["execution"] = execution
    attributes["history"] += f"\n{campaign.attributes['history']}"
    try:
        return merge_shards(
            campaign.path, found.shards, campaign.table, campaign.output, attributes
        )
    except OSError as error:
        raise unwritable(campaign.path / MERGED, error) from error
