"""Figures show what the dataset holds, in its own units."""

from __future__ import annotations

import functools
import subprocess
import sys
from collections.abc import Callable

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from loops import for_each
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.text import Text

from ringsim import plots
from ringsim.dataset import to_dataset
from ringsim.outputs import VARIABLES
from ringsim.plots import figures, style
from ringsim.plots.figures import PICTURES, draw_figures, figures_of, left_out, names_for
from ringsim.plots.ring import ring
from ringsim.plots.rods_and_cables import default_sections, rod_stress
from ringsim.plots.run import (
    asynchrony,
    energy,
    imbalance,
    opening_angles,
    section_map,
)
from ringsim.refusal import InputError
from ringsim.scene import load_scene, scene_from_toml
from ringsim.variables import Fate, Outcome, Status

Drawn = Callable[..., tuple[Figure, bool]]
DRAWINGS = [opening_angles, asynchrony, rod_stress, energy, ring, section_map]
CHARTS = [opening_angles, asynchrony, rod_stress, energy, section_map]


def words(figure) -> str:
    """Everything written on a figure."""
    return "\n".join(text.get_text() for text in figure.findobj(mpl.text.Text))


def settings() -> dict:
    """Matplotlib's, without the backend: reading that one chooses it."""
    return {name: mpl.rcParams[name] for name in mpl.rcParams if name != "backend"}


def dashed_lines(axes) -> list[float]:
    """Times of the vertical lines."""
    vertical = [
        line for line in axes.lines if len(set(line.get_xdata())) == 1 < len(line.get_xdata())
    ]
    return [float(line.get_xdata()[0]) for line in vertical]


@pytest.fixture(scope="module")
def drawn(deployed: xr.Dataset, failed: xr.Dataset) -> Drawn:
    """A figure of one of the two runs, drawn once, and whether that changed data or settings."""

    @functools.cache
    def drawn(draw: Callable[[xr.Dataset], Figure], *, well: bool = True) -> tuple[Figure, bool]:
        run = deployed if well else failed
        data, before = run.copy(deep=True), settings()
        figure = draw(run)
        return figure, not run.identical(data) or settings() != before

    return drawn


@pytest.mark.parametrize(
    ("draw", "name", "label"),
    [
        (opening_angles, "opening_angle", "Some name (deg)"),
        (asynchrony, "asynchrony", "Some name (deg)"),
        (rod_stress, "rod_stress", "Some name (MPa)"),
        (energy, "work", "some name"),
        (section_map, None, None),
    ],
)
def test_time_axis_and_values_are_named_by_the_dataset(draw, name, label, deployed):
    run = deployed.copy()
    run["time"] = run["time"].assign_attrs(long_name="moment", units="s")
    if name is not None:
        run[name] = run[name].assign_attrs(long_name="some name")
    figure = draw(run)
    assert any(axes.get_xlabel() == "Moment (s)" for axes in figure.axes)
    assert label is None or label in words(figure).splitlines()


@pytest.mark.parametrize("draw", DRAWINGS)
def test_title_names_the_scene_and_how_the_run_ended(draw, drawn, deployed):
    text = words(drawn(draw)[0])
    assert deployed.attrs["title"] in text
    assert "Deployed after 17.58 s" in text
    text = " ".join(words(drawn(draw, well=False)[0]).split())
    assert "Solver failed after 9.25 s: the step fell below its bound" in text


@pytest.mark.parametrize("draw", CHARTS)
def test_deployment_time_is_marked_only_if_there_is_one(draw, drawn, deployed):
    times = [time for axes in drawn(draw)[0].axes for time in dashed_lines(axes)]
    assert times
    assert set(times) == {float(deployed.deployment_time)}
    late = drawn(draw, well=False)[0]
    assert not [time for axes in late.axes for time in dashed_lines(axes)]


@pytest.mark.parametrize("draw", DRAWINGS)
def test_drawing_leaves_data_and_settings_as_they_were(draw, drawn):
    assert not drawn(draw)[1]
    assert not drawn(draw, well=False)[1]


def test_every_section_of_both_planes_has_its_line(drawn, deployed):
    figure = drawn(opening_angles)[0]
    upper, lower = figure.axes[0], figure.axes[1]
    for axes, plane in ((upper, "upper"), (lower, "lower")):
        (lines,) = [c for c in axes.collections if isinstance(c, LineCollection)]
        segments = lines.get_segments()
        assert lines.get_array().tolist() == list(range(1, 19))
        for section, segment in enumerate(segments, start=1):
            wanted = deployed.opening_angle.sel(plane=plane, section=section)
            np.testing.assert_array_equal(segment[:-1, 0], deployed.time)
            np.testing.assert_array_equal(segment[:-1, 1], wanted)
            assert segment[-1].tolist() == [float(deployed.final_time), 180.0]


