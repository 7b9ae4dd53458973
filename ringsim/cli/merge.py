"""``ringsim merge``: put the results of a campaign into one file."""

from __future__ import annotations

import logging
from pathlib import Path

import click

from ringsim.campaign.folder import open_folder
from ringsim.campaign.run import merge
from ringsim.storage.files import locked
from ringsim.storage.store import recover, survey


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
def command(folder: Path) -> None:
    """Write campaign.nc in FOLDER from the samples that are done; the others are missing values.

    It may be called at any time and any number of times.  While the campaign runs, samples that
    are not in a shard yet are left out.
    """
    logging.basicConfig(format="%(message)s")
    campaign = open_folder(folder)
    with locked(folder / "lock") as alone:
        if alone:
            recover(folder, campaign.identity, "")
        found = survey(folder, campaign.identity, campaign.table.samples, set_aside=alone)
    path = merge(campaign, found, execution="merged on its own")
    click.echo(
        f"{path}: {campaign.table.samples} samples, {len(found.missing)} not run, "
        f"{len(found.failed)} failed"
    )
