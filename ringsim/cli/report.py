"""``ringsim report``: a campaign as one page."""

from pathlib import Path
from typing import Any

import click

from ringsim.cli.opening import opened
from ringsim.cli.options import PATH
from ringsim.files import require_place
from ringsim.refusal import InputError


@click.command()
@click.argument("folder", metavar="DIR", type=PATH)
@click.option("--out", metavar="FILE", type=PATH, default=Path("report.html"), show_default=True)
@click.option(
    "--analysis", metavar="FILE", type=PATH,
    help="File of ringsim analyse --out with what to show instead of an analysis of today.",
)  # fmt: skip
def command(folder: Path, out: Path, analysis: Path | None) -> None:
    """Write one page about the campaign in DIR, or in a file campaign.nc.

    The page holds all that it shows, and loads nothing: it can be mailed, printed and kept.
    """
    from ringsim.analysis.stored import MERGED

    require_place(out)
    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"--out {out}: the page is HTML: write {out.stem}.html")
    with opened(folder) as campaign:
        _write(campaign, folder / MERGED if folder.is_dir() else folder, out, analysis)


def _write(campaign: Any, file: Path, out: Path, analysis: Path | None) -> None:
    from ringsim.report.page import LARGEST, write_report

    if "sample" not in campaign.dims or not {"scene", "campaign"} <= campaign.attrs.keys():
        raise InputError(f"{file}: holds no campaign: give the folder that ringsim campaign named")
    known = None if analysis is None else _load(analysis)
    if known is not None and "statistic" not in known.dims:
        raise InputError(
            f"--analysis {analysis}: holds no analysis: give what ringsim analyse --out has "
            "written, or leave it out"
        )
    size = write_report(campaign, out, str(file.parent), known)
    click.echo(f"wrote {out} ({size / 1e6:.2f} MB)")
    if size > LARGEST:
        click.echo(f"{out}: larger than {LARGEST / 1e6:g} MB, the size it is meant to have")


def _load(file: Path) -> Any:
    import xarray as xr

    try:
        return xr.load_dataset(file, engine="netcdf4")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"{file}: cannot be read as a netCDF file: {reason}; merge again, or give another one"
        ) from None
