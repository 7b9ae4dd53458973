"""The numbers of a result that statistics are about, and the samples whose numbers hold."""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.outputs import COORDINATES, OUTPUTS
from ringsim.outputs.family import Array
from ringsim.variables import GOALS, Status, Variable

Mask = NDArray[np.bool_]
"""One truth for each sample."""
CHECKED = "_checked"
"""How names of the full engine's answers end in the file of a campaign."""


def quantities() -> dict[str, Variable]:
    """All numbers without dimensions that tell of the antenna, and are no places."""
    places = COORDINATES.keys() - {"time"}
    return {
        each.name: each
        for output in OUTPUTS if output.of_antenna
        for each in output.variables
        if not each.dims and each.flags is None and each.dtype != "str"
        and each.name.rpartition("_")[2] not in places
    }  # fmt: skip


def numbers(campaign: xr.Dataset, name: str) -> Array:
    """A variable over samples as floats, NaN where it is missing, or the variable itself is."""
    if name not in campaign:
        return np.full(campaign.sizes["sample"], np.nan)
    values = campaign[name].to_numpy().astype(float)
    known = quantities().get(name.removesuffix(CHECKED))
    # Missing counts are negative.
    counts = known is not None and known.dtype.startswith("i")
    return np.where(values < 0, np.nan, values) if counts else values


def good(campaign: xr.Dataset) -> Mask:
    """Which samples have numbers that hold."""
    return np.asarray(campaign["status"].to_numpy() == Status.OK)


def tells_of(campaign: xr.Dataset, name: str) -> Mask:
    """Which samples tell of a variable: they have a value of it, or ended before what it is about
    happened.  The others reached their goal with a model that does not compute it.
    """
    done = np.zeros(campaign.sizes["sample"], dtype=bool)
    if "outcome" in campaign:
        done = np.isin(campaign["outcome"].to_numpy(), GOALS)
    return np.asarray(good(campaign) & ~(done & np.isnan(numbers(campaign, name))))


def lost(campaign: xr.Dataset) -> Mask:
    """Which samples have run and given no numbers that hold."""
    return np.asarray(campaign["status"].to_numpy() >= Status.SOLVER_FAILED)


def ran(campaign: xr.Dataset) -> Mask:
    """Which samples have run; the others are neither lost nor without a value."""
    return np.asarray(campaign["status"].to_numpy() >= Status.OK)


def used(campaign: xr.Dataset) -> xr.Dataset:
    """The samples whose numbers hold; the others are told, and never counted."""
    return campaign.isel(sample=np.flatnonzero(good(campaign)))


def worst_sample(campaign: xr.Dataset, variable: Variable) -> int:
    """The sample whose numbers hold with the worst value; -1 without a value, or where neither end
    is the worse one.  Of equal ones the first.
    """
    values = variable.badness * numbers(campaign, variable.name)
    known = good(campaign) & np.isfinite(values)
    if not variable.badness or not known.any():
        return -1
    return int(campaign["sample"].to_numpy()[np.argmax(np.where(known, values, -np.inf))])
