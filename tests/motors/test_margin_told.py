"""Where the margin of a drive is told: ``check --margin``, files, figures, ``explain``."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from motor_rings import ring
from ringsim.cli import cli
from ringsim.cli.scene import margin_lines
from ringsim.outputs.balance import summary
from ringsim.outputs.motors import DriveMargins
from ringsim.parts.margin import EcssMechanisms, NasaMechanisms
from ringsim.plots import figures
from ringsim.plots.drives_and_locks import drive
from ringsim.rigid.margin import DriveMargin
from ringsim.scene import Scene, load_scene
from ringsim.simulation import simulate
from ringsim.variables import Fate


@pytest.fixture(scope="module")
def scene() -> Scene:
    return ring(
        joints__vjoint={"coulomb": 0.05}, net__stiffness=5.0, net__neutral_length=0.5,
        margin={"kind": "ecss-e-st-33-01c"}, solver__end_time=1.0,
    )  # fmt: skip


def told(path: Path, scene: Scene) -> str:
    path.write_text(scene.to_toml())
    result = CliRunner().invoke(cli, ["check", str(path), "--margin"])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_check_prints_the_margin_of_the_ideal_ring(scene: Scene, tmp_path: Path) -> None:
    text = told(tmp_path / "one.toml", scene)
    now = DriveMargin(scene, EcssMechanisms()).at(np.radians(60.0))
    first = next(line for line in text.splitlines() if line.startswith("60.0")).split()
    numbers = [now.available, *(now.resisting[k] for k in ("pulley friction", "joint friction"))]
    assert first[1:4] == [f"{number:.4g}" for number in numbers]
    assert first[-1] == f"{now.margin:.3f}"
    assert re.search(r"^ecss-e-st-33-01c: least margin \S+ at 60.00 deg: NOT enough$", text, re.M)
    assert "nasa" not in text
    both = told(tmp_path / "all.toml", scene.with_values({"margin": "none"}))
    assert re.search(r"^ecss-e-st-33-01c: least", both, re.M)
    assert re.search(r"^nasa-std-5017b: least", both, re.M)


def test_the_drive_of_the_table_has_the_gears_losses_and_not_the_pulleys(tmp_path: Path) -> None:
    """Its first line says so, and the columns follow the efficiency but no pulley's friction."""

    def drive_of(values: dict[str, float]) -> float:
        text = told(tmp_path / "one.toml", load_scene("ring18-motor").with_values(values))
        assert "the drive without the losses of pulleys; margins" in text.splitlines()[0]
        head = next(line for line in text.splitlines() if line.startswith("angle"))
        row = next(line for line in text.splitlines() if line.startswith("60.0"))
        return float(dict(zip(re.split(r"  +", head), row.split(), strict=True))["by cables"])

    of_scene, cables = drive_of({}), ("cables.upper", "cables.lower")
    winding = load_scene("ring18-motor").cables.upper.winch.winding
    half = {f"{cable}.winch.winding.efficiency": 0.5 * winding.efficiency for cable in cables}
    assert drive_of(half) == pytest.approx(0.5 * of_scene, rel=1e-3)
    smooth = {f"{cable}.friction.coefficient": 0.0 for cable in cables}
    assert drive_of(smooth) == of_scene


def test_check_does_not_end_with_valid_alone_where_the_drive_is_short(
    scene: Scene, tmp_path: Path
) -> None:
    for standard, words in ((scene, "NOT enough"), (scene.with_values({"margin": "none"}), "")):
        (file := tmp_path / "one.toml").write_text(standard.to_toml())
        last = CliRunner().invoke(cli, ["check", str(file)]).output.splitlines()[-1]
        assert last.startswith("valid")
        assert (words in last) if words else (last == "valid: ringsim run FILE runs it")


