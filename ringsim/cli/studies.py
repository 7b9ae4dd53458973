"""``ringsim modes``, ``accuracy``, ``stability``, ``calibrate``, ``sensors`` and ``optimise``."""

import os
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click
import tomli_w

from ringsim.campaign.run import Ended
from ringsim.campaign.studies import Panel, by_engines, panels_over
from ringsim.cli.options import (
    PATH,
    PLOT_FORMAT,
    SCENE,
    SETTINGS,
    WORKERS,
    Formats,
    draw_result,
    require_with,
)
from ringsim.execution.mpi import launched_size
from ringsim.files import read_text, require_file, write_text
from ringsim.refusal import EXIT_BAD_INPUT, EXIT_DONE, EXIT_FAILED, InputError
from ringsim.scene import load_scene
from ringsim.tables import Table, counted

_WORKERS = click.option(
    "--workers", metavar="N", type=WORKERS, help="Solver processes (default: all cores)."
)
_DRY_RUN = click.option(
    "--dry-run", is_flag=True,
    help="Check the file, time one run, and show what all would cost; store nothing.",
)  # fmt: skip


@click.command()
@SCENE
@SETTINGS
@click.option(
    "--at", metavar="ANGLES",
    help="Opening angles, deg, e.g. 10,40,90 or stowed,deployed (default: see --points).",
)  # fmt: skip
@click.option(
    "--points", metavar="N", type=click.IntRange(2, 200),
    help="So many angles, evenly from stowed to deployed (default 9).",
)  # fmt: skip
@click.option(
    "--modes", "count", metavar="N", type=click.IntRange(1, 100), default=6, show_default=True,
    help="Modes at each angle, beside motions that nothing holds.",
)  # fmt: skip
@click.option(
    "--latched/--free", "latched", default=None,
    help=
        "Hold V-joints at every angle by the stiffness of their stop, or let them turn (default: "
        "held where the ring is fully open).",
)  # fmt: skip
@click.option(
    "--tension", metavar="N", type=click.FloatRange(0.0, 1e6), default=0.0, show_default=True,
    help="Tension of the ropes, whose winches hold; 0: they are slack.",
)  # fmt: skip
@click.option("--out", metavar="FILE", type=PATH, help="netCDF file (default SCENE-modes.nc).")
@click.option("--plot", is_flag=True, help="Draw frequencies and shapes beside the netCDF file.")
@PLOT_FORMAT
def modes_command(
    scene: str, settings: dict[str, Any], at: str | None, points: int | None, count: int,
    latched: bool | None, tension: float, out: Path | None, *, plot: bool, formats: Formats,
) -> int:  # fmt: skip
    """Natural frequencies and shapes of SCENE, at rest at opening angles from stowed to deployed.

    Free V-joints leave the mechanism free, latched ones are as stiff as the scene's stop; gravity,
    the net and the base are the scene's.  Writes SCENE-modes.nc.
    """
    require_with("--plot-format", formats, "--plot", plot)
    if at is not None and points is not None:
        raise InputError(f"--points {points}: --at says which angles: leave out one of the two")
    chosen = load_scene(scene).with_values(settings)
    target = out or Path(f"{chosen.name}-modes.nc")
    require_file(target)

    from ringsim.dataset import save
    from ringsim.vibration import modes, modes_tables

    found = modes(
        chosen, None if at is None else at.split(","), points=points or 9, count=count,
        latched=latched, tension=tension,
    )  # fmt: skip
    save(found, target)
    for table in modes_tables(found):
        for line in [table.title, *table.lines(), ""]:
            click.echo(line)
    click.echo(f"wrote {target}")
    if plot:
        draw_result(found, target.parent, target.stem, formats)
    return EXIT_DONE


