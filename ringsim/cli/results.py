"""``ringsim merge``, ``analyse``, ``report``, ``dossier``, ``plot``, ``compare``, ``export``."""

from pathlib import Path
from typing import Any

import click
import xarray as xr

from ringsim.analysis.campaign_notes import notes
from ringsim.analysis.design import called, inputs, median_and_worst, open_stored
from ringsim.analysis.engines import check_lines
from ringsim.analysis.intervals import ran
from ringsim.analysis.requirements import parse_requirements, required_by
from ringsim.campaign.folder import open_folder
from ringsim.campaign.merging import is_behind, merge
from ringsim.campaign.watch import as_decided
from ringsim.cli.options import (
    ANIMATE,
    COLOUR,
    FOLDER,
    PATH,
    PLOT_FORMAT,
    Formats,
    draw_figures,
    draw_result,
    listed,
    require_with,
    write_animation,
)
from ringsim.dataset import open_lazily, save, with_plain_attributes
from ringsim.files import MERGED, require_file, require_place, writing
from ringsim.refusal import EXIT_DONE, EXIT_NOT_MET, InputError, known_or_nearest
from ringsim.storage.netcdf import runs_in
from ringsim.tables import counted, size_text, slim
from ringsim.variables import Status

_MEASURED = click.option(
    "--measured", metavar="TOML", type=PATH,
    help="Lay the measured data of this file beside the samples, too.",
)  # fmt: skip


def opened(path: Path) -> xr.Dataset:
    """The dataset in a file, or of the campaign in a folder, as ``open_stored`` opens it.

    Results of an interrupted campaign are merged first, which a line says, also where its file is
    named.  While a campaign runs there nothing is: its end merges them.  InputError if there is
    none.
    """
    folder = path.parent if path.name == MERGED and path.is_file() else path
    if any(folder.glob("journals/*")) and is_behind(folder) and not runs_in(folder):
        left, _, _ = merge(open_folder(folder), execution="", partly=True)
        told = f", {counted(left, 'sample')} not run" if left else ""
        click.echo(f"{folder}: merged its results into {MERGED}{told}")
    if path.is_dir() and not (path / MERGED).exists() and runs_in(path):
        raise InputError(
            f"{path}: this campaign is running, and merges its results at its end: wait for "
            f"that, or run ringsim merge {path} for the results so far"
        )
    return open_stored(path)


@click.command()
@FOLDER
def merge_command(folder: Path) -> None:
    """Write campaign.nc in FOLDER from the samples that are done; the others are missing values.

    It may be called at any time and any number of times, also while the campaign runs.
    """
    from ringsim.analysis.study_text import verdict_lines

    campaign = open_folder(folder)
    left, failed, path = merge(campaign, execution="", partly=True)
    samples = as_decided(campaign).table.samples
    click.echo(
        f"{path}: {counted(samples, 'sample')}, {samples - left} done, {left} not run, "
        f"{failed} failed"
    )
    if path is not None:
        with open_lazily(path) as dataset:
            for line in [*notes(dataset), *check_lines(dataset), *verdict_lines(dataset)]:
                click.echo(f"  {line}")


