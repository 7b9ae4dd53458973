"""Starting a campaign: here, in several processes, or on all ranks of an MPI world."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from ringsim.campaign.folder import open_folder, prepare_folder, require_this_build
from ringsim.campaign.growing import grown, grows, is_open
from ringsim.campaign.retry import FAILED, check_settings
from ringsim.campaign.run import Choices, Share, run_campaign
from ringsim.campaign.specification import SOLVERS, Campaign
from ringsim.execution.local import Local, Serial
from ringsim.execution.mpi import Mpi, aborting, launched_size, mpi_world
from ringsim.execution.work import Scheduler
from ringsim.exit_codes import EXIT_DONE
from ringsim.refusal import InputError
from ringsim.storage.netcdf import DESIGN
from ringsim.variables import Status


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
                f"--part {self.share.number}/{self.share.count}: which samples a design of kind "
                "subset-simulation has depends on the results of all others: leave it out, and "
                "use --workers or MPI"
            )
        if grows(self.campaign) and self.again:
            raise InputError(
                "--retry-failed: later samples of a design of kind subset-simulation follow from "
                "the results as they are: leave it out, or choose another folder with --out"
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
            return grows(campaign) and not self.again and is_open(campaign)
        begun = open_folder(self.folder)
        if (held := begun.attributes["campaign_name"]) != name:
            raise InputError(
                f"{self.folder}: this folder holds the campaign {held}, not {name}: choose its "
                "folder with --out"
            )
        require_this_build(begun)
        begun.survey()
        return False

    @property
    def choices(self) -> tuple[Any, ...]:
        """All ``Choices`` but the scheduler and whether more follow, in their order."""
        wanted = self.campaign.specification
        again = FAILED if self.again else frozenset[Status]()
        return wanted.limits, wanted.max_failed, self.share, again, self.overrides


class Ended(NamedTuple):
    """How a campaign ended: its exit code, on all ranks, or why it was refused."""

    code: int = 0
    refused: InputError | None = None
    first: bool = True
    """Whether this is rank 0, who tells."""


def require_no_launcher(workers: int | None) -> None:
    """Refuse (InputError) a number of workers under an MPI launcher."""
    if launched_size() > 1 and workers is not None:
        raise InputError(
            f"--workers {workers}: under an MPI launcher every rank drives one solver "
            "process: leave out --workers"
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
                    placed = made.folder, (*made.choices, made.prepare())
                except InputError as error:
                    placed = error
            if isinstance(placed := scheduler.from_first(placed), InputError):
                raise placed
            folder, chosen = placed
            how = Choices(scheduler, *chosen)
            code = run_campaign(folder, how)
            if not how.more or scheduler.from_first(code) != EXIT_DONE:
                break
        if first:
            then(folder)
        return Ended(code, first=first)
    except InputError as error:
        return Ended(refused=error, first=first)
    finally:
        scheduler.close()
