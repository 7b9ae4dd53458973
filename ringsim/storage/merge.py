"""Merging: all inputs beside all outputs in one file, in bounded memory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ringsim.refusal import InputError
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
from ringsim.storage.shards import Shard, rows_of, shapes_in
from ringsim.variables import VARIABLES, Variable

NAME = "campaign.nc"
BLOCK_BYTES = 64 << 20


def merge_shards(
    folder: Path,
    shards: Sequence[Shard],
    table: Table,
    output: Output,
    attributes: Mapping[str, Any],
) -> Path:
    """Write ``campaign.nc``, whole or not at all.

    Samples that have not been run have the status "not_run" and missing values.  Of a sample
    that was run twice the later result counts.

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

    Raises
    ------
    InputError
        If the shards do not fit together, or ``output`` names an unknown variable.
    OSError
        If the disk is full; an older file stays.
    """
    axes, names = _common(shards)
    for name in [*output.significant_digits, *output.leave_out]:
        if name not in VARIABLES:
            raise InputError(f"output: {name} is not an output variable")
    scalars = {n for n, v in VARIABLES.items() if not v.dims and not v.needs}
    wanted = {
        name: variable
        for name, variable in VARIABLES.items()
        if name in names | scalars and name not in PER_SAMPLE and name not in output.leave_out
    } | PER_SAMPLE
    owner, row = _latest(shards, table.samples)
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
                _copy(file, shards, owner, row, wanted)
        except RuntimeError as error:
            raise OSError(str(error)) from error
    return path


def _common(shards: Sequence[Shard]) -> tuple[dict[str, NDArray[Any]], set[str]]:
    """Coordinates that the shards share, and the outputs that occur in any."""
    axes: dict[str, NDArray[Any]] = {}
    names: set[str] = set()
    for shard in shards:
        found, outputs = shapes_in(shard.path)
        names |= outputs
        for name, values in found.items():
            if not np.array_equal(axes.setdefault(name, values), values):
                raise InputError(
                    f"{shard.path}: its {name} differs from that of the shards before: it was made "
                    "by another version; delete it and run the campaign again"
                )
    return axes, names


def _latest(shards: Sequence[Shard], samples: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Shard and row that hold each sample, -1 for those that have not been run."""
    owner = np.full(samples, -1, dtype=np.int64)
    row = np.full(samples, -1, dtype=np.int64)
    when = np.full(samples, -np.inf)
    for number, shard in enumerate(shards):
        valid = np.flatnonzero(shard.samples < samples)
        ids = shard.samples[valid]
        newer = shard.finished[valid] > when[ids]
        owner[ids[newer]], row[ids[newer]] = number, valid[newer]
        when[ids[newer]] = shard.finished[valid][newer]
    return owner, row


def _copy(
    file: Any,
    shards: Sequence[Shard],
    owner: NDArray[np.int64],
    row: NDArray[np.int64],
    wanted: Mapping[str, Variable],
) -> None:
    """Fill blocks of samples, each read from the shards that hold them."""
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
            read = rows_of(shards[number].path, list(wanted), row[start + here])
            for name, values in read.items():
                blocks[name][here] = values
        for name, values in blocks.items():
            file[name][start:stop] = values