@click.command()
@click.argument("source", metavar="DIR|FILE", type=PATH)
@click.option(
    "--require", "required", metavar="REQUIREMENT", multiple=True,
    help=
        "Check this requirement, too, or in place of the campaign file's on that output: "
        "'asynchrony_max: max 10, probability 0.99, confidence 0.9', 'outcome: is deployed, "
        "probability ...'.",
)  # fmt: skip
@click.option(
    "--reweight", "reweighted", metavar="INPUT", multiple=True,
    help=
        "Also estimate the results for another distribution of a drawn input, without new runs: "
        "'loads.force = { kind = \"normal\", mean = 0.012, standard_deviation = 1e-4 }'.",
)  # fmt: skip
@click.option(
    "--full", is_flag=True,
    help=
        "Print every statistic with its interval and convergence, and all sensitivity measures, "
        "significant or not.",
)  # fmt: skip
@click.option(
    "--gate", is_flag=True,
    help="Return exit code 4 unless every requirement is shown to be met.",
)  # fmt: skip
@click.option("--out", metavar="FILE", type=PATH, help="Also write the results to a netCDF file.")
def analyse_command(
    source: Path, required: tuple[str, ...], reweighted: tuple[str, ...], full: bool, gate: bool,
    out: Path | None,
) -> int:  # fmt: skip
    """Analyse the campaign in DIR (or its campaign.nc): verdicts on requirements, shares of
    outcomes, statistics of outputs with intervals that fit the design, which error dominates, and
    which inputs matter.

    Exit codes: 0 done, whatever the verdicts without --gate; 2 bad input; 4 with --gate if not all
    requirements are met.
    """
    from ringsim.analysis.reweighting import parse_reweighted
    from ringsim.analysis.study import analyse
    from ringsim.analysis.study_text import not_met, told

    others = parse_reweighted(reweighted)
    if out is not None:
        require_file(out, source)
    with opened(source) as campaign:  # which tells what further outputs there are
        wanted = required_by(campaign.attrs) | parse_requirements(required)
        if gate and not wanted:
            raise InputError(
                f"--gate: {source} has no requirements: give some under [requirements], or with "
                "--require"
            )
        try:
            found = analyse(campaign, wanted, others)
        except InputError as error:
            raise InputError(f"{source}: {error}") from None
    folder = source if source.is_dir() else source.parent
    for line in told(found, str(folder), full=full):
        click.echo(line)
    _save(found, out)
    if gate and (failing := not_met(found)):
        click.echo(f"{source}: gate closed: {'; '.join(failing)}", err=True)
        return EXIT_NOT_MET
    return EXIT_DONE


def _save(found: xr.Dataset, out: Path | None) -> None:
    if out is not None:
        save(found, out)
        click.echo(f"wrote {out}")


@click.command()
@click.argument("folder", metavar="DIR", type=PATH)
@click.option("--out", metavar="FILE", type=PATH, default=Path("report.html"), show_default=True)
@click.option(
    "--analysis", metavar="FILE", type=PATH,
    help="Show the analysis in this file (from ringsim analyse --out) instead of a new one.",
)  # fmt: skip
@_MEASURED
@click.option("--pdf", is_flag=True, help="Also write a PDF of the same name (needs chromium).")
def report_command(
    folder: Path, out: Path, analysis: Path | None, measured: Path | None, pdf: bool
) -> None:
    """Write one page about the campaign in DIR, or in a file campaign.nc.

    The page holds all that it shows, and loads nothing: it can be mailed, printed and kept.
    """
    _require_page("--out", out, pdf=pdf)
    with opened(folder) as campaign:
        file = folder / MERGED if folder.is_dir() else folder
        size = _write(campaign, file, out, analysis, measured)
    _told_page(out, size, pdf=pdf)


@click.command()
@click.argument("folder", metavar="DIR", type=PATH)
@click.option("--out", metavar="FILE", type=PATH, default=Path("dossier.html"), show_default=True)
@_MEASURED
@click.option("--pdf", is_flag=True, help="Also write a PDF of the same name (needs chromium).")
def dossier_command(folder: Path, out: Path, measured: Path | None, *, pdf: bool) -> None:
    """List what the campaign in DIR, or in a file campaign.nc, shows of each clause of the
    standards ECSS-E-ST-33-01C and NASA-STD-7009: the numbers, their evidence, and what is missing.

    The same is written as a page that loads nothing: it can be mailed, printed and kept.
    """
    from ringsim.measured import load_measured
    from ringsim.report.dossier import write_dossier

    _require_page("--out", out, pdf=pdf)
    with opened(folder) as campaign:
        try:
            own = folder if folder.is_dir() else folder.parent
            test = None if measured is None else load_measured(measured)
            size, told = write_dossier(campaign, out, str(own), test)
        except InputError as error:
            raise InputError(f"{folder}: {error}") from None
    for line in told:
        click.echo(line)
    _told_page(out, size, pdf=pdf)


def _require_page(option: str, out: Path, *, pdf: bool) -> None:
    """That a page can be written there, and printed; InputError if not."""
    require_place(out)
    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{option} {out}: the page is HTML: give a name such as {out.stem}.html")
    if pdf:
        from ringsim.report.shell import require_browser

        require_place(out.with_suffix(".pdf"))
        require_browser()


