"""Campaigns that the program writes itself: gone on with, and refused without a trace."""

from __future__ import annotations

from pathlib import Path

import netCDF4
import pytest

from campaign_bench import HERE, opened
from ringsim.campaign.run import run_cases
from ringsim.campaign.specification import SOLVERS
from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.variables import Status

SCENE = load_scene("ring18").with_values({"structure.sections": 6, "boom": "none"})
CASES = [{"rods.damping": 0.0}, {"rods.damping": 1.5}]
"""Seconds that the stand-in for the solver takes."""


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    monkeypatch.setitem(SOLVERS, "full", "fake_solver:slow")

    def run(scene=SCENE, cases=CASES, **choices):
        return run_cases(tmp_path, "cases", scene, cases, workers=2, **choices)

    return run


def ends(file):
    return opened(file).status.values.tolist()


def test_only_what_ran_out_of_time_is_tried_again(run):
    assert ends(run(timeout=0.5)) == [Status.OK, Status.TIMEOUT]
    assert ends(run(timeout=60.0)) == [Status.OK, Status.TIMEOUT]
    assert ends(run(timeout=60.0, again=frozenset({Status.TIMEOUT}))) == [Status.OK, Status.OK]


def texts(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_what_is_refused_replaces_no_file(run, tmp_path):
    cases = [{"rods.damping": 0.0}]
    run(cases=cases)
    before = texts(tmp_path)
    assert {"cases.toml", "cases.csv", "cases-scene.toml"} == before.keys()
    with pytest.raises(InputError, match="its scene differs"):
        run(SCENE.with_values({"loads.force": 0.03}), cases)
    with pytest.raises(InputError, match="its inputs differs"):
        run(cases=[{"loads.force": 0.01}])
    with pytest.raises(InputError, match=r"rods\.damping"):
        run(cases=[{"rods.damping": -1.0}])
    assert texts(tmp_path) == before


def test_results_of_another_engine_are_not_mixed(run, tmp_path):
    cases = [{"rods.damping": 0.0}]
    run(cases=cases)
    with netCDF4.Dataset(Path(tmp_path) / "cases" / "design.nc", "a") as design:
        design.exudyn_version = "0.1"
    with pytest.raises(InputError, match="the version of exudyn differs"):
        run(cases=cases)
