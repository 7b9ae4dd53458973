"""Samples listed in a file."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from ringsim.files import read_text
from ringsim.refusal import InputError
from ringsim.sampling.columns import read_inputs
from ringsim.sampling.correlation import Correlation
from ringsim.sampling.designs.family import Design, Factors
from ringsim.sampling.distributions.family import Values


class Listed(Design):
    """One sample per row of a CSV file with scene paths in its header, or per netCDF sample.

    In a netCDF file every variable over the dimension ``sample`` that has an attribute ``path``
    is taken: the design or the result of another campaign can be listed as it is.
    """

    kind: Literal["list"] = "list"
    file: str
    """Looked up beside the campaign file."""

    def table(
        self, factors: Factors, correlations: Sequence[Correlation], *, seed: int, folder: Path
    ) -> dict[str, Values]:
        """Values by path; see :meth:`Design.table`."""
        if factors or correlations:
            raise InputError(
                "inputs: a listed design takes them from its file; leave out inputs and "
                "correlations"
            )
        path = folder / self.file
        if not path.is_file():
            raise InputError(f"design.file = {self.file}: there is no file {path}")
        columns = _from_netcdf(path) if path.suffix == ".nc" else _from_csv(path)
        if not columns or not len(next(iter(columns.values()))):
            raise InputError(f"design.file = {self.file}: no samples in it")
        return columns


def _from_csv(path: Path) -> dict[str, Values]:
    lines = csv.reader(read_text(path).splitlines())
    rows = [[word.strip() for word in row] for row in lines if row]
    if len(rows) < 2:
        return {}
    header, *rows = rows
    for name in header:
        if not name or header.count(name) > 1:
            raise InputError(
                f"design.file = {path.name}: column name {name!r} must be a scene path, once"
            )
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header):
            raise InputError(
                f"design.file = {path.name}: row {number} has {len(row)} values and must have "
                f"{len(header)}, one per column"
            )
    return {name: _typed(words) for name, *words in zip(header, *rows, strict=True)}


def _typed(words: Sequence[str]) -> Values:
    """Whole numbers, numbers, true and false, or words: the narrowest that fits the column."""
    if all(word in ("true", "false") for word in words):
        return np.array([word == "true" for word in words])
    for kind in (int, float):
        try:
            return np.array([kind(word) for word in words])
        except (ValueError, OverflowError):
            continue
    return np.array(words)


def _from_netcdf(path: Path) -> dict[str, Values]:
    import netCDF4

    try:
        with netCDF4.Dataset(path) as file:
            columns = read_inputs(file)
    except OSError as error:
        raise InputError(f"design.file = {path.name}: cannot be read: {error}") from None
    found: dict[str, Values] = {}
    for column in columns:
        if column.dim:
            found |= {f"{column.path}[{k}]": each for k, each in enumerate(column.values.T, 1)}
        else:
            found[column.path] = column.values
    return found
