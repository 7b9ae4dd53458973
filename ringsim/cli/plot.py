"""``ringsim plot FILE``."""

from pathlib import Path

import click

from ringsim.cli.options import PATH, PLOT_FORMAT
from ringsim.refusal import InputError


@click.command()
@click.argument("file", type=PATH)
@PLOT_FORMAT
@click.option("--out", metavar="DIR", type=PATH, help="Folder for the figures (default: FILE's).")
def command(file: Path, formats: tuple[str, ...] | None, out: Path | None) -> None:
    """Draw the figures of a run, or of a campaign, from its FILE.

    FILE is what ringsim run, ringsim replay --save, ringsim campaign or ringsim merge has written.
    """
    from ringsim.analysis.stored import open_stored
    from ringsim.plots.campaign.figures import draw_campaign
    from ringsim.plots.run import draw_run

    with open_stored(file) as dataset:
        campaign = "sample" in dataset.dims
        needed = {"scene", "campaign"} if campaign else {"scene", "reason"}
        if not needed <= dataset.attrs.keys() or "status" not in dataset:
            raise InputError(
                f"{file}: holds neither a run nor a campaign: give a file that ringsim run or "
                "ringsim campaign has written (campaign.nc)"
            )
        draw = draw_campaign if campaign else draw_run
        drawn = draw(dataset, file.parent if out is None else out, file.stem, formats or ("png",))
        for picture in drawn:
            click.echo(f"wrote {picture}")
        if not drawn:
            click.echo(f"{file}: nothing to draw: no run got as far as its first record")
