"""The map says how each cell ended, where the borders are, and which ok was not true."""

from __future__ import annotations

import itertools
import re
import runpy
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from ringsim.analysis.stability import (
    ENDED,
    OK,
    PROMISES,
    WRONG,
    borders,
    cells_of,
    checked,
    chosen_for_check,
    compared,
    joined,
    judged,
    summary,
    to_markdown,
)
from ringsim.parts.solver import Solver
from ringsim.plots.studies import stability
from ringsim.variables import Cause, Fate, Status

pytestmark = pytest.mark.quick

NEWTON = "the solver stopped at 1 s after 9 step reductions: reduce solver.step"
ENDS = {
    "all V-joints have reached 180 deg": (Status.OK, Cause.NONE, Fate.DEPLOYED),
    "solver.end_time = 4 s was reached with 0 of 4 V-joints locked": (
        Status.OK, Cause.NONE, Fate.CUT_OFF,
    ),
    NEWTON: (Status.SOLVER_FAILED, Cause.NEWTON, Fate.NONE),
    "still running after limits.timeout = 90 s": (Status.TIMEOUT, Cause.TIME_LIMIT, Fate.NONE),
    "KeyError: 'x'": (Status.ERROR, Cause.EXCEPTION, Fate.NONE),
    "the solver process died of SIGSEGV": (Status.CRASHED, Cause.CRASH, Fate.NONE),
}  # fmt: skip


def campaign(*reasons: str, **values: list[float]) -> xr.Dataset:
    """A merged campaign whose samples ended for these reasons."""
    count = len(reasons)
    angle = np.full((count, 2, 3, 4), np.nan)
    angle[..., :2] = [60.0, 90.0]
    numbers = {
        "energy_error": [1e-4] * count, "restarts": [0] * count, "deployment_time": [3.0] * count,
        "peak_tension": [10.0] * count, "cpu_time": [1.0] * count, "steps": [1.0] * count,
    }  # fmt: skip
    found = {name: ("sample", np.array(v)) for name, v in (numbers | values).items()}
    for place, name in enumerate(("status", "cause", "outcome")):
        found[name] = ("sample", np.array([int(ENDS[r][place]) for r in reasons], dtype="i1"))
    found["reason"] = ("sample", np.array(reasons, dtype=object))
    found["opening_angle"] = (("sample", "plane", "section", "time"), angle)
    return xr.Dataset(found)


GOOD = next(iter(ENDS))
TIME_PROMISE, _, TENSION_PROMISE = PROMISES.values()
WORDS = {
    "name": "g", "title": "group", "x_label": "stiffness", "x_units": "N", "y_label": "speed",
    "y_units": "m/s", "fidelity": "full",
}  # fmt: skip
OTHER = WORDS | {"name": "g-frame", "title": "group, frame engine", "fidelity": "frame"}
CUT_OFF = "solver.end_time = 4 s was reached with 0 of 4 V-joints locked"


def cells(*reasons: str, **values: list[float]) -> xr.Dataset:
    count = len(reasons)
    return cells_of(campaign(*reasons, **values), range(count), [0.0] * count)


def test_every_end_has_its_verdict_and_its_cause() -> None:
    found = judged(cells(*ENDS))
    assert found["cause"].values.tolist() == [
        "", "cut off", "Newton", "time limit", "error", "crashed",
    ]  # fmt: skip
    assert found["verdict"].values.tolist() == [OK, ENDED, ENDED, ENDED, WRONG, WRONG]


def test_ok_with_an_energy_error_over_its_tolerance_is_wrong() -> None:
    most = Solver().energy_tolerance
    found = judged(cells(GOOD, GOOD, energy_error=[0.99 * most, 1.01 * most]))
    assert found["verdict"].values.tolist() == [OK, WRONG]


def test_the_final_angle_is_the_last_that_was_recorded() -> None:
    np.testing.assert_allclose(cells(GOOD)["final_angle"], 90.0)


