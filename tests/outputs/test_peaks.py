"""When and where the largest values were: the place belongs to the value that is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from loops import for_each

from ringsim.cli import cli
from ringsim.outputs.balance import summary
from ringsim.outputs.base import BaseReaction
from ringsim.outputs.corners import PeakAcceleration
from ringsim.outputs.family import Run, Series, axes, top_of
from ringsim.outputs.joints import Asynchrony
from ringsim.outputs.motors import DriveMargins
from ringsim.outputs.recorder import overloads
from ringsim.outputs.rods_and_cables import CableTension, NetTension, RodStress
from ringsim.scene import load_scene
from ringsim.simulation import FIDELITIES, simulate

TRUSS = load_scene("truss2").with_values({"solver.end_time": 2.0, "record.interval": 0.5})
TIMES = np.linspace(0.0, 2.0, 9)
RODS = np.array([f"rod {k}" for k in range(8)])


def run_of(angles, rates, until=np.nan) -> tuple[Run, Series]:
    """A run of the truss with two planes and two sections."""
    grid = np.arange(0.0, 2.25, 0.5)
    series = Series(TIMES, angles, grid), Series(TIMES, rates, grid)
    known = axes(TRUSS) | {"rod": RODS}
    return Run(TRUSS, *series, np.full((2, 2), until), {}, known), series[0]


LIMITED = TRUSS.with_values({"limits.tension": 5.1})
STILL = run_of(np.ones((9, 2, 2)), np.zeros((9, 2, 2)))[0]


@pytest.mark.parametrize("seed", range(20))
def test_a_summit_between_readings_is_found_on_uneven_steps(seed: int) -> None:
    """Of cos(t - t0) the largest reading lacks up to h^2 / 8, the parabola a hundredth of that."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.05, 0.1, 60))
    summit = float(rng.uniform(2.0, 3.0))
    curves = np.stack([0.9 * np.cos(times - summit), np.cos(times - summit)], axis=1)
    top = top_of(times, curves)
    assert top.where == (1,)
    assert top.value == pytest.approx(1.0, abs=1e-2 * 0.1**2 / 8.0)
    assert top.time == pytest.approx(summit, abs=2e-3)
    assert top.value >= curves.max()


@for_each(("course", "why"), [
    ([0.0, 1.0, 2.0, 2.0, 2.0, 0.0, 0.0], "level, as of a motor at its limit, and off"),
    ([0.0, 1.0, 2.0, 3.0, 4.0, 0.0, 0.0], "cut at its largest"),
    ([0.0, 0.0, 4.0, 3.0, 2.0, 1.0, 0.0], "begun at its largest"),
    ([5.0, 4.0, 3.0, 2.0, 1.0, 0.0, 0.0], "at the start"),
    ([0.0, 1.0, 3.0, 4.0, np.nan, np.nan, np.nan], "beside a reading that is missing"),
])  # fmt: skip
def test_where_nothing_rises_between_readings_the_largest_of_them_counts(
    course: list[float], why: str
) -> None:
    top = top_of(np.arange(7.0), np.array(course))
    assert top.value == np.nanmax(course), why
    assert top.time == np.nanargmax(course), why


def test_the_summit_may_be_at_another_place_or_time_than_the_largest_reading() -> None:
    times = np.arange(7.0)
    curves = np.stack([5.0 - (times - 3.0) ** 2, 5.2 - (times - 3.45) ** 2], axis=1)
    top = top_of(times, curves)
    assert (top.value, top.time, top.where) == (pytest.approx(5.2), pytest.approx(3.45), (1,))
    # What is between readings alone is over a limit, too, and corners tell the same one.
    assert overloads(LIMITED, [CableTension()], lambda _: Series(times, curves, times)).startswith(
        "; 5.2 N at 3.45 s, more than limits.tension = 5.1 N"
    )
    pulls = np.zeros((7, 2, 3, 3))
    pulls[:, 0, 0, 0], pulls[:, 1, 2, 0] = curves.T + 30.0
    run = replace(STILL, coordinates=STILL.coordinates | {"corner": np.arange(1, 4)})
    found = PeakAcceleration().reduce(run, Series(times, pulls, times))
    assert found["peak_acceleration_max"] == pytest.approx(35.2) == found["peak_acceleration"].max()
    assert (found["peak_acceleration_max_plane"], found["peak_acceleration_max_corner"]) == (
        "lower", 3
    )  # fmt: skip