def test_courses_of_a_deployed_ring_go_on_behind_its_last_record(deployed, failed):
    run = deployed.isel(time=slice(0, 170))  # up to 16.9 s
    for axes, last in zip(opening_angles(run).axes[:4], (180.0, 180.0, 0.0, 0.0), strict=True):
        for segment in axes.collections[0].get_segments():
            times = [float(run.deployment_time), *[float(run.final_time)] * (last > 0.0)]
            assert segment[-len(times) :].tolist() == [[time, last] for time in times]
    for segment in opening_angles(failed).axes[0].collections[0].get_segments():
        assert segment[-1, 0] < float(failed.final_time)
    (line,) = (line for line in asynchrony(run).axes[0].lines if len(line.get_xdata()) > 2)
    assert line.get_xydata()[-1].tolist() == [float(run.deployment_time), 0.0]


def test_deviations_add_up_to_nothing(drawn):
    figure = drawn(opening_angles)[0]
    shown = [c for axes in figure.axes[2:4] for c in axes.collections]
    total = sum(segment[:, 1] for lines in shown for segment in lines.get_segments())
    np.testing.assert_allclose(total, 0.0, atol=1e-11)  # 36 roundings of values up to 180


def test_no_deviation_leaves_its_panel(deployed):
    run = deployed.copy(deep=True)
    run["opening_angle"].values[0, 3, 120] += 60.0
    for axes in opening_angles(run).axes[2:4]:
        low, high = axes.get_ylim()
        heights = np.concatenate([s[:, 1] for s in axes.collections[0].get_segments()])
        assert low < heights.min()
        assert heights.max() < high


def test_the_map_shows_the_deviations_and_who_is_farthest_apart(deployed):
    run = deployed.assign(asynchrony_leader_plane="lower", asynchrony_leader_section=7)
    figure = section_map(run)
    until = deployed.time.values <= float(deployed.deployment_time)
    angles = deployed.opening_angle.values[..., until]
    for number, axes in enumerate(figure.axes[:2]):
        image = axes.collections[0]
        wanted = angles[number] - angles.mean(axis=(0, 1))
        np.testing.assert_allclose(image.get_array(), wanted, atol=1e-12)  # roundings of 180
        assert image.get_clim()[1] >= np.abs(wanted).max()
        assert image.get_clim() == figure.axes[0].collections[0].get_clim()
    found = {m.get_marker(): m for a in figure.axes[:2] for m in a.lines if m.get_marker() in "^v"}
    at = int(deployed.asynchrony.values.argmax())
    least = np.unravel_index(angles[..., at].argmin(), angles.shape[:2])
    assert (found["v"].axes, found["v"].get_ydata()) == (figure.axes[least[0]], [least[1] + 1])
    assert (found["^"].axes, found["^"].get_ydata()) == (figure.axes[1], [7])
    assert {mark.get_xdata()[0] for mark in found.values()} == {deployed.time.values[at]}


def test_locks_are_marked_at_their_times(drawn, deployed):
    for axes, plane in zip(drawn(opening_angles)[0].axes, ("upper", "lower"), strict=False):
        marks = np.asarray(axes.collections[-1].get_offsets())
        np.testing.assert_array_equal(marks[:, 0], deployed.lock_time.sel(plane=plane))
        assert set(marks[:, 1]) == {180.0}


@pytest.mark.parametrize(("peak", "scale"), [(1.0, "linear"), (1000.0, "log")])
def test_a_peak_of_stress_at_the_lock_does_not_flatten_the_rest(peak, scale, deployed):
    run = deployed.copy(deep=True)
    run["rod_stress"].values[..., -1] *= peak
    for axes in rod_stress(run).axes:
        assert axes.get_yscale() == scale
        shown = np.concatenate([line.get_ydata() for line in axes.lines])
        assert np.nanmax(shown) < axes.get_ylim()[1]


