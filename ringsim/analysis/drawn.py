"""The drawn inputs of a campaign as columns of numbers: by mean, by place, and word by word."""

import hashlib
from dataclasses import dataclass

import numpy as np
import xarray as xr

from ringsim.analysis.intervals import Array

_MOST_WORDS = 12
"""Different words of an input up to which each is a column of its own."""


@dataclass(frozen=True)
class Drawn:
    """Columns of inputs, shape (samples, columns), those that are alike in all samples left out."""

    names: tuple[str, ...]
    values: Array
    of_place: tuple[bool, ...]
    """Which columns are one place of an input that has many."""
    mean: tuple[bool, ...]
    """Which columns are the mean over the places of an input."""


def drawn(campaign: xr.Dataset) -> Drawn:
    """All drawn inputs; one that several paths share is one column, named after the first."""
    found: dict[str, tuple[Array, bool, bool]] = {}
    for name, variable in campaign.data_vars.items():
        says = variable.attrs
        if says.get("role") != "input" or says.get("path") == "solver.error_bars":
            continue
        path, values = str(says.get("path", name)), variable.to_numpy()
        if values.dtype.kind in "OUS":
            words = np.unique(values.astype(str))
            if values.ndim == 1 and len(words) <= _MOST_WORDS:
                for word in words[: 1 if len(words) == 2 else None]:
                    is_so = (values.astype(str) == word).astype(float)
                    found[f"{path} = {word}"] = is_so, False, False
        elif values.ndim == 1:
            found[path] = values.astype(float), False, False
        else:
            numbers = values.astype(float)
            found[f"mean of {path}"] = numbers.mean(axis=1), False, True
            for k, place in enumerate(_places(campaign, variable)):
                found[f"{path}[{place}]"] = numbers[:, k], True, False
    seen: set[bytes] = set()
    kept = {}
    for name, column in found.items():
        key = hashlib.blake2b(column[0].tobytes()).digest()
        if np.ptp(column[0]) > 0 and key not in seen:
            seen.add(key)
            kept[name] = column
    count = campaign.sizes["sample"]
    values = np.array([each[0] for each in kept.values()]).reshape(-1, count).T
    of_place = tuple(each[1] for each in kept.values())
    return Drawn(tuple(kept), values, of_place, tuple(each[2] for each in kept.values()))


def _places(campaign: xr.Dataset, variable: xr.DataArray) -> list[str]:
    """Names of the places of an input: those of its coordinate if it has one, else numbers."""
    (dim,) = variable.dims[1:]
    for name, coordinate in variable.coords.items():
        if coordinate.dims == (dim,) and str(name).endswith("_name"):
            return [f'"{each}"' for each in coordinate.values]
    return [str(k + 1) for k in range(variable.sizes[dim])]
