"""Figures of a campaign show the numbers of the file, and what they leave out."""

from __future__ import annotations

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from made_campaign import made_campaign, made_scene, with_motors
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ringsim.analysis import courses as blocks_module
from ringsim.analysis.design import median_and_worst, scalars
from ringsim.analysis.intervals import is_moment, quantities
from ringsim.analysis.study import analyse
from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.outputs.family import VARIABLES
from ringsim.plots import style
from ringsim.plots.campaign import endings, frame
from ringsim.plots.campaign.courses import lock_order, shares
from ringsim.plots.campaign.endings import angle_grid, base_load, laid_on, margin, motors, tension
from ringsim.plots.campaign.frame import ALL_ALIKE, moves, shown
from ringsim.plots.campaign.numbers import by_input, convergence, distributions, drawn
from ringsim.plots.campaign.tornado import bars_of, named, one_by_one
from ringsim.plots.figures import PICTURES, figures_of
from ringsim.variables import Fate, Status

GOOD = [0, 1, 3, 4, 6]


@pytest.fixture(scope="module")
def mixed() -> xr.Dataset:
    return made_campaign(8, failed=(2, 5), not_run=(7,))


def names_for(campaign: xr.Dataset) -> set[str]:
    """Figures of what campaigns of the kind hold."""
    own = [each for each in PICTURES if each.of == "campaign"]
    absent = {
        each.name for each in own
        if not set(each.needs) <= set(campaign)
        or not all(np.isfinite(campaign[name]).any() for name in each.needs[:1])
    }  # fmt: skip
    return {each.name for each in own} - absent - {"rare_event", "one_by_one"}


def words(figure: Figure) -> str:
    texts = [figure.get_supxlabel(), *(each.get_title().get_text() for each in figure.legends)]
    labels = [t.get_text() for legend in figure.legends for t in legend.get_texts()]
    return " ".join(" ".join([*texts, *labels]).split())


def test_lock_order_counts_ties_by_halves_and_what_stays_open() -> None:
    campaign = made_campaign(4, failed=(3,))
    campaign["lock_time"][:] = 5.0
    campaign["lock_time"][0, 0, 0] = 4.0
    campaign["lock_time"][1, 1, 2:] = 6.0
    campaign["lock_time"][2, 0, 1] = np.nan
    first, last, never = shares(campaign)
    assert first.sum() == pytest.approx(1.0)
    assert first[0, 0] == pytest.approx((1 + 1 / 6 + 1 / 7) / 3)
    assert last[1, 2] == pytest.approx((1 / 7 + 1 / 2) / 3)
    assert last.sum() == pytest.approx(2 / 3)
    assert never[0, 1] == pytest.approx(1 / 3)
    assert never.sum() == pytest.approx(1 / 3)
    assert "the last joint is counted in the 2 samples in which all" in words(lock_order(campaign))


def test_bars_of_few_samples_have_their_share_in_words() -> None:
    """One of a hundred is a line on the axis, which goes to all of them."""
    campaign = made_campaign(100)
    campaign["lock_time"][:] = 5.0
    campaign["lock_time"][:, 0, 1] = 4.0
    campaign["lock_time"][0, 0, 0] = 3.0
    upper, lower = lock_order(campaign).axes
    assert upper.get_ylim()[1] > 1.0
    assert "100%" in [upper.yaxis.get_major_formatter()(tick) for tick in upper.get_yticks()]
    (small,) = [text for text in upper.texts if text.get_text() == "1%"]
    stack = sum(table[0, 0] for table in shares(campaign))
    assert small.xy == pytest.approx((campaign["section"].values[0], stack))
    assert small.get_color() == style.BLUE  # of the bar that it is about
    assert not [t for t in lower.texts if t.get_text() == "1%"]


def test_distributions_are_steps_with_limits(mixed: xr.Dataset) -> None:
    figure = distributions(mixed)
    values = np.sort(mixed["asynchrony_max"].values[GOOD])
    (panel,) = [a for a in figure.axes if a.get_xlabel().startswith("Largest asynchrony")]
    step, limit = panel.lines[0], panel.lines[-1]
    np.testing.assert_allclose(step.get_xdata()[1:], values)
    np.testing.assert_allclose(step.get_ydata()[1:], np.arange(1, 6) / 5)
    assert limit.get_xdata()[0] == 3.0
    assert panel.get_title(loc="left") == "n = 5 of 8"
    (dots,) = [line for line in panel.lines if line.get_marker() == "o"]
    told = analyse(mixed)["asynchrony_max"].sel(statistic=["quantile_05", "median", "quantile_95"])
    np.testing.assert_allclose(dots.get_xdata(), told)
    one = distributions(made_campaign(1)).axes[0]
    assert not [line for line in one.lines if line.get_marker() == "o"]


