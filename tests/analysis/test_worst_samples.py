"""The worst samples of each failure, and what is unusual in their inputs."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from made_campaign import made_campaign

from made import campaign
from ringsim.analysis.design import placement
from ringsim.analysis.influence import influence
from ringsim.analysis.influence_text import what_separates
from ringsim.analysis.requirements import read_requirements
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import told
from ringsim.analysis.worst import unusual, worst, worst_lines
from ringsim.refusal import InputError
from ringsim.variables import Fate, Status

BOUND = {"probability": 0.9, "confidence": 0.9}
VALUES = np.array([5.0, 1.0, 9.0, np.nan, 7.0, 8.0, 2.0, np.nan])


def made() -> xr.Dataset:
    """Samples 3 and 7 have no asynchrony: one has stalled, one is lost."""
    status, outcome = np.full(8, Status.OK), np.full(8, Fate.DEPLOYED)
    status[7], outcome[3], outcome[7] = Status.DIVERGED, Fate.STALLED, Fate.NONE
    found = campaign(
        VALUES, status=status, outcome=outcome, least_drive_margin=0.1 * VALUES - 0.35,
        locked_joints=np.array([8, 8, 8, 2, 8, 8, 8, 0]), final_time=np.full(8, 4.0),
    )  # fmt: skip
    return found.assign(reason=("sample", [f"ended so; in run {k}" for k in range(8)]))


def found(**requirements: dict[str, float]) -> dict[str, list[tuple[int, str]]]:
    wanted = read_requirements({k: v | BOUND for k, v in requirements.items()}, "file")
    one, rows = worst(made(), wanted), dict[str, list[tuple[int, str]]]()
    for words, sample, value in zip(
        one.worst_failure.values, one.worst_sample.values, one.worst_found.values, strict=True
    ):
        rows.setdefault(words, []).append((int(sample), str(value)))
    return rows


def test_each_failure_has_its_worst_samples_in_order() -> None:
    rows = found(asynchrony_max={"max": 6.0}, least_drive_margin={"min": 0.2})
    degree = "violates asynchrony_max <= 6 deg"
    assert rows == {
        degree: [(2, "9 deg"), (5, "8 deg"), (4, "7 deg")],
        "violates least_drive_margin >= 0.2": [(1, "-0.25"), (6, "-0.15"), (0, "0.15")],
        "stalled": [(3, "ended so")],
        "failed: diverged": [(7, "ended so")],
    }
    # Without a value it is violated, too, and comes after those that tell by how much.
    assert found(asynchrony_max={"max": 8.5})["violates asynchrony_max <= 8.5 deg"] == [
        (2, "9 deg"), (3, "no value: ended so"),
    ]  # fmt: skip
    both = found(asynchrony_max={"min": 1.5, "max": 8.9})
    assert [s for s, _ in both["violates asynchrony_max <= 8.9 deg and >= 1.5 deg"]] == [
        1, 2, 3,
    ]  # fmt: skip


def test_failures_of_the_same_samples_are_one() -> None:
    wanted = read_requirements({"outcome": {"is": "deployed", **BOUND}}, "file")
    one = worst(made(), wanted)
    assert list(one.worst_failure.values) == ["violates outcome is deployed; stalled",
                                              "failed: diverged"]  # fmt: skip
    assert one.worst_failed.values.tolist() == [1, 1]
    assert one.worst_of.values.tolist() == [8, 8]
    assert not worst(made().isel(sample=[0, 1]), {})
    with pytest.raises(InputError, match="no such output"):
        worst(made(), read_requirements({"peak_tension": {"max": 1.0, **BOUND}}, "file"))


def inputs(**columns: np.ndarray) -> xr.Dataset:
    one = xr.Dataset(coords={"sample": np.arange(20)})
    for name, values in columns.items():
        units = "K" if name == "temperature" else "m"
        says = {"role": "input", "path": f"a.{name}", "input": name, "units": units}
        one[name] = ("sample", "section")[: values.ndim], values, says
    return one


def test_what_is_far_out_is_told_in_words() -> None:
    even = np.linspace(-1.0, 1.0, 20)
    places = 1e-3 * (1.0 + 0.01 * np.outer(even, [1.0, -0.9, 1.0, -0.9]))
    places[9, 3] = 1.5e-3
    one = inputs(
        temperature=293.15 + 50.0 * even, friction=places, word=np.array(["a"] * 19 + ["b"]),
        alike=np.full(20, 3.0),
    )  # fmt: skip
    cold, second, usual, odd, word = unusual(one, [0, 1, 10, 9, 19])
    assert cold == (
        "temperature 243.1 K (-30 C, the lowest); "
        "section 1 of friction 0.00099 m (-1 %, the lowest)"
    )
    assert second == "nothing unusual"  # one of ten is as cold
    assert usual == "nothing unusual"
    assert odd == "section 4 of friction 0.0015 m (+50 %, the highest)"
    assert "word = b (as in 1 of 20)" in word
    assert "temperature 343.1 K (70 C, the highest)" in word


def test_a_place_is_compared_with_all_places_also_where_it_separates_the_failure() -> None:
    """As the note says: the median of all is 1.5, that of section 2 alone 2."""
    places = np.repeat([[1.0, 2.0, 1.0, 2.0]], 20, axis=0)
    places[7, 1] = 3.0
    one = inputs(friction=places)
    alone = unusual(one, [7])
    assert alone == ["section 2 of friction 3 m (+100 %, the highest)"]
    assert unusual(one, [7], [{"section 2 of friction": True}]) == alone


def test_a_value_that_many_samples_have_is_not_unusual() -> None:
    """Of a discrete input none lies beyond the last value, and a quarter may have it."""
    for count, rare in ((5, False), (2, True)):  # of 40, on each side: two are one in twenty
        steps = np.repeat([1.2, 1.5, 1.8], [count, 40 - 2 * count, count])
        one = inputs()
        one = one.isel(sample=0, drop=True).assign_coords(sample=np.arange(40))
        one["step"] = "sample", steps, {"role": "input", "path": "a.step", "units": "m"}
        one["step"][1] = 1.2 * (1.0 + 1e-15)  # as computed
        ends = unusual(one, [0, 39])
        assert [each != "nothing unusual" for each in ends] == [rare, rare]


def test_of_a_grid_the_values_at_its_ends_are_told() -> None:
    """No value of a grid is rare; the corner that sizes a mechanism is what was asked for."""
    cold, rub = (each.ravel() for each in np.meshgrid([213.0, 253.0, 293.0], [0.02, 0.05]))
    one = made_campaign(6, kind="grid")
    one = one.drop_vars([n for n, v in one.data_vars.items() if v.attrs.get("role") == "input"])
    for name, values, units in (("temperature", cold, "K"), ("coulomb", rub, "N m")):
        says = {"role": "input", "path": f"a.{name}", "input": name, "units": units}
        one[name] = "sample", values, says
    corner, middle = unusual(one, [3, 4])
    assert corner == (
        "temperature 213 K (-60 C, the lowest); coulomb 0.05 N m (+43 %, the highest)"
    )
    assert middle == "coulomb 0.05 N m (+43 %, the highest)"


def test_chance_makes_one_sample_in_ten_unusual() -> None:
    """Also of many places: some place is always far out."""
    random = np.random.default_rng(3)
    values = random.random((1000, 17))
    one = xr.Dataset(coords={"sample": np.arange(1000)})
    says = {"role": "input", "path": "a", "units": "m"}
    one["single"] = "sample", values[:, 0], says
    shares = [np.mean(np.array(unusual(one, [*range(1000)])) != "nothing unusual")]
    one = one.drop_vars("single").assign(many=(("sample", "section"), values, says))
    far = np.array(unusual(one, [*range(1000)]))
    # Places alone: 1 - (1 - 0.1 / 17)^17 = 0.095; with the mean, which goes with them, more.
    shares.append(np.mean([each.startswith("section ") for each in far]))
    assert shares[0] == pytest.approx(0.1, abs=0.002)
    assert 0.06 < shares[1] < 0.1


def stalled_by(stuck: np.ndarray, cold: np.ndarray, noise: np.ndarray) -> xr.Dataset:
    """A campaign whose stuck or cold samples stall, among inputs that do nothing."""
    stalls = stuck | (cold < 240.0)
    outcome = np.where(stalls, Fate.STALLED, Fate.DEPLOYED)
    one = campaign(np.full(len(stuck), 5.0), outcome=outcome,
                   locked_joints=np.full(len(stuck), 3))  # fmt: skip
    for name, values, units in (
        ("faults", np.where(stuck, "stuck-vjoint", "none"), "1"),
        ("temperature", cold, "K"),
        *((f"noise{k}", column, "m") for k, column in enumerate(noise.T)),
    ):
        one[name] = "sample", values, {"role": "input", "path": name, "units": units}
    return one


def test_what_separates_the_failures_is_named_first_however_common_it_is() -> None:
    """A quarter of the samples has the fault that all stalled ones have."""
    random = np.random.default_rng(1)
    stuck = np.arange(100) % 4 == 0
    one = stalled_by(stuck, np.full(100, 293.0), random.random((100, 5)))
    rows = analyse(one).worst_inputs.values.tolist()
    assert len(rows) == 3
    assert all(row.startswith("faults = stuck-vjoint (as in 25 of 100)") for row in rows)
    ((_, name, told, _),) = what_separates(analyse(one)).rows
    assert (name, told) == ("faults = stuck-vjoint", "more often by 100 percentage points")


def test_few_of_a_failure_are_told_by_what_separates_the_whole() -> None:
    """Of the rings that fail to deploy two have stalled: too few to tell what separates them."""
    random = np.random.default_rng(1)
    stuck = np.arange(100) % 4 == 0
    one = stalled_by(stuck, np.full(100, 293.0), random.random((100, 5)))
    one["outcome"][np.flatnonzero(stuck)[2:]] = Fate.CUT_OFF
    wanted = read_requirements({"outcome": {"is": "deployed"} | BOUND}, "file")
    found = analyse(one, wanted)
    told = dict(zip(found.worst_failure.values, found.worst_inputs.values, strict=True))
    assert set(told) == {"violates outcome is deployed", "stalled", "cut off"}
    assert all(each.startswith("faults = stuck-vjoint (as in 25 of 100)") for each in told.values())


def test_a_sample_on_the_other_side_is_not_told_by_what_separates_the_rest() -> None:
    random = np.random.default_rng(2)
    stuck, cold = np.arange(400) % 40 == 0, 225.0 + 100.0 * random.random(400)
    cold[0] = 300.0  # of the stuck ones this one is warm
    one = stalled_by(stuck, cold, random.random((400, 2)))
    one["locked_joints"][0] = 0  # and the worst of all
    first, *others = analyse(one).worst_inputs.values.tolist()
    assert "temperature" not in first
    assert "faults = stuck-vjoint (as in 10 of 400)" in first
    assert all(row.startswith("temperature") for row in others)


def test_one_of_two_values_that_separates_is_told_though_half_of_all_have_it() -> None:
    limit = np.where(np.arange(12) % 2, 50.0, 20000.0)
    one = campaign(np.where(limit < 100.0, np.nan, 5.0),
                   status=np.where(limit < 100.0, Status.DIVERGED, Status.OK),
                   outcome=np.where(limit < 100.0, Fate.NONE, Fate.DEPLOYED))  # fmt: skip
    for name, values in {"limit": limit, "noise": np.random.default_rng(5).random(12)}.items():
        one[name] = "sample", values, {"role": "input", "path": name, "units": "1"}
    rows = analyse(one).worst_inputs.values.tolist()
    assert rows
    assert all(row.startswith("limit 50 (") for row in rows)


def test_a_fault_that_was_drawn_is_told_however_common_it_is() -> None:
    one = stalled_by(np.arange(30) % 5 == 0, np.full(30, 293.0), np.zeros((30, 0)))
    first, second = unusual(one, [0, 1])
    assert first == "faults = stuck-vjoint (as in 6 of 30)"
    assert second == "nothing unusual"


def test_of_a_list_of_cases_labels_and_what_most_have_otherwise_are_told() -> None:
    one = campaign(np.arange(5.0), design={"kind": "list", "file": "cases.csv"})
    names = np.array(["nominal", "late", "stopped", "cold", "cold and late"], dtype=object)
    one["case"] = "sample", names, {"role": "label", "path": ""}
    for name, values in {"start": [0.0, 5.0, 0.0, 0.0, 5.0], "rate": np.arange(5.0)}.items():
        one[name] = "sample", np.array(values), {"role": "input", "path": name, "units": "s"}
    told = unusual(one, [0, 1, 2])
    assert told == ["nominal", "late; start = 5 s (most: 0 s)", "stopped"]
    # What is told so is not told again as unusual, nor as a drawn fault.
    jam = np.array(["none"] * 19 + ["jam"], dtype=object)
    one = campaign(np.arange(20.0), design={"kind": "list", "file": "cases.csv"})
    for name, values in {"faults": jam, "force": np.where(jam == "jam", 3.0, 1.0)}.items():
        one[name] = "sample", values, {"role": "input", "path": name, "units": "N"}
    (last,) = unusual(one, [19])
    assert last == "faults = jam (most: none); force = 3 N (most: 1 N)"


def test_a_drawn_fault_comes_before_rarer_numbers() -> None:
    random = np.random.default_rng(4)
    stuck, noise = np.arange(60) % 12 == 0, random.random((60, 5))
    noise[0] = 9.0  # the largest of each
    one = stalled_by(stuck, np.full(60, 293.0), noise)
    told, *_ = unusual(one, [0])
    assert told.startswith("faults = stuck-vjoint (as in 5 of 60); noise")


@pytest.mark.parametrize(("sense", "bound"), [(1.0, {"max": -4.0}), (-1.0, {"min": 4.0})])
def test_where_nearly_all_fail_what_goes_with_the_output_is_named(sense, bound) -> None:
    """Larger x makes it worse; a sample that is bad with a small x is not told by it."""
    random = np.random.default_rng(5)
    x = random.random(200)
    values = sense * (np.where(np.arange(200) < 3, -5.0, x))  # all but three are beyond
    values[7], x[7] = sense * 2.0, 0.3
    one = campaign(values)
    for name, column in ("x", x), ("y", random.random(200)):
        one[name] = "sample", column, {"role": "input", "path": name, "units": "m"}
    wanted = read_requirements({"asynchrony_max": bound | BOUND}, "file")
    found = worst(one, wanted, influence(one, wanted, placement(one)))
    first, *others = found.worst_inputs.values.tolist()
    assert found.worst_sample.values[0] == 7
    assert "x " not in first
    assert len(others) == 2
    assert all(each.startswith("x ") for each in others)


def test_analysis_and_accessor_tell_the_same_and_how_to_run_them() -> None:
    one = made_campaign(8, failed=(2,), stalled=(4,))
    table, known = one.ring.worst(), analyse(one)
    assert isinstance(table, pd.DataFrame)
    assert table["sample"].tolist() == known.worst_sample.values.tolist()
    assert table["found"].tolist() == known.worst_found.values.tolist()
    assert table["replay"][0] == "ringsim replay runs/made 7"
    lines = told(known, "here/my runs")
    at = lines.index(worst_lines(known, "here/my runs")[0])
    assert lines[at] == "worst of: violates asynchrony_max <= 3 deg (5 of 8 samples)"
    assert lines[at + 3] == "    ringsim replay 'here/my runs' 7"
    one.attrs["requirements"] = json.dumps({})
    assert len(made_campaign(3, kind="grid").assign_attrs(requirements="{}").ring.worst()) == 0