@click.command()
@SCENE
@SETTINGS
@click.option("--out", metavar="DIR", type=PATH, help="Folder (default runs/accuracy-SCENE).")
@_WORKERS
@click.option(
    "--timeout", metavar="SECONDS", type=click.FloatRange(0.0, min_open=True), default=1800.0,
    show_default=True, help="Time limit for each setting.",
)  # fmt: skip
@click.option(
    "--most-elements", type=click.Choice(["4", "8"]), default="4", show_default=True,
    help=
        "Largest number of elements, as a multiple of the scene's; 8 gives peak stresses to 1e-3 "
        "at several times the cost.",
)  # fmt: skip
@click.option(
    "--brief", is_flag=True,
    help=
        "A shorter study (a quarter of the cost): steps down to a quarter instead of a sixteenth "
        "of the scene's, at most twice its elements; constant steps, rods, dissipation and "
        "Newton tolerance are not varied.",
)  # fmt: skip
@click.option(
    "--fidelity", type=click.Choice(["both", "frame"]), default="both", show_default=True,
    help=
        "Engines to compare; frame: only that engine, at a tenth of the cost, with its own limit "
        "as reference.",
)  # fmt: skip
def accuracy_command(
    scene: str, settings: dict[str, Any], out: Path | None, workers: int | None, timeout: float,
    most_elements: str, brief: bool, fidelity: str,
) -> int:  # fmt: skip
    """Compare numerical settings of SCENE: error against run time, and which to choose.

    Writes accuracy.nc, accuracy.md, accuracy.png and settings.toml (for ringsim run --accuracy);
    the same command again goes on with an interrupted study, and tries settings again that took
    longer than --timeout.  Exit codes: 0 done, 2 bad input, 3 too few runs for a reference ended
    well.
    """
    chosen = load_scene(scene).with_values(settings)
    folder = out or Path("runs") / f"accuracy-{chosen.name}"

    from ringsim.analysis.accuracy import lines, tables
    from ringsim.analysis.study import evidence_of
    from ringsim.campaign.studies import ReferenceRunError, run_ladder
    from ringsim.dataset import save
    from ringsim.plots.figures import write
    from ringsim.plots.studies import accuracy

    try:
        cores = workers or len(os.sched_getaffinity(0))
        engine = "frame" if fidelity == "frame" else "full"
        found = run_ladder(
            folder, chosen, cores, timeout, int(most_elements), brief=brief, fidelity=engine
        )
    except ReferenceRunError as error:
        click.echo(f"{chosen.name}: {error}", err=True)
        return EXIT_FAILED
    title = f"Error against run time: {chosen.name}"
    found.attrs |= {"title": title, "scene": chosen.to_toml()}
    save(found, folder / "accuracy.nc")
    write_text(folder / "accuracy.md", tables(found, title))
    write_text(folder / "settings.toml", tomli_w.dumps(evidence_of(found).model_dump()))
    write(accuracy(found), folder / "accuracy.png")
    for line in lines(found, title):
        click.echo(line)
    for name in ("accuracy.nc", "accuracy.md", "accuracy.png", "settings.toml"):
        click.echo(f"wrote {folder / name}")
    return EXIT_DONE


@click.command()
@SCENE
@SETTINGS
@click.option(
    "--over", metavar="PATH=LOW..HIGH", multiple=True,
    help=
        "Axis of a panel; each two give one panel (x, then y). cables.*.NAME is NAME of all "
        "cables. Default: panels that suit the scene.",
)  # fmt: skip
@click.option(
    "--points", metavar="N", type=click.IntRange(2, 30), default=5, show_default=True,
    help="Values of each axis.",
)  # fmt: skip
@click.option(
    "--out", metavar="DIR", type=PATH,
    help="Folder of the results (default runs/stability-SCENE).",
)  # fmt: skip
@click.option(
    "--workers", metavar="N", type=WORKERS, default=1, show_default=True, help="Solver processes."
)
@click.option(
    "--check", "percent", metavar="PERCENT", type=click.FloatRange(0.0, 100.0, min_open=True),
    default=10.0, show_default=True,
    help="Percentage of the ok cells that are run again with smaller steps.",
)  # fmt: skip
@click.option(
    "--fidelity", type=click.Choice(["full", "frame", "both"]), default="full", show_default=True,
    help=
        "Engine of the runs; both: side by side with error bars, and cells marked where they "
        "differ.",
)  # fmt: skip
def stability_command(
    scene: str, settings: dict[str, Any], over: tuple[str, ...], points: int, out: Path | None,
    workers: int, percent: float, fidelity: str,
) -> int:  # fmt: skip
    """Map around SCENE: which pairs of values run well, and how runs end elsewhere.

    Each panel has two axes, for example --over cables.*.axial_stiffness=1e3..1e7 --over
    solver.step=0.01..1; each of its cells is one run.  From HIGH = 10 LOW on values are spaced
    geometrically.  Writes stability.nc, stability.png and stability.md; the same command goes on
    after an interruption.  Exit codes: 0 every cell is ok, or ended with a named cause; 2 bad
    input; 3 some cells are wrong.
    """
    chosen = load_scene(scene).with_values(settings)
    panels = by_engines(panels_over(chosen, over, points), fidelity)
    for panel in panels:
        x, y = (f"--over {s.label}={s.values[0]:g}..{s.values[-1]:g}" for s in (panel.x, panel.y))
        click.echo(f"{panel.title}: {x} {y}: {counted(len(list(panel.cells())), 'cell')}")
    return draw_map(out or Path("runs") / f"stability-{chosen.name}", panels, workers, percent)


