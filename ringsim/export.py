"""Results in the formats of other programs: tables as CSV, files for MATLAB and for ParaView."""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from ringsim.dataset import as_in_scene
from ringsim.files import whole
from ringsim.layout.bodies import Array
from ringsim.outputs import VARIABLES
from ringsim.refusal import InputError
from ringsim.scene import scene_from_toml
from ringsim.shapes import ByLine, Shape, shape_of

# Codes and units of variables in words.


def in_words(variable: xr.DataArray) -> xr.DataArray:
    """The variable, with words instead of codes; what has none stays a number.

    >>> codes = {"flag_values": [-1, 0], "flag_meanings": "not_run ok"}
    >>> in_words(xr.DataArray([0, -1, 5], attrs=codes)).values.tolist()
    ['ok', 'not_run', '5']
    """
    if "flag_meanings" not in variable.attrs:
        return variable
    values = np.atleast_1d(variable.attrs["flag_values"]).tolist()
    words = dict(zip(values, str(variable.attrs["flag_meanings"]).split(), strict=True))
    told = [words.get(code, f"{code:g}") for code in variable.to_numpy().ravel().tolist()]
    return variable.copy(data=np.array(told, dtype=object).reshape(variable.shape))


def units_of(variable: xr.DataArray) -> str:
    """Unit of a variable; empty of words and of numbers without one."""
    units = str(variable.attrs.get("units", "1"))
    return "" if units == "1" else units


def meaning_of(variable: xr.DataArray) -> str:
    """What it is: of an input its scene path, and its name if it has another one."""
    words, path = (str(variable.attrs.get(name, "")) for name in ("long_name", "path"))
    own = str(variable.attrs.get("input", path))
    return words if not path else path if own == path else f"{own}: {path}"


# Tidy tables: one file for each set of dimensions, a column for each of them and each variable.


BLOCK = 1 << 22
"""Rows, about, that are held at once."""
LARGE = 100e6
"""Bytes of all tables above which few programs open them, and they take minutes to write."""
_LETTERS = {"f": 10.0, "O": 12.0, "U": 12.0}
"""Bytes of a cell with its comma, by kind, about; whole numbers have five."""


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
                _no_formula(_table(block, dims)).to_csv(file, index=False, header=number == 0)
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
        _no_formula(table.to_dataframe().reset_index()).to_csv(draft, index=False)
    return [*written, path]


def size_of_csv(dataset: xr.Dataset) -> float:
    """Bytes that ``write_csv`` would write, to a third or so: times after a run's end are no rows,
    and numbers have as many digits as they need.
    """
    share, found = 1.0, 0.0
    if "final_time" in dataset and dataset.sizes.get("time", 0) > 1:
        ended = np.nan_to_num(dataset["final_time"].to_numpy() / float(dataset["time"][-1]))
        share = float(np.clip(ended, 0.0, 1.0).mean())
    for dims, names in _tables(dataset).items():
        kinds = [dataset[name].dtype.kind for name in (*names, *(d for d in dims if d in dataset))]
        letters = sum(_LETTERS.get(kind, 5.0) for kind in kinds)
        found += letters * _rows(dataset, dims) * (share if "time" in dims else 1.0)
    return found


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


def _counts(name: str, values: Array) -> bool:
    """Whether a variable, or that of a check, is a count, and holds nothing else."""
    declared = VARIABLES.get(name.removesuffix("_checked"))
    known = values[~np.isnan(values)]
    return bool(declared and declared.dtype.startswith("i") and (known == np.rint(known)).all())


def _table(block: xr.Dataset, dims: tuple[str, ...]) -> Any:
    """A pandas table of a block, with units in its headers."""
    told = block.map(in_words, keep_attrs=True)
    if not dims:
        return told.expand_dims("row").to_dataframe().rename(columns=_headers(block))
    numbers = [n for n, v in told.data_vars.items() if v.dtype.kind == "f"]
    table = told.to_dataframe(dim_order=list(dims))
    # Counts are read as real numbers, since some may be missing.
    counts = [n for n in numbers if _counts(str(n), table[n].to_numpy())]
    table[counts] = table[counts].astype("Int64")
    if "time" in dims and len(numbers) == len(told.data_vars):
        table = table.dropna(how="all", subset=numbers)
    return table.reset_index().rename(columns=_headers(block))


