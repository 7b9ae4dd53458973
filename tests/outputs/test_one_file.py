"""A new output is one file: files, campaigns, summaries and ``explain`` know it from there."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

from ringsim.cli import cli
from ringsim.dataset import to_dataset
from ringsim.outputs import OUTPUTS, VARIABLES, Output
from ringsim.scene import load_scene
from ringsim.simulation import simulate
from ringsim.variables import Cause, Fate, Outcome, Status, Variable

SHORT = {"structure.opening_angle": 160.0, "solver.end_time": 2.0}
SCENE = load_scene("truss2").with_values(SHORT)
CAMPAIGN = """
name = "two"
scene = "truss2"
design = { kind = "random", samples = 2 }

[set]
"structure.opening_angle" = 160.0
"solver.end_time" = 0.5

[inputs]
"cables.upper.winch.winding.speed" = { kind = "uniform", low = 0.009, high = 0.011 }
"""


@pytest.fixture
def opening_rate(monkeypatch):
    """The module with the output, which nothing knows any more after the test."""
    before, shipped = list(OUTPUTS), dict(VARIABLES)
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import opening_rate

    yield opening_rate
    OUTPUTS[:] = before
    VARIABLES.clear()
    VARIABLES.update(shipped)
    del sys.modules["opening_rate"]


@pytest.mark.parametrize(("fidelity", "end", "gained"), [("frame", 2.0, 5.0), ("full", 0.3, 0.3)])
def test_a_run_has_it(opening_rate, fidelity, end, gained) -> None:
    short = {"record.interval": 0.01, "solver.end_time": end, "solver.tolerance": 1e-3}
    found = simulate(SCENE.with_values(short), fidelity)
    assert found.opening_rate.dims == ("time",)
    assert found.opening_rate.attrs["units"] == "degree s-1"
    # Integrated it gives back the mean opening angle; what the trapezoids err by is the first one,
    # in which the winch starts: half an interval at its 3.1 deg/s.
    angle = found.opening_angle.mean(("plane", "section")).dropna("time")
    rate = found.opening_rate.dropna("time")
    passed = np.append(0.0, np.cumsum(0.5 * np.diff(rate.time) * (rate.values[1:] + rate[:-1])))
    moving = slice(0, int((angle < 179.0).sum()))
    assert angle.values[moving] - angle.values[0] == pytest.approx(passed[moving], abs=0.03)
    assert found.opening_rate_max >= rate.max()
    assert angle.values[moving][-1] - angle.values[0] > gained


def test_a_run_that_failed_has_it_as_missing(opening_rate) -> None:
    found = to_dataset(Outcome(Status.CRASHED, "it died"), SCENE)
    assert np.isnan(found.opening_rate_max)
    assert "opening_rate" not in found


def test_the_summary_of_a_run_states_it(opening_rate, tmp_path) -> None:
    settings = [f"--set={path}={value}" for path, value in SHORT.items()]
    out = str(tmp_path / "run.nc")
    printed = CliRunner().invoke(
        cli, ["run", "truss2", "--fidelity=frame", "--out", out, *settings]
    )
    with xr.open_dataset(out) as found:
        line = f"  largest opening rate{float(found.opening_rate_max):10.4f} deg s-1"
    assert line in printed.output.splitlines()


def test_a_campaign_has_it(opening_rate, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("two.toml").write_text(CAMPAIGN, encoding="utf-8")
    options = ["--workers=1", "--out=out", "--solver=opening_rate:run_frame"]
    printed = CliRunner().invoke(cli, ["campaign", "two.toml", *options])
    assert printed.exit_code == 0, printed.output
    with xr.open_dataset("out/campaign.nc") as found:
        assert found.opening_rate.dims == ("sample", "time")
        assert found.opening_rate.attrs["long_name"] == "mean rate of all opening angles"
        assert found.opening_rate_max.dims == ("sample",)
        assert (found.opening_rate_max > 0.0).all()
        assert found.cause.dtype == np.int8
        assert found.cause.values.tolist() == [Cause.NONE, Cause.NONE]
        words = found.cause.attrs["flag_meanings"].split()
        assert words[:3] == ["unknown", "none", "blow_up"]
        assert found.outcome.values.tolist() == [Fate.CUT_OFF, Fate.CUT_OFF]
        assert found.cause.attrs["flag_values"].tolist() == [-1, *Cause]


def test_explain_tells_it(opening_rate) -> None:
    printed = CliRunner().invoke(cli, ["explain"]).output
    assert "opening_rate(time)" in printed
    assert "largest mean rate of all opening angles" in printed


def test_two_outputs_of_one_name_are_refused() -> None:
    before = list(OUTPUTS), dict(VARIABLES)
    with pytest.raises(ValueError, match="asynchrony already: rename it"):

        class Again(Output):
            variables = (Variable("asynchrony", (), "1", "another"),)

    assert (list(OUTPUTS), dict(VARIABLES)) == before