def _told_page(out: Path, size: int, *, pdf: bool) -> None:
    """Say what was written, and print it if that is wanted."""
    from ringsim.report.shell import LARGEST, write_pdf

    click.echo(f"wrote {out} ({size / 1e6:.2f} MB)")
    if size > LARGEST:
        click.echo(f"{out}: larger than {LARGEST / 1e6:g} MB, the largest size intended")
    if pdf:
        write_pdf(out, out.with_suffix(".pdf"))
        click.echo(f"wrote {out.with_suffix('.pdf')}")


def _write(
    campaign: xr.Dataset, file: Path, out: Path, analysis: Path | None, measured: Path | None
) -> int:
    from ringsim.measured import load_measured
    from ringsim.report.page import write_report

    if "sample" not in campaign.dims or not {"scene", "campaign"} <= campaign.attrs.keys():
        raise InputError(
            f"{file}: has no campaign: give the folder that ringsim campaign has written"
        )
    known = None if analysis is None else _load(analysis)
    if known is not None and "statistic" not in known.dims:
        raise InputError(
            f"--analysis {analysis}: has no analysis: give a file of ringsim analyse --out, or "
            "leave it out"
        )
    if known is not None:
        _require_of(known, campaign, analysis, file)
    test = None if measured is None else load_measured(measured)
    return write_report(campaign, out, str(file.parent), known, test)


def _require_of(
    known: xr.Dataset, campaign: xr.Dataset, analysis: Path | None, file: Path
) -> None:  # fmt: skip
    """Refuse (InputError) an analysis of another campaign; say where it is of other samples."""
    again = f"run ringsim analyse {file.parent} --out {analysis} again, or leave it out"
    if known.attrs.get("campaign_identity", "") != campaign.attrs.get("identity", ""):
        name = known.attrs.get("campaign_name", "")
        raise InputError(
            f"--analysis {analysis}: it is of another campaign{f' ({name})' if name else ''}, or "
            f"of this one with another scene, engine or inputs, than {file}: {again}"
        )
    held = campaign.sizes["sample"], int(ran(campaign).sum())
    stored = known.attrs.get("samples"), known.attrs.get("samples_run")
    if stored != held:
        click.echo(
            f"--analysis {analysis}: it is of {stored[1]} samples that have run of {stored[0]}, "
            f"and {file} has {held[1]} of {held[0]}: its numbers are shown as they are; for those "
            f"of all samples {again}",
            err=True,
        )


def _load(file: Path) -> xr.Dataset:
    try:
        return with_plain_attributes(xr.load_dataset(file, engine="netcdf4"))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"{file}: cannot be read as a netCDF file: {reason}; merge again, or give another one"
        ) from None


@click.command()
@click.argument("file", type=PATH)
@PLOT_FORMAT
@ANIMATE
@COLOUR
@click.option(
    "--sample", type=int, metavar="N",
    help="Sample of a campaign for --animate (default: the worst).",
)  # fmt: skip
@click.option(
    "--measured",
    metavar="TOML",
    type=PATH,
    help="Draw the measured data of this file over the run or the samples, and nothing else.",
)
@click.option("--out", metavar="DIR", type=PATH, help="Folder for the figures (default: FILE's).")
def plot_command(
    file: Path, formats: Formats, *, animate: bool, colour: str | None,
    sample: int | None, measured: Path | None, out: Path | None,
) -> None:  # fmt: skip
    """Draw the figures of a run, or of a campaign, from its FILE.

    FILE is what ringsim run, replay --save, campaign, merge, modes, calibrate or optimise has
    written.
    """
    require_with("--colour", colour, "--animate", animate)
    require_with("--sample", sample, "--animate", animate)
    from ringsim.plots.figures import left_out

    with opened(file) as dataset:
        others = {"tried_objective", "mechanism_modes"} & set(dataset)
        if others or {"learnt", "posterior_quantile"} <= set(dataset):
            if animate:
                raise InputError(f"--animate: {file} has no run to animate: leave it out")
            draw_result(dataset, out or file.parent, file.stem, formats)
            return
        file = file / MERGED if file.is_dir() else file
        campaign = "sample" in dataset.dims
        needed = {"scene", "campaign"} if campaign else {"scene", "reason"}
        if not needed <= dataset.attrs.keys() or "status" not in dataset:
            raise InputError(
                f"{file}: has neither a run nor a campaign: give a file that ringsim run or "
                "ringsim campaign has written (campaign.nc)"
            )
        folder = out or file.parent
        if sample is not None and campaign:
            _require_sample(dataset, sample, file)
        if measured is not None:
            if animate:
                raise InputError(
                    "--animate: not together with --measured: leave out one of the two"
                )
            _draw_measured(dataset, measured, folder, file.stem, formats)
            return
        shown = _shown(dataset, sample, file) if animate else None
        drawn = draw_figures(dataset, folder, file.stem, formats)
        if why := left_out(dataset):
            click.echo(why)
        if not drawn:
            click.echo(f"{file}: nothing to draw: no run reached its first recorded time")
        elif shown is not None:
            run, name = shown
            write_animation(run.load(), folder / f"{name}.gif", colour)


