"""Running a campaign: run what is missing in its folder, merge, say how it ended."""

import contextlib
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ringsim.analysis.campaign_notes import budget_lines, notes
from ringsim.analysis.engines import check_lines, too_far
from ringsim.campaign.folder import Folder, open_folder
from ringsim.campaign.merging import merge
from ringsim.campaign.specification import SOLVERS
from ringsim.campaign.stopping import Watch, as_decided
from ringsim.campaign.watch import Progress, StopRequest, stopping_on_signals
from ringsim.compile_cache import choose_folder
from ringsim.execution.work import Allowance, Scheduler, Work, longest_first, relative_cost
from ringsim.exit_codes import EXIT_DONE, EXIT_FAILED, EXIT_INTERRUPTED
from ringsim.refusal import InputError
from ringsim.storage.journal import Journal
from ringsim.storage.locks import reserved
from ringsim.storage.result import Result, check_of, sample_of
from ringsim.variables import Status


@dataclass(frozen=True)
class Share:
    """Every ``count``-th sample of a campaign, starting at ``number`` - 1."""

    number: int = 1
    count: int = 1

    @classmethod
    def parse(cls, text: str) -> "Share":
        """The share that ``i/n`` names; InputError if there is none.

        >>> Share.parse("2/8")
        Share(number=2, count=8)
        """
        number, _, count = text.partition("/")
        if not (number.isdigit() and count.isdigit() and 1 <= int(number) <= int(count)):
            raise InputError(f"--part {text}: must read i/n with 1 <= i <= n, for example 2/8")
        return cls(int(number), int(count))

    @property
    def writer(self) -> str:
        """Start of the names of files that belong to this share alone."""
        return "all" if self.count == 1 else f"part{self.number}of{self.count}"

    def holds(self, samples: Any) -> Any:
        """Which of the samples belong to the share."""
        return samples % self.count == self.number - 1


@dataclass(frozen=True)
class Choices:
    """How a campaign is to be run this time."""

    scheduler: Scheduler
    allowance: Allowance
    max_failed: int | None = None
    """Failures that are tolerated, in the whole campaign; None for any number."""
    share: Share = Share()
    again: frozenset[Status] = frozenset()
    """Samples that ended so run again, too."""
    overrides: Mapping[str, Any] = field(default_factory=dict)
    """Settings by scene path with which those run, and nothing else does."""
    more: bool = False
    """Whether more samples may follow: then nothing is merged or told as long as all goes well."""


def run_campaign(folder: Path, choices: Choices) -> int:
    """Run the missing samples of a prepared folder, on every rank that takes part.

    Returns the exit code: 0 all samples have run, 3 too many (or all) of them failed, or engines
    differ by more than the campaign allows, 130 stopped by a signal, or samples are left.
    InputError if the folder is in use or cannot be written.
    """
    scheduler, share = choices.scheduler, choices.share
    with contextlib.ExitStack() as held:
        stop, fault = held.enter_context(stopping_on_signals()), ""
        if scheduler.rank == 0:
            try:
                held.enter_context(reserved(folder, share.writer, alone=share.count == 1))
            except InputError as error:
                fault = str(error)
        if fault := scheduler.from_first(fault):
            raise InputError(fault)
        campaign = open_folder(folder)
        if scheduler.rank == 0 and campaign.attributes["solver"] == SOLVERS["frame"]:
            choose_folder()  # tells, where it is a temporary one; solver processes tell nobody
        _run_missing(campaign, choices, stop)
        try:
            return _conclude(campaign, choices, stop) if scheduler.rank == 0 else EXIT_DONE
        finally:
            # Until rank 0 has merged: a signal would end the others, and they the whole job.
            scheduler.wait()


def _run_missing(campaign: Folder, choices: Choices, stop: StopRequest) -> None:
    scheduler = choices.scheduler
    writer = f"{choices.share.writer}-rank{scheduler.rank}"
    journal = Journal(campaign.path, writer)
    own, run_with = dict(choices.overrides), campaign.run_with
    work = Work(
        solver=campaign.attributes["solver"], scene=campaign.scene.to_table(),
        values_of=lambda number: campaign.table.values_of(sample_of(number)) | own,
        allowance=choices.allowance, judge=campaign.attributes.get("judge", ""),
        keep=lambda result: journal.append(
            replace(result, overrides=own, run_with=run_with[sample_of(result.sample)])
        ),
        stop=lambda: stop.reason, more=choices.more,
    )  # fmt: skip
    samples: list[int] = []
    progress = None
    if scheduler.rank == 0:
        samples, progress, work = _watched(campaign, choices, stop, work)
    reason = fault = ""
    try:
        reason = scheduler.run(samples, work)
    except InputError as error:
        fault = str(error)
    try:
        journal.close()
    except InputError as error:
        fault = fault or str(error)
    fault = next(filter(None, scheduler.from_all(fault)), "")
    if reason:
        stop.note(reason, signalled=True)  # another rank was told to stop
    if progress is not None:
        progress.close("failed" if fault else "stopped" if reason else "finished")
    if fault:
        raise InputError(fault)


