"""design.nc: what a campaign is going to run, written before its first run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np

from ringsim.files import whole
from ringsim.refusal import InputError
from ringsim.sampling.table import Column, Table
from ringsim.storage.netcdf import add_dimension, add_samples, open_new

NAME = "design.nc"


def write_design(folder: Path, table: Table, attributes: Mapping[str, Any]) -> None:
    """Write all inputs of all samples.

    Parameters
    ----------
    folder
        The campaign's folder.
    table
        The samples.
    attributes
        Global attributes: identity, texts and provenance.

    Raises
    ------
    OSError, RuntimeError
        If the disk is full.
    """
    with whole(folder / NAME) as draft, open_new(draft) as file:
        file.setncatts(dict(attributes))
        add_samples(file, np.arange(table.samples))
        add_inputs(file, table, compression=4)


def read_design(folder: Path) -> tuple[Table, dict[str, Any]]:
    """The samples of a campaign, and the global attributes of its design.

    Raises
    ------
    InputError
        If the folder holds no campaign.
    """
    path = folder / NAME
    if not path.is_file():
        raise InputError(f"{folder}: no campaign in this folder: {NAME} is not there")
    try:
        with netCDF4.Dataset(path) as file:
            file.set_auto_maskandscale(False)
            attributes = {name: file.getncattr(name) for name in file.ncattrs()}
            columns = tuple(
                _column(variable)
                for variable in file.variables.values()
                if "path" in variable.ncattrs()
            )
            seeds = file["sample_seed"][:]
    except (OSError, RuntimeError, KeyError, IndexError, AttributeError) as error:
        raise InputError(
            f"{path}: cannot be read: {error}; choose another folder, or delete this one"
        ) from None
    for name in ("identity", "scene", "solver"):
        if name not in attributes:
            raise InputError(
                f"{path}: this is not the design of a campaign, it has no attribute {name}: choose "
                "another folder"
            )
    return Table(columns, seeds), attributes


def add_inputs(file: Any, table: Table, *, compression: int) -> None:
    """Create a variable for every input, and the samples' seeds."""
    for column in table.columns:
        values = column.values
        if column.dim:
            add_dimension(file, column.dim, values.shape[1])
        dims = ("sample", column.dim) if column.dim else ("sample",)
        attributes = {
            "long_name": f"input {column.path}",
            "units": column.units,
            "path": column.path,
            "role": "input",
            "distribution": column.origin,
        }
        kind: Any = values.dtype
        if values.dtype.kind == "U":
            kind, values = str, values.astype(object)
            del attributes["units"]
        elif values.dtype.kind == "b":
            kind, values = "i1", values.astype("i1")
            attributes["dtype"] = "bool"
        options = {"compression": "zlib", "complevel": compression} if compression else {}
        if kind is str:
            options = {}
        variable = file.createVariable(column.name, kind, dims, **options)
        variable.setncatts(attributes)
        variable[:] = values
    seeds = file.createVariable("sample_seed", "i8", ("sample",))
    seeds.long_name = "seed of the sample, from the campaign's seed and the sample's index"
    seeds.units = "1"
    seeds[:] = table.seeds


def _column(variable: Any) -> Column:
    values = np.asarray(variable[:])
    if values.dtype.kind == "O":
        values = values.astype(str)
    if "dtype" in variable.ncattrs():
        values = values.astype(variable.getncattr("dtype"))
    return Column(
        name=variable.name,
        path=variable.path,
        dim=variable.dimensions[1] if len(variable.dimensions) > 1 else "",
        units=variable.getncattr("units") if "units" in variable.ncattrs() else "1",
        origin=variable.distribution,
        values=values,
    )
