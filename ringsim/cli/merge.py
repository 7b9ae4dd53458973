"""``ringsim merge``: put the results of a campaign into one file."""

from __future__ import annotations

import contextlib
import logging
from pathlib import Path

import click

from ringsim.campaign.folder import open_folder
from ringsim.campaign.merging import merge
from ringsim.files import writing
from ringsim.storage.locks import GO_ON, locked
from ringsim.storage.store import recover


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
def command(folder: Path) -> None:
    """Write campaign.nc in FOLDER from the samples that are done; the others are missing values.

    It may be called at any time and any number of times.  While the campaign runs, samples that
    are not in a shard yet are left out.
    """
    logging.basicConfig(format="%(message)s")
    campaign = open_folder(folder)
    with contextlib.ExitStack() as held:
        with writing(folder / "lock", GO_ON):
            alone = held.enter_context(locked(folder / "lock"))
        if alone:
            recover(folder, campaign.identity, "")
    merged = merge(campaign, execution="merged on its own", set_aside=alone, partly=True)
    click.echo(
        f"{merged.path}: {campaign.table.samples} samples, {merged.left} not run, "
        f"{merged.failed} failed"
    )