def test_the_rebound_does_not_set_the_scale_of_the_deviations(drawn, deployed):
    run = deployed.copy(deep=True)
    run["opening_angle"].values[0, 3, -1] = 90.0
    both = drawn(opening_angles)[0], opening_angles(run)
    limits = [[axes.get_ylim() for axes in figure.axes[2:4]] for figure in both]
    assert limits[0] == limits[1]


@pytest.mark.parametrize(
    ("sections", "chosen"), [(1, (1,)), (2, (1, 2)), (3, (1, 2)), (6, (1, 3)), (18, (1, 9))]
)
def test_stress_is_shown_at_the_boom_and_half_way_round(sections, chosen):
    assert default_sections(sections) == chosen


def test_stress_lines_are_the_halves_of_the_diagonals_in_black_and_red(drawn, deployed):
    for axes, diagonal in zip(drawn(rod_stress)[0].axes, ("rising", "falling"), strict=False):
        lines = [line for line in axes.lines if len(line.get_xdata()) > 2][:4]
        wanted = [
            deployed.rod_stress.sel(rod=f"diagonal_{diagonal}_{half}", section=section)
            for section in (1, 9)
            for half in ("left", "right")
        ]
        for line, values in zip(lines, wanted, strict=True):
            np.testing.assert_array_equal(line.get_ydata(), 1e-6 * values)
        red = [mpl.colors.to_rgb(line.get_color())[0] > 0.5 for line in lines]
        assert red == [False, False, True, True]
        # In grey dashes tell sections apart, and widths halves.
        assert [line.get_linestyle() for line in lines] == ["-", "-", "--", "--"]
        assert lines[0].get_linewidth() == lines[2].get_linewidth() > lines[1].get_linewidth()


def test_limits_of_loads_are_drawn_and_within_the_axes(deployed, scene_of):
    held = scene_of(18).with_values({"limits.rod_stress": 9e6, "record.stress": True})
    for axes in rod_stress(deployed.assign_attrs(scene=held.to_toml())).axes:
        assert [9.0, 9.0] in [list(line.get_ydata()) for line in axes.lines]
        assert axes.get_ylim()[1] > 9.0
        assert "limits.rod_stress = 9 MPa" in [text.get_text() for text in axes.texts]
    assert not any("limits." in text.get_text() for text in rod_stress(deployed).findobj(Text))


@pytest.mark.usefixtures("settled")
def test_names_of_panels_leave_the_words_of_limits_free(deployed, scene_of):
    """Wherever the limit is: near the top of the axes the corner is taken."""
    for limit in (2e6, 9e6, 1e8):
        held = scene_of(18).with_values({"limits.rod_stress": limit, "record.stress": True})
        figure = rod_stress(deployed.assign_attrs(scene=held.to_toml()))
        figure.draw_without_rendering()
        for axes in figure.axes:
            (told,) = (text for text in axes.texts if text.get_text().startswith("limits."))
            for text in axes.texts:
                if text.get_gid() == style.FREE:
                    box = text.get_bbox_patch().get_window_extent()
                    assert not box.overlaps(told.get_window_extent())


@pytest.mark.usefixtures("settled")
def test_stress_on_axes_is_in_megapascal_wherever_its_values_are():
    figure = Figure()
    axes = figure.subplots()
    axes.plot([1e6, 3e7], [1.0, 2.0])
    axes.set_xlabel("Largest stress (Pa)")
    axes.set_ylabel("Force (N)")
    axes.set_title("of stress (Pa)")
    style.in_readable_units(figure)
    figure.draw_without_rendering()
    told = [axes.get_xlabel(), axes.get_ylabel(), axes.get_title()]
    assert told == ["Largest stress (MPa)", "Force (N)", "of stress (MPa)"]
    for place, tick in zip(axes.get_xticks(), axes.get_xticklabels(), strict=True):
        assert float(tick.get_text()) == pytest.approx(1e-6 * place)


@pytest.mark.usefixtures("settled")
def test_a_vertical_axis_without_a_name_has_the_unit_of_its_panel_s_title():
    figure = Figure()
    stress, force, share = figure.subplots(1, 3)
    for axes, title in ((stress, "Largest stress (Pa)"), (force, "Force (N)"), (share, "Share")):
        axes.plot([0.0, 1.0], [4e6, 9e6])
        axes.set_title(title, loc="left")
    style.in_readable_units(figure)
    figure.draw_without_rendering()
    assert stress.get_title(loc="left") == "Largest stress (MPa)"
    for axes, factor in ((stress, 1e-6), (force, 1.0), (share, 1.0)):
        scale = float(axes.yaxis.get_offset_text().get_text() or 1.0)
        told = [scale * float(tick.get_text()) for tick in axes.get_yticklabels()]
        assert told == pytest.approx(factor * axes.get_yticks())
    bare = Figure()
    bare.suptitle("Stress (Pa)")
    style.in_readable_units(bare)
    assert bare.get_suptitle() == "Stress (Pa)"


