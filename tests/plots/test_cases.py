"""Samples that stand for no population are drawn one by one: no median, no quantile, no word."""

from __future__ import annotations

import functools
import json

import numpy as np
import pytest
import xarray as xr
from made_campaign import SECTIONS, TIMES, lags, made_campaign, with_motors
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from ringsim.analysis.study import analyse
from ringsim.plots.campaign.courses import fan, lag_map
from ringsim.plots.campaign.endings import base_load, margin, motors
from ringsim.plots.campaign.frame import moves
from ringsim.plots.figures import figures_of
from ringsim.report.player import player

AVERAGES = ("median", "quantile", "5-95", "0-100", "Bands", "correlation")


def single_changes(samples: int) -> xr.Dataset:
    """Sample 0 is the base case, sample k changes the pulley's friction; the last one stalls."""
    found = with_motors(made_campaign(samples, stalled=(samples - 1,)))
    found.attrs["design"] = json.dumps({"kind": "one-at-a-time"})
    found["rods_young_modulus"][:] = 1e11
    found["rods_young_modulus"][1:] = 1e11 + 1e9 * np.arange(1, samples)
    found["cables_upper_friction_coefficient"][:] = 1.0
    found["cables_lower_winch_stop_time"][:] = "none"
    rates = np.arange(samples)[:, None, None] + np.ones((1, 2, SECTIONS))
    told = {"long_name": "opening rate at the latch", "units": "rad/s"}
    return found.assign(latch_rate=(("sample", "plane", "section"), rates, told))


def words(figure: Figure) -> str:
    every = figure.findobj(Text)
    return " ".join(" ".join(each.get_text() for each in every).split())


@functools.cache
def told(kind: str, samples: int) -> dict[str, str]:
    """What all figures say, by their names."""
    campaign = single_changes(samples)
    campaign.attrs["design"] = json.dumps({"kind": kind})
    return {each.name: words(figure) for each, figure in figures_of(campaign)}


def lines_of(axes: Axes) -> list[np.ndarray]:
    """Values of the lines that are curves, without limits and zeros."""
    return [each.get_ydata() for each in axes.lines if len(each.get_xdata()) > 2]


@pytest.mark.parametrize(
    ("kind", "samples"),
    [
        ("one-at-a-time", 12),
        ("one-at-a-time", 5),
        ("grid", 5),
        pytest.param("list", 5, marks=pytest.mark.slow),
    ],
)
def test_no_figure_tells_an_average_of_cases(kind: str, samples: int) -> None:
    drawn = dict(told(kind, samples))
    assert {"fan", "lag_map", "margin", "motors", "base", "latch_rate", "tension"} <= drawn.keys()
    drawn.pop("tornado", None)  # ranks of inputs need no population
    for name, text in drawn.items():
        assert not [each for each in AVERAGES if each in text], name
    heavy = "the heavy one the base case" in drawn["motors"]
    assert heavy == (kind == "one-at-a-time")


def test_the_fan_is_of_all_cases() -> None:
    campaign = single_changes(5)
    figure, share = fan(campaign), TIMES / TIMES[-1]
    axes = figure.axes[0]
    assert not axes.collections
    cases = [each for each in axes.lines if not each.get_label().startswith("_")]
    assert [each.get_label() for each in cases] == [
        "base case (deployed)",
        *(f"young_modulus {1e11 + 1e9 * k:.4g} (deployed)" for k in (1, 2, 3)),
        "young_modulus 1.04e+11 (stalled)",
    ]
    for k, line in enumerate(cases):
        wanted = 4.0 * lags(k)[0, 0] * (share * (1.0 - share))
        np.testing.assert_allclose(line.get_ydata(), wanted, atol=1e-5)
    widths = [each.get_linewidth() for each in cases]
    assert widths[0] > 1.5 * max(widths[1:])
    assert len({each.get_color() for each in cases}) == 5
    assert [axes.get_ylabel() for axes in figure.axes[::SECTIONS]] == [
        "upper\nplane",
        "lower\nplane",
    ]


def test_many_cases_are_told_apart_by_their_ending() -> None:
    axes = fan(single_changes(12)).axes[0]
    labels = [each.get_label() for each in axes.lines if not each.get_label().startswith("_")]
    assert labels == ["base case (deployed)", *["deployed (11)"] * 10, "stalled (1)"]


def test_of_very_many_cases_some_are_drawn_and_the_worst() -> None:
    figure = fan(single_changes(131))
    drawn = [each for each in figure.axes[0].lines if not each.get_label().startswith("_")]
    assert len(drawn) == 45  # every third of 131, and the last one, which lags most
    assert "45 of them are drawn" in words(figure)


def test_the_map_of_lags_shows_the_base_case() -> None:
    figure = lag_map(single_changes(5))
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[:2] == ["upper plane, base case", "upper plane, worst: sample 4"]
    drawn = figure.axes[0].collections[0].get_array()
    share = TIMES / TIMES[-1]
    np.testing.assert_allclose(drawn, 4.0 * lags(0)[0][:, None] * share * (1.0 - share), atol=1e-5)


def test_courses_by_ending_are_those_of_the_cases() -> None:
    campaign = single_changes(5)
    torque, _, *_ = motors(campaign).axes
    assert [each.max() for each in map(np.nan_to_num, lines_of(torque))] == pytest.approx(
        1e-3 * np.arange(1.0, 6.0)
    )
    force = base_load(campaign).axes[0]
    assert [each[0] for each in lines_of(force)] == pytest.approx([3.0, 4.0, 5.0, 6.0, 7.0])
    course = margin(campaign).axes[1]
    assert [each[0] for each in lines_of(course)] == pytest.approx([-0.5, -0.4, -0.3, -0.2, -0.1])


@pytest.mark.usefixtures("settled")
def test_the_legend_of_cases_stays_on_the_sheet() -> None:
    campaign = single_changes(8)
    assert moves(campaign)[0][0] == "base"
    for _, figure in figures_of(campaign):
        figure.draw_without_rendering()
        for legend in figure.legends:
            box = legend.get_window_extent()
            assert 0 <= box.x0 < box.x1 <= figure.bbox.width


def test_the_player_offers_the_base_case() -> None:
    campaign = single_changes(5)
    held = player(campaign, analyse(campaign))
    assert held is not None
    names = [each["name"] for each in held["samples"]]
    assert names[0].startswith("sample 0: base case")
    assert not [each for each in names if "median" in each]


def test_angles_have_one_unit_in_all_figures() -> None:
    many = {each.name: words(one) for each, one in figures_of(with_motors(made_campaign(8)))}
    for one in (told("one-at-a-time", 5), many):
        assert "(deg)" in one["fan"]
        assert not [name for name, text in one.items() if "degree" in text]
