"""``ringsim merge``: put the results of a campaign into one file."""

from pathlib import Path

import click
import xarray as xr

from ringsim.analysis.campaign_notes import notes
from ringsim.analysis.engines import check_lines
from ringsim.campaign.folder import open_folder
from ringsim.campaign.merging import merge
from ringsim.campaign.stopping import as_decided
from ringsim.cli.options import FOLDER


@click.command()
@FOLDER
def command(folder: Path) -> None:
    """Write campaign.nc in FOLDER from the samples that are done; the others are missing values.

    It may be called at any time and any number of times, also while the campaign runs.
    """
    from ringsim.analysis.study_text import verdict_lines

    campaign = open_folder(folder)
    left, failed, path = merge(campaign, execution="merged on its own", partly=True)
    samples = as_decided(campaign).table.samples
    click.echo(f"{path}: {samples} samples, {samples - left} done, {left} not run, {failed} failed")
    if path is not None:
        with xr.open_dataset(path) as dataset:
            for line in [*notes(dataset), *check_lines(dataset), *verdict_lines(dataset)]:
                click.echo(f"  {line}")
