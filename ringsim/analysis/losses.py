"""Lost runs that bend what the others tell: which lines they bend, and the mark on these.

Runs that are lost where inputs have certain values leave another population behind: its mean,
quantiles and shares are not those of the antenna, and their intervals tell nothing of that.
"""

from dataclasses import dataclass

import numpy as np
import xarray as xr

from ringsim.analysis.blocks import blocks_of
from ringsim.analysis.dependence import LEVEL, dependence
from ringsim.analysis.drawn import drawn
from ringsim.analysis.quantities import lost, ran
from ringsim.analysis.tails import subset_simulation
from ringsim.tables import Table

MARK = " *"
"""Stands behind what lost runs bend."""
NOTE = "lost_runs"
"""Attribute that says why, of an analysis and of each of its variables that is bent."""
LOST = "lost"
"""How names of groups and outcomes begin that are those of lost runs: all that ran tell them."""


@dataclass(frozen=True)
class Losses:
    """The lost runs of a campaign, and whether they go with inputs."""

    count: int
    ran: int
    chance: float
    """Probability that runs lost at random go with inputs as much; NaN if none is lost."""

    @property
    def note(self) -> str:
        """Why statistics are bent, in words; empty if they are not, as far as one can tell."""
        if not self.chance < LEVEL:
            return ""
        p = f"p = {self.chance:.2g}" if round(self.chance, 4) else "p < 0.0001"
        return (
            f"{self.count} of {self.ran} runs are lost, and which ones goes with inputs ({p}): "
            f"what is marked{MARK} tells of the other {self.ran - self.count} alone, another "
            "population, and may be far off (run the lost ones again: ringsim campaign "
            "--retry-failed, or narrow the inputs)"
        )

    @property
    def mark(self) -> str:
        """What stands behind a line that they bend; empty if they do not."""
        return MARK if self.note else ""


def losses(campaign: xr.Dataset) -> Losses:
    """The lost runs of a merged campaign; subset simulation takes them as no event, and says so."""
    run, gone = ran(campaign), lost(campaign)
    count, chance = int(gone.sum()), np.nan
    if count and subset_simulation(campaign) is None:
        blocks, block = blocks_of(campaign), None
        if blocks is not None:
            block = np.unique(np.arange(len(run))[run] // blocks.size, return_inverse=True)[1]
        chance = dependence(gone[run], drawn(campaign).values[run], block)
    return Losses(count, int(run.sum()), chance)


def marked(table: Table, analysis: xr.Dataset, column: int = 0) -> Table:
    """A table with the mark in one column of each row, but of those about lost runs, if an analysis
    says that its statistics are bent.
    """
    if not analysis.attrs.get(NOTE):
        return table
    rows, own = [], False
    for row in table.rows:
        own = row[0].startswith(LOST) if row[0] else own  # a blank repeats the one above
        mark = "" if own else MARK
        rows.append((*row[:column], f"{row[column]}{mark}", *row[column + 1 :]))
    return table._replace(rows=rows)