def test_the_slopes_beyond_the_neighbours_bound_the_rise() -> None:
    """Of 2, 3, 3.9, 0, -4 at steps of 1 the parabola would rise by 0.23, the bound by 0.125."""
    course = np.array([2.0, 3.0, 3.9, 0.0, -4.0])
    assert top_of(np.arange(5.0), course).value == pytest.approx(3.9 + 0.125)


def test_no_summit_lies_across_a_jump() -> None:
    """Two readings of one time, as where a fault strikes."""
    times = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0, 5.0])
    top = top_of(times, np.array([0.0, 1.0, 1.5, 3.0, 2.9, 2.0, 1.0]))
    assert (top.value, top.time) == (3.0, 2.0)


@pytest.mark.parametrize("leads", [1.0, -1.0])
def test_asynchrony_tells_who_and_when_between_steps(leads) -> None:
    """Lower 1 departs from the others by sin(t)^2 (2 - t) deg, the step's ends are 0.25 s apart."""
    angles, rates = np.ones((9, 2, 2)), np.zeros((9, 2, 2))
    fall = np.radians(np.sin(TIMES) ** 2 * (2.0 - TIMES))
    slope = np.radians(np.sin(2.0 * TIMES) * (2.0 - TIMES) - np.sin(TIMES) ** 2)
    angles[:, 1, 0] += leads * fall
    rates[:, 1, 0] += leads * slope
    run, series = run_of(angles, rates)
    found = Asynchrony().reduce(run, series)
    fine = np.linspace(0.0, 2.0, 100_001)
    truth = np.sin(fine) ** 2 * (2.0 - fine)
    # An eighth of a step at most beside the maximum, where the curvature is 1.7 deg/s^2, and
    # cubics on steps of h that err by h^4 / 384 of the fourth derivative, about 20.
    assert found["asynchrony_max"] == pytest.approx(truth.max(), abs=4e-4)
    assert found["asynchrony_max_time"] == pytest.approx(fine[truth.argmax()], abs=0.25 / 8)
    who = "leader" if leads > 0.0 else "laggard"
    assert found[f"asynchrony_{who}_plane"] == "lower"
    assert found[f"asynchrony_{who}_section"] == 1
    at = f"at {found['asynchrony_max_time']:.4g} s: "
    words = "upper 1 behind lower 1" if leads > 0.0 else "lower 1 behind upper 1"
    assert Asynchrony().told(found, {}) == at + words


def test_asynchrony_at_an_output_time_has_that_time() -> None:
    """A cubic that bulges between the eight points of a step, where an output time lies."""
    times, grid = np.array([0.0, 1.0]), np.array([0.0, 0.46875])
    angles, rates = np.zeros((2, 2, 2)), np.zeros((2, 2, 2))
    rates[:, 0, 1] = 1.0, -0.75  # largest between 3/8 and 4/8
    run = Run(
        TRUSS, Series(times, angles, grid), Series(times, rates, grid),
        np.full((2, 2), np.nan), {}, axes(TRUSS),
    )  # fmt: skip
    found = Asynchrony().reduce(run, run.angles)
    assert found["asynchrony_max"] == found["asynchrony"][1]
    assert found["asynchrony_max_time"] == grid[1]
    assert (found["asynchrony_leader_plane"], found["asynchrony_leader_section"]) == ("upper", 2)


def test_joints_that_open_alike_have_no_leader() -> None:
    found = Asynchrony().reduce(STILL, STILL.angles)
    assert found["asynchrony_max"] == 0.0
    assert Asynchrony().told(found, {}) == ""


