"""``ringsim compare A B``."""

from pathlib import Path

import click

from ringsim.cli.opening import opened
from ringsim.cli.options import PATH
from ringsim.refusal import InputError


@click.command()
@click.argument("first", type=PATH)
@click.argument("second", type=PATH)
@click.option("--out", metavar="FILE", type=PATH, help="Write all of it to a netCDF file.")
def command(first: Path, second: Path, out: Path | None) -> None:
    """Say how SECOND differs from FIRST: two campaigns (folders or files), or two runs.

    Samples with equal seeds or inputs are compared in pairs, which shows much smaller differences.
    """
    from ringsim.analysis.comparison import compare
    from ringsim.analysis.comparison_text import compared
    from ringsim.dataset import require_file, save

    if out is not None:
        require_file(out)
    with opened(first) as one, opened(second) as other:
        try:
            found = compare(one, other)
        except InputError as error:
            raise InputError(f"{first}, {second}: {error}") from None
    for line in compared(found):
        click.echo(line)
    if out is not None:
        save(found, out)
        click.echo(f"wrote {out}")
