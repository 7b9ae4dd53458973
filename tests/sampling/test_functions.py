"""Inputs that follow others by a table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import preloaded
import pytest

import ringsim
from ringsim import InputError
from ringsim.analysis.design import called, inputs
from ringsim.campaign.specification import campaign_of
from ringsim.report import page
from ringsim.tables import number_text

TABLE = [[200.0, 9e4], [250.0, 1.0e5], [320.0, 1.4e5]]
INPUTS: dict[str, Any] = {
    "temperature": {"kind": "uniform", "low": 220.0, "high": 310.0, "unit": "K"},
    "lot": {"kind": "discrete", "values": ["A", "B"], "probabilities": [0.5, 0.5]},
    "cables.lower.axial_stiffness": {"kind": "function", "input": "temperature", "table": TABLE},
    "cables.upper.axial_stiffness":
        {"kind": "function", "input": "temperature", "table": [[200.0, 1e5], [400.0, 2e5]]},
    "joints.vjoint.viscous":
        {"kind": "function", "input": "lot", "table": [["B", 0.06], ["A", 0.04]]},
}  # fmt: skip


def campaign(given: dict[str, Any], design: str = "random", **keys: Any) -> ringsim.Campaign:
    return ringsim.Campaign(
        "truss2", given, {"kind": design, "samples": 16}, seed=4, fidelity="frame",
        set={"solver.end_time": 0.2}, **keys,
    )  # fmt: skip


def test_they_are_their_tables_of_what_was_drawn(tmp_path: Path) -> None:
    """In the scenes that run, and in the file; analyses know what was drawn alone."""
    given = campaign(INPUTS)
    found = given.run(workers=0, out=tmp_path / "o")
    cold, lot = found["temperature"].values, found["lot"].values
    assert 220.0 < cold.min() < cold.max() < 310.0
    assert set(lot) == {"A", "B"}
    assert found["temperature"].attrs["units"] == "K"
    assert "units" not in found["lot"].attrs  # nobody has told one
    lower = found["cables_lower_axial_stiffness"].values
    np.testing.assert_allclose(lower, np.interp(cold, *np.transpose(TABLE)), rtol=1e-15)
    upper = found["cables_upper_axial_stiffness"].values
    np.testing.assert_allclose(upper, 500.0 * cold, rtol=1e-14)
    np.testing.assert_array_equal(found["joints_vjoint_viscous"], np.where(lot == "A", 0.04, 0.06))
    assert [called(found[name]) for name in inputs(found)] == ["temperature", "lot"]
    scene = ringsim.load_scene("truss2").with_values({
        "solver.end_time": 0.2, "cables.lower.axial_stiffness": float(lower[5]),
        "cables.upper.axial_stiffness": float(upper[5]),
        "joints.vjoint.viscous": float(found["joints_vjoint_viscous"][5]),
    })  # fmt: skip
    own = ringsim.simulate(scene, fidelity="frame")
    assert own["peak_tension"].item() == found["peak_tension"].values[5]
    replayed = preloaded.ringsim("replay", tmp_path / "o", 5).stdout
    assert f"temperature = {cold[5]:.6g}\n" in replayed
    assert f'lot = "{lot[5]}"' in replayed
    values = {each.path: each for each in page.values_of(found)[0]}
    assert (values["joints.vjoint.viscous"].origin, values["joints.vjoint.viscous"].comment) == (
        "drawn", "follows lot",
    )  # fmt: skip
    assert "temperature" not in values
    rows = {row[0]: row for row in page.drawn_inputs(found)}
    assert [*rows] == ["temperature", "lot", *(path for path in INPUTS if "." in path)]
    assert (rows["temperature"][1], rows["temperature"][-1]) == ("K", "-")
    assert rows["cables.lower.axial_stiffness"][4] == " to ".join(
        number_text(end, 5) for end in (lower.min(), lower.max())
    )
    plan = given.plan(out=tmp_path / "p")
    assert "cables.lower.axial_stiffness: " in plan
    assert "N, follows temperature" in plan
    assert "rank correlation" not in plan  # both stiffnesses follow temperature, as they should
    told = ringsim.analyse(found)
    with pytest.raises(InputError, match="follows another input"):
        ringsim.analyse(found, reweighted={"temperature": INPUTS["cables.lower.axial_stiffness"]})
    assert set(told["input"].values) <= {"temperature", "lot = A", "lot = B"}


@pytest.mark.quick
def test_an_input_of_a_path_may_be_followed_place_by_place() -> None:
    """As friction classes of pulleys, which both cables have."""
    path = "cables.upper.friction.coefficient"
    drawn = {"kind": "uniform", "low": 1e-4, "high": 5e-4, "each_section": True}
    follower = {"kind": "function", "input": path, "table": [[0.0, 0.0], [1e-3, 2e-3]]}
    given = campaign({path: drawn, "cables.lower.friction.coefficient": follower})
    columns = {each.path: each for each in given._described.draw().columns}
    upper, lower = (columns[f"cables.{c}.friction.coefficient"] for c in ("upper", "lower"))
    np.testing.assert_allclose(lower.values, 2.0 * upper.values, rtol=1e-14)
    assert upper.dim == lower.dim == "pulley"
    assert lower.input == path


@pytest.mark.quick
@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"input": "cold"}, "follows cold, which is not drawn"),
        ({"table": [[230.0, 1e5], [320.0, 2e5]]}, "and the table goes from 230 to 320"),
        ({"table": [[320.0, 1e5], [200.0, 2e5]]}, "must increase"),
        ({"table": [["A", 1e5], ["B", 2e5]]}, "its table is of words, and temperature is not"),
        ({"table": [["A", 1e5], [200.0, 2e5]]}, "all words, or all numbers"),
        ({"table": [["A", 1e5], ["A", 2e5]], "input": "lot"}, "stands there twice"),
        ({"table": [["A", 1e5], ["C", 2e5]], "input": "lot"}, 'no row for "B"'),
        ({"table": [[200.0, 1e5]]}, "must have 2 or more entries"),
        ({"table": [[200.0, -1e5], [320.0, 1e5]]}, "axial_stiffness"),
        ({"table": [[200.0, -1e5], [320.0, 1e5]]}, "(by its table for temperature = 2"),
        ({"table": [[490.0, 1e5], [600.0, 1e5]]}, "if that is in C, it is 49"),
        ({"shared": ["rods.density"]}, "give each path a function of its own"),
        ({"unit": "N"}, 'unit = "N": the scene says the unit of its paths (N): leave it out'),
    ],
)  # fmt: skip
def test_what_is_no_function_is_refused(change: dict[str, Any], told: str) -> None:
    path = "cables.lower.axial_stiffness"
    with pytest.raises(InputError) as refused:
        campaign(INPUTS | {path: INPUTS[path] | change}).plan()
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.quick
def test_what_has_no_path_is_refused_unless_it_is_followed() -> None:
    with pytest.raises(InputError, match="temperature"):
        campaign({"temperature": INPUTS["temperature"]}).plan()
    each = INPUTS["temperature"] | {"each_section": True}
    with pytest.raises(InputError, match="nothing tells how many values"):
        campaign(INPUTS | {"temperature": each}).plan()


@pytest.mark.quick
def test_a_unit_is_told_of_what_has_no_path_alone() -> None:
    path = "rods.young_modulus"
    drawn = {"kind": "uniform", "low": 1.1e11, "high": 1.3e11, "unit": "MPa"}
    with pytest.raises(InputError, match="the unit of its paths \\(Pa\\): leave it out"):
        campaign({path: drawn}).plan()
    table = campaign_of(
        'name = "g"\nscene = "truss2"\ndesign = { kind = "random", samples = 4 }\n[inputs]\n'
        'cold = { kind = "uniform", low = 200, high = 320, unit = "K" }\n"rods.young_modulus" '
        '= { kind = "function", input = "cold", table = [[200, 1.2e11], [320, 1.3e11]] }\n',
        Path("g.toml"),
    ).draw()
    assert {each.name: each.units for each in table.columns} == {
        "cold": "K", "rods_young_modulus": "Pa",
    }  # fmt: skip


@pytest.mark.quick
def test_designs_place_samples_by_what_is_drawn() -> None:
    """A Sobol' design has two dimensions here, and a grid knows no other axes."""
    table = campaign_of(
        'name = "g"\nscene = "truss2"\ndesign = { kind = "grid", levels = 3 }\n[inputs]\n'
        'temperature = { kind = "uniform", low = 200, high = 320 }\n"cables.lower.axial_stiffness" '
        '= { kind = "function", input = "temperature", table = [[200, 1e5], [320, 2e5]] }\n',
        Path("g.toml"),
    ).draw()
    (stiffness,) = (each.values for each in table.columns if each.path)
    np.testing.assert_allclose(np.sort(stiffness), [1e5, 1.5e5, 2e5])
