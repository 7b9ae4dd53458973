"""Reading the series of many samples block by block, so that memory does not grow with them."""

from collections.abc import Iterator, Sequence

import numpy as np
import xarray as xr

from ringsim.analysis.quantities import good

BLOCK_BYTES = 32 << 20
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
    return any(
        bool(np.isfinite(block[name].to_numpy()[good(block)]).any())
        for block in blocks(campaign, [name, "status"])
    )
