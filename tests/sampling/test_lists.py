"""Samples listed in a CSV file or taken from another campaign: labels, tables, bad cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from loops import for_each
from pydantic import TypeAdapter

from ringsim.refusal import InputError
from ringsim.sampling.columns import Table
from ringsim.sampling.designs.independent import Listed
from ringsim.sampling.table import AnyDesign, AnyDistribution, draw
from ringsim.scene import load_scene
from ringsim.storage.netcdf import read_design, write_design

pytestmark = pytest.mark.quick

TRUSS = load_scene("truss2")
PATH = "cables.upper.friction.coefficient"


def listed(folder: Path, text: str) -> Table:
    (folder / "cases.csv").write_text(text)
    return draw(TRUSS, {}, (), Listed(file="cases.csv"), seed=1, folder=folder)


def test_text_columns_are_labels_and_no_inputs(tmp_path: Path) -> None:
    text = "solver.step, motor type, stop\n0.1, A1, none\n0.05, 7, none\n"
    table = listed(tmp_path, text)
    assert table.values_of(1) == {"solver.step": 0.05, "stop": "none"}
    write_design(tmp_path, table, {"identity": "x", "scene": "", "solver": ""})
    again, _ = read_design(tmp_path)
    assert again.starts_with(table)
    assert again.values_of(1) == table.values_of(1)
    third = draw(TRUSS, {}, (), Listed(file="design.nc"), seed=1, folder=tmp_path)
    for found in (again, third):
        (label,) = (column for column in found.columns if not column.path)
        assert (label.name, label.values.tolist()) == ("motor_type", ["A1", "7"])


def test_cells_hold_words_beside_numbers_and_tables(tmp_path: Path) -> None:
    text = (
        "cables.lower.winch.stop_time,cables.lower.winch.winding\n"
        "5.0,\"{ kind = 'stall', speed = 0.12, max_tension = 20.0 }\"\n"
        "none,\"{ kind = 'constant', speed = 0.12 }\"\n"
    )
    table = listed(tmp_path, text)
    first, second = (TRUSS.with_values(table.values_of(k)).cables.lower.winch for k in (0, 1))
    assert (first.stop_time, first.winding.max_tension) == (5.0, 20.0)
    assert (second.stop_time, second.winding.kind) == (None, "constant")


def test_lists_from_another_campaign_keep_their_arrays(tmp_path: Path) -> None:
    law = {"kind": "uniform", "low": 2e-4, "high": 4e-4, "each_section": True}
    inputs = TypeAdapter(dict[str, AnyDistribution]).validate_python({PATH: law})
    design = TypeAdapter(AnyDesign).validate_python({"kind": "random", "samples": 3})
    table = draw(TRUSS, inputs, (), design, seed=1, folder=tmp_path)
    write_design(tmp_path, table, {})
    (column,) = draw(TRUSS, {}, (), Listed(file="design.nc"), seed=1, folder=tmp_path).columns
    assert (column.path, column.dim, column.units) == (PATH, "pulley", "m")
    np.testing.assert_array_equal(column.values, table.columns[0].values)
    ring = load_scene("ring18-cable")
    with pytest.raises(InputError, match=r"design\.nc: sample 0, column .* has 5 values"):
        draw(ring, {}, (), Listed(file="design.nc"), seed=1, folder=tmp_path)


@for_each(
    ("text", "words"),
    [
        (
            "solver.step,joints.vjoint.viscous\n0.1,0.05\n0.1,0.04\n0.1,abc\n0.1,0.06\n",
            r'row 3 below the header, sample 2, column joints.vjoint.viscous: .* = "abc" must be a',
        ),
        ("solver.step,loads.force\n0.1,0.1\n0.1,\n", r'row 2 .*column loads.force: .* = "" must'),
        ("solver.step\n0.1\nnan\n", "row 2 below the header, sample 1, column solver.step: .*nan"),
        ("solver.step\n0.1\n-1.0\n", r"row 2 .*column solver.step: .*must be at least"),
        ("solver.step;loads.force\n0,1;0,2\n", "separated by semicolons, and must be by commas"),
        ("solver.step\tloads.force\n0.1\t0.2\n", "separated by tabs, and must be by commas"),
        ('solver.step\n0.1\n"0,05"\n', 'row 2 .*solver.step: "0,05" has a decimal comma: .* 0.05'),
        ("solver.step\n0,1\n", r"row 1 has 2 values and must have 1.*decimals have points"),
        ("solver.step,case\n0.1,1\n", "column case is no scene path, and no label"),
        (
            "solver.step,status\n0.1,good\n",
            "label status would have the name status, which is in use",
        ),
        (
            "solver.step,sample\n0.1,first\n",
            "label sample would have the name sample, which is in use",
        ),
        ("solver.stop,case\n0.1,good\n", r"column solver.stop: .*did you mean step\?"),
        (
            'cables.upper.winch.winding\n"{ kind = 3"\n',
            "winding = { kind = 3: not a valid TOML table",
        ),
    ],
)
def test_bad_cells_are_named_in_one_line(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        listed(tmp_path, text)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("row", [1, 2])
def test_a_refused_value_of_a_named_pulley_keeps_the_name(row: int, tmp_path: Path) -> None:
    path = 'cables.upper.friction.coefficient["section 2 V"]'
    cells = ["-0.002", "0.001"] if row == 1 else ["0.001", "-0.002"]
    quoted = path.replace('"', '""')
    (tmp_path / "c.csv").write_text("\n".join([f'"{quoted}"', *cells]))
    with pytest.raises(InputError) as refused:
        draw(load_scene("truss2"), {}, [], Listed(file="c.csv"), seed=0, folder=tmp_path)
    assert str(refused.value).startswith(
        f"c.csv: row {row} below the header, sample {row - 1}, column {path}: scene truss2: "
        f"{path} = -0.002 m must be at least 0 m"
    )
