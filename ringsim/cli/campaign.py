"""``ringsim campaign``: run a campaign, or finish an interrupted one."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import click

from ringsim.campaign.folder import prepare_folder
from ringsim.campaign.plan import plan
from ringsim.campaign.run import Choices, Part, run_campaign
from ringsim.campaign.specification import SOLVERS, Campaign, load_campaign
from ringsim.execution.launch import aborting, describe, launched_size, mpi_world
from ringsim.execution.local import Local
from ringsim.execution.mpi import Mpi
from ringsim.execution.serial import Serial
from ringsim.exit_codes import EXIT_BAD_INPUT, EXIT_DONE
from ringsim.refusal import InputError


@dataclass(frozen=True)
class Request:
    """What the command line asks for."""

    file: Path
    workers: int | None
    out: Path | None
    part: str
    retry_failed: bool
    dry_run: bool
    solver: str


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--workers",
    type=click.IntRange(0, 4096),
    help="Solver processes (default 1); 0 runs in this process, without isolation.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder (default runs/NAME).")
@click.option("--part", default="1/1", help="Run only the i-th of n shares of the samples: i/n.")
@click.option("--retry-failed", is_flag=True, help="Run the failed samples again, too.")
@click.option("--dry-run", is_flag=True, help="Show plan and predicted cost; keep nothing.")
@click.option("--solver", default="", hidden=True)
def command(**options: Any) -> int:
    """Run the campaign of FILE; the same command again goes on with what is missing.

    Under mpiexec or srun every rank computes, and --workers is left out.  Exit codes: 0 all
    samples have run (some may have failed, up to max_failed), 3 too many or all of them failed,
    130 stopped by a signal.
    """
    logging.basicConfig(format="%(message)s")
    request = Request(**options)
    size = launched_size()
    if request.dry_run:
        return _show_plan(request, size)
    if size > 1:
        return _under_mpi(request)
    folder, choices = _prepare(load_campaign(request.file), request, request.workers)
    return run_campaign(folder, choices)


def _folder(campaign: Campaign, request: Request) -> Path:
    return request.out or Path("runs") / campaign.specification.name


def _solver(campaign: Campaign, request: Request) -> str:
    return request.solver or SOLVERS[campaign.specification.fidelity]


def _part(text: str) -> Part:
    number, slash, count = text.partition("/")
    if not (slash and number.isdigit() and count.isdigit() and 1 <= int(number) <= int(count)):
        raise InputError(f"--part {text}: must read i/n with 1 <= i <= n, for example 2/8")
    return Part(int(number), int(count))


def _show_plan(request: Request, size: int) -> int:
    campaign = load_campaign(request.file)
    for line in plan(
        campaign,
        _folder(campaign, request),
        workers=max(1, request.workers or size),
        part=_part(request.part),
        solver=_solver(campaign, request),
    ):
        click.echo(line)
    return EXIT_DONE


def _prepare(campaign: Campaign, request: Request, workers: int | None) -> tuple[Path, Choices]:
    wanted, folder = campaign.specification, _folder(campaign, request)
    count = 1 if workers is None else workers
    choices = Choices(
        scheduler=Local(count) if count else Serial(),
        workers=max(1, count),
        limits=wanted.limits,
        max_failed=wanted.max_failed,
        part=_part(request.part),
        retry_failed=request.retry_failed,
        description=f"{count} local workers" if count else "in one process",
    )
    prepare_folder(campaign, folder, solver=_solver(campaign, request))
    return folder, choices


def _under_mpi(request: Request) -> int:
    world = mpi_world()
    with aborting(world):
        rank, fault, prepared = world.Get_rank(), "", None
        if rank == 0:
            try:
                if request.workers is not None:
                    raise InputError(
                        f"--workers {request.workers}: under an MPI launcher every rank drives one "
                        "solver process: leave out --workers"
                    )
                prepared = _prepare(load_campaign(request.file), request, world.Get_size())
            except InputError as error:
                fault = str(error)
        fault, prepared = world.bcast((fault, prepared))
        try:
            if prepared is None:
                raise InputError(fault)
            folder, choices = prepared
            choices = replace(
                choices, scheduler=Mpi(world), communicator=world, description=describe(world)
            )
            return run_campaign(folder, choices)
        except InputError as error:
            if rank == 0:
                click.echo(str(error), err=True)
            return EXIT_BAD_INPUT
