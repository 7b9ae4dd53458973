"""A run as an xarray dataset, and datasets as netCDF files."""

import contextlib
import json
import platform
import tomllib
import warnings
from collections.abc import Hashable
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim import build
from ringsim.files import require_file, require_regular, whole, writing
from ringsim.outputs import COORDINATES, VARIABLES
from ringsim.outputs.family import SPAN_NAME, axes, holds, span_names
from ringsim.refusal import InputError
from ringsim.scene import Scene, scene_from_toml
from ringsim.stored_state import layout_fingerprint
from ringsim.variables import OF_CAMPAIGNS, Fidelity, Outcome, Variable, flags_of


def to_dataset(outcome: Outcome, scene: Scene) -> xr.Dataset:
    """Give the arrays of a run of ``scene`` their dimensions, units, meaning and provenance.

    Everything that does not depend on time is always there, NaN where the run did not get so
    far (stress only if the scene records it); what depends on time is there if it was recorded.
    So the samples of a campaign fit together, also when some of them failed.

    Variables of ``ringsim.outputs`` have ``units`` and ``long_name``; ``status`` and ``cause``
    are int8 with CF flags.  Among the global attributes ``reason`` says in words how the run
    ended, and ``scene`` is the scene's TOML text.  ValueError if the outcome holds a name that no
    output declares, or an array whose shape does not fit its dimensions.
    """
    unknown = sorted(set(outcome.values) - set(VARIABLES))
    if unknown:
        raise ValueError(f"variables without a definition: {', '.join(unknown)}")
    known, held = axes(scene) | outcome.coordinates, holds(scene)
    found = outcome.values | {"status": np.array(outcome.status), "cause": np.array(outcome.cause)}
    # Variables, which nothing aligns: data arrays would cost as much as a short run.
    arrays: dict[str, xr.Variable] = {}
    for name, variable in VARIABLES.items():
        if name in found:
            arrays[name] = _array(variable, found[name])
            # Of another structure a variable may mean something else than of a ring.
            words = scene.structure.long_names.get(name, variable.long_name)
            arrays[name].attrs["long_name"] = words
        elif "time" not in variable.dims and held.issuperset(variable.needs):
            shape = tuple(len(known.get(dim, ())) for dim in variable.dims)
            missing = "" if variable.dtype == "str" else np.nan
            arrays[name] = _array(variable, np.full(shape, missing))
    used = {dim for array in arrays.values() for dim in array.dims}
    coordinates = {n: _array(v, known[n]) for n, v in COORDINATES.items() if n in used & set(known)}
    _add_states(arrays, coordinates, outcome, scene)
    names = span_names(scene)
    if [coordinates[dim].size for dim in SPAN_NAME.dims if dim in coordinates] == [*names.shape]:
        coordinates[SPAN_NAME.name] = _array(SPAN_NAME, names)
    return xr.Dataset(arrays, coords=coordinates, attrs=_attributes(outcome, scene))


def _add_states(
    arrays: dict[str, xr.Variable], coordinates: dict[str, xr.Variable],
    outcome: Outcome, scene: Scene,
) -> None:  # fmt: skip
    """Add the states that a run has stored."""
    if not (found := outcome.states):
        return
    told = {
        "long_name": "everything that a run needs to go on, see ringsim.stored_state",
        "engine": str(found["state_engine"]),
        "format": int(found["state_format"]),
        "layout": layout_fingerprint(scene),
        "history": str(found["history_form"]),
    }
    arrays["state"] = xr.Variable("state_entry", found["state"], told)
    for name, words in (
        ("state_form", "where the numbers of a state lie, JSON"),
        ("state_begin", "first number of a state"),
    ):
        attributes = {"long_name": words}
        arrays[name] = xr.Variable("state_time", found[name], attributes)
    attributes = {"long_name": "time of a stored state", "units": "s"}
    coordinates["state_time"] = xr.Variable("state_time", found["state_time"], attributes)