def test_loads_with_an_allowable_come_first_and_show_it() -> None:
    campaign = with_motors(made_campaign(8))
    every = [n for n, each in VARIABLES.items() if each.summary is not None and each.dtype == "f8"]
    for name in every:
        campaign[name] = "sample", 100.0 + np.arange(8.0), {"units": VARIABLES[name].units}
    campaign["peak_tension"].values[:] = 20.0 + 1e-3 * np.arange(8.0)
    campaign.attrs["requirements"] = "{}"
    scene = made_scene()
    assert "peak_tension" not in shown(campaign)[0]
    for limit in (30.0, 500.0):
        own = campaign.assign_attrs(scene=scene.with_values({"limits.tension": limit}).to_toml())
        figure = distributions(own)
        assert shown(own)[0][0] == "peak_tension"
        panel = figure.axes[0]
        at = [line.get_xdata()[0] for line in panel.lines if len(line.get_xdata()) == 2]
        told = " ".join(text.get_text() for text in panel.texts)
        # One far beyond all values would leave them at the edge.
        near = limit < 100.0
        assert (at == [limit], "limit 30 N" in told) == (near, near)
        assert ("limit 500 N" in panel.get_title(loc="left")) is not near


def test_labels_of_expressions_fit_their_panels() -> None:
    text = "apart = max(abs(opening_angle(plane='upper') - opening_angle(plane='lower')))"
    made = xr.DataArray(0.0, name="apart", attrs={"long_name": text, "units": "deg"})
    told = style.label(made, width=38)
    assert max(map(len, told.split("\n"))) <= 34
    assert "".join(told.split()) == f"{text} (deg)".replace(" ", "")
    assert "(\ndeg" not in told


def test_what_did_not_happen_keeps_a_distribution_below_its_verdict() -> None:
    campaign = made_campaign(20, stalled=(1, 4, 7), failed=(2,), not_run=(5,))
    deployed = np.isfinite(campaign["deployment_time"].values)
    times = 30.0 + np.arange(20.0)
    campaign["deployment_time"][:] = np.where(deployed, times, np.nan)
    (panel,) = (
        a for a in distributions(campaign).axes if a.get_xlabel().startswith("Time at which")
    )
    step, dots, limit = panel.lines
    assert step.get_ydata()[-1] == pytest.approx(15 / 18)
    at = step.get_ydata()[step.get_xdata() <= limit.get_xdata()[0]][-1]
    found = analyse(campaign).sel(requirement="deployment_time")
    assert at == pytest.approx(float(found["probability"]))
    # Quantiles are those of the table, at the height that the curve has there.
    told = analyse(campaign)["deployment_time"]
    names = ["quantile_05", "median", "quantile_95"]
    np.testing.assert_allclose(dots.get_xdata(), told.sel(statistic=names))
    np.testing.assert_allclose(dots.get_ydata(), np.array([0.05, 0.5, 0.95]) * 15 / 18)
    assert "did not happen in the other samples" in words(distributions(campaign))
    # A model that tells no time of what deployed is not an antenna that fails.
    campaign["outcome"][:] = int(Fate.DEPLOYED)
    (panel,) = (
        a for a in distributions(campaign).axes if a.get_xlabel().startswith("Time at which")
    )
    assert panel.lines[0].get_ydata()[-1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("name", "bound", "below"),
    [
        ("least_latch_rate", {}, True), ("peak_latch_rate", {}, False),
        ("least_latch_rate", {"max": 9.0}, False), ("peak_latch_rate", {"min": 0.1}, True),
    ],
)  # fmt: skip
def test_what_did_not_happen_counts_on_the_bad_side_of_a_number(
    name: str, bound: dict[str, float], below: bool
) -> None:
    """Of a ring whose latches were never met the least rate is no better than all others."""
    campaign = made_campaign(10, stalled=(0, 5))
    rates = np.where(np.isfinite(campaign["deployment_time"]), 1.0 + np.arange(10.0), np.nan)
    campaign[name] = "sample", rates, {"units": "rad s-1", "long_name": "some rate"}
    wanted = {name: bound | {"probability": 0.5, "confidence": 0.9}} if bound else {}
    campaign.attrs["requirements"] = json.dumps(wanted)
    (panel,) = (a for a in distributions(campaign).axes if a.get_xlabel().startswith("Some rate"))
    step, dots = panel.lines[:2]
    ends = [step.get_ydata()[0], step.get_ydata()[-1]]
    assert ends == pytest.approx([0.2, 1.0] if below else [0.0, 0.8])
    middle = np.nanmedian(rates)
    assert dots.get_xdata()[1] == pytest.approx(middle)
    assert dots.get_ydata()[1] == pytest.approx(0.6 if below else 0.4)