def _draw_measured(
    dataset: xr.Dataset, measured: Path, folder: Path, stem: str, formats: Formats
) -> None:
    from ringsim.analysis.residuals import clock_line, residuals
    from ringsim.measured import load_measured
    from ringsim.plots import figures, style
    from ringsim.plots.comparison import measured_and_computed

    measurement = load_measured(measured)
    title = measurement.file.title or measurement.file.name
    figure = measured_and_computed(residuals(dataset, measurement), title)
    if clock := clock_line(dataset, measurement):
        click.echo(clock)
    style.in_readable_units(figure)
    for written in figures.write_figure(
        figure, folder, f"{stem}-fig-measured", formats or ("png",)
    ):
        click.echo(f"wrote {written}")


def _shown(dataset: xr.Dataset, sample: int | None, file: Path) -> tuple[xr.Dataset, str]:
    """The run to animate, and the name of its file."""
    if "sample" not in dataset.dims:
        if sample is not None:
            raise InputError(f"--sample {sample}: {file} has only one run: leave it out")
        return dataset, file.stem
    if sample is None:
        chosen = median_and_worst(dataset)
        first = dataset["sample"].values[int(ran(dataset).argmax())]
        sample = int(first) if chosen is None else chosen[1]
    _require_sample(dataset, sample, file)
    _require_run(dataset, sample, file)
    return dataset.sel(sample=sample), f"{file.stem}-sample{sample}"


def _require_sample(dataset: xr.Dataset, sample: int, file: Path) -> None:
    held = dataset["sample"].values.tolist()
    if sample not in held:
        told = f"{held[0]} to {held[-1]}"
        if held != list(range(held[0], held[-1] + 1)):
            told = ", ".join(map(str, held[:_NAMED])) + ", ..." * (len(held) > _NAMED)
        raise InputError(f"--sample {sample}: {file} has samples {told}: choose one of them")


_NAMED = 20
"""Samples that a message names at most."""


def _require_run(dataset: xr.Dataset, sample: int, file: Path) -> None:
    if dataset["status"].sel(sample=sample) < Status.OK:
        raise InputError(
            f"--sample {sample}: it has not run, so that {file} has nothing to show of it: run "
            "the campaign's file again, which runs what is left, or choose another sample"
        )


@click.command()
@click.argument("first", type=PATH)
@click.argument("second", type=PATH)
@click.option(
    "--report", "page", metavar="FILE", type=PATH, help="Also write an HTML page with figures."
)
@click.option("--pdf", is_flag=True, help="Also write the page as PDF (needs chromium).")
@click.option("--out", metavar="FILE", type=PATH, help="Also write the results to a netCDF file.")
def compare_command(
    first: Path, second: Path, page: Path | None, out: Path | None, *, pdf: bool
) -> None:
    """Compare SECOND with FIRST: two campaigns (folders or files), two runs, or a run or campaign
    with measured data (a TOML file).

    Samples with equal seeds or inputs are compared in pairs, which shows much smaller differences.
    """
    require_with("--pdf", pdf or None, "--report", page is not None)
    if out is not None:
        if out.suffix == ".html":
            raise InputError(f"--out {out}: it writes netCDF; the page is --report {out}")
        require_file(out, first, second)
    if second.suffix == ".toml":
        if page is not None:
            raise InputError(
                "--report: a page compares two results: leave it out, and draw measured data with "
                f"ringsim plot {first} --measured {second}, or ringsim report --measured"
            )
        _compare_measured(first, second, out)
        return
    from ringsim.analysis.comparison import compare
    from ringsim.analysis.comparison_text import compared

    if page is not None:
        _require_page("--report", page, pdf=pdf)
    with opened(first) as one, opened(second) as other:
        names = _named(one, first), _named(other, second)
        names = names if names[0] != names[1] else (str(first), str(second))
        try:
            found = compare(one, other, names)
        except InputError as error:
            raise InputError(f"{first}, {second}: {error}") from None
        for line in compared(found):
            click.echo(line)
        _save(found, out)
        if page is not None:
            from ringsim.report.page import write_comparison

            _told_page(page, write_comparison(found, one, other, page), pdf=pdf)


