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
    """Draw the figures of a run from FILE, which ringsim run or replay --save has written."""
    import xarray as xr

    from ringsim.plots.run import draw_run

    try:
        dataset = xr.load_dataset(file, engine="netcdf4")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"{file}: cannot be read as a netCDF file: {reason}; give a file that ringsim run has "
            "written"
        ) from None
    if "sample" in dataset.dims:
        raise InputError(
            f"{file}: holds {dataset.sizes['sample']} samples of a campaign: write one of them "
            "with ringsim replay FOLDER SAMPLE --save run.nc, and plot that file"
        )
    if not {"scene", "reason"} <= dataset.attrs.keys() or "status" not in dataset:
        raise InputError(f"{file}: holds no run: give a file that ringsim run has written")
    drawn = draw_run(dataset, file.parent if out is None else out, file.stem, formats or ("png",))
    for picture in drawn:
        click.echo(f"wrote {picture}")
    if not drawn:
        click.echo(f"{file}: nothing to draw: the run ended before its first record")