def test_tension_by_span(mixed: xr.Dataset) -> None:
    figure = tension(mixed)
    spans = mixed["span"].values
    for axes in figure.axes:
        middle = axes.lines[0]
        np.testing.assert_allclose(middle.get_ydata(), 23.0 / spans)
        np.testing.assert_allclose(axes.lines[1].get_ydata(), 26.0 / spans)
    assert "largest tension: sample 6" in words(figure)
    # However many spans there are, none has the number 0.
    assert figure.axes[-1].get_xlim() == pytest.approx((spans[0] - 0.6, spans[-1] + 0.6))


def test_inputs_with_places_count_by_their_mean(mixed: xr.Dataset) -> None:
    figure = by_input(mixed)
    assert figure.get_suptitle().startswith("Asynchrony and outcome by input: ")
    points = {c.get_label(): c.get_offsets() for c in figure.axes[1].collections}
    assert {name: len(at) for name, at in points.items()} == {
        "deployed (5)": 5, "failed: timeout (2)": 2,
    }  # fmt: skip
    np.testing.assert_allclose(points["deployed (5)"][:, 0], np.array(GOOD) + 1.0)
    np.testing.assert_allclose(points["deployed (5)"][:, 1], mixed["asynchrony_max"].values[GOOD])
    places, labels = drawn(mixed["cables_lower_winch_stop_time"])
    assert labels == ["3.0", "none"]
    assert "below the line" not in words(by_input(made_campaign(3)))
    assert places.tolist() == [0, 1] * 4


def test_numbers_among_words_stand_by_size(mixed: xr.Dataset) -> None:
    stops = ["8.0", "none", "24.0", "4.0", "-1.5", "1e2", "4.0", "none"]
    made = mixed.assign(
        cables_lower_winch_stop_time=mixed["cables_lower_winch_stop_time"].copy(data=stops)
    )
    places, labels = drawn(made["cables_lower_winch_stop_time"])
    assert labels == ["-1.5", "4.0", "8.0", "24.0", "1e2", "none"]
    assert [labels[int(place)] for place in places] == stops


@pytest.mark.usefixtures("settled")
@pytest.mark.parametrize("count", [2, 3, 4, 7])
def test_words_of_inputs_are_whole_and_stand_apart(count: int) -> None:
    campaign = made_campaign(8)
    faults = [f"failed-latch(plane=upper, section={k}, time=0.5)" for k in range(count - 1)]
    faults = [*faults, "none"]
    about = {"role": "input", "input": "faults", "units": "1"}
    held = np.array([faults[k % count] for k in range(8)], dtype=object)
    campaign["input_faults"] = "sample", held, about
    figure = by_input(campaign)
    figure.draw_without_rendering()
    (axes,) = (each for each in figure.axes if each.get_xlabel() == "faults")
    ticks = axes.get_xticklabels()
    assert ["".join(tick.get_text().split()) for tick in ticks] == [
        each.replace(" ", "") for each in faults
    ]
    boxes = [tick.get_window_extent() for tick in ticks]
    assert all(a.x1 < b.x0 for a, b in itertools.pairwise(boxes))
    assert axes.get_window_extent().height > 100.0


def test_no_figure_drops_a_sample_in_silence(mixed: xr.Dataset) -> None:
    for picture, figure in figures_of(with_motors(mixed)):
        told = words(figure)
        if picture.name == "by_input":
            assert "7 of 8 samples run; the 2 without" in told
        else:
            assert "5 of 8 samples; left out: 2 failed: timeout, 1 not run" in told, picture.name


