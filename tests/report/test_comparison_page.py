"""The page of a comparison tells what the comparison found, and its figures draw the samples."""

from __future__ import annotations

import itertools
import json
import re

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from loops import for_each
from made_campaign import TIMES, made_campaign, made_scene
from matplotlib.text import Text
from sheets import cut_words

from read_page import Page
from ringsim.analysis.comparison import compare
from ringsim.analysis.comparison_text import compared, names_of, sections
from ringsim.analysis.design import median_and_worst
from ringsim.analysis.intervals import good, is_moment, quantities
from ringsim.analysis.requirements import required_by
from ringsim.analysis.study import analyse
from ringsim.analysis.verdicts import verdict_table
from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.plots import comparison
from ringsim.plots.comparison import figures_of_both, pairs, values
from ringsim.report.page import comparison_page
from ringsim.report.shell import LARGEST
from ringsim.variables import Fate


@pytest.fixture(scope="module")
def both() -> tuple[xr.Dataset, xr.Dataset]:
    """Campaigns of eight samples each; the second, in a scene of its own, is 10 % less apart."""
    one, other = made_campaign(8, stalled=(4,)), made_campaign(8, failed=(2,))
    other["asynchrony_max"] = 0.9 * other["asynchrony_max"]
    other["asynchrony"] = 0.9 * other["asynchrony"]
    seeds = "sample", np.arange(8)
    scene = made_scene().with_values({"stop.stiffness": 60.0})
    other.attrs["scene"], other.attrs["title"] = scene.to_toml(), "Soft <rods>"
    return one.assign(sample_seed=seeds), other.assign(sample_seed=seeds)


