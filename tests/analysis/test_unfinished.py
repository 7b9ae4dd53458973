"""What has not run yet is neither lost nor without a value: it is as if it were not planned."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr

from made import drawn_campaign, ishigami
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told
from ringsim.plots.campaign.tornado import bars_of
from ringsim.sampling.designs.blocks import Morris, Saltelli
from ringsim.sampling.designs.independent import RandomDesign, Sobol
from ringsim.variables import Fate

pytestmark = pytest.mark.quick

NOT_RUN = -1


def lost(x):
    """Some, whatever their inputs are."""
    return np.random.default_rng(1).random(len(x)) < 0.05


def unfinished(whole, has_run):
    """The same with only some samples run."""
    found = whole.copy(deep=True)
    found["status"] = found["status"].where(has_run, NOT_RUN).astype("i1")
    found["outcome"] = found["outcome"].where(has_run, Fate.NONE).astype("i1")
    found["asynchrony_max"] = found["asynchrony_max"].where(has_run)
    return found


@pytest.mark.parametrize(
    ("design", "block"),
    [
        (RandomDesign(samples=400), 1), (Sobol(samples=512, replicates=8), 1),
        (Saltelli(samples=64), 5), (Morris(samples=60), 4),
    ],
)  # fmt: skip
def test_a_campaign_that_runs_tells_what_one_of_its_first_samples_does(design, block):
    whole = drawn_campaign(design, ishigami, 3, 2, lost=lost)
    first = 40 * block if block > 1 else 160
    found = analyse(unfinished(whole, whole["sample"] < first))
    alone = analyse(whole.isel(sample=slice(first)))
    assert found.attrs["samples_run"] == first
    used, gone, absent, rest = found.asynchrony_max_samples.values
    assert used + gone + absent + rest > used + gone + absent
    differ = [
        name for name in alone.data_vars
        if name != "asynchrony_max_samples" and not alone[name].equals(found[name])
    ]  # fmt: skip
    assert differ == []
    assert f"of which {first} have run" in told(found)[0]
    assert "have run" not in told(alone)[0]


def test_parts_are_of_what_has_run_in_any_order():
    whole = drawn_campaign(RandomDesign(samples=400), ishigami, 3, 2)
    run = xr.DataArray(np.random.default_rng(3).random(400) < 0.3, dims="sample")
    found = analyse(unfinished(whole, run))
    values = whole.asynchrony_max.values[run.values]
    half = round(0.5 * len(values))
    first = found.asynchrony_max_convergence.sel(statistic="mean")
    assert first.sel(part=0.5) == pytest.approx(values[:half].mean(), rel=1e-12)
    assert len(np.unique(first)) == 4
    line = next(line for line in told(found) if re.match(r"asynchrony_max +(deg )? +-?\d", line))
    assert line.split()[-1] == str(len(values))


def test_indices_and_their_figure_leave_out_blocks_that_have_not_run():
    whole = drawn_campaign(Saltelli(samples=64), ishigami, 3, 2)
    whole["asynchrony_max"].attrs |= {"long_name": "asynchrony", "units": "degree"}
    run = whole["sample"] < 5 * 40 + 2  # of the last block two samples
    found = analyse(unfinished(whole, run)).sel(output="asynchrony_max")
    assert (found.index_used, found.index_lost, found.missing) == (40, 0, 0)
    (bars,) = (bars for name, bars in bars_of(unfinished(whole, run)) if name == "asynchrony_max")
    assert bars.told == "blocks: 40 used, 0 left out"