@for_each("sections", [[], [0], [1, 19], range(1, 8)])
def test_sections_that_do_not_exist_are_refused(sections, deployed):
    with pytest.raises(ValueError, match=r"sections = .* 1\.\.18"):
        rod_stress(deployed, sections)


def test_imbalance_is_what_the_energies_lack(deployed):
    lack = imbalance(deployed).values
    drift = 1e-6 * np.sin(deployed.time) * np.clip(deployed.time / 17.58, 0.0, 1.0)
    np.testing.assert_allclose(lack, -drift, atol=1e-15)  # rounding of energies below 0.1 J


def test_energies_are_drawn_in_the_unit_of_the_label(drawn, deployed):
    upper, lower = drawn(energy)[0].axes
    assert upper.get_ylabel() == "Energy (mJ)"
    np.testing.assert_array_equal(upper.lines[0].get_ydata(), 1e3 * deployed.work)
    assert lower.get_ylabel() == "Imbalance (µJ)"
    np.testing.assert_array_equal(lower.lines[1].get_ydata(), 1e6 * imbalance(deployed))
    assert "2.3e-05" in lower.get_title(loc="left")


@pytest.mark.usefixtures("settled")
@pytest.mark.parametrize(
    ("sections", "closed"), [(1, False), pytest.param(6, True, marks=pytest.mark.slow), (72, True)]
)
def test_no_words_leave_the_sheet_or_meet(sections, closed, scene_of, made_run):
    run = made_run(scene_of(sections, closed=closed))
    for draw in DRAWINGS:
        figure = draw(run)
        figure.draw_without_rendering()
        sheet = figure.bbox
        loose = [t for a in figure.axes for t in (*a.texts, a.title, a._left_title)]
        loose += [a.xaxis.label for a in figure.axes] + [a.yaxis.label for a in figure.axes]
        loose += figure.texts
        boxes = [t.get_window_extent() for t in loose if t.get_text() and t.get_visible()]
        for number, box in enumerate(boxes):
            assert box.x0 >= sheet.x0 - 1, draw.__name__
            assert box.x1 <= sheet.x1 + 1, draw.__name__
            assert box.y0 >= sheet.y0 - 1, draw.__name__
            assert box.y1 <= sheet.y1 + 1, draw.__name__
            assert not any(box.overlaps(other) for other in boxes[:number]), draw.__name__


OF_RINGS = {"opening_angles", "asynchrony", "section_map", "rod_stress", "ring", "energy"}
"""Figures of a ring without cables."""


def test_only_figures_that_apply_are_written(tmp_path, deployed, scene_of, made_run):
    assert set(names_for(deployed)) == OF_RINGS | {"locks"}
    plain = made_run(scene_of(6, parts=False), stress=False)
    paths = draw_figures(plain, tmp_path / "plain")
    names = OF_RINGS - {"rod_stress"} | {"locks"}
    assert {path.name for path in paths} == {f"run-fig-{name}.png" for name in names}
    for path in paths:
        assert path.read_bytes().startswith(b"\x89PNG")
    assert sorted((tmp_path / "plain").iterdir()) == sorted(paths)


def test_runs_that_ended_early_are_drawn_as_far_as_they_got(tmp_path, failed, unfinished):
    assert len(names_for(failed)) == len(OF_RINGS)
    assert len(draw_figures(unfinished, tmp_path)) == len(OF_RINGS)


def test_a_single_record_can_be_drawn(tmp_path, scene_of, made_run):
    run = made_run(scene_of(6), status=Status.DIVERGED, until=0.01)
    assert len(draw_figures(run, tmp_path)) == len(OF_RINGS)


def test_a_run_without_records_has_no_figures(tmp_path, deployed):
    scene = scene_from_toml(deployed.attrs["scene"], source="test")
    crashed = to_dataset(Outcome(Status.CRASHED, "the solver process died"), scene)
    assert draw_figures(crashed, tmp_path) == []


def test_a_folder_that_cannot_be_made_is_refused(tmp_path, deployed):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(InputError, match="taken"):
        draw_figures(deployed, tmp_path / "taken")


