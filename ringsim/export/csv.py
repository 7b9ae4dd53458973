"""Tidy tables: one file for each set of dimensions, a column for each of them and each variable."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ringsim.export.words import in_words, meaning_of, units_of
from ringsim.files import whole

BLOCK = 1 << 22
"""Rows, about, that are held at once."""
MANY = 5_000_000
"""Rows of a table above which few programs open it, and it takes minutes to write."""


def write_csv(dataset: xr.Dataset, folder: Path, stem: str) -> list[Path]:
    """Write STEM-DIM-DIM.csv for every set of dimensions, and STEM-variables.csv on what the
    columns mean; returns the files.

    A header is a name with its unit: ``opening_angle (degree)``.  Codes are words.  Times without
    any value, as after the end of a run, are left out.
    """
    written = []
    for dims, names in _tables(dataset).items():
        path = folder / f"{stem}-{'-'.join(dims) or 'numbers'}.csv"
        with whole(path, lasting=False) as draft, draft.open("w", encoding="utf-8") as file:
            for number, block in enumerate(_blocks(dataset[names], dims)):
                _table(block, dims).to_csv(file, index=False, header=number == 0)
        written.append(path)
    path = folder / f"{stem}-variables.csv"
    about: dict[str, list[str]] = {"units": [], "meaning": [], "dimensions": []}
    for each in (dataset[name] for name in dataset.variables):
        about["units"].append(units_of(each))
        about["meaning"].append(meaning_of(each))
        about["dimensions"].append(" ".join(map(str, each.dims)))
    columns = {name: ("name", words) for name, words in about.items()}
    table = xr.Dataset(columns, coords={"name": [str(name) for name in dataset.variables]})
    with whole(path, lasting=False) as draft:
        table.to_dataframe().to_csv(draft)
    return [*written, path]


def most_rows(dataset: xr.Dataset) -> int:
    """Rows of the longest table that ``write_csv`` would write, at most."""
    return max((_rows(dataset, dims) for dims in _tables(dataset)), default=0)


def _rows(dataset: xr.Dataset, dims: tuple[str, ...]) -> int:
    return int(np.prod([dataset.sizes[dim] for dim in dims], dtype=np.int64))


def _tables(dataset: xr.Dataset) -> dict[tuple[str, ...], list[str]]:
    """Names of variables by their dimensions."""
    found: dict[tuple[str, ...], list[str]] = {}
    for name, variable in dataset.data_vars.items():
        found.setdefault(tuple(map(str, variable.dims)), []).append(str(name))
    return found


def _blocks(dataset: xr.Dataset, dims: tuple[str, ...]) -> Iterator[xr.Dataset]:
    """The dataset in pieces along its first dimension, so that any campaign fits into memory."""
    rows = _rows(dataset, dims)
    if rows <= BLOCK or not dims:
        yield dataset
        return
    length = dataset.sizes[dims[0]]
    step = max(1, BLOCK * length // rows)
    for start in range(0, length, step):
        yield dataset.isel({dims[0]: slice(start, start + step)})


def _table(block: xr.Dataset, dims: tuple[str, ...]) -> Any:
    """A pandas table of a block, with units in its headers."""
    told = block.map(in_words, keep_attrs=True)
    if not dims:
        return told.expand_dims("row").to_dataframe().rename(columns=_headers(block))
    numbers = [n for n, v in told.data_vars.items() if v.dtype.kind == "f"]
    table = told.to_dataframe(dim_order=list(dims))
    if "time" in dims and len(numbers) == len(told.data_vars):
        table = table.dropna(how="all", subset=numbers)
    return table.reset_index().rename(columns=_headers(block))


def _headers(block: xr.Dataset) -> dict[str, str]:
    units = {str(name): units_of(block[name]) for name in block.variables}
    return {name: f"{name} ({unit})" if unit else name for name, unit in units.items()}