def _no_formula(table: Any) -> Any:
    """A pandas table in which words and headers that spreadsheets would compute have an apostrophe
    before them, which these hide; numbers written as words stay.

    Source: OWASP, CSV injection.
    """
    words = table.select_dtypes(include=["object", "string"]).columns
    return table.assign(**{name: table[name].map(_safe) for name in words}).rename(columns=_safe)


def _safe(cell: Any) -> Any:
    if not isinstance(cell, str) or cell[:1] not in _FORMULA or len(cell) < 2:
        return cell
    try:
        float(cell)
    except ValueError:
        return f"'{cell}"
    return cell


_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def _headers(block: xr.Dataset) -> dict[str, str]:
    units = {str(name): units_of(block[name]) for name in block.variables}
    return {name: f"{name} ({unit})" if unit else name for name, unit in units.items()}


# MATLAB's files, level 5: every variable under its name, with what it means beside it.


LONGEST_NAME = 63
"""Characters of a name; MATLAB cuts longer ones."""
MOST_BYTES = (1 << 31) - 1
"""Of one variable in files of this level."""


def write_mat(dataset: xr.Dataset, folder: Path, stem: str) -> list[Path]:
    """Write STEM.mat; returns it.

    Beside the variables and coordinates ``units``, ``meaning`` and ``dimensions`` are structs with
    their words by name, ``attributes`` those of the dataset.  Words are cells; codes stay numbers,
    with their words in ``codes``.  A variable of such a name has "_" behind it.

    Raises
    ------
    InputError
        If a variable is larger, or a name longer, than such files can hold.
    """
    path = folder / f"{stem}.mat"
    content: dict[str, Any] = {}
    about: dict[str, dict[str, Any]] = {"units": {}, "meaning": {}, "dimensions": {}, "codes": {}}
    for each in dataset.variables:
        name, variable = str(each), dataset[each]
        if len(name) > LONGEST_NAME:
            raise InputError(
                f"{path}: {name} has {len(name)} characters, and MATLAB's names at most "
                f"{LONGEST_NAME}: choose --format csv"
            )
        if variable.nbytes > MOST_BYTES:
            raise InputError(
                f"{path}: {name} takes {variable.nbytes / 1e9:.1f} GB, and a variable of a MATLAB "
                "file at most 2.1 GB: choose fewer samples with --sample, or --format csv"
            )
        words = variable.dtype.kind in "OU"
        content[name] = variable.to_numpy().astype(object) if words else variable.to_numpy()
        about["units"][name] = str(variable.attrs.get("units", ""))
        about["meaning"][name] = meaning_of(variable)
        about["dimensions"][name] = " ".join(map(str, variable.dims)) or "none"
        if "flag_meanings" in variable.attrs:
            values = np.atleast_1d(variable.attrs["flag_values"]).tolist()
            named = zip(values, str(variable.attrs["flag_meanings"]).split(), strict=True)
            about["codes"][name] = ", ".join(f"{code:g} {word}" for code, word in named)
    attributes = {str(name)[:LONGEST_NAME]: value for name, value in dataset.attrs.items()}
    about |= {"attributes": attributes}
    content = {f"{name}_" if name in about else name: own for name, own in content.items()}
    with whole(path, lasting=False) as draft, draft.open("wb") as file:
        scipy.io.savemat(
            file, content | about, do_compression=True,
            long_field_names=True, oned_as="column",
        )  # fmt: skip
    return [path]


# ParaView's files: the lines of the structure at every recorded time.
#
# Written by hand: a time is four arrays in XML, vtk takes 100 MB, and meshio's collections over
# time are XDMF.  meshio reads them back in the tests.


_LINE = 3
"""VTK's number of a cell that is a line."""
_GRID = """<?xml version="1.0"?>
<!-- {words} -->
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="{points}" NumberOfCells="{cells}">
{body}</Piece></UnstructuredGrid></VTKFile>
"""
_COLLECTION = """<?xml version="1.0"?>
<!-- {words} -->
<VTKFile type="Collection" version="1.0" byte_order="LittleEndian"><Collection>
{body}</Collection></VTKFile>
"""


