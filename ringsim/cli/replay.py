"""``ringsim replay``: run one sample of a campaign again, in the foreground."""

import faulthandler
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from ringsim.campaign.folder import open_folder, other_build
from ringsim.cli.options import FOLDER, PATH
from ringsim.execution.solve import load_solver, solve
from ringsim.exit_codes import EXIT_DONE, EXIT_FAILED
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.error_bars import rules
from ringsim.refusal import InputError
from ringsim.storage.result import Result, check_of
from ringsim.variables import GOALS, TIMINGS, Outcome

Arrays = dict[str, NDArray[Any]]


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
    if told := other_build(campaign):
        click.echo(told)
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
        if "status" not in different:
            new, old = result.arrays(), before.arrays()
            bars = _bars(old)
            if (
                not bars and result.fate in GOALS
            ):  # the same run once more, with what it leaves open
                again = values | {"solver.error_bars": True}
                bars = _bars(solve(load_solver(solver), campaign.scene, number, again).arrays())
            for line in judged(different, new, old, bars):
                click.echo(f"  {line}")
        return EXIT_FAILED
    else:
        click.echo("identical to the stored result")
    return EXIT_FAILED if result.status.failed else EXIT_DONE


def _differences(result: Result, before: Result) -> list[str]:
    """Names of what a replay gave differently, timings aside."""
    new, old = result.arrays(), before.arrays()
    status = ["status"] if result.status != before.status else []
    return status + [
        name for name in sorted((new.keys() | old.keys()) - set(TIMINGS))
        if name not in new or name not in old
        or not np.array_equal(new[name], old[name], equal_nan=new[name].dtype.kind == "f")
    ]  # fmt: skip


def _bars(arrays: Arrays) -> Arrays:
    """Error bars by the name of what they are of."""
    return {name: arrays[f"{name}_error"] for name in rules() if f"{name}_error" in arrays}


def judged(different: list[str], new: Arrays, old: Arrays, bars: Arrays) -> list[str]:
    """How far two results of a sample are apart: relative to each output's largest stored size, and
    beside the numerical error that the sample states.

    Codes and words have no size; of series counts where both have a value.
    """
    sizes: dict[str, float] = {}
    within, beyond = list[str](), list[str]()
    for name in different:
        if name not in new or name not in old or old[name].dtype.kind != "f":
            continue
        if new[name].shape != old[name].shape:
            continue
        apart = np.abs(new[name] - old[name])
        if not np.isfinite(apart).any():
            continue
        largest = np.nanmax(np.abs(old[name]))
        sizes[name] = float(np.nanmax(apart) / largest) if largest else np.inf
        if name in bars:
            told = f"{name} by {np.nanmax(apart):.2g} of {np.nanmax(bars[name]):.2g}"
            unit = VARIABLES[name].units
            (beyond if np.any(apart > bars[name]) else within).append(f"{told} {unit}")
    lines = []
    if sizes:
        most = max(sizes, key=sizes.__getitem__)
        lines.append(f"largest relative difference: {sizes[most]:.2g} ({most})")
    if within or beyond:
        how = "ABOVE" if beyond else "below"
        lines.append(f"{how} the error bars: {', '.join(beyond or within)}")
    else:
        lines.append("none of these has an error bar")
    return lines
