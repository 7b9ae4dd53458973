"""Locks, latch rates, motors and margins as the dataset holds them."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import xarray as xr
from made_campaign import SECTIONS, TIMES, made_campaign, made_scene, with_motors
from sheets import cut_words

from ringsim.analysis.courses import courses, ends
from ringsim.plots.campaign.endings import latch_rate, lock_impulse, margin
from ringsim.plots.campaign.endings import motors as motors_of_samples
from ringsim.plots.drives_and_locks import drive, drive_end, least_rate, locks, motors
from ringsim.plots.figures import figures_of
from ringsim.plots.style import locked_time
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate
from ringsim.variables import Fate

LEAST = 0.25


def latched_scene() -> Scene:
    """Latches that catch from 0.25 rad/s on."""
    return made_scene().with_values({"latch": {"min_rate": LEAST}})


@pytest.fixture
def campaign() -> xr.Dataset:
    """Sample k meets its latches with (k + 1) / 10 rad/s in section 1, twice that in section 2, ..;
    the last joint of sample 0 meets none.
    """
    made = made_campaign(8, failed=(2,)).assign_attrs(scene=latched_scene().to_toml())
    number = np.arange(1.0, SECTIONS + 1) * 0.1
    rates = (np.arange(8.0) + 1.0)[:, None, None] * np.stack([number, 0.5 * number])
    rates[0, 1, -1] = np.nan
    says = {"units": "rad/s", "long_name": "opening rate"}
    made["latch_rate"] = ("sample", "plane", "section"), rates, says
    made["lock_impulse"] = ("sample", "plane", "section"), 3.0 * rates, {"units": "N m s"}
    return made


def test_bands_of_latch_rates_are_those_of_the_samples_that_count(campaign: xr.Dataset) -> None:
    held = [0, 1, 3, 4, 5, 6, 7]
    for draw, scale in ((latch_rate, 1.0), (lock_impulse, 3.0)):
        figure = draw(campaign)
        for plane, axes in enumerate(figure.axes):
            own = scale * campaign["latch_rate"].to_numpy()[held, plane]
            (middle,) = (line for line in axes.lines if line.get_label() == "median")
            assert middle.get_ydata() == pytest.approx(np.nanmedian(own, axis=0))
            whole, most = axes.collections
            ends_of = [segment[:, 1].tolist() for segment in whole.get_segments()]
            wanted = np.column_stack([np.nanmin(own, axis=0), np.nanmax(own, axis=0)])
            assert np.array(ends_of) == pytest.approx(wanted)
            levels = np.nanquantile(own, [0.05, 0.95], axis=0).T
            assert np.array([s[:, 1] for s in most.get_segments()]) == pytest.approx(levels)
        words = figure.legends[0].get_title().get_text()
        assert "7 of 8 samples; left out: 1 " in words
        assert f"1 of {7 * 2 * SECTIONS} V-joints of all samples have none." in words


def test_the_least_rate_is_drawn_unless_it_is_drawn_by_sample(campaign: xr.Dataset) -> None:
    def line(made: xr.Dataset) -> list[float]:
        lines = latch_rate(made).axes[0].lines
        return [each.get_ydata()[0] for each in lines if "catch" in str(each.get_label())]

    assert line(campaign) == [LEAST]
    law = {"role": "input", "path": "latch.min_rate"}
    assert line(campaign.assign(latch_min_rate=("sample", np.linspace(0, 1, 8), law))) == []
    other = latched_scene().with_values({"latch.min_rate[2]": 0.3})
    assert line(campaign.assign_attrs(scene=other.to_toml())) == []
    assert np.isnan(least_rate(campaign.assign_attrs(scene=made_scene().to_toml())))
    assert np.isnan(least_rate(campaign.drop_attrs(deep=False)))


@pytest.mark.usefixtures("settled")
def test_bounds_of_requirements_are_drawn_beside_the_rates_and_impulses(
    campaign: xr.Dataset,
) -> None:
    about = {"probability": 0.9, "confidence": 0.9}
    wanted = {
        "least_latch_rate": about | {"min": 0.3}, "peak_latch_rate": about | {"max": 0.75},
        "peak_lock_impulse": about | {"max": 2.0}, "peak_tension": about | {"max": 9.0},
    }  # fmt: skip
    campaign.attrs["requirements"] = json.dumps(wanted)
    for draw, known in (
        (latch_rate, {"min 0.3 rad/s": 0.3, "max 0.75 rad/s": 0.75}),
        (lock_impulse, {"max 2 N m s": 2.0}),
    ):
        for axes in draw(campaign).axes:
            assert {text.get_text(): text.xy[1] for text in axes.texts} == known
            heights = [line.get_ydata()[0] for line in axes.lines if len(line.get_ydata()) == 2]
            assert set(known.values()) <= set(heights)
        assert not cut_words(draw(campaign))


def test_locks_of_a_run_stand_by_section(campaign: xr.Dataset) -> None:
    run = campaign.isel(sample=3, drop=True)
    panels = locks(run).axes
    names = ("lock_time", "latch_rate", "lock_impulse")
    for axes, name in zip(panels, names, strict=True):
        for row, line in zip(run[name].to_numpy(), axes.lines, strict=False):
            assert line.get_xdata().round().tolist() == run["section"].values.tolist()
            assert line.get_ydata() == pytest.approx(row)
    upper, lower = (line.get_xdata() for line in panels[0].lines)
    assert (lower > upper).all()  # planes that lock alike do not hide each other
    assert panels[1].lines[-1].get_ydata()[0] == LEAST
    assert len(locks(run.drop_vars(["latch_rate", "lock_impulse"])).axes) == 1


@pytest.mark.usefixtures("settled")
def test_marks_that_are_nearly_alike_are_whole(campaign: xr.Dataset) -> None:
    """Impulses of all V-joints within a hundredth, in a run and in a campaign."""
    campaign["lock_impulse"] = 10.6 + 1e-2 * campaign["lock_impulse"] / 20.0
    for figure in (locks(campaign.isel(sample=3, drop=True)), lock_impulse(campaign)):
        figure.draw_without_rendering()
        axes = figure.axes[2 if len(figure.axes) == 3 else 0]
        most = max(np.nanmax(line.get_ydata()) for line in axes.lines)
        radius = max(line.get_markersize() for line in axes.lines) * figure.dpi / 144.0
        top = axes.transData.transform((0.0, most))[1] + radius
        assert top < axes.get_window_extent().y1
        assert axes.get_ylim()[0] == 0.0


def test_the_base_turns_and_moves_as_the_run_recorded() -> None:
    craft = {"mass": 20.0, "inertia": [3.0, 3.0, 2.0]}
    values = {
        "structure.sections": 3, "spacecraft": craft, "solver.end_time": 1.0,
        "record.reactions": True, "record.positions": True,
    }  # fmt: skip
    run = simulate(load_scene("ring18-cable").with_values(values))
    ((_, figure),) = figures_of(run, "base")
    turn, rate, _, force, _ = figure.axes
    known = run["base_rotation"].dropna("time")
    way = run["position"].sel(point="upper corner 1").dropna("time")
    loads = (run[name].dropna("time") for name in ("base_force", "base_torque"))
    turning = run["base_rate"].dropna("time")
    drawn = zip(figure.axes, (known, turning, way - way[..., 0], *loads), strict=True)
    for axes, wanted in drawn:
        for row, line in zip(wanted.transpose("axis", "time").values, axes.lines, strict=False):
            assert line.get_ydata()[: len(row)] == pytest.approx(row)
    assert "(deg)" in turn.get_ylabel()
    assert "(deg/s)" in rate.get_ylabel()
    assert "(N)" in force.get_ylabel()
    told = "Attitude, rate, place, force and torque of the spacecraft"
    assert " ".join(figure.get_suptitle().split()).startswith(told)
    # A peak that records miss is told with how far these are apart, and no other one.
    size = float((run["base_force"] ** 2).sum("axis").max() ** 0.5)
    between = 0.5 * float(run["time"][3] + run["time"][4])
    for high, missed in ((9.0 * size, True), (size, False)):
        seen = run.assign(peak_base_force=high).drop_vars("peak_base_force_time")
        seen = seen.assign(peak_base_force_time=between) if missed else seen
        ((_, figure),) = figures_of(seen, "base")
        (words,) = (t.get_text() for t in figure.axes[3].texts if "largest" in t.get_text())
        apart = float(run["time"][1] - run["time"][0])
        every = f"curves: records every {apart:.3g} s; dot: of all steps"
        assert (every in words) == missed
        assert words.startswith("largest of all steps: " if missed else "largest: ")
    # The title tells no more than there is.
    still = run.assign(base_rotation=0.0 * run["base_rotation"])
    ((_, figure),) = figures_of(still, "base")
    assert figure.get_suptitle().startswith("Force and torque of the base")
    assert len(figure.axes) == 2
    bare = run.drop_vars(["base_rate", "base_force", "base_torque", "position"])
    ((_, figure),) = figures_of(bare, "base")
    assert figure.get_suptitle().startswith("Attitude of the spacecraft")
    assert not list(figures_of(still.drop_vars(["base_force", "base_torque"]), "base"))


def test_motors_of_a_run_have_a_panel_a_quantity(campaign: xr.Dataset) -> None:
    run = with_motors(campaign).isel(sample=3, drop=True)
    torque, speed = motors(run).axes
    for axes, name in ((torque, "motor_torque"), (speed, "motor_speed")):
        rows = run[name].transpose("plane", "winch", "time").to_numpy()[:, 0]
        for row, line in zip(rows, axes.lines, strict=False):
            assert line.get_ydata() == pytest.approx(row, nan_ok=True)
    # A peak between two records stands beside the curves, which stay alike for both motors.
    high = 9.0 * float(abs(run["motor_torque"]).max())
    panel, _ = motors(run.assign(peak_motor_torque=high, peak_motor_torque_time=2.05)).axes
    assert [len(line.get_xdata()) for line in panel.lines[:3]] == [len(run["time"])] * 2 + [1]
    assert panel.lines[2].get_ydata().tolist() == [high]
    (told,) = (t.get_text() for t in panel.texts if t.get_text().startswith("largest"))
    assert told.startswith("largest of all steps: ")
    assert "curves: records every" in told
    assert [t.get_text() for t in motors(run).legends[0].get_texts()] == [
        "upper cable", "lower cable",
    ]  # fmt: skip


def test_the_whole_course_of_the_margin_is_within_its_axis(campaign: xr.Dataset) -> None:
    made = with_motors(campaign)
    made["drive_margin"] = made["drive_margin"] * np.where(made["time"] > 4.0, 40.0, 1.0)
    axes = margin(made).axes[1]
    low, high = axes.get_ylim()
    drawn = [line.get_ydata() for line in axes.lines if len(line.get_ydata()) > 2]
    assert low < min(map(np.nanmin, drawn))
    assert high > max(map(np.nanmax, drawn)) > 20.0


def test_a_ring_whose_latches_missed_is_not_over_when_it_came_to_180_degrees() -> None:
    """Its motors go on, and it may fold again: neither is taken for a ring that is locked."""
    made = with_motors(made_campaign(3))
    made["deployment_time"][:] = 4.0
    made["final_time"][:] = 9.0
    made["outcome"][1] = int(Fate.NOT_LATCHED)
    assert ends(made).tolist() == [4.0, 9.0, 4.0]
    assert ends(made.drop_vars("outcome")).tolist() == [4.0, 4.0, 4.0]
    # Also of one that its motors overloaded while a latch did not catch.
    joints = made.sizes["plane"] * made.sizes["section"]
    count = ("sample", np.full(3, joints))
    over = made.copy(deep=True).assign(
        locked_joints=count, latched_joints=("sample", [joints, joints - 1, joints])
    )
    over["outcome"][1] = int(Fate.OVERLOADED)
    assert ends(over).tolist() == [4.0, 9.0, 4.0]
    run = over.isel(sample=1, drop=True)
    assert np.isnan(locked_time(run))
    assert motors_of_samples(made.drop_vars("outcome")).axes
    lines = {line.get_label(): line for line in motors_of_samples(made).axes[0].lines}
    assert lines["deployed (2), line: sample 0"].get_xdata()[-1] == 4.0
    assert lines["not latched (1), line: sample 1"].get_xdata()[-1] == 9.0
    over = xr.DataArray(ends(made), dims="sample")
    made["opening_angle"] = made["opening_angle"].where(made["time"] <= over)
    held = courses(made, (0.0, 1.0)).bands.sel(time=8.0)
    angle = made["opening_angle"].isel(sample=1).sel(time=8.0)
    own = (angle - angle.mean()).transpose("plane", "section").to_numpy()
    wanted = np.stack([np.minimum(own, 0.0), np.maximum(own, 0.0)])
    assert held.transpose("quantile", "plane", "section").to_numpy() == pytest.approx(
        wanted, abs=1e-4
    )
    assert TIMES[-1] == 10.0


def with_margin(least: float, moment: float, stop: float) -> xr.Dataset:
    """A run of motors by the standard of NASA: its margin falls from 1 to ``least`` at a time (s),
    and rises to 2 again; the upper winch stops at 2.5 s, the lower at a time of its own.
    """
    made = with_motors(made_campaign(1)).isel(sample=0, drop=True)
    scene = load_scene("ring18-motor").with_values({
        "structure.sections": SECTIONS, "margin.kind": "nasa-std-5017b",
        "cables.upper.winch.stop_time": 2.5,
        "cables.lower.winch.stop_time": stop if math.isfinite(stop) else "none",
    })  # fmt: skip
    made["drive_margin"] = made["drive_margin"].copy(
        data=np.interp(TIMES, [0.0, moment, 10.0], [1.0, least, 2.0])
    )
    kinds = {"resistance": ["pulley friction"]}
    told = {"units": "N m"}
    return made.assign_coords(kinds).assign(
        drive_available=("time", 1.0 + TIMES, told),
        drive_resistance=(("resistance", "time"), np.ones((1, len(TIMES))), told),
        least_drive_margin=least, least_drive_margin_time=moment,
        least_drive_margin_angle=20.0 + 16.0 * moment,
    ).assign_attrs(scene=scene.to_toml())  # fmt: skip


@pytest.mark.parametrize(
    ("moment", "stop", "told"),
    [
        (5.0, math.inf, "least margin -0.005 at 100 deg"),
        (2.0, 6.0, "least margin -0.005 at 52 deg; "
         "no margin from 6 s on: all winches have stopped"),
    ],
)  # fmt: skip
def test_the_margin_of_a_run_ends_where_the_last_winch_stops(
    moment: float, stop: float, told: str
) -> None:
    run = with_margin(-0.005, moment, stop)
    axes = drive(run).axes[1]
    words, factors = axes.get_title(loc="left").split("\n")  # above the frame, where no curve runs
    assert words == told
    assert "factors of the standard" in factors
    assert axes.get_ylabel().startswith("Margin by NASA-STD-5017B")
    last = TIMES[stop > TIMES][-1]
    curve, _, least = axes.lines
    known = np.isfinite(curve.get_ydata())
    assert curve.get_xdata()[known][-1] == pytest.approx(20.0 + 16.0 * last)
    assert least.get_ydata()[0] == pytest.approx(curve.get_ydata()[known].min())


def test_margins_of_a_campaign_end_where_the_last_winch_of_a_sample_stops() -> None:
    """By the rule of the run's figure, for winches that the scene stops, and that samples do."""
    campaign = with_motors(made_campaign(6))
    assert campaign["cables_lower_winch_stop_time"].values[:2].tolist() == ["3.0", "none"]
    campaign["cables_lower_winch_stop_time"].attrs["path"] = "cables.lower.winch.stop_time"
    campaign.attrs["design"] = '{"kind": "one-at-a-time"}'
    assert np.isinf(drive_end(campaign)).all()  # the upper winch goes on
    values = {"structure.sections": SECTIONS, "cables.upper.winch.stop_time": 2.0}
    scene = load_scene("ring18-motor").with_values(values)
    campaign.attrs["scene"] = scene.to_toml()
    assert drive_end(campaign).tolist() == [3.0, np.inf] * 3
    lower = margin(campaign).axes[1]
    ends = []
    for line in lower.lines[:6]:
        angle, known = line.get_xdata(), np.isfinite(line.get_ydata())
        ends.append(angle[known][-1])
    # Samples 0, 2 and 4 stop at 3 s, and the last record before is that of 2.5 s.
    assert ends[::2] == pytest.approx([20.0 + 16.0 * 2.5] * 3, abs=1.1)
    assert ends[1::2] == pytest.approx([180.0] * 3)
    (legend,) = margin(campaign).legends
    told = " ".join(legend.get_title().get_text().split())
    assert "Curves end where the last winch stops, in 3 samples" in told
