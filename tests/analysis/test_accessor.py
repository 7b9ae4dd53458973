"""``dataset.ring``: there for every dataset, and what it says is what the data say."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from made_campaign import SECTIONS, made_campaign
from matplotlib.figure import Figure
from matplotlib.text import Text
from scipy.stats import binomtest

import ringsim
from made import drawn_campaign
from ringsim.analysis import derived, study_text
from ringsim.analysis.courses import course, courses
from ringsim.plots import figures
from ringsim.plots.figures import names_for
from ringsim.refusal import InputError
from ringsim.sampling.designs.independent import RandomDesign
from ringsim.tables import Table


@pytest.fixture(scope="module")
def campaign() -> xr.Dataset:
    """Sample k lags by (1 + k / 4) from -1 to 1 over the sections; in the lower plane by half."""
    found = made_campaign(9, failed=(2,), stalled=(4, 5), not_run=(8,))
    for who, section in (("leader", SECTIONS), ("laggard", 1)):
        planes = np.full(9, "upper", dtype=object)
        planes[[2, 8]] = ""
        found[f"asynchrony_{who}_plane"] = ("sample", planes)
        numbers = np.where(planes == "upper", float(section), -1.0)
        numbers[3] = 2.0
        found[f"asynchrony_{who}_section"] = ("sample", numbers)
    return found


@pytest.mark.parametrize(
    "order",
    [
        "import ringsim, xarray; ringsim.InputError",
        *(
            pytest.param(order, marks=pytest.mark.slow)
            for order in (
                "import xarray, ringsim", "import ringsim.accessor, xarray, ringsim",
                "import ringsim; ringsim.simulate; import xarray",
            )
        ),
        "import xarray; xarray.open_dataset(FILE); import ringsim",
        "import ringsim, xarray; xarray.open_dataset(FILE, engine='ringsim')",
    ],
)  # fmt: skip
def test_every_dataset_has_it(order: str, tmp_path: Path) -> None:
    """Whoever comes first, and without loading anything but xarray."""
    xr.Dataset({"a": 1}).to_netcdf(tmp_path / "any.nc", engine="netcdf4")
    code = (
        f"FILE = {str(tmp_path / 'any.nc')!r}\n{order}\nimport sys\n"
        "print(type(xarray.Dataset().ring).__name__, 'scipy' in sys.modules)\n"
        "import importlib; importlib.reload(ringsim)"
    )
    done = subprocess.run([sys.executable, "-W", "error", "-c", code], capture_output=True,
                          text=True, check=True)  # fmt: skip
    assert done.stdout.split() == ["Ring", "False"]


def test_outcomes_are_counted_with_exact_intervals(campaign: xr.Dataset) -> None:
    table = campaign.ring.outcomes()
    assert table["samples"].to_dict() == {"deployed": 5, "stalled": 2, "failed: timeout": 1}
    assert table["lost"].to_dict() == {"deployed": 1, "stalled": 1, "failed: timeout": 0}
    for kind, row in table.iterrows():
        assert row["of"] == 8
        least, most = int(row["samples"]), int(row["samples"] + row["lost"])
        low = binomtest(least, 8).proportion_ci(0.95, "exact").low
        high = binomtest(most, 8).proportion_ci(0.95, "exact").high
        assert (row["lower"], row["upper"]) == pytest.approx((low, high)), kind
        assert row["share"] == row["samples"] / row["of"]


def test_a_fan_is_of_the_samples_that_count(campaign: xr.Dataset) -> None:
    found = campaign.ring.fan()
    assert found.dims == ("quantile", "plane", "section", "time")
    assert found.attrs["units"] == "degree"
    known = courses(campaign)
    assert known.samples.tolist() == [0, 1, 3, 4, 5, 6, 7]
    each = [course(campaign, sample, found) for sample in known.samples]
    np.testing.assert_allclose(found.sel(quantile=0.5), np.median(each, axis=0), atol=1e-5)
    np.testing.assert_allclose(found.sel(quantile=1.0), np.max(each, axis=0), atol=1e-5)
    # Half-way through, 4 * 1/4 * (1 + k / 4) degree at the last section: sample 5 is the fourth.
    middle = found.sel(plane="upper", section=SECTIONS, quantile=0.5).sel(time=5.0)
    assert float(middle) == pytest.approx(1.0 + 4 / 4, abs=1e-3)


def test_who_leads_and_lags_how_often(campaign: xr.Dataset) -> None:
    found = campaign.ring.leader()
    assert found.attrs == {"samples": 7, "of": 9}
    for word, section in (("leads", SECTIONS), ("lags", 1)):
        assert int(found[word].sum()) == 7
        assert int(found[word].sel(plane="upper", section=section)) == 6
        assert int(found[word].sel(plane="upper", section=2)) == 1


def test_who_leads_and_lags_when(campaign: xr.Dataset) -> None:
    run = campaign.isel(sample=2)  # it broke at 4 s
    found = run.drop_vars("sample").ring.leader()
    moving = found.sel(time=slice(0.5, 4.0))
    assert set(moving["leader"].to_numpy()) == {f"upper {SECTIONS}"}
    assert set(moving["laggard"].to_numpy()) == {"upper 1"}
    np.testing.assert_allclose(found["asynchrony"], run["asynchrony"], atol=1e-9)
    assert set(found["leader"].sel(time=slice(4.1, None)).to_numpy()) == {""}


@pytest.mark.parametrize("ask", ["outcomes", "fan"])
def test_of_a_run_there_are_no_shares(ask: str, campaign: xr.Dataset) -> None:
    with pytest.raises(InputError, match="only a campaign has them"):
        getattr(campaign.isel(sample=0, drop=True).ring, ask)()


def test_what_was_left_out_is_refused(campaign: xr.Dataset) -> None:
    with pytest.raises(InputError, match="opening_angle, which this campaign has left out"):
        campaign.drop_vars("opening_angle").ring.fan()
    with pytest.raises(InputError, match="asynchrony_leader_plane, which this campaign"):
        campaign.drop_vars("asynchrony_leader_plane").ring.leader()
    with pytest.raises(InputError, match="opening_angle, which this dataset"):
        xr.Dataset().ring.leader()
    assert "Campaign" in dir(ringsim)


def test_figures_are_methods_and_notebooks_show_them(
    campaign: xr.Dataset, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three of them: all are drawn in tests/plots."""
    few = [
        p for p in figures.PICTURES if p.name in ("distributions", "lock_order", "opening_angles")
    ]
    monkeypatch.setattr(figures, "PICTURES", few)
    figure = campaign.ring.plot("lock_order")
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert pickle.loads(pickle.dumps(figure))._repr_png_()
    every = campaign.ring.plot()
    assert list(every) == names_for(campaign)
    assert repr(every).startswith("figures: distributions, ")
    assert every._repr_html_().count("<p>") == len(every)
    run = campaign.isel(sample=0, drop=True)
    assert "opening_angles" in run.ring.plot()
    with pytest.raises(InputError, match=r"no such figure \(did you mean lock_order"):
        campaign.ring.plot("lock_orders")
    with pytest.raises(InputError, match="no such figure"):
        campaign.drop_vars("lock_time").ring.plot("lock_order")


