"""Merging a campaign: inputs beside outputs of all its journals in one file, ``campaign.nc``."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from numpy.typing import NDArray

from ringsim.analysis import derived
from ringsim.analysis.intervals import CHECKED
from ringsim.campaign.folder import Folder
from ringsim.campaign.watch import decided
from ringsim.files import DESIGN, DRAFT, MERGED, whole, writing
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.family import SPAN_NAME, span_names
from ringsim.refusal import InputError
from ringsim.sampling.columns import Table, add_inputs
from ringsim.scene import Scene
from ringsim.storage import netcdf
from ringsim.storage.journal import FOLDER, DamagedError, Survey
from ringsim.storage.netcdf import GO_ON, PER_SAMPLE, OutputTable, attributes_of_file, locked
from ringsim.storage.result import sample_of, stacked
from ringsim.tables import counted
from ringsim.variables import Cause, Fidelity, Status, Variable

_KEPT = (
    "identity", "seed", "solver", "campaign", "campaign_name", "scene", "output", "design",
    "requirements", "check_every", "judge", "max_difference", "stop_when", "suspects", "modules",
    "outputs", "source", "clocks",
    "ringsim_version", "git_commit", "sources", "exudyn_version",
)  # fmt: skip
"""Attributes of the design that a merged file has, too: what it was run with, whoever merges."""


def merge(campaign: Folder, *, execution: str, partly: bool) -> tuple[int, int, Path | None]:
    """Write ``campaign.nc``, one process at a time, so that it never loses samples it had.

    ``execution`` says who computed it, empty where nobody knows; if samples or checks are left, it
    is written only if ``partly``.  Of a campaign that its rule has ended it holds the samples up to
    there.  Returns the number of samples left, of failed ones, and the file, or None if it is not
    written.
    InputError if the folder cannot be written to, or no sample at all has run.
    """
    path, design = campaign.path / MERGED, campaign.attributes
    model, planned = Fidelity[design.get("fidelity", "full").upper()], campaign.table.samples
    name, title = design["campaign_name"], design["title"]
    made = attributes_of_file(name=name, title=title, action="merged", model=model)
    journals = counted(len([*(campaign.path / FOLDER).glob("*.journal")]), "journal")
    output = OutputTable.model_validate_json(design["output"])
    attributes = made | {n: design[n] for n in _KEPT if n in design} | output.stated()
    attributes["execution"] = execution or f"merged on its own, from {journals}"
    attributes["history"] += f"\n{design['history']}"
    with writing(path, GO_ON), locked(campaign.path / "lock-merge", wait=True):
        for draft in campaign.path.glob(f".{MERGED}.*{DRAFT}"):
            draft.unlink(missing_ok=True)
        if (end := decided(campaign)) is not None:
            campaign = campaign.first(end.samples)
            attributes |= {"stopped_after": end.samples, "stop_reason": end.told}
        if "stop_when" in attributes:
            attributes["planned_samples"] = planned
        for last in (False, True):
            read = _newest(campaign.path)
            found = campaign.survey()
            checks = campaign.survey(checks=True) if len(campaign.checked) else None
            left, failed = len(found.missing), len(found.failed)
            if not partly and (left or len(campaign.unchecked())):
                return left, failed, None
            if left == campaign.table.samples:
                raise InputError(
                    f"{campaign.path}: no sample has run, so there is nothing "
                    "to merge: first run ringsim campaign with the file of "
                    f"{design['campaign_name']}"
                )
            try:
                failed += write_merged(
                    campaign.path, found, campaign.table, campaign.scene, output, attributes,
                    checks,
                )  # fmt: skip
                if 0.0 < read < math.inf:
                    os.utime(path, (read, read))
                break
            except DamagedError:
                if last:
                    raise
    return left, failed, path


def is_behind(folder: Path) -> bool:
    """Whether there are results that the merged file cannot have, or a journal that is no file,
    which merging refuses.
    """
    if not (folder / DESIGN).exists():
        return False
    merged = folder / MERGED
    if not merged.exists():
        return True
    # What was written while it merged is no part of it: it has the time of what it has read.
    return _newest(folder) > merged.stat().st_mtime and os.access(folder, os.W_OK)


def _newest(folder: Path) -> float:
    """When a journal was written last, s; infinite if one is no file."""
    journals = (folder / FOLDER).glob("*.journal")
    return max((f.stat().st_mtime if f.is_file() else math.inf for f in journals), default=0.0)


# The file, in bounded memory.


_OF_SAMPLES = ("log", "overrides", "attempts")
"""What is not told of checks."""
BLOCK_BYTES = 32 << 20
"""Numbers of successive samples that are written at once, about."""
_ROWS = 1 << 14
"""Successive samples of which numbers of checks are written at once."""
_READ = 256
"""Results that are unpacked at once."""
UNFIT = (
    "its result has another size than those of the first samples: do not vary inputs that change "
    "the size of the result"
)
"""Reason of samples that cannot stand in one file with the others."""


def write_merged(
    folder: Path,
    found: Survey,
    table: Table,
    scene: Scene,
    output: netcdf.OutputTable,
    attributes: Mapping[str, Any],
    checks: Survey | None = None,
) -> int:
    """Write ``campaign.nc`` of what was found in a folder, whole or not at all.

    The samples of ``table`` vary ``scene``, whose spans name those of all of them.  If there are
    ``checks``, numbers and words without dimensions of the full engine stand beside those of the
    samples, as ``NAME_checked``.

    Returns how many samples count as failed because their coordinates differ.  OSError or
    RuntimeError if the disk is full; an older file stays.
    """
    axes, names, fits = _common(found)
    scalars = {n for n, v in VARIABLES.items() if not v.dims and not v.needs}
    wanted = {
        name: variable
        for name, variable in VARIABLES.items()
        if name in names | scalars and name not in PER_SAMPLE and name not in output.leave_out
    } | PER_SAMPLE
    own = derived.known_from(attributes)
    made = {name: each.variable(name) for name, each in own.items()}
    with whole(folder / MERGED) as draft, netCDF4.Dataset(draft, "w") as file:
        file.setncatts(dict(attributes))
        netcdf.add_coordinate(file, "sample", np.arange(table.samples))
        for name, values in axes.items():
            netcdf.add_coordinate(file, name, values)
        names_of_spans = span_names(scene)
        wide = [len(axes[dim]) for dim in SPAN_NAME.dims if dim in axes]
        if wide == [*names_of_spans.shape] and not table.moves_winches:
            netcdf.add_span_names(file, names_of_spans)
        add_inputs(file, table, compression=output.compression)
        for name, variable in (wanted | made).items():
            digits = output.significant_digits.get(name)
            netcdf.add_variable(file, variable, compression=output.compression, digits=digits)
        for name, each in own.items():
            file[name].expression = each.of
        _copy(file, found, fits, wanted, own)
        if checks is not None:
            _add_checks(file, checks, wanted | made, output, own)
    return int((~fits[found.form[found.form >= 0]]).sum())


def _common(found: Survey) -> tuple[dict[str, NDArray[Any]], set[str], NDArray[np.bool_]]:
    """Coordinates of the first samples, the outputs that occur, and which forms fit."""
    axes: dict[str, NDArray[Any]] = {}
    names: set[str] = set()
    fits = np.ones(found.form.max(initial=-1) + 1, dtype=bool)
    forms, first = np.unique(found.form, return_index=True)
    for sample in np.sort(first[forms >= 0]):  # the lowest sample of each form
        (result,) = found.results([sample])
        arrays = result.arrays()
        own = {name: arrays[name] for name in COORDINATES if name in arrays}
        fit = all(np.array_equal(axes.get(n, v), v) for n, v in own.items())
        fits[found.form[sample]] = fit
        if fit:
            axes |= own
            names |= arrays.keys() - own.keys()
    return axes, names, fits


def _add_checks(
    file: Any, checks: Survey, wanted: Mapping[str, Variable], output: netcdf.OutputTable,
    own: Mapping[str, derived.Derived],
) -> None:  # fmt: skip
    """Create and fill the variables of the checks."""
    both = {name: v for name, v in wanted.items() if not v.dims and name not in _OF_SAMPLES}
    for name, variable in both.items():
        words = f"{variable.long_name}, of the check with the full engine"
        mine = replace(variable, name=f"{name}{CHECKED}", long_name=words)
        digits = output.significant_digits.get(name)
        netcdf.add_variable(file, mine, compression=output.compression, digits=digits)
    for part in _parts(len(checks.status), _ROWS):
        blocks = {n: netcdf.blank(variable, (len(part),)) for n, variable in both.items()}
        for result in checks.results(np.arange(part.start, part.stop)):
            known = {"status": result.status, "cause": result.cause, "reason": result.reason}
            for name, value in {**derived.of_run(own, result.arrays()), **known}.items():
                if name in both:
                    blocks[name][sample_of(result.sample) - part.start] = np.asarray(value)[()]
        for name, values in blocks.items():
            file[f"{name}{CHECKED}"][part.start : part.stop] = values


def _parts(samples: int, most: int) -> Iterator[range]:
    """All samples in turn, so many at a time."""
    for start in range(0, samples, most):
        yield range(start, min(start + most, samples))


def _copy(
    file: Any, found: Survey, fits: NDArray[np.bool_], wanted: Mapping[str, Variable],
    own: Mapping[str, derived.Derived],
) -> None:  # fmt: skip
    """Fill blocks of samples, each read from the journals that hold them."""
    # What expressions read may be left out of the file; a run of another kind may lack it.
    read = {n for each in own.values() for n in each.names if n not in wanted}
    read = {n for n in read if set(VARIABLES[n].dims) <= file.dimensions.keys()}
    written, wanted = wanted, {**wanted, **{name: VARIABLES[name] for name in read}}
    sizes = {dim: d.size for dim, d in file.dimensions.items()}
    shapes = {n: tuple(sizes[dim] for dim in v.dims) for n, v in wanted.items()}
    bytes_each = sum(8 * int(np.prod(shape, dtype=np.int64)) for shape in shapes.values())
    for part in _parts(len(found.status), max(1, BLOCK_BYTES // max(1, bytes_each))):
        blocks = {n: netcdf.blank(v, (len(part), *shapes[n])) for n, v in wanted.items()}
        for rows in _parts(len(part), _READ):
            _fill(blocks, part.start, found, fits, rows)
        blocks["attempts"][:] = found.attempts[part.start : part.stop]
        axes = {name: file[name][:] for name in file.dimensions if name in file.variables}
        blocks |= derived.over_samples(own, blocks, axes)
        for name, values in blocks.items():
            if name in written or name in own:
                file[name][part.start : part.stop] = values


def _fill(
    blocks: Mapping[str, NDArray[Any]], first: int, found: Survey, fits: NDArray[np.bool_],
    rows: range,
) -> None:  # fmt: skip
    """Fill some rows of blocks that begin with the sample ``first`` with what ran of them."""
    results = list(found.results(first + np.arange(rows.start, rows.stop)))
    for result in results:
        k, fit = result.sample - first, fits[found.form[result.sample]]
        blocks["status"][k] = result.status if fit else Status.ERROR
        blocks["cause"][k] = result.cause if fit else Cause.UNFIT
        blocks["reason"][k] = result.reason if fit else UNFIT
        blocks["log"][k] = result.log
        blocks["overrides"][k] = result.settings()
    fitting = [result for result in results if fits[found.form[result.sample]]]
    for places, arrays in stacked([result.body for result in fitting]):
        own = [fitting[place].sample - first for place in places]
        for name in arrays.keys() & blocks.keys():
            blocks[name][own] = arrays[name]