def write_pvd(run: xr.Dataset, folder: Path, stem: str) -> list[Path]:
    """Write STEM.pvd, and STEM-vtu/NUMBER.vtu for every recorded time; returns the first.

    Points carry ``lag``, the deviation of a V-joint from the mean opening angle (degree, NaN
    elsewhere); lines ``part``, a number whose meaning the file tells, ``lag`` of the joint that
    they end at and, if recorded, ``stress`` (Pa).

    InputError if nothing was recorded, or not all planes and sections of its scene are there.
    """
    run = as_in_scene(run)
    path, inner = folder / f"{stem}.pvd", folder / f"{stem}-vtu"
    try:
        shape = shape_of(run, scene_from_toml(str(run.attrs["scene"]), source="attribute scene"))
    except ValueError as error:
        raise InputError(f"{path}: {error}: there is nothing to show") from error
    parts = ", ".join(f"part {k} {name}" for k, name in enumerate(shape.points.lines))
    told = escape(f"{run.attrs.get('title', '')}: {shape.words}; {parts}")
    words = re.sub("-(?=-)", "- ", told)  # two hyphens would end the comment
    inner.mkdir(exist_ok=True)
    entries = ""
    values = _values(run, shape)
    for number, time in enumerate(shape.times.tolist()):
        name = f"{number:05d}.vtu"
        with whole(inner / name, lasting=False, swept=False) as draft:
            draft.write_text(_grid(shape, values, time, words), encoding="utf-8")
        entries += f'<DataSet timestep="{time:.9g}" part="0" file="{inner.name}/{name}"/>\n'
    with whole(path, lasting=False) as draft:
        draft.write_text(_COLLECTION.format(words=words, body=entries), encoding="utf-8")
    return [path]


def _values(run: xr.Dataset, shape: Shape) -> dict[str, ByLine]:
    """What lines carry, by name."""
    found = {}
    if "opening_angle" in run and shape.points.openings.size:
        found["lag"] = shape.lags(run)
    if "rod_stress" in run:
        found["stress"] = shape.stresses(run)
    return found


def _grid(shape: Shape, values: dict[str, ByLine], time: float, words: str) -> str:
    lines, places = shape.points.lines, shape.at(time)
    pairs = np.concatenate([*lines.values()])
    part = np.repeat(np.arange(len(lines)), [len(each) for each in lines.values()])
    of_cells: dict[str, Array | NDArray[np.int_]] = {"part": part}
    of_points: dict[str, Array] = {}
    for name, value in values.items():
        known = {group: np.full(len(each), np.nan) for group, each in lines.items()} | value(time)
        of_cells[name] = np.concatenate([known[group] for group in lines])
        if "V-joints" in known:
            of_points[name] = np.full(len(places), np.nan)
            of_points[name][shape.points.openings.ravel()] = known["V-joints"]
    body = (
        _section("PointData", (_array(*each) for each in of_points.items()))
        + _section("CellData", (_array(*each) for each in of_cells.items()))
        + _section("Points", [_array("Points", places)])
        + _section(
            "Cells",
            [
                _array("connectivity", pairs.ravel()),
                _array("offsets", 2 * np.arange(1, len(pairs) + 1)),
                _array("types", np.full(len(pairs), _LINE)),
            ],
        )
    )
    return _GRID.format(words=words, points=len(places), cells=len(pairs), body=body)


def _section(name: str, arrays: Iterable[str]) -> str:
    return f"<{name}>\n{''.join(arrays)}</{name}>\n"


def _array(name: str, values: Array | NDArray[np.int_]) -> str:
    kind = "Float64" if values.dtype.kind == "f" else "UInt8" if name == "types" else "Int64"
    wide = f' NumberOfComponents="{values.shape[1]}"' if values.ndim > 1 else ""
    text = " ".join(f"{value:.9g}" for value in values.ravel().tolist())
    return f'<DataArray type="{kind}" Name="{name}"{wide} format="ascii">{text}</DataArray>\n'