def test_tension_tells_plane_and_span() -> None:
    tensions = np.random.default_rng(3).uniform(1.0, 2.0, (9, 2, 6))
    tensions[:, 0, 5] = np.nan  # of a cable with fewer spans
    tensions[6, 1, 3] = 30.0
    tensions[[5, 7], 1, 3] = 1.5  # alike on both sides, so that the parabola's summit is there
    found = CableTension().reduce(STILL, Series(TIMES, tensions, STILL.angles.grid))
    assert found["peak_tension"] == 30.0
    assert found["peak_tension_time"] == TIMES[6]
    assert (found["peak_tension_plane"], found["peak_tension_span"]) == ("lower", 4)
    words = "at 1.5 s: lower, span 4 (section 1 second hinge to section 2 first hinge)"
    assert CableTension().told(found, TRUSS.span_names) == words
    assert CableTension().told(found, {}) == "at 1.5 s: lower, span 4"


def test_tension_after_the_deployment_does_not_count() -> None:
    tensions = np.zeros((9, 2, 6))
    tensions[3, 0, 0], tensions[6, 1, 3] = 20.0, 30.0
    angles = np.pi + np.broadcast_to((TIMES - 1.3)[:, None, None], (9, 2, 2))
    run = run_of(angles, np.ones((9, 2, 2)), until=1.3)[0]
    found = CableTension().reduce(run, Series(TIMES, tensions, run.angles.grid))
    assert (found["peak_tension"], found["peak_tension_time"]) == (20.0, TIMES[3])
    assert (found["peak_tension_plane"], found["peak_tension_span"]) == ("upper", 1)


def test_stress_tells_rod_and_section() -> None:
    stress = np.random.default_rng(4).uniform(1.0, 2.0, (9, 8, 2))
    stress[2, 5, 1] = 3e6
    found = RodStress().reduce(STILL, Series(TIMES, stress, STILL.angles.grid))
    assert (found["peak_rod_stress"], found["peak_stress_time"]) == (3e6, TIMES[2])
    assert RodStress().told(found, {}) == "at 0.5 s: rod 5, section 2"


def test_planes_that_pull_alike_are_told_together() -> None:
    """To round-off, up to the peak; the far winch's span of both planes is alike, too."""
    tensions = np.random.default_rng(3).uniform(1.0, 2.0, (9, 1, 6)) * np.ones((1, 2, 1))
    tensions[:, 1] *= 1.0 + 1e-10
    tensions[[3, 5], :, 3] = 1.5
    tensions[4, :, 3] = 30.0, 30.0 * (1.0 + 1e-10)
    words = "at 1 s: upper and lower, span 4"

    def told() -> str:
        series = Series(TIMES, tensions, STILL.angles.grid)
        return CableTension().told(axes(TRUSS) | CableTension().reduce(STILL, series), {})

    assert told() == words
    tensions[6:, 0] += 5.0
    assert told() == words
    tensions[:, :, 0] = tensions[:, :, 3]
    assert told() == "at 1 s: upper and lower, span 1 (and 2 more alike)"
    tensions[:, 1] *= 1.0 + 1e-4
    assert told() == "at 1 s: lower, span 1 (and 1 more alike)"


def test_stresses_and_joints_that_are_alike_are_told_together() -> None:
    stress = np.random.default_rng(4).uniform(1.0, 2.0, (9, 8, 2))
    stress[2, 5, 1] = 3e6
    stress[:, 6, 1] = stress[:, 5, 1]
    found = RodStress().reduce(STILL, Series(TIMES, stress, STILL.angles.grid))
    known = axes(TRUSS) | {"rod": RODS}
    assert RodStress().told(known | found, {}) == "at 0.5 s: rod 5 and rod 6, section 2"
    stress[:, 7, 1] = stress[:, 5, 1]
    found = RodStress().reduce(STILL, Series(TIMES, stress, STILL.angles.grid))
    assert RodStress().told(known | found, {}) == "at 0.5 s: rod 5, section 2 (and 2 more alike)"
    shapes = np.radians([[0.0, 1.0], [0.0, 1.0 + 1e-8]])
    motion = (np.asarray(each)[:, None, None] for each in (TIMES**2, 2.0 * TIMES))
    run, series = run_of(*(shapes * each for each in motion))
    values = axes(TRUSS) | {"opening_angle": np.degrees(run.angles.on_grid(run.rates.values))}
    told = Asynchrony().told(values | Asynchrony().reduce(run, series), {})
    assert told == "at 2 s: upper and lower 1 behind upper and lower 2"
    alike = Asynchrony().reduce(run, series) | {"asynchrony_max": 4e-5}
    assert Asynchrony().told(values | alike, {}) == ""


