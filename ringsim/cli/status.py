"""``ringsim status``: how far a campaign is."""

from __future__ import annotations

import logging
from pathlib import Path

import click

from ringsim.campaign.folder import open_folder
from ringsim.campaign.status import standing


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
def command(folder: Path) -> None:
    """Tell how many samples of the campaign in FOLDER are done, failed, running and left.

    It only reads, and may be called while the campaign runs.
    """
    logging.basicConfig(format="%(message)s")
    for line in standing(open_folder(folder)).lines():
        click.echo(line)
