"""How variables lie in netCDF files, and the locks of those that are written."""

import contextlib
import fcntl
import math
import os
import platform
import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any, ClassVar

import netCDF4
import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from ringsim import build
from ringsim.files import DESIGN, campaign_cure, whole, writing
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.family import SPAN_NAME
from ringsim.refusal import InputError, known_or_nearest, show
from ringsim.sampling.columns import Table, add_inputs, read_inputs
from ringsim.storage.result import MISSING_COUNT
from ringsim.units import Model
from ringsim.variables import NO_CODE, Fidelity, Variable, flags_of

# How variables lie in netCDF files, and where these come from; ``design.nc``.


_PACKAGES = ("exudyn", "numpy", "scipy", "netCDF4", "mpi4py")

CHUNK_BYTES = 1 << 20
"""Size of what is compressed at once, about."""
CHUNK_ROWS = 1 << 14
"""Samples that are compressed at once, at most: hundreds of variables have one such piece each in
memory while they are written."""

PER_SAMPLE = {name: VARIABLES[name] for name in ("status", "cause")} | {
    "reason": Variable("reason", (), "1", "why the run ended so", "str"),
    "log": Variable("log", (), "1", "last lines of output of a failed run", "str"),
    "overrides": Variable("overrides", (), "1", "settings given for this sample alone", "str"),
    "attempts": Variable("attempts", (), "1", "stored results, failed runs included", "i4"),
}
"""What is known of every sample beside its outputs."""


NO_LICENSE = "None"
"""What ACDD wants to read where nobody has stated a licence."""


class OutputTable(Model):
    """How ``campaign.nc`` stores the results."""

    gone: ClassVar[dict[str, str]] = {
        "shard_samples": "there is no limit any more: leave it out",
    }

    compression: Annotated[int, Field(ge=0, le=9)] = 4
    """Level of zlib; 0 stores plain numbers."""
    significant_digits: dict[str, Annotated[int, Field(ge=1, le=15)]] = Field(default_factory=dict)
    """Decimal digits that are kept, by variable; the rest is rounded away before compression."""
    leave_out: list[str] = Field(default_factory=list)
    """Output variables that the merged file does not hold."""
    license: Annotated[str, Field(max_length=500)] = NO_LICENSE
    """Under which terms others may use the file: a name or address of a licence."""
    creator: Annotated[str, Field(max_length=500)] = ""
    """Who answers for the results: a person, group or institution."""

    @model_validator(mode="after")
    def _known(self) -> "OutputTable":
        for name in [*self.significant_digits, *self.leave_out]:
            if name not in VARIABLES:
                hint = known_or_nearest(name, VARIABLES)
                raise ValueError(f"{name} is not an output variable ({hint})")
        return self

    def stated(self) -> dict[str, str]:
        """Attributes of the file that its makers state."""
        terms, creator = self.license.strip() or NO_LICENSE, self.creator.strip()
        return {"license": terms} | ({"creator_name": creator} if creator else {})


def add_coordinate(file: Any, name: str, values: NDArray[Any]) -> None:
    """Create a dimension with its coordinate variable in an open netCDF4 dataset."""
    sample = Variable("sample", ("sample",), "1", "sample of the campaign", "i8")
    file.createDimension(name, len(values))
    variable = _create(file, COORDINATES.get(name, sample), (name,))
    if name == "sample":
        variable.standard_name = "realization"
    variable[:] = values.astype(object) if values.dtype.kind == "U" else values


def add_span_names(file: Any, names: NDArray[Any]) -> None:
    """Name the spans of an open netCDF4 dataset that has the dimensions, shape (planes, spans)."""
    _create(file, SPAN_NAME, SPAN_NAME.dims)[:] = names.astype(object)
    file.coordinates = SPAN_NAME.name