def test_the_median_is_a_sample_and_the_worst_has_the_largest_asynchrony(
    mixed: xr.Dataset,
) -> None:
    assert median_and_worst(mixed) == (3, 6)
    assert median_and_worst(made_campaign(2, failed=(0, 1))) is None


def test_all_figures_of_a_file(tmp_path: Path, mixed: xr.Dataset) -> None:
    save(mixed, tmp_path / "campaign.nc")
    done = CliRunner().invoke(cli, ["plot", str(tmp_path), "--plot-format", "svg"])
    assert done.exit_code == 0, done.output
    names = {path.name for path in tmp_path.glob("*.svg")}
    # Five samples are too few for a correlation.
    expected = names_for(mixed) - {"tornado"}
    assert names == {f"campaign-fig-{name}.svg" for name in expected}


@pytest.mark.parametrize("choice", [{"failed": (0, 1)}, {"not_run": (0, 1)}, {"stalled": (0, 1)}])
def test_campaigns_in_which_nothing_deployed(choice: dict[str, tuple[int, ...]]) -> None:
    names = {picture.name for picture, _ in figures_of(made_campaign(2, **choice))}
    stalled = {"distributions", "convergence", "fan", "lag_map", "tension", "by_input"}
    expected = stalled if "stalled" in choice else {"by_input"} if "failed" in choice else set()
    assert names == expected


def test_a_campaign_without_asynchrony_has_no_fan() -> None:
    campaign = made_campaign(2)
    campaign["asynchrony"][:] = np.nan
    names = {picture.name for picture, _ in figures_of(campaign)}
    assert names == names_for(campaign) - {"fan", "lag_map", "tornado"}


def test_the_margin_by_ending_and_over_the_angle() -> None:
    campaign = with_motors(made_campaign(8, stalled=(4, 6), failed=(2,)))
    upper, lower = margin(campaign).axes
    assert "linear to 1" in lower.get_ylabel()
    strips = dict(
        zip([t.get_text() for t in upper.get_yticklabels()], upper.collections, strict=True)
    )
    assert {name: len(at.get_offsets()) for name, at in strips.items()} == {
        "deployed (5)": 5, "stalled (2)": 2,
    }  # fmt: skip
    np.testing.assert_allclose(strips["stalled (2)"].get_offsets()[:, 0], [-0.1, 0.1], atol=1e-12)
    (stalled,) = (line for line in lower.lines if line.get_label() == "stalled (2)")
    # The margin grows by one over the way, from 20 to 180 deg.
    angle = stalled.get_xdata()
    np.testing.assert_allclose(stalled.get_ydata(), (angle - 20.0) / 160.0, atol=1e-9)
    band = lower.collections[1].get_paths()[0].vertices
    assert band[:, 1].min() == pytest.approx(-0.1)
    wanted = {"least_drive_margin": {"min": -0.3, "probability": 0.9, "confidence": 0.9}}
    campaign.attrs["requirements"] = json.dumps(wanted)
    assert [t.get_text() for t in margin(campaign).axes[0].texts] == ["required -0.3"]
    # What is required of another margin is drawn at the marks of that one.
    started = campaign["least_drive_margin"] + 0.25
    campaign["least_drive_margin_started"] = started.assign_attrs(long_name="from the last start")
    campaign.attrs["requirements"] = json.dumps(
        {"least_drive_margin_started": wanted.pop("least_drive_margin") | {"min": 0.0}}
    )
    upper = margin(campaign).axes[0]
    assert [t.get_text() for t in upper.texts] == ["required 0"]
    assert "from the last start" in upper.get_xlabel().lower()
    marks = np.concatenate([each.get_offsets()[:, 0] for each in upper.collections])
    ran = started.values[(campaign["status"] == Status.OK).values]
    np.testing.assert_allclose(np.sort(marks), np.sort(ran), atol=1e-12)


