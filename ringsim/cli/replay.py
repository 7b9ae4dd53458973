"""``ringsim replay``: run one sample of a campaign again, in the foreground."""

import faulthandler
from pathlib import Path

import click
import numpy as np

from ringsim.campaign.folder import open_folder
from ringsim.cli.options import FOLDER, PATH
from ringsim.execution.solve import load_solver, solve
from ringsim.exit_codes import EXIT_DONE, EXIT_FAILED
from ringsim.outputs import COORDINATES
from ringsim.refusal import InputError
from ringsim.storage.result import Result, check_of
from ringsim.variables import TIMINGS, Outcome


@click.command()
@FOLDER
@click.argument("sample", type=int)
@click.option("--scene", is_flag=True, help="Print the sample's scene and do not run it.")
@click.option("--check", is_flag=True, help="Repeat the sample's check by the full engine instead.")
@click.option("--save", metavar="FILE", type=PATH, help="Write the run to a netCDF file.")
def command(folder: Path, sample: int, *, scene: bool, check: bool, save: Path | None) -> int:
    """Run SAMPLE of the campaign in FOLDER again in this process, and compare the results.

    Nothing in the folder changes.  Everything that the solver prints is shown; a crash or a hang
    happens here, where a debugger can look at it.
    """
    from ringsim.dataset import require_file
    from ringsim.dataset import save as write

    campaign = open_folder(folder)
    if save is not None:
        require_file(save)
    if not 0 <= sample < campaign.table.samples:
        raise InputError(
            f"sample {sample} is not in {folder}: choose one from 0 to {campaign.table.samples - 1}"
        )
    solver, number = campaign.attributes["solver"], sample
    if check:
        if "judge" not in campaign.attributes:
            raise InputError(
                f"--check: the samples of {folder} have no checks (check_every): leave it out"
            )
        solver, number = campaign.attributes["judge"], check_of(sample)
    before = next(campaign.survey(checks=check).results([sample]), None)
    values = campaign.table.values_of(sample) | (before.overrides if before is not None else {})
    exact = campaign.scene.with_values(values)
    if scene:
        click.echo(exact.to_toml())
        return EXIT_DONE
    faulthandler.enable()
    for path, value in values.items():
        click.echo(f"{path} = {value}")
    result = solve(load_solver(solver), campaign.scene, number, values)
    if result.log:
        click.echo(result.log)
    name = f"{'check of ' * check}sample {sample}"
    click.echo(f"{name}: {result.status.word}: {result.reason} ({result.seconds:.2f} s)")
    if save is not None:
        from ringsim.dataset import to_dataset

        arrays = result.arrays()
        coordinates = {name: arrays.pop(name) for name in COORDINATES if name in arrays}
        outcome = Outcome(result.status, result.reason, coordinates, arrays, result.cause)
        write(to_dataset(outcome, exact), save)
        click.echo(f"{save}: written")
    if before is None:
        click.echo("there is no stored result to compare with")
    elif different := _differences(result, before):
        click.echo(f"differs from the stored result ({before.status.word}): {', '.join(different)}")
        return EXIT_FAILED
    else:
        click.echo("identical to the stored result")
    return EXIT_FAILED if result.status.failed else EXIT_DONE


def _differences(result: Result, before: Result) -> list[str]:
    """Names of what a replay gave differently, timings aside."""
    new, old = result.arrays(), before.arrays()
    status = ["status"] if result.status != before.status else []
    return status + [
        name for name in sorted(new.keys() & old.keys() - set(TIMINGS))
        if not np.array_equal(new[name], old[name], equal_nan=new[name].dtype.kind == "f")
    ]  # fmt: skip
