"""What has not run yet is neither lost nor without a value: it is as if it were not planned."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr
from made_campaign import made_campaign, with_motors

from made import drawn_campaign, ishigami
from ringsim.analysis.campaign_notes import notes
from ringsim.analysis.engines import check_lines
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told, verdict_lines
from ringsim.outputs.family import VARIABLES
from ringsim.plots import figures as of_campaigns
from ringsim.plots.campaign.tornado import bars_of
from ringsim.refusal import InputError
from ringsim.report.page import page
from ringsim.sampling.designs.blocks import Morris, Saltelli
from ringsim.sampling.designs.independent import RandomDesign, Sobol
from ringsim.storage.netcdf import PER_SAMPLE
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


def with_everything():
    """A small campaign with motors, checks by the other engine, and who leads and lags."""
    made = with_motors(made_campaign(6, failed=(1,), stalled=(4,), not_run=(5,)))
    held = made["status"].values == 0
    for who, section in (("leader", 4), ("laggard", 1)):
        made[f"asynchrony_{who}_plane"] = "sample", np.where(held, "upper", "").astype(object)
        made[f"asynchrony_{who}_section"] = "sample", np.where(held, section, -1)
    made["asynchrony_max_time"] = "sample", np.where(held, 5.0, np.nan)
    for name in ("locked_joints", "latched_joints"):
        made[name] = "sample", np.where(held, 8, -1).astype("i4")
    for name in ("status", "outcome", "reason", "deployment_time", "asynchrony_max"):
        made[f"{name}_checked"] = made[name]
    made.attrs |= {"check_every": 1, "requirements": "{}"}
    return made


_LEFT_OUT = [
    str(name) for name, each in with_everything().data_vars.items()
    if name in VARIABLES and name not in PER_SAMPLE and each.attrs.get("role") is None
]  # fmt: skip


@pytest.mark.parametrize("name", _LEFT_OUT)
def test_a_file_may_leave_out_any_of_its_variables(name, monkeypatch):
    """What merging, analyse, report and Python tell of the others is the same."""
    whole = with_everything()
    less = whole.drop_vars([name, f"{name}_checked"], errors="ignore")
    told_of = [*notes(less), *verdict_lines(less), *check_lines(less)]
    assert told_of[-1]
    assert ("deployed: 3 of 5" in told_of) == (name != "outcome")
    analysis = analyse(less)
    if name != "peak_tension":
        assert analysis["peak_tension"].sel(statistic="mean") == np.mean([20.0, 22.0, 23.0, 24.0])
    monkeypatch.setattr(of_campaigns, "PICTURES", [])
    assert "runs/made" in page(less, "runs/made", analysis)
    for ask in ("tables", "worst", "outcomes"):
        assert len(getattr(less.ring, ask)())
    for ask in {"fan", "leader"} - _NEEDED.get(name, set()):
        xr.testing.assert_equal(getattr(less.ring, ask)(), getattr(whole.ring, ask)())
    for ask in _NEEDED.get(name, ()):
        with pytest.raises(InputError, match=name):
            getattr(less.ring, ask)()


_NEEDED = {f"asynchrony_{who}_{dim}": {"leader"}
           for who in ("leader", "laggard") for dim in ("plane", "section")}  # fmt: skip
_NEEDED |= {"opening_angle": {"fan"}}


def test_indices_and_their_figure_leave_out_blocks_that_have_not_run():
    whole = drawn_campaign(Saltelli(samples=64), ishigami, 3, 2)
    whole["asynchrony_max"].attrs |= {"long_name": "asynchrony", "units": "degree"}
    run = whole["sample"] < 5 * 40 + 2  # of the last block two samples
    found = analyse(unfinished(whole, run)).sel(output="asynchrony_max")
    assert (found.index_used, found.index_lost, found.missing) == (40, 0, 0)
    (bars,) = (bars for name, bars in bars_of(unfinished(whole, run)) if name == "asynchrony_max")
    assert bars.told == "blocks: 40 used, 0 left out"