def _compare_measured(run: Path, measured: Path, out: Path | None) -> None:
    from ringsim.analysis import residuals
    from ringsim.measured import load_measured

    measurement = load_measured(measured)
    with opened(run) as dataset:
        found = residuals.residuals(dataset, measurement)
        clock = residuals.clock_line(dataset, measurement)
    for line in slim(residuals.residual_table(found, clock)).lines():
        click.echo(line)
    _save(residuals.residual_statistics(found), out)


def _named(dataset: xr.Dataset, path: Path) -> str:
    """What tables call it: the campaign's name, of a run that of its file."""
    return str(dataset.attrs.get("campaign_name", "")) or path.stem


FORMATS = ("csv", "mat", "pvd")


def _formats(_context: Any, _option: Any, text: str) -> tuple[str, ...]:
    return listed("--format", text, FORMATS, "is not an export format")


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
    help="Only this sample of a campaign; can be given several times.",
)  # fmt: skip
@click.option(
    "--variables", "names", metavar="NAME,NAME", default="", callback=_names,
    help="Only these variables, in csv and mat (default: all; FILE-variables.csv lists them).",
)  # fmt: skip
@click.option("--out", metavar="DIR", type=PATH, help="Folder (default: FILE's).")
def export_command(
    file: Path, formats: tuple[str, ...], samples: tuple[int, ...], names: tuple[str, ...],
    out: Path | None,
) -> None:  # fmt: skip
    """Write a run, or a campaign, from its FILE or folder in the formats of other programs."""
    from ringsim.export import LARGE, size_of_csv, write_csv, write_mat, write_pvd

    with opened(file) as dataset:
        campaign = "sample" in dataset.dims
        if "status" not in dataset or "scene" not in dataset.attrs:
            raise InputError(
                f"{file}: has neither a run nor a campaign: give what ringsim run or ringsim "
                "campaign has written"
            )
        if samples and not campaign:
            raise InputError(f"--sample {samples[0]}: {file} has only one run: leave it out")
        samples = tuple(dict.fromkeys(samples))  # each once, however often it is named
        for sample in samples:
            _require_sample(dataset, sample, file)
            if "pvd" in formats:
                _require_run(dataset, sample, file)
        if campaign and "pvd" in formats and not samples:
            raise InputError(
                "--format pvd: is for single runs, and this is a campaign: choose samples with "
                "--sample"
            )
        chosen = dataset.sel(sample=list(samples)) if samples else dataset
        # Stored states mean nothing to other programs.
        chosen = chosen.drop_dims(["state_entry", "state_time"], errors="ignore")
        if names:
            chosen = _only(chosen, names, formats)
        if "csv" in formats and (size := size_of_csv(chosen)) > LARGE:
            click.echo(
                f"writing about {size_text(size)} of CSV: choose variables with --variables, or "
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


def _only(dataset: xr.Dataset, names: tuple[str, ...], formats: tuple[str, ...]) -> xr.Dataset:
    """The dataset with some of its variables; InputError if it has not all of them."""
    if not {"csv", "mat"} & set(formats):
        raise InputError("--variables: has no effect with --format pvd: leave it out")
    known = [str(name) for name in dataset.data_vars]
    # Inputs have the names that analyse and the report give them, too.
    own = {called(dataset[name]): name for name in inputs(dataset)}
    names = tuple(own.get(name, name) for name in names)
    for name in names:
        if name not in known:
            hint = known_or_nearest(name, known)
            raise InputError(f"--variables {name}: is not a variable of this file ({hint})")
    return dataset[list(names)]
