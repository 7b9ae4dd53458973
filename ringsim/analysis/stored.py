"""Opening what ringsim has stored: campaigns and runs, by folder or by file."""

from pathlib import Path

import xarray as xr

from ringsim.refusal import InputError

MERGED = "campaign.nc"


def open_stored(path: Path) -> xr.Dataset:
    """The dataset in a file, or of the campaign in a folder, loaded only as far as it is used.

    What has one value a sample is in memory at once, for it is used again and again; series stay
    in the file.
    InputError if there is none, or it is not merged yet; close it, or use it in ``with``.
    """
    file = path
    if path.is_dir():
        file = path / MERGED
        if not file.exists():
            inside = (path / "design.nc").exists()
            cure = "there is no campaign in it: give the folder that ringsim campaign named"
            if inside and any(path.glob("journals/*")):
                cure = f"its results are not merged yet: give ringsim merge {path} first"
            elif inside:
                cure = "no sample of it has run yet: give ringsim campaign the same file again"
            raise InputError(f"{path}: this folder holds no {MERGED}: {cure}")
    try:
        found = xr.open_dataset(file, engine="netcdf4")
        for variable in found.variables.values():
            if len(variable.dims) < 2:
                variable.load()
        return found
    except FileNotFoundError:
        raise InputError(
            f"{file}: there is no such file or folder: check its name, and the folder that you are "
            "in"
        ) from None
    except (OSError, ValueError) as error:
        if file.suffix == ".toml":
            raise InputError(
                f"{file}: this says what to run, and holds no results: give the folder that "
                "ringsim campaign named, runs/NAME by default"
            ) from None
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"{file}: cannot be read as a netCDF file: {reason}; give a file that ringsim has "
            "written"
        ) from None
