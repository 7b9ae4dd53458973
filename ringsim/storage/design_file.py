"""design.nc: what a campaign is going to run, written before its first run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np

from ringsim.files import whole
from ringsim.refusal import InputError
from ringsim.sampling.columns import Table, add_inputs, read_inputs
from ringsim.storage.netcdf import add_coordinate

NAME = "design.nc"


def write_design(folder: Path, table: Table, attributes: Mapping[str, Any]) -> None:
    """Write all inputs of all samples; the attributes are identity, texts and provenance.

    OSError or RuntimeError if the disk is full.
    """
    with whole(folder / NAME) as draft, netCDF4.Dataset(draft, "w") as file:
        file.setncatts(dict(attributes))
        add_coordinate(file, "sample", np.arange(table.samples))
        add_inputs(file, table, compression=4)


def read_design(folder: Path) -> tuple[Table, dict[str, Any]]:
    """The samples of a campaign, and the global attributes of its design.

    InputError if the folder holds no campaign.
    """
    path = folder / NAME
    if not path.is_file():
        raise InputError(f"{folder}: no campaign in this folder: {NAME} is not there")
    try:
        with netCDF4.Dataset(path) as file:
            attributes = {name: file.getncattr(name) for name in file.ncattrs()}
            table = Table(read_inputs(file), file["sample_seed"][:])
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
    return table, attributes