def test_the_band_of_margins_ends_where_the_first_deployed_sample_has_its_last_record() -> None:
    """Records before 180 deg stand at another angle in each: beyond the first, a band of all would
    shrink to the margin of one.  Samples that stall end where they do, and cases are whole.
    """
    campaign = with_motors(made_campaign(8, stalled=(4, 6)))
    cut = xr.DataArray([9.9, 9.4, 8.4, 9.9, 5.9, 9.9, 7.9, 9.9], dims="sample")
    campaign["drive_margin"] = campaign["drive_margin"].where(campaign["time"] <= cut)
    campaign["drive_margin"] = campaign["drive_margin"] + 0.1 * campaign["sample"]
    lower = margin(campaign).axes[1]
    curves = {line.get_label(): line.get_xdata() for line in lower.lines}
    # 20 deg and 16 deg a second, records every half second, and angles 0.95 deg apart.
    for label, moment in (("deployed (6)", 8.0), ("stalled (2)", 7.5)):
        assert 0.0 <= 20.0 + 16.0 * moment - curves[label][-1] < 1.0, label
    ends = [band.get_paths()[0].vertices for band in lower.collections]
    last = max(ends, key=lambda each: each[:, 0].max())
    last = last[np.isclose(last[:, 0], last[:, 0].max())]
    assert np.ptp(last[:, 1]) > 1.0  # of margins that grow by 0.2 from sample to sample
    (told,) = (each.get_title().get_text() for each in margin(campaign).legends)
    said = "The band of deployed samples ends where the first of them has its last record."
    assert said in " ".join(told.split())
    campaign.attrs["design"] = json.dumps({"kind": "list"})
    figure = margin(campaign)
    assert max(line.get_xdata()[np.isfinite(line.get_ydata())][-1] for line in figure.axes[1].lines
               if len(line.get_xdata()) > 2) == pytest.approx(20.0 + 16.0 * 9.5)  # fmt: skip
    (told,) = (each.get_title().get_text() for each in figure.legends)
    assert "last record" not in told


def test_motors_and_base_are_drawn_by_ending() -> None:
    campaign = with_motors(made_campaign(8, stalled=(4, 6), failed=(2,)))
    torques = motors(campaign).axes[::2]
    assert [a.get_title(loc="left") for a in torques] == ["upper cable", "lower cable"]
    for axes in torques:
        lines = {line.get_label(): line.get_ydata() for line in axes.lines}
        np.testing.assert_allclose(lines["stalled (2), line: sample 4"], 5e-3)
        np.testing.assert_allclose(lines["deployed (5), line: sample 3"], 4e-3)
    force, torque = base_load(campaign).axes
    for axes, scale in ((force, 1.0), (torque, 0.5)):
        np.testing.assert_allclose(axes.lines[0].get_ydata(), 6.0 * scale)
        assert axes.collections[0].get_paths()[0].vertices[:, 1].max() == pytest.approx(
            10.0 * scale
        )


def test_of_many_samples_some_of_every_ending_are_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endings, "MOST", 3)
    monkeypatch.setattr(blocks_module, "BLOCK_BYTES", 1)
    campaign = with_motors(made_campaign(9, stalled=(8,)))
    read, ends = endings.chosen(campaign, ["motor_torque"])
    assert read["sample"].values.tolist() == [0, 3, 6, 8]
    assert ends.tolist() == ["deployed"] * 3 + ["stalled"]
    assert "4 of them are drawn" in words(motors(campaign))


def joined(panel: Axes) -> list[list[float]]:
    """Samples that a line joins, without that of the base case across the panel."""
    lines = [line.get_xdata() for line in panel.lines if line.get_color() == style.PALE]
    return [list(each) for each in lines if len(each) > 1]


def test_lines_join_values_of_one_scale_alone() -> None:
    """Not places, words, nor what is on both sides of a sample without a value."""
    campaign = made_campaign(13, failed=(3,), not_run=(12,))
    campaign.attrs["design"] = '{"kind": "one-at-a-time"}'
    campaign["rods_young_modulus"][:] = [1e11, 2e11, 3e11, 4e11, 5e11, 6e11, *[1e11] * 7]
    friction = np.ones((13, 3))
    friction[[6, 7], [0, 1]] = 2.0
    campaign["cables_upper_friction_coefficient"][:] = friction
    laws = ["none"] * 8 + ["3.0", "4.0", "never", "later", "none"]
    campaign["cables_lower_winch_stop_time"][:] = laws
    figure = one_by_one(campaign)
    assert joined(figure.axes[-1]) == [[1, 2], [4, 5]]
    assert "not run" not in " ".join(t.get_text() for t in figure.legends[0].get_texts())
    campaign["cables_lower_winch_stop_time"][10:12] = ["5.0", "6.0"]
    assert joined(one_by_one(campaign).axes[-1]) == [[1, 2], [4, 5], [8, 9, 10, 11]]


