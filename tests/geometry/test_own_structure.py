"""A topology that ringsim does not ship is one file: the double ring of the examples."""

from __future__ import annotations

import math
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import ringsim
from ringsim.layout.layout import internal_mobility, layout_of
from ringsim.parts.margin import EcssMechanisms
from ringsim.refusal import InputError
from ringsim.rigid.assembling import assembled
from ringsim.rigid.margin import DriveMargin
from ringsim.rigid.statics import OneCoordinate, opening_time
from ringsim.scene import Scene, scene_from_toml
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
    # Frames hold the body on the boom by a spring a hundred times as stiff as a rod, 6e8 N/m, which
    # forces of 1 N across the boom stretch by 2e-9 m.
    assert float(run.constraint_error) < 5e-9
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


@pytest.fixture
def double(example: dict[str, Any]) -> Scene:
    """For a short while: its layout has what each of these parts takes."""
    scene: Scene = example["scene"]
    return scene.with_values({"solver.end_time": 0.4, "record.interval": 0.05})


def test_accelerations_of_its_corners(double: Scene) -> None:
    run = ringsim.simulate(double.with_values({"record.accelerations": True}), "frame")
    own = run.peak_acceleration.sel(plane=["upper", "lower"])
    assert np.isfinite(own).all()
    assert run.peak_acceleration.sel(plane=["inner upper", "inner lower"]).isnull().all()
    assert float(run.peak_acceleration_max) == pytest.approx(float(own.max()))


def test_shape_of_its_corners(double: Scene) -> None:
    run = ringsim.simulate(double.with_values({"record.shape": True}), "frame")
    known = run.corner_deviation.sel(plane=["upper", "lower"])
    assert float(run.best_fit_rms) == pytest.approx(float(np.sqrt((known**2).mean())))
    assert run.corner_deviation.sel(plane="inner lower").isnull().all()


def test_errors_of_lengths_strain_the_rods_of_both_rings(double: Scene) -> None:
    """Alternating errors of all diagonals cannot be taken up without energy: twice E A e^2 L."""
    uneven = [1e-4, -1e-4] * 3
    scene = double.with_values({"rods.length_error": {"diagonal_rising": uneven}})
    layout = scene.structure.layout(scene, scene.structure.coordinate + 0j)
    strained = [rod.name for rod in layout.rods if rod.strain != 0.0]
    assert strained.count("diagonal_rising") == strained.count("inner_diagonal_rising") == 6
    run = ringsim.simulate(scene, "frame")
    expected = assembled(layout, scene.rods).energy
    assert expected > 0.0
    assert float(run.prestress_energy) == pytest.approx(expected, rel=1e-6)


def test_modulus_of_its_bars(double: Scene) -> None:
    scene = double.with_values({"rods.bar_young_modulus": 7e10})
    layout = scene.structure.layout(scene, scene.structure.coordinate + 0j)
    assert {rod.young_modulus for rod in layout.rods if rod.group == "bars"} == {7e10}
    assert {rod.young_modulus for rod in layout.rods if rod.group == "diagonals"} == {120e9}


def test_margin_of_its_drive(double: Scene) -> None:
    """A constant torque of 24 V-joints against dry friction of as many, by hand."""
    scene = double.with_values(
        {
            "loads": "none", "margin": {"kind": "ecss-e-st-33-01c"},
            "hinge_spring": {"kind": "linear", "stiffness": 0.0, "preload": 0.01},
            "joints": {"vjoint": {"coulomb": 0.001}},
        }
    )  # fmt: skip
    now = DriveMargin(scene, EcssMechanisms()).at(math.radians(120.0))
    assert now.resisting["joint friction"] == pytest.approx(24 * 0.001, rel=1e-9)
    assert now.margin == pytest.approx(0.8 * 0.01 / (2.0 * 3.0 * 0.001) - 1.0, rel=1e-9)
    assert np.isfinite(ringsim.simulate(scene, "frame").least_drive_margin)


def test_faults_in_its_inner_planes(double: Scene) -> None:
    """A stuck V-joint keeps its angle while the others go on; a failed spring loses its energy."""
    stuck = {"kind": "stuck-vjoint", "plane": "inner upper", "section": 2, "time": 0.0}
    held = ringsim.simulate(double.with_values({"faults": [stuck], "loads.force": 0.1}), "frame")
    moved = (held.opening_angle.dropna("time").isel(time=-1) - held.opening_angle[..., 0]).values
    place = {"plane": 2, "section": 1}
    assert abs(moved[place["plane"], place["section"]]) < 0.05 * np.abs(moved).max()
    spring = {"kind": "linear", "stiffness": 0.0, "preload": 0.01}
    broken = {"kind": "failed-spring", "plane": "inner lower", "section": 3, "time": 0.0}
    scene = double.with_values({"hinge_spring": spring, "faults": [broken]})
    run = ringsim.simulate(scene, "frame")
    assert float(run.dissipation[0]) == pytest.approx(0.01 * math.radians(80.0), rel=1e-6)
    for plane in ("inner", "outer upper"):
        with pytest.raises(
            InputError, match=f'plane = "{plane}" must be "upper" or "lower" or "in'
        ):
            double.with_values({"faults": [stuck | {"plane": plane}]})


def test_a_net_s_edge_in_its_outer_planes(double: Scene) -> None:
    net = {"kind": "boundary", "axial_stiffness": 1e3, "strain": 0.01}
    run = ringsim.simulate(double.with_values({"net": net}), "frame")
    assert np.isfinite(run.net_tension.sel(plane="upper")).any()
    assert run.net_tension.sel(plane="inner upper").isnull().all()


def test_what_its_layout_does_not_show_is_refused(double: Scene) -> None:
    """Its layout places pins where they are drawn, whatever field it inherits."""
    for field, value in (("hinge_error", {"upper_left": 1e-4}), ("angle_error", 0.1)):
        with pytest.raises(InputError, match=f'structure.{field}: structure.kind = "double-ring"'):
            double.with_values({f"structure.{field}": value})
        with pytest.raises(InputError, match=f"structure.{field}"):
            double.with_values({f"structure.{field}": value, "rods.length_error": {}})
