"""A topology that ringsim does not ship is one file: the double ring of the examples."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ringsim
from ringsim.layout.layout import layout_of
from ringsim.layout.mobility import internal_mobility
from ringsim.scene import Scene, scene_from_toml
from ringsim.theory.one_coordinate import OneCoordinate, opening_time
from ringsim.variables import Fate, Status


@pytest.fixture(scope="module")
def example() -> dict[str, Any]:
    return runpy.run_path(str(Path(__file__).parents[2] / "examples" / "own_structure.py"))


def test_it_can_only_fold_and_weighs_twice_its_rods(example: dict[str, Any]) -> None:
    scene: Scene = example["scene"]
    layout = layout_of(scene)
    assert internal_mobility(layout) == 1
    single = scene.with_values(
        {"structure.kind": "pantograph-ring", "structure.inner_offset": None}
    )
    one, two = layout_of(single).masses(), layout.masses()
    for group in ("diagonals", "bars", "V-joints"):
        assert two[group] == pytest.approx(2.0 * one[group], rel=1e-12)
    for group in ("hinges", "boom"):
        assert two[group] == pytest.approx(one[group], rel=1e-12)


def test_its_run_balances_energy_and_keeps_its_joints(example: dict[str, Any]) -> None:
    run = example["run"]
    assert int(run.status) == Status.OK
    assert run.opening_angle.sizes == {"plane": 4, "section": 6, "time": run.sizes["time"]}
    assert list(run.plane.values) == ["upper", "lower", "inner upper", "inner lower"]
    # The bar of ring18 at its own tolerance: 3e-4 of deployment, 2e-3 with its impact.
    assert float(run.energy_error) < 3e-3
    assert float(run.constraint_error) < 1e-9
    assert np.isfinite(run.lock_time).all()


def test_it_opens_in_the_time_that_its_energy_says(example: dict[str, Any]) -> None:
    """Quadrature of the one-coordinate equation: the elastic ring is a little later."""
    scene: Scene = example["scene"]
    start = scene.structure.coordinate
    exact = opening_time(OneCoordinate(scene), start).time
    assert float(example["run"].deployment_time) == pytest.approx(exact, rel=3e-3)


def test_cables_stress_faults_and_its_own_text_work_as_with_any_other(
    example: dict[str, Any],
) -> None:
    cable = ringsim.load_scene("ring18-cable").to_table()["cables"]
    scene: Scene = example["scene"].with_values(
        {
            "cables": cable, "loads": "none", "record.stress": True, "solver.end_time": 0.5,
            "faults": [{"kind": "stuck-vjoint", "section": 2, "time": 0.2}],
        }
    )  # fmt: skip
    assert scene_from_toml(scene.to_toml(), source="text") == scene
    run = ringsim.simulate(scene)
    assert int(run.outcome) == Fate.CUT_OFF, run.attrs["reason"]
    assert {"inner_bar_upper_left", "diagonal_rising_right"} <= set(run.rod.values)
    assert run.rod_stress.sizes["rod"] == 16
    assert float(run.cable_tension.sel(plane="upper").max()) > 0.0
    assert run.cable_tension.sel(plane="inner upper").isnull().all()
    # 9.1e-6 at the default tolerance, 2.7e-6 at a thirtieth of it.
    assert float(run.energy_error) < 2e-5
    assert float(run.constraint_error) < 1e-9
