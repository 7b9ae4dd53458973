"""``ringsim run``: one run, and how far it is on a terminal."""

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from tqdm import tqdm

from ringsim.cli.options import (
    ANIMATE,
    COLOUR,
    PATH,
    PLOT_FORMAT,
    SCENE,
    SETTINGS,
    Formats,
    draw_figures,
    require_with,
    write_animation,
)
from ringsim.files import require_file
from ringsim.outputs import VARIABLES
from ringsim.outputs.balance import summary
from ringsim.outputs.base import DOUBT, may_be_off
from ringsim.parts.solver import Solver
from ringsim.refusal import EXIT_DONE, EXIT_FAILED, InputError
from ringsim.scene import Scene, load_scene
from ringsim.scene.checks import doubtful
from ringsim.stepping.instant import Instant, Watch
from ringsim.stored_state import require_fit
from ringsim.variables import GONE, Outcome

if TYPE_CHECKING:
    from ringsim.outputs.recorder import StoredState

# How far a run is, on a terminal.


def watched(run: Callable[[Scene, Watch | None], Outcome], scene: Scene) -> Outcome:
    """Run a scene by ``run``; where stderr is a terminal a bar counts its time up to
    ``solver.end_time``, and the V-joints that have locked.  A run that starts anew starts its bar
    anew.
    """
    most = 0
    with tqdm(
        total=scene.solver.end_time, desc=scene.name, leave=False,
        disable=not sys.stderr.isatty(),
        bar_format="{desc}: {n:.3g} of {total:g} s |{bar}| {elapsed}{postfix}",
    ) as bar:  # fmt: skip

        def show(now: Instant) -> None:
            nonlocal most
            most = 0 if now.time < bar.n else most
            if scene.structure.locks:
                most = max(most, int((now.angles >= np.pi).sum()))
                bar.set_postfix_str(f"{most} of {now.angles.size} V-joints locked", refresh=False)
            bar.update(now.time - bar.n)

        return run(scene, None if bar.disable else show)


