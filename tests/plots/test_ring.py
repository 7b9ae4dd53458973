"""The drawn ring is the ideal ring, to scale."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from made_campaign import made_campaign, with_positions
from matplotlib.collections import LineCollection

import ringsim
from ringsim.plots.ring import LOOKS, facing_azimuth, instants, lines_at, modes, ring, view
from ringsim.scene import load_scene, scene_from_toml
from ringsim.simulation import simulate

LEFT = [*range(6), *range(12, 18)]
"""Left halves of the bars of six sections, upper plane first."""


def lengths(lines: np.ndarray) -> np.ndarray:
    return np.linalg.norm(lines[:, 1] - lines[:, 0], axis=-1)


@pytest.mark.parametrize("angle", [1.0, 46.0, 110.0, 180.0])
@pytest.mark.parametrize(("sections", "closed"), [(1, False), (2, False), (6, True), (18, True)])
def test_rods_keep_their_lengths_while_the_ring_opens(sections, closed, angle, scene_of):
    scene = scene_of(sections, closed=closed)
    parts = lines_at(scene, np.radians(np.full((2, sections), angle)))
    structure = scene.structure
    assert parts["diagonals"].shape == (4 * sections, 2, 3)
    assert parts["bars"].shape == (4 * sections, 2, 3)
    np.testing.assert_allclose(lengths(parts["diagonals"]), structure.half_diagonal, rtol=1e-12)
    np.testing.assert_allclose(lengths(parts["bars"]), structure.half_bar, rtol=1e-12)
    np.testing.assert_allclose(
        lengths(parts["hinge assemblies"]), structure.hinge_offset, rtol=1e-10
    )
    np.testing.assert_allclose(lengths(parts["boom"]), scene.boom.length, rtol=1e-12)


def test_a_section_that_is_ahead_is_drawn_ahead(scene_of):
    scene = scene_of(6)
    opening = np.full((2, 6), 100.0)
    bars = lines_at(scene, np.radians(opening))["bars"]
    opening[0, 2] = 130.0
    opening[1, 4] = 70.0
    shifted = lines_at(scene, np.radians(opening))["bars"]
    depth, moved = (np.abs(np.diff(lines[LEFT, :, 2]))[:, 0] for lines in (bars, shifted))
    half = scene.structure.half_bar
    expected = half * np.sin(np.radians(90.0 - 0.5 * opening)).ravel()
    np.testing.assert_allclose(depth, half * np.sin(np.radians(40.0)), rtol=1e-12)
    np.testing.assert_allclose(moved, expected, rtol=1e-12)


def test_parts_that_the_scene_leaves_out_are_not_drawn(scene_of):
    lines = lines_at(scene_of(6, parts=False), np.radians(np.full((2, 6), 90.0)))
    assert set(lines) == {"diagonals", "bars", "hinge assemblies", "V-joints"}


def test_springs_are_taut_beyond_their_neutral_length(scene_of):
    scene = scene_of(18)
    stowed = lines_at(scene, np.radians(np.full((2, 18), 40.0)))
    deployed = lines_at(scene, np.radians(np.full((2, 18), 180.0)))
    assert "net, taut" not in stowed
    assert "net, slack" not in deployed
    assert len(stowed["net, slack"]) == len(deployed["net, taut"]) == 18
    assert lengths(deployed["net, taut"]).min() > scene.net.neutral_length


@pytest.mark.parametrize("azimuth", [0.0, 42.0, -130.0])
def test_camera_keeps_all_distances(azimuth):
    points = np.random.default_rng(3).normal(size=(20, 3))
    paper, near = view(points, azimuth, 24.0)
    turned = np.concatenate([paper, near[:, None]], axis=-1)
    np.testing.assert_allclose(turned @ turned.T, points @ points.T, atol=1e-13)


def test_camera_sees_up_as_up_and_near_as_near():
    points = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1, 0]])
    paper, near = view(points, 0.0, 30.0)
    assert paper[0, 1] > 0.0
    assert paper[2, 0] == pytest.approx(1.0)
    assert near[1] == pytest.approx(np.cos(np.radians(30.0)))


def test_arcs_are_seen_from_outside(scene_of):
    scene = scene_of(5, closed=False)
    azimuth = np.radians(facing_azimuth(scene))
    towards = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    assert (scene.structure.geometry().normals @ towards > 0.0).all()


def test_instants_are_first_middle_and_deployment(deployed):
    (first, stowed), (second, half), (third, opened) = instants(deployed)
    assert (first, second, third) == ("stowed", "half-way", "deployed")
    assert float(stowed.time) == 0.0
    spacing = float(np.diff(deployed.time).max())
    assert abs(float(opened.time) - float(deployed.deployment_time)) <= 0.5 * spacing + 1e-12
    middle = 0.5 * (float(stowed.mean()) + float(opened.mean()))
    mean = deployed.opening_angle.mean(("plane", "section"))
    assert abs(float(half.mean()) - middle) == float(np.abs(mean - middle).min())


def test_instants_of_a_failed_run_end_at_its_last_record(failed):
    name, last = instants(failed)[-1]
    assert name == "end of the run"
    assert float(last.time) == pytest.approx(9.2)
    assert np.isfinite(last).all()


@pytest.mark.usefixtures("settled")
def test_drawing_is_true_to_scale(deployed):
    figure = ring(deployed)
    (axes,) = figure.axes
    figure.draw_without_rendering()
    frame = axes.get_window_extent()
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    across, up = frame.width / (right - left), frame.height / (high - low)
    assert across == pytest.approx(up, rel=1e-3)
    (bar,) = axes.lines
    metres = float(np.ptp(bar.get_xdata()))
    (words,) = [text for text in axes.texts if text.get_text() == f"{metres:g} m"]
    assert words.get_annotation_clip() is False  # it stands above the frame


@pytest.mark.parametrize(("sections", "closed"), [(1, False), (2, False), (7, True), (72, True)])
def test_views_stand_side_by_side_inside_the_sheet(sections, closed, scene_of, made_run):
    (axes,) = ring(made_run(scene_of(sections, closed=closed))).axes
    views = [
        np.concatenate(c.get_segments()) for c in axes.collections if isinstance(c, LineCollection)
    ]
    edges = [(float(v[:, 0].min()), float(v[:, 0].max())) for v in views]
    assert len(edges) == 3
    assert edges[0][0] >= -1e-9
    assert all(a[1] < b[0] for a, b in pairwise(edges))
    assert edges[-1][1] <= axes.get_xlim()[1] + 1e-9
    assert max(v[:, 1].max() for v in views) <= axes.get_ylim()[1] + 1e-9


@pytest.mark.usefixtures("settled")
@pytest.mark.parametrize("words", [3, 60])
@pytest.mark.parametrize("title", ["A ring", "A ring " + 20 * "of many words "])
def test_words_above_the_ring_stand_apart(title, words, failed):
    figure = ring(failed.assign_attrs(title=title, reason=" ".join(["came to rest"] * words)))
    figure.draw_without_rendering()
    (axes,) = figure.axes
    (head,) = (text for text in figure.texts if text.get_weight() == "bold")
    (told,) = axes.findobj(lambda each: getattr(each, "get_text", str)().startswith("Solver"))
    end, subject = told.get_window_extent(), head.get_window_extent()
    bar = next(text for text in axes.texts if text.get_text().endswith(" m")).get_window_extent()
    assert bar.y1 < end.y0 < end.y1 < subject.y0 < subject.y1 <= figure.bbox.y1


@pytest.mark.parametrize("computed", [True, False])
def test_the_spacecraft_is_drawn_where_it_is_fixed(computed):
    """At its centre of mass, on a line from the boom's upper end; computed it turns with that."""
    craft = {"mass": 20.0, "inertia": [3.0, 3.0, 2.0], "centre": [0.3, 0.0, 0.8]}
    values = {
        "structure.sections": 3, "spacecraft": craft, "solver.end_time": 0.4,
        "record.reactions": True, "record.positions": computed, "record.interval": 0.1,
    }  # fmt: skip
    run = simulate(load_scene("ring18-cable").with_values(values))
    turn = np.array([0.0, 0.0, 90.0])[:, None] * (run["time"].values > 0.0)
    run["base_rotation"] = run["base_rotation"].copy(data=turn)
    figure = ring(run)
    told = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"spacecraft", "from the boom's upper end to it"} <= {*told}
    shots = [c for c in figure.axes[0].collections if isinstance(c, LineCollection)]
    scene = scene_from_toml(run.attrs["scene"], source="test")
    for number, shot in enumerate(shots):
        away = [0.0, 0.3, 0.8] if computed and number else craft["centre"]
        wanted, _ = view(np.array(away), facing_azimuth(scene), 24.0)
        widths = shot.get_linewidths() / np.max(shot.get_linewidths())
        (arm,) = np.flatnonzero(np.isclose(widths, 2.0 / 11.0))
        ends = shot.get_segments()[arm]
        assert ends[1] - ends[0] == pytest.approx(wanted, abs=1e-9)
        body = shot.get_segments()[int(np.argmax(widths))]
        assert body[0] == pytest.approx(ends[1], abs=1e-9)
    bare = load_scene("ring18-cable").with_values({"structure.sections": 3, "solver.end_time": 0.2})
    assert "spacecraft" not in [t.get_text() for t in ring(simulate(bare)).legends[0].get_texts()]