def test_the_choice_is_repeatable_and_of_ok_cells_alone() -> None:
    whole = judged(cells(*([GOOD, NEWTON] * 50)))
    first, again = (chosen_for_check(whole, 0.2, seed=4) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    assert len(first) == len(set(first)) == 10
    assert np.all(first % 2 == 0)
    assert len(chosen_for_check(judged(cells(NEWTON)), 0.5, seed=4)) == 0
    assert chosen_for_check(judged(cells(NEWTON, GOOD)), 0.01, seed=4).tolist() == [1]


@pytest.mark.parametrize(
    ("changed", "check", "verdict"),
    [
        ({}, "holds", OK),
        ({"deployment_time": [3.0 / (1.0 + 1.1 * TIME_PROMISE)]}, "differs", WRONG),
        ({"deployment_time": [3.0 / (1.0 + 0.9 * TIME_PROMISE)]}, "holds", OK),
        ({"peak_tension": [10.0 / (1.0 + 1.1 * TENSION_PROMISE)]}, "differs", WRONG),
        ({"peak_tension": [np.nan]}, "holds", OK),
        ({"steps": [1.4]}, "unproven", OK),
        ({"steps": [1.4], "deployment_time": [4.0]}, "differs", WRONG),
    ],
)
def test_a_finer_run_proves_or_refutes_a_cell(changed, check, verdict) -> None:
    whole = judged(cells(NEWTON, GOOD))
    found = checked(whole, np.array([1]), cells(GOOD, **({"steps": [1.6]} | changed)))
    assert found["check"].values.tolist() == ["", check]
    assert found["verdict"].values.tolist() == [ENDED, verdict]


def test_a_finer_run_that_does_not_end_proves_nothing() -> None:
    found = checked(judged(cells(GOOD)), np.array([0]), cells(NEWTON))
    assert found["check"].values.tolist() == ["unproven"]


def test_borders_name_the_ranges_and_what_lies_beyond() -> None:
    ends = [
        NEWTON,
        GOOD,
        GOOD,
        GOOD,
        CUT_OFF,
    ]
    group = cells(*ends, *ends[1:], GOOD)
    group["x"].values[:] = [1, 2, 3, 4, 5] * 2
    group["y"].values[:] = [7] * 5 + [8] * 5
    along, across = borders(joined([(WORDS, group)]))
    assert along == ["group", "stiffness (N)", "2 .. 3", "1 .. 5", "Newton", "cut off"]
    assert across == ["group", "speed (m/s)", "none", "7 .. 8", "-", "-"]


def test_text_and_figure_tell_every_kind_of_cell() -> None:
    whole = joined([(WORDS, cells(*ENDS)), (WORDS | {"title": "other"}, cells(GOOD, restarts=[1]))])
    text = to_markdown(whole)
    assert "7 cells in 2 panels: 3 ended, 2 ok, 2 wrong" in text
    assert "1 of the ok cells after a restart" in summary(whole)
    assert NEWTON in text
    assert "## Where ok ends" in text
    wrong = cells(*ENDS, GOOD)
    apart = np.full(wrong.sizes["cell"], np.nan)
    apart[-1] = 0.055
    wrong = wrong.assign(
        tension_difference=("cell", apart), check=("cell", np.where(apart > 0, "differs", "")),
        time_difference=("cell", 0.0 * apart), angle_difference=("cell", np.nan * apart),
    )  # fmt: skip
    text_of_wrong = to_markdown(joined([(WORDS, wrong)]))
    assert "from a finer run: tension differs by 5.5 % (allowed 5 %)" in text_of_wrong
    assert "Where ok ends" not in to_markdown(joined([(WORDS, cells(GOOD))]))  # nothing ended
    figure = stability(whole)
    legend = [entry.get_text() for entry in figure.legends[0].get_texts()]
    assert legend == ["ok", "r  ok, after a restart", "t  cut off", "N  Newton",
                      "T  time limit", "!  wrong"]  # fmt: skip
    assert "Stiffness (N)" in [axes.get_xlabel() for axes in figure.axes]


BARS = {
    "deployment_time_error": [0.1], "peak_tension_error": [0.2],
    "asynchrony_max": [2.0], "asynchrony_max_error": [1e-9],
}  # fmt: skip


@pytest.mark.parametrize(
    ("reason", "changed", "word"),
    [
        (GOOD, {}, "agree"),
        (GOOD, {"deployment_time": [3.19]}, "agree"),
        (GOOD, {"deployment_time": [3.21]}, "deployment_time"),
        (GOOD, {"peak_tension": [10.41]}, "peak_tension"),
        # Round-off of rings whose sections are all alike.
        (GOOD, {"asynchrony_max": [2.0 + 9e-5], "asynchrony_max_error": [1e-9]}, "agree"),
        (GOOD, {"asynchrony_max": [2.0 + 2e-4], "asynchrony_max_error": [1e-9]}, "asynchrony_max"),
        (GOOD, {"peak_tension": [99.0], "peak_tension_error": [np.nan]}, "agree"),
        (CUT_OFF, {}, "outcome"),
        (NEWTON, {"deployment_time": [99.0]}, "status"),
    ],
)
def test_engines_differ_by_their_ends_or_beyond_both_error_bars(reason, changed, word) -> None:
    full, frame = cells(GOOD, **BARS), cells(reason, **(BARS | changed))
    found = compared(joined([(WORDS, full), (OTHER, frame)]))
    assert found["engines"].values.tolist() == [word, word]
    text = to_markdown(found)
    assert f"In {int(word != 'agree')} of them they differ" in text
    assert ("| group | 0, 0 |" in text) == (word != "agree")


def test_cells_in_which_engines_differ_have_a_frame_in_the_figure() -> None:
    pair = (WORDS, cells(GOOD, GOOD, GOOD)), (OTHER, cells(GOOD, NEWTON, GOOD))
    figure = stability(compared(joined(pair)))
    legend = [entry.get_text() for entry in figure.legends[0].get_texts()]
    assert legend == ["ok", "N  Newton", "the engines differ"]
    for panel in figure.axes[:2]:
        frames = [patch for patch in panel.patches if patch.get_width() < 1.0]
        assert [(patch.get_x() + 0.43, patch.get_y() + 0.43) for patch in frames] == [(1.0, 0.0)]


def test_maps_of_one_engine_compare_nothing() -> None:
    for words in (WORDS, OTHER):
        found = compared(joined([(words, cells(GOOD))]))
        assert "engines" not in found
        assert "engines" not in to_markdown(found)


def test_the_benchmarks_map_is_large_and_its_cells_are_valid() -> None:
    """Every pair of ends of two axes is a scene."""
    known = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "stability_map.py"))
    panels, quick = known["PANELS"], known["QUICK"]
    assert sum(len(list(panel.cells())) for panel in panels) == 520
    assert sum(len(list(panel.cells())) for panel in quick) == 12
    assert len({panel.name for panel in panels}) == len(panels)
    for panel in (*panels, *quick):
        for x, y in itertools.product(panel.x.values[:: len(panel.x.values) - 1], panel.y.values):
            panel.scene.with_values(panel.x.at(x) | panel.y.at(y))


def test_reasons_are_told_by_whole_clauses() -> None:
    """As many as there is room for, never half of one, as of a cure that would be cut off."""
    words, found = "steps are too long: set solver.tolerance = 1e-4", cells(GOOD, NEWTON)
    found["reason"].values[1] = "; ".join([NEWTON, *[words] * 20])
    told = to_markdown(joined([(WORDS, found)]))
    assert re.search(rf"\| {NEWTON}(; {words}){{2,6}} \|\n", told)