@pytest.mark.parametrize(("margin", "word"), [(-0.2, "NOT enough"), (0.0, "enough")])
def test_the_least_margin_is_told_with_its_angle_and_verdict(margin: float, word: str) -> None:
    least = {"least_drive_margin": margin, "least_drive_margin_angle": 21.25}
    told = DriveMargins().told(least | {"least_drive_margin_time": 0.5}, {})
    assert told == f"at 21.25 deg and 0.5 s: {word}"
    less = ", and one plane even -1.000" if margin < 0.0 else ", but one plane has -1.000"
    for plane, more in ((-1.0, less), (margin, ""), (0.3, "")):
        both = least | {"least_drive_margin_time": 0.5, "least_plane_margin": plane}
        assert DriveMargins().told(both, {}) == told + more
        then = " (0.300 from the start of the last winch on)"
        later = both | {"least_drive_margin_started": 0.3}
        assert DriveMargins().told(later, {}) == told + then + more


def test_the_summary_of_a_run_tells_both_planes() -> None:
    """A ring without a boom is symmetric; only what is printed tells it."""
    run = simulate(load_scene("truss2").with_values({"solver.end_time": 0.3, "boom": "none"}))
    values = {str(name): each.values for name, each in run.variables.items()}
    told = summary(values, TRUSS.span_names)
    assert ": upper and lower, span 1 (winch to " in told["peak_tension"]
    assert " behind upper and lower " in told["asynchrony_max"]
    assert run.peak_tension_plane.item() in ("upper", "lower")


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_a_run_tells_what_its_series_hold(fidelity, tmp_path) -> None:
    """On output times much closer than steps the series come near to the peaks, and only there."""
    values = {"solver.end_time": 0.1, "record.interval": 2e-5, "record.stress": True}
    run = simulate(load_scene("truss2").with_values(values), fidelity)
    place = {"plane": run.peak_tension_plane.item(), "span": run.peak_tension_span.item()}
    near = run.cable_tension.sel(place).sel(time=run.peak_tension_time, method="nearest")
    assert near.item() == pytest.approx(run.peak_tension.item(), rel=1e-3)
    assert near.span_name.item() == TRUSS.span_names[place["plane"]][place["span"] - 1]
    assert run.cable_tension.max().item() <= run.peak_tension.item() * (1.0 + 1e-3)
    place = {"rod": run.peak_stress_rod.item(), "section": run.peak_stress_section.item()}
    near = run.rod_stress.sel(place).sel(time=run.peak_stress_time, method="nearest")
    assert near.item() == pytest.approx(run.peak_rod_stress.item(), rel=1e-3)
    at = run.opening_angle.sel(time=run.asynchrony_max_time, method="nearest")
    first, last = (
        at.sel(plane=run[f"asynchrony_{who}_plane"], section=run[f"asynchrony_{who}_section"])
        for who in ("leader", "laggard")
    )
    assert (first - last).item() == pytest.approx(run.asynchrony_max.item(), rel=1e-3)


