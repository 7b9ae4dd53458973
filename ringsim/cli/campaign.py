"""``ringsim campaign``: run a campaign, or finish an interrupted one."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from ringsim.campaign.folder import open_folder, prepare_folder
from ringsim.campaign.growing import grown, grows, is_open
from ringsim.campaign.retry import FAILED, check_settings
from ringsim.campaign.run import Choices, Share, run_campaign
from ringsim.campaign.specification import SOLVERS, load_campaign
from ringsim.campaign.status import plan
from ringsim.campaign.stopping import as_decided
from ringsim.cli.options import PATH, PLOT_FORMAT, SETTINGS, require_plot
from ringsim.execution.local import Local, Serial
from ringsim.execution.mpi import Mpi, aborting, launched_size, mpi_world
from ringsim.execution.work import Scheduler
from ringsim.exit_codes import EXIT_BAD_INPUT, EXIT_DONE
from ringsim.refusal import InputError
from ringsim.storage.merge import NAME as MERGED
from ringsim.storage.netcdf import DESIGN
from ringsim.variables import Status


@click.command()
@click.argument("file", type=PATH)
@click.option(
    "--workers", metavar="N", type=click.IntRange(0, 4096),
    help="Solver processes (default 1); 0 runs in this process, without isolation.",
)  # fmt: skip
@SETTINGS
@click.option(
    "--samples", type=click.IntRange(1, 10_000_000), metavar="N",
    help="Draw N samples instead of as many as the file says.",
)  # fmt: skip
@click.option("--out", metavar="DIR", type=PATH, help="Folder (default runs/NAME).")
@click.option(
    "--part", metavar="I/N", default="1/1", help="Run only the I-th of N shares of the samples."
)
@click.option(
    "--retry-failed", is_flag=True,
    help="Run the failed samples again, too; with --set only these, with other solver settings.",
)  # fmt: skip
@click.option("--dry-run", is_flag=True, help="Show plan and predicted cost; keep nothing.")
@click.option("--plot", is_flag=True, help="Draw figures beside campaign.nc.")
@PLOT_FORMAT
@click.option("--solver", default="", hidden=True)
@click.option("--judge", default=SOLVERS["full"], hidden=True)
def command(
    file: Path, workers: int | None, settings: dict[str, Any], samples: int | None,
    out: Path | None, part: str, *, retry_failed: bool, dry_run: bool, plot: bool,
    formats: tuple[str, ...] | None, solver: str, judge: str,
) -> int:  # fmt: skip
    """Run the campaign of FILE; the same command again goes on with what is missing.

    Under mpiexec or srun every rank computes, and --workers is left out.  Exit codes: 0 all
    samples have run (some may have failed, up to max_failed), 3 too many or all of them failed, or
    the frame engine differs from the full one by more than max_difference, 130 stopped by a signal.
    """
    size = launched_size()
    require_plot(formats, plot=plot)

    def prepare() -> tuple[Path, tuple[Any, ...]]:
        if size > 1 and workers is not None and not dry_run:
            raise InputError(
                f"--workers {workers}: under an MPI launcher every rank drives one solver "
                "process: leave out --workers"
            )
        # With --retry-failed they are settings of the failed samples alone.
        own, theirs = ({}, settings) if retry_failed else (settings, {})
        campaign, share = load_campaign(file, own, samples), Share.parse(part)
        if grows(campaign) and share.count > 1:
            raise InputError(
                f"--part {part}: which samples a design of kind subset-simulation has depends on "
                "the results of all others: leave it out, and use --workers or MPI"
            )
        if grows(campaign) and retry_failed:
            raise InputError(
                "--retry-failed: later samples of a design of kind subset-simulation follow from "
                "the results as they are: leave it out, or choose another folder with --out"
            )
        check_settings(campaign.scene, theirs)
        wanted = campaign.specification
        folder, name = out or Path("runs") / wanted.name, solver or SOLVERS[wanted.fidelity]
        if dry_run:
            count = max(1, workers or size)
            for line in plan(campaign, folder, workers=count, share=share, solver=name):
                click.echo(line)
        elif retry_failed and (folder / DESIGN).exists():
            begun = open_folder(folder).attributes["campaign_name"]
            if begun != wanted.name:
                raise InputError(
                    f"{folder}: this folder holds the campaign {begun}, not {wanted.name}: choose "
                    "its folder with --out"
                )
        else:
            campaign = grown(campaign, folder)
            prepare_folder(campaign, folder, solver=name, judge=judge)
        again = FAILED if retry_failed else frozenset[Status]()
        # To be asked again as long as samples follow from the results of others.
        more = grows(campaign) and not retry_failed and not dry_run and is_open(campaign)
        return folder, (wanted.limits, wanted.max_failed, share, again, theirs, more)

    def draw(folder: Path) -> None:
        # As long as samples are left, a file would be an older one.
        if not plot or len(as_decided(open_folder(folder)).survey().missing):
            return
        import xarray as xr

        from ringsim.plots.campaign.figures import draw_campaign

        found = xr.load_dataset(folder / MERGED, engine="netcdf4")
        for picture in draw_campaign(found, folder, formats=formats or ("png",)):
            click.echo(f"wrote {picture}")

    if dry_run:
        prepare()
        return EXIT_DONE
    if size == 1:
        return _run(Serial() if workers == 0 else Local(workers or 1), prepare, draw)
    world = mpi_world()
    with aborting(world):
        return _run(Mpi(world), prepare, draw)


def _run(
    scheduler: Scheduler, prepare: Callable[[], tuple[Path, tuple[Any, ...]]],
    draw: Callable[[Path], None],
) -> int:  # fmt: skip
    """Prepare on rank 0, run on all ranks, draw on rank 0; what is refused is told once."""
    try:
        while True:
            prepared: Any = None
            if scheduler.rank == 0:
                try:
                    prepared = prepare()
                except InputError as error:
                    prepared = error
            if isinstance(prepared := scheduler.from_first(prepared), InputError):
                raise prepared
            folder, choices = prepared
            how = Choices(scheduler, *choices)
            code = run_campaign(folder, how)
            if not how.more or scheduler.from_first(code) != EXIT_DONE:
                break
        if scheduler.rank == 0:
            draw(folder)
        return code
    except InputError as error:
        if scheduler.rank == 0:
            click.echo(str(error), err=True)
        return EXIT_BAD_INPUT
