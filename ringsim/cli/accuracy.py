"""``ringsim accuracy SCENE``."""

import os
from pathlib import Path
from typing import Any

import click
import tomli_w

from ringsim.cli.options import PATH, SCENE, SETTINGS, WORKERS
from ringsim.exit_codes import EXIT_DONE, EXIT_FAILED
from ringsim.files import write_text
from ringsim.scene import load_scene


@click.command()
@SCENE
@SETTINGS
@click.option("--out", metavar="DIR", type=PATH, help="Folder (default runs/accuracy-SCENE).")
@click.option("--workers", metavar="N", type=WORKERS, help="Solver processes (default: all cores).")
@click.option(
    "--timeout", metavar="SECONDS", type=click.FloatRange(0.0, min_open=True), default=1800.0,
    show_default=True, help="Longest time of one setting.",
)  # fmt: skip
@click.option(
    "--most-elements", type=click.Choice(["4", "8"]), default="4", show_default=True,
    help="Elements up to so many times the scene's; 8 for peak stresses to 1e-3, at several times "
    "the cost.",
)  # fmt: skip
@click.option(
    "--brief", is_flag=True,
    help="A quarter of the cost: steps down to a quarter of the scene's instead of a sixteenth, "
    "elements up to twice the scene's, no constant steps, other rods, dissipation or Newton "
    "tolerances.",
)  # fmt: skip
@click.option(
    "--fidelity", type=click.Choice(["both", "frame"]), default="both", show_default=True,
    help="Engines to try; frame: that one alone, at a tenth of the cost, with its own limit as the "
    "reference.",
)  # fmt: skip
def command(
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

    from ringsim.analysis.accuracy_text import tables
    from ringsim.analysis.evidence import evidence_of
    from ringsim.campaign.accuracy import ReferenceRunError, run_ladder
    from ringsim.dataset import save
    from ringsim.plots.accuracy import accuracy
    from ringsim.plots.style import write

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
    text = tables(found, title)
    write_text(folder / "accuracy.md", text)
    write_text(folder / "settings.toml", tomli_w.dumps(evidence_of(found).model_dump()))
    write(accuracy(found), folder / "accuracy.png")
    click.echo(text)
    for name in ("accuracy.nc", "accuracy.md", "accuracy.png", "settings.toml"):
        click.echo(f"wrote {folder / name}")
    return EXIT_DONE