def test_the_printed_formula_gives_the_printed_margin(scene: Scene, tmp_path: Path) -> None:
    """Factors of the line below the table, forces of its rows."""
    sprung = scene.with_values(
        {"hinge_spring": {"kind": "linear", "stiffness": 0.01, "preload": 0.02}}
    )
    text = told(tmp_path / "one.toml", sprung)
    head = re.split(r"  +", next(line for line in text.splitlines() if line.startswith("angle")))
    formula = re.search(r"required = ([\d.]+) x \((.*)\)$", text, re.M)
    assert formula is not None
    factors = {
        kind: float(factor)
        for factor, kind in (term.split(" ", 1) for term in formula[2].split(" + "))
    }
    assert factors == {"joint friction": 3.0, "net": 1.2}
    rows = [re.split(r"  +", line) for line in text.splitlines() if re.match(r"\d+\.\d  ", line)]
    assert len(rows) > 12
    for row in rows[:-1]:
        own = dict(zip(head, row, strict=True))
        required = float(formula[1]) * sum(f * float(own[kind]) for kind, f in factors.items())
        assert float(own["required"]) == pytest.approx(required, rel=1e-3)
        margin = float(own["counted drive"]) / float(own["required"]) - 1.0
        assert float(own["margin"]) == pytest.approx(margin, abs=2e-3 * (1.0 + abs(margin)))
    assert (
        "cables with 3 times the friction of pulleys and gears, springs that drive times 0.8"
        in text
    )


def test_another_standard_has_its_own_factors_and_keeps_those_that_were_given(
    scene: Scene,
) -> None:
    other = scene.with_values({"margin.kind": "nasa-std-5017b"})
    assert other.margin == NasaMechanisms()
    measured = scene.with_values({"margin.friction": 1.5})
    other = measured.with_values({"margin.kind": "nasa-std-5017b", "margin.latch": 3.0})
    assert other.margin == NasaMechanisms(friction=1.5, latch=3.0)
    both = {"margin.kind": "nasa-std-5017b", "margin.motorisation": 2.0}
    assert scene.with_values(both).margin == NasaMechanisms(motorisation=2.0)


def test_a_run_says_that_its_least_margin_waits_for_a_winch(scene: Scene) -> None:
    run = simulate(scene.with_values({"cables.lower.winch.start_time": 0.25}), fidelity="frame")
    words = "the least drive margin is that of 0 s, before cables.lower.winch starts at 0.25 s"
    assert words in run.attrs["reason"]
    (then,) = re.findall(r"0.25 s: from then on (\S+) at", run.attrs["reason"])
    later = float(run.drive_margin.where(run.time >= 0.25).min())
    assert float(then) == pytest.approx(later, abs=2e-3)
    assert float(run.least_drive_margin_time) == 0.0
    least = float(run.least_drive_margin_started)
    assert least == pytest.approx(float(then), rel=1e-3)
    angle = float(run.least_drive_margin_started_angle)
    margin = DriveMargin(scene, EcssMechanisms()).at(np.radians(angle)).margin
    assert least == pytest.approx(margin, rel=1e-6)
    even = simulate(scene, fidelity="frame")
    assert "least drive margin" not in even.attrs["reason"]
    assert float(even.least_drive_margin_started) == float(even.least_drive_margin)


def test_a_dead_winch_is_told_beside_a_strong_one(scene: Scene, tmp_path: Path) -> None:
    torques = {"upper": 1.0, "lower": 1e-9}
    values = {f"cables.{name}.winch.winding.stall_torque": t for name, t in torques.items()}
    text = told(tmp_path / "two.toml", scene.with_values(values))
    assert re.search(r"^ecss-e-st-33-01c: least margin \S+ at \S+ deg: enough$", text, re.M)
    assert re.search(
        r"^  upper plane alone: its .* gives 100 % of what drives.* deg: enough$", text, re.M
    )
    assert re.search(
        r"^  lower plane alone: .* gives 1e-07 % .* least margin -1.000 at \S+ deg: NOT enough$",
        text,
        re.M,
    )
    assert "both planes are equal" in told(tmp_path / "even.toml", scene)


