"""Campaigns of motors that can stall: runs with margins hold, and are judged and reported."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from made_campaign import made_campaign, with_motors

from motor_rings import ring
from ringsim.analysis.requirements import read_requirements
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import statistics_table, told
from ringsim.execution.work import solve
from ringsim.plots import figures
from ringsim.refusal import InputError
from ringsim.report.page import page
from ringsim.rigid.margin import MOST, DriveMargin, with_margin
from ringsim.tables import slim
from ringsim.variables import PLANES, Fate, Outcome, Status

REQUIRED = {
    "least_drive_margin": {"min": 0.05, "probability": 0.5, "confidence": 0.9},
    "outcome": {"is": "deployed", "probability": 0.9, "confidence": 0.9},
}


def course(last_lock: float) -> Outcome:
    """Of six sections that open at an even rate until 1.0 s; the run is told until 1.45 s."""
    times = np.linspace(0.0, 2.0, 11)
    angles = np.broadcast_to(np.minimum(60.0 + 120.0 * times, 180.0), (2, 6, 11)).copy()
    angles[..., times > 1.45] = np.nan
    values = {
        "opening_angle": angles, "deployment_time": np.array(last_lock),
        "final_time": np.array(1.45), "outcome": np.array(int(Fate.DEPLOYED)),
        "energy_error": np.array(0.0), "constraint_error": np.array(0.0),
        "asynchrony_max": np.array(0.0),
    }  # fmt: skip
    places = {"plane": np.array(PLANES), "section": np.arange(1, 7)}
    return Outcome(Status.OK, "made", {"time": times, **places}, values)


@pytest.mark.parametrize(("last_lock", "until"), [(1.0, 1.0), (np.nan, 1.45)])
def test_a_run_holds_whose_margin_ends_with_its_last_lock(last_lock: float, until: float) -> None:
    scene = ring(joints__vjoint={"coulomb": 0.05}, margin={"kind": "ecss-e-st-33-01c"})
    found = with_margin(course(last_lock), scene)
    times = found.coordinates["time"]
    assert np.isfinite(found.values["drive_margin"]).tolist() == (times <= until + 1e-9).tolist()
    assert solve(lambda _: found, scene, 0, {}).status == Status.OK
    found.values["drive_margin"][2] = np.nan
    lost = solve(lambda _: found, scene, 0, {})
    assert (lost.status, lost.reason[:28]) == (Status.DIVERGED, "drive_margin is not a number")


def test_a_run_holds_while_nothing_resists(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = ring(joints__vjoint="none", margin={"kind": "ecss-e-st-33-01c"})
    at = DriveMargin.at
    monkeypatch.setattr(DriveMargin, "at", lambda *a: at(*a)._replace(margin=np.inf))
    found = with_margin(course(1.0), scene)
    assert found.values["least_drive_margin"] == MOST
    assert solve(lambda _: found, scene, 0, {}).status == Status.OK


@pytest.fixture(scope="module")
def campaign() -> xr.Dataset:
    made = with_motors(made_campaign(8, stalled=(4, 6), failed=(2,)))
    made.attrs["requirements"] = json.dumps(REQUIRED)
    made.attrs["design"] = '{"kind": "random", "samples": 8}'
    return made


def test_margin_and_outcome_are_judged(campaign: xr.Dataset) -> None:
    found = analyse(campaign)
    assert found["requirement"].values.tolist() == [*REQUIRED]
    # Margins of -0.5, -0.4, (lost), -0.2, ... 0.2: all but the last two fall short.
    assert found["samples_violating"].values.tolist() == [5, 2]
    assert found["least_drive_margin"].sel(statistic="minimum").item() == pytest.approx(-0.5)
    text = "\n".join(told(found))
    assert "least_drive_margin >= 0.05" in text
    stalled = dict(zip(found["kind"].values.tolist(), found["outcome_samples"].values, strict=True))
    assert stalled["stalled"] == 2


def test_a_requirement_on_the_course_of_the_margin_names_its_smallest() -> None:
    wanted = {"drive_margin": {"min": 0.0, "probability": 0.9, "confidence": 0.9}}
    with pytest.raises(InputError, match="use its least, least_drive_margin"):
        read_requirements(wanted, "requirements")


def test_the_report_shows_them(campaign: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("margin", "motors", "base")
    monkeypatch.setattr(figures, "PICTURES", [p for p in figures.PICTURES if p.name in names])
    text = page(campaign, "runs/made", analyse(campaign))
    for name in names:
        assert f'id="figure-{name}"' in text
    assert "<dd>smallest static margin of the drive at any angle that the run passed</dd>" in text
    assert '<th scope="col">mean</th>' in text


def test_a_grid_has_extremes_and_no_means(campaign: xr.Dataset) -> None:
    listed = campaign.assign_attrs(design='{"kind": "grid"}')
    for kind, made in (("random", campaign), ("grid", listed)):
        table = slim(statistics_table(analyse(made)))
        heads, rows = table.head, table.rows
        assert ("std. dev." in heads) == (kind == "random")
        assert {len(row) for row in rows} == {len(heads)}
        (convergence,) = (each for each in figures.PICTURES if each.name == "convergence")
        assert convergence.applies(made) == (kind == "random")
