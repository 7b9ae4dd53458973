"""``ringsim campaign``: run a campaign, or finish an interrupted one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from ringsim.campaign.folder import prepare_folder
from ringsim.campaign.run import Choices, Part, run_campaign
from ringsim.campaign.specification import SOLVER, load_campaign
from ringsim.cli import EXIT_BAD_INPUT
from ringsim.execution.launch import aborting, describe, launched_size, mpi_world
from ringsim.execution.local import Local
from ringsim.execution.mpi import Mpi
from ringsim.execution.serial import Serial
from ringsim.refusal import InputError


def _part(text: str) -> Part:
    number, slash, count = text.partition("/")
    if not (slash and number.isdigit() and count.isdigit() and 1 <= int(number) <= int(count)):
        raise InputError(f"--part {text}: must read i/n with 1 <= i <= n, for example 2/8")
    return Part(int(number), int(count))


@click.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--workers", type=click.IntRange(0, 4096), help="Solver processes (default 1); "
              "0 runs in this process, without isolation.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), help="Folder (default runs/NAME).")
@click.option("--part", default="1/1", help="Run only the i-th of n shares of the samples: i/n.")
@click.option("--retry-failed", is_flag=True, help="Run the failed samples again.")
@click.option("--solver", default=SOLVER, hidden=True)
def command(
    file: Path, workers: int | None, out: Path | None, part: str, retry_failed: bool, solver: str
) -> int:
    """Run the campaign of FILE; the same command again goes on with what is missing.

    Under mpiexec or srun every rank computes, and --workers is left out.
    """
    if launched_size() > 1:
        return _under_mpi(file, workers, out, part, retry_failed, solver)
    folder, choices = _prepare(file, workers, out, part, retry_failed, solver)
    return run_campaign(folder, choices)


def _prepare(
    file: Path, workers: int | None, out: Path | None, part: str, retry_failed: bool, solver: str
) -> tuple[Path, Choices]:
    campaign = load_campaign(file)
    wanted = campaign.specification
    folder = out or Path("runs") / wanted.name
    count = 1 if workers is None else workers
    choices = Choices(
        scheduler=Local(count) if count else Serial(),
        workers=max(1, count),
        limits=wanted.limits,
        max_failed=wanted.max_failed,
        part=_part(part),
        retry_failed=retry_failed,
        description=f"{count} local workers" if count else "in one process",
    )
    prepare_folder(campaign, folder, solver=solver)
    return folder, choices


def _under_mpi(
    file: Path, workers: int | None, out: Path | None, part: str, retry_failed: bool, solver: str
) -> int:
    world = mpi_world()
    with aborting(world):
        rank, fault, prepared = world.Get_rank(), "", None
        if rank == 0:
            try:
                if workers is not None:
                    raise InputError(
                        f"--workers {workers}: under an MPI launcher every rank drives one solver "
                        "process: leave out --workers"
                    )
                prepared = _prepare(file, world.Get_size(), out, part, retry_failed, solver)
            except InputError as error:
                fault = str(error)
        fault, prepared = world.bcast((fault, prepared))
        try:
            if prepared is None:
                raise InputError(fault)
            folder, choices = prepared
            return run_campaign(
                folder,
                replace(
                    choices, scheduler=Mpi(world), communicator=world, description=describe(world)
                ),
            )
        except InputError as error:
            if rank == 0:
                click.echo(str(error), err=True)
            return EXIT_BAD_INPUT
