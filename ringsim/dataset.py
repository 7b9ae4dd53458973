"""A run as an xarray dataset, and datasets as netCDF files."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ringsim.choice import kind_of
from ringsim.files import whole, writing
from ringsim.refusal import InputError
from ringsim.scene import Scene
from ringsim.variables import COORDINATES, RODS, VARIABLES, Fidelity, Outcome, Status, Variable

CONVENTIONS = "CF-1.11, ACDD-1.3"
_MISSING_COUNT = -1


def to_dataset(outcome: Outcome, scene: Scene) -> xr.Dataset:
    """Give the arrays of a run their dimensions, units, meaning and provenance.

    Everything that does not depend on time is always there, NaN where the run did not get so
    far (stress only if the scene records it); what depends on time is there if it was recorded.
    So the samples of a campaign fit together, also when some of them failed.

    Parameters
    ----------
    outcome
        What the run gave.
    scene
        The scene that was run; its TOML text becomes the attribute ``scene``.

    Returns
    -------
    xr.Dataset
        Variables of ``ringsim.variables`` with ``units`` and ``long_name``; ``status`` is an
        int8 with CF flags; the global attribute ``reason`` says in words how the run ended.

    Raises
    ------
    ValueError
        If the outcome holds a name that ``ringsim.variables`` does not know, or an array whose
        shape does not fit its dimensions.
    """
    unknown = sorted(set(outcome.values) - set(VARIABLES))
    if unknown:
        raise ValueError(f"variables without a definition: {', '.join(unknown)}")
    axes = _axes(outcome, scene)
    arrays: dict[str, xr.DataArray] = {}
    for name, variable in VARIABLES.items():
        if name == "status":
            arrays[name] = _status(outcome.status)
        elif name in outcome.values:
            arrays[name] = _array(variable, outcome.values[name])
            arrays[name].attrs.update(_meaning(name, scene))
        elif "time" not in variable.dims and _wanted(variable, scene):
            shape = tuple(len(axes[dim]) for dim in variable.dims)
            arrays[name] = _array(variable, np.full(shape, np.nan))
    used = {dim for array in arrays.values() for dim in array.dims}
    coordinates = {v.name: _array(v, axes[v.name]) for v in COORDINATES if v.name in used}
    return xr.Dataset(arrays, coords=coordinates, attrs=_attributes(outcome, scene))


def save(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a netCDF-4 file, whole or not at all.

    Numeric arrays are compressed (zlib level 4, shuffle), missing values are NaN, missing
    counts -1.  The file appears under its name only once it is complete on the disk.

    Parameters
    ----------
    dataset
        What to write.
    path
        The file; an older one of that name is replaced.

    Raises
    ------
    InputError
        If the folder does not exist, or if the file cannot be written there.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}: create it first")
    if path.is_dir():
        raise InputError(f"{path}: this is a folder: give the name of a file")
    with writing(path), whole(path) as draft:
        dataset.drop_encoding().to_netcdf(
            draft,
            engine="netcdf4",
            format="NETCDF4",
            encoding=_encoding(dataset),
            unlimited_dims=[],
        )


def _wanted(variable: Variable, scene: Scene) -> bool:
    """Whether a scene asks for what a variable says."""
    holds = {"": True, "stress": scene.record.stress, "cables": scene.cables is not None}
    bars = scene.solver.error_bars
    holds |= {f"error bars of {part}": bars and there for part, there in holds.items() if part}
    holds["error bars"] = bars
    holds[kind_of(scene.structure)] = True
    return holds.get(variable.needs, False)


def _meaning(name: str, scene: Scene) -> dict[str, str]:
    """Attributes by which a variable of this structure differs from the ring's."""
    words = scene.structure.long_names.get(name)
    return {} if words is None else {"long_name": words}


def _axes(outcome: Outcome, scene: Scene) -> dict[str, np.ndarray[Any, Any]]:
    """Values of every dimension; the outcome's own where it has them."""
    known: dict[str, np.ndarray[Any, Any]] = {
        "plane": np.array(scene.structure.planes),
        "section": np.arange(1, scene.structure.sections + 1),
        "rod": np.array(RODS),
        "time": np.empty(0),
    }
    return known | outcome.coordinates


def _array(variable: Variable, values: np.ndarray[Any, Any]) -> xr.DataArray:
    values = np.asarray(values)
    attributes = {"long_name": variable.long_name}
    if variable.dtype != "str":
        attributes["units"] = variable.units
        whole = np.issubdtype(np.dtype(variable.dtype), np.integer)
        missing = whole and values.dtype.kind == "f" and not np.isfinite(values).all()
        values = values.astype("f8" if missing else variable.dtype)
    if values.ndim != len(variable.dims):
        raise ValueError(
            f"{variable.name} has shape {values.shape}, but its dimensions are {variable.dims}"
        )
    return xr.DataArray(values, dims=variable.dims, attrs=attributes)


def _status(status: Status) -> xr.DataArray:
    array = _array(VARIABLES["status"], np.array(int(status)))
    array.attrs["flag_values"] = np.array([int(s) for s in Status], dtype="i1")
    array.attrs["flag_meanings"] = " ".join(s.word for s in Status)
    return array


def _attributes(outcome: Outcome, scene: Scene) -> dict[str, str]:
    now = datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
    software = f"ringsim {version('ringsim')}"
    title = scene.title or scene.name
    ideal = int(outcome.values.get("fidelity", Fidelity.FULL)) == Fidelity.IDEAL
    model = "ideal ring of rigid rods" if ideal else "multibody simulation with exudyn"
    engine = "" if ideal else f" {version('exudyn')}"
    return {
        "Conventions": CONVENTIONS,
        "title": title,
        "summary": f"One simulated run of the scene {scene.name} ({title}), "
        f"status {outcome.status.word}.",
        "reason": outcome.reason,
        "history": f"{now} simulated by {software}",
        "date_created": now,
        "source": f"{software}: {model}{engine}",
        "fidelity": "ideal" if ideal else "full",
        "creator_name": "ringsim",
        "ringsim_version": version("ringsim"),
        "exudyn_version": version("exudyn"),
        "numpy_version": version("numpy"),
        "python_version": platform.python_version(),
        "scene": scene.to_toml(),
    }


def _encoding(dataset: xr.Dataset) -> dict[str, dict[str, Any]]:
    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        chosen: dict[str, Any] = {"_FillValue": None}
        declared = VARIABLES.get(str(name))
        if variable.dtype.kind == "f" and name not in dataset.coords:
            chosen["_FillValue"] = np.nan
            if declared is not None and np.dtype(declared.dtype).kind == "i":
                chosen = {"dtype": declared.dtype, "_FillValue": _MISSING_COUNT}
        if variable.ndim > 0 and variable.dtype.kind in "fiub":
            chosen |= {"zlib": True, "complevel": 4, "shuffle": True}
        encoding[str(name)] = chosen
    return encoding
