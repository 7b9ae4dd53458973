"""Merging: all inputs beside all outputs in one file, in bounded memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.outputs import VARIABLES
from ringsim.sampling.table import Table
from ringsim.storage.design_file import add_inputs
from ringsim.storage.files import whole
from ringsim.storage.layout import (
    CHUNK_BYTES,
    PER_SAMPLE,
    Output,
    add_coordinate,
    add_samples,
    add_variable,
    blank,
    open_new,
)
from ringsim.storage.shards import Shard, latest, rows_of, shapes_in
from ringsim.variables import Cause, Status, Variable

NAME = "campaign.nc"
BLOCK_BYTES = 64 << 20
UNFIT = (
    "its output times or places differ from those of the first samples: do not vary what shapes "
    "the result"
)
"""Reason of samples that cannot stand in one file with the others."""


def merge_shards(
    folder: Path,
    shards: Sequence[Shard],
    table: Table,
    output: Output,
    attributes: Mapping[str, Any],
) -> int:
    """Write ``campaign.nc``, whole or not at all.

    Samples that have not been run have the status "not_run" and missing values.  Of a sample
    that was run twice the result of greater precedence counts.

    Parameters
    ----------
    folder
        The campaign's folder.
    shards
        Its shards.
    table
        The inputs.
    output
        Compression, digits and variables to leave out.
    attributes
        Global attributes.

    Returns
    -------
    int
        Samples that count as failed because their coordinates differ from the others'.

    Raises
    ------
    OSError
        If the disk is full; an older file stays.
    """
    axes, names, fits = _common(shards)
    scalars = {n for n, v in VARIABLES.items() if not v.dims and not v.needs}
    wanted = {
        name: variable
        for name, variable in VARIABLES.items()
        if name in names | scalars and name not in PER_SAMPLE and name not in output.leave_out
    } | PER_SAMPLE
    owner, row = latest(shards, table.samples)
    path = folder / NAME
    with whole(path) as draft:
        try:
            with open_new(draft) as file:
                file.setncatts(dict(attributes))
                add_samples(file, np.arange(table.samples))
                for name, values in axes.items():
                    add_coordinate(file, name, values)
                add_inputs(file, table, compression=output.compression)
                for name, variable in wanted.items():
                    digits = output.significant_digits.get(name)
                    add_variable(file, variable, compression=output.compression, digits=digits)
                _copy(file, shards, fits, (owner, row), wanted)
        except RuntimeError as error:
            raise OSError(str(error)) from error
    return int((~fits[owner[owner >= 0]]).sum())


def _common(
    shards: Sequence[Shard],
) -> tuple[dict[str, NDArray[Any]], set[str], NDArray[np.bool_]]:
    """Coordinates of the first samples, the outputs that occur, and which shards fit."""
    axes: dict[str, NDArray[Any]] = {}
    names: set[str] = set()
    fits = np.ones(len(shards), dtype=bool)
    for number in sorted(range(len(shards)), key=lambda k: int(shards[k].samples[0])):
        found, outputs = shapes_in(shards[number].path)
        fits[number] = all(np.array_equal(axes.get(n, v), v) for n, v in found.items())
        if fits[number]:
            names |= outputs
            axes |= found
    return axes, names, fits


def _copy(
    file: Any,
    shards: Sequence[Shard],
    fits: NDArray[np.bool_],
    place: tuple[NDArray[np.int64], NDArray[np.int64]],
    wanted: Mapping[str, Variable],
) -> None:
    """Fill blocks of samples, each read from the shards that hold them."""
    owner, row = place
    sizes = {dim: d.size for dim, d in file.dimensions.items()}
    shapes = {n: tuple(sizes[dim] for dim in v.dims) for n, v in wanted.items()}
    bytes_each = sum(8 * int(np.prod(shape, dtype=np.int64)) for shape in shapes.values())
    aligned = max(1, CHUNK_BYTES // max(1, bytes_each))
    count = max(1, BLOCK_BYTES // max(1, bytes_each * aligned)) * aligned
    for start in range(0, len(owner), count):
        stop = min(start + count, len(owner))
        blocks = {n: blank(v, (stop - start, *shapes[n])) for n, v in wanted.items()}
        for number in np.unique(owner[start:stop]):
            if number < 0:
                continue
            here = np.flatnonzero(owner[start:stop] == number)
            names = list(wanted if fits[number] else PER_SAMPLE)
            read = rows_of(shards[number].path, names, row[start + here])
            for name, values in read.items():
                blocks[name][here] = values
            if not fits[number]:
                blocks["status"][here], blocks["reason"][here] = Status.ERROR, UNFIT
                blocks["cause"][here] = Cause.UNFIT
        for name, values in blocks.items():
            file[name][start:stop] = values