def test_a_ring_that_folds_is_not_called_stowed(scene_of, made_run):
    run = made_run(scene_of(6), until=12.0)
    backwards = run.isel(time=slice(0, 100)).copy(deep=True)
    backwards["opening_angle"].values[:] = backwards["opening_angle"].values[..., ::-1]
    assert [name for name, _ in instants(backwards)] == ["start", "half-way", "end of the run"]


def test_joints_are_drawn_where_the_bars_meet(scene_of):
    opening = np.radians(np.linspace(60.0, 189.0, 12).reshape(2, 6))
    lines = lines_at(scene_of(6), opening)
    assert lines["V-joints"].shape == (12, 2, 3)
    meet = lines["bars"][LEFT, 1]
    np.testing.assert_allclose(lines["V-joints"][:, 0], meet, atol=1e-12)
    beyond = np.radians(180.0) < opening.ravel()
    assert beyond.any()


def test_the_deployed_ring_shows_joints_past_their_stop(deployed):
    run = deployed.copy(deep=True)
    run["opening_angle"].values[1, 4, run.time.values > run.lock_time.values[1, 4]] = 189.0
    _, opened = instants(run)[-1]
    assert float(opened.sel(plane="lower", section=5)) == pytest.approx(189.0)
    latest = deployed.lock_time == deployed.deployment_time
    assert float(opened.where(latest).max()) == pytest.approx(180.0, abs=1e-9)
    assert ring(run).axes


