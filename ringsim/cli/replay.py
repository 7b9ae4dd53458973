"""``ringsim replay``: run one sample of a campaign again, in the foreground."""

from __future__ import annotations

import faulthandler
from pathlib import Path

import click

from ringsim.campaign.folder import open_folder
from ringsim.campaign.replay import differences, outcome_of, replay, sample_scene, stored
from ringsim.exit_codes import EXIT_DONE, EXIT_FAILED


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.argument("sample", type=int)
@click.option("--scene", is_flag=True, help="Print the sample's scene and do not run it.")
@click.option("--save", type=click.Path(path_type=Path), help="Write the run to a netCDF file.")
def command(folder: Path, sample: int, scene: bool, save: Path | None) -> int:
    """Run SAMPLE of the campaign in FOLDER again in this process, and compare the results.

    Nothing in the folder changes.  Everything that the solver prints is shown; a crash or a hang
    happens here, where a debugger can look at it.
    """
    campaign = open_folder(folder)
    exact = sample_scene(campaign, sample)
    if scene:
        click.echo(exact.to_toml())
        return EXIT_DONE
    faulthandler.enable()
    before = stored(campaign, sample)
    for path, value in campaign.table.values_of(sample).items():
        click.echo(f"{path} = {value}")
    result = replay(campaign, sample)
    if result.log:
        click.echo(result.log)
    click.echo(f"sample {sample}: {result.status.word}: {result.reason} ({result.seconds:.2f} s)")
    if save is not None:
        from ringsim.dataset import save as write
        from ringsim.dataset import to_dataset

        write(to_dataset(outcome_of(result), exact), save)
        click.echo(f"{save}: written")
    if before is None:
        click.echo("there is no stored result to compare with")
    elif different := differences(result, before):
        click.echo(f"differs from the stored result ({before.status.word}): {', '.join(different)}")
        return EXIT_FAILED
    else:
        click.echo("identical to the stored result")
    return EXIT_FAILED if result.status.failed else EXIT_DONE