@pytest.mark.parametrize("count", [1, 2, 54, 72, 73, 100, 501])
def test_places_are_named_at_equal_steps_and_at_both_ends(count: int) -> None:
    places = np.array(named(count))
    assert (places[0], places[-1]) == (0, count - 1)
    assert len(places) <= 73
    steps = np.diff(places)
    assert (steps[:-1] == steps[:1]).all()
    if count <= 72:
        assert places.tolist() == list(range(count))
    elif len(steps):
        assert 0.5 * steps[0] < steps[-1] <= 1.5 * steps[0]


def test_labels_of_inputs_break_between_their_parts() -> None:
    campaign = made_campaign(3)
    campaign["rods_young_modulus"].attrs["path"] = (
        'cables.upper.friction.coefficient["section 3 V"]'
    )
    labels = [axes.get_xlabel() for axes in by_input(campaign).axes]
    assert labels[0] == 'cables.upper.friction.coefficient\n["section 3 V"] (Pa)'
    assert labels[1] == "cables.upper_friction_coefficient\nmean (m)"


def test_of_blocks_figures_show_the_samples_that_the_analysis_takes() -> None:
    campaign = made_campaign(40)
    campaign.attrs["design"] = '{"kind": "saltelli", "samples": 8, "replicates": 2}'
    rows = np.array(["A", "AB: modulus", "AB: friction", "AB: stop", "B"] * 8)
    campaign["block_row"] = "sample", rows
    own = np.isin(rows, ["A", "B"])
    (axes,) = (
        a for a in distributions(campaign).axes if a.get_xlabel().startswith("Largest tension")
    )
    np.testing.assert_allclose(axes.lines[0].get_xdata()[1:], 20.0 + np.flatnonzero(own))
    figure = convergence(campaign)
    (axes,) = (a for a in figure.axes if a.get_title(loc="left").startswith("Largest tension"))
    told = analyse(campaign)["peak_tension"].sel(statistic="mean")
    assert axes.lines[0].get_ydata()[-1] == pytest.approx(float(told))
    assert "16 of 16 samples; no run failed. Only the samples A and B" in words(figure)


def test_convergence_draws_the_quantile_at_the_worse_end() -> None:
    made = with_motors(made_campaign(8))
    figure = convergence(made)
    label = "quantile at the worse end (95 %; 5 % where less is worse)"
    told = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert [text for text in told if "quantile" in text] == [label]
    plain = convergence(made_campaign(8)).legends[0].get_texts()
    assert "95 % quantile, at the worse end" in [text.get_text() for text in plain]
    for name, level in (("least_drive_margin", 0.05), ("peak_tension", 0.95)):
        own = style.plain(made[name].attrs["long_name"])[:12].lower()
        (axes,) = (a for a in figure.axes if a.get_title(loc="left").lower().startswith(own))
        (line,) = (each for each in axes.lines if each.get_label() == label)
        assert line.get_ydata()[-1] == pytest.approx(np.quantile(made[name], level))


def test_one_at_a_time_names_every_change() -> None:
    campaign = made_campaign(6, stalled=(5,))
    campaign.attrs["design"] = '{"kind": "one-at-a-time"}'
    campaign["rods_young_modulus"][:] = [1e11, 2e11, 1e11, 1e11, 1e11, 1e11]
    friction = np.ones((6, 3))
    friction[[2, 3, 4], [0, 1, 2]] = 2.0
    campaign["cables_upper_friction_coefficient"][:] = friction
    campaign["cables_lower_winch_stop_time"][:] = ["none"] * 5 + ["3.0"]
    changes = ["base", "young_modulus 2e+11", "pulley 1", "pulley 2", "pulley 3"]
    changes += ["lower_winch_stop_time 3.0"]
    assert moves(campaign)[0] == changes
    figure = one_by_one(campaign)
    assert [t.get_text() for t in figure.axes[-1].get_xticklabels()] == changes
    (panel,) = (a for a in figure.axes if a.get_title(loc="left").startswith("Largest tension"))
    points = np.concatenate([c.get_offsets() for c in panel.collections])
    np.testing.assert_allclose(points, np.stack([np.arange(6), 20.0 + np.arange(6)], axis=1))
    assert not joined(panel)
    names = {picture.name for picture, _ in figures_of(campaign)}
    assert "one_by_one" in names
    assert not {"distributions", "convergence", "tornado"} & names
    # Long names take their room below the panels, not from them.
    campaign["cables_lower_winch_stop_time"][:] = ["none"] * 5 + ["a winch that is cut off " * 9]
    figure = one_by_one(campaign)
    figure.draw_without_rendering()
    heights = [axes.get_window_extent().height / figure.dpi for axes in figure.axes]
    assert min(heights) > 0.8


