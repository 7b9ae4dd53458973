"""Campaigns over cables with one winch and with two, which have a span and a pulley more."""

from __future__ import annotations

from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from pydantic import TypeAdapter

from ringsim.outputs.family import axes
from ringsim.refusal import InputError
from ringsim.sampling.columns import Table, add_inputs
from ringsim.sampling.table import AnyDesign, AnyDistribution, draw
from ringsim.scene import Scene, load_scene
from ringsim.storage.netcdf import add_coordinate, read_design, write_design

pytestmark = pytest.mark.quick


def drawn(base: Scene, inputs: dict[str, object]) -> Table:
    return draw(
        base,
        TypeAdapter(dict[str, AnyDistribution]).validate_python(inputs),
        (),
        TypeAdapter(AnyDesign).validate_python({"kind": "random", "samples": 8}),
        seed=1,
        folder=Path(),
    )


def test_a_campaign_does_not_mix_cables_of_different_spans() -> None:
    ends = {"kind": "discrete", "values": ["first", "both"]}
    with pytest.raises(InputError, match="of 6 and of 7 spans"):
        drawn(load_scene("truss2"), {"cables.upper.end": ends})
    ends["values"] = ["first", "last"]
    assert drawn(load_scene("truss2"), {"cables.upper.end": ends}).samples == 8


def test_coefficients_of_two_lengths_lie_in_two_dimensions() -> None:
    law = {"kind": "uniform", "low": 2e-4, "high": 4e-4, "each_section": True}
    base = load_scene("truss2").with_values({"cables.upper.end": "both"})
    paths = [f"cables.{plane}.friction.coefficient" for plane in ("upper", "lower")]
    upper, lower = drawn(base, dict.fromkeys(paths, law)).columns
    assert (upper.dim, upper.values.shape) == ("pulley_of_two_winches", (8, 6))
    assert (lower.dim, lower.values.shape) == ("pulley", (8, 5))


def test_names_of_pulleys_are_in_the_design(tmp_path) -> None:
    law = {"kind": "uniform", "low": 2e-4, "high": 4e-4, "each_section": True}
    base = load_scene("truss2").with_values({"cables.lower.end": "last"})
    paths = [f"cables.{plane}.friction.coefficient" for plane in ("upper", "lower")]
    table = drawn(base, dict.fromkeys(paths, law))
    write_design(tmp_path, table, {"identity": "x", "scene": base.to_toml(), "solver": "none"})
    upper, lower = read_design(tmp_path)[0].columns
    assert [c.places for c in (upper, lower)] == [c.places for c in table.columns]
    assert upper.places[0] == "section 1 first hinge"
    assert lower.places[0] == "section 2 second hinge"
    with xr.open_dataset(tmp_path / "design.nc") as found:
        for column in (upper, lower):
            names = found[f"{column.name}_pulley_name"]
            assert names.values.tolist() == list(column.places)
        assert "pulley_name" not in found.variables


def test_fewer_pulleys_than_results_have_lie_in_a_dimension_of_their_own(tmp_path) -> None:
    law = {"kind": "uniform", "low": 2e-4, "high": 4e-4, "each_section": True}
    base = load_scene("truss2").with_values({"cables.upper.end": "both"})
    paths = [f"cables.{plane}.friction.coefficient" for plane in ("upper", "lower")]
    table = drawn(base, dict.fromkeys(paths, law))
    with netCDF4.Dataset(tmp_path / "inputs.nc", "w") as file:
        add_coordinate(file, "sample", np.arange(8))
        add_coordinate(file, "pulley", axes(base)["pulley"])
        add_inputs(file, table, compression=0)
    with xr.open_dataset(tmp_path / "inputs.nc") as found:
        assert found.sizes["pulley"] == 6
        lower = found["cables_lower_friction_coefficient"]
        assert lower.dims == ("sample", "pulley_of_one_winch")
        assert lower["pulley_of_one_winch_name"].values.tolist() == list(table.columns[1].places)
        assert found["cables_upper_friction_coefficient"].shape == (8, 6)


def test_a_pulley_by_name_and_by_number_is_drawn_once() -> None:
    law = {"kind": "uniform", "low": 2e-4, "high": 4e-4}
    path = "cables.upper.friction.coefficient"
    with pytest.raises(InputError, match=r"coefficient\[5\] is drawn twice"):
        drawn(load_scene("truss2"), {f"{path}[5]": law, f'{path}["section 2 V"]': law})
