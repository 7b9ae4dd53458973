"""What is told of a design that changes one input at a time: each case, and no chance."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from made_campaign import made_campaign

from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import case_table, told
from ringsim.analysis.worst import worst_lines
from ringsim.plots.campaign.frame import looks_of_cases

pytestmark = pytest.mark.quick

STOP = "cables.lower_winch_stop_time"
LIMIT = {"asynchrony_max": {"max": 11.5, "probability": 0.9, "confidence": 0.9}}


@pytest.fixture
def campaign() -> xr.Dataset:
    """Sample 5 stalls, its lower winch stops at 3 s."""
    made = made_campaign(6, stalled=(5,))
    made.attrs["design"] = '{"kind": "one-at-a-time"}'
    made["rods_young_modulus"][:] = [1e11, 2e11, 1e11, 1e11, 1e11, 1e11]
    friction = np.ones((6, 3))
    friction[[2, 3, 4], [0, 1, 2]] = 2.0
    made["cables_upper_friction_coefficient"][:] = friction
    made["cables_lower_winch_stop_time"][:] = ["none"] * 5 + ["3.0"]
    return made


def test_each_case_has_its_change_its_outcome_and_its_numbers(campaign: xr.Dataset) -> None:
    table = case_table(analyse(campaign))
    assert [row[1] for row in table.rows] == [
        "the base case",
        "rods.young_modulus = 200 GPa (base: 100 GPa)",
        *(f"pulley {k} of cables.upper_friction_coefficient = 2 m (base: 1 m)" for k in (1, 2, 3)),
        f"{STOP} = 3 s (base: none)",
    ]
    assert [row[2] for row in table.rows] == ["deployed"] * 5 + ["stalled"]
    for name in ("deployment_time", "asynchrony_max", "peak_tension"):
        (at,) = (k for k, head in enumerate(table.head) if head.startswith(f"{name} ("))
        for row, value in zip(table.rows, campaign[name].values, strict=True):
            assert row[at] == ("-" if np.isnan(value) else f"{value:.4g}"), name


def test_failures_tell_what_is_other_and_nothing_speaks_of_chance(campaign: xr.Dataset) -> None:
    found = analyse(campaign, LIMIT)
    lines = told(found)
    (violating,) = (k for k, line in enumerate(lines) if line.startswith("worst of: stalled"))
    assert lines[violating + 2] == f"    inputs: {STOP} = 3 s (base: none)"
    text = "\n".join(lines)
    for word in ("nothing unusual", "chance", "significant", "estimate  ", "probability of"):
        assert word not in text, word
    bad = int((campaign["asynchrony_max"] > 11.5).sum())
    assert f"asynchrony_max: {bad} of 6 samples violate it" in lines
    assert "these samples stand for no population: there is no probability to estimate" in lines
    drawn = told(analyse(campaign.assign_attrs(design='{"kind": "random"}'), LIMIT))
    assert not any("population" in line for line in drawn)


def test_what_is_the_same_in_all_cases_has_its_value(campaign: xr.Dataset) -> None:
    campaign["peak_tension"][:] = 40.0
    (line,) = (each for each in told(analyse(campaign)) if each.startswith("the same in all"))
    assert "peak_tension 40 N" in line


def test_cases_of_a_list_are_told_by_their_names(campaign: xr.Dataset) -> None:
    """In a table, and in figures that draw each of them; a list without names has neither."""
    listed = campaign.assign_attrs(design='{"kind": "list", "file": "cases.csv"}')
    assert "case" not in analyse(listed).dims
    names = np.array(["sound", "soft", "jam", "late", "cold", "stops"], dtype=object)
    listed["load_case"] = "sample", names, {"role": "label", "path": ""}
    table = case_table(analyse(listed))
    assert table.head[:3] == ("sample", "case", "outcome")
    assert [row[:3] for row in table.rows] == [
        (str(k), name, "stalled" if k == 5 else "deployed") for k, name in enumerate(names)
    ]
    assert [row for row in told(analyse(listed)) if row.startswith("5 ")]
    looks = looks_of_cases(listed, np.array([1, 5]))
    assert [each["label"] for each in looks] == ["soft (deployed)", "stops (stalled)"]


def test_the_base_case_is_the_first_sample_also_where_that_has_not_run() -> None:
    """As of another part of a campaign that runs in parts."""
    made = made_campaign(8, not_run=[0])
    made.attrs["design"] = '{"kind": "one-at-a-time"}'
    moduli, times = np.full(8, 1e11), np.full(8, "none", dtype="<U4")
    moduli[1], times[7] = 2e11, "4.0"
    for name, values in (
        ("rods_young_modulus", moduli), ("cables_lower_winch_stop_time", times),
        ("cables_upper_friction_coefficient", np.zeros((8, 3))),
    ):  # fmt: skip
        made[name] = made[name].dims, values, made[name].attrs
    lines = "\n".join(worst_lines(analyse(made), "DIR"))
    assert "inputs: cables.lower_winch_stop_time = 4 s (base: none)" in lines
    assert "base: 200 GPa" not in lines
