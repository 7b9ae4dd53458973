"""The table of differences counts what it says, and the verdict follows from it."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from ringsim.analysis.engines import check_lines, differences, main_outputs
from ringsim.analysis.intervals import quantities
from ringsim.variables import Fate, Status

pytestmark = pytest.mark.quick

NAN = np.nan


def campaign(**changed: list[float]) -> xr.Dataset:
    """Four samples, of which 0, 1 and 3 were checked; the check of 3 has failed."""
    values = {
        "status": [Status.OK] * 4,
        "outcome": [Fate.DEPLOYED] * 4,
        "deployment_time": [10.0, 11.0, 12.0, 13.0],
        "deployment_time_error": [0.02, NAN, NAN, NAN],
        "status_checked": [Status.OK, Status.OK, -1, Status.SOLVER_FAILED],
        "outcome_checked": [Fate.DEPLOYED, Fate.DEPLOYED, -1, Fate.NONE],
        "deployment_time_checked": [10.01, 11.03, NAN, NAN],
        "deployment_time_error_checked": [0.005, NAN, NAN, NAN],
    } | changed
    columns = {name: ("sample", np.array(column)) for name, column in values.items()}
    reasons = ("sample", ["", "", "", "too stiff"])
    design = {"design": json.dumps({"kind": "random", "samples": 4})}
    return xr.Dataset({**columns, "reason_checked": reasons}, {"sample": np.arange(4)}, design)


def test_numbers_of_the_antenna_are_quantities() -> None:
    names = quantities().keys()
    assert names >= {"deployment_time", "asynchrony_max_time", "peak_tension", "locked_joints"}
    for other in ("energy_error", "steps", "cpu_time", "peak_tension_span", "opening_angle"):
        assert other not in names
    assert {"deployment_time", "asynchrony_max", "peak_tension"} <= set(main_outputs())


def test_only_samples_that_ended_well_with_both_count() -> None:
    (found,) = differences(campaign())
    assert found.name == "deployment_time"
    assert found.samples.tolist() == [0, 1]
    assert found.apart == pytest.approx([0.01, 0.03])
    assert found.share == pytest.approx([0.01 / 10.01, 0.03 / 11.03])
    assert found.worst == 1
    # Where a sample states no bar, the largest of its engine stands in.
    assert found.bars == pytest.approx([0.025, 0.025])
    assert found.standard_error == pytest.approx(np.std([10, 11, 12, 13], ddof=1) / 2.0)


def test_what_both_engines_compute_alike_judges_neither() -> None:
    """The margin of the drive is the statics of rigid rods in both."""
    margin = {"least_drive_margin": [0.1] * 4, "least_drive_margin_checked": [0.1, 0.1, NAN, NAN]}
    assert [each.name for each in differences(campaign(**margin))] == ["deployment_time"]


@pytest.mark.parametrize(
    ("checked", "listed"),
    [([10.0 + 1e-13, 11.0], False), ([10.0, 11.0 + 1e-6], True), ([NAN, 11.0], True)],
)
def test_what_rounding_leaves_is_not_listed(checked: list[float], listed: bool) -> None:
    (found,) = differences(campaign(deployment_time_checked=[*checked, NAN, NAN]))
    assert found.listed == listed


def test_rounding_of_zero_is_not_listed() -> None:
    """Its share of the other engine's value is infinite."""
    values = {"deployment_time": [1e-17, 11.0, 1.0, 1.0]}
    (found,) = differences(campaign(**values, deployment_time_checked=[0.0, 11.0, NAN, NAN]))
    assert not found.listed


def test_standard_errors_are_those_of_the_design() -> None:
    def of(**design: object) -> float:
        return differences(campaign().assign_attrs(design=json.dumps(design)))[0].standard_error

    # Replicates 0 and 1 have the means 11 and 12.
    halves = of(kind="sobol", samples=4, replicates=2)
    assert halves == pytest.approx(np.std([11, 12], ddof=1) / 2**0.5)
    assert np.isnan(of(kind="sobol", samples=4))
    assert np.isnan(of(kind="grid"))