def draw_map(folder: Path, panels: Sequence[Panel], workers: int, percent: float) -> int:
    """Run panels, check some percent of the ok cells, and write the map; returns the exit code."""
    from ringsim.analysis.stability import WRONG, summary, to_markdown
    from ringsim.campaign.studies import run_check, run_map
    from ringsim.dataset import save
    from ringsim.plots.figures import write
    from ringsim.plots.studies import stability

    whole = run_map(folder, panels, workers)
    # The same seed at every resumption, so that the same cells are checked.
    whole = run_check(folder, panels, whole, share=0.01 * percent, seed=1, workers=workers)
    save(whole, folder / "stability.nc")
    write(stability(whole), folder / "stability.png")
    write_text(folder / "stability.md", to_markdown(whole))
    click.echo(summary(whole))
    for name in ("stability.nc", "stability.png", "stability.md"):
        click.echo(f"wrote {folder / name}")
    return EXIT_FAILED if (whole["verdict"] == WRONG).any() else EXIT_DONE


@click.command()
@click.argument("file", metavar="FILE", type=PATH)
@SETTINGS
@click.option("--out", metavar="DIR", type=PATH, help="Folder (default runs/NAME).")
@_WORKERS
@_DRY_RUN
@click.option("--plot", is_flag=True, help="Draw what was learnt beside posterior.nc.")
def calibrate_command(
    file: Path, settings: dict[str, Any], out: Path | None, workers: int | None, *, dry_run: bool,
    plot: bool,
) -> int:  # fmt: skip
    """Find unknown inputs from measured data: FILE has priors, the data and a budget of runs.

    FILE is a campaign file without a design, with measured = "TEST.toml", runs and stages.  Writes
    posterior.nc, from which a campaign draws (inputs.from = "posterior.nc"); each stage is a
    campaign in the same folder.  The same command goes on with one that was interrupted; under
    mpiexec or srun every rank computes, and --workers is left out.
    """
    from ringsim.analysis.posterior import calibration_tables

    return _course(
        file, settings, out, workers, calibration_tables, planning=False, dry_run=dry_run, plot=plot
    )


@click.command()
@click.argument("file", metavar="FILE", type=PATH)
@SETTINGS
@click.option("--out", metavar="DIR", type=PATH, help="Folder (default runs/NAME-sensors).")
@_WORKERS
@_DRY_RUN
def sensors_command(
    file: Path, settings: dict[str, Any], out: Path | None, workers: int | None, *, dry_run: bool
) -> int:
    """Tell before a test how much each sensor would tell: FILE is as for calibrate.

    The readings need not exist: in the file of measured data clock.interval and clock.end take the
    place of the table.  Lists the sensors in the order in which they add most, with what is then
    left of the scatter of each unknown; writes sensors.nc.
    """
    from ringsim.analysis.residuals import sensors_table

    return _course(
        file, settings, out, workers, lambda d: [sensors_table(d)], planning=True, dry_run=dry_run
    )


