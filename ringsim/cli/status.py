"""``ringsim status``: how far a campaign is."""

from pathlib import Path

import click

from ringsim.campaign.folder import open_folder
from ringsim.campaign.status import status_lines
from ringsim.cli.options import FOLDER


@click.command()
@FOLDER
def command(folder: Path) -> None:
    """Tell how many samples of the campaign in FOLDER are done, failed, running and left, and what
    the antenna did.

    It only reads, and may be called while the campaign runs.
    """
    for line in status_lines(open_folder(folder)):
        click.echo(line)