class _Fidelity(click.Choice[str]):
    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Refuse what there was with what to do."""
        if value in GONE:
            raise InputError(f"--fidelity {value}: {GONE[value]}")
        return super().convert(value, param, ctx)


@click.command()
@SCENE
@SETTINGS
@click.option("--out", metavar="FILE", type=PATH, help="netCDF file to write (default SCENE.nc).")
@click.option(
    "--fidelity", type=_Fidelity(["full", "frame", "both"]),
    help=
        "Engine: full (exudyn), frame (for rings, about thirty times as fast), or both, with a "
        "table of their differences.  [default: frame if it can run the scene, else full; or "
        "what --accuracy selects]",
)  # fmt: skip
@click.option(
    "--accuracy", metavar="ERROR", type=click.FloatRange(1e-8, 1.0),
    help=
        "Target for the relative error of deployment time and opening angle: selects the "
        "cheapest engine and settings that were measured to reach it.",
)  # fmt: skip
@click.option(
    "--of", metavar="OUTPUT",
    help="Output for --accuracy instead: loads, asynchrony, peak_tension, ...",
)  # fmt: skip
@click.option(
    "--evidence", metavar="FILE", type=PATH,
    help=
        "Measured settings, settings.toml of ringsim accuracy (default: of the most similar "
        "built-in scene).",
)  # fmt: skip
@click.option(
    "--from", "origin", metavar="FILE", type=PATH,
    help=
        "Continue from a state that an earlier run has stored in its netCDF file "
        "(record.state_interval).",
)  # fmt: skip
@click.option(
    "--at", metavar="TIME", type=click.FloatRange(min=0.0),
    help="Time of that state, s.  [default: the last one]",
)  # fmt: skip
@click.option("--plot", is_flag=True, help="Draw figures beside the netCDF file.")
@PLOT_FORMAT
@ANIMATE
@COLOUR
def run_command(
    scene: str, settings: dict[str, Any], out: Path | None, fidelity: str | None,
    accuracy: float | None, of: str | None, evidence: Path | None, origin: Path | None,
    at: float | None, *, plot: bool, formats: Formats, animate: bool,
    colour: str | None,
) -> int:  # fmt: skip
    """Run SCENE (a built-in name or a TOML file) and write SCENE.nc."""
    chosen = load_scene(scene)
    if accuracy is not None:
        chosen, fidelity = _with_accuracy(chosen, accuracy, of, evidence, settings, fidelity)
    start = _start(origin, at)
    require_with("--of", of, "--accuracy", accuracy)
    require_with("--evidence", evidence, "--accuracy", accuracy)
    require_with("--plot-format", formats, "--plot", plot)
    require_with("--colour", colour, "--animate", animate)
    chosen = chosen.with_values(settings)
    if colour == "stress" and not chosen.record.stress:
        raise InputError("--colour stress: needs the stresses: give --set record.stress=true, too")
    target = out or Path(f"{chosen.name}.nc")

    from ringsim.outputs.recorder import against_limits
    from ringsim.simulation import run, run_frame

    require_file(target)
    # The frame engine first: it refuses what it cannot represent.
    asked = ("frame", "full") if fidelity == "both" else (fidelity or "frame",)
    for name in asked:
        require_fit(start, chosen, name)
    for line in doubtful(chosen):
        click.echo(f"doubtful: {line}")
    engines = {"frame": partial(run_frame, start=start), "full": partial(run, start=start)}
    try:
        outcomes = {name: watched(engines[name], chosen) for name in asked}
    except InputError as error:
        if fidelity is not None or start is not None:
            raise
        # Behind the last colon stands the cure, which is taken here.
        click.echo(f"using the full model: {str(error).rpartition(': ')[0] or error}")
        outcomes = {"full": watched(engines["full"], chosen)}
    if start is not None:  # told once nothing has refused it
        click.echo(outcomes[asked[0]].began)
    from ringsim.dataset import save, to_dataset  # behind the run: xarray takes most of a second

    datasets = [to_dataset(outcome, chosen) for outcome in outcomes.values()]
    dataset, lines = datasets[-1], []
    if fidelity == "both":
        from ringsim.analysis.engines import run_lines, with_frame

        lines = list(run_lines(outcomes["frame"], outcomes["full"]))
        dataset = with_frame(*reversed(datasets))
    # Replaced, not refused: to change a scene and run it again is what one does all day, and
    # scripts do it with one name.  Everything of a run can be computed again from its file.
    done = "replaced" if target.exists() else "wrote"
    save(dataset, target)
    for by, outcome in outcomes.items():
        values = outcome.values
        became = "" if outcome.status.failed else f", {outcome.fate.word.replace('_', ' ')}"
        engine = f" ({by})" if len(outcomes) > 1 else ""
        click.echo(f"{chosen.name}{engine}: {outcome.status.word}{became}: {outcome.reason}")
        if anew := _restarted(values, chosen.solver):
            click.echo(f"  {anew}")
        off, _ = may_be_off(outcome.reason)
        for name, told in summary(outcome.coordinates | values, chosen.span_names).items():
            label = (VARIABLES[name].summary or ("",))[0] + DOUBT * (name in off)
            if anew or name != "total_steps":
                click.echo(f"  {label:20s}{told}")
        for told in against_limits(chosen, values):
            click.echo(f"  {told}")
    for line in lines:
        click.echo(f"  {line}")
    click.echo(f"{done} {target}")
    if plot:
        draw_figures(dataset, target.parent, target.stem, formats)
        drawn = chosen.structure.locks and chosen.rods.oriented
        # Not recorded for the figure: steps that resolve the rods' vibration are another run.
        if drawn and not chosen.record.stress:
            click.echo("figures of stress need --set record.stress=true")
    if animate:
        write_animation(dataset, target.with_suffix(".gif"), colour)
        if not chosen.record.positions:
            click.echo("computed positions need --set record.positions=true")
    failed = any(outcome.status.failed for outcome in outcomes.values())
    return EXIT_FAILED if failed else EXIT_DONE


def _start(origin: Path | None, at: float | None) -> "StoredState | None":
    """The state to go on from."""
    from ringsim.stored_state import read_state

    if origin is None and at is not None:
        raise InputError(f"--at {at:g}: has no effect without --from; give both")
    return None if origin is None else read_state(origin, at)


def _restarted(values: dict[str, Any], asked: Solver) -> str:
    """With which settings a run that started anew was computed; empty if it did not."""
    if not (times := int(values.get("restarts", 0))):
        return ""
    used = f"solver.step = {values['step_used'].item():.3g} s instead of {asked.step:.3g} s"
    if np.isfinite(values["tolerance_used"]):
        tolerance = values["tolerance_used"].item()
        used += f", solver.tolerance = {tolerance:.2g} instead of {asked.tolerance:.2g}"
    return (
        f"restarted {times} times: computed with {used} (solver.restarts = 0 to see the "
        "first start fail instead)"
    ).replace("1 times", "once")


def _with_accuracy(
    scene: Scene, accuracy: float, of: str | None, file: Path | None, given: dict[str, Any],
    fidelity: str | None,
) -> tuple[Scene, str]:  # fmt: skip
    """The scene with the cheapest settings that were measured to be so accurate, and their engine,
    which is ``fidelity`` unless that is None.
    """
    from ringsim.analysis.study import CHOICES, JUDGED_BY, evidence_for, read_evidence
    from ringsim.simulation import why_not_frame

    if fidelity == "both":
        raise InputError(
            f"--accuracy {accuracy:g}: settings were measured for the full and the frame engine, "
            f"not for --fidelity {fidelity}: leave out one of the two"
        )
    if (output := of or JUDGED_BY) not in CHOICES:
        raise InputError(f"--of {output}: must be one of {', '.join(CHOICES)}")
    changed = scene.with_values(given)
    known = read_evidence(file) if file is not None else evidence_for(changed)
    known.require_like(changed)
    picked = known.pick(accuracy, output, fidelity)
    if picked.fidelity == "frame" and fidelity is None and why_not_frame(changed):
        picked = known.pick(accuracy, output, "full")
    if clash := sorted(set(picked.values) & set(given)):
        raise InputError(
            f"--set {clash[0]}: --accuracy selects this value: leave out one of the two"
        )
    values = known.values_for(picked, changed)
    words = ", ".join(f"{path} = {value}" for path, value in values.items())
    errors = ", ".join(f"{name.replace('_', ' ')} {e:.2g}" for name, e in picked.errors.items())
    click.echo(f"settings for {accuracy:g}: fidelity = {picked.fidelity}, {words}")
    click.echo(f"  errors measured with {known.scene}: {errors}")
    return scene.with_values(values), picked.fidelity
