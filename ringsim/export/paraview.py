"""ParaView's files: the lines of the structure at every recorded time.

Written by hand: a time is four arrays in XML, vtk takes 100 MB, and meshio's collections over time
are XDMF.  meshio reads them back in the tests.
"""

from collections.abc import Iterable
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.files import whole
from ringsim.layout.bodies import Array
from ringsim.refusal import InputError
from ringsim.scene import scene_from_toml
from ringsim.shapes import ByLine, Shape, shape_of

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

    InputError if nothing was recorded.
    """
    path, inner = folder / f"{stem}.pvd", folder / f"{stem}-vtu"
    try:
        shape = shape_of(run, scene_from_toml(str(run.attrs["scene"]), source="attribute scene"))
    except ValueError as error:
        raise InputError(f"{path}: {error}: there is nothing to show") from error
    parts = ", ".join(f"part {k} {name}" for k, name in enumerate(shape.points.lines))
    words = escape(f"{run.attrs.get('title', '')}: {shape.words}; {parts}").replace("--", "- -")
    inner.mkdir(exist_ok=True)
    entries = ""
    values = _values(run, shape)
    for number, time in enumerate(shape.times.tolist()):
        name = f"{number:05d}.vtu"
        with whole(inner / name, lasting=False) as draft:
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