def test_every_drawn_variable_is_defined():
    assert {name for picture in PICTURES for name in picture.needs} <= set(VARIABLES)


def test_a_title_with_dollars_is_no_formula(deployed):
    figure = opening_angles(deployed.assign_attrs(title=r"between $\frac{$ and $5"))
    figure.draw_without_rendering()
    assert r"between \$\frac{\$ and \$5" in words(figure)


def test_importing_the_figures_changes_no_global_setting():
    check = (
        "import sys, matplotlib as mpl; "
        "settings = lambda: {k: mpl.rcParams[k] for k in mpl.rcParams if k != 'backend'}; "
        "before = settings(); import ringsim.plots.run; "
        "assert settings() == before; assert 'matplotlib.pyplot' not in sys.modules"
    )
    found = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True)
    assert found.returncode == 0, found.stderr


@pytest.mark.usefixtures("settled")
def test_a_long_ending_stands_clear_of_what_is_above_the_axes(deployed):
    """Words of the lock above the right end of the axes, and the second line of the ending."""
    long = deployed.assign(outcome=int(Fate.OVERLOADED))
    long.attrs = long.attrs | {"reason": "all V-joints have locked; a limit was passed " * 6}
    figure = opening_angles(long)
    figure.draw_without_rendering()
    axes = figure.axes[0]
    (lock,) = [text for text in axes.texts if text.get_text().startswith("all locked")]
    (title,) = [
        text for text in axes.findobj(mpl.text.Text) if text.get_text().startswith("Overloaded")
    ]
    ending = title.get_window_extent()
    assert ending.height > 1.5 * lock.get_window_extent().height  # two lines
    assert not ending.overlaps(lock.get_window_extent())


def test_an_ending_that_is_too_long_ends_with_a_clause(deployed):
    why = "came to rest with 12 of 24 V-joints locked, none of the lower plane: no winch moves the "
    why += "ring, and every V-joint has kept within 0.57 deg for 12 s"
    then = "steps of 47.2 ms at the lock at 25.3304 s are too long for shocks in the rods"
    long = deployed.assign(outcome=int(Fate.PARTLY_DEPLOYED))
    long.attrs = long.attrs | {"reason": f"{why}; {then}"}
    for inches, last in ((8.0, why), (14.0, then)):
        told = " ".join(style.heading(long, "Locks", inches)[1].split())
        assert told.endswith(last)


def test_the_enlarged_end_says_where_it_begins(deployed, unfinished):
    for run in (deployed, unfinished):
        _, close = asynchrony(run).axes
        (told,) = (t.get_text() for t in close.texts if "enlarged" in t.get_text())
        assert told == f"from {close.get_xlim()[0]:.3g} s on, enlarged"


def test_angles_have_one_unit_in_all_figures_of_a_run(deployed):
    for each, figure in figures_of(deployed):
        assert "degree" not in words(figure), each.name


def test_a_structure_without_joints_between_rods_is_told_what_is_not_drawn(
    deployed: xr.Dataset,
) -> None:
    planar = deployed.assign_attrs(scene=load_scene("planar-truss").to_toml())
    assert not {*names_for(planar)} & {"opening_angles", "ring", "cables"}
    assert left_out(planar).startswith("not drawn: opening_angles, section_map, ")
    assert left_out(deployed) == ""


def test_a_figure_is_one_entry(deployed: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plots, "known", dict(plots.known))

    @plots.picture("run", 15, "Nothing", ("asynchrony",))
    def nothing(run: xr.Dataset) -> Figure:
        return Figure()

    made = plots.known["run", "nothing"]
    monkeypatch.setattr(figures, "PICTURES", (made, *figures.PICTURES))
    assert next(figures_of(deployed))[0] is made


@pytest.mark.usefixtures("settled")
@pytest.mark.parametrize("told", [r"$\frac{$", "\x1b[31mred", "x" * 200_000])
def test_words_of_a_file_are_drawn_whatever_they_are(deployed: xr.Dataset, told: str) -> None:
    """No formula that matplotlib refuses, no letter without a sign, no end of layout."""
    dataset = deployed.copy(deep=True).assign_attrs(reason=told, title=told)
    for name in ("opening_angle", "section"):
        dataset[name].attrs |= {"long_name": told, "units": told}
    [(_, figure)] = figures_of(dataset, "opening_angles")
    figure.draw_without_rendering()
    assert dataset["section"].attrs["units"] == told
