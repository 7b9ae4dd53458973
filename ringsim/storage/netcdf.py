"""How variables lie in netCDF files: types, attributes, chunks and compression."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

import netCDF4
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ringsim.refusal import known_or_nearest
from ringsim.storage.result import COORDINATE, MISSING_COUNT
from ringsim.units import Model
from ringsim.variables import VARIABLES, Status, Variable

NOT_RUN = -1
"""Value of ``status`` for samples that have not been run."""

CHUNK_BYTES = 1 << 20
"""Size of what is compressed at once, about."""

PER_SAMPLE = {
    v.name: v
    for v in (
        VARIABLES["status"],
        Variable("reason", (), "1", "why the run ended so", "str"),
        Variable("log", (), "1", "end of what a failed run printed", "str"),
    )
}
"""What is known of every sample beside its outputs."""

Digits = Annotated[int, Field(ge=1, le=15)]


class Output(Model):
    """How ``campaign.nc`` stores the results."""

    gone: ClassVar[dict[str, str]] = {
        "shard_samples": "results are kept in journals of any length; leave it out",
    }

    compression: Annotated[int, Field(ge=0, le=9)] = 4
    """Level of zlib; 0 stores plain numbers."""
    significant_digits: dict[str, Digits] = Field(default_factory=dict)
    """Decimal digits that are kept, by variable; the rest is rounded away before compression."""
    leave_out: list[str] = Field(default_factory=list)
    """Output variables that the merged file does not hold."""

    @model_validator(mode="after")
    def _known(self) -> Output:
        for name in [*self.significant_digits, *self.leave_out]:
            if name not in VARIABLES:
                hint = known_or_nearest(name, VARIABLES)
                raise ValueError(f"{name} is not an output variable ({hint})")
        return self


def add_coordinate(file: Any, name: str, values: NDArray[Any]) -> None:
    """Create a dimension with its coordinate variable."""
    definition = COORDINATE[name]
    file.createDimension(name, len(values))
    kind: Any = str if definition.dtype == "str" else definition.dtype
    variable = file.createVariable(name, kind, (name,))
    variable.long_name = definition.long_name
    if kind is not str:
        variable.units = definition.units
    variable[:] = values.astype(object) if kind is str else values


def add_samples(file: Any, samples: NDArray[np.int64]) -> None:
    """Create the dimension ``sample`` with the samples' indices."""
    file.createDimension("sample", len(samples))
    variable = file.createVariable("sample", "i8", ("sample",))
    variable.standard_name = "realization"
    variable.long_name = "sample of the campaign"
    variable.units = "1"
    variable[:] = samples


def add_variable(
    file: Any,
    definition: Variable,
    *,
    compression: int,
    digits: int | None = None,
) -> Any:
    """Create a variable over ``sample`` and its own dimensions.

    Parameters
    ----------
    file
        An open netCDF4 dataset that has the dimensions.
    definition
        Name, dimensions, units and meaning.
    compression
        Level of zlib (with shuffle); 0 for none.
    digits
        Significant decimal digits to keep.
    """
    dims = ("sample", *definition.dims)
    shape = tuple(file.dimensions[dim].size for dim in dims)
    options: dict[str, Any] = {}
    kind: Any = definition.dtype
    if kind == "str":
        kind = str
    else:
        size = np.dtype(kind).itemsize
        row = max(1, int(np.prod(shape[1:], dtype=np.int64)) * size)
        rows = max(1, min(shape[0], CHUNK_BYTES // row))
        options["chunksizes"] = (rows, *(max(1, n) for n in shape[1:]))
        options["compression"] = "zlib" if compression else None
        options["complevel"] = compression or None
        options["shuffle"] = bool(compression)
        if kind.startswith("f"):
            options["fill_value"] = np.nan
            if digits is not None:
                options |= {"significant_digits": digits, "quantize_mode": "GranularBitRound"}
        elif definition.name in VARIABLES and definition.name != "status":
            options["fill_value"] = MISSING_COUNT
    variable = file.createVariable(definition.name, kind, dims, **options)
    variable.set_auto_maskandscale(False)
    variable.long_name = definition.long_name
    if kind is not str:
        variable.units = definition.units
    if definition.name == "status":
        variable.flag_values = np.array([NOT_RUN, *Status], dtype="i1")
        variable.flag_meanings = " ".join(["not_run", *(s.word for s in Status)])
    return variable


def blank(definition: Variable, shape: tuple[int, ...]) -> NDArray[Any]:
    """An array of missing values."""
    if definition.dtype == "str":
        return np.full(shape, "", dtype=object)
    if definition.name == "status":
        return np.full(shape, NOT_RUN, dtype="i1")
    kind = np.dtype(definition.dtype)
    return np.full(shape, np.nan if kind.kind == "f" else MISSING_COUNT, dtype=kind)


def open_new(path: Any) -> Any:
    """A new netCDF-4 file."""
    return netCDF4.Dataset(path, "w", format="NETCDF4")
