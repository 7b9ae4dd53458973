"""MATLAB's files, level 5: every variable under its name, with what it means beside it."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.io import savemat

from ringsim.export.words import meaning_of
from ringsim.files import whole
from ringsim.refusal import InputError

LONGEST_NAME = 63
"""Characters of a name; MATLAB cuts longer ones."""
MOST_BYTES = (1 << 31) - 1
"""Of one variable in files of this level."""


def write_mat(dataset: xr.Dataset, folder: Path, stem: str) -> list[Path]:
    """Write STEM.mat; returns it.

    Beside the variables and coordinates ``units``, ``meaning`` and ``dimensions`` are structs with
    their words by name, ``attributes`` those of the dataset.  Words are cells; codes stay numbers,
    with their words in ``codes``.

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
    with whole(path, lasting=False) as draft, draft.open("wb") as file:
        savemat(
            file, content | about | {"attributes": attributes}, do_compression=True,
            long_field_names=True, oned_as="column",
        )  # fmt: skip
    return [path]
