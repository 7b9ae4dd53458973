"""``ringsim campaign``, ``status`` and ``replay``."""

import faulthandler
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from ringsim.campaign.folder import open_folder, other_build
from ringsim.campaign.merging import is_behind
from ringsim.campaign.plan import plan, status_lines
from ringsim.campaign.run import Order, Share, require_no_launcher, start
from ringsim.campaign.specification import SOLVERS, load_campaign
from ringsim.campaign.watch import as_decided
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
from ringsim.execution.work import load_solver, solve
from ringsim.files import MERGED, require_file
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.balance import rules
from ringsim.refusal import EXIT_BAD_INPUT, EXIT_DONE, EXIT_FAILED, InputError, show
from ringsim.sampling.columns import Table
from ringsim.sampling.distributions import plain
from ringsim.storage.result import Result, check_of
from ringsim.tables import readable, unit_text
from ringsim.variables import GOALS, TIMINGS, Fate, Outcome


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
@click.option("--out", metavar="DIR", type=PATH, help="Folder of the results (default runs/NAME).")
@click.option(
    "--part", metavar="I/N", default="1/1", help="Run only the I-th of N parts of the samples."
)
@click.option(
    "--retry-failed", is_flag=True,
    help=
        "Run failed samples again, too. With --set: only failed samples, with these solver "
        "settings.",
)  # fmt: skip
@click.option(
    "--dry-run",
    is_flag=True,
    help="Check the file, time one sample, and show what would run and its cost; store nothing.",
)
@click.option("--plot", is_flag=True, help="Draw figures beside campaign.nc.")
@PLOT_FORMAT
@click.option("--solver", default="", hidden=True)
@click.option("--judge", default=SOLVERS["full"], hidden=True)
def campaign_command(
    file: Path, workers: int | None, settings: dict[str, Any], samples: int | None,
    out: Path | None, part: str, *, retry_failed: bool, dry_run: bool, plot: bool,
    formats: Formats, solver: str, judge: str,
) -> int:  # fmt: skip
    """Run the campaign of FILE; the same command again continues it.

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
        # As long as samples or checks are left, or are not merged, a file would be an older one.
        held = as_decided(open_folder(folder)) if plot else None
        if held is None or len(held.survey().missing) or len(held.unchecked()):
            return
        if is_behind(folder):
            told = f"{folder / MERGED} is older than the results: no figures before ringsim merge"
            click.echo(f"{told} {folder}", err=True)
            return
        from ringsim.analysis.design import open_stored

        with open_stored(folder) as found:
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
    """Show how many samples of the campaign in FOLDER are done, failed, running and left, their
    outcomes, and the next command.

    It only reads, and may be called while the campaign runs.
    """
    for line in status_lines(open_folder(folder)):
        click.echo(line)


# One sample again.


Arrays = dict[str, NDArray[Any]]


def _rounded(value: Any) -> str:
    """A drawn value for people; ``--scene`` prints it with all digits."""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_rounded, value))}]"
    return show(value)


@click.command()
@FOLDER
@click.argument("sample", type=int)
@click.option("--scene", is_flag=True, help="Print the sample's scene without running it.")
@click.option(
    "--check", is_flag=True, help="Repeat the sample's check with the full engine instead."
)
@click.option("--save", metavar="FILE", type=PATH, help="Write the run to a netCDF file.")
@SETTINGS
@click.option("--solver", "allowed", hidden=True, default="", help="As for ringsim campaign.")
def replay_command(
    folder: Path, sample: int, *, scene: bool, check: bool, save: Path | None,
    settings: dict[str, Any], allowed: str,
) -> int:  # fmt: skip
    """Run SAMPLE of the campaign in FOLDER again in this process, and compare the results; with
    --set, tell what the sample would have given so.

    Nothing in the folder changes.  Everything that the solver prints is shown; a crash or a hang
    happens here, where a debugger can look at it.
    """
    from ringsim.dataset import save as write

    campaign = open_folder(folder)
    if save is not None:
        if scene:
            raise InputError(f"--save {save}: nothing runs with --scene: leave out one of the two")
        require_file(save)
    if not 0 <= sample < campaign.table.samples:
        raise InputError(
            f"sample {sample} is not in {folder}: choose one from 0 to {campaign.table.samples - 1}"
        )
    solver, number = campaign.attributes["solver"], sample
    if check:
        if "judge" not in campaign.attributes:
            raise InputError(
                f"--check: {folder} has no checks with the full engine (check_every): leave it out"
            )
        solver, number = campaign.attributes["judge"], check_of(sample)
    modules = {name.partition(":")[0] for name in (*SOLVERS.values(), allowed) if name}
    if solver.partition(":")[0] not in modules:
        # A file from elsewhere must not choose what code runs.
        raise InputError(
            f"{folder}: its design.nc names the solver {solver!r}, which ringsim does not have "
            f"({', '.join(SOLVERS.values())}): replay the campaign with the version of ringsim "
            "that ran it"
        )
    before = next(campaign.survey(checks=check).results([sample]), None)
    values = campaign.table.values_of(sample) | (before.overrides if before is not None else {})
    values |= settings
    exact = campaign.scene.with_values(values)
    if scene:
        click.echo(exact.to_toml())
        return EXIT_DONE
    faulthandler.enable()
    if told := other_build(campaign):
        click.echo(told)
    for column in campaign.table.columns:
        if column.input and not column.path:  # what others follow
            click.echo(f"{column.input} = {_rounded(column.values[sample].item())}")
    for path, value in values.items():
        click.echo(f"{path} = {_rounded(value)}")
    result = solve(load_solver(solver), campaign.scene, number, values)
    if result.log:
        click.echo(result.log)
    name = f"{'check of ' * check}sample {sample}"
    how = result.fate.words if result.fate else result.status.word
    click.echo(f"{name}: {how}: {result.reason}; computed in {result.seconds:.2f} s")
    if save is not None:
        from ringsim.dataset import to_dataset

        arrays = result.arrays()
        coordinates = {name: arrays.pop(name) for name in COORDINATES if name in arrays}
        outcome = Outcome(result.status, result.reason, coordinates, arrays, result.cause)
        dataset = to_dataset(outcome, exact)
        dataset.attrs["title"] += f", {name} of {campaign.attributes['campaign_name']}"
        write(dataset, save)
        click.echo(f"wrote {save}")
    if before is None:
        click.echo("there is no stored result to compare with")
    elif settings:
        told = ", ".join(f"{path} = {_rounded(value)}" for path, value in settings.items())
        click.echo(f"with {told} beside the stored result:")
        for line in _left_alone(campaign.table, sample, settings):
            click.echo(f"  {line}")
        for line in changed(result.arrays(), before.arrays()):
            click.echo(f"  {line}")
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


def _left_alone(table: Table, sample: int, settings: Mapping[str, Any]) -> Iterator[str]:
    """What keeps its drawn value though it shares that with a path that was set."""
    set_ = {c.input: c.path for c in table.columns if c.input and c.path in settings}
    for column in table.columns:
        if column.path and column.input in set_ and column.path not in settings:
            value = _rounded(plain(column.values[sample]))
            other = set_[column.input]
            yield f"{column.path} keeps {value}, which it shared with {other}: set it, too"


def _differences(result: Result, before: Result) -> list[str]:
    """Names of what a replay gave differently, timings aside."""
    new, old = result.arrays(), before.arrays()
    status = ["status"] if result.status != before.status else []
    return status + [
        name for name in sorted((new.keys() | old.keys()) - set(TIMINGS))
        if name not in new or name not in old
        or not np.array_equal(new[name], old[name], equal_nan=new[name].dtype.kind == "f")
    ]  # fmt: skip


def changed(new: Arrays, old: Arrays) -> list[str]:
    """What a summary tells of both, and by how much the new value is larger."""
    lines = []
    both = [each for each in (old, new) if "outcome" in each]
    if len(fates := [Fate(int(each["outcome"])).words for each in both]) == 2:
        lines += [f"{'outcome':<24} {' -> '.join(fates)}"] * (fates[0] != fates[1])
    for name, variable in VARIABLES.items():
        if variable.summary is None or name in TIMINGS or name not in new or name not in old:
            continue
        before, after = float(old[name]), float(new[name])
        # Of margins, which may be negative, no share tells anything.
        apart = before > 0.0 and np.isfinite(after) and before != after
        share = 100.0 * (after / before - 1.0) if apart else 0.0
        more = f" ({share:{'+.0f' if abs(share) >= 100.0 else '+.2g'}} %)" * apart
        bars = [float(each.get(f"{name}_error", np.nan)) for each in (old, new)]
        factor, unit = readable(variable.units, np.nanmax(np.abs([before, after, 0.0])))
        values = " -> ".join(
            "none" if np.isnan(value) else
            f"{factor * value:.5g}" + f" +- {factor * bar:.2g}" * bool(np.isfinite(bar))
            + f" {unit_text(unit)}" * (unit_text(unit) != "")
            for value, bar in zip((before, after), bars, strict=True)
        )  # fmt: skip
        lines.append(f"{variable.summary[0]:<24} {values}{more}")
    return lines


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
            unit = unit_text(VARIABLES[name].units)
            (beyond if np.any(apart > bars[name]) else within).append(f"{told} {unit}".rstrip())
    lines = []
    if sizes:
        most = max(sizes, key=sizes.__getitem__)
        lines.append(f"largest relative difference: {sizes[most]:.2g} ({most})")
    if within or beyond:
        how = "ABOVE" if beyond else "below"
        lines.append(f"{how} the error bars: {', '.join(beyond or within)}")
    else:
        lines.append("none of these outputs has an error bar")
    return lines
