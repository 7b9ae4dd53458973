"""The drawn inputs of a campaign as columns of numbers: by mean, quarter, place, and by word."""

import hashlib
from dataclasses import dataclass

import numpy as np
import xarray as xr

from ringsim.analysis.campaign_samples import called, inputs
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
    input: tuple[str, ...]
    """Of each column the name of its input."""


def drawn(campaign: xr.Dataset) -> Drawn:
    """All drawn inputs by the names that the campaign's file gives them: one that several paths
    share is one column; inputs of other names that are alike in all samples are one, too, which has
    both names, since nothing tells them apart.
    """
    found: dict[str, tuple[Array, str, str]] = {}
    for variable in (campaign[name] for name in inputs(campaign)):
        if variable.attrs.get("path") == "solver.error_bars":
            continue
        own, values = called(variable), variable.to_numpy()
        if values.dtype.kind in "OUS":
            words = np.unique(values.astype(str))
            if values.ndim == 1 and len(words) <= _MOST_WORDS:
                for word in words[: 1 if len(words) == 2 else None]:
                    is_so = (values.astype(str) == word).astype(float)
                    found[f"{own} = {word}"] = is_so, "input", own
        elif values.ndim == 1:
            found[own] = values.astype(float), "input", own
        else:
            numbers = values.astype(float)
            found[f"mean of {own}"] = numbers.mean(axis=1), "mean", own
            if (count := numbers.shape[1]) >= _LEAST_QUARTERED:
                for low, high in stretches(count, 4):
                    mean = numbers[:, low:high].mean(axis=1)
                    found[f"mean of {own}[{low + 1}..{high}]"] = mean, "quarter", own
            for k, place in enumerate(place_names(campaign, variable)):
                found[f"{own}[{place}]"] = numbers[:, k], "place", own
    kept: dict[bytes, tuple[list[str], Array, str, list[str]]] = {}
    for name, (column, level, own) in found.items():
        if np.ptp(column) > 0:
            key = hashlib.blake2b(column.tobytes()).digest()
            names, _, _, owners = kept.setdefault(key, ([], column, level, []))
            if own not in owners:  # the mean of one place is that place
                names.append(name)
                owners.append(own)
    count = campaign.sizes["sample"]
    values = np.array([column for _, column, _, _ in kept.values()]).reshape(-1, count).T
    return Drawn(
        tuple(" and ".join(names) for names, *_ in kept.values()), values,
        tuple(level for _, _, level, _ in kept.values()),
        tuple(owners[0] for *_, owners in kept.values()),
    )  # fmt: skip


def place_names(campaign: xr.Dataset, variable: xr.DataArray) -> list[str]:
    """Names of the places of an input: those of its coordinate if it has one, else numbers."""
    (dim,) = variable.dims[1:]
    for name, coordinate in variable.coords.items():
        if coordinate.dims == (dim,) and str(name).endswith("_name"):
            return [f'"{each}"' for each in coordinate.values]
    return [str(k + 1) for k in range(variable.sizes[dim])]
