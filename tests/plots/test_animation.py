"""The animation shows the run: where it is, when, and who is ahead."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from made_campaign import made_campaign, made_scene, with_positions
from matplotlib.colors import to_rgb
from PIL import Image

from ringsim.cli import cli
from ringsim.dataset import save
from ringsim.plots import animation, figures
from ringsim.plots.animation import stage
from ringsim.plots.ring import facing_azimuth, view
from ringsim.shapes import COMPUTED, FROM_ANGLES, shape_of

ONE_PICTURE = tuple(one for one in figures.PICTURES if one.name == "distributions")


@pytest.fixture(autouse=True)
def _few_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(animation, "FRAMES", 3)


def made_run(*, computed: bool) -> xr.Dataset:
    campaign = made_campaign(2)
    campaign = with_positions(campaign) if computed else campaign
    return campaign.isel(sample=1, drop=True)


def run(*words: object) -> tuple[int, str]:
    done = CliRunner().invoke(cli, list(map(str, words)))
    return done.exit_code, done.output


@pytest.mark.parametrize("computed", [True, False])
def test_a_frame_shows_positions_time_and_who_is_ahead(computed: bool) -> None:
    """Orange the joint that is farthest ahead, purple the last, at the places of the run."""
    one = made_run(computed=computed)
    shape = shape_of(one, made_scene())
    figure, show = stage(one, shape, animation.by_lag(one, shape))
    show(5.0)
    words = [text.get_text() for text in figure.texts]
    assert any(" 5.00 s" in text and "100.0 deg open" in text for text in words)
    assert (COMPUTED if computed else FROM_ANGLES) in words
    (lines,) = figure.axes[0].collections
    segments, colours = np.array(lines.get_segments()), np.array(lines.get_color())
    azimuth = facing_azimuth(shape.scene)
    names = shape.points.names
    angle = one["opening_angle"].sel(time=5.0)
    known = view(shape.at(5.0), azimuth, animation._ELEVATION)[0]
    for chosen, sense in ((angle.argmax(...), 1.0), (angle.argmin(...), -1.0)):
        plane, section = (int(chosen[dim]) for dim in ("plane", "section"))
        place = known[names.index(f"{('upper', 'lower')[plane]} V-joint {section + 1}")]
        dots = np.linalg.norm(segments - place, axis=2).max(axis=1) < 2e-3
        assert dots.sum() == 1
        red, _, blue = colours[dots][0][:3]
        assert np.sign(red - blue) == sense
    orange, purple = (np.array(to_rgb(word)) for word in ("#c85a00", "#542788"))
    assert orange[0] > orange[2]
    assert purple[0] < purple[2]


def test_the_view_holds_the_whole_run() -> None:
    one = made_run(computed=True)  # it floats by 5 m
    shape = shape_of(one, made_scene())
    figure, show = stage(one, shape, animation.by_lag(one, shape))
    (left, right), (low, high) = figure.axes[0].get_xlim(), figure.axes[0].get_ylim()
    for time in np.linspace(0.0, 10.0, 7):
        show(float(time))
        x, y = np.concatenate(figure.axes[0].collections[0].get_segments()).T
        assert left < x.min() < x.max() < right
        assert low < y.min() < y.max() < high


def test_stress_colours_every_rod() -> None:
    one = made_run(computed=True)
    rods = [f"rod{k}" for k in range(8)]
    values = np.arange(1.0, 9.0)[:, None, None] * np.ones((1, 4, one.sizes["time"])) * 1e6
    told = {"units": "Pa", "long_name": "stress"}
    one = one.assign_coords(rod=rods).assign(rod_stress=(("rod", "section", "time"), values, told))
    shape = shape_of(one, made_scene())
    paint = animation.by_stress(one, shape)
    assert paint.label == "stress (MPa)"
    assert paint.factor * paint.values(3.0)["bars"].max() == pytest.approx(8.0)
    assert paint.norm.vmax == pytest.approx(8.0)
    figure, show = stage(one, shape, paint)
    show(3.0)
    assert len(set(map(tuple, np.round(figure.axes[0].collections[0].get_color(), 3)))) > 8


def test_the_verbs_write_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    save(made_run(computed=True), Path("one.nc"))
    save(made_campaign(3), Path("many.nc"))
    monkeypatch.setattr(figures, "PICTURES", ONE_PICTURE)
    code, told = run("run", "truss2", "--set", "solver.end_time=0.3", "--animate")
    assert code == 0
    assert "wrote truss2.gif\ncomputed positions need --set record.pos" in told
    with Image.open("truss2.gif") as found:
        assert found.n_frames > 1
        found.seek(found.n_frames - 1)
        assert found.info["duration"] >= 1000 * animation.HELD
    code, told = run("plot", "many.nc", "--animate", "--out", "pictures")  # the worst sample
    assert (code, told.splitlines()[-1]) == (0, "wrote pictures/many-sample2.gif")
    assert Path("pictures/many-sample2.gif").exists()


def test_what_it_cannot_show_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    save(made_campaign(3, failed=(1,), not_run=(2,)), Path("many.nc"))
    monkeypatch.setattr(figures, "PICTURES", ONE_PICTURE)
    for words, told in (
        (("plot", "many.nc", "--colour", "lag"), "has no effect without --animate"),
        (("plot", "many.nc", "--sample", 1), "has no effect without --animate"),
        (("plot", "many.nc", "--animate", "--sample", 7), "has samples 0 to 2"),
        (("plot", "many.nc", "--animate", "--measured", "a.toml"), "not together with --measured"),
        (("plot", "many.nc", "--animate", "--sample", 2), "--sample 2: it has not run"),
        (("plot", "many.nc", "--animate", "--colour", "stress"), "record.stress=true"),
        (("run", "truss2", "--animate", "--colour", "stress"), "give --set record.stress=true"),
    ):
        code, printed = run(*words)
        assert (code, told in printed) == (2, True), printed
    assert not list(tmp_path.glob("*.gif"))