def add_variable(
    file: Any, definition: Variable, *, compression: int, digits: int | None = None
) -> None:
    """Create a variable over ``sample`` and its own dimensions, which the file has.

    ``compression`` is a level of zlib, 0 for none; ``digits`` are the significant ones to keep.
    """
    dims = ("sample", *definition.dims)
    options: dict[str, Any] = {}
    if definition.dtype != "str":
        samples, *shape = (file.dimensions[dim].size for dim in dims)
        row = max(1, math.prod(shape) * np.dtype(definition.dtype).itemsize)
        rows = max(1, min(samples, CHUNK_ROWS, CHUNK_BYTES // row))
        options["chunksizes"] = (rows, *(max(1, n) for n in shape))
        if definition.flags is None:  # a missing code has a word like others
            options["fill_value"] = blank(definition, ())[()]
        if compression:
            options |= {"compression": "zlib", "complevel": compression, "shuffle": True}
        if definition.dtype.startswith("f") and digits is not None:
            options |= {"significant_digits": digits, "quantize_mode": "GranularBitRound"}
    variable = _create(file, definition, dims, **options)
    variable.set_auto_maskandscale(False)
    if definition.dtype != "str":
        # Samples are written in turn, so one piece is enough; the library keeps 64 MiB otherwise.
        variable.set_var_chunk_cache(size=rows * row, nelems=1)
    if definition.flags is not None:
        flags = flags_of(definition.flags)
        missing = "not_run" if definition.name.startswith("status") else "unknown"
        variable.flag_values = np.append(np.int8(NO_CODE), flags["flag_values"])
        variable.flag_meanings = f"{missing} {flags['flag_meanings']}"


def _create(file: Any, definition: Variable, dims: tuple[str, ...], **options: Any) -> Any:
    text = definition.dtype == "str"
    kind = str if text else definition.dtype
    variable = file.createVariable(definition.name, kind, dims, **options)
    variable.long_name = definition.long_name
    if not text:
        variable.units = definition.units
    return variable


def blank(definition: Variable, shape: tuple[int, ...]) -> NDArray[Any]:
    """An array of missing values."""
    if definition.dtype == "str":
        return np.full(shape, "", dtype=object)
    kind = np.dtype(definition.dtype)
    return np.full(shape, np.nan if kind.kind == "f" else MISSING_COUNT, dtype=kind)


def write_design(folder: Path, table: Table, attributes: Mapping[str, Any]) -> None:
    """Write all inputs of all samples; OSError or RuntimeError if the disk is full."""
    with whole(folder / DESIGN) as draft, netCDF4.Dataset(draft, "w") as file:
        file.setncatts(dict(attributes))
        add_coordinate(file, "sample", np.arange(table.samples))
        add_inputs(file, table, compression=4)


def read_design(folder: Path) -> tuple[Table, dict[str, Any]]:
    """The samples of a campaign, and the attributes of its design; InputError if there is none."""
    path = folder / DESIGN
    if not path.is_file():
        what = "this is a file" if folder.exists() else "there is no such folder"
        if folder.is_dir():
            what = f"no campaign in this folder: it has no {DESIGN}"
        raise InputError(f"{folder}: {what}: {campaign_cure(folder)}")
    try:
        with netCDF4.Dataset(path) as file:
            attributes = {name: file.getncattr(name) for name in file.ncattrs()}
            table = Table(read_inputs(file), file["sample_seed"][:])
    except (OSError, RuntimeError, KeyError, IndexError, AttributeError) as error:
        raise InputError(
            f"{path}: cannot be read: {error}; choose another folder, or delete this one"
        ) from None
    if absent := [name for name in ("identity", "scene", "solver") if name not in attributes]:
        raise InputError(
            f"{path}: this is not the design of a campaign, it has no attribute {absent[0]}: "
            "choose another folder"
        )
    if str(attributes.get("fidelity", "full")).upper() not in Fidelity.__members__:
        raise InputError(
            f"{path}: its fidelity is {show(attributes['fidelity'])}: the file is damaged or "
            "changed: choose another folder"
        )
    return table, attributes


def attributes_of_file(*, name: str, title: str, action: str, model: Fidelity) -> dict[str, Any]:
    """Attributes after ACDD: by whom, when, where and with what a campaign's file was made."""
    versions = {f"{package}_version": version(package) for package in _PACKAGES}
    now = datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
    software = f"ringsim {version('ringsim')}"
    return {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": title or name,
        "summary": f"Campaign {name} of simulated ring deployments: inputs and outputs by sample.",
        "history": f"{now} {action} by {software}",
        "date_created": now,
        "source": f"{software}: {model.model}", "fidelity": model.word,
        "license": NO_LICENSE, "creator_software": software,
        "python_version": platform.python_version(), "platform": platform.platform(),
        "host": platform.node(), **build.provenance(), **versions,
    }  # fmt: skip


# Locks: which process may run which samples of a campaign's folder.


GO_ON = (
    "free some space or choose another folder, then run the same command again: finished samples "
    "are kept"
)
"""What to do when a campaign's folder cannot be written to."""

_LOCK_TRIES, _LOCK_PAUSE = 10, 0.1


@contextlib.contextmanager
def locked(path: Path, *, shared: bool = False, wait: bool = False) -> Iterator[bool]:
    """Hold an advisory lock; False if another process holds it, unless it may ``wait``.

    Others may hold a shared lock, too.  OSError if its file is not there and cannot be created;
    InputError if it is a link, what that leads to is none of ours, or no file.
    """
    if path.is_symlink() or (path.exists() and not path.is_file()):
        what = "a link" if path.is_symlink() else "a folder" if path.is_dir() else "no file"
        raise InputError(f"{path}: is {what}, but must be a lock file of the campaign: remove it")
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
    except OSError:
        if not path.exists():
            raise
        # Does as well, in folders that are read-only.
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        held = True  # also on a file system without locks
        try:
            fcntl.flock(descriptor, kind if wait else kind | fcntl.LOCK_NB)
        except BlockingIOError:
            held = False
        except OSError:
            pass
        yield held
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def reserved(folder: Path, writer: str, *, alone: bool) -> Iterator[None]:
    """Keep other processes from the share ``writer``, or if ``alone`` from all; or InputError."""
    for _ in tries(folder):
        with contextlib.ExitStack() as held:
            with writing(folder / f"lock-{writer}", GO_ON):
                free = held.enter_context(locked(folder / "lock", shared=not alone)) and (
                    held.enter_context(locked(folder / f"lock-{writer}"))
                )
            if free:
                yield
                return


def tries(folder: Path) -> Iterator[int]:
    """Count up, with pauses, for as long as it pays to wait for a lock; after that InputError."""
    for number in range(_LOCK_TRIES):
        yield number
        time.sleep(_LOCK_PAUSE)
    raise InputError(
        f"{folder}: another process is running this campaign: wait for it, or stop it (ringsim "
        "status shows which one)"
    )


def runs_in(folder: Path) -> bool:
    """Whether any process runs a campaign in a folder just now."""
    path = folder / "lock"
    if not path.exists():
        return False
    with locked(path) as free:
        return not free


def in_use(folder: Path, writer: str) -> bool:
    """Whether a process runs a share of a campaign just now."""
    path = folder / f"lock-{writer}"
    if not path.exists():
        return False
    with locked(path, shared=True) as free:
        return not free