def test_the_page_holds_every_cell_of_the_terminal_and_loads_nothing(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    found = compare(*both, ("ground", "flight"))
    text = comparison_page(found, *both)
    read = Page(text)
    assert len(text.encode()) < LARGEST
    assert len(read.ids) == len(set(read.ids))
    assert all(load.startswith(("#", "data:image/png;base64,")) for load in read.loads)
    cells = [c for s in sections(found).values() for t in s.tables for r in t.rows for c in r]
    assert sorted(cells) == sorted(c for c in read.cells if c in cells)
    assert {"figure-differences", "figure-values", "figure-courses"} <= set(read.ids)
    assert "What differs: flight against ground" in text
    assert "Soft &lt;rods&gt; (flight)" in text
    order = [text.index(f'id="{name}"') for name in ("requirements", "outputs", "figures")]
    assert order == sorted(order)


def test_what_may_be_off_is_told_with_verdicts_and_figures(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    """In the words of an analysis of each, and with its mark in the figures."""
    one, other = (
        each.assign(reason=("sample", np.array([REASON] * 8, dtype=object))) for each in both
    )
    found = compare(one, other)
    for side, each in enumerate((one, other)):
        words = {row[0]: row[1] for row in verdict_table(analyse(each)).rows}
        texts = found["requirement"].values
        assert found["kept_verdict_text"].values[:, side].tolist() == [words[t] for t in texts]
    (line,) = (each for each in compared(found) if each.startswith("numbers with ?"))
    assert line.startswith(
        "numbers with ? may be off, as their runs say, since steps are too long at locks: "
        "asynchrony_max in 8 of 8"
    )
    (table, *_) = sections(found)["requirements"].tables
    told = {row[0]: row[-2:] for row in table.rows}
    assert "if its numbers hold: may be off in 8 of 8" in told["asynchrony_max <= 3 deg ?"][0]
    marked = {
        text.get_text()
        for _, _, figure in figures_of_both(found, one, other) for text in figure.findobj(Text)
        if text.get_text().endswith(" ?")
    }  # fmt: skip
    assert marked
    assert all(text.startswith(("Largest asynchrony", "Largest difference")) for text in marked)


REASON = (
    "all V-joints have reached 180 deg; steps of 50 ms at the lock at 5 s are too long for shocks "
    "in the rods (period 80 ms), so asynchrony_max may be off: set solver.tolerance = 1e-04 "
    "(2 to 3 times the steps)"
)


def test_what_differs_in_the_scenes_is_told_by_path(both: tuple[xr.Dataset, xr.Dataset]) -> None:
    found = compare(*both)
    assert found["setting"].values.tolist() == ["stop.stiffness"]
    assert float(found["setting_first"].item()) == made_scene().stop.stiffness
    assert found.sel(setting="stop.stiffness")["setting_second"].item() == "60.0"
    same = compare(both[0], both[0])
    assert same.sizes["setting"] == 0
    lines = "\n".join(compared(same))
    assert "differs in" not in lines
    assert "differs in" in "\n".join(compared(found))
    assert "no outcome differs" in lines
    # A part that one of them lacks.
    held = made_scene().with_values(
        {"gravity.vector": [0.0, 0.0, -9.81], "offload.planes": "upper"}
    )
    found = compare(both[0], both[0].assign_attrs(scene=held.to_toml()))
    assert found.sel(setting="gravity.vector")["setting_first"].item() == "none"
    assert "[0.0, 0.0, -9.81]" in "\n".join(compared(found))
    assert "offload.planes" in found["setting"].values
    assert "offload.corners" not in found["setting"].values  # [], which means all of them


def test_columns_have_the_names_of_the_two_where_they_are_short(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    found = compare(*both, ("ground", "flight"))
    assert names_of(found) == ("ground", "flight")
    (table,) = sections(found)["outputs"].tables
    assert list(table.head[2:4]) == ["ground", "flight"]
    (cells,) = (row for row in table.rows if row[0] == "asynchrony_max")
    row = dict(zip(table.head, cells, strict=True))
    assert row["in %"] == "-10"
    assert compared(found)[0].endswith("(ground)")
    for names in (("a" * 17, "b"), ("same", "same")):
        assert names_of(compare(*both, names)) == ("first", "second")


def test_what_is_the_same_in_each_pair_is_one_line(both: tuple[xr.Dataset, xr.Dataset]) -> None:
    found = compare(*both)
    (table,) = sections(found)["outputs"].tables
    note, *_ = table.notes
    assert note.startswith("the same in each pair: ")
    assert "asynchrony_max" not in note
    # Equal means of other samples are not the same.
    turned = both[0].assign(peak_tension=both[0]["peak_tension"][::-1].variable)
    names = [row[0] for row in sections(compare(both[0], turned))["outputs"].tables[0].rows]
    assert "peak_tension" in names


def test_figures_draw_the_samples_of_both(both: tuple[xr.Dataset, xr.Dataset]) -> None:
    found = compare(*both, ("ground", "flight"))
    held = good(both[0]) & good(both[1])
    one, two = (each["asynchrony_max"].to_numpy()[held] for each in both)
    figure = pairs(found, both, ["asynchrony_max"])
    (axes,) = figure.axes
    dots = [line for line in axes.lines if line.get_linestyle() == "None"]
    drawn = np.concatenate([line.get_xydata() for line in dots])
    order = np.argsort(drawn[:, 0])
    assert drawn[order] == pytest.approx(np.column_stack([one, two - one])[np.argsort(one)])
    # The pair that stalled in one of them alone has a mark of its own.
    assert [len(line.get_xydata()) for line in dots] == [held.sum() - 1, 1]
    figure = values(found, both, ["asynchrony_max"])
    first, second = (line for line in figure.axes[0].lines if line.get_drawstyle() == "steps-post")
    assert first.get_label() == "ground"
    ordered = np.sort(both[1]["asynchrony_max"].to_numpy()[good(both[1])])
    assert second.get_xdata()[1:] == pytest.approx(ordered)
    assert second.get_ydata()[-1] == 1.0
    drawn = {name: figure for name, _, figure in figures_of_both(found, *both)}
    labels = [" ".join(a.get_ylabel().split()) for a in drawn["courses"].axes]
    (place,) = (k for k, each in enumerate(labels) if "difference of opening angles" in each)
    axes = drawn["courses"].axes[place]
    first, second = axes.lines
    middle, _ = median_and_worst(both[0].isel(sample=np.flatnonzero(held)))
    for line, each in ((first, both[0]), (second, both[1])):  # the same antenna in both
        row = each["asynchrony"].sel(sample=middle).to_numpy()[: len(line.get_xdata())]
        count = np.isfinite(row)
        assert line.get_ydata()[count] == pytest.approx(row[count])


def test_what_is_over_counts_on_in_the_courses(both: tuple[xr.Dataset, xr.Dataset]) -> None:
    one, late = both[0].isel(sample=range(4)).copy(deep=True), TIMES > 6.0
    angles = one["opening_angle"].transpose("sample", "plane", "section", "time").to_numpy()
    tensions = one["cable_tension"].transpose("sample", "plane", "span", "time").to_numpy()
    for recorded in (angles, tensions):  # three of four are deployed at 6 s
        recorded[:3, ..., late] = np.nan
    one["final_time"][:3], one["deployment_time"][:3] = 6.0, 6.0
    found = compare(one, both[1], ("ground", "flight"))
    (figure,) = (figure for name, _, figure in figures_of_both(found, one, both[1])
                 if name == "courses")  # fmt: skip
    middle, _ = median_and_worst(one)
    assert middle < 3
    drawn = {" ".join(a.get_ylabel().split()): a.lines[0].get_xydata() for a in figure.axes}
    time, opening = drawn["Mean opening angle (deg)"].T
    assert opening[time > 6.0] == pytest.approx(180.0)
    time, tension = drawn["Largest cable tension (N)"].T
    assert tension[-1] == pytest.approx(tensions[middle].max(axis=(0, 1))[~late][-1])
    assert "A run that has ended still counts" in figure.legends[0].get_title().get_text()


def test_a_sample_that_runs_on_ends_no_axis_of_a_comparison() -> None:
    one, other = made_campaign(30, stalled=(7,)), made_campaign(30)
    late = np.arange(30) == 7
    one["deployment_time"][:] = np.where(late, np.nan, 4.0)
    one["final_time"][:] = np.where(late, 10.0, 4.0)
    other["deployment_time"][:], other["final_time"][:] = 6.0, 6.0
    found = compare(one, other, ("ground", "flight"))
    drawn = {name: figure for name, _, figure in figures_of_both(found, one, other)}
    assert drawn["courses"].axes[0].get_xlim() == pytest.approx((0.0, 6.0))
    told = drawn["courses"].legends[0].get_title().get_text()
    assert told.endswith("\nground: 1 sample goes on, until 10 s.")


@pytest.mark.parametrize("told", [r"$\frac{$", "\x1b[31mred", "x" * 200_000])
def test_texts_of_the_files_are_drawn_whatever_they_are(told: str) -> None:
    one = made_campaign(8).assign_attrs(title=told, campaign_name=told)
    for array in (one["peak_tension"], one["opening_angle"]):
        array.attrs |= {"long_name": told, "units": told}
    found = compare(one, made_campaign(8), (told, "other"))
    for _, _, figure in figures_of_both(found, one, made_campaign(8)):
        figure.draw_without_rendering()


@pytest.mark.parametrize("slower", [2.0, 10.0])
def test_a_slow_flight_and_a_fast_test_have_an_axis_each(
    slower: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Of few times most are not behind the end of the fast one, whose records go on.
    monkeypatch.setattr(comparison, "_RECORDS", 6)
    one = made_campaign(8)
    one["final_time"][:], one["deployment_time"][:] = 5.0, 5.0
    other = one.assign_coords(time=slower * one["time"])
    other = other.assign({n: slower * one[n] for n in ("final_time", "deployment_time")})
    found = compare(one, other, ("ground", "flight"))
    drawn = {name: figure for name, _, figure in figures_of_both(found, one, other)}
    axes = drawn["courses"].axes
    fast, slow = axes[0].lines
    if slower > 3.0:  # the same courses over the share of their own time
        assert axes[0].get_xlim() == (0.0, 1.0)
        assert fast.get_xydata() == pytest.approx(slow.get_xydata())
        assert len(fast.get_xdata()) == 6
        words = "Share of 5 s in ground and of 50 s in flight, when the last ring had opened"
        assert axes[-1].get_xlabel() == words
    else:
        assert axes[0].get_xlim() == (0.0, 10.0)
        assert axes[-1].get_xlabel().endswith("run (s)")


def test_samples_that_were_cut_off_are_told_and_what_differs_comes_first(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    one = both[0].copy(deep=True)
    one["outcome"][:2] = int(Fate.CUT_OFF)
    told = "ground: 2 of 8 samples cut off at solver.end_time: "
    text = comparison_page(compare(one, both[1], ("ground", "flight")), one, both[1])
    assert told in text
    assert text.index("<h1>") < text.index('id="settings"') < text.index('id="requirements"')
    assert "cut off" not in "\n".join(compared(compare(*both)))


def test_words_of_figures_fit_their_sheets(both: tuple[xr.Dataset, xr.Dataset]) -> None:
    one, other = (each.copy(deep=True) for each in both)
    told = {"units": "s", "long_name": "longest such time of any motor"}
    for shift, each in enumerate((one, other)):
        for name in ("longest_slack", "peak_motor_torque", "longest_motor_lag"):
            each[name] = "sample", np.arange(8.0) + shift, told  # one ends a row of panels
    names = (
        ("ground-8m-hot-2", "flight-8m-cold1"),
        ("the same ring on the ground with hot motors", "b" * 60),
    )
    for first, second in names:
        found = compare(one, other, (first, second))
        for name, _, figure in figures_of_both(found, one, other):
            assert not cut_words(figure), name


def test_what_is_nearly_the_same_in_both_has_no_panel(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    """Its differences would be those of the last digits that tables give."""
    one, other = (each.copy(deep=True) for each in both)
    for each, power in ((one, 3.0), (other, 3.001)):
        values = power + 1e-4 * np.arange(8.0)
        each["peak_motor_power"] = "sample", values, {"units": "W", "long_name": "motor power"}
    (section,) = [each for each in sections(compare(one, other)).values() if each.name == "outputs"]
    (table,) = section.tables
    assert "peak_motor_power" not in [row[0] for row in table.rows]
    assert "differences and scatter below 0.1 %: peak_motor_power 3" in " ".join(table.notes)
    for _, _, figure in itertools.islice(figures_of_both(compare(one, other), one, other), 2):
        assert not any("Motor power" in axes.get_xlabel() for axes in figure.axes)
        told = " ".join(figure.legends[0].get_title().get_text().split())
        assert told == "Not drawn, because samples differ by less than 0.1 %: peak_motor_power"
    other["peak_motor_power"] += 0.01
    drawn = {name: each for name, _, each in figures_of_both(compare(one, other), one, other)}
    assert any("Motor power" in axes.get_xlabel() for axes in drawn["values"].axes)


def test_a_page_holds_the_panels_of_what_is_required_first(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    """What has no panel is named below."""
    made = [
        name for name, each in quantities().items()
        if each.dtype == "f8" and not is_moment(name) and name not in both[0]
    ][:14]  # fmt: skip
    random = np.random.default_rng(5)
    one, other = (
        each.assign({name: ("sample", random.random(8), {"units": "1"}) for name in made})
        for each in both
    )
    drawn = list(itertools.islice(figures_of_both(compare(one, other), one, other), 2))
    wanted = [name for name in required_by(one.attrs) if name in quantities()]
    assert "asynchrony_max" in wanted
    for _, _, figure in drawn:
        assert len([axes for axes in figure.axes if axes.axison]) == 12
        told = " ".join(figure.legends[0].get_title().get_text().split())
        left = told.partition("In the table alone: ")[2].split(", ")
        assert len(left) >= 3
        assert not set(left) & set(wanted)


def test_differences_have_their_unit_and_labels_stand_apart(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    one, other = (each.copy(deep=True) for each in both)
    narrow = np.linspace(7.9981, 7.99825, one.sizes["sample"])
    for each, factor in ((one, 1.0), (other, 1.1)):
        each["peak_rod_stress"] = "sample", factor * 1e6 * narrow, {"units": "Pa"}
        each["peak_net_tension"] = "sample", narrow * factor, {"units": "N"}
    found = compare(one, other, ("a", "b"))
    drawn = {name: figure for name, _, figure in figures_of_both(found, one, other)}
    figure = drawn["differences"]
    figure.draw_without_rendering()
    panels = {axes.get_xlabel(): axes for axes in figure.axes if axes.get_visible()}
    stress, net = panels["Peak_rod_stress (MPa), a"], panels["Peak_net_tension (N), a"]
    assert (stress.get_ylabel(), net.get_ylabel()) == ("(MPa)", "(N)")
    told = [float(tick.get_text().replace("\u2212", "-")) for tick in stress.get_yticklabels()]
    assert told == pytest.approx(1e-6 * stress.get_yticks(), abs=1e-6)
    for axes in (*panels.values(), *drawn["values"].axes):
        low, high = axes.get_xlim()
        shown = zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
        boxes = [tick.get_window_extent() for place, tick in shown if low <= place <= high]
        assert all(a.x1 < b.x0 for a, b in itertools.pairwise(boxes))


def test_two_runs_are_drawn_over_time(both: tuple[xr.Dataset, xr.Dataset]) -> None:
    one, other = (each.isel(sample=0, drop=True) for each in both)
    found = compare(one, other, ("a", "b"))
    drawn = {name: figure for name, _, figure in figures_of_both(found, one, other)}
    assert list(drawn) == ["courses"]
    angles = drawn["courses"].axes[0].lines[0]
    mean = one["opening_angle"].mean(["plane", "section"]).to_numpy()
    assert angles.get_ydata() == pytest.approx(mean[: len(angles.get_ydata())], nan_ok=True)
    assert "figure-courses" in comparison_page(found, one, other)


def test_the_verb_writes_the_page_and_refuses_what_it_cannot_write(
    both: tuple[xr.Dataset, xr.Dataset], tmp_path
) -> None:
    paths = [str(tmp_path / name) for name in ("a.nc", "b.nc")]
    for each, path in zip(both, paths, strict=True):
        save(each, path)
    out = tmp_path / "page.html"
    done = CliRunner().invoke(cli, ["compare", *paths, "--report", str(out)])
    assert done.exit_code == 0, done.output
    assert f"wrote {out} (" in done.output
    assert "stop.stiffness" in out.read_text(encoding="utf-8")
    for more, told in (
        (
            ["--report", str(tmp_path / "page.txt")],
            "the page is HTML: give a name such as page.html",
        ),
        (["--pdf"], "--pdf: has no effect without --report"),
        (
            ["--out", "page.html"],
            "--out page.html: it writes netCDF; the page is --report page.html",
        ),
        (["--report", str(tmp_path / "none" / "page.html")], "none"),
    ):
        done = CliRunner().invoke(cli, ["compare", *paths, *more])
        assert done.exit_code == 2, done.output
        assert told in done.output


def test_one_pair_of_many_samples_is_no_pair_of_runs(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    first, second = both[0].isel(sample=slice(0, 2)), both[1].isel(sample=slice(1, 6))
    found = compare(first, second)
    assert (found.attrs["pairs"], found.attrs["runs"]) == (1, 0)
    lines = compared(found)
    told = "samples are paired by their seeds (1 pair of 2 and 5 samples that have run: "
    assert f"{told}all tables and figures are of these pairs)" in lines
    (table,) = sections(found)["outputs"].tables
    assert "worse in" not in table.head
    assert table.head[0] == "mean of"
    runs = compare(*(each.isel(sample=0, drop=True) for each in both))
    assert runs.attrs["runs"] == 1
    (ends,) = sections(runs)["outcomes"].tables
    assert ends.rows == [("outcome", "deployed", "deployed")]


def test_all_tables_and_figures_are_of_the_pairs_that_have_run() -> None:
    """Of ten and six samples, of which the last two have not run: four pairs."""
    one, other = made_campaign(10), made_campaign(6, not_run=(4, 5))
    other["asynchrony_max"] *= 0.5
    found = compare(one, other, ("ground", "flight"))
    lines = compared(found)
    told = "samples are paired by their inputs (4 pairs of 10 and 4 samples that have run: "
    assert f"{told}all tables and figures are of these pairs)" in lines
    assert "flight: 4 of 6 samples have run" in lines
    assert "not run" not in found["kind"].values
    assert found["kind_compared"].values.tolist() == [[4, 4]]
    drawn = {name: figure for name, _, figure in figures_of_both(found, one, other)}
    titles = [a.get_title("left") for a in drawn["values"].axes if a.get_visible()]
    assert set(titles) == {"n = 4 of 4, 4 of 4"}
    legend = [text.get_text() for text in drawn["courses"].legends[0].get_texts()]
    assert len({text.partition("line: ")[2] for text in legend}) == 1


@for_each("less", ["failed", "not_run"])
def test_a_campaign_without_a_result_is_compared(less: str) -> None:
    one, other = made_campaign(4), made_campaign(4, **{less: (0, 1, 2, 3)})
    found = compare(one, other)
    assert "deployment_time &lt;= 40 s: met" in comparison_page(found, one, other)
    assert ("second: 0 of 4 samples have run" in compared(found)) == (less == "not_run")


def test_numbers_that_runs_call_uncertain_are_marked_and_counted(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    said = "deployed; steps of 9 ms at the lock at 3 s are too long for shocks in the rods (period "
    said += "54 ms), so asynchrony_max, peak_tension may be off: set solver.tolerance = 1e-5"
    reasons = np.array(["deployed"] * 8, dtype=object)
    reasons[[0, 1, 3]] = said
    one, two = both[0], both[1].assign(reason=("sample", reasons))
    found = compare(one, two, ("ground", "flight"))
    lines = compared(found)
    (told,) = (line for line in lines if "may be off" in line)
    where = "in 0 of 8 samples of ground and 3 of 8 samples of flight"
    assert told.endswith(f": asynchrony_max, peak_tension {where}")
    rows = [row[0] for part in sections(found).values() for t in part.tables for row in t.rows]
    marked = {row for row in rows if row.endswith(" ?")}
    assert marked == {r for r in rows if r.startswith(("asynchrony_max", "peak_tension"))}
    assert len(marked) >= 2  # the mean, and the requirement on it
    text = re.sub("<[^>]+>", "", comparison_page(found, one, two))
    assert re.search(r"asynchrony_max(?: \(deg\))? \?", text)
    runs = [each.isel(sample=0, drop=True) for each in (one, two)]
    runs[1].attrs["reason"] = said
    (told,) = (line for line in compared(compare(*runs, ("a", "b"))) if "may be off" in line)
    assert told.endswith(": asynchrony_max, peak_tension in b")
    assert not any("may be off" in line for line in compared(compare(*both)))


def test_engines_and_what_is_drawn_are_told_apart(both: tuple[xr.Dataset, xr.Dataset]) -> None:
    frame = both[0].assign_attrs(fidelity="frame")
    found = compare(frame, both[0].assign_attrs(fidelity="full"))
    assert found["setting"].values.tolist() == ["fidelity"]
    drawn = {"role": "input", "path": "stop.stiffness"}
    one, two = (each.assign(stiffness=("sample", np.arange(8.0), drawn)) for each in both)
    assert "stop.stiffness" not in compare(one, two)["setting"].values


def test_distributions_and_requirements_that_differ_are_told(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    def asked(campaign: xr.Dataset, high: float, limit: float | None) -> xr.Dataset:
        law = json.dumps(
            {"kind": "uniform", "each_section": False, "shared": [], "low": 40.0, "high": high}
        )
        about = {"role": "input", "path": "stop.stiffness", "distribution": law}
        wanted = {"max": limit, "probability": 0.9, "confidence": 0.95}
        text = json.dumps({"asynchrony_max": wanted} if limit else {})
        drawn = campaign.assign(stiffness=("sample", np.arange(8.0), about))
        return drawn.assign_attrs(requirements=text)

    one, two = asked(both[0], 60.0, 5.0), asked(both[1], 80.0, None)
    lines = "\n".join(compared(compare(one, two)))
    assert re.search(
        r"input stop.stiffness +uniform, low 40, high 60 +uniform, low 40, high 80", lines
    )
    assert re.search(
        r"requirement asynchrony_max +<= 5 deg, probability 0.9, confidence 0.95 +none", lines
    )
    assert "input stop.stiffness" not in "\n".join(
        compared(compare(one, asked(both[1], 60.0, 4.0)))
    )


def test_of_cases_courses_show_the_base_case_and_the_range(
    both: tuple[xr.Dataset, xr.Dataset],
) -> None:
    design = json.dumps({"kind": "one-at-a-time"})
    one = both[0].assign_attrs(design=design)
    found = compare(one, both[1], ("changes", "flight"))
    (figure,) = (each for name, _, each in figures_of_both(found, one, both[1])
                 if name == "courses")  # fmt: skip
    (axes,) = (a for a in figure.axes if "cable" in a.get_ylabel())
    tension = one["cable_tension"].max(("plane", "span")).transpose("sample", "time").to_numpy()
    count = len(axes.lines[0].get_xdata())
    assert axes.lines[0].get_ydata() == pytest.approx(tension[0][:count])
    held = tension[good(one)][:, :count]
    edges = axes.collections[0].get_paths()[0].vertices[:, 1]
    assert (edges.min(), edges.max()) == pytest.approx((held.min(), held.max()))
    told = figure.legends[0].get_title().get_text()
    assert "Lines are the base case" in told
    assert "Each line is the sample whose asynchrony_max is the median" in told  # of the other


def test_a_campaign_without_records_has_a_page() -> None:
    """As where all its runs have failed: it has no courses, and ended with a traceback."""
    both = made_campaign(4), made_campaign(4).drop_dims("time")
    assert "</html>" in comparison_page(compare(*both), *both)
