"""Courses of the samples of a campaign, in the fan and in the map of lags."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from made_campaign import SECTIONS, TIMES, lags, made_campaign, with_motors
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ringsim.analysis import courses as blocks_module
from ringsim.analysis import courses as courses_module
from ringsim.analysis.comparison import compare
from ringsim.analysis.courses import course, courses
from ringsim.analysis.design import median_and_worst
from ringsim.plots.campaign.courses import fan, lag_map
from ringsim.plots.campaign.endings import base_load, motors
from ringsim.plots.campaign.frame import shown_until
from ringsim.plots.comparison import figures_of_both

GOOD = [0, 1, 3, 4, 6]


@pytest.fixture(scope="module")
def mixed() -> xr.Dataset:
    return made_campaign(8, failed=(2, 5), not_run=(7,))


def legend_of(figure: Figure) -> str:
    return " ".join(text.get_text() for each in figure.legends for text in each.get_texts())


def caption(figure: Figure) -> str:
    below = [figure.get_supxlabel(), *(each.get_title().get_text() for each in figure.legends)]
    return " ".join(" ".join(below).split())


def deviation(campaign: xr.Dataset) -> np.ndarray:
    """By numpy alone, of the samples that count; every run ends at the last record."""
    angle = campaign["opening_angle"].transpose("sample", "plane", "section", "time").values[GOOD]
    return angle - angle.mean(axis=(1, 2), keepdims=True)


@pytest.mark.usefixtures("settled")
def test_the_fan_shows_the_range_and_the_median_sample(mixed: xr.Dataset) -> None:
    figure, wanted = fan(mixed), deviation(mixed)
    assert median_and_worst(mixed) == (3, 6)
    for (plane, section), axes in zip(np.ndindex(2, SECTIONS), figure.axes, strict=True):
        (line,) = (line for line in axes.lines if line.get_label() == "median")
        np.testing.assert_allclose(line.get_xdata(), TIMES, atol=1e-12)
        expected = wanted[GOOD.index(3), plane, section]
        np.testing.assert_allclose(line.get_ydata(), expected, atol=1e-5)
        (band,) = axes.collections
        drawn_at = band.get_paths()[0].vertices[:, 1]
        assert drawn_at.min() == pytest.approx(wanted[:, plane, section].min(), abs=1e-5)
        assert drawn_at.max() == pytest.approx(wanted[:, plane, section].max(), abs=1e-5)
        (worst,) = (line for line in axes.lines if line.get_label() != "median")
        largest = np.abs(worst.get_ydata()).max()
        assert largest == pytest.approx(np.abs(lags(6)[plane, section]), abs=1e-5)
    assert legend_of(figure) == "all samples median: sample 3 worst: sample 6"
    beside = [axes.get_ylabel() for axes in figure.axes[::SECTIONS]]
    assert beside == ["upper\nplane", "lower\nplane"]
    lines = [each for each in figure.legends[0].legend_handles if isinstance(each, Line2D)]
    dashed = {each.get_label(): each.get_linestyle() for each in lines}
    assert dashed["worst: sample 6"] != dashed["median: sample 3"]
    assert figure.axes[-1].get_xlabel().startswith("Time since")
    figure.draw_without_rendering()
    box = figure.legends[0].get_window_extent()
    assert 0 <= box.x0 < box.x1 <= figure.bbox.width  # few sections make a narrow figure


def over_time(campaign: xr.Dataset, until: list[float]) -> None:
    """Section k opens by k degree a second; nothing is recorded after a sample's end."""
    slope = xr.DataArray([[1.0, 2.0, 3.0, 4.0]] * 2, dims=("plane", "section"))
    angles = (campaign.time * slope).transpose("plane", "section", "time")
    end = xr.DataArray(until, dims="sample")
    campaign["opening_angle"][:] = angles.where(campaign.time <= end).transpose(
        *campaign["opening_angle"].dims
    )


def test_what_is_over_counts_on_at_the_time_when_it_happened() -> None:
    """Rings that lock at 3.3 s and 5 s, one that stops at 8 s: records are half a second apart."""
    campaign = made_campaign(3, stalled=(2,))
    over_time(campaign, [3.3, 5.0, 8.0])
    campaign["deployment_time"][:] = [3.3, 5.0, np.nan]
    campaign["final_time"][:] = [3.4, 5.0, 8.0]
    found = courses(campaign)
    assert found.bands["time"].values.tolist() == TIMES[TIMES <= 8.0].tolist()
    last = found.bands.sel(section=4, plane="upper")
    by_hand = {  # 1.5 degree a second ahead of the mean
        3.0: [4.5, 4.5, 4.5],
        3.5: [0.0, 5.25, 5.25],
        5.0: [0.0, 7.5, 7.5],
        5.5: [0.0, 0.0, 8.25],
        8.0: [0.0, 0.0, 12.0],
    }
    for time, values in by_hand.items():
        at = last.sel(time=time)
        np.testing.assert_allclose(at.sel(quantile=[0.0, 0.5, 1.0]), values, atol=1e-5)
    # A ring that was stopped keeps what it had.
    over_time(campaign, [3.3, 5.0, 6.0])
    campaign["final_time"][2] = 6.2
    campaign["final_time"][0] = 10.0
    campaign["deployment_time"][0] = np.nan
    stopped = courses(campaign).bands.sel(section=4, plane="lower", time=6.5)
    np.testing.assert_allclose(stopped.sel(quantile=[0.0, 0.5, 1.0]), [0.0, 4.5, 9.0], atol=1e-5)


