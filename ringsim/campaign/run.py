"""Running a campaign: start it, run what is missing in its folder, merge, say how it ended."""

import contextlib
import csv
import io
import json
import re
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import tomli_w

from ringsim.analysis import derived
from ringsim.analysis.campaign_notes import notes
from ringsim.analysis.engines import check_lines, too_far
from ringsim.analysis.tails import subset_simulation
from ringsim.campaign.folder import (
    FAILED,
    Folder,
    check_settings,
    open_folder,
    opened_as,
    prepare_folder,
    require_this_build,
)
from ringsim.campaign.merging import merge
from ringsim.campaign.specification import SOLVERS, Campaign, campaign_of, load_campaign
from ringsim.campaign.watch import Progress, StopRequest, Watch, as_decided, stopping_on_signals
from ringsim.execution.mpi import Mpi, aborting, launched_size, mpi_world
from ringsim.execution.slot import Local, Serial
from ringsim.execution.work import (
    Allowance,
    Scheduler,
    Work,
    longest_first,
    relative_cost,
    with_checks,
)
from ringsim.files import DESIGN, MERGED, write_text, writing
from ringsim.refusal import EXIT_DONE, EXIT_FAILED, EXIT_INTERRUPTED, InputError
from ringsim.sampling.designs.levels import SubsetSimulation
from ringsim.sampling.distributions import Array
from ringsim.scene import Scene
from ringsim.storage.journal import Journal
from ringsim.storage.netcdf import reserved
from ringsim.storage.result import Result, check_of, sample_of
from ringsim.tables import counted
from ringsim.variables import GOALS, Fate, Status


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
        if not (number.isdecimal() and count.isdecimal() and 1 <= int(number) <= int(count)):
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
    brief: bool = False
    """Whether nothing is told of the results: what asked for them tells what they mean, also of
    engines that differ by more than the campaign allows."""
    label: str = ""
    """What progress is told of, instead of the campaign's name."""


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
        try:
            campaign = open_folder(folder)
        except InputError as error:  # of one rank, as on a machine that does not see the folder
            fault = str(error)
        if fault := next(filter(None, scheduler.from_all(fault)), ""):
            raise InputError(fault)
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
    """The samples to run, longest ones first, with checks among them, and the work with who watches
    it.
    """
    share, most = choices.share, choices.max_failed
    campaign = as_decided(campaign)
    before, every = campaign.survey(), np.arange(campaign.table.samples)
    again = every[np.isin(before.status, list(choices.again))]
    failed, open_ = np.setdiff1d(before.failed, again), np.union1d(before.missing, again)
    if choices.overrides and not len(again):
        _tell("no sample has failed: nothing to run again")
    missing = again if choices.overrides else open_
    missing, mine = missing[share.holds(missing)], int(share.holds(failed).sum())
    done, total = (int(share.holds(each).sum()) for each in (np.setdiff1d(every, open_), every))
    checks = [check_of(sample) for sample in _checks(campaign, choices)]
    progress = Progress(
        campaign.path / f"progress-{share.writer}.json",
        choices.label or campaign.attributes["campaign_name"],
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
            stop.note(
                f"{counted(count, 'sample')} failed, more than max_failed = {most}", signalled=False
            )
        return stop.reason

    samples = longest_first(missing, relative_cost(campaign.table, campaign.scene))
    samples = watch.in_order(with_checks(samples, checks, choices.scheduler.workers))
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
    # scipy.stats takes half a second
    from ringsim.analysis.study_text import error_lines, verdict_lines

    stop.at_once = True
    try:
        whole = choices.share.count
        by = choices.scheduler.description + f" in each of {whole} parts" * (whole > 1)
        left, failed, path = merge(campaign, execution=by, partly=False)
    except KeyboardInterrupt:
        _tell(f"{stop.reason}; the results are not merged yet: run the same command again")
        return EXIT_INTERRUPTED
    finally:
        stop.at_once = False
    refused, campaign = [], as_decided(campaign)
    if path is not None:
        _tell(f"{path}: {counted(campaign.table.samples, 'sample')}, {failed} failed")
        listed = any(column.path == "solver.error_bars" for column in campaign.table.columns)
        # Here, as xarray takes half a second to load, which status need not wait for.
        from ringsim.dataset import open_lazily

        with open_lazily(path) as dataset:
            lines = [] if choices.brief else notes(dataset)
            if not choices.brief and (listed or campaign.scene.solver.error_bars):
                lines += error_lines(dataset)
            if not choices.brief:
                lines += check_lines(dataset) + verdict_lines(dataset)
                refused = too_far(dataset)  # which lines end with
        for line in lines:
            _tell(f"  {line}")
    if stop.reason and not stop.signalled and not stop.enough:
        once = ", or run the failed ones again with --retry-failed (and --set solver.tolerance=...)"
        once *= not growth_told(campaign)  # what grows depends on them
        _tell(f"{stop.reason}; {counted(left, 'sample')} left: raise max_failed{once}")
        return EXIT_FAILED
    unchecked = len(campaign.unchecked())
    todo = counted(left, "sample") + f" and {counted(unchecked, 'check')}" * (unchecked > 0)
    alone = choices.share.count == 1 and not choices.overrides
    interrupted = (left or unchecked) and (stop.signalled or alone)
    if interrupted:
        why = stop.reason or "some results are missing"
        _tell(f"{why}; {todo} left: run the same command again to continue")
    elif (left or unchecked) and choices.overrides:
        _tell(f"{todo} left: run the command without --retry-failed and --set")
    elif left or unchecked:
        _tell(f"this part is done; {todo} of other parts left")
    if failed == campaign.table.samples or refused:
        return EXIT_FAILED
    return EXIT_INTERRUPTED if interrupted else EXIT_DONE


def _tell(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


# Designs that grow with their results: which samples come next, and how well they went.


def grows(campaign: Campaign) -> bool:
    """Whether the samples of a campaign depend on the results of others."""
    return isinstance(campaign.specification.design, SubsetSimulation)


def grown(campaign: Campaign, path: Path) -> Campaign:
    """A campaign with the samples that follow from the results in its folder, if there is one.

    InputError if the runs do not compute the output that is asked for.
    """
    design = campaign.specification.design
    if not isinstance(design, SubsetSimulation) or not (path / DESIGN).exists():
        return campaign
    folder = open_folder(path)
    known = _responses(folder, design)
    design = design.knowing(known)
    wanted = campaign.specification.model_copy(update={"design": design})
    suspects = _suspects(folder, known, design) if design.check and design.ended else ()
    return replace(campaign, specification=wanted, suspects=suspects)


def _suspects(folder: Folder, known: Array, design: SubsetSimulation) -> tuple[int, ...]:
    """Runs on which the probability depends most: the nearest ones outside the event, half of what
    is wanted; of those in it, lost, or short of their goal the rest, evenly spread.
    """
    short = ~np.isin(folder.survey().fate, (*GOALS, Fate.NONE))
    found = np.flatnonzero((known > design.target) | np.isneginf(known) | short)
    outside = np.setdiff1d(np.arange(len(known)), found)
    near = outside[np.argsort(-known[outside], kind="stable")][: design.check // 2]
    count = min(design.check - len(near), len(found))
    chosen = np.linspace(0, len(found) - 1, count).round().astype(int)
    return tuple(np.union1d(found[chosen], near).tolist())


def growth_told(folder: Folder) -> str:
    """How many runs a campaign that grows has, in words; nothing of others."""
    if (design := subset_simulation(folder.attributes)) is None:
        return ""
    if not len(folder.survey().missing):
        design = design.knowing(_responses(folder, design))
    return design.runs_told(folder.table.samples)


def is_open(campaign: Campaign) -> bool:
    """Whether more samples may follow from the results of those that it has."""
    design = campaign.specification.design
    return isinstance(design, SubsetSimulation) and not design.ended


def _responses(folder: Folder, design: SubsetSimulation) -> Array:
    """Responses of the first samples, all of which have run."""
    found = folder.survey()
    count = int(found.missing[0]) if len(found.missing) else folder.table.samples
    values = np.full(count, np.nan)
    for result in found.results(np.arange(count)):
        arrays = result.arrays()
        if design.of in arrays:
            values[result.sample] = arrays[design.of]
        elif result.status == Status.OK and result.fate in GOALS:
            raise InputError(
                f"design.of = {design.of}: sample {result.sample} reached its goal without a "
                "value of it, because this fidelity does not compute it: choose another output, "
                "or another fidelity"
            )
    return design.responses(values, found.status[:count] != Status.OK)


# Starting a campaign: here, in several processes, or on all ranks of an MPI world.


class Order(NamedTuple):
    """Which campaign to run where, and how this time."""

    campaign: Campaign
    folder: Path
    share: Share = Share()
    again: bool = False
    """Whether failed samples run again, too."""
    overrides: Mapping[str, Any] = {}
    """Settings by scene path with which those run, and nothing else does."""
    solver: str = ""
    """What maps a scene to its outcome instead of the fidelity's."""
    judge: str = SOLVERS["full"]
    more: bool = False
    """Whether another order follows from the results of this one."""
    brief: bool = False
    """Whether nothing is told of the results."""
    label: str = ""
    """What progress is told of, instead of the campaign's name."""

    @property
    def solving(self) -> str:
        """What maps a scene to its outcome."""
        return self.solver or SOLVERS[self.campaign.specification.fidelity]

    def check(self) -> None:
        """Refuse (InputError) overrides that would make samples of another antenna, and parts and
        retries of a design whose samples follow from the results of others.
        """
        if grows(self.campaign) and self.share.count > 1:
            raise InputError(
                f"--part {self.share.number}/{self.share.count}: the samples of subset "
                "simulation depend on the results of earlier ones, so they cannot be divided "
                "into parts: leave --part out, and use --workers or MPI"
            )
        if grows(self.campaign) and self.again:
            raise InputError(
                "--retry-failed: the samples of subset simulation depend on the results of "
                "earlier ones, also failed ones: leave --retry-failed out, or choose another "
                "folder with --out"
            )
        check_settings(self.campaign.scene, self.overrides)

    def prepare(self) -> bool:
        """Make the folder, or see that it is this campaign's; InputError if it is not.

        Returns whether more samples will follow from the results of these.
        """
        self.check()
        name = self.campaign.specification.name
        if not (self.again and (self.folder / DESIGN).exists()):
            campaign = grown(self.campaign, self.folder)
            prepare_folder(campaign, self.folder, solver=self.solving, judge=self.judge)
            open_folder(self.folder).survey()  # here, where a refusal reaches all ranks
            return self.more or (grows(campaign) and not self.again and is_open(campaign))
        begun = open_folder(self.folder)
        if (held := begun.attributes["campaign_name"]) != name:
            raise InputError(
                f"{self.folder}: this folder has the campaign {held}, not {name}: choose another "
                "folder with --out"
            )
        require_this_build(begun)
        begun.survey()
        self._require_begun(begun)
        return False

    def _require_begun(self, begun: Folder) -> None:
        """Refuse (InputError) a folder that was not begun with this file, whose settings of the
        command line count again: those of today are of failed samples.
        """
        text, held = self.campaign.text, str(begun.attributes["campaign"])
        called = re.findall(r"^# called with --set (\S+) = (.*)$", held, re.MULTILINE)
        sizes = [re.findall(r"^# called with --samples (\d+)$", own, re.MULTILINE)
                 for own in (text, held)]  # fmt: skip
        size = next((int(each[-1]) for each in sizes if each), None)
        settings = {name: json.loads(value) for name, value in called}
        plain = re.sub(r"^# called with .*$", "", text, flags=re.MULTILINE)
        campaign = campaign_of(plain, self.campaign.file, settings, size, self.campaign.scene)
        table = campaign.draw()
        opened_as(campaign, self.folder, table, self.solving)
        if table.samples > begun.table.samples:
            raise InputError(
                f"{self.folder}: was begun with {begun.table.samples} samples, and --retry-failed "
                f"runs failed ones of these: leave it out to run the {table.samples} of "
                f"{self.campaign.file.name}"
            )

    @property
    def choices(self) -> tuple[Any, ...]:
        """All ``Choices`` but the scheduler and the last three, in their order."""
        wanted = self.campaign.specification
        again = FAILED if self.again else frozenset[Status]()
        return wanted.limits, wanted.max_failed, self.share, again, self.overrides


class Ended(NamedTuple):
    """How a campaign ended: its exit code, on all ranks, or why it was refused."""

    code: int = 0
    refused: InputError | None = None
    first: bool = True
    """Whether this is rank 0, who tells."""

    def require_end(self) -> None:
        """Raise why it was refused, or KeyboardInterrupt after a signal."""
        if self.refused is not None:
            raise self.refused
        if self.code == EXIT_INTERRUPTED:
            raise KeyboardInterrupt


def require_no_launcher(workers: int | None) -> None:
    """Refuse (InputError) a number of workers under an MPI launcher."""
    if launched_size() > 1 and workers is not None:
        raise InputError(
            f"--workers {workers}: under MPI every rank has one solver process: leave out --workers"
        )


def start(workers: int | None, order: Callable[[], Order], then: Callable[[Path], None]) -> Ended:
    """Place an order on rank 0, run it on all ranks, and go on on rank 0 with its folder.

    ``workers`` solver processes, one if None, or this very process for 0; under an MPI launcher
    one for each rank.
    """
    if launched_size() == 1:
        return _start(Serial() if workers == 0 else Local(workers or 1), order, then)
    world = mpi_world()
    with aborting(world):
        return _start(Mpi(world), order, then)


def _start(scheduler: Scheduler, order: Callable[[], Order], then: Callable[[Path], None]) -> Ended:
    first = scheduler.rank == 0
    try:
        while True:
            placed: Any = None
            if first:
                try:
                    made = order()
                    placed = made.folder, (*made.choices, made.prepare(), made.brief, made.label)
                except InputError as error:
                    placed = error
            if isinstance(placed := scheduler.from_first(placed), InputError):
                raise placed
            folder, chosen = placed
            how = Choices(scheduler, *chosen)
            code: Any
            try:
                code = run_campaign(folder, how)
            except InputError as error:  # of the first rank alone, as of a merge
                code = error
            if isinstance(code := scheduler.from_first(code), InputError):
                raise code
            if not how.more or code != EXIT_DONE:
                break
        if first:
            then(folder)
        return Ended(code, first=first)
    except InputError as error:
        return Ended(refused=error, first=first)
    finally:
        scheduler.close()


# Campaigns of listed cases, written and run by the program itself.


def run_cases(
    folder: Path, name: str, scene: Scene, cases: Sequence[Mapping[str, Any]], *, workers: int,
    title: str = "", timeout: float = 3600.0, fidelity: str = "full",
    again: frozenset[Status] = frozenset(),
) -> Path:  # fmt: skip
    """Run the cases of a scene that are still missing; returns the merged file: sample k is case k.

    An ordinary campaign called ``name`` goes into ``folder``, which is created, file and all.
    ``cases`` are values by scene path, the same paths in each, one value (no lists) to a path;
    ``timeout`` is the longest time of one run, s; ``fidelity`` is "full" or "frame".

    Cases that ended with a status of ``again`` run again.

    InputError if a case or the folder is refused, which changes no file; KeyboardInterrupt after a
    signal: call again.
    """
    limits = Allowance(timeout=timeout)
    campaign = listed_cases(
        folder, name, scene, cases, title=title, limits=limits, fidelity=fidelity
    )
    choices = Choices(Local(workers), campaign.specification.limits, again=again, brief=True)
    if run_campaign(folder / name, choices) == EXIT_INTERRUPTED:
        raise KeyboardInterrupt
    return folder / name / MERGED


def listed_cases(
    folder: Path, name: str, scene: Scene, cases: Sequence[Mapping[str, Any]], *, title: str,
    limits: Allowance, fidelity: str, clocks: Mapping[str, Any] = MappingProxyType({}),
    outputs: Mapping[str, derived.Derived] = MappingProxyType({}),
) -> Campaign:  # fmt: skip
    """The campaign of these cases, prepared in ``folder``/``name``; see :func:`run_cases`, and for
    the ``clocks`` of tests ``Campaign``; with ``outputs`` of one's own by name.
    """
    paths, listed = list(cases[0]), io.StringIO()
    writer = csv.DictWriter(listed, paths, lineterminator="\n")
    writer.writeheader()
    for number, case in enumerate(cases):
        if case.keys() != cases[0].keys():
            raise InputError(
                f"case {number} has values for {', '.join(case)}, and must have them for "
                f"{', '.join(paths)}"
            )
        writer.writerow({k: str(v).lower() if isinstance(v, bool) else v for k, v in case.items()})
    base, rows, file = (f"{name}{end}" for end in ("-scene.toml", ".csv", ".toml"))
    table = {
        "name": name, "title": title, "scene": base, "fidelity": fidelity,
        "design": {"kind": "list", "file": rows},
        "limits": limits.model_dump(exclude_defaults=True),
        "outputs": {n: each.model_dump(exclude_none=True) for n, each in outputs.items()},
    }  # fmt: skip
    texts = {base: scene.to_toml(), rows: listed.getvalue(), file: tomli_w.dumps(table)}
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    # Judged elsewhere, so that what is refused does not replace the files of what was run.
    with tempfile.TemporaryDirectory(prefix="ringsim-cases-") as drafts:
        for each, text in texts.items():
            write_text(Path(drafts) / each, text)
        campaign = replace(load_campaign(Path(drafts) / file), clocks=clocks)
        prepare_folder(campaign, folder / name, solver=SOLVERS[fidelity])
    for each, text in texts.items():
        write_text(folder / each, text)
    return load_campaign(folder / file)
