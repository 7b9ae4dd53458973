"""Courses of all samples on one axis: the share of each run that has passed."""

import numpy as np
import xarray as xr

from ringsim.analysis.campaign_samples import used
from ringsim.outputs.family import Array

MOST = 401
"""Points along the axis at most: more than a figure resolves."""


def ends(campaign: xr.Dataset) -> Array:
    """When each run was over: its last lock, or its end if there was none; s, (sample,)."""
    final, time = campaign["final_time"].to_numpy(), campaign["time"].to_numpy()
    deployed = campaign["deployment_time"].to_numpy()
    found = np.where(np.isfinite(deployed), deployed, final)
    return np.asarray(np.where(np.isfinite(found), found, time[-1]), dtype=float)


def courses(campaign: xr.Dataset) -> xr.DataArray:
    """Deviation of each opening angle from the mean of all, (sample, plane, section, share).

    Of the samples whose numbers hold and that were recorded; linear between records, which is
    what the file knows.  Runs last differently long, so that at one time some would have ended,
    and what a fan shows there would be the slow ones alone.
    """
    good = used(campaign)
    time = good["time"].to_numpy()
    share = np.linspace(0.0, 1.0, int(np.clip(len(time), 2, MOST)))
    rows, kept = [], []
    angles = good["opening_angle"].transpose("sample", "plane", "section", "time")
    for number, end in enumerate(ends(good)):
        angle = angles.isel(sample=number).to_numpy()
        known = np.flatnonzero(np.isfinite(angle).all(axis=(0, 1)))
        if len(known) < 2:
            continue
        at = np.clip(share * end, time[known[0]], time[known[-1]])
        after = np.clip(np.searchsorted(time[known], at), 1, len(known) - 1)
        before, behind = known[after - 1], known[after]
        weight = (at - time[before]) / (time[behind] - time[before])
        course = (1.0 - weight) * angle[..., before] + weight * angle[..., behind]
        rows.append((course - course.mean(axis=(0, 1))).astype("f4"))
        kept.append(number)
    shape = (0, good.sizes["plane"], good.sizes["section"], len(share))
    return xr.DataArray(
        np.stack(rows) if rows else np.empty(shape, "f4"),
        dims=("sample", "plane", "section", "share"),
        coords={
            "sample": good["sample"].to_numpy()[kept], "plane": good["plane"],
            "section": good["section"],
            "share": ("share", share, {"long_name": "share of the run until its last lock or end"}),
        },
        attrs={
            "units": good["opening_angle"].attrs.get("units", "1"),
            "long_name": "deviation from the mean opening angle",
        },
    )  # fmt: skip