def test_the_share_of_a_plane_is_of_what_the_standard_counts(scene: Scene, tmp_path: Path) -> None:
    """And not of what the cables would give without friction, of which both have about half."""
    rough = scene.with_values({"cables.upper.friction.coefficient": 2.5e-3})
    text = told(tmp_path / "rough.toml", rough)
    (share, margin, angle), *_ = re.findall(
        r"^  upper plane alone: .* gives (\S+) % of .* least margin (\S+) at (\S+) deg", text, re.M
    )
    at = DriveMargin(rough, EcssMechanisms()).at(np.radians(float(angle)))
    own, other = at.pulls[1]
    loads = at.driving["loads"]
    counted = 100.0 * (own + 0.5 * loads) / (own + other + loads)
    assert counted < 40.0
    assert float(share) == pytest.approx(counted, rel=0.01)
    assert float(margin) == pytest.approx((2.0 * own + loads) / at.required - 1.0, abs=2e-3)


def test_the_cable_of_a_winch_that_starts_later_has_no_margin_yet(
    scene: Scene, tmp_path: Path
) -> None:
    late = scene.with_values({"cables.lower.winch.start_time": 0.25})
    text = told(tmp_path / "late.toml", late)
    assert "  lower plane alone: its winch starts later, not included here\n" in text
    assert re.search(r"^  upper plane alone: its .* gives \S+ % of what drives", text, re.M)


def test_where_round_off_resists_there_is_no_number(scene: Scene, tmp_path: Path) -> None:
    """The net's pull goes with the cosine of half the angle, to 1e-17 at 180 deg."""
    text = told(tmp_path / "net.toml", scene.with_values({"joints": {}}))
    last = next(line for line in text.splitlines() if line.startswith("180.0"))
    assert last.split()[-1] == "-"


def test_check_refuses_a_drive_without_limit() -> None:
    result = CliRunner().invoke(cli, ["check", "truss2", "--margin"])
    assert result.exit_code == 2
    assert 'cables.upper.winch.winding.kind = "constant": its force is not limited' in result.stderr