def test_the_last_line_says_whether_bars_cover_the_differences() -> None:
    lines = check_lines(campaign())
    assert lines[0] == "3 of 4 samples were checked with the full engine"
    assert lines[1] == "1 check failed, first sample 3: too stiff"
    assert lines[2] == "median and worst are over the 2 samples that both engines completed"
    assert lines[-1] == (
        "the engines differ by more than their error bars in deployment_time (sample 1: 0.03 s, "
        "both error bars 0.025)"
    )
    (head,) = (line for line in lines if line.startswith("difference of"))
    assert "both error bars there" in head  # of two engines, not those of one as elsewhere
    near = check_lines(campaign(deployment_time_checked=[10.01, 11.02, NAN, NAN]))
    assert near[-1] == "the engines differ by no more than their error bars"
    # Of what tables do not list it says nothing: moments, and numbers that are the same.
    none = [0.0] * 4
    two = campaign(
        deployment_time_checked=[10.01, 11.02, NAN, NAN],
        peak_tension=[5.0] * 4, peak_tension_checked=[5.1, 5.0, NAN, NAN],
        peak_tension_time=[1.0] * 4, peak_tension_time_checked=[1.5, 1.0, NAN, NAN],
        asynchrony_max=none, asynchrony_max_checked=none,
    )  # fmt: skip
    assert check_lines(two)[-1] == (
        "the engines differ by no more than their error bars in the 1 output with such bars"
    )
    # Sections that are all alike run apart by round-off, which no bar covers.
    alike = campaign(
        deployment_time_checked=[10.01, 11.02, NAN, NAN],
        asynchrony_max=[5e-6, 4e-6, 0.0, 0.0], asynchrony_max_checked=[2e-9, 3e-9, NAN, NAN],
        asynchrony_max_error=[1e-9] * 4, asynchrony_max_error_checked=[1e-9] * 4,
    )  # fmt: skip
    assert check_lines(alike)[-1] == "the engines differ by no more than their error bars"
    apart = alike.assign(asynchrony_max=("sample", [2e-4, 0.0, 0.0, 0.0]))
    assert "more than their error bars in asynchrony_max" in check_lines(apart)[-1]
    silent = campaign().drop_vars(["deployment_time_error", "deployment_time_error_checked"])
    assert "error bars in" not in check_lines(silent)[-1]


def test_a_number_that_one_engine_lacks_differs_by_all() -> None:
    stalled = campaign(
        deployment_time_checked=[10.01, NAN, NAN, NAN],
        outcome_checked=[Fate.DEPLOYED, Fate.STALLED, -1, Fate.NONE],
    )
    (found,) = differences(stalled)
    assert found.apart.tolist() == [pytest.approx(0.01), np.inf]
    assert found.share[1] == np.inf
    told = "the outcome differs in 1 of 2: sample 1: deployed, full engine: stalled"
    assert told in check_lines(stalled)
    stalled.attrs["max_difference"] = "1000.0"
    assert "more than the campaign allows" in check_lines(stalled)[-1]


def test_a_campaign_without_checks_says_nothing() -> None:
    plain = campaign()
    assert check_lines(plain.drop_vars([n for n in plain if str(n).endswith("_checked")])) == []


def test_stresses_are_told_in_the_unit_of_all_other_tables() -> None:
    values = {"peak_rod_stress": [6.0e6] * 4, "peak_rod_stress_checked": [6.1e6, 6.0e6, NAN, NAN]}
    bars = {f"peak_rod_stress_error{end}": [1e4] * 4 for end in ("", "_checked")}
    lines = check_lines(campaign(**values, **bars))
    (row,) = (line for line in lines if line.startswith("peak_rod_stress"))
    assert row.split()[1:6] == ["MPa", "0.05", "0.1", "0", "0.016"]
    assert row.split()[6] == "0.02"
    assert "0.1 MPa, both error bars 0.02" in lines[-1]