def test_loads_at_the_base_tell_when_each_was_largest() -> None:
    """By their magnitude, whatever the largest component."""
    loads = np.random.default_rng(5).uniform(-1.0, 1.0, (9, 2, 3))
    loads[3, 0], loads[6, 1] = 3.0, -4.0
    loads[5, 0, 0] = 4.0
    found = BaseReaction().reduce(STILL, Series(TIMES, loads, STILL.angles.grid))
    assert found["peak_base_force"] == pytest.approx(27.0**0.5)
    assert found["peak_base_torque"] == pytest.approx(48.0**0.5)
    for name, when in (("peak_base_force", 0.75), ("peak_base_torque", 1.5)):
        assert found[f"{name}_time"] == when
        assert BaseReaction().told_of(name, found, {}) == f"at {when:g} s"
    assert BaseReaction().told_of("peak_base_force", {"peak_base_force": 3.0}, {}) == ""


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_impulse_acceleration_and_turn_tell_where_and_when_they_were_largest(fidelity) -> None:
    """The other places have less; on output times closer than steps the base is there turned most.

    An impulse has the time of its lock.
    """
    values = {"record.reactions": True, "record.accelerations": True, "record.interval": 5e-3}
    values |= {"boom.base": "free", "structure.opening_angle": 170.0, "solver.tolerance": 0.03}
    run = simulate(load_scene("truss2").with_values(values), fidelity)
    for name, each, dim in (
        ("peak_lock_impulse", run.lock_impulse, "section"),
        ("peak_acceleration_max", run.peak_acceleration, "corner"),
    ):
        place = {at: run[f"{name}_{at}"].item() for at in ("plane", dim)}
        assert each.sel(place).item() == run[name].item() == each.max().item()
    place = {at: run[f"peak_lock_impulse_{at}"].item() for at in ("plane", "section")}
    assert run.lock_time.sel(place).item() == run.peak_lock_impulse_time.item()
    turned = np.sqrt((run.base_rotation**2).sum("axis", skipna=False))
    near = turned.sel(time=run.base_rotation_max_time, method="nearest").item()
    assert near == pytest.approx(run.base_rotation_max.item(), rel=1e-3)
    told = summary({str(name): each.values for name, each in run.variables.items()}, {})
    when = f" at {run.base_rotation_max_time.item():.4g} s"
    assert told["base_rotation_max"].endswith(when)
    assert ", corner " in told["peak_acceleration_max"]


def test_an_acceleration_tells_corner_and_time() -> None:
    """By its magnitude, whatever the largest component."""
    found = np.random.default_rng(6).uniform(-1.0, 1.0, (9, 2, 3, 3))
    found[2, 1, 2], found[4, 0, 0, 1] = [3.0, 0.0, -4.0], 4.5
    run = replace(STILL, coordinates=axes(TRUSS) | {"corner": np.arange(1, 4)})
    values = PeakAcceleration().reduce(run, Series(TIMES, found, STILL.angles.grid))
    assert values["peak_acceleration_max"] == values["peak_acceleration"][1, 2] == 5.0
    assert PeakAcceleration().told(values, {}) == "at 0.5 s: lower, corner 3"


def test_the_largest_of_motors_are_told_with_time_and_plane() -> None:
    """On output times much closer than steps the series come near to the peaks, and only there."""
    values = {"solver.end_time": 0.1, "record.interval": 1e-4}
    values |= {f"cables.{each}.winch.winding.torque_constant": 0.02 for each in ("upper", "lower")}
    run = simulate(load_scene("ring18-motor").with_values(values), "frame")
    told = summary({str(name): each.values for name, each in run.variables.items()}, {})
    for name in ("motor_torque", "motor_power", "motor_current"):
        place = {dim: run[f"peak_{name}_{dim}"].item() for dim in ("plane", "winch")}
        near = run[name].sel(place).sel(time=run[f"peak_{name}_time"], method="nearest")
        assert near.item() == pytest.approx(run[f"peak_{name}"].item(), rel=1e-3)
        assert run[name].max().item() <= run[f"peak_{name}"].item() * (1.0 + 1e-3)
        assert f" at {run[f'peak_{name}_time'].item():.4g} s: " in told[f"peak_{name}"]


CAMPAIGN = """
name = "two"
scene = "truss2"
fidelity = "frame"
design = { kind = "random", samples = 2 }

[set]
"solver.end_time" = 0.1
'cables.upper.friction.coefficient["section 1 V"]' = 0.001

[inputs]
'cables.upper.friction.coefficient["section 2 V"]' = { kind = "uniform", low = 2e-4, high = 4e-4 }

[inputs.cables.lower.friction.coefficient]
kind = "uniform"
low = 2e-4
high = 4e-4
each_section = true
"""


