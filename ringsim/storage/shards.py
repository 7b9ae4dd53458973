"""Shards: files with the results of many samples, never changed once they are there."""

from __future__ import annotations

import logging
import os
import secrets
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from numpy.typing import NDArray

from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.storage.files import DRAFT, digest, sync
from ringsim.storage.layout import (
    PER_SAMPLE,
    add_coordinate,
    add_samples,
    add_variable,
    blank,
    open_new,
)
from ringsim.storage.record import Result, plain, precedence
from ringsim.variables import Variable

FOLDER = "shards"
ASIDE = "set-aside"
_COMPRESSION = 1
_CHUNK_BYTES = 1 << 16
"""Small, so that a few samples of a shard can be read without the others."""
_TIMES = {
    "finished": Variable("finished", (), "s", "end of the run, since 1970-01-01T00:00:00Z"),
    "seconds": Variable("seconds", (), "s", "elapsed time of all runs of the sample"),
}
_ROW_BYTES = 100_000
"""Reading one row takes as long as reading so many bytes of rows that stand together."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Shard:
    """What a shard, whose checksum is right, says about its samples."""

    path: Path
    samples: NDArray[np.int64]
    status: NDArray[np.int8]
    finished: NDArray[np.float64]
    seconds: NDArray[np.float64]


def write_shards(folder: Path, results: Iterable[Result], campaign: str) -> list[Path]:
    """Write results to new shards, in the order of their samples.

    A file is named after its first sample and the checksum of its bytes, and appears under that
    name when all of it is on the disk.  Results with different coordinates (or none) go to
    different files.

    Parameters
    ----------
    folder
        The campaign's folder.
    results
        What to write; nothing happens if there are none.
    campaign
        Identity of the campaign.

    Raises
    ------
    OSError
        If the disk is full; no broken file is left behind.
    """
    groups: dict[Any, list[Result]] = {}
    for result in sorted(results, key=lambda result: result.sample):
        groups.setdefault(_axes_key(result), []).append(result)
    return [_write(folder / FOLDER, members, campaign) for members in groups.values()]


def _axes_key(result: Result) -> Any:
    arrays = result.unpack()
    return tuple((n, arrays[n].shape, arrays[n].tobytes()) for n in COORDINATES if n in arrays)


def _write(shards: Path, ordered: list[Result], campaign: str) -> Path:
    draft = shards / f".{secrets.token_hex(6)}{DRAFT}"
    try:
        _fill(draft, ordered, campaign)
        final = shards / f"shard-{ordered[0].sample:07d}-{digest(draft)}.nc"
        sync(draft)
        os.replace(draft, final)
    except RuntimeError as error:
        raise OSError(str(error)) from error
    finally:
        draft.unlink(missing_ok=True)
    sync(shards)
    return final


def _fill(path: Path, ordered: list[Result], campaign: str) -> None:
    arrays = [result.unpack() for result in ordered]
    with open_new(path) as file:
        file.campaign = campaign
        add_samples(file, np.array([result.sample for result in ordered], dtype=np.int64))
        for name in COORDINATES:
            if name in arrays[0]:
                add_coordinate(file, name, arrays[0][name])
        for name, definition in (PER_SAMPLE | _TIMES).items():
            found = [getattr(r, "step" if name == "largest_step" else name) for r in ordered]
            column = blank(definition, (len(ordered),))
            column[:] = [plain(text) for text in found] if definition.dtype == "str" else found
            add_variable(file, definition, compression=0)[:] = column
        for name, definition in VARIABLES.items():
            first = next((found[name] for found in arrays if name in found), None)
            if first is None or name in PER_SAMPLE:
                continue
            block = blank(definition, (len(ordered), *first.shape))
            for k, values in enumerate(arrays):
                if name in values:
                    block[k] = values[name]
            variable = add_variable(
                file, definition, compression=_COMPRESSION, chunk_bytes=_CHUNK_BYTES
            )
            variable[:] = block


def read_shards(folder: Path, campaign: str, *, set_aside: bool) -> list[Shard]:
    """All shards of a campaign whose checksum is right.

    Parameters
    ----------
    folder
        The campaign's folder.
    campaign
        Identity of the campaign; shards of another one are left out like broken ones.
    set_aside
        Move broken shards to the folder ``set-aside``; each is named in a warning of the log.
    """
    found: list[Shard] = []
    for path in sorted((folder / FOLDER).glob("shard-*.nc")):
        fault = _fault(path)
        if not fault:
            shard, owner = _read(path)
            if owner == campaign:
                found.append(shard)
                continue
            fault = "it belongs to another campaign"
        if set_aside and _moved(path, folder / ASIDE):
            _log.warning("%s: %s; set aside, its samples run again", path.name, fault)
        else:
            _log.warning("%s: %s; ignored", path.name, fault)
    return found


def _moved(path: Path, aside: Path) -> bool:
    try:
        aside.mkdir(exist_ok=True)
        os.replace(path, aside / path.name)
    except OSError:
        return False
    return True


def _fault(path: Path) -> str:
    expected = path.stem.rsplit("-", 1)[-1]
    try:
        return "" if digest(path) == expected else "its checksum is wrong"
    except OSError as error:
        return f"it cannot be read ({error.strerror})"


def _read(path: Path) -> tuple[Shard, str]:
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        columns = [file[name][:] for name in ("sample", "status", "finished", "seconds")]
        return Shard(path, *columns), str(file.campaign)


def latest(shards: Sequence[Shard], samples: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Shard and row of the result that counts of each sample, -1 where there is none."""
    owner = np.full(samples, -1, dtype=np.int64)
    row = np.full(samples, -1, dtype=np.int64)
    best = np.full(samples, -np.inf)
    for number, shard in enumerate(shards):
        weight = precedence(shard.status, shard.finished)
        rows = np.flatnonzero((shard.samples >= 0) & (shard.samples < samples))
        rows = rows[np.argsort(weight[rows], kind="stable")]
        rows = rows[weight[rows] > best[shard.samples[rows]]]
        ids = shard.samples[rows]
        owner[ids], row[ids], best[ids] = number, rows, weight[rows]
    return owner, row


def rows_of(path: Path, names: Sequence[str], rows: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
    """Rows of some variables of a shard; variables that it does not have are left out.

    Parameters
    ----------
    path
        The shard.
    names
        Variables.
    rows
        Which rows, in any order.
    """
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        return {name: _rows(file[name], rows) for name in names if name in file.variables}


def _rows(variable: Any, rows: NDArray[np.int64]) -> NDArray[Any]:
    """Read rows one by one where that is cheaper than reading all of them."""
    each = int(np.prod(variable.shape[1:], dtype=np.int64)) * 8
    if variable.dtype is str or len(rows) * _ROW_BYTES >= variable.shape[0] * each:
        return np.asarray(variable[:][rows])
    return np.stack([np.asarray(variable[int(row)]) for row in rows])


def shapes_in(path: Path) -> tuple[dict[str, NDArray[Any]], set[str]]:
    """Coordinates and names of the outputs of a shard."""
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        axes = {name: np.asarray(file[name][:]) for name in COORDINATES if name in file.variables}
        return axes, {name for name in VARIABLES if name in file.variables}
