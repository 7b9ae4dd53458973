"""The largest value drawn is the one that a run prints, also where no record falls on it."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.text import Text

from ringsim.plots.figures import draw_figures
from ringsim.plots.ring import strain_over_length, tension_over_length
from ringsim.plots.rods_and_cables import cables, nodal_forces, pulleys, rod_stress
from ringsim.plots.run import asynchrony, peak_of
from ringsim.scene import load_scene
from ringsim.simulation import simulate

CURVES = ("asynchrony", "rod_stress", "cable_tension")
DRAWN = [
    (asynchrony, "Largest difference", "asynchrony_max", 1.0),
    (rod_stress, "", "peak_rod_stress", 1e-6),
    (cables, "Tension", "peak_tension", 1.0),
]


@pytest.fixture(scope="module")
def truss() -> xr.Dataset:
    """The first jerk of two winches, recorded so seldom that all peaks lie between records."""
    fields = {"solver.end_time": 0.5, "record.interval": 0.25, "record.stress": True}
    return simulate(load_scene("truss2").with_values(fields))


@pytest.fixture(scope="module")
def planar() -> xr.Dataset:
    fields = {"solver.end_time": 0.2, "record.interval": 0.1}
    return simulate(load_scene("planar-truss").with_values(fields))


def highest(figure: Figure, label: str) -> float:
    """Of all lines of the axes whose name begins so, and of those beside them."""
    named = [axes for axes in figure.axes if axes.get_ylabel().startswith(label)]
    rows = [
        axes
        for axes in figure.axes
        if any(axes in one.get_shared_y_axes().get_siblings(one) for one in named)
    ]
    marks = [line for axes in rows for line in axes.lines if line.get_marker() == "o"]
    drawn = [line.get_ydata() for axes in rows for line in axes.lines if len(line.get_ydata()) > 2]
    return float(np.nanmax(np.concatenate([*drawn, *(mark.get_ydata() for mark in marks)])))


@pytest.mark.parametrize(("draw", "label", "number", "factor"), DRAWN)
def test_the_highest_point_is_the_number_of_the_summary(draw, label, number, factor, truss):
    figure = draw(truss)
    assert highest(figure, label) == factor * float(truss[number])
    words = " ".join(text.get_text() for text in figure.findobj(Text))
    largest = "largest" if draw is asynchrony else "largest of all steps"
    assert f"{largest}: {factor * float(truss[number]):.3g}" in words


def test_a_peak_between_records_is_in_no_curve_of_those_compared(truss):
    """Of one plane alone: in its curve the other, recorded seldom, would look far smaller."""
    rows = cables(truss).axes[6:]
    curves = [line for axes in rows for line in axes.lines if len(line.get_xdata()) > 2]
    assert len(curves) >= 2
    for line in curves:
        np.testing.assert_array_equal(line.get_xdata(), truss["time"])
    words = [text.get_text() for axes in rows for text in axes.texts]
    (told,) = (text for text in words if text.startswith("largest"))
    assert told.startswith("largest of all steps: ")
    assert told.endswith("curves: records every 0.25 s; dot: of all steps")
    peak = peak_of(truss, "cable_tension", "peak_tension")
    assert not peak.apart(xr.full_like(truss["time"], peak.value))


@pytest.mark.parametrize(("draw", "taut"), [(cables, False), (pulleys, False), (pulleys, True)])
def test_why_curves_stop_is_told(draw, taut, truss):
    run = truss.copy(deep=True)
    run["pulley_ratio"][:] = 0.9
    if not taut:
        run["cable_tension"][..., 1:] = 0.0
        run["pulley_ratio"][..., 1:] = np.nan
    told = draw(run).legends[0].get_title().get_text().lower()
    assert ("no line where the rope before it is slack." in told) is not taut


def test_these_peaks_are_in_no_record(truss):
    for series, (*_, number, _) in zip(CURVES, DRAWN, strict=True):
        assert float(truss[series].max()) < 0.9 * float(truss[number])


@pytest.mark.parametrize("number", ["peak_tension", "peak_bending_strain"])
def test_a_planar_truss_shows_its_largest_values(number, planar):
    draw = tension_over_length if number == "peak_tension" else strain_over_length
    (mark,) = [line for line in draw(planar).axes[0].lines if line.get_marker() == "o"]
    assert float(mark.get_ydata()[0]) == float(planar[number])


def test_a_peak_stands_where_the_dataset_says(deployed):
    run = deployed.assign(
        peak_rod_stress=9e6, peak_stress_time=4.04, peak_stress_rod="bar_lower_left",
        peak_stress_section=5,
    )  # fmt: skip
    axes = rod_stress(run).axes[3]
    (mark,) = [line for line in axes.lines if line.get_marker() == "o"]
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (4.04, 9.0)
    wanted = deployed.rod_stress.sel(rod="bar_lower_left", section=5)
    assert [line for line in axes.lines if np.array_equal(line.get_ydata(), 1e-6 * wanted)]
    assert "section 5, lower bar, left half" in axes.texts[-1].get_text()


def test_the_place_of_a_peak_is_that_of_the_records_beside_it(deployed):
    run = deployed.copy(deep=True)
    run["rod_stress"].values[2, 3, 40:42] = 5e6
    run["rod_stress"].values[6, 8, 100] = 8e6
    run = run.assign(peak_rod_stress=9e6, peak_stress_time=4.04)
    peak = peak_of(run, "rod_stress", "peak_rod_stress", stem="peak_stress")
    assert peak[:3] == (9e6, 4.04, {"rod": str(run.rod.values[2]), "section": 4})
    missing = run.assign(peak_stress_section=-1, peak_stress_time=np.nan)
    peak = peak_of(missing, "rod_stress", "peak_rod_stress", stem="peak_stress")
    assert peak.place == {"rod": str(run.rod.values[6]), "section": 9}


def test_asynchrony_is_drawn_to_the_deployment_and_on_a_linear_axis(deployed):
    run = deployed.copy(deep=True)
    run["asynchrony"].values[-1] = 99.0
    figure = asynchrony(run)
    assert highest(figure, "Largest") == float(deployed.asynchrony_max)
    whole, close = figure.axes
    assert {axes.get_yscale() for axes in figure.axes} == {"linear"}
    begin, end = close.get_xlim()
    assert whole.get_xlim()[0] < begin < float(deployed.deployment_time) < end


@pytest.mark.usefixtures("settled")
def test_a_peak_behind_the_last_record_is_on_the_sheet(failed):
    run = failed.sel(time=slice(0.0, 0.1)).assign(final_time=0.19)
    run = run.assign(peak_rod_stress=9e6, peak_stress_time=0.19, asynchrony_max_time=0.19)
    for draw in (rod_stress, asynchrony):
        figure = draw(run.assign(asynchrony_max=3.0))
        figure.draw_without_rendering()
        assert figure.axes[0].get_xlim() == (0.0, 0.19)


def test_both_cables_share_their_axes(truss):
    axes = cables(truss).axes
    assert len(axes) == 8
    for row in zip(axes[::2], axes[1::2], strict=True):
        assert row[0].get_ylim() == row[1].get_ylim()
        if not row[0].get_ylabel().startswith("Tension at"):
            continue
        for panel, plane in zip(row, ("upper", "lower"), strict=True):
            behind_hinge = truss.cable_tension.sel(plane=plane, span=2)
            np.testing.assert_array_equal(panel.lines[0].get_ydata(), behind_hinge)


def test_a_plane_without_a_cable_has_no_column(truss):
    one = truss.copy(deep=True)
    one["cable_tension"].loc[{"plane": "upper"}] = np.nan
    figure = cables(one)
    assert len(figure.axes) == 4
    assert any(text.get_text() == "lower cable" for text in figure.findobj(Text))


def test_every_figure_of_a_truss_is_written(truss, tmp_path):
    paths = draw_figures(truss, tmp_path, "truss2")
    assert len(paths) == 9
    assert all(path.name.startswith("truss2-fig-") for path in paths)


def test_the_terms_of_cable_figures_are_explained(truss):
    labels = [axes.get_ylabel().replace("\n", " ") for axes in cables(truss).axes]
    assert "Tension behind a section over that before it" in labels
    meant = nodal_forces(truss).legends[0].get_title().get_text()
    assert "Along: in the direction of the section's bars, away from the winch." in meant
    assert "Inwards: from the plane of the cable towards the other plane." in meant
