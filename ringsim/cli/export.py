"""``ringsim export``: results for other programs."""

from pathlib import Path
from typing import Any

import click

from ringsim.cli.opening import opened
from ringsim.cli.options import PATH, listed
from ringsim.files import writing
from ringsim.refusal import InputError, known_or_nearest

FORMATS = ("csv", "mat", "pvd")


def _formats(_context: Any, _option: Any, text: str) -> tuple[str, ...]:
    return listed("--format", text, FORMATS, "is no format to export to")


def _names(_context: Any, _option: Any, text: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(filter(None, (word.strip() for word in text.split(",")))))


@click.command()
@click.argument("file", type=PATH)
@click.option(
    "--format", "formats", metavar="csv,mat,pvd", default="csv", callback=_formats,
    help="One or more: tidy tables with units, MATLAB, ParaView over time (default csv).",
)  # fmt: skip
@click.option(
    "--sample", "samples", metavar="N", type=int, multiple=True,
    help="Only this sample of a campaign; may be given more than once.",
)  # fmt: skip
@click.option(
    "--variables", "names", metavar="NAME,NAME", default="", callback=_names,
    help="Only these variables, in csv and mat (default: all; FILE-variables.csv lists them).",
)  # fmt: skip
@click.option("--out", metavar="DIR", type=PATH, help="Folder (default: FILE's).")
def command(
    file: Path, formats: tuple[str, ...], samples: tuple[int, ...], names: tuple[str, ...],
    out: Path | None,
) -> None:  # fmt: skip
    """Write a run, or a campaign, from its FILE or folder in the formats of other programs."""
    from ringsim.export.csv import MANY, most_rows, write_csv
    from ringsim.export.matlab import write_mat
    from ringsim.export.paraview import write_pvd

    with opened(file) as dataset:
        campaign = "sample" in dataset.dims
        if "status" not in dataset or "scene" not in dataset.attrs:
            raise InputError(
                f"{file}: holds neither a run nor a campaign: give what ringsim run or ringsim "
                "campaign has written"
            )
        if samples and not campaign:
            raise InputError(f"--sample {samples[0]}: {file} holds one run: leave it out")
        for sample in samples:
            if sample not in dataset["sample"]:
                raise InputError(
                    f"--sample {sample}: {file} holds samples 0 to {dataset.sizes['sample'] - 1}"
                )
        if campaign and "pvd" in formats and not samples:
            raise InputError(
                "--format pvd: shows runs, and this is a campaign: choose some with --sample"
            )
        chosen = dataset.sel(sample=list(samples)) if samples else dataset
        # Stored states mean nothing to other programs.
        chosen = chosen.drop_dims(["state_entry", "state_time"], errors="ignore")
        if names:
            chosen = _only(chosen, names, formats)
        if "csv" in formats and (rows := most_rows(chosen)) > MANY:
            click.echo(
                f"the longest table has up to {rows:,} rows: choose variables with --variables, or "
                "samples with --sample, unless you need all",
                err=True,
            )
        folder = out or (file if file.is_dir() else file.parent)
        stem = "campaign" if file.is_dir() else file.stem
        with writing(folder):
            folder.mkdir(parents=True, exist_ok=True)
            written = write_csv(chosen, folder, stem) if "csv" in formats else []
            written += write_mat(chosen, folder, stem) if "mat" in formats else []
            if "pvd" in formats:
                runs = {f"{stem}-sample{n}": dataset.sel(sample=n) for n in samples}
                for name, run in (runs or {stem: dataset}).items():
                    written += write_pvd(run, folder, name)
    for path in written:
        click.echo(f"wrote {path}")


def _only(dataset: Any, names: tuple[str, ...], formats: tuple[str, ...]) -> Any:
    """The dataset with some of its variables; InputError if it has not all of them."""
    if not {"csv", "mat"} & set(formats):
        raise InputError("--variables: says nothing to --format pvd: leave it out")
    known = [str(name) for name in dataset.data_vars]
    for name in names:
        if name not in known:
            hint = known_or_nearest(name, known)
            raise InputError(f"--variables {name}: is no variable of this file ({hint})")
    return dataset[list(names)]