def test_a_record_that_is_lost_lies_on_the_line_between_its_neighbours() -> None:
    campaign = made_campaign(2)
    whole = course(campaign, 1, campaign["time"])
    campaign["opening_angle"][1, :, 2, 7:9] = np.nan
    found = course(campaign, 1, campaign["time"])
    known = np.delete(np.arange(len(TIMES)), [7, 8])
    for place in np.ndindex(2, SECTIONS):
        expected = np.interp(TIMES, TIMES[known], whole.values[place][known])
        np.testing.assert_allclose(found.values[place], expected, atol=1e-5)


def test_planes_stand_one_below_the_other_with_one_scale() -> None:
    campaign = made_campaign(5)
    campaign["opening_angle"][:, 1] = campaign["opening_angle"][:, 0]
    figure = fan(campaign)
    angle = campaign["opening_angle"].transpose("sample", "plane", "section", "time").values
    values = angle - angle.mean(axis=(1, 2), keepdims=True)
    air = 0.06 * np.ptp(values)
    wanted = values.min() - air, values.max() + air
    for section in range(SECTIONS):
        upper, lower = figure.axes[section], figure.axes[SECTIONS + section]
        assert upper.get_title(loc="left") == f"section {section + 1}"
        assert upper.get_position().x0 == lower.get_position().x0
        lines = [next(a.get_ydata() for a in axes.lines) for axes in (upper, lower)]
        np.testing.assert_allclose(*lines, atol=1e-6)
        for axes in (upper, lower):
            assert axes.get_ylim() == pytest.approx(wanted, rel=1e-4)
            assert all(band.get_facecolor()[0, 3] <= 0.2 for band in axes.collections)


def test_the_time_in_which_things_happen_is_enlarged() -> None:
    """Sections are apart in the last 2 of 10 s alone, and once before by less than a quarter of
    that; a row above the panels has the whole run.
    """
    campaign = made_campaign(5)
    angle = campaign["opening_angle"]
    mean, late = angle.mean(("plane", "section")), campaign["time"] >= 8.0
    largest = abs((angle - mean).where(late)).max(("plane", "section", "time"))
    small = 0.2 * (angle - mean) * (largest / abs(angle - mean).max(("plane", "section", "time")))
    before = mean + small.where(campaign["time"] == 5.0, 0.0)
    campaign["opening_angle"] = angle.where(late, before).transpose(*angle.dims)
    figure = fan(campaign)
    whole, *panels = sorted(figure.axes, key=lambda axes: -axes.get_position().y1)
    assert whole.get_xlim() == (0.0, 10.0)
    apart = (angle - mean).where(late, 0.0).max(("sample", "plane", "section"))
    edges = whole.collections[0].get_paths()[0].vertices[:, 1]
    assert edges.max() == pytest.approx(float(apart.max()), rel=1e-5)
    begin, end = panels[0].get_xlim()
    assert 7.0 < begin < 8.0 < end <= 10.0
    assert {axes.get_xlim() for axes in panels} == {(begin, end)}
    assert len(panels) == 2 * SECTIONS


def test_quantiles_do_not_depend_on_how_the_file_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """A sample at a time and a point of the axis at a time, with a record lost in one sample."""
    campaign = made_campaign(9, failed=(2,), not_run=(5,))
    campaign["opening_angle"][3, :, 1, 4] = np.nan
    campaign["opening_angle"][4, :, :, 1:] = np.nan  # one record is no course
    whole = courses(campaign)
    monkeypatch.setattr(blocks_module, "BLOCK_BYTES", 1)
    monkeypatch.setattr(courses_module, "_PASSES", 1000)
    monkeypatch.setattr(courses_module, "HELD_BYTES", 4 * 8 * 8)
    parts = courses(campaign)
    xr.testing.assert_allclose(whole.bands, parts.bands, rtol=0.0, atol=1e-6)  # sums of floats
    assert whole.samples.tolist() == parts.samples.tolist() == [0, 1, 3, 6, 7, 8]
    single = [course(campaign, k, whole.bands) for k in parts.samples]
    expected = np.quantile(np.array(single), (0.0, 0.05, 0.5, 0.95, 1.0), axis=0)
    np.testing.assert_allclose(parts.bands, expected, atol=1e-5)