def save(dataset: xr.Dataset, path: str | Path) -> None:
    """Write a netCDF-4 file, whole or not at all; an older one of that name is replaced.

    Numeric arrays are compressed (zlib level 4, shuffle), missing values are NaN, missing
    counts -1.  InputError if the folder does not exist, the file cannot be written there, or its
    name does not end with ``.nc``.
    """
    path = Path(path)
    require_file(path)
    with writing(path), whole(path) as draft:
        dataset.drop_encoding().to_netcdf(
            draft, engine="netcdf4", format="NETCDF4", encoding=_encoding(dataset),
            unlimited_dims=[],
        )  # fmt: skip


def in_order(found: xr.Dataset) -> xr.Dataset:
    """The samples of a campaign by their numbers, and records by time, however they were selected
    or transposed: what analyses and figures tell of them goes by their places.

    InputError if no sample is left, or one of them, or another place, is there twice.
    """
    for dim in (name for name in found.indexes if name in found.dims):
        index = found.indexes[dim]
        if not index.is_unique:
            twice = index[index.duplicated()][0]
            raise InputError(f"{dim} = {twice} is twice in this selection: select each once")
        if dim in ("sample", "time") and not index.is_monotonic_increasing:
            found = found.sortby(dim)
    if found.sizes.get("sample") == 0:
        raise InputError("no sample is left in this selection: select one at least")
    turned = {}
    for name, each in found.data_vars.items():
        known = VARIABLES[str(name)].dims if name in VARIABLES else ()
        order = dict.fromkeys(("sample", *known, *each.dims))
        wanted = tuple(dim for dim in order if dim in each.dims)
        if wanted != each.dims:
            turned[name] = each.transpose(*wanted)
    return found.assign(turned) if turned else found


def as_in_scene(found: xr.Dataset) -> xr.Dataset:
    """The same with planes, sections, spans and others as the scene of a run or a campaign counts
    them, since what is drawn of them goes by their places.

    InputError if some of them are not there.
    """
    found, known = in_order(found), dict[str, NDArray[Any]]()
    if "scene" in found.attrs:
        with contextlib.suppress(InputError):  # told by what needs the scene
            known = axes(scene_from_toml(str(found.attrs["scene"]), source="attribute scene"))
    for dim in (each for each in known if each in found.coords):
        held, wanted = found[dim].values, f"each {dim} of the scene"
        if dim == "time":
            whole, wanted = held, "a dimension"
        elif dim in ("plane", "section", "axis"):
            whole = known[dim]
        else:  # of spans and others samples may have more than the scene
            whole = np.arange(1, held.size + 1)
        if held.ndim == 0 or not held.size or not {*whole.tolist()} <= {*held.tolist()}:
            told = ", ".join(map(str, np.atleast_1d(held).tolist()[:6])) or "none"
            raise InputError(
                f"{dim} is only {told} in this selection, and must be {wanted}: ask the whole "
                "dataset, and select from the answer"
            )
        turned = len(held) == len(whole) and not np.array_equal(held, whole)
        found = found.sel({dim: whole}) if turned else found
    return found


def with_plain_attributes(found: xr.Dataset) -> xr.Dataset:
    """A dataset with the numbers among its attributes as Python's: a file gives them back as
    numpy's, whose truths are no numbers to multiply a word with.
    """
    plain = {n: v.item() if isinstance(v, np.generic) else v for n, v in found.attrs.items()}
    return found.assign_attrs(plain)


_TEXTS = ("scene", "campaign", "title", "reason", "fidelity", "question", "campaign_name")
_JSON = ("design", "requirements", "max_difference", "stop_when", "suspects", "outputs")
"""Attributes of a run or a campaign that are texts, and those that are JSON."""