def test_a_run_draws_what_resists_and_its_least_margin(
    scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = simulate(scene, "frame")
    monkeypatch.setattr(figures, "PICTURES", [p for p in figures.PICTURES if p.name == "drive"])
    assert [p.name for p in figures.draw_figures(found, tmp_path, formats=["svg"])] == [
        "run-fig-drive.svg"
    ]
    figure = drive(found)
    upper, lower = figure.axes
    labels = upper.get_legend_handles_labels()[1]
    assert {"pulley friction", "joint friction"} < set(labels)
    angles, available = upper.lines[0].get_data()
    assert np.allclose(available, found.drive_available.dropna("time"))
    assert np.all(np.diff(angles) >= 0.0)
    words = lower.get_title() or lower.get_title(loc="left")
    assert f"least margin {float(found.least_drive_margin):.3f}" in words


def test_pulleys_that_the_standards_factor_jams_are_told(tmp_path: Path) -> None:
    """A bearing of f/R = 0.4 has 1.2 with a factor of 3: no tension where the rope turns far."""
    path = "cables.upper.friction.coefficient"
    told_of = {
        share: told(tmp_path / "one.toml", load_scene("ring18-motor").with_values({
            path: 0.01 * share, "margin": {"kind": "ecss-e-st-33-01c"},
        }))
        for share in (0.3, 0.4)
    }  # fmt: skip
    line = r"^  cables.upper: with 3 times its friction up to (\d+) pulleys pass on no tension, at "
    found = [re.search(line, text, re.MULTILINE) for text in told_of.values()]
    assert found[0] is None
    assert found[1] is not None
    assert 1 <= int(found[1][1]) <= 53
    assert "cables.lower: with" not in told_of[0.4]


def test_check_names_a_plane_whose_own_cable_falls_short(tmp_path: Path) -> None:
    """Where both together are enough: a run says so, too."""
    stall = {
        f"cables.{p}.winch.winding.stall_torque": t for p, t in (("upper", 0.1), ("lower", 0.002))
    }
    for values, wanted in ((stall, True), (dict.fromkeys(stall, 0.1), False)):
        path = tmp_path / "one.toml"
        path.write_text(load_scene("ring18-motor").with_values(values).to_toml())
        last = CliRunner().invoke(cli, ["check", str(path)]).stdout.splitlines()[-1]
        assert (
            last.startswith("valid, but the lower plane's own cable has least margin -0.") == wanted
        )
        assert (last == "valid: ringsim run FILE runs it") != wanted


@pytest.mark.parametrize(
    ("last", "told"),
    [(-1.0, "until the winches were switched off"), (0.7, "for a rigid ring, which opens as one")],
)
def test_a_ring_that_stalls_is_not_blamed_on_its_rods_once_nobody_drives(
    last: float, told: str
) -> None:
    values = {
        "least_drive_margin": np.array(0.7), "least_drive_margin_angle": np.array(20.0),
        "least_drive_margin_time": np.array(0.0), "outcome": np.array(int(Fate.STALLED)),
        "drive_margin": np.array([0.7, 0.9, last, np.nan]),
    }  # fmt: skip
    assert f"enough {told}" in DriveMargins().told(values, {})
    values |= {"least_plane_margin": np.array(-0.2)}
    also = "and" if last > 0.0 else "but"
    assert DriveMargins().told(values, {}).endswith(f", {also} one plane has -0.200")
    values["outcome"] = np.array(int(Fate.DEPLOYED))
    assert DriveMargins().told(values, {}).endswith("s: enough, but one plane has -0.200")


def test_the_drives_course_ends_below_zero_where_the_winches_stop() -> None:
    stop = {f"cables__{plane}__winch__stop_time": 0.3 for plane in ("upper", "lower")}
    found = simulate(ring(margin={"kind": "ecss-e-st-33-01c"}, solver__end_time=1.0, **stop))
    course = found["drive_margin"].dropna("time").values
    assert course[0] > 0.0
    assert course[-1] == -1.0


def test_a_peak_of_nothing_has_no_place() -> None:
    few = {"structure.sections": 6, "solver.end_time": 5.0}
    found = simulate(load_scene("ring18-flight").with_values(few), fidelity="frame")
    assert float(found["peak_net_tension"]) == 0.0
    assert summary(dict(found.variables), {})["peak_net_tension"].split() == ["0", "N"]


@pytest.mark.parametrize("weak", [1.0, 0.5])
def test_so_many_times_the_torque_give_a_margin_of_zero(weak: float) -> None:
    """Springs that drive stay as they are, so that it is not in the ratio of 1 + margin."""
    torques = {f"cables.{plane}.winch.winding.stall_torque": 0.005 for plane in ("upper", "lower")}
    torques["cables.lower.winch.winding.stall_torque"] *= weak
    scene = load_scene("ring18-motor").with_values(torques)
    (told,) = (line for line in margin_lines(scene) if "a margin of 0 takes" in line)
    words = "times the pull of all winches, as so many times their stall_torque give"
    assert told.endswith(f"{words}{'; one plane alone may take more' * (weak < 1.0)}")
    assert scene.margin is not None
    drive = DriveMargin(scene, scene.margin)
    more = drive.pull_needed()
    assert float(told.split()[5]) == pytest.approx(more, rel=5e-3)
    assert more > 1.1 / (1.0 + drive.least().margin)
    stronger = scene.with_values({path: more * torque for path, torque in torques.items()})
    assert DriveMargin(stronger, scene.margin).least().margin == pytest.approx(0.0, abs=1e-3)
    stuck = {"kind": "stuck-vjoint", "plane": "upper", "section": 1, "time": 0.0}
    held = DriveMargin(scene.with_values({"faults": [stuck]}), scene.margin)
    assert held.pull_needed() == np.inf
