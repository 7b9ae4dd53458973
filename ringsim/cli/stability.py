"""``ringsim stability``: where the solver is sound, and how it ends where it is not."""

from __future__ import annotations

import logging
from pathlib import Path

import click

from ringsim.exit_codes import EXIT_DONE, EXIT_FAILED
from ringsim.files import write_text

_SEED = 1


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("runs/stability"),
    show_default=True,
    help="Folder for the map and its campaigns.",
)
@click.option(
    "--workers", type=click.IntRange(1, 4096), default=1, show_default=True,
    help="Solver processes.",
)  # fmt: skip
@click.option("--quick", is_flag=True, help="A dozen cells instead of all.")
@click.option(
    "--check",
    "percent",
    type=click.FloatRange(0.0, 100.0, min_open=True),
    default=10.0,
    show_default=True,
    help="Share in percent of the ok cells that are run again with smaller steps.",
)
def command(out: Path, workers: int, *, quick: bool, percent: float) -> int:
    """Map over stiffness, masses, friction, fold angle, steps, stops, sections and loads.

    Writes stability.nc, stability.png and stability.md into the folder.  The same command goes on
    after an interruption.  Exit codes: 0 every cell is ok within what that promises, or ended
    with a cause; 3 some are wrong.
    """
    from ringsim.analysis.stability import WRONG
    from ringsim.analysis.stability_text import summary, to_markdown
    from ringsim.campaign.stability import run_check, run_map
    from ringsim.campaign.stability_groups import GROUPS, QUICK
    from ringsim.dataset import save
    from ringsim.plots import style
    from ringsim.plots.stability import stability

    logging.basicConfig(format="%(message)s")
    groups = QUICK if quick else GROUPS
    whole = run_map(out, groups, workers)
    whole = run_check(out, groups, whole, share=0.01 * percent, seed=_SEED, workers=workers)
    save(whole, out / "stability.nc")
    style.write(stability(whole), out / "stability.png")
    write_text(out / "stability.md", to_markdown(whole))
    click.echo(summary(whole))
    for name in ("stability.nc", "stability.png", "stability.md"):
        click.echo(f"wrote {out / name}")
    return EXIT_FAILED if (whole["verdict"] == WRONG).any() else EXIT_DONE