def test_notebooks_show_what_a_dataset_can_be_asked(campaign: xr.Dataset) -> None:
    text = campaign.ring._repr_html_()
    assert text.startswith("<p>ring of a campaign</p>")
    assert text.count("<tr>") == repr(campaign.ring).count("()")
    assert "Which V-joint is most open and which least." in text


def test_who_leads_is_refused_of_a_campaign_without_records() -> None:
    """As where all runs have failed."""
    made = made_campaign(3).drop_dims("plane")
    with pytest.raises(InputError, match="leader: needs plane"):
        made.ring.leader()


def test_no_table_takes_the_place_of_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """With everything that there is to tell: all have a name of their own, and the numbers."""
    made = drawn_campaign(RandomDesign(samples=200), lambda x: x[:, 0], 1, 5)
    law = {"kind": "uniform", "low": 0.0, "high": 0.9}
    analysis = ringsim.analyse(made, reweighted={"x1": law})
    for full in (False, True):
        found = analysis.ring.tables(full=full)
        parts = study_text.sections(analysis, "x", full=full).values()
        every = [table for each in parts for table in each.more or each.tables if table.rows]
        assert [rows.to_numpy().tolist() for rows in found.values()] == [
            [list(row) for row in table.rows] for table in every
        ]
        (row,) = found["output"].to_numpy().tolist()
        assert float(row[list(found["output"]).index("mean")]) == pytest.approx(
            made["asynchrony_max"].mean().item(), abs=5e-3
        )
        kept = made["asynchrony_max"].values[made["x1"].values < 0.9]
        told = found["output, reweighted"].set_index("statistic").loc["mean", "reweighted"]
        assert float(told) == pytest.approx(kept.mean(), abs=5e-3)
    alike = study_text.Section(
        "a", "A", [Table(("output",), [("x",)]), Table(("output",), [("y",)])]
    )
    monkeypatch.setattr(study_text, "sections", lambda *_, **__: {"a": alike})
    assert list(analysis.ring.tables()) == ["output", "output (2)"]


