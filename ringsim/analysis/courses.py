"""Courses of all samples over time, and their quantiles.

Angles of all samples are never in memory together: blocks of samples are read for a part of the
time at a time, over which the quantiles of all samples are then exact.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.analysis.intervals import Mask, good, numbers
from ringsim.outputs.family import Array
from ringsim.variables import Fate

QUANTILES = (0.0, 0.05, 0.5, 0.95, 1.0)
"""What bands show: all samples, nine in ten, the median."""
MOST, FEWER = 401, 101
"""Records that are shown at most: more than a figure resolves; fewer where samples are many."""
HELD_BYTES = 200 << 20
"""Angles that are held at once."""
_ANGLE = "opening_angle"
_TIMES = ("deployment_time", "final_time")
_PASSES = 4
"""Times that the file is read for MOST records, at most."""
Numbers = NDArray[np.float32]
Places = NDArray[np.int64]


# Reading the series of many samples block by block, so that memory does not grow with them.


BLOCK_BYTES = 8 << 20
"""Numbers of one variable that are read at once, about."""


def blocks(campaign: xr.Dataset, names: Sequence[str]) -> Iterator[xr.Dataset]:
    """Some variables over ``sample``, in memory, a block of successive samples at a time.

    Slices of samples are what the file is compressed in; any other selection reads it many times.
    """
    count = campaign.sizes["sample"]
    widest = max(campaign[name].nbytes for name in names) // max(count, 1)
    size = max(1, BLOCK_BYTES // max(widest, 1))
    for start in range(0, count, size):
        yield campaign[list(names)].isel(sample=slice(start, start + size)).load()


def any_finite(campaign: xr.Dataset, name: str) -> bool:
    """Whether a variable has a number in a sample whose numbers hold."""
    first = np.flatnonzero(good(campaign))[:1]  # nearly always tells it, without a block
    return bool(np.isfinite(campaign[name].isel(sample=first).to_numpy()).any()) or any(
        bool(np.isfinite(block[name].to_numpy()[good(block)]).any())
        for block in blocks(campaign, [name, "status"])
    )


def largest(campaign: xr.Dataset, peak: str, series: str) -> Array:
    """Largest values of a series at any time of the runs, at least those of its ``peak``, shape
    (samples,); NaN without one.
    """
    found = numbers(campaign, peak)
    if series not in campaign:
        return found
    rows = list[Array]()
    for block in blocks(campaign, [series]):
        values = block[series].transpose("sample", ...).to_numpy()
        rows.append(np.fmax.reduce(values.reshape(len(values), -1), axis=1, initial=np.nan))
    return np.asarray(np.fmax(found, np.concatenate(rows)), dtype=float)


# Quantiles over samples, and how they are read for a part of the time at a time.


@dataclass(frozen=True)
class Courses:
    """Quantiles over the samples of each section's deviation from the mean opening angle.

    They are of one time each: where samples are late in turn, each for a while, their median is
    nearly zero, which no sample has.
    """

    bands: xr.DataArray
    """Shape (quantile, plane, section, time), degree."""
    samples: Places
    """Samples whose numbers hold and that were recorded."""


def deployed(campaign: xr.Dataset) -> Mask:
    """Which rings came to 180 deg and stay there, as no latch missed its catch, (sample,)."""
    open_once = np.asarray(np.isfinite(numbers(campaign, "deployment_time")))
    if "deployment_time" not in campaign:  # the file leaves it out
        open_once = np.asarray(numbers(campaign, "outcome") == int(Fate.DEPLOYED))
    missed = np.zeros(len(open_once), dtype=bool)
    if "outcome" in campaign:
        missed |= campaign["outcome"].to_numpy() == int(Fate.NOT_LATCHED)
    if {"latched_joints", "locked_joints"} <= set(campaign.data_vars):
        # A ring may be told as overloaded, because its motors pulled on.
        missed |= (campaign["latched_joints"] < campaign["locked_joints"]).to_numpy()
    return np.asarray(open_once & ~missed)


def names_of_ends(campaign: xr.Dataset) -> list[str]:
    """What ``ends`` reads of a campaign."""
    return [
        name for name in ("outcome", "latched_joints", "locked_joints", *_TIMES) if name in campaign
    ]


def ends(campaign: xr.Dataset) -> Array:
    """When each run was over: its last lock where the ring stays open, or its end; s, (sample,)."""
    opened, final = (numbers(campaign, name) for name in _TIMES)
    time = campaign["time"].to_numpy()
    found = np.where(deployed(campaign) & np.isfinite(opened), opened, final)
    return np.asarray(np.where(np.isfinite(found), found, time[-1]), dtype=float)


def courses(campaign: xr.Dataset, quantiles: Sequence[float] = QUANTILES) -> Courses:
    """Quantiles of the deviations of a campaign that is in memory, or opened.

    Of the samples whose numbers hold and that were recorded, until the last of them is over;
    between records linear.  A run that is over counts on, so that what is told of late times is not
    of the slow ones alone: deployed rings have no deviation, others that of their last record.
    """
    places = campaign.sizes["plane"] * campaign.sizes["section"]
    each = 4 * places * max(1, int(good(campaign).sum()))
    most = MOST if each * MOST <= _PASSES * HELD_BYTES else FEWER
    at = np.unique(np.linspace(0, _last(campaign), most).round().astype(int))
    parts = np.array_split(at, min(len(at), -(-each * len(at) // HELD_BYTES)))
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
    return Courses(_labelled(campaign, every, at, quantile=list(quantiles)), kept)


def course(campaign: xr.Dataset, sample: int, like: xr.DataArray) -> xr.DataArray:
    """The deviations of one sample at the times of ``like``, (plane, section, time), degree."""
    at = np.searchsorted(campaign["time"].to_numpy(), like["time"].to_numpy())
    (rows, _), *_ = _rows(campaign.sel(sample=[sample]), at)
    return _labelled(campaign, rows[0], at)


def _last(campaign: xr.Dataset) -> int:
    """The first record at which all runs are over."""
    time, until = campaign["time"].to_numpy(), ends(campaign)[good(campaign)]
    return int(np.clip(np.searchsorted(time, until.max(initial=0.0)), 0, len(time) - 1))


def _labelled(campaign: xr.Dataset, values: Any, at: Places, **more: Any) -> xr.DataArray:
    time = campaign["time"].isel(time=at)
    coords = more | {"plane": campaign["plane"], "section": campaign["section"], "time": time}
    says = campaign[_ANGLE].attrs
    attrs = {"units": says.get("units", "1"), "long_name": "deviation from the mean opening angle"}
    return xr.DataArray(values, dims=list(coords), coords=coords, attrs=attrs)


def _held(campaign: xr.Dataset, at: Places) -> tuple[Numbers, Places]:
    """The deviations of all samples there, (plane, section, time, sample), and which they are."""
    wide = campaign.sizes["plane"], campaign.sizes["section"], len(at)
    held, kept = np.empty((*wide, int(good(campaign).sum())), dtype="f4"), []
    count = 0
    for rows, samples in _rows(campaign, at):
        held[..., count : count + len(rows)] = np.moveaxis(rows, 0, -1)
        count += len(rows)
        kept.append(samples)
    return held[..., :count], np.concatenate([np.empty(0, dtype=np.int64), *kept])


def _rows(campaign: xr.Dataset, at: Places) -> Iterator[tuple[Numbers, Places]]:
    """Deviations of the samples of each block at these records, (sample, plane, section, time),
    and which samples they are.
    """
    time = campaign["time"].to_numpy()
    names = [_ANGLE, "status", *names_of_ends(campaign)]
    for block in blocks(campaign, names):
        block = block.isel(sample=np.flatnonzero(good(block)))
        angles = block[_ANGLE].transpose("sample", "plane", "section", "time").to_numpy()
        known = np.isfinite(angles).all(axis=(1, 2))
        recorded = known.sum(axis=1) >= 2
        angles, known = angles[recorded], known[recorded]
        rows = _laid(angles, time, known, at)
        rows -= rows.mean(axis=(1, 2), keepdims=True)
        over = deployed(block)[recorded]
        last = known.shape[1] - 1 - known[:, ::-1].argmax(axis=1)
        # The last record may be before the last lock, when joints are still apart.
        locked = over[:, None] & (at > last[:, None])
        rows = np.where(locked[:, None, None, :], 0.0, rows)
        yield rows.astype("f4"), block["sample"].to_numpy()[recorded]


def _laid(angles: Array, time: Array, known: Mask, at: Places) -> Array:
    """Angles at some records, from the known ones (sample, time) before and after each."""
    place = np.arange(known.shape[1])
    before = np.maximum.accumulate(np.where(known, place, -1), axis=1)
    after = np.minimum.accumulate(np.where(known, place, len(place))[:, ::-1], axis=1)[:, ::-1]
    before, after = before[:, at], after[:, at]
    before, after = (
        np.where(before < 0, after, before), np.where(after == len(place), before, after),
    )  # fmt: skip
    found = np.take_along_axis(angles, before[:, None, None], axis=-1)
    rows, columns = np.nonzero(after > before)
    before, after = before[rows, columns], after[rows, columns]
    weight = (time[at[columns]] - time[before]) / (time[after] - time[before])
    first, second = angles[rows, :, :, before], angles[rows, :, :, after]
    found[rows, :, :, columns] = first + weight[:, None, None] * (second - first)
    return found
