"""Words inside axes cover no curve where there is room, and legends none at all."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ringsim.plots import style
from ringsim.plots.rods_and_cables import rod_stress
from ringsim.plots.run import Peak, asynchrony, energy, mark, opening_angles
from ringsim.plots.style import FREE

pytestmark = pytest.mark.usefixtures("settled")

TIMES = np.linspace(0.0, 10.0, 400)
STEEP = {
    "early": np.exp(-8.0 * TIMES),
    "late": np.exp(8.0 * (TIMES - 10.0)),
    "both": np.exp(-8.0 * TIMES) + 0.9 * np.exp(8.0 * (TIMES - 10.0)),
    "at once high": 1.0 - np.exp(-8.0 * TIMES),
    "high, then low": np.where(TIMES < 5.0, 1.0, 0.0),
}


def covered(figure: Figure) -> list[str]:
    """Free words whose box a curve passes, points of steep ones being as near as pixels."""
    figure.draw_without_rendering()
    found = []
    for axes in figure.axes:
        boxes = {t.get_text(): t.get_window_extent() for t in axes.texts if t.get_gid() == FREE}
        lines = [line for line in axes.findobj(Line2D) if line.axes and line in axes.lines]
        segments = [s for c in axes.collections if hasattr(c, "get_segments")
                    for s in c.get_segments()]  # fmt: skip
        for curve in [*(line.get_xydata() for line in lines), *segments]:
            if len(curve) < 9:  # marks and lines of the axes
                continue
            points = axes.transData.transform(curve[np.isfinite(curve).all(axis=1)])
            share = np.linspace(0.0, 1.0, 200)[:, None, None]
            dense = (points[:-1] + share * np.diff(points, axis=0)).reshape(-1, 2)
            for words, box in boxes.items():
                inside = (dense > (box.x0, box.y0)) & (dense < (box.x1, box.y1))
                if inside.all(axis=1).any():
                    found.append(words)
    return found


@pytest.mark.parametrize("heights", STEEP.values(), ids=STEEP.keys())
def test_name_and_largest_value_avoid_a_steep_curve(heights: np.ndarray) -> None:
    figure = Figure(figsize=(5.0, 3.0))
    axes = figure.subplots()
    axes.plot(TIMES, heights)
    axes.set_xlim(0.0, 10.0)
    k = int(heights.argmax())
    style.name_panel(axes, "rising diagonal")
    mark(axes, Peak(float(heights[k]), float(TIMES[k]), {}), "N", "span 12, somewhere")
    style.head(figure, axes, xr.Dataset({"status": 0}), "Steep")
    assert covered(figure) == []
    one, other = (text.get_window_extent() for text in axes.texts)
    assert not one.overlaps(other)


def test_words_stand_between_curves_below_a_limit_in_as_many_lines_as_fit() -> None:
    """Many curves at the start, spikes later on, a limit with its name above: as cables have."""
    figure = Figure(figsize=(5.0, 2.2))
    axes = figure.subplots()
    axes.set_xlim(0.0, 10.0)
    for size in np.linspace(10.0, 60.0, 12):
        late = np.where(np.abs(TIMES - 6.8) < 0.1, size, 0.0)
        axes.plot(TIMES, np.where(TIMES < 2.0, size, late))
    axes.set_ylim(0.0, 95.0)
    style.draw_limit([axes], 75.0, "limits.tension = 75 N")
    mark(axes, Peak(60.0, 1.0, {}), "N", "span 1, winch to section 1 first hinge")
    style.head(figure, axes, xr.Dataset({"status": 0}), "Cables")
    assert covered(figure) == []
    (words,) = (text for text in axes.texts if text.get_gid() == FREE)
    figure.draw_without_rendering()
    box = words.get_window_extent()
    limit = axes.transData.transform((0.0, 75.0))[1]
    assert not box.y0 < limit < box.y1
    told = words.get_text()
    assert " ".join(told.split()) == ("largest: 60 N at 1 s span 1, winch to section 1 first hinge")
    assert any(line.endswith("60 N at 1 s") or "section 1" in line for line in told.split("\n"))


@pytest.mark.parametrize(("limit", "far"), [(60.0, False), (200.0, True)])
def test_panels_of_one_scale_say_the_same_of_a_limit(limit: float, far: bool) -> None:
    """The first panel's line would bring the limit within the scale of the second."""
    figure = Figure()
    panels = figure.subplots(2, sharey=True)
    for axes in panels:
        axes.plot([0.0, 1.0], [10.0, 30.0])
    style.draw_limit(list(panels), limit, "limit")
    words = "limit, far above" if far else "limit"
    assert [axes.texts[0].get_text() for axes in panels] == [words, words]
    assert [len(axes.lines) for axes in panels] == ([1, 1] if far else [2, 2])


def test_names_stay_in_their_corner_where_nothing_is_in_the_way() -> None:
    figure = Figure(figsize=(5.0, 3.0))
    axes = figure.subplots()
    axes.plot(TIMES, 0.1 * TIMES)
    style.name_panel(axes, "upper plane")
    style.head(figure, axes, xr.Dataset({"status": 0}), "Flat")
    assert axes.texts[0].get_position() == (0.02, 0.95)


@pytest.mark.parametrize(
    "draw",
    [
        *(pytest.param(each, marks=pytest.mark.slow) for each in (opening_angles, asynchrony)),
        rod_stress,
    ],
)
def test_figures_of_a_ring_that_opens_at_once(draw, deployed: xr.Dataset) -> None:
    run = deployed.copy(deep=True)
    late = run.time.values > 0.3
    run["opening_angle"].values[..., late] = 172.0 + 0.4 * run.time.values[late]
    run["asynchrony"].values[1:4] = 8.0, 20.0, 5.0
    run["rod_stress"].values[..., 1:4] *= 80.0
    assert covered(draw(run)) == []


def test_the_legend_of_energies_is_beside_the_curves(deployed: xr.Dataset) -> None:
    figure = energy(deployed)
    figure.draw_without_rendering()
    (legend,) = figure.legends
    assert len(legend.get_texts()) == 4
    for axes in figure.axes:
        assert axes.get_legend() is None
        assert not legend.get_window_extent().overlaps(axes.get_window_extent())
