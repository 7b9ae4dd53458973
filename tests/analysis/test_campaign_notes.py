"""What merged campaigns of older runs are told."""

from __future__ import annotations

import xarray as xr

from ringsim.analysis.campaign_notes import latch_lines
from ringsim.variables import Fate


def campaign(outcomes: list[Fate], latched: list[int]) -> xr.Dataset:
    values = {"outcome": [int(one) for one in outcomes], "latched_joints": latched}
    values["locked_joints"] = [6] * len(latched)
    return xr.Dataset({name: ("sample", value) for name, value in values.items()})


def test_deployed_samples_whose_latches_have_not_caught_are_named() -> None:
    [line] = latch_lines(campaign([Fate.DEPLOYED] * 3 + [Fate.NOT_LATCHED], [6, 4, 0, 4]))
    assert line.startswith("2 deployed samples (1, 2) have latches that did not catch")


def test_those_that_are_told_as_they_are_need_no_note() -> None:
    assert latch_lines(campaign([Fate.DEPLOYED, Fate.NOT_LATCHED], [6, 4])) == []
    assert latch_lines(campaign([Fate.DEPLOYED], [0]).drop_vars("latched_joints")) == []