def late_in_turn() -> xr.Dataset:
    """Seven rings whose planes are apart by about 8 deg for half a second, each a second after the
    one before: at each time six of them are in step.
    """
    campaign = made_campaign(7)
    sizes = np.array([8.3, 8.1, 8.0, 8.6, 8.2, 8.5, 8.4])  # the median is that of sample 0
    apart = np.zeros((7, len(TIMES)))
    apart[np.arange(7), 4 + 2 * np.arange(7)] = sizes
    about = xr.DataArray([0.5, -0.5], dims="plane") * xr.DataArray(apart, dims=("sample", "time"))
    mean = campaign["opening_angle"].mean(("plane", "section"))
    for name, values in (("opening_angle", mean + about), ("asynchrony", abs(about).sum("plane"))):
        like = campaign[name]
        campaign[name] = values.broadcast_like(like).transpose(*like.dims).assign_attrs(like.attrs)
    campaign["asynchrony_max"][:] = sizes
    return campaign


def test_curves_of_samples_that_lag_in_turn_are_of_a_sample_not_of_an_instant() -> None:
    """The median at each time would be zero, though each ring lags by more than 4 deg."""
    campaign = late_in_turn()
    assert float(courses(campaign).bands.sel(quantile=0.5).max()) == pytest.approx(0.0, abs=1e-5)
    assert median_and_worst(campaign) == (0, 3)
    figure = fan(campaign)
    (line,) = (line for line in figure.axes[0].lines if line.get_label() == "median")
    assert line.get_ydata().max() == pytest.approx(4.15, abs=1e-5)
    assert "Median: the sample whose asynchrony_max is the median of all." in caption(figure)
    images = [axes.collections[0].get_array() for axes in lag_map(campaign).axes[:2]]
    assert [float(each.max()) for each in images] == pytest.approx([4.15, 4.3], abs=1e-5)
    other = late_in_turn()
    other["asynchrony"] *= 2.0
    other["asynchrony_max"] *= 2.0
    found = compare(campaign, other, ("slow", "fast"))
    (both,) = (f for name, _, f in figures_of_both(found, campaign, other) if name == "courses")
    axes = both.axes[1]
    assert [line.get_ydata().max() for line in axes.lines] == pytest.approx([8.3, 16.6])
    assert [line.get_label() for line in axes.lines] == [
        "slow, line: sample 0", "fast, line: sample 0",
    ]  # fmt: skip
    edges = [band.get_paths()[0].vertices[:, 1].max() for band in axes.collections]
    assert edges == pytest.approx([8.6, 17.2])
    assert "asynchrony_max is the median of slow; bands span all samples" in caption(both)


def test_courses_by_ending_are_of_its_median_sample() -> None:
    """Of rings 0 to 4 sample 2 is in the middle, of those that stall, 5 to 7, sample 6."""
    campaign = with_motors(made_campaign(8, stalled=(5, 6, 7)))
    for draw, size in ((motors, 1e-3), (base_load, 1.0)):
        figure = draw(campaign)
        first, second = figure.axes[0].lines
        assert first.get_label() == "deployed (5), line: sample 2"
        assert second.get_label() == "stalled (3), line: sample 6"
        offset = 1.0 if draw is motors else 3.0
        assert first.get_ydata()[0] == pytest.approx(size * (offset + 2.0))
        assert second.get_ydata()[0] == pytest.approx(size * (offset + 6.0))
        assert "the line is the sample whose asynchrony_max is the median" in caption(figure)


def test_the_map_shows_the_median_and_the_worst(mixed: xr.Dataset) -> None:
    figure, wanted = lag_map(mixed), deviation(mixed)
    upper, lower = figure.axes[:2], figure.axes[2:4]
    for plane, pair in enumerate((upper, lower)):
        for axes, values in zip(pair, (wanted[GOOD.index(3)], wanted[-1]), strict=True):
            image = axes.collections[0].get_array().reshape(SECTIONS, -1)
            np.testing.assert_allclose(image, values[plane], atol=1e-5)
    scales = [axes.collections[0].get_clim() for axes in (*upper, *lower)]
    assert scales == [scales[0]] * 4
    assert scales[0][1] == pytest.approx(np.abs(wanted[-1]).max(), abs=1e-5)


def test_one_sample_that_runs_on_does_not_squeeze_all_others() -> None:
    """Of 30 rings 29 deploy within 4 s, and one stalls until 10 s."""
    campaign = with_motors(made_campaign(30, stalled=(7,)))
    late = np.arange(30) == 7
    campaign["deployment_time"][:] = np.where(late, np.nan, np.linspace(3.0, 4.0, 30))
    campaign["final_time"][:] = np.where(late, 10.0, 4.0)
    until, told = shown_until(campaign)
    nearly = np.sort(np.where(late, 10.0, campaign["deployment_time"]))[28]
    assert until == pytest.approx(1.25 * nearly)
    assert told == f" Time ends at {until:.3g} s: 1 sample goes on, until 10 s."
    for draw in (fan, lag_map, motors, base_load):
        figure = draw(campaign)
        assert told.strip() in caption(figure), draw
        ends = [a.get_xlim()[1] for a in figure.axes if "Time since" in a.get_xlabel()]
        assert ends
        assert all(until - 0.5 <= end <= until for end in ends), draw
    # Of few none is an exception.
    assert shown_until(campaign.isel(sample=slice(0, 10))) == (np.inf, "")
    assert shown_until(made_campaign(30)) == (np.inf, "")
