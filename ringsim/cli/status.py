"""``ringsim status``: how far a campaign is."""

from __future__ import annotations

import logging
from pathlib import Path

import click

from ringsim.campaign.folder import open_folder
from ringsim.campaign.status import status_lines


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
def command(folder: Path) -> None:
    """Tell how many samples of the campaign in FOLDER are done, failed, running and left.

    It only reads, and may be called while the campaign runs.
    """
    logging.basicConfig(format="%(message)s")
    for line in status_lines(open_folder(folder)):
        click.echo(line)
