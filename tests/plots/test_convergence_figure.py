"""Convergence shows what the analysis tells of so many first samples."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr
from made_campaign import made_campaign
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import binomtest, t

from ringsim.analysis.study import analyse
from ringsim.outputs.family import VARIABLES
from ringsim.plots.campaign.numbers import convergence

GOOD = [0, 1, 3, 4, 6]


def words(figure: Figure) -> str:
    (legend,) = figure.legends
    texts = [legend.get_title().get_text(), *(each.get_text() for each in legend.get_texts())]
    return " ".join(" ".join(texts).split())


def panel(figure: Figure, start: str) -> Axes:
    (found,) = (a for a in figure.axes if a.get_title(loc="left").startswith(start))
    return found


def ends_at(axes: Axes, count: int) -> np.ndarray:
    """The ends of a panel's band there, the lower one first."""
    (band,) = axes.collections
    drawn_at = band.get_paths()[0].vertices
    return np.sort(np.unique(drawn_at[drawn_at[:, 0] == count, 1]))


def replicated(samples: int, replicates: int) -> xr.Dataset:
    campaign = made_campaign(samples, kind="sobol")
    table = {"kind": "sobol", "samples": samples, "replicates": replicates}
    campaign.attrs["design"] = json.dumps(table)
    campaign["peak_tension"][:] = np.random.default_rng(3).normal(20.0, 1.0, samples)
    return campaign


def test_convergence_ends_at_mean_and_quantile() -> None:
    campaign = made_campaign(8, failed=(2, 5), not_run=(7,))
    figure = convergence(campaign)
    values = campaign["peak_tension"].values[GOOD]
    axes = panel(figure, "Largest tension")
    mean, quantile = axes.lines
    assert mean.get_ydata()[-1] == pytest.approx(values.mean())
    assert mean.get_ydata()[1] == pytest.approx(values[:2].mean())
    assert quantile.get_ydata()[-1] == pytest.approx(np.quantile(values, 0.95))
    assert not axes.collections  # five samples have no interval
    assert all(each.get_xlabel() == "Samples" for each in figure.axes if each.get_visible())
    alone = convergence(made_campaign(9, kind="sobol"))
    assert not panel(alone, "Largest tension").collections
    assert "are not independent" in words(alone)


def test_the_band_of_convergence_is_the_interval_of_the_analysis() -> None:
    campaign = made_campaign(12)
    figure = convergence(campaign)
    axes = panel(figure, "Largest tension")
    assert axes.collections[0].get_paths()[0].vertices[:, 0].min() == 8
    known = analyse(campaign)["peak_tension_interval"].sel(statistic="mean")
    np.testing.assert_allclose(ends_at(axes, 12), np.sort(known))
    assert "95 % interval of the mean" in words(figure)
    one = convergence(made_campaign(1))
    axes = panel(one, "Largest tension")
    assert axes.get_title(loc="left").endswith("n = 1")
    assert all(float(tick).is_integer() for tick in axes.get_xticks())
    assert "interval" not in words(one)


def test_replicates_of_a_design_give_the_mean_its_interval() -> None:
    campaign = replicated(40, 4)
    figure = convergence(campaign)
    axes = panel(figure, "Largest tension")
    known = analyse(campaign)["peak_tension_interval"].sel(statistic="mean")
    np.testing.assert_allclose(ends_at(axes, 40), np.sort(known))
    # Replicates of one size: Student's t of their four means.
    means = campaign["peak_tension"].values.reshape(10, 4).mean(axis=0)
    half = t.ppf(0.975, 3) * means.std(ddof=1) / 2.0
    np.testing.assert_allclose(ends_at(axes, 40), [means.mean() - half, means.mean() + half])
    drawn_at = axes.collections[0].get_paths()[0].vertices[:, 0]
    assert drawn_at.min() >= 8  # two samples of each
    assert "not independent" not in words(figure)


def test_a_requirement_has_its_probability_with_the_bounds_of_its_verdict() -> None:
    campaign = made_campaign(30, stalled=(4, 11, 25), failed=(6,))
    figure = convergence(campaign)
    found = analyse(campaign).sel(requirement="outcome")
    axes = panel(figure, "outcome is deployed")
    share, required = axes.lines
    assert required.get_ydata()[0] == 0.9
    assert share.get_ydata()[-1] == pytest.approx(26 / 29) == pytest.approx(found.probability)
    ends = [float(found.probability_lower), float(found.probability_upper)]
    np.testing.assert_allclose(ends_at(axes, 29), ends)
    (band,) = axes.collections
    for count in np.unique(band.get_paths()[0].vertices[:, 0]).astype(int):
        kept = np.isin(np.delete(np.arange(30), 6)[:count], [4, 11, 25], invert=True)
        assert share.get_ydata()[count - 1] == pytest.approx(kept.mean())
        # One-sided bounds of 90 %: a two-sided interval of 80 %.
        # Sample 6 is lost, and counts as violating below and as keeping to it above.
        lost, own = int(count > 6), int(kept.sum())
        low, high = (
            binomtest(each, count + lost).proportion_ci(0.8, "exact") for each in (own, own + lost)
        )
        sides = [low.low, high.high]
        drawn_at = ends_at(axes, count)
        np.testing.assert_allclose(drawn_at[[0, -1]], sides)
    titles = [a.get_title(loc="left") for a in figure.axes]
    assert "asynchrony_max <= 3 deg\nn = 29" in titles


def test_requirements_that_fail_are_drawn_and_what_is_left_out_has_its_reason() -> None:
    campaign = made_campaign(16)
    numbers = [n for n, each in VARIABLES.items() if each.summary is not None][:12]
    for k, name in enumerate(numbers):
        campaign[name] = "sample", np.arange(16.0) + k
    about = {"min": 15.5, "probability": 0.9, "confidence": 0.9}
    campaign.attrs["requirements"] = json.dumps(dict.fromkeys(numbers[::-1], about))
    figure = convergence(campaign)
    titles = [axes.get_title(loc="left") for axes in figure.axes if axes.get_visible()]
    drawn = [name for name in numbers if any(title.startswith(f"{name} >=") for title in titles)]
    assert drawn == numbers[:9]
    assert len(titles) == 12
    told = words(figure).partition("as at least as many samples meet them as any other: ")[2]
    left = told.partition(".")[0].removeprefix("the requirements of ").split(", ")
    assert sorted(left) == sorted(numbers[9:])
    assert "for want of room: mean and quantile of " in words(figure)
    campaign[numbers[0]][3] = np.nan
    assert f"not all samples tell of them: the requirements of {numbers[0]}." in words(
        convergence(campaign)
    )


def test_shares_of_none_and_of_all_are_lines_inside_the_frame() -> None:
    campaign = made_campaign(16)
    about = {"probability": 0.9, "confidence": 0.9}
    never, always = about | {"max": -1.0}, about | {"max": 1e3}
    wanted = {"asynchrony_max": never, "peak_tension": always}
    campaign.attrs["requirements"] = json.dumps(wanted)
    figure = convergence(campaign)
    figure.draw_without_rendering()
    for start, height in (("asynchrony_max <=", 0.0), ("peak_tension <=", 1.0)):
        axes = panel(figure, start)
        assert set(axes.lines[0].get_ydata()) == {height}
        frame, (_, at) = axes.get_window_extent(), axes.transData.transform((1.0, height))
        assert frame.y0 + 2.0 < at < frame.y1 - 2.0
        assert all(tick >= 0.0 for tick in axes.get_yticks() if tick >= axes.get_ylim()[0])
