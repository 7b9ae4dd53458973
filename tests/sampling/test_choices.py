"""Inputs that choose: whole tables, faults with a probability, one value for several paths."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from loops import for_each
from pydantic import TypeAdapter

from ringsim.refusal import InputError
from ringsim.sampling.columns import Correlation, Table
from ringsim.sampling.distributions import Distribution, Normal
from ringsim.sampling.table import AnyDesign, AnyDistribution, draw
from ringsim.scene import Scene, load_scene
from ringsim.storage.netcdf import read_design, write_design

pytestmark = pytest.mark.quick

TRUSS = load_scene("truss2")
IDENTITY = {"identity": "x", "scene": "", "solver": ""}
STUCK = {"kind": "stuck-vjoint", "section": 2, "time": 0.2}
STALL = {"kind": "stall", "speed": 0.12, "max_tension": 20.0}
LAW = {"kind": "ramp", "speed": 0.12, "duration": 1.0}
FAULTS = {"kind": "discrete", "values": [[STUCK], []], "probabilities": [0.1, 0.9]}
WINDING = {"kind": "discrete", "values": [STALL, LAW]}
STOP = {"kind": "discrete", "values": [5.0, "none"], "probabilities": [0.1, 0.9]}
UPPER, LOWER = (f"cables.{plane}.friction.coefficient" for plane in ("upper", "lower"))
FRICTION = {"kind": "lognormal", "mean": 4e-4, "standard_deviation": 1e-4, "shared": [UPPER, LOWER]}


def drawn(inputs: dict[str, object], *, base: Scene = TRUSS, design: object = None,
          correlations: list[Correlation] | None = None) -> Table:  # fmt: skip
    return draw(
        base,
        TypeAdapter(dict[str, AnyDistribution]).validate_python(inputs),
        correlations or (),
        TypeAdapter(AnyDesign).validate_python(design or {"kind": "random", "samples": 200}),
        seed=4,
        folder=Path(),
    )


def scenes(table: Table) -> list[Scene]:
    return [TRUSS.with_values(table.values_of(k)) for k in range(table.samples)]


def test_faults_strike_with_their_probability() -> None:
    struck = [bool(scene.faults) for scene in scenes(drawn({"faults": FAULTS}))]
    # Four standard deviations of 200 trials: 4 sqrt(0.1 * 0.9 / 200) = 0.085.
    assert np.mean(struck) == pytest.approx(0.1, abs=0.085)
    assert any(struck)


def test_a_motor_stops_with_its_probability_and_else_never() -> None:
    found = {
        scene.cables.lower.winch.stop_time
        for scene in scenes(drawn({"cables.lower.winch.stop_time": STOP}))
    }
    assert found == {5.0, None}


def test_a_table_takes_the_place_of_the_whole_part() -> None:
    inputs = {"cables.lower.winch.winding": WINDING}
    laws = [scene.cables.lower.winch.winding for scene in scenes(drawn(inputs))]
    assert {type(law).__name__ for law in laws} == {"StallWinding", "RampWinding"}
    assert {law.max_tension for law in laws if law.kind == "stall"} == {20.0}


def test_a_kind_is_drawn_and_keeps_what_both_have() -> None:
    path = "cables.upper.friction.kind"
    table = drawn({path: {"kind": "discrete", "values": ["none", "bearing"]}})
    kinds = {scene.cables.upper.friction.kind: scene for scene in scenes(table)}
    assert set(kinds) == {"none", "bearing"}
    assert kinds["bearing"] == TRUSS


def test_the_files_hold_labels_and_give_the_same_scenes_back(tmp_path: Path) -> None:
    inputs = {"faults": FAULTS, "cables.lower.winch.winding": WINDING,
              "cables.lower.winch.stop_time": STOP}  # fmt: skip
    table = drawn(inputs)
    write_design(tmp_path, table, IDENTITY)
    again, _ = read_design(tmp_path)
    assert again.starts_with(table)
    assert table.starts_with(again)
    assert scenes(again) == scenes(table)
    with xr.open_dataset(tmp_path / "design.nc") as file:
        groups = {name: len(found) for name, found in file.groupby("faults").groups.items()}
        words = set(file.cables_lower_winch_stop_time.values)
        units = {name: file[name].attrs.get("units") for name in file if "path" in file[name].attrs}
    assert set(groups) == {"none", "stuck-vjoint(section=2, time=0.2)"}
    assert groups["none"] == sum(not scene.faults for scene in scenes(table))
    assert words == {"5.0", "none"}
    # Numbers beside words have their unit; tables and words alone have none.
    assert units["cables_lower_winch_stop_time"] == "s"
    assert units["faults"] is units["cables_lower_winch_winding"] is None


def test_a_design_of_a_fidelity_that_does_not_exist_is_refused(tmp_path: Path) -> None:
    write_design(tmp_path, drawn({"faults": FAULTS}), IDENTITY | {"fidelity": "frame"})
    assert read_design(tmp_path)[1]["fidelity"] == "frame"
    write_design(tmp_path, drawn({"faults": FAULTS}), IDENTITY | {"fidelity": "banana"})
    with pytest.raises(InputError, match=r'design\.nc: its fidelity is "banana": the file is dam'):
        read_design(tmp_path)


def test_what_a_distribution_of_ones_own_lacks_is_told() -> None:
    law = Normal(mean=0.0, standard_deviation=1.0)
    with pytest.raises(InputError, match=r'^kind "normal" has no log_density.* from Continuous$'):
        Distribution.log_density(law, np.zeros(1))
    with pytest.raises(InputError, match=r'^kind "normal" has no probability.* from Continuous$'):
        Distribution.probability(law, 0.0)


def test_a_grid_crosses_tables_and_faults() -> None:
    table = drawn(
        {"faults": FAULTS, "cables.lower.winch.winding": WINDING}, design={"kind": "grid"}
    )
    assert table.samples == 4
    pairs = {(len(s.faults), s.cables.lower.winch.winding.kind) for s in scenes(table)}
    assert pairs == {(n, kind) for n in (0, 1) for kind in ("stall", "ramp")}


@pytest.mark.parametrize("each", [False, True])
def test_one_value_goes_to_all_paths_that_share_it(each: bool, tmp_path: Path) -> None:
    table = drawn({"friction": FRICTION | {"each_section": each}})
    upper, lower = table.columns
    assert (upper.path, lower.path) == (UPPER, LOWER)
    assert upper.values.shape == ((200, 5) if each else (200,))
    assert len(np.unique(upper.values)) == upper.values.size
    np.testing.assert_array_equal(upper.values, lower.values)
    write_design(tmp_path, table, IDENTITY)
    assert read_design(tmp_path)[0].starts_with(table)


def test_a_shared_value_is_one_axis_of_correlations_and_grids() -> None:
    damping = {"kind": "uniform", "low": 0.01, "high": 0.09}
    pair = Correlation(between=("friction", "joints.vjoint.viscous"), coefficient=0.9)
    inputs = {"friction": FRICTION, "joints.vjoint.viscous": damping}
    upper, _, viscous = drawn(inputs, correlations=[pair]).columns
    # Standard error of a correlation of 0.9 from 200 samples: (1 - 0.81) / sqrt(200) = 0.013.
    ranks = [np.argsort(np.argsort(c.values)) for c in (upper, viscous)]
    assert np.corrcoef(*ranks)[0, 1] == pytest.approx(0.9, abs=0.06)
    assert drawn(inputs, design={"kind": "grid", "levels": {"friction": 4}}).samples == 4 * 3


@for_each(
    ("inputs", "words"),
    [
        ({"friction": FRICTION, UPPER: FRICTION | {"shared": []}}, "upper.*is drawn twice"),
        ({"friction": FRICTION | {"shared": [UPPER, UPPER]}}, "must list each path once"),
        ({UPPER: FRICTION | {"shared": [LOWER]}}, "also that of the input, or the input must"),
        ({"friction": FRICTION | {"shared": ["cables.uper.friction"]}}, "did you mean upper"),
        ({"friction": FRICTION | {"shared": []}}, "friction is not a known key"),
        (
            {UPPER + "[2]": FRICTION | {"shared": []}, UPPER: FRICTION | {"shared": []}},
            r"coefficient would overwrite .*coefficient\[2\]: put it before that",
        ),
        ({"structure": {"kind": "discrete", "values": [{"sections": 3}]}}, "drawn as a whole"),
        (
            {"cables.lower.winch.stop_time": STOP | {"values": ["never", 5.0]}},
            'stop_time = "never" must be a finite number in s, without quotes, or "none"',
        ),
        ({"faults": FAULTS | {"values": [[STUCK | {"section": 7}], []]}}, "section = 7 must be at"),
    ],
)
def test_senseless_choices_are_refused_in_one_line(inputs: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        drawn(inputs)
    assert "\n" not in str(refusal.value)


def test_lists_of_different_lengths_share_no_values_of_their_places() -> None:
    base = TRUSS.with_values({"cables.upper.end": "both"})
    with pytest.raises(InputError, match=f"{UPPER} has 6, {LOWER} has 5: leave out each_section"):
        drawn({"friction": FRICTION | {"each_section": True}}, base=base)