def test_joints_change_their_colour_when_they_lock(deployed):
    words = [text.get_text() for text in ring(deployed).legends[0].get_texts()]
    assert {"V-joints, free", "V-joints, locked"} <= set(words)
    free = deployed.assign(lock_time=deployed.lock_time.where(False), deployment_time=np.nan)
    words = [text.get_text() for text in ring(free).legends[0].get_texts()]
    assert "V-joints, locked" not in words


def test_positions_are_drawn_where_they_were_computed():
    """Stretched by a tenth along z, which no opening angle would do, the drawing is, too."""
    run = with_positions(made_campaign(1), 0.0).isel(sample=0, drop=True)
    tall = run.copy(deep=True)
    tall["position"].loc[{"axis": "z"}] *= 1.1
    heights = []
    for one in (run.drop_vars("position"), run, tall):
        figure = ring(one)
        heights.append(figure.axes[0].get_ylim()[1])
        subject = figure.get_suptitle().split(":")[0]
        assert subject == ("Deployment as computed" if "position" in one else "Deployment")
    run["base_rotation"] = ("time", "axis"), np.full((run.sizes["time"], 3), 2.0)
    assert "as computed:" in ring(run).get_suptitle()
    assert "Deployment, seen from the base:" in ring(run.drop_vars("position")).get_suptitle()
    assert heights[1] == pytest.approx(heights[0], rel=1e-6)
    assert 1.02 * heights[0] < heights[2] <= 1.1 * heights[0]


def test_more_states_are_equal_steps_of_the_mean_angle(deployed):
    moments = instants(deployed, 4)
    assert [name for name, _ in moments] == ["stowed", "stage 1", "stage 2", "deployed"]
    means = [float(angles.mean()) for _, angles in moments]
    course = deployed["opening_angle"].dropna("time", how="any").mean(("plane", "section"))
    for k in (1, 2):
        wanted = means[0] + k * (means[-1] - means[0]) / 3.0
        assert abs(means[k] - wanted) <= 1.01 * float(abs(course.diff("time")).max())
    with pytest.raises(ValueError, match="states = 1 must be at least 2"):
        instants(deployed, 1)


@pytest.mark.usefixtures("settled")
def test_shapes_of_modes_stand_below_their_words_with_the_spacecraft():
    craft = {"mass": 800.0, "inertia": [1.0, 1.0, 1.0], "centre": [0.0, 0.0, 1.5]}
    values = {"structure.sections": 3, "spacecraft": craft}
    found = ringsim.modes(load_scene("ring18").with_values(values), ["deployed"], count=2)
    figure = modes(found)
    figure.draw_without_rendering()
    (words,) = (text.get_text() for text in figure.texts if "shapes at 180 deg" in text.get_text())
    rest = found["position"].isel(angle=-1).transpose("point", "axis").values
    size = float(np.ptp(rest, axis=0).max())
    assert f"the largest displacement is drawn as {0.14 * size:.3g} m, 14 % of" in words
    assert "dot: the spacecraft's centre of mass" in words
    for panel in figure.axes[1:]:
        _, shape = [each for each in panel.collections if isinstance(each, LineCollection)]
        drawn = np.concatenate(shape.get_segments())
        high = panel.transData.transform(drawn)[:, 1].max()
        assert high < panel.title.get_window_extent().y0
        thin = max(shape.get_linewidths()) / LOOKS["boom"]["linewidth"]
        assert thin == pytest.approx(11.0 / 5.0 * 0.8 / 1.3)
