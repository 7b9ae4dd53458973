"""``ringsim accuracy SCENE``."""

from __future__ import annotations

import os
from pathlib import Path

import click

from ringsim.overrides import parse_assignment
from ringsim.scene import load_scene


@click.command("accuracy")
@click.argument("scene", metavar="SCENE")
@click.option(
    "--set", "settings", metavar="PATH=VALUE", multiple=True, help="Override a scene field."
)
@click.option(
    "--out", metavar="DIR", type=click.Path(path_type=Path),
    help="Folder (default runs/accuracy-SCENE).",
)  # fmt: skip
@click.option(
    "--workers", type=click.IntRange(1, 4096), help="Solver processes (default: all cores)."
)
def command(scene: str, settings: tuple[str, ...], out: Path | None, workers: int | None) -> None:
    """Compare numerical settings of SCENE: error against run time, and which to choose.

    Writes accuracy.nc, accuracy.md, accuracy.png and settings.toml (for ``run --accuracy``); the
    same command again goes on with an interrupted study.
    """
    chosen = load_scene(scene)
    if settings:
        chosen = chosen.with_values(dict(parse_assignment(text) for text in settings))
    folder = out or Path("runs") / f"accuracy-{chosen.name}"

    from ringsim.analysis.accuracy_text import tables
    from ringsim.analysis.evidence import evidence_of, to_toml
    from ringsim.campaign.accuracy import run_ladder
    from ringsim.dataset import save
    from ringsim.plots.accuracy import draw_accuracy

    found = run_ladder(folder, chosen, workers or len(os.sched_getaffinity(0)))
    found.attrs["title"] = f"Error against run time: {chosen.name}"
    found.attrs["scene"] = chosen.to_toml()
    save(found, folder / "accuracy.nc")
    text = tables(found, str(found.attrs["title"]))
    (folder / "accuracy.md").write_text(text, encoding="utf-8")
    (folder / "settings.toml").write_text(to_toml(evidence_of(found)), encoding="utf-8")
    draw_accuracy(found, folder / "accuracy.png")
    click.echo(text)
    for name in ("accuracy.nc", "accuracy.md", "accuracy.png", "settings.toml"):
        click.echo(f"wrote {folder / name}")