@click.command()
@click.argument("file", metavar="FILE", type=PATH)
@SETTINGS
@click.option("--out", metavar="DIR", type=PATH, help="Folder (default runs/NAME).")
@_WORKERS
@_DRY_RUN
@click.option("--plot", is_flag=True, help="Draw the front beside front.nc.")
def optimise_command(
    file: Path, settings: dict[str, Any], out: Path | None, workers: int | None, *, dry_run: bool,
    plot: bool,
) -> int:  # fmt: skip
    """Find the values that make an antenna best under what is uncertain.

    FILE is a campaign file without a design, with variables, objectives and constraints.  Writes
    front.nc, a scene file for each design on the front, and its campaign of fresh samples; designs
    that were tried are campaigns in the same folder.  The same command goes on with one that was
    interrupted; under mpiexec or srun every rank computes, and --workers is left out.
    """
    from ringsim.analysis.front import front_tables
    from ringsim.campaign.optimisation import Given, first_order, optimisation_of, run_optimisation

    def given() -> Given:
        found = optimisation_of(read_text(file), file, settings)
        budget = found.budget
        click.echo(
            f"{found.table['name']}: up to {budget.designs} designs of {budget.samples} samples, "
            f"one after the other, checks of {budget.check}, then verdicts of {budget.verdict} "
            "each; what has run is kept"
        )
        return found

    if dry_run:
        return _plan(lambda: first_order(given()), workers)
    ended, path = run_optimisation(given, _most(workers), out)
    return _told(ended, path, front_tables, plot=plot)


def _most(workers: int | None) -> int | None:
    """Solver processes: those that are asked for, or one for each core; under an MPI launcher each
    rank has one.
    """
    return workers or (len(os.sched_getaffinity(0)) if launched_size() == 1 else None)


def _course(
    file: Path, settings: dict[str, Any], out: Path | None, workers: int | None,
    tables: Callable[[Any], list[Table]], *, planning: bool, dry_run: bool, plot: bool = False,
) -> int:  # fmt: skip
    from ringsim.campaign.calibration import Given, calibration_of, run_course
    from ringsim.campaign.run import Order

    def given() -> Given:  # where stages are ordered: on the first rank
        found = calibration_of(read_text(file), file, settings)
        stages, each = found.budget.stages, found.members
        click.echo(
            f"{found.campaign.specification.name}: {counted(stages * each, 'run')} in "
            f"{counted(stages, 'stage')} of {each}, one after the other; what has run is kept"
        )
        return found

    if dry_run:
        from ringsim.sampling.distributions import law_text

        def first() -> tuple[Order, int, int, str]:
            found = given()
            if not planning:
                found.require_readings()
            for name, law in found.budget.clock:
                if law is not None:
                    click.echo(f"  clock.{name}: {law_text(law.model_dump(mode='json'))}")
            runs, told = found.members * found.budget.stages, f"{found.budget.stages} stages"
            return Order(found.campaign, Path()), runs, 0, f"{told} x {found.members}"

        return _plan(first, workers)
    ended, path = run_course(given, _most(workers), out, planning=planning)
    return _told(ended, path, tables, plot=plot)


def _plan(first: Callable[[], tuple[Any, int, int, str]], workers: int | None) -> int:
    """Print what a course of campaigns would cost: an order that stands for all, how many runs and
    checks they have, and what they are.
    """
    from ringsim.campaign.plan import plan_of_course

    cores = _most(workers) or launched_size()
    for line in plan_of_course(*first(), cores, partial(click.echo, err=True)):
        click.echo(line)
    return EXIT_DONE


def _told(
    ended: Ended, path: Path, tables: Callable[[Any], list[Table]], *, plot: bool
) -> int:  # fmt: skip
    """Print what a course of campaigns has found, on the first rank; the exit code."""
    import xarray as xr

    if ended.refused is not None:
        if ended.first:
            raise ended.refused
        return EXIT_BAD_INPUT
    # All samples of the last campaign may have failed: what that means is told, too.
    if ended.first and ended.code in (EXIT_DONE, EXIT_FAILED) and path.exists():
        found = xr.load_dataset(path)
        for table in tables(found):
            for line in ["", *table.lines()]:
                click.echo(line)
        click.echo(f"wrote {path}")
        if plot:
            draw_result(found, path.parent, path.stem)
    return ended.code
