"""Samples listed in a file."""

import csv
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np

from ringsim.files import read_text
from ringsim.overrides import parse_value
from ringsim.refusal import InputError
from ringsim.sampling.columns import read_inputs
from ringsim.sampling.correlation import Correlation
from ringsim.sampling.designs.family import Design, Factors
from ringsim.sampling.values import Values, array_of, is_label


class Listed(Design):
    """One sample per row of a CSV file with scene paths in its header, or per netCDF sample.

    A CSV file has commas between its cells and points in its numbers.  A column of text whose name
    is no scene path holds labels, which are kept beside the results.

    In a netCDF file every variable over the dimension ``sample`` that has an attribute ``path``
    is taken: the design or the result of another campaign can be listed as it is.
    """

    population: ClassVar[bool] = False
    cure: ClassVar[str] = "correct it there"

    kind: Literal["list"] = "list"
    file: str
    """Looked up beside the campaign file."""

    def where(self, sample: int, path: str) -> str:
        """Where a sample stands in the file; see :meth:`Design.where`."""
        row = "" if self.file.endswith(".nc") else f"row {sample + 1} below the header, "
        return f"{self.file}: {row}sample {sample}{path and f', column {path}'}"

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
    if not rows:
        return {}
    (header, *rows), where = rows, f"design.file = {path.name}:"
    for mark, word in {";": "semicolons", "\t": "tabs"}.items():
        if any(mark in name for name in header):
            raise InputError(
                f"{where} its columns are separated by {word}, and must be by commas, with points "
                "in numbers (0.5): export it as CSV with commas"
            )
    for name in header:
        if not name or header.count(name) > 1:
            raise InputError(f"{where} column name {name!r} must be a scene path, once")
    for number, row in enumerate(rows, start=1):
        for name, word in zip(header, row, strict=False):
            if _DECIMAL_COMMA.fullmatch(word):
                raise InputError(
                    f'{where} row {number} below the header, column {name}: "{word}" has a decimal '
                    f"comma: write {word.replace(',', '.')}"
                )
        if len(row) != len(header):
            raise InputError(
                f"{where} row {number} has {len(row)} values and must have {len(header)}, one per "
                "column; commas separate values, decimals have points (0.5)"
            )
    columns = {name: words for name, *words in zip(header, *rows, strict=True)} if rows else {}
    return {name: _typed(name, words, f"{where} column {name}") for name, words in columns.items()}


_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+([eE][-+]?[0-9]+)?")


def _typed(name: str, words: Sequence[str], where: str) -> Values:
    """The cells of a column: numbers, true and false, tables, words; or labels."""
    cells = array_of([_cell(word, where) for word in words])
    return np.array(words) if is_label(name) and cells.dtype.kind not in "if" else cells


def _cell(word: str, where: str) -> Any:
    if word in ("true", "false"):
        return word == "true"
    for kind in (int, float):
        try:
            return kind(word)
        except (ValueError, OverflowError):
            continue
    return parse_value(word, where) if word.startswith(("{", "[")) else word


def _from_netcdf(path: Path) -> dict[str, Values]:
    import netCDF4

    try:
        with netCDF4.Dataset(path) as file:
            columns = read_inputs(file)
    except OSError as error:
        raise InputError(f"design.file = {path.name}: cannot be read: {error}") from None
    return {column.path or column.name: column.values for column in columns}
