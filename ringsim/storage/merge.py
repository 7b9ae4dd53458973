"""Merging: all inputs beside all outputs in one file, in bounded memory."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from numpy.typing import NDArray

from ringsim.analysis.intervals import CHECKED
from ringsim.files import MERGED, whole
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.family import SPAN_NAME, span_names
from ringsim.sampling.columns import Table, add_inputs
from ringsim.scene import Scene
from ringsim.storage import netcdf
from ringsim.storage.journal import Survey
from ringsim.storage.netcdf import PER_SAMPLE
from ringsim.storage.result import sample_of
from ringsim.variables import Cause, Status, Variable

_OF_SAMPLES = ("log", "overrides", "attempts")
"""What is not told of checks."""
BLOCK_BYTES = 64 << 20
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
        for name, variable in wanted.items():
            digits = output.significant_digits.get(name)
            netcdf.add_variable(file, variable, compression=output.compression, digits=digits)
        _copy(file, found, fits, wanted)
        if checks is not None:
            _add_checks(file, checks, wanted, output)
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
    file: Any, checks: Survey, wanted: Mapping[str, Variable], output: netcdf.OutputTable
) -> None:
    """Create and fill the variables of the checks."""
    both = {name: v for name, v in wanted.items() if not v.dims and name not in _OF_SAMPLES}
    blocks = {}
    for name, variable in both.items():
        words = f"{variable.long_name}, of the check with the full engine"
        mine = replace(variable, name=f"{name}{CHECKED}", long_name=words)
        digits = output.significant_digits.get(name)
        netcdf.add_variable(file, mine, compression=output.compression, digits=digits)
        blocks[name] = netcdf.blank(variable, checks.status.shape)
    for result in checks.results(np.arange(len(checks.status))):
        known = {"status": result.status, "cause": result.cause, "reason": result.reason}
        for name, value in {**result.arrays(), **known}.items():
            if name in both:
                blocks[name][sample_of(result.sample)] = np.asarray(value)[()]
    for name, values in blocks.items():
        file[f"{name}{CHECKED}"][:] = values


def _copy(
    file: Any, found: Survey, fits: NDArray[np.bool_], wanted: Mapping[str, Variable]
) -> None:
    """Fill blocks of samples, each read from the journals that hold them."""
    sizes = {dim: d.size for dim, d in file.dimensions.items()}
    shapes = {n: tuple(sizes[dim] for dim in v.dims) for n, v in wanted.items()}
    bytes_each = sum(8 * int(np.prod(shape, dtype=np.int64)) for shape in shapes.values())
    aligned = max(1, netcdf.CHUNK_BYTES // max(1, bytes_each))
    count = max(1, BLOCK_BYTES // max(1, bytes_each * aligned)) * aligned
    for start in range(0, len(found.status), count):
        stop = min(start + count, len(found.status))
        blocks = {n: netcdf.blank(v, (stop - start, *shapes[n])) for n, v in wanted.items()}
        for result in found.results(np.arange(start, stop)):
            k, fit = result.sample - start, fits[found.form[result.sample]]
            for name, values in result.arrays().items() if fit else ():
                if name in blocks:
                    blocks[name][k] = values[()]  # of text a word, not an array
            blocks["status"][k] = result.status if fit else Status.ERROR
            blocks["cause"][k] = result.cause if fit else Cause.UNFIT
            blocks["reason"][k] = result.reason if fit else UNFIT
            blocks["log"][k] = result.log
            blocks["overrides"][k] = result.settings()
        blocks["attempts"][:] = found.attempts[start:stop]
        for name, values in blocks.items():
            file[name][start:stop] = values
