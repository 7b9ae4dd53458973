"""The blocks of runs that designs for Sobol' indices and for screening are made of."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ringsim.sampling.columns import BLOCK_ROW


@dataclass(frozen=True)
class Blocks:
    """What every sample is within its block."""

    rows: NDArray[np.str_]
    """Shape (blocks, size): "A", "AB: GROUP", "B"; of trajectories "start", "up: GROUP", ..."""

    @property
    def size(self) -> int:
        """Samples of a block."""
        return int(self.rows.shape[1])

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the groups that move, in the order of the first block."""
        names = (row.partition(": ")[2] for row in self.rows[0].tolist())
        return tuple(dict.fromkeys(name for name in names if name))

    @property
    def of_indices(self) -> bool:
        """Whether they are for Sobol' indices; else they are trajectories."""
        return bool(self.rows[0, 0] == "A")


def blocks_of(campaign: xr.Dataset) -> Blocks | None:
    """The blocks of a whole campaign; None if it has none, or is a selection of its samples."""
    if BLOCK_ROW not in campaign or not campaign.sizes["sample"]:
        return None
    rows = campaign[BLOCK_ROW].to_numpy().astype(str)
    whole = np.array_equal(campaign["sample"].to_numpy(), np.arange(len(rows)))
    starts = np.flatnonzero(rows == rows[0])
    size = int(starts[1]) if len(starts) > 1 else len(rows)
    if not whole or len(rows) % size or (starts != np.arange(0, len(rows), size)).any():
        return None
    return Blocks(rows.reshape(-1, size))


def population_of(campaign: xr.Dataset) -> xr.Dataset:
    """The samples that stand for the population: of blocks for Sobol' indices those of A and B.

    The other runs of a block repeat most of their values; in statistics they would count as if they
    were more antennas.
    """
    blocks = blocks_of(campaign)
    if blocks is None or not blocks.of_indices:
        return campaign
    return campaign.isel(sample=np.flatnonzero(np.isin(blocks.rows.ravel(), ["A", "B"])))
