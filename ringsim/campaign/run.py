"""Running a campaign: prepare its folder, run what is missing, merge."""

from __future__ import annotations

import contextlib
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ringsim.analysis.error_budget import budget_lines, error_budget
from ringsim.analysis.restarts import restart_lines
from ringsim.campaign.folder import Folder, open_folder
from ringsim.campaign.merging import merge
from ringsim.campaign.watch import Progress, Stop, stopping_on_signals
from ringsim.execution.cost import longest_first, relative_cost
from ringsim.execution.launch import polite_barrier
from ringsim.execution.work import Limits, Scheduler, Work
from ringsim.exit_codes import EXIT_DONE, EXIT_FAILED, EXIT_INTERRUPTED
from ringsim.refusal import InputError
from ringsim.storage.locks import reserved
from ringsim.storage.record import Result
from ringsim.storage.store import Store, Survey, recover, survey


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
        signal, or samples are left.

    Raises
    ------
    InputError
        If the folder is in use or cannot be written.
    """
    with contextlib.ExitStack() as held:
        stop, fault = held.enter_context(stopping_on_signals()), ""
        if choices.rank == 0:
            try:
                held.enter_context(reserved(folder, choices.part.writer, alone=choices.part.whole))
                share = "" if choices.part.whole else choices.part.writer
                recover(folder, open_folder(folder).identity, share)
            except InputError as error:
                fault = str(error)
        if choices.communicator is not None:
            fault = choices.communicator.bcast(fault)
        if fault:
            raise InputError(fault)
        campaign = open_folder(folder)
        _run_missing(campaign, choices, stop)
        try:
            return _conclude(campaign, choices, stop) if choices.rank == 0 else EXIT_DONE
        finally:
            # Until rank 0 has merged: a signal would end the others, and they the whole job.
            if choices.communicator is not None:
                polite_barrier(choices.communicator)


def _run_missing(campaign: Folder, choices: Choices, stop: Stop) -> None:
    writer = f"{choices.part.writer}-rank{choices.rank}"
    store = Store(campaign.path, campaign.identity, writer, campaign.output.shard_samples)
    before = _survey(campaign, choices)
    progress = _progress(campaign, choices, before) if before is not None else None
    reason = fault = ""
    try:
        reason = choices.scheduler.run(
            _to_run(campaign, choices, before),
            _work(campaign, choices, store, stop, progress, _failed_elsewhere(choices, before)),
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
    if reason:
        stop.note(reason, signalled=True)  # another rank was told to stop
    if progress is not None:
        progress.close("failed" if fault else "stopped" if reason else "finished")
    if fault:
        raise InputError(fault)


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


def _failed_elsewhere(choices: Choices, before: Survey | None) -> int:
    """Failed samples of other parts, which count against ``max_failed`` too."""
    if before is None or choices.retry_failed:
        return 0
    return int((~choices.part.holds(before.failed)).sum())


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
    campaign: Folder,
    choices: Choices,
    store: Store,
    stop: Stop,
    progress: Progress | None,
    failed_elsewhere: int,
) -> Work:
    most = choices.max_failed

    def check_budget() -> None:
        if progress is not None and most is not None:
            failed = progress.failed + failed_elsewhere
            if failed > most:
                why = f"{failed} samples failed, more than max_failed = {most}"
                stop.note(why, signalled=False)

    def finished(result: Result) -> None:
        if progress is not None:
            progress.finished(result)
            check_budget()

    def asked() -> str:
        if progress is not None:
            progress.refresh()
        return stop.asked()

    check_budget()
    return Work(
        solver=campaign.solver,
        scene=campaign.scene.to_table(),
        values_of=campaign.table.values_of,
        limits=choices.limits,
        keep=store.keep,
        started=progress.started if progress is not None else lambda sample: None,
        finished=finished,
        stop=asked,
    )


def _conclude(campaign: Folder, choices: Choices, stop: Stop) -> int:
    """Merge if nothing is left, say how it ended, and choose the exit code."""
    stop.at_once = True
    try:
        merged = merge(
            campaign, execution=choices.description, set_aside=choices.part.whole, partly=False
        )
    except KeyboardInterrupt:
        _tell(f"{stop.reason}; the samples are not merged yet: the same command goes on with that")
        return EXIT_INTERRUPTED
    finally:
        stop.at_once = False
    left, failed = merged.left, merged.failed
    over_budget = bool(stop.reason) and not stop.signalled
    if merged.path is not None:
        _tell(f"{merged.path}: {campaign.table.samples} samples, {failed} failed")
        for line in _notes(campaign, merged.path):
            _tell(f"  {line}")
    if over_budget:
        _tell(
            f"{stop.reason}; {left} samples are left: raise max_failed, or mend what fails and "
            "give the same command with --retry-failed"
        )
    elif left and (stop.signalled or choices.part.whole):
        why = stop.reason or "some results were lost"
        _tell(f"{why}; {left} samples are left: the same command goes on with them")
    elif left:
        _tell(f"this part is done; {left} samples of other parts are left")
    if over_budget or failed == campaign.table.samples:
        return EXIT_FAILED
    return EXIT_INTERRUPTED if left and (stop.signalled or choices.part.whole) else EXIT_DONE


def _tell(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _notes(campaign: Folder, path: Path) -> list[str]:
    """Samples that started anew, and numerical against sampling error where there are bars."""
    import xarray as xr

    listed = any(column.path == "solver.error_bars" for column in campaign.table.columns)
    with xr.open_dataset(path) as dataset:
        lines = restart_lines(dataset)
        if listed or campaign.scene.solver.error_bars:
            lines += budget_lines(error_budget(dataset))
    return lines