def test_a_stored_analysis_has_the_tables_of_a_new_one(tmp_path: Path) -> None:
    """Also where its numbers are 1, of which texts have no plural."""
    for made in (made_campaign(1), made_campaign(6, failed=(1,), not_run=(5,))):
        analysis = ringsim.analyse(made)
        analysis.to_netcdf(tmp_path / "a.nc")
        with xr.open_dataset(tmp_path / "a.nc") as stored:
            found = stored.ring.tables(full=True)
        expected = analysis.ring.tables(full=True)
        assert list(found) == list(expected)
        for name, rows in expected.items():
            again = {"run it again"} & set(rows)  # in the folder of the file
            assert rows.drop(columns=again).equals(found[name].drop(columns=again))
            assert rows.attrs == found[name].attrs


@pytest.fixture(scope="module")
def cases() -> xr.Dataset:
    """Single changes, of which samples 1 and 4 have the largest numbers."""
    found = made_campaign(6, kind="one-at-a-time").assign_attrs(design='{"kind": "one-at-a-time"}')
    young, friction = found["rods_young_modulus"], found["cables_upper_friction_coefficient"]
    young[:] = [1e11, 2e11, 3e11, 1e11, 1e11, 1e11]
    friction[:] = np.ones((6, 3)) + np.array([0, 0, 0, 1, 2, 3])[:, None]
    found["cables_lower_winch_stop_time"][:] = "none"
    return found


def marks(figure: Figure) -> list[object]:
    """Places and heights of all marks, and the names below."""
    drawn = [np.asarray(c.get_offsets()).tolist() for ax in figure.axes for c in ax.collections]
    return [drawn, [text.get_text() for text in figure.axes[-1].get_xticklabels()]]


@pytest.mark.parametrize("order", [[0, 3, 1, 2, 4, 5], [5, 4, 3, 2, 1, 0]])
def test_samples_may_come_in_any_order(order: list[int], cases: xr.Dataset) -> None:
    other = cases.isel(sample=order)
    assert marks(other.ring.plot("one_by_one")) == marks(cases.ring.plot("one_by_one"))
    found, expected = other.ring.tables(), cases.ring.tables()
    assert list(found) == list(expected)
    for name, rows in expected.items():
        assert found[name].equals(rows)
    assert other.ring.worst().equals(cases.ring.worst())
    xr.testing.assert_equal(other.ring.fan(), cases.ring.fan())
    assert ringsim.analyse(other).equals(ringsim.analyse(cases))


def test_without_its_sample_nothing_is_the_base_case(cases: xr.Dataset) -> None:
    part = cases.isel(sample=slice(2, None))
    assert "one_by_one" not in part.ring.plot()
    for each, there in ((part, False), (cases, True)):
        every = [*each.ring.tables().values(), *each.ring.dossier().values(), each.ring.worst()]
        text = " ".join(rows.to_string() for rows in every)
        assert ("the base case" in text) == there
        assert ("(base: " in text) == there