def require_declared(found: xr.Dataset, file: Path) -> None:
    """Refuse (InputError) a run or a campaign that is not made as its outputs declare it.

    What somebody else has written or changed would otherwise fail wherever it is used first.
    """
    if "status" not in found or "scene" not in found.attrs:
        return
    cure = (
        "it is damaged, changed, or a part of a result: merge the campaign, or run the scene, again"
    )
    for name, value in found.attrs.items():
        if name in (*_TEXTS, *_JSON) and not isinstance(value, str):
            raise InputError(f"{file}: its attribute {name} must be a text: {cure}")
        try:
            _ = json.loads(value) if name in _JSON and value else None
        except ValueError as error:
            raise InputError(f"{file}: its attribute {name} is no JSON: {error}: {cure}") from None
    try:
        tomllib.loads(found.attrs["scene"])
    except ValueError as error:
        raise InputError(f"{file}: its attribute scene is no TOML: {error}: {cure}") from None
    for name, variable in found.variables.items():
        if name in found.dims and variable.dims != (name,):
            raise InputError(f"{file}: {name} must have the dimension {name} alone: {cure}")
        if told := _undeclared(str(name), variable, found):
            raise InputError(f"{file}: {name} {told}: {cure}")


def _undeclared(name: str, variable: xr.Variable, found: xr.Dataset) -> str:
    """What of a stored variable is not as its output declares it; empty if all is."""
    own = name.removesuffix("_checked").removesuffix("_frame")
    if (declared := COORDINATES.get(own) or VARIABLES.get(own)) is None:
        return ""
    samples = ("sample",) * ("sample" in found.dims and own not in COORDINATES)
    # A part of a result lacks dimensions, and people turn them round.
    dims = tuple(dim for dim in (*samples, *declared.dims) if dim in found.dims)
    if {*variable.dims} != {*dims}:
        return f"has the dimensions {_listed(variable.dims)}, must have {_listed(dims)}"
    text = declared.dtype == "str"
    if text is not (variable.dtype.kind in "OUS"):
        return f"must hold {'texts' if text else 'numbers'}"
    if own in COORDINATES:
        values = np.atleast_1d(variable.to_numpy())
        again = len(set(values.tolist())) < len(values)
        again |= not text and not np.isfinite(values.astype(float)).all()
        return "holds a value twice, or none" if again else ""
    # A place that an output tells, such as peak_tension_span, is one that the file has.
    dim = own.rpartition("_")[2]
    if OF_CAMPAIGNS in declared.needs:  # a number of the user's own, whatever it is called
        return ""
    if declared.dims or dim not in COORDINATES or dim == "time" or dim not in found.coords:
        return ""
    known = {*np.atleast_1d(found[dim].to_numpy()).tolist(), -1, ""}
    wrong = [each for each in variable.to_numpy().ravel().tolist() if each == each]
    wrong = [each for each in wrong if each not in known]
    return f"holds {wrong[0]}, which is not a {dim} of the file" if wrong else ""


def _listed(dims: tuple[Hashable, ...]) -> str:
    return f"({', '.join(map(str, dims))})"


def _array(variable: Variable, values: np.ndarray[Any, Any]) -> xr.Variable:
    values = np.asarray(values)
    attributes: dict[str, Any] = {"long_name": variable.long_name}
    if variable.dtype != "str":
        attributes["units"] = variable.units
        counts = variable.dtype.startswith("i")
        missing = counts and values.dtype.kind == "f" and not np.isfinite(values).all()
        values = values.astype("f8" if missing else variable.dtype)
    if values.ndim != len(variable.dims):
        raise ValueError(
            f"{variable.name} has shape {values.shape}, but its dimensions are {variable.dims}"
        )
    if variable.flags is not None:
        attributes |= flags_of(variable.flags)
    return xr.Variable(variable.dims, values, attributes)


@cache
def version(package: str) -> str:
    """What is installed, which is read from a file."""
    return metadata.version(package)


def _attributes(outcome: Outcome, scene: Scene) -> dict[str, str]:
    now = datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
    software = f"ringsim {version('ringsim')}"
    title = scene.title or scene.name
    fidelity = Fidelity(int(outcome.values.get("fidelity", Fidelity.FULL)))
    # The library whose version decides about the numbers; the core's sources are ringsim's own.
    library = f" {version('exudyn')}" if fidelity is Fidelity.FULL else ""
    return {
        "Conventions": "CF-1.11, ACDD-1.3",
        "title": title,
        "summary": f"One simulated run of the scene {scene.name} ({title}), "
        f"status {outcome.status.word}.",
        "reason": outcome.reason,
        "history": f"{now} simulated by {software}",
        "date_created": now,
        "source": f"{software}: {fidelity.model}{library}",
        "fidelity": fidelity.word,
        "license": "None",
        **build.provenance(),
        **{f"{name}_version": version(name) for name in ("exudyn", "numpy")},
        "python_version": platform.python_version(),
        "scene": scene.to_toml(),
        **({"began": outcome.began} if outcome.began else {}),
    }


