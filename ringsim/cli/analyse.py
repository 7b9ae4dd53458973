"""``ringsim analyse DIR|FILE``."""

import json
from pathlib import Path

import click

from ringsim.cli.opening import opened
from ringsim.cli.options import PATH
from ringsim.refusal import InputError


@click.command()
@click.argument("source", metavar="DIR|FILE", type=PATH)
@click.option(
    "--require", "required", metavar="REQUIREMENT", multiple=True,
    help="Judge a requirement, too, or in place of the file's on that output: 'asynchrony_max: max "
    "10, probability 0.99, confidence 0.9', 'outcome: is deployed, probability ...'.",
)  # fmt: skip
@click.option(
    "--reweight", "reweighted", metavar="INPUT", multiple=True,
    help="Tell also what another distribution of a drawn input would give, without new runs: "
    "'loads.force = { kind = \"normal\", mean = 0.012, standard_deviation = 1e-4 }'.",
)  # fmt: skip
@click.option(
    "--full", is_flag=True,
    help="Tell the interval and the convergence of every statistic, and every measure of what "
    "matters, whatever chance would explain.",
)  # fmt: skip
@click.option("--out", metavar="FILE", type=PATH, help="Write all of it to a netCDF file.")
def command(
    source: Path, required: tuple[str, ...], reweighted: tuple[str, ...], full: bool,
    out: Path | None,
) -> None:  # fmt: skip
    """Say what the campaign in DIR (or its campaign.nc) tells: verdicts on requirements, shares of
    outcomes, statistics of outputs with intervals that fit the design, which error dominates, and
    which inputs matter.

    Exit codes: 0 done, whatever the verdicts; 2 bad input.
    """
    from ringsim.analysis.requirements import parse_requirements, read_requirements
    from ringsim.analysis.reweighting import parse_reweighted
    from ringsim.analysis.study import analyse
    from ringsim.analysis.study_text import told
    from ringsim.dataset import require_file, save

    others = parse_reweighted(reweighted)
    wanted = parse_requirements(required)
    if out is not None:
        require_file(out)
    with opened(source) as campaign:
        own = json.loads(campaign.attrs.get("requirements", "{}"))
        try:
            judged = {**read_requirements(own, "requirements"), **wanted}
            found = analyse(campaign, judged, others)
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
    folder = source if source.is_dir() else source.parent
    for line in told(found, str(folder), full=full):
        click.echo(line)
    if out is not None:
        save(found, out)
        click.echo(f"wrote {out}")