@pytest.mark.parametrize(
    ("selected", "told"),
    [
        ({"sample": []}, "no sample is left"),
        ({"section": slice(0, 2)}, "section is only 1, 2 in this selection, and must be each"),
        ({"section": 0}, "section is only 1 in"),
        ({"plane": 0}, "plane is only upper in"),
        ({"plane": [1]}, "plane is only lower in"),
        ({"span": slice(2, 5)}, "span is only 3, 4, 5 in"),
        ({"time": 3}, "time is only 1.5 in .*must be a dimension"),
        ({"sample": [0, 1, 1, 2]}, "sample = 1 is twice in this selection: select each once"),
        ({"time": [0, 1, 1]}, "time = .* is twice"),
        ({"section": [0, 0, 1, 2, 3]}, "section = 1 is twice"),
    ],
)
def test_selections_are_refused_that_lack_a_part_of_the_ring(
    selected: dict[str, object], told: str, campaign: xr.Dataset
) -> None:
    part = campaign.isel(selected)
    for ask in ("leader", "tables", "dossier", "worst", "fan", "plot"):
        with pytest.raises(InputError, match=told):
            getattr(part.ring, ask)()
    if "sample" not in selected:
        for ask in ("leader", "plot"):
            with pytest.raises(InputError, match=told):
                getattr(part.isel(sample=0, drop=True).ring, ask)()


def test_dimensions_may_come_in_any_order(campaign: xr.Dataset) -> None:
    """What is told and drawn goes by their places, which a transposed dataset has otherwise."""
    turned = campaign.transpose()
    assert turned["opening_angle"].dims[0] == "time"
    for name, rows in campaign.ring.tables().items():
        assert turned.ring.tables()[name].equals(rows)
    xr.testing.assert_equal(turned.ring.fan(), campaign.ring.fan())
    for whole, other in ((campaign, turned), (campaign.isel(sample=3), turned.isel(sample=3))):
        figures = whole.ring.plot(), other.ring.plot()
        assert len(figures[0]) == len(figures[1]) > 0


def test_planes_and_sections_may_be_turned(campaign: xr.Dataset) -> None:
    turned = campaign.isel(section=slice(None, None, -1), plane=[1, 0])
    xr.testing.assert_equal(turned.ring.fan(), campaign.ring.fan())
    xr.testing.assert_equal(turned.ring.leader(), campaign.ring.leader())
    run, other = (each.isel(sample=3, drop=True) for each in (campaign, turned))
    drawn = [
        [(line.get_label(), np.asarray(line.get_ydata()).tolist()) for line in axes.lines]
        for each in (run, other) for axes in each.ring.plot("nodal_forces").axes
    ]  # fmt: skip
    half = len(drawn) // 2
    assert drawn[:half] == drawn[half:]
    assert any(drawn)


def test_each_of_two_campaigns_has_outputs_of_its_own() -> None:
    """One has apart in s and up to 1.9, the other in degree without a bound."""
    made = []
    for of, unit in (("max(lock_time)", "s"), ("max(opening_angle)", "degree")):
        one = made_campaign(4)
        one["apart"] = "sample", np.linspace(0.5, 2.0, 4), {"units": unit}
        required = {"apart": {"max": 1.9, "probability": 0.5, "confidence": 0.9}}
        one.attrs |= {"outputs": json.dumps({"apart": {"of": of}}),
                      "requirements": json.dumps(required)}  # fmt: skip
        made.append(one)
    try:
        first, second = (each.ring for each in made)
        for each, unit in ((first, "s"), (second, "deg"), (first, "s")):
            told = each.worst()["found"].tolist()
            assert f"2 {unit}" in told
            drawn = " ".join(text.get_text() for text in each.plot("distributions").findobj(Text))
            assert f"max 1.9 {unit}" in drawn
    finally:
        derived.forget(derived.declared())
