"""Opening what verbs are called for: a folder that is not merged yet is merged first."""

from pathlib import Path

import click
import xarray as xr


def opened(path: Path) -> xr.Dataset:
    """The dataset in a file, or of the campaign in a folder, as ``open_stored`` opens it.

    Results of an interrupted campaign are merged first, which a line says.  While a campaign runs
    there nothing is: its end merges them.  InputError if there is none.
    """
    from ringsim.analysis.stored import MERGED, open_stored

    if any(path.glob("journals/*")):
        from ringsim.campaign.folder import open_folder
        from ringsim.campaign.merging import is_behind, merge
        from ringsim.storage.locks import runs_in
        from ringsim.tables import counted

        if is_behind(path) and not runs_in(path):
            left, _, _ = merge(open_folder(path), execution="merged on its own", partly=True)
            told = f", {counted(left, 'sample')} not run" if left else ""
            click.echo(f"{path}: merged its results into {MERGED} first{told}")
    return open_stored(path)
