"""Courses of all samples on one axis, the share of each run that has passed, and their quantiles.

Angles of all samples are never in memory together: blocks of samples are read and laid on the axis,
for a part of the axis at a time, over which the quantiles of all samples are then exact.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.quantities import good
from ringsim.analysis.reading import blocks
from ringsim.outputs.family import Array

QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)
"""What bands show: all samples, nine in ten, the median."""
MOST, FEWER = 401, 101
"""Points along the axis at most: more than a figure resolves; fewer where samples are many."""
HELD_BYTES = 200 << 20
"""Angles that are held at once."""
_ANGLE = "opening_angle"
_PASSES = 4
"""Times that the file is read for MOST points, at most."""
Numbers = NDArray[np.float32]


@dataclass(frozen=True)
class Courses:
    """Quantiles over the samples of each section's deviation from the mean opening angle."""

    bands: xr.DataArray
    """Shape (quantile, plane, section, share), degree."""
    samples: NDArray[np.int64]
    """Samples whose numbers hold and that were recorded."""

    @property
    def median(self) -> xr.DataArray:
        """The middle one, (plane, section, share)."""
        return self.bands.sel(quantile=0.5)


def ends(campaign: xr.Dataset) -> Array:
    """When each run was over: its last lock, or its end if there was none; s, (sample,)."""
    final, time = campaign["final_time"].to_numpy(), campaign["time"].to_numpy()
    deployed = campaign["deployment_time"].to_numpy()
    found = np.where(np.isfinite(deployed), deployed, final)
    return np.asarray(np.where(np.isfinite(found), found, time[-1]), dtype=float)


def courses(campaign: xr.Dataset, quantiles: Sequence[float] = QUANTILES) -> Courses:
    """Quantiles of the deviations of a campaign that is in memory, or opened.

    Of the samples whose numbers hold and that were recorded; linear between records, which is
    what the file knows.  Runs last differently long, so that at one time some would have ended,
    and what a fan shows there would be the slow ones alone.
    """
    places = campaign.sizes["plane"] * campaign.sizes["section"]
    each = 4 * places * max(1, int(good(campaign).sum()))
    most = MOST if each * MOST <= _PASSES * HELD_BYTES else FEWER
    share = np.linspace(0.0, 1.0, int(np.clip(campaign.sizes["time"], 2, most)))
    parts = np.array_split(share, min(len(share), -(-each * len(share) // HELD_BYTES)))
    found, kept = [], np.empty(0, dtype=np.int64)
    for part in parts:
        held, kept = _held(campaign, part)
        bands = np.full((len(quantiles), *held.shape[:-1]), np.nan)
        for place in np.ndindex(held.shape[:2] if len(kept) else (0, 0)):
            # Sorted in place: nothing else reads it.
            levels = np.quantile(held[place], quantiles, axis=-1, overwrite_input=True)
            bands[(slice(None), *place)] = levels
        found.append(bands)
        del held
    every = np.concatenate(found, axis=-1)
    return Courses(_labelled(campaign, every, share, quantile=list(quantiles)), kept)


def course(campaign: xr.Dataset, sample: int, share: Array) -> xr.DataArray:
    """The deviations of one sample, (plane, section, share), degree."""
    (rows, _), *_ = _rows(campaign.sel(sample=[sample]), share)
    return _labelled(campaign, rows[0], share)


def _labelled(campaign: xr.Dataset, values: Any, share: Array, **more: Any) -> xr.DataArray:
    axis = ("share", share, {"long_name": "share of the run until its last lock or end"})
    coords = more | {"plane": campaign["plane"], "section": campaign["section"], "share": axis}
    says = campaign[_ANGLE].attrs
    attrs = {"units": says.get("units", "1"), "long_name": "deviation from the mean opening angle"}
    return xr.DataArray(values, dims=list(coords), coords=coords, attrs=attrs)


def _held(campaign: xr.Dataset, share: Array) -> tuple[Numbers, NDArray[np.int64]]:
    """The deviations of all samples there, (plane, section, share, sample), and which they are."""
    wide = campaign.sizes["plane"], campaign.sizes["section"], len(share)
    held, kept = np.empty((*wide, int(good(campaign).sum())), dtype="f4"), []
    count = 0
    for rows, samples in _rows(campaign, share):
        held[..., count : count + len(rows)] = np.moveaxis(rows, 0, -1)
        count += len(rows)
        kept.append(samples)
    return held[..., :count], np.concatenate([np.empty(0, dtype=np.int64), *kept])


def _rows(campaign: xr.Dataset, share: Array) -> Iterator[tuple[Numbers, NDArray[np.int64]]]:
    """Deviations of the samples of each block, (sample, plane, section, share), and which."""
    for block in blocks(campaign, [_ANGLE, "status", "final_time", "deployment_time"]):
        block = block.isel(sample=np.flatnonzero(good(block)))
        angles = block[_ANGLE].transpose("sample", "plane", "section", "time").to_numpy()
        known = np.isfinite(angles).all(axis=(1, 2))
        counts = known.sum(axis=1)
        # Records are there from the start on up to an end; what has gaps is laid out by itself.
        whole = (known == (np.arange(known.shape[1]) < counts[:, None])).all(axis=1)
        time, end = block["time"].to_numpy(), ends(block)
        rows = np.empty((len(angles), *angles.shape[1:3], len(share)))
        fit = whole & (counts >= 2)
        rows[fit] = _laid(angles[fit], time, counts[fit], end[fit], share)
        for k in np.flatnonzero(~whole & (counts >= 2)):
            one = angles[k : k + 1, ..., known[k]]
            rows[k] = _laid(one, time[known[k]], counts[[k]], end[[k]], share)[0]
        rows = rows[counts >= 2]
        rows -= rows.mean(axis=(1, 2), keepdims=True)
        yield rows.astype("f4"), block["sample"].to_numpy()[counts >= 2]


def _laid(angles: Array, time: Array, counts: NDArray[np.int64], end: Array, share: Array) -> Array:
    """Angles at shares of runs with so many records each, (sample, plane, section, share)."""
    at = np.clip(share * end[:, None], time[0], time[counts - 1][:, None])
    after = np.clip(np.searchsorted(time, at), 1, (counts - 1)[:, None])
    weight = ((at - time[after - 1]) / (time[after] - time[after - 1]))[:, None, None]
    after = after[:, None, None]
    first = np.take_along_axis(angles, after - 1, axis=-1)
    return np.asarray(first + weight * (np.take_along_axis(angles, after, axis=-1) - first))