def _counts(values: np.ndarray[Any, Any], dtype: str) -> bool:
    """Whether all are missing, or numbers that a count's type holds: a mean of counts, as in an
    analysis, is no count.
    """
    inside = (values >= 0.0) & (values <= np.iinfo(dtype).max) & (values == np.rint(values))
    return bool((np.isnan(values) | inside).all())


def _encoding(dataset: xr.Dataset) -> dict[str, dict[str, Any]]:
    encoding: dict[str, dict[str, Any]] = {}
    for name, variable in dataset.variables.items():
        chosen: dict[str, Any] = {"_FillValue": None}
        declared = VARIABLES.get(str(name))
        if variable.dtype.kind == "f" and name not in dataset.coords:
            chosen["_FillValue"] = np.nan
            dtype = "f8" if declared is None else declared.dtype
            if dtype.startswith("i") and _counts(variable.values, dtype):
                chosen = {"dtype": dtype, "_FillValue": -1}
        if variable.ndim > 0 and variable.dtype.kind in "fiub":
            chosen |= {"zlib": True, "complevel": 4, "shuffle": True}
        encoding[str(name)] = chosen
    return encoding


# Files of results that are opened: what netCDF4 and xarray keep of them by themselves grows with
# the samples.


_SENTENCES = ("reason", "log", "overrides", "reason_checked")
_KEPT_BYTES = 8 << 20
"""What is kept of each variable that was read, unpacked, instead of 64 MiB."""
_READ_AT_ONCE = 1 << 14
"""Sentences that are read at once."""


def open_lazily(path: Path) -> xr.Dataset:
    """A file of results as ``xarray.open_dataset`` gives it, but sentences of samples as objects,
    equal ones once: as text of one width, one long log of a failed run would take as much memory
    in every sample.  InputError as of ``require_regular`` and ``require_declared``.
    """
    require_regular(path)
    with warnings.catch_warnings():
        # Of a file in which they stand twice, which is refused below.
        warnings.filterwarnings("ignore", "Duplicate dimension", UserWarning)
        result = _opened(path)
        try:
            require_declared(result, path)
        except InputError:
            result.close()
            raise
    return result


def _opened(path: Path) -> xr.Dataset:
    before = netCDF4.get_chunk_cache()
    netCDF4.set_chunk_cache(_KEPT_BYTES, *before[1:])
    try:
        # One handle for both: a file that is opened twice in turns crashes netCDF's library.
        opening: Any = xr.backends.NetCDF4DataStore.open
        store = opening(str(path))
    finally:
        netCDF4.set_chunk_cache(*before)
    file, known = store.ds, dict[str, str]()
    own = [
        name for name in _SENTENCES if name in file.variables
        and file[name].dimensions == ("sample",) and file[name].dtype is str
    ]  # fmt: skip
    found = xr.open_dataset(store, drop_variables=own)
    for name in own:
        attributes = {key: file[name].getncattr(key) for key in file[name].ncattrs()}
        found[name] = "sample", _shared(file[name], known), attributes
    ordered = {name: found[name] for name in file.variables if name in found.data_vars}
    result = xr.Dataset(ordered, found.coords, found.attrs)
    result.encoding = found.encoding
    result.set_close(found.close)
    return result


def _shared(variable: Any, known: dict[str, str]) -> NDArray[np.object_]:
    """The sentences of a variable over samples, each of which is in memory once."""
    values = np.full(variable.shape, "", dtype=object)
    for start in range(0, len(values), _READ_AT_ONCE):
        part = variable[start : start + _READ_AT_ONCE]
        values[start : start + _READ_AT_ONCE] = [known.setdefault(text, text) for text in part]
    return values