def test_panels_are_for_numbers_that_differ_or_have_limits() -> None:
    """Fewer than a thousandth apart is no panel; whole numbers have one where they are required."""
    campaign = made_campaign(8)
    campaign.attrs["requirements"] = "{}"
    campaign["deployment_time"] = "sample", np.linspace(10.0, 10.02, 8)
    names, flat = shown(campaign)
    assert "deployment_time" in names
    assert "deployment_time" not in flat
    campaign["deployment_time"] = "sample", np.linspace(10.0, 10.005, 8)
    names, flat = shown(campaign)
    assert "deployment_time" not in names
    assert f"{ALL_ALIKE}: deployment_time" in flat
    assert f"{ALL_ALIKE}: deployment_time" in words(distributions(campaign))
    assert f"{ALL_ALIKE}: deployment_time" in words(convergence(campaign))
    wanted = {"probability": 0.9, "confidence": 0.9}
    campaign["latched_joints"] = "sample", np.full(8, 6)
    campaign.attrs["requirements"] = json.dumps(
        {"deployment_time": {"max": 12.0} | wanted, "latched_joints": {"min": 6} | wanted}
    )
    names, flat = shown(campaign)
    assert {"deployment_time", "latched_joints"} <= set(names)
    assert "deployment_time" not in flat


def test_a_percentage_stays_on_its_line(mixed: xr.Dataset) -> None:
    for length in range(60, 120):
        figure = Figure(figsize=(8.0, 4.0))
        frame.head(figure, mixed, "Any", f"{'x' * length} by less than 0.1 % of it " + "y " * 80)
        assert not [line for line in figure.get_supxlabel().split("\n") if line.startswith("%")]


def test_of_too_many_numbers_those_that_differ_most_are_drawn_also_without_a_summary() -> None:
    campaign = made_campaign(8)
    about = {"min": 1.0, "probability": 0.9, "confidence": 0.9}
    every = [n for n, each in VARIABLES.items() if each.summary is not None and each.dtype == "f8"]
    for k, name in enumerate(every):
        campaign[name] = "sample", 100.0 + (k + 1.0) * np.arange(8.0)
    every = scalars(campaign)  # without numerical errors
    (plain, *_) = (n for n, each in quantities().items() if each.summary is None
                   and each.dtype == "f8" and not is_moment(n) and n not in campaign)  # fmt: skip
    campaign[plain] = "sample", np.arange(8.0)
    asked = dict.fromkeys(every[:3], about)
    campaign.attrs["requirements"] = json.dumps(asked)
    names, told = shown(campaign)
    always = [name for name in every[3:] if name in ("asynchrony_max", "peak_tension")]
    drawn = [*every[:3], *always, *every[-5 + len(always) :], plain]
    assert names == drawn
    others = [name for name in every if name not in drawn]
    assert told == f" Not drawn for want of room: {', '.join(others)}."
    assert plain in dict(bars_of(campaign))
    # Panels that stand beside those of requirements fill the last row.
    for count in (4, 7, 8):
        campaign.attrs["requirements"] = json.dumps(dict.fromkeys(every[:count], about))
        assert all(axes.get_visible() for axes in convergence(campaign).axes), count


def test_counts_that_differ_are_drawn_as_well() -> None:
    campaign = made_campaign(8)
    campaign["latched_joints"] = "sample", 20 + np.arange(8) % 3
    campaign["locked_joints"] = "sample", [24] * 8
    names, _ = shown(campaign)
    assert "latched_joints" in names
    assert "locked_joints" not in names


