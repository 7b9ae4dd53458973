"""``ringsim campaign`` and ``status``."""

from functools import partial
from pathlib import Path
from typing import Any

import click

from ringsim.campaign.folder import open_folder
from ringsim.campaign.plan import plan
from ringsim.campaign.run import Order, Share, require_no_launcher, start
from ringsim.campaign.specification import SOLVERS, load_campaign
from ringsim.campaign.status import status_lines
from ringsim.campaign.stopping import as_decided
from ringsim.cli.options import (
    FOLDER,
    PATH,
    PLOT_FORMAT,
    SETTINGS,
    Formats,
    draw_figures,
    require_with,
)
from ringsim.execution.mpi import launched_size
from ringsim.exit_codes import EXIT_BAD_INPUT, EXIT_DONE
from ringsim.storage.merge import NAME as MERGED


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
def campaign_command(
    file: Path, workers: int | None, settings: dict[str, Any], samples: int | None,
    out: Path | None, part: str, *, retry_failed: bool, dry_run: bool, plot: bool,
    formats: Formats, solver: str, judge: str,
) -> int:  # fmt: skip
    """Run the campaign of FILE; the same command again goes on with what is missing.

    Under mpiexec or srun every rank computes, and --workers is left out.  Exit codes: 0 all
    samples have run (some may have failed, up to max_failed), 3 too many or all of them failed, or
    the frame engine differs from the full one by more than max_difference, 130 stopped by a signal.
    """
    require_with("--plot-format", formats, "--plot", plot)

    def order() -> Order:
        if not dry_run:
            require_no_launcher(workers)
        # With --retry-failed they are settings of the failed samples alone.
        own, theirs = ({}, settings) if retry_failed else (settings, {})
        campaign, share = load_campaign(file, own, samples), Share.parse(part)
        folder = out or Path("runs") / campaign.specification.name
        return Order(campaign, folder, share, retry_failed, theirs, solver, judge)

    def draw(folder: Path) -> None:
        # As long as samples are left, a file would be an older one.
        if not plot or len(as_decided(open_folder(folder)).survey().missing):
            return
        import xarray as xr

        found = xr.load_dataset(folder / MERGED, engine="netcdf4")
        draw_figures(found, folder, "campaign", formats)

    if dry_run:
        say = partial(click.echo, err=True)
        for line in plan(order(), max(1, workers or launched_size()), say):
            click.echo(line)
        return EXIT_DONE
    ended = start(workers, order, draw)
    if ended.refused is None:
        return ended.code
    if ended.first:
        click.echo(str(ended.refused), err=True)
    return EXIT_BAD_INPUT


@click.command()
@FOLDER
def status_command(folder: Path) -> None:
    """Tell how many samples of the campaign in FOLDER are done, failed, running and left, and what
    the antenna did.

    It only reads, and may be called while the campaign runs.
    """
    for line in status_lines(open_folder(folder)):
        click.echo(line)
