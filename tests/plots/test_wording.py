"""What the figures say comes from the dataset alone."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from loops import for_each
from matplotlib.figure import Figure

from ringsim.analysis.derived import Derived
from ringsim.plots import style
from ringsim.variables import Fate

pytestmark = pytest.mark.quick


def quantity(values, units: str) -> xr.DataArray:
    attributes = {"units": units, "long_name": "some quantity"}
    return xr.DataArray(np.asarray(values, dtype=float), dims="time", attrs=attributes)


@for_each(
    ("largest", "units", "wanted"),
    [
        (0.06, "J", "mJ"),
        (6e-7, "J", "µJ"),
        (4e-7, "J", "nJ"),
        (2.4e6, "Pa", "MPa"),
        (700.0, "Pa", "kPa"),
        (3.0, "J", "J"),
        (1e-30, "J", "pJ"),
        (1e30, "Pa", "GPa"),
        (2.4e6, "degree", "degree"),
        (0.0, "J", "J"),
    ],
)
def test_prefix_follows_the_largest_value(largest, units, wanted):
    factor, found = style.readable_units(quantity([0.0, -largest, np.nan], units))
    assert found == wanted
    if units in ("J", "Pa") and 1e-12 < largest < 1e12:
        assert 0.5 <= factor * largest < 500.0


def test_prefixed_numbers_mean_the_same():
    factor, units = style.readable_units(quantity([0.06], "J"))
    assert (factor * 0.06, units) == (pytest.approx(60.0, rel=1e-15), "mJ")


def test_label_is_long_name_and_units():
    assert style.label(quantity([1.0], "N")) == "Some quantity (N)"
    assert style.label(quantity([1.0], "N"), "kN") == "Some quantity (kN)"
    assert style.label(quantity([1.0], "1")) == "Some quantity"


def test_long_labels_are_broken_between_words():
    assert style.label(quantity([1.0], "N"), width=14) == "Some quantity\n(N)"


def test_ending_tells_success_failure_and_the_lack_of_an_end(deployed, failed, unfinished):
    assert style.ending(deployed) == "Deployed after 17.58 s"
    assert style.ending(failed).startswith("Solver failed after 9.25 s: the step fell below")
    assert style.ending(unfinished).startswith("Cut off after 12 s: ")


def test_a_long_title_is_broken_into_even_lines(deployed):
    run = deployed.assign_attrs(title="word " * 26)
    figure = Figure(figsize=(8.0, 3.0))
    style.head(figure, figure.subplots(), run, "Subject")
    lines = figure.get_suptitle().splitlines()
    assert len(lines) == 2
    assert abs(len(lines[0]) - len(lines[1])) <= len("word ")


def test_a_run_that_does_not_tell_its_outcome_gives_the_reason(unfinished):
    run = unfinished.drop_vars("outcome")
    run.attrs["reason"] = "the end time was reached"
    assert style.ending(run) == "Ended after 12 s: the end time was reached"


@for_each(("title", "wanted"), [
    ("18-section ring, 2 cables", "2-section ring, 2 cables"),
    ("Ring of 8 m, 18 sections, two cables", "Ring of 8 m, 2 sections, two cables"),
    ("Truss of paper 000", "Truss of paper 000, 2 sections"),
    ("", "2 sections"),
])  # fmt: skip
def test_titles_tell_the_true_number_of_sections(title, wanted, unfinished):
    assert style.scene_title(unfinished.assign_attrs(title=title)) == wanted


def test_an_output_by_an_expression_has_its_name_and_the_expression_as_it_is_written():
    made = Derived(of="max(abs(asynchrony))").variable("apart")
    drawn = xr.DataArray(0.0, name="apart", attrs={"long_name": made.long_name, "units": "degree"})
    assert style.label(drawn) == "apart = max(abs(asynchrony)) (deg)"
    assert style.label(drawn.assign_attrs(long_name="largest lag")) == "Largest lag (deg)"


def test_the_end_of_a_run_at_rest_is_not_when_it_came_to_rest(unfinished):
    run = unfinished.assign(outcome=int(Fate.STALLED)).assign_attrs(reason="no winch moves it")
    assert style.ending(run) == "Stalled by 12 s: no winch moves it"
