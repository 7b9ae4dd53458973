"""Pictures of the documentation: what some are drawn from, and where they stand."""

from __future__ import annotations

import re

import numpy as np
import pytest
import xarray as xr

from pages import ROOT
from ringsim.rigid.margin import DriveMargin
from ringsim.scene import load_scene


def test_no_sample_is_left_out_above_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    from study_pictures import exceeded

    values = np.random.default_rng(2).exponential(1.0, 40).round(1)
    places, above = exceeded(values, 9.0)
    assert places.tolist() == [*sorted(values.tolist()), 9.0]
    for limit in np.linspace(values.min(), 9.0, 300):
        # A step as figures draw it: the count holds from its place to the next.
        drawn = above[np.searchsorted(places, limit, side="right") - 1]
        assert drawn == sum(value > limit for value in values.tolist())
    assert above[-3:].tolist() == [1, 0, 0]


def test_margins_of_many_rings_are_those_of_each(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a few rings whose friction and torque lie between, against the margin of every one."""
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    from study_pictures import PLAIN, static_margins

    scene, rng = load_scene("ring18-motor"), np.random.default_rng(3)
    paths = {
        "cables.upper.friction.coefficient": (4e-4, 1e-3), "joints.vjoint.coulomb": (0.01, 0.025),
        "cables.upper.winch.winding.derating": (0.6, 1.0),
        "cables.lower.winch.winding.derating": (0.6, 1.0),
    }  # fmt: skip
    drawn = {path: rng.uniform(*ends, 6) for path, ends in paths.items()}
    names = {path.replace(".", "_"): ("sample", values) for path, values in drawn.items()}
    found = static_margins(xr.Dataset(names, attrs={"scene": scene.to_toml()}))
    for k, margin in enumerate(found.tolist()):
        values = {path: float(each[k]) for path, each in drawn.items()}
        lower = {"cables.lower.friction.coefficient": values["cables.upper.friction.coefficient"]}
        drive = DriveMargin(scene.with_values(values | lower), PLAIN)
        assert margin == pytest.approx(drive.at(drive.start).margin, abs=1e-4)


def test_examples_stand_beside_pictures_that_exist(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    from made_pages import gallery

    shown = re.findall(r"^## `(\w+)`|^!\[.+\]\((\S+)\)$", gallery(), re.MULTILINE)
    names = [picture for _, picture in shown if picture]
    assert len(names) == 3
    assert all((ROOT / "docs" / name).is_file() for name in names)
    before = [shown[k - 1][0] for k, (_, picture) in enumerate(shown) if picture]
    assert before == ["analysis", "campaign", "first_run"]