def test_places_and_names_survive_a_campaign(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("two.toml").write_text(CAMPAIGN, encoding="utf-8")
    ended = CliRunner().invoke(cli, ["campaign", "two.toml", "--workers=0", "--out=out"])
    assert ended.exit_code == 0, ended.output
    with xr.open_dataset("out/campaign.nc") as found:
        found.load()
    assert found.peak_tension_plane.isin(["upper", "lower"]).all()
    assert found.asynchrony_leader_section.isin([1, 2]).all()
    assert found.span_name.dims == ("plane", "span")
    for plane, names in TRUSS.span_names.items():
        assert found.span_name.sel(plane=plane).values.tolist() == list(names)
    drawn = found.cables_lower_friction_coefficient
    assert drawn.pulley_name[[0, -1]].values.tolist() == ["section 1 first hinge", "section 2 V"]
    assert found.cables_upper_friction_coefficient_section_2_V.dims == ("sample",)
    # A sample again: the largest tension is that of the run with its inputs.
    values = {c.attrs["path"]: c[1].values.tolist() for c in found.values() if "path" in c.attrs}
    run = simulate(
        load_scene("truss2").with_values(
            {"solver.end_time": 0.1, "cables.upper.friction.coefficient[2]": 0.001, **values}
        ),
        "frame",
    )
    assert run.peak_tension_span == found.peak_tension_span[1]
    assert run.peak_tension.item() == found.peak_tension[1].item()
    worst = int(np.argmax(found.peak_tension.values))
    span, plane = int(found.peak_tension_span[worst]), found.peak_tension_plane[worst].item()
    line = (
        f"  largest tension in sample {worst}: {found.peak_tension[worst]:.4g} N at "
        f"{found.peak_tension_time[worst]:.4g} s: {plane}, span {span} "
        f"({TRUSS.span_names[plane][span - 1]})"
    )
    assert line in ended.output.splitlines()


def test_names_are_left_out_where_samples_differ_in_them(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = CAMPAIGN + ('[inputs.cables.lower.end]\nkind = "discrete"\nvalues = ["first", "last"]\n')
    Path("two.toml").write_text(text, encoding="utf-8")
    ended = CliRunner().invoke(cli, ["campaign", "two.toml", "--workers=0", "--out=out"])
    assert ended.exit_code == 0, ended.output
    with xr.open_dataset("out/campaign.nc") as found:
        assert not {"span_name", "pulley_name"} & set(found.variables)
        assert found.peak_tension_span.isin(found.span).all()
    assert " span 1 (" not in ended.output


def test_results_without_places_tell_none() -> None:
    """Of an older file, or of a solver that does not know them: text is empty, numbers missing."""
    values = {"peak_tension_time": 1.0, "peak_tension_plane": "", "peak_tension_span": np.nan}
    assert CableTension().told(values, TRUSS.span_names) == ""
    assert CableTension().told({"peak_tension": 1.0}, TRUSS.span_names) == ""
    assert RodStress().told({"peak_stress_time": np.nan}, {}) == ""
    assert Asynchrony().told({"asynchrony_max": 3.0, "asynchrony_leader_plane": ""}, {}) == ""
    assert Asynchrony().told({"asynchrony_max": 3.0}, {}) == ""


def test_places_without_a_span_are_told_beside_names_of_spans() -> None:
    """The net's edge has planes and sections, of a scene whose cables name their spans."""
    tensions = np.ones((9, 2, 2))
    tensions[3, 1, 0] = 4.0
    found = NetTension().reduce(STILL, Series(TIMES, tensions, STILL.angles.grid))
    names = {"upper": ("winch to block",), "lower": ("winch to block",)}
    assert NetTension().told(found, names) == "at 0.75 s: lower, section 1"


@pytest.mark.parametrize("name", ["ring18-motor", "ring18-ground", "ring18-cable"])
def test_the_verb_tells_every_peak_of_a_scene(name: str, tmp_path: Path) -> None:
    """What a run says at its end, of the scenes with most parts; it reaches its time limit."""
    short = ["--set", "solver.end_time=0.2", "--fidelity", "frame"]
    done = CliRunner().invoke(cli, ["run", name, *short, "--out", str(tmp_path / "a.nc")])
    assert done.exception is None or isinstance(done.exception, SystemExit), done.output
    assert "largest tension" in done.output
