"""``ringsim stability SCENE`` from the command to its files, and the axes that it takes."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from loops import for_each

from ringsim.analysis.stability import ENDED, OK
from ringsim.campaign.studies import Panel, by_engines, panels_over, pieces_of, sweep_of
from ringsim.cli import cli
from ringsim.refusal import InputError
from ringsim.scene import builtin_scenes, load_scene

SHORT = {
    "structure.opening_angle": 165.0, "solver.end_time": 1.0, "record.interval": 0.25,
    "joints.vjoint.viscous": 0.2, "solver.step_limit": 800, "solver.tolerance": 4e-3,
    "solver.settling_time": 0.0,
    "cables.upper.slack_width": 0.05, "cables.lower.slack_width": 0.05,
}  # fmt: skip
SPEED, STOP = "cables.*.winch.winding.speed", "stop.stiffness"
OVER = ["--over", f"{SPEED}=0.01..1", "--over", f"{STOP}=100..200", "--points", "2"]


def stability(*words: str):
    return CliRunner().invoke(cli, ["stability", *words], standalone_mode=False)


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    out = tmp_path_factory.mktemp("stability") / "map"
    short = [word for path, value in SHORT.items() for word in ("--set", f"{path}={value}")]
    words = ["truss2", *short, *OVER, "--fidelity", "frame", "--out", str(out)]
    done = stability(*words)
    assert done.exception is None
    assert done.return_value == 0, done.output
    return out, words, done.output


def told(output: str) -> list[str]:
    """The line of counts."""
    return [line for line in output.splitlines() if " cells in " in line]


def test_two_axes_make_a_panel_of_runs_of_the_scene(mapped) -> None:
    """Wound at 1 m/s the truss opens; at 0.01 m/s it does not within its second."""
    with xr.open_dataset(mapped[0] / "stability.nc") as found:
        assert found["x"].values.tolist() == [0.01, 0.01, 1.0, 1.0]
        assert found["y"].values.tolist() == [100.0, 200.0] * 2
        assert found["cause"].values.tolist() == ["cut off", "cut off", "", ""]
        assert found["verdict"].values.tolist() == [ENDED, ENDED, OK, OK]
        assert sorted(found["check"].values.tolist()) == ["", "", "", "holds"]
        labels = [str(found[name].values[0]) for name in ("x_label", "x_units", "y_label")]
        assert labels == [SPEED, "m/s", STOP]
        assert str(found["y_units"].values[0]) == "N m/rad"


def test_text_and_figure_are_written(mapped) -> None:
    out, _, said = mapped
    assert f"panel 1, frame engine: --over {SPEED}=0.01..1 --over {STOP}=100..200: 4 cells" in said
    assert re.search(r"4 cells in 1 panel: 2 ended, 2 ok", said)
    text = (out / "stability.md").read_text(encoding="utf-8")
    assert f"| panel 1, frame engine | {SPEED} (m/s) | 1 .. 1 | 1 .. 1 | cut off | - |" in text
    assert (out / "stability.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_full_engine_has_a_map_like_it(mapped, tmp_path) -> None:
    words = [*mapped[1][: mapped[1].index("--fidelity")], "--out", str(tmp_path)]
    done = stability(*words, "--fidelity", "full")
    assert done.return_value == 0, done.output
    files = (folder / "stability.nc" for folder in (mapped[0], tmp_path))
    frame, full = (xr.load_dataset(file) for file in files)
    assert frame["fidelity"].values.tolist() == ["frame"]
    assert full["fidelity"].values.tolist() == ["full"]
    assert frame["verdict"].values.tolist() == full["verdict"].values.tolist()
    np.testing.assert_allclose(frame.deployment_time, full.deployment_time, rtol=5e-3)


def test_both_engines_stand_side_by_side_with_error_bars() -> None:
    panels = panels_over(load_scene("truss2"), [], points=2)
    found = by_engines(panels, "both")
    assert [panel.fidelity for panel in found] == ["full", "frame"] * len(panels)
    assert all(panel.scene.solver.error_bars for panel in found)
    assert len({panel.name for panel in found}) == len(found)
    assert by_engines(panels, "full") == panels
    assert not any(panel.scene.solver.error_bars for panel in by_engines(panels, "frame"))


def test_what_the_frame_engine_cannot_represent_is_left_to_the_full_one() -> None:
    ring, truss = (panels_over(load_scene(n), [], points=2)[0] for n in ("truss2", "planar-truss"))
    found = by_engines([ring, truss], "frame")
    assert [panel.fidelity for panel in found] == ["frame", "full"]
    for refused in (truss, replace(ring, scene=ring.scene.with_values({"rods.kind": "ancf"}))):
        with pytest.raises(InputError, match=r'--fidelity both: .*choose fidelity = "full"'):
            by_engines([refused], "both")


def test_the_same_command_goes_on_without_running_anything_again(mapped) -> None:
    out, words, said = mapped
    stamps = {path: path.stat().st_mtime_ns for path in out.glob("*/*/journals/*")}
    again = stability(*words)
    assert again.return_value == 0
    assert told(again.output) == told(said)
    assert stamps
    assert {path: path.stat().st_mtime_ns for path in out.glob("*/*/journals/*")} == stamps


@for_each(
    ("over", "wanted"),
    [
        (["rods.damping=1..2"], "--over rods.damping=1..2: a panel needs two axes"),
        (["rods.damping=1", STOP], "--over rods.damping=1: must read PATH=LOW..HIGH"),
        (["rods.damping=a..b", STOP], "--over rods.damping=a..b: must read PATH=LOW..HIGH"),
        (["rods.damping=2..1", STOP], "LOW = 2 must be below HIGH = 1"),
        (["rods.damping=1..inf", STOP], "HIGH = inf, and both finite"),
        (["rods.dampng=1..2", STOP], "--over rods.dampng=1..2: scene truss2: rods.dampng is not"),
        (["rods.damping=-1..2", STOP], "rods.damping = -1.0 s must be at least 0 s"),
        (["solver.step=1..90", STOP], "solver.step = 90.0 s must not exceed end_time = 45.0 s"),
        (["rods.kind=1..2", STOP], "known: ancf, geometrically-exact"),
        (["structure.sections=1.5..3", STOP], "structure.sections takes whole numbers only"),
        (["net.*.stiffness=1..2", STOP], "* stands for every cable"),
        ([STOP, STOP], "both axes of panel 1 vary stop.stiffness"),
        (
            ["record.interval=1..9", "solver.end_time=5..20"],
            "--over record.interval = 7 with --over solver.end_time = 5: ",
        ),
    ],
)
def test_axes_that_make_no_sense_are_refused(over, wanted, tmp_path) -> None:
    texts = [text if "=" in text else f"{text}=100..200" for text in over]
    words = [word for text in texts for word in ("--over", text)]
    done = CliRunner().invoke(cli, ["stability", "truss2", *words, "--out", str(tmp_path / "x")])
    assert done.exit_code == 2
    assert wanted in done.output
    assert len(done.output.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_values_are_geometric_from_a_decade_on_and_whole_where_the_field_is() -> None:
    scene = load_scene("truss2")
    found = [
        sweep_of(scene, f"{text}", points=5).values
        for text in ("stop.stiffness=1..10000", "stop.stiffness=1..9", "rods.elements=1..3",
                     "solver.settling_time=0..1")
    ]  # fmt: skip
    assert found == [
        (1.0, 10.0, 100.0, 1000.0, 10000.0), (1.0, 3.0, 5.0, 7.0, 9.0), (1, 2, 3),
        (0.0, 0.25, 0.5, 0.75, 1.0),
    ]  # fmt: skip


@for_each("name", builtin_scenes())
def test_default_axes_stand_around_what_the_scene_has(name) -> None:
    scene = load_scene(name)
    panels = panels_over(scene, [], points=3)
    assert len(panels) >= 2
    for sweep in (sweep for panel in panels for sweep in (panel.x, panel.y)):
        assert scene.with_values(sweep.at(sweep.values[1])) == scene, sweep.label
    labels = {sweep.label for panel in panels for sweep in (panel.x, panel.y)}
    assert ("cables.*.axial_stiffness" in labels) == (scene.cables is not None)


def test_default_axes_leave_out_what_a_scene_lacks() -> None:
    plain = load_scene("ring18").with_values({"stop": "none", "rods.damping": 0.0})
    with pytest.raises(InputError, match="has none of the default pairs"):
        panels_over(plain, [], points=3)


@pytest.mark.parametrize("shaping", ["x", "y", "both"])
def test_an_axis_that_shapes_the_result_takes_a_campaign_for_each_value(shaping) -> None:
    scene = load_scene("truss2")
    sections = sweep_of(scene, "structure.sections=1..3", points=3)
    ends = sweep_of(scene, "solver.end_time=30..40", points=2)
    speed = sweep_of(scene, f"{SPEED}=0.1..0.3", points=2)
    x, y = {"x": (sections, speed), "y": (speed, sections), "both": (sections, ends)}[shaping]
    pieces = pieces_of(Panel("p", "p", scene, x, y))
    assert len(pieces) == {"x": 3, "y": 3, "both": 6}[shaping]
    cells = [(one, other) for piece in pieces for one, other, _ in piece.cells]
    assert sorted(cells) == sorted(Panel("p", "p", scene, x, y).cells())
    for piece in pieces:
        for one, other, own in piece.cells:
            whole = scene.with_values(x.at(one) | y.at(other))
            assert piece.scene.with_values(own) == whole
            assert not {"structure.sections", "solver.end_time"} & set(own)
    assert np.unique([piece.name for piece in pieces]).size == len(pieces)
