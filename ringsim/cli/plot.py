"""``ringsim plot FILE``."""

from pathlib import Path
from typing import Any

import click

from ringsim.cli.opening import opened
from ringsim.cli.options import ANIMATE, COLOUR, PATH, PLOT_FORMAT, require_animate
from ringsim.refusal import InputError


@click.command()
@click.argument("file", type=PATH)
@PLOT_FORMAT
@ANIMATE
@COLOUR
@click.option(
    "--sample", type=int, metavar="N",
    help="The sample of a campaign that --animate shows (default: the worst).",
)  # fmt: skip
@click.option("--out", metavar="DIR", type=PATH, help="Folder for the figures (default: FILE's).")
def command(
    file: Path, formats: tuple[str, ...] | None, *, animate: bool, colour: str | None,
    sample: int | None, out: Path | None,
) -> None:  # fmt: skip
    """Draw the figures of a run, or of a campaign, from its FILE.

    FILE is what ringsim run, ringsim replay --save, ringsim campaign or ringsim merge has written.
    """
    require_animate(colour, animate=animate)
    if sample is not None and not animate:
        raise InputError(f"--sample {sample}: says nothing without --animate; give both")
    from ringsim.analysis.stored import MERGED
    from ringsim.plots.campaign.figures import draw_campaign
    from ringsim.plots.run import draw_run

    with opened(file) as dataset:
        file = file / MERGED if file.is_dir() else file
        campaign = "sample" in dataset.dims
        needed = {"scene", "campaign"} if campaign else {"scene", "reason"}
        if not needed <= dataset.attrs.keys() or "status" not in dataset:
            raise InputError(
                f"{file}: holds neither a run nor a campaign: give a file that ringsim run or "
                "ringsim campaign has written (campaign.nc)"
            )
        draw, folder = draw_campaign if campaign else draw_run, out or file.parent
        drawn = draw(dataset, folder, file.stem, formats or ("png",))
        for picture in drawn:
            click.echo(f"wrote {picture}")
        if not drawn:
            click.echo(f"{file}: nothing to draw: no run got as far as its first record")
        elif animate:
            from ringsim.plots.animation import animate as write_animation

            run, name = _shown(dataset, sample, file)
            moving = write_animation(run.load(), folder / f"{name}.gif", colour or "lag")
            click.echo(f"wrote {moving}")


def _shown(dataset: Any, sample: int | None, file: Path) -> tuple[Any, str]:
    """The run to animate, and the name of its file."""
    from ringsim.analysis.campaign_samples import median_and_worst

    if "sample" not in dataset.dims:
        if sample is not None:
            raise InputError(f"--sample {sample}: {file} holds one run: leave it out")
        return dataset, file.stem
    if sample is None:
        chosen = median_and_worst(dataset)
        sample = int(dataset["sample"][0]) if chosen is None else chosen[1]
    if sample not in dataset["sample"]:
        raise InputError(
            f"--sample {sample}: {file} holds samples 0 to {dataset.sizes['sample'] - 1}"
        )
    return dataset.sel(sample=sample), f"{file.stem}-sample{sample}"
