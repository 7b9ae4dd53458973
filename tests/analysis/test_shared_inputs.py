"""An input that several paths share has one name, that of the campaign's file, everywhere."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from made_campaign import made_campaign

from ringsim.analysis.comparison import compare
from ringsim.analysis.design import called, drawn, inputs
from ringsim.analysis.reweighting import read_distributions, weights_of
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told
from ringsim.campaign.specification import load_campaign
from ringsim.export import meaning_of
from ringsim.plots.campaign.numbers import by_input
from ringsim.plots.campaign.tornado import bars_of
from ringsim.refusal import InputError
from ringsim.report import page
from ringsim.storage.netcdf import read_design, write_design

PATHS = ["temperature.joint.value", "temperature.pulley.value"]
FILE = f"""
name = "shared"
scene = "ring18-motor"
fidelity = "frame"
design = {{ kind = "random", samples = 4 }}
[set]
"joints.vjoint" = {{ kind = "viscous-coulomb", coulomb = 0.002, rate = 0.002 }}
"temperature.joint.friction" = {{ temperatures = [200.0, 350.0], factors = [3.0, 0.5] }}
"temperature.pulley.friction" = {{ temperatures = [200.0, 350.0], factors = [3.0, 0.5] }}
[inputs]
cold = {{ kind = "uniform", low = 220.0, high = 330.0, shared = {json.dumps(PATHS)} }}
"loads.force" = {{ kind = "uniform", low = 0.01, high = 0.02 }}
"""


def shared(samples: int = 30, *, named: bool = True) -> xr.Dataset:
    """Asynchrony follows an input that two paths share, which a list of places goes with."""
    made, random = made_campaign(samples), np.random.default_rng(1)
    law = json.dumps({"kind": "uniform", "low": 0.0, "high": 1.0, "shared": PATHS})
    values = random.random(samples)
    for path in PATHS:
        says = {"role": "input", "path": path, "units": "K", "distribution": law}
        says |= {"input": "cold"} if named else {}
        made[path.replace(".", "_")] = "sample", values, says
    made["cables_upper_friction_coefficient"][:] = random.random((samples, 3))
    made["rods_young_modulus"][:] = random.random(samples)
    made["asynchrony_max"][:] = 10.0 * values
    return made


def test_the_files_of_a_campaign_hold_the_names(tmp_path: Path) -> None:
    (tmp_path / "c.toml").write_text(FILE)
    table = load_campaign(tmp_path / "c.toml").draw()
    write_design(tmp_path, table, {"identity": "", "scene": "", "solver": ""})
    again, _ = read_design(tmp_path)
    for each in (table, again):
        assert [(c.path, c.input or c.path) for c in each.columns] == [
            *((path, "cold") for path in PATHS), ("loads.force", "loads.force"),
        ]  # fmt: skip
    found = xr.load_dataset(tmp_path / "design.nc")
    assert [called(found[name]) for name in inputs(found)] == ["cold", "loads.force"]


def test_one_column_one_row_and_one_panel() -> None:
    made = shared()
    assert sum("temperature" in name for name in drawn(made).names) == 0
    assert drawn(made).names.count("cold") == 1
    found = analyse(made)
    assert found["input"].values.tolist().count("cold") == 1
    for full in (False, True):
        lines = "\n".join(told(found, full=full))
        assert "cold" in lines
        assert "temperature." not in lines
    row = next(row for row in page.drawn_inputs(made) if row[0] == "cold")
    assert row[1:3] == ["K", "1"]
    assert row[-1] == ", ".join(PATHS)
    assert len(page.drawn_inputs(made)) == 4
    origins = {value.path: value.origin for value in page.values_of(made)[0]}
    assert [origins[path] for path in PATHS] == ["drawn", "drawn"]
    panels = [axes.get_xlabel() for axes in by_input(made).axes if axes.get_xlabel()]
    assert [label for label in panels if label.startswith(("cold", "temperature"))] == ["cold (K)"]
    _, bars = next((name, bars) for name, bars in bars_of(made) if name == "asynchrony_max")
    assert bars.names[0] == "cold"
    assert meaning_of(made["temperature_joint_value"]) == f"cold: {PATHS[0]}"


def test_inputs_that_nothing_tells_apart_have_both_names() -> None:
    made = shared()
    says = {"role": "input", "path": "loads.force", "units": "N", "distribution": "listed"}
    made["loads_force"] = "sample", made["temperature_joint_value"].values, says
    names = drawn(made).names
    assert "cold and loads.force" in names
    assert not {"cold", "loads.force"} & set(names)


def test_it_is_reweighted_as_a_whole() -> None:
    made = shared()
    new = {"kind": "uniform", "low": 0.5, "high": 1.0}
    weights, _ = weights_of(made, read_distributions({"cold": new}))
    np.testing.assert_array_equal(weights > 0, made["temperature_joint_value"] >= 0.5)
    for path in PATHS:
        with pytest.raises(InputError, match=rf"{path}: is not a drawn .*did you mean cold\?"):
            weights_of(made, read_distributions({path: new}))


def test_a_comparison_names_it_once() -> None:
    one, other = shared(), shared()
    for each in (one, other):
        each["sample_seed"] = "sample", np.arange(30)
        each.attrs["design"] = json.dumps({"kind": "random", "samples": 30})
    for path in PATHS:
        name = path.replace(".", "_")
        other[name][:] = 0.5
        law = json.loads(other[name].attrs["distribution"])
        other[name].attrs["distribution"] = json.dumps(law | {"kind": "uniform", "low": 0.2})
    assert compare(one, other).attrs["pairing"].endswith("their inputs differ in cold")