def test_a_sheet_has_the_panels_that_matter_and_names_the_others() -> None:
    """Nine at most: what is required first, and inputs in the order of their correlations."""
    campaign = made_campaign(8)
    wanted = {"max": 9.0, "probability": 0.9, "confidence": 0.9}
    campaign.attrs["requirements"] = json.dumps({"total_motor_energy": wanted})
    every = [n for n, each in VARIABLES.items() if each.summary is not None and each.dtype == "f8"]
    for name in every:
        campaign[name] = "sample", np.arange(8.0)
    names, told = shown(campaign)
    assert len(names) == 9
    assert names[0] == "total_motor_energy"
    others = told.removesuffix(".").partition("Not drawn for want of room: ")[2].split(", ")
    assert others[0]
    assert not set(others) & set(names)
    assert sum(axes.get_visible() for axes in convergence(campaign).axes) == 9
    dice = np.random.default_rng(1)
    for k in range(20):
        about = {"role": "input", "input": f"input {k}", "units": "1"}
        values = dice.random(8) if k < 19 else -campaign["asynchrony_max"].values
        campaign[f"input_{k}"] = "sample", values, about
    figure = by_input(campaign)
    labels = [axes.get_xlabel() for axes in figure.axes if axes.get_visible()]
    assert len(labels) == 9
    assert labels[0].startswith("cables.lower_winch_stop_time")
    assert any(label.startswith("input 19") for label in labels[:5])
    told = words(figure).partition("Not drawn, since their rank correlation with this output")[2]
    assert told.count("input ") == 4
    assert " and 10 more" in told


def test_lags_ahead_are_lighter_than_lags_behind() -> None:
    """So that a print in grey has their sign."""
    axes = Figure().subplots()
    times, sections = np.arange(2.0), np.arange(1, 10)
    lags = np.linspace(-1.0, 1.0, 9)[:, None] * np.ones(2)
    lags = xr.DataArray(lags, {"section": sections, "time": times}, ("section", "time"))
    image = style.lag_image(axes, lags, 1.0)
    grey = image.to_rgba(lags.values[:, 0])[:, :3] @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(grey) > 0.02).all()


def test_settings_of_the_solver_are_no_inputs_beside_the_antenna_s() -> None:
    campaign = made_campaign(3)
    panels = len(by_input(campaign).axes)
    about = {"role": "input", "path": "solver.error_bars", "distribution": "one sample in 2"}
    campaign["solver_error_bars"] = "sample", np.array([True, False, True]), about
    assert len(by_input(campaign).axes) == panels


def test_the_course_of_the_margin_begins_where_runs_begin() -> None:
    """Angles of starts differ by round-off: each counts at the first angle of the grid."""
    rows = [
        (np.array([20.0 + off, 90.0, 180.0 - off]), np.array([start, 3.0, 5.0]))
        for off, start in ((0.0, -0.5), (1e-14, 0.4), (3e-14, 2.0), (1.0, 1.0))
    ]
    laid = np.array([laid_on(angle_grid(rows), *row) for row in rows])
    np.testing.assert_allclose(laid[:3, 0], [-0.5, 0.4, 2.0])
    np.testing.assert_allclose(laid[:3, -1], 5.0)
    assert np.isnan(laid[3, [0, -1]]).all()


@pytest.mark.usefixtures("settled")
@pytest.mark.parametrize("kind", ["random", pytest.param("one-at-a-time", marks=pytest.mark.slow)])
def test_stress_has_the_numbers_of_its_unit_in_all_figures(kind: str) -> None:
    campaign = made_campaign(12)
    campaign.attrs["design"] = json.dumps({"kind": kind})
    variable = VARIABLES["peak_rod_stress"]
    about = {"long_name": variable.long_name, "units": variable.units}
    campaign["peak_rod_stress"] = "sample", np.linspace(5e6, 8e6, 12), about
    seen = set()
    for picture, figure in figures_of(campaign):
        for axes in figure.axes:
            titled = axes.get_title(loc="left") if not axes.get_ylabel() else ""
            for axis, words in ((axes.xaxis, axes.get_xlabel()), (axes.yaxis, titled)):
                if "stress" in words.lower() and "(" in words:
                    assert "(MPa)" in words
                    figure.draw_without_rendering()
                    places = axis.get_majorticklocs()
                    told = axis.get_major_formatter().format_ticks(places)
                    scale = float(axis.get_major_formatter().get_offset() or 1.0)
                    numbers = [scale * float(text) for text in told]
                    assert numbers == pytest.approx(1e-6 * places)
                    seen.add(picture.name)
    assert seen == ({"one_by_one"} if kind == "one-at-a-time" else {"distributions", "convergence"})