def _watched(
    campaign: Folder, choices: Choices, stop: StopRequest, work: Work
) -> tuple[list[int], Progress, Work]:
    """The checks and samples to run, longest ones first, and the work with who watches it."""
    share, most = choices.share, choices.max_failed
    campaign = as_decided(campaign)
    before, every = campaign.survey(), np.arange(campaign.table.samples)
    again = every[np.isin(before.status, list(choices.again))]
    failed, open_ = np.setdiff1d(before.failed, again), np.union1d(before.missing, again)
    if choices.overrides and not len(again):
        _tell("no sample has failed: nothing is run again")
    missing = again if choices.overrides else open_
    missing, mine = missing[share.holds(missing)], int(share.holds(failed).sum())
    done, total = (int(share.holds(each).sum()) for each in (np.setdiff1d(every, open_), every))
    checks = [check_of(sample) for sample in _checks(campaign, choices)]
    progress = Progress(
        campaign.path / f"progress-{share.writer}.json", campaign.attributes["campaign_name"],
        total=total, done=done, failed=mine, workers=choices.scheduler.workers,
        checks=len(checks),
    )  # fmt: skip

    watch = Watch(campaign, again)

    def finished(result: Result) -> None:
        progress.finished(result)
        watch.finished(result.sample)

    def asked() -> str:
        progress.refresh()
        if enough := watch.ended():
            stop.enough = stop.enough or not stop.reason
            stop.note(enough, signalled=False)
        count = progress.failed + len(failed) - mine
        if most is not None and count > most:
            stop.note(f"{count} samples failed, more than max_failed = {most}", signalled=False)
        return stop.reason

    samples = longest_first(missing, relative_cost(campaign.table, campaign.scene))
    samples = watch.in_order(checks + samples)  # checks first: the full engine takes longest
    work = replace(work, started=progress.started, finished=finished, stop=asked)
    return samples, progress, work


def _checks(campaign: Folder, choices: Choices) -> list[int]:
    """The samples of this share whose checks are to run."""
    if not len(campaign.checked):
        return []
    found = campaign.survey(checks=True)
    wanted = np.isin(found.status, list(choices.again))
    if not choices.overrides:
        wanted[found.missing] = True
    chosen = campaign.checked[wanted[campaign.checked]]
    return [int(sample) for sample in chosen[choices.share.holds(chosen)]]


def _conclude(campaign: Folder, choices: Choices, stop: StopRequest) -> int:
    """Merge if nothing is left, say how it ended, and choose the exit code."""
    if choices.more and not stop.reason and not len(campaign.survey().missing):
        return EXIT_DONE
    from ringsim.analysis.study_text import verdict_lines  # scipy.stats takes half a second

    stop.at_once = True
    try:
        left, failed, path = merge(campaign, execution=choices.scheduler.description, partly=False)
    except KeyboardInterrupt:
        _tell(f"{stop.reason}; the samples are not merged yet: the same command goes on with that")
        return EXIT_INTERRUPTED
    finally:
        stop.at_once = False
    refused, campaign = [], as_decided(campaign)
    if path is not None:
        _tell(f"{path}: {campaign.table.samples} samples, {failed} failed")
        listed = any(column.path == "solver.error_bars" for column in campaign.table.columns)
        with xr.open_dataset(path) as dataset:
            lines = notes(dataset)
            if listed or campaign.scene.solver.error_bars:
                lines += budget_lines(dataset)
            lines += check_lines(dataset) + verdict_lines(dataset)
            refused = too_far(dataset)
        for line in lines:
            _tell(f"  {line}")
    if stop.reason and not stop.signalled and not stop.enough:
        _tell(
            f"{stop.reason}; {left} samples are left: raise max_failed, or mend what fails and "
            "give the same command with --retry-failed (and --set solver.tolerance=...)"
        )
        return EXIT_FAILED
    unchecked = len(campaign.unchecked())
    todo = f"{left} samples" + (f" and {unchecked} checks" if unchecked else "")
    alone = choices.share.count == 1 and not choices.overrides
    interrupted = (left or unchecked) and (stop.signalled or alone)
    if interrupted:
        why = stop.reason or "some results were lost"
        _tell(f"{why}; {todo} are left: the same command goes on with them")
    elif (left or unchecked) and choices.overrides:
        _tell(f"{todo} are left: give the command without --retry-failed and --set")
    elif left or unchecked:
        _tell(f"this part is done; {todo} of other parts are left")
    if failed == campaign.table.samples or refused:
        return EXIT_FAILED
    return EXIT_INTERRUPTED if interrupted else EXIT_DONE


def _tell(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
