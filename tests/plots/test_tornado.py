"""The tornado shows the indices that the design allows, with their intervals, or says why not."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from made_campaign import made_campaign
from matplotlib.figure import Figure

from ringsim.analysis.design import placement
from ringsim.analysis.influence_text import what_matters
from ringsim.analysis.sensitivity import sensitivity
from ringsim.analysis.study import analyse
from ringsim.plots.campaign.frame import ALL_ALIKE, in_lines
from ringsim.plots.campaign.numbers import distributions
from ringsim.plots.campaign.tornado import bars_of, explained, tornado
from ringsim.sampling.designs.blocks import Morris, Saltelli
from ringsim.sampling.designs.independent import RandomDesign
from ringsim.sampling.distributions import Uniform
from ringsim.variables import Fate, Status

FACTORS = dict.fromkeys(("force", "modulus"), Uniform(low=0.0, high=1.0))


def made(design, lost=None) -> xr.Dataset:
    """Peak tension of two inputs; samples beyond ``lost`` of the modulus have none."""
    points = design.points(FACTORS, 1)
    few = made_campaign(2)
    gone = np.zeros(len(points), bool) if lost is None else points[:, 1] > lost
    tension = 20 + 3 * points[:, 0] + points[:, 1] ** 2
    found = xr.Dataset(
        {
            "status": ("sample", np.where(gone, Status.TIMEOUT, Status.OK).astype("i1")),
            "peak_tension": ("sample", np.where(gone, np.nan, tension), few.peak_tension.attrs),
        },
        coords={"sample": np.arange(len(points))},
        attrs=few.attrs | {"design": json.dumps(json.loads(design.model_dump_json()))},
    )
    for path, column in zip(FACTORS, points.T, strict=True):
        found[path] = "sample", column, {"role": "input", "path": path}
    if hasattr(design, "rows"):
        found["block_row"] = "sample", np.array(design.rows(FACTORS, 1)), {"role": "label"}
    return found


def widths(figure: Figure) -> list[list[float]]:
    """Lengths of the bars of the first panel, by row of bars."""
    return [[patch.get_width() for patch in bars] for bars in figure.axes[0].containers
            if hasattr(bars, "patches")]  # fmt: skip


@pytest.mark.parametrize(
    ("design", "measure"),
    [
        (Saltelli(samples=64), "total_index"),
        (Morris(samples=20), "mean_absolute_effect"),
        (RandomDesign(samples=200), "given_data_index"),
    ],
)
def test_bars_are_the_indices_of_the_analysis(design, measure) -> None:
    campaign = made(design)
    known = sensitivity(campaign, {}, placement(campaign)).sel(output="peak_tension")
    figure = tornado(campaign)
    longest = np.sort(known[measure].values)[::-1]
    np.testing.assert_allclose(widths(figure)[0], longest)
    names = [tick.get_text() for tick in figure.axes[0].get_yticklabels()]
    assert names == ["force", "modulus"]
    assert len(widths(figure)) == (1 if measure == "mean_absolute_effect" else 2)
    (whiskers, *_) = [line for line in figure.axes[0].collections if len(line.get_segments())]
    ends = known[f"{measure}_interval"].values[np.argsort(-known[measure].values)]
    drawn = [segment[:, 0] for segment in whiskers.get_segments()]
    np.testing.assert_allclose(drawn, ends)
    assert "used, 0 left out" in figure.axes[0].get_xlabel()


def test_few_plain_samples_have_correlations() -> None:
    campaign = made(RandomDesign(samples=20))
    figure = tornado(campaign)
    assert figure.axes[0].get_xlabel() == "Partial rank correlation\nsamples: 20"
    assert not explained(made(RandomDesign(samples=5)))


def test_what_chance_would_explain_has_no_bar() -> None:
    campaign = made(RandomDesign(samples=30))
    tension = 3.0 * campaign["force"].values + 1e-3 * campaign["modulus"].values
    campaign["peak_tension"] = "sample", tension
    ((_, bars),) = bars_of(campaign)
    assert bars.names == ["force"]
    # Of two inputs, one held, in 30 samples: t of 27 degrees of freedom beyond 1.27 % a side.
    held = 2.3676
    assert bars.chance == pytest.approx(held / np.hypot(27**0.5, held), abs=1e-3)
    campaign["peak_tension"] = "sample", np.random.default_rng(5).random(30)
    ((_, bars),) = bars_of(campaign)
    assert not bars.names
    told = " ".join(each.get_title().get_text() for each in tornado(campaign).legends)
    told += tornado(campaign).get_supxlabel()
    assert "No significant input for peak_tension" in " ".join(told.split())


def test_bars_stand_in_the_order_of_the_table() -> None:
    """Behind the input with an index those with a correlation, the stronger first."""
    campaign = made(RandomDesign(samples=60)).assign_attrs(requirements="{}")
    stream = np.random.default_rng(11)
    weak = {name: stream.random(60) for name in ("damping", "friction", "delay")}
    for name, values in weak.items():
        campaign[name] = "sample", values, {"role": "input", "path": name}
    force = campaign["force"].values
    mixed = 0.12 * weak["damping"] + 0.2 * weak["friction"] + 0.09 * weak["delay"]
    campaign["peak_tension"][:] = 20.0 + 3.0 * force + mixed
    (bars,) = (each for name, each in bars_of(campaign) if name == "peak_tension")
    rows = what_matters(analyse(campaign)).rows
    assert bars.names[:3] == [row[1] for row in rows[:3]] == ["force", "friction", "damping"]
    assert bars.inside.tolist() == sorted(bars.inside.tolist(), reverse=True)
    sizes = np.abs(bars.values).tolist()
    assert sizes != sorted(sizes, reverse=True)  # the order of indices would be another one


def test_what_all_samples_have_in_common_needs_no_word() -> None:
    campaign = made_campaign(30)
    about = {"probability": 0.9, "confidence": 0.9}
    campaign["outcome"][:] = int(Fate.DEPLOYED)
    campaign["deployment_time"] = 30.0 + 1e-5 * campaign["rods_young_modulus"] / 1e11
    wanted = {"outcome": about | {"is": "deployed"}, "deployment_time": about | {"max": 40.0}}
    campaign["deployment_time_error"] = "sample", np.full(30, 0.5), {"units": "s"}
    campaign.attrs["requirements"] = json.dumps(wanted)
    (legend,) = tornado(campaign).legends
    told = " ".join(legend.get_title().get_text().split())
    assert f"Not drawn, because {ALL_ALIKE}: deployment_time." in told
    assert "outcome" not in told


def test_a_shut_gate_is_told_with_what_is_known_beside_it() -> None:
    campaign = made(Saltelli(samples=64), lost=0.9)
    figure = tornado(campaign)
    assert "no index: " in figure.axes[0].get_xlabel()
    assert "depends on inputs" in figure.axes[0].get_xlabel()
    outputs = dict(bars_of(campaign))
    assert outputs["peak_tension"].measure == "partial_rank_correlation"
    assert outputs["failed runs"].measure == "total_index"
    assert outputs["failed runs"].names[0] == "modulus"
    assert "left out: " in figure.legends[0].get_title().get_text()


def test_what_has_no_interval_is_told_and_measures_differ_in_colour() -> None:
    campaign = made(RandomDesign(samples=60))
    # A perfect correlation has no known error; where an input decides there is no index.
    campaign["deployment_time"] = campaign["force"].where(campaign["force"] < 0.7)
    campaign["deployment_time"].attrs = {"long_name": "time of deployment", "units": "s"}
    measures = [bars.measure for _, bars in bars_of(campaign)]
    assert measures == ["rank_correlation", "given_data_index"]
    figure = tornado(campaign)
    told = " ".join(figure.legends[0].get_title().get_text().split())
    assert "Bars without whiskers: interval not known" in told
    colours = {axes.patches[0].get_facecolor() for axes in figure.axes}
    assert len(colours) == 2
    whole = tornado(made(RandomDesign(samples=60)))
    assert "Bars without" not in whole.get_supxlabel() + "".join(
        each.get_title().get_text() for each in whole.legends
    )


def test_long_paths_are_broken_between_their_parts() -> None:
    winding = "cables.upper.winch.winding."
    assert in_lines(f"{winding}derating") == f"{winding}\nderating"
    place = "cables.upper.friction.coefficient[section 1 first hinge]"
    assert in_lines(place) == place.replace("[", "\n[")


def test_each_main_number_has_the_measure_that_it_allows_and_no_panel_is_empty() -> None:
    campaign = made(RandomDesign(samples=16))
    # Known where the first input is small alone, where the second one is all alike.
    short = campaign["force"] > 0.6
    campaign["modulus"][:] = np.where(short, campaign["modulus"], 0.5)
    told = {"long_name": "time of deployment", "units": "s"}
    campaign["deployment_time"] = (30.0 + campaign["force"]).where(~short).assign_attrs(told)
    campaign["final_time"] = campaign["peak_tension"] * 0.0 + 5.0
    campaign["peak_tension_time"] = campaign["force"] ** 2
    found = dict(bars_of(campaign))
    assert {name: bars.measure for name, bars in found.items()} == {
        "deployment_time": "rank_correlation", "peak_tension": "partial_rank_correlation",
    }  # fmt: skip
    assert found["deployment_time"].names == ["force"]
    assert found["deployment_time"].values.tolist() == [pytest.approx(1.0)]
    assert all(len(axes.patches) for axes in tornado(campaign).axes)


def test_what_differs_by_less_than_its_numerical_error_has_no_sheet() -> None:
    one = made(RandomDesign(samples=200))
    assert explained(one)
    one["peak_tension_error"] = "sample", np.full(200, 5.0), {"units": "N"}
    assert not explained(one)
    assert [*bars_of(one)] == []


def test_what_has_no_panel_for_want_of_differences_has_no_bars() -> None:
    """As distributions, which leave it out by the same rule and with the same words."""
    campaign = made(RandomDesign(samples=200))
    said = {"long_name": "power of a motor", "units": "W"}
    campaign["peak_motor_power"] = 3.0 - 1e-3 * campaign["force"].assign_attrs(said)
    for figure in (tornado(campaign), distributions(campaign)):
        titles = [axes.get_title(loc="left") + axes.get_xlabel() for axes in figure.axes]
        assert not any("Power of a motor" in title for title in titles)
        below = figure.get_supxlabel() + "".join(
            each.get_title().get_text() for each in figure.legends
        )
        assert f"Not drawn, because {ALL_ALIKE}: peak_motor_power." in " ".join(below.split())
    assert "peak_motor_power" in dict(bars_of(campaign))
    limit = {"peak_motor_power": {"max": 4.0, "probability": 0.9, "confidence": 0.9}}
    campaign.attrs["requirements"] = json.dumps(limit)
    assert any("Power" in axes.get_title(loc="left") for axes in tornado(campaign).axes)


def test_what_has_no_partial_correlation_has_its_plain_one_beside_the_index() -> None:
    """One of more places than samples: it is significant by its rank correlation."""
    campaign = made_campaign(40)
    stream = np.random.default_rng(2)
    friction = stream.random((40, 60))
    about = campaign["cables_upper_friction_coefficient"].attrs
    campaign = campaign.drop_vars("cables_upper_friction_coefficient")
    campaign["cables_upper_friction_coefficient"] = ("sample", "pulley"), friction, about
    campaign["rods_young_modulus"][:] = modulus = stream.random(40)
    campaign["cables_lower_winch_stop_time"][:] = ["none"] * 40
    campaign["peak_tension"][:] = 10.0 + 2.0 * modulus + 2.0 * friction[:, 0]
    bars = dict(bars_of(campaign))["peak_tension"]
    assert bars.measure == "given_data_index"
    alone = np.isnan(bars.inside)
    assert alone.tolist() == np.isfinite(bars.plain).tolist()
    assert alone.any()
    assert not alone.all()
    assert np.isnan(bars.plain_ends[~alone]).all()
    (place,) = np.flatnonzero(alone)
    ranks = [np.argsort(np.argsort(x)) for x in (friction[:, 0], campaign["peak_tension"].values)]
    assert bars.plain[place] == pytest.approx(np.corrcoef(*ranks)[0, 1])
    figure = tornado(campaign)
    (axes,) = (a for a in figure.axes if a.get_title(loc="left").startswith("Largest tension"))
    (drawn,) = (c for c in axes.containers if c.get_label() == "rank correlation")
    assert drawn.patches[place].get_width() == pytest.approx(bars.plain[place])
    assert max(map(len, axes.get_xlabel().split("\n"))) <= 48  # no wider than its panel
    assert " ".join(axes.get_xlabel().split()).startswith(
        "First-order index, and partial rank correlation or rank correlation"
    )


@pytest.mark.usefixtures("settled")
def test_rows_are_as_high_as_their_bars_and_tell_once_what_is_alike() -> None:
    """Of three panels two have one bar and one has two: bars are of one height on paper."""
    design = RandomDesign(samples=200)
    campaign = made(design)
    force, modulus = (campaign[name].values for name in FACTORS)
    campaign["deployment_time"] = "sample", 30.0 + force
    campaign["peak_rod_stress"] = "sample", 2.0 + modulus
    figure = tornado(campaign)
    figure.draw_without_rendering()
    drawn = [axes for axes in figure.axes if axes.get_visible()]
    assert sorted(len(axes.get_yticks()) for axes in drawn) == [1, 1, 2]
    sizes = [axes.patches[0].get_window_extent().height for axes in drawn]
    assert sizes == pytest.approx([sizes[0]] * 3, rel=0.02)
    assert not any("used" in axes.get_xlabel() for axes in drawn)
    told = " ".join(figure.legends[0].get_title().get_text().split())
    assert "Samples: 200 used, 0 left out in each panel." in told
