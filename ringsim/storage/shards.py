"""Shards: files with the results of many samples, never changed once they are there."""

from __future__ import annotations

import logging
import os
import secrets
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from numpy.typing import NDArray

from ringsim.storage.files import DRAFT, digest, sync
from ringsim.storage.layout import (
    COORDINATE,
    PER_SAMPLE,
    add_coordinate,
    add_samples,
    add_variable,
    blank,
    open_new,
)
from ringsim.storage.record import Result
from ringsim.variables import VARIABLES, Status, Variable

FOLDER = "shards"
ASIDE = "set-aside"
_COMPRESSION = 1
_TIMES = {
    "finished": Variable("finished", (), "s", "end of the run, since 1970-01-01T00:00:00Z"),
    "seconds": Variable("seconds", (), "s", "elapsed time of all runs of the sample"),
}
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Shard:
    """What a shard, whose checksum is right, says about its samples."""

    path: Path
    samples: NDArray[np.int64]
    status: NDArray[np.int8]
    finished: NDArray[np.float64]
    seconds: NDArray[np.float64]


def write_shard(folder: Path, results: Iterable[Result], campaign: str) -> Path | None:
    """Write results to a new shard, in the order of their samples.

    The file is named after its first sample and the checksum of its bytes, and appears under
    that name when all of it is on the disk.

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
        If the disk is full; no file is left behind.
    """
    ordered = sorted(results, key=lambda result: result.sample)
    if not ordered:
        return None
    shards = folder / FOLDER
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
    axes: dict[str, NDArray[Any]] = {}
    for k, found in enumerate(arrays):
        mine = {name: values for name, values in found.items() if name in COORDINATE}
        if all(np.array_equal(values, axes.get(name, values)) for name, values in mine.items()):
            axes |= mine
        else:
            ordered[k], arrays[k] = _unfit(ordered[k]), {}
    with open_new(path) as file:
        file.campaign = campaign
        add_samples(file, np.array([result.sample for result in ordered], dtype=np.int64))
        for name, values in axes.items():
            add_coordinate(file, name, values)
        for name, definition in (PER_SAMPLE | _TIMES).items():
            column = blank(definition, (len(ordered),))
            column[:] = [getattr(result, "step" if name == "largest_step" else name)
                         for result in ordered]  # fmt: skip
            add_variable(file, definition, compression=0)[:] = column
        for name, definition in VARIABLES.items():
            first = next((found[name] for found in arrays if name in found), None)
            if first is None or name in PER_SAMPLE:
                continue
            block = blank(definition, (len(ordered), *first.shape))
            for k, found in enumerate(arrays):
                if name in found:
                    block[k] = found[name]
            add_variable(file, definition, compression=_COMPRESSION)[:] = block


def _unfit(result: Result) -> Result:
    return replace(
        result,
        status=Status.ERROR,
        reason="its output times or sections differ from those of the other samples: do not vary "
        "what shapes the result",
        arrays=(),
        body=b"",
    )


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
        if set_aside:
            aside = folder / ASIDE
            aside.mkdir(exist_ok=True)
            os.replace(path, aside / path.name)
            _log.warning("%s: %s; set aside, its samples run again", path.name, fault)
        else:
            _log.warning("%s: %s; ignored", path.name, fault)
    return found


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


def rows_of(path: Path, names: Sequence[str], rows: NDArray[np.int64]) -> dict[str, NDArray[Any]]:
    """Rows of some variables of a shard; variables that it does not have are left out."""
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        return {name: file[name][:][rows] for name in names if name in file.variables}


def shapes_in(path: Path) -> tuple[dict[str, NDArray[Any]], set[str]]:
    """Coordinates and names of the outputs of a shard."""
    with netCDF4.Dataset(path) as file:
        file.set_auto_maskandscale(False)
        axes = {name: np.asarray(file[name][:]) for name in COORDINATE if name in file.variables}
        return axes, {name for name in VARIABLES if name in file.variables}
