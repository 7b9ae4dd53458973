"""The drawn inputs of a campaign as columns of numbers: by mean, quarter, place, and by word."""

import hashlib
from dataclasses import dataclass

import numpy as np
import xarray as xr

from ringsim.analysis.intervals import Array
from ringsim.sampling.designs.grouped import stretches

_MOST_WORDS = 12
"""Different words of an input up to which each is a column of its own."""
_LEAST_QUARTERED = 8
"""Places of an input from which on each quarter of them has a mean of its own."""


@dataclass(frozen=True)
class Drawn:
    """Columns of inputs, shape (samples, columns), those that are alike in all samples left out."""

    names: tuple[str, ...]
    values: Array
    level: tuple[str, ...]
    """Of each column: "input"; of one that has many places "mean", "quarter" and "place"."""
    path: tuple[str, ...]
    """Of each column the scene path of its input."""


def drawn(campaign: xr.Dataset) -> Drawn:
    """All drawn inputs; one that several paths share is one column, named after the first."""
    found: dict[str, tuple[Array, str, str]] = {}
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
                    found[f"{path} = {word}"] = is_so, "input", path
        elif values.ndim == 1:
            found[path] = values.astype(float), "input", path
        else:
            numbers = values.astype(float)
            found[f"mean of {path}"] = numbers.mean(axis=1), "mean", path
            if (count := numbers.shape[1]) >= _LEAST_QUARTERED:
                for low, high in stretches(count, 4):
                    mean = numbers[:, low:high].mean(axis=1)
                    found[f"mean of {path}[{low + 1}..{high}]"] = mean, "quarter", path
            for k, place in enumerate(_places(campaign, variable)):
                found[f"{path}[{place}]"] = numbers[:, k], "place", path
    seen: set[bytes] = set()
    kept = {}
    for name, column in found.items():
        key = hashlib.blake2b(column[0].tobytes()).digest()
        if np.ptp(column[0]) > 0 and key not in seen:
            seen.add(key)
            kept[name] = column
    count = campaign.sizes["sample"]
    values = np.array([each[0] for each in kept.values()]).reshape(-1, count).T
    levels, paths = (tuple(str(each[k]) for each in kept.values()) for k in (1, 2))
    return Drawn(tuple(kept), values, levels, paths)


def _places(campaign: xr.Dataset, variable: xr.DataArray) -> list[str]:
    """Names of the places of an input: those of its coordinate if it has one, else numbers."""
    (dim,) = variable.dims[1:]
    for name, coordinate in variable.coords.items():
        if coordinate.dims == (dim,) and str(name).endswith("_name"):
            return [f'"{each}"' for each in coordinate.values]
    return [str(k + 1) for k in range(variable.sizes[dim])]
