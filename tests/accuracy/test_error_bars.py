"""Error bars: what they are made of, who has them, and what a campaign makes of them."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

from ringsim.analysis.campaign_notes import notes
from ringsim.analysis.study import analyse
from ringsim.analysis.study_text import error_lines, error_tables
from ringsim.campaign.run import run_cases
from ringsim.campaign.specification import load_campaign
from ringsim.dataset import to_dataset
from ringsim.exudyn import integrate
from ringsim.outputs import VARIABLES
from ringsim.outputs.balance import OF_DIFFERENCE, error_bars, refined, rules
from ringsim.parts.solver import Solver
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene
from ringsim.simulation import run, run_frame
from ringsim.stepping.guard import ConstantSteps
from ringsim.stepping.instant import Energies, Instant, Scales
from ringsim.stepping.locks import StopContact
from ringsim.stepping.repeats import MotionSteps
from ringsim.variables import Fate, Outcome, Status

TIMES = np.linspace(0.0, 4.0, 41)
SOON = {"structure.opening_angle": 150.0}


def ring(**values: object) -> Scene:
    plain = {
        "structure.sections": 3,
        "structure.aspect_ratio": 1.0,
        "net": "none",
        "loads.force": 0.03,
        "solver.end_time": 5.0,
        "solver.settling_time": 0.0,
    }
    return load_scene("ring18").with_values(plain | values)


def outcome(error: float, status: Status = Status.OK) -> Outcome:
    """A run whose numbers are all too large by a relative error."""
    rate = 50.0 * (1.0 + error)
    locks = np.array([[2.0, 3.0]]) * (1.0 + error)
    angles = np.where(locks[..., None] >= TIMES, rate * TIMES, np.nan)
    values = {
        "lock_time": locks,
        "deployment_time": np.array(locks.max()),
        "opening_angle": angles,
        "asynchrony_max": np.array(5.0 * (1.0 + error)),
        "peak_tension": np.array(10.0 * (1.0 + error)),
        "final_time": np.array(4.0),
        "outcome": np.array(int(Fate.NONE if status.failed else Fate.DEPLOYED)),
    }
    return Outcome(status, "", {"time": TIMES}, values)


def test_a_method_of_second_order_is_covered_by_its_safety() -> None:
    """Half the steps, a quarter of the error: the runs differ by three quarters of it."""
    error = 1e-4
    found = error_bars(outcome(error), outcome(error / 4.0))
    values = {"deployment_time": 3.0, "opening_angle": 150.0, "peak_tension": 10.0}
    for name, value in values.items():
        expected = rules()[name].safety * error * value
        assert found[f"{name}_error"] == pytest.approx(expected, rel=0.01)


def steps_of(solver: Solver, rates: list[float], stops: StopContact) -> list[float]:
    """Steps chosen while the mean rate goes through these values."""
    scales = Scales(0.1, 1.0, travel=3.0, length=1.0, contact_step=2e-3)
    constant = solver.step_control == "constant"
    control = ConstantSteps(solver.step, recover=False) if constant else MotionSteps(solver, scales)
    time, steps = 0.0, []
    for rate in rates:
        time += control.step
        rest = Energies(0.0, 0.0, 0.0, 0.0)
        control.advance(Instant(time, np.zeros(1), np.array([rate]), rest), stops)
        steps.append(control.step)
    return steps


FREE, MEETING = StopContact(np.inf, 0.0, 0.0), StopContact(1e-9, 30.0, 0.0)
CALM, WILD = [1.0] * 40, [1.0, -1e9] * 20


@pytest.mark.parametrize(
    ("rates", "stops"), [(CALM, FREE), (WILD, FREE), (CALM, MEETING)], ids=["cap", "floor", "stop"]
)
@pytest.mark.parametrize("control", ["motion", "constant"])
def test_the_second_run_halves_every_step(rates, stops, control) -> None:
    solver = Solver(step=0.1, step_control=control, tolerance=1e-3)
    one, two = (steps_of(s, rates, stops) for s in (solver, solver.scaled(0.5)))
    np.testing.assert_allclose(two, 0.5 * np.array(one), rtol=1e-12)


def test_a_second_run_stays_within_its_bounds() -> None:
    solver = Solver(step=0.8, end_time=1.0, tolerance=0.05).scaled(2.0)
    assert (solver.step, solver.tolerance) == (1.0, 0.1)
    assert Solver.model_validate(solver.model_dump()) == solver


def test_the_second_run_is_finer_in_all_that_has_an_order() -> None:
    scene = ring(**{"rods.elements": 3, "solver.step": 0.1})
    finer = refined(scene)
    assert finer.rods.elements == 6
    assert finer.solver.step == scene.solver.step / 2.0
    assert finer.solver.tolerance == scene.solver.tolerance / 4.0
    assert finer.solver.newton_tolerance == scene.solver.newton_tolerance / 4.0


@pytest.mark.parametrize("which", [0, 1])
def test_no_bars_without_two_good_runs(which: int) -> None:
    pair = [outcome(4e-4), outcome(1e-4)]
    pair[which] = outcome(1e-4, Status.DIVERGED)
    assert error_bars(*pair) == {}


def test_runs_that_agree_by_chance_in_the_largest_have_the_bar_of_their_places() -> None:
    """The root mean square of the differences, without places that neither run has."""
    assert all(VARIABLES[rule.of].dims for rule in rules().values() if rule.of)
    pair = outcome(0.0), outcome(0.0)
    for each, rates in zip(pair, ([0.1, 0.2, np.nan, 0.4], [0.1, 0.23, np.nan, 0.36]), strict=True):
        each.values["latch_rate"] = np.array([rates])
        each.values["least_latch_rate"] = np.array(0.1)
        each.values["peak_latch_rate"] = np.nanmax(rates)
    found, rule = error_bars(*pair), rules()["least_latch_rate"]
    rms = np.sqrt((0.03**2 + 0.04**2) / 3.0)
    assert found["least_latch_rate_error"] == pytest.approx(rule.safety * OF_DIFFERENCE * rms)
    # A number that is missing has none, and places that no run has tell nothing.
    pair[0].values["least_latch_rate"] = np.array(np.nan)
    assert np.isnan(error_bars(*pair)["least_latch_rate_error"])
    pair[0].values["least_latch_rate"] = np.array(0.1)
    pair[0].values["latch_rate"] = np.full((1, 4), np.nan)
    assert error_bars(*pair)["least_latch_rate_error"] == 0.0
    safety = rules()["peak_latch_rate"].safety
    assert found["peak_latch_rate_error"] == pytest.approx(safety * OF_DIFFERENCE * 0.04)


def test_of_a_series_the_largest_size_at_each_place_counts() -> None:
    """However many records either run has, and whichever sign and time the largest has there."""
    pair = outcome(0.0), outcome(0.0)
    for each, series in zip(pair, (
        [[[1.0, 9.0, 2.0], [3.0, -4.0, 0.0], [np.nan] * 3]],
        [[[9.0, 1.5], [4.2, 1.0], [np.nan] * 2]],
    ), strict=True):  # fmt: skip
        each.values["cable_tension"] = np.array(series)
        each.values["peak_tension"] = np.array(9.0)
    rms = np.sqrt(0.2**2 / 2.0)
    expected = rules()["peak_tension"].safety * OF_DIFFERENCE * rms
    assert error_bars(*pair)["peak_tension_error"] == pytest.approx(expected)


def half_open(error: float, locked: int = 1) -> Outcome:
    """A run that ended with so many V-joints locked of two."""
    found = outcome(error)
    found.values["lock_time"][0, locked:] = np.nan
    found.values["deployment_time"] = np.array(np.nan)
    found.values["outcome"] = np.array(int(Fate.PARTLY_DEPLOYED))
    return found


def test_a_run_that_does_not_deploy_has_bars_of_all_that_it_tells() -> None:
    error = 1e-4
    found = error_bars(half_open(error), half_open(error / 4.0))
    assert np.isnan(found["deployment_time_error"])
    for name in ("opening_angle", "asynchrony_max", "peak_tension"):
        value = {"opening_angle": 150.0, "asynchrony_max": 5.0, "peak_tension": 10.0}[name]
        expected = rules()[name].safety * error * value
        assert found[f"{name}_error"] == pytest.approx(expected, rel=0.01)


def test_no_bars_where_the_steps_decide_what_locks() -> None:
    assert error_bars(half_open(1e-4), outcome(2.5e-5)) == {}
    assert error_bars(half_open(1e-4, 0), half_open(2.5e-5)) == {}


def test_bars_change_nothing_else() -> None:
    scene = ring(**SOON, **{"record.stress": True, "solver.tolerance": 1e-3})
    plain, barred = (
        run_frame(scene.with_values({"solver.error_bars": bars})) for bars in (False, True)
    )
    bars = {name for name in barred.values if name not in plain.values}
    assert bars == {
        "deployment_time_error", "opening_angle_error", "asynchrony_max_error",
        "peak_rod_stress_error", "asynchrony_error",
    }  # fmt: skip
    for name in bars:
        assert np.nanmax(barred.values[name]) > 0.0
    for name, values in plain.values.items():
        if name not in ("wall_time", "cpu_time"):
            np.testing.assert_array_equal(values, barred.values[name])
    assert barred.values["steps"] == plain.values["steps"]
    dataset = to_dataset(barred, scene.with_values({"solver.error_bars": True}))
    assert dataset.peak_rod_stress_error.attrs["units"] == "Pa"
    assert "peak_tension_error" not in dataset
    assert not bars & set(to_dataset(plain, scene).data_vars)


@pytest.fixture
def attempts(monkeypatch):
    """Have runs end as given, one after another; the scenes that they were given are noted."""

    def prepare(*endings: Outcome) -> list[Scene]:
        left, seen = list(endings), []

        def attempt(scene: Scene, watch: object) -> Outcome:
            seen.append(scene)
            return left.pop(0)

        monkeypatch.setattr(integrate, "solve", attempt)
        return seen

    return prepare


def test_the_second_run_gives_the_bars(attempts) -> None:
    error = 4e-4
    seen = attempts(outcome(error), outcome(0.25 * error))
    scene = ring(**{"solver.error_bars": True})
    found = run(scene)
    assert seen[1] == refined(seen[0])
    expected = rules()["peak_tension"].safety * error * 10.0
    assert found.values["peak_tension_error"] == pytest.approx(expected, rel=0.01)
    assert "no error bars" not in found.reason


@pytest.mark.parametrize(
    ("second", "says"),
    [
        (Outcome(Status.DIVERGED, "the motion blew up"), "ended as diverged: the motion blew up"),
        (half_open(1e-4), "locked other V-joints"),
    ],
    ids=["failed", "other"],
)
def test_a_run_without_bars_says_why(attempts, second, says) -> None:
    attempts(outcome(1e-4), second)
    found = run(ring(**{"solver.error_bars": True}))
    assert found.status is Status.OK
    assert f"no error bars, since the run with half the steps {says}" in found.reason
    assert not any(name.endswith("_error") for name in found.values)


def test_the_bar_of_the_asynchrony_is_that_of_all_that_came_before() -> None:
    one, finer = outcome(0.0), outcome(0.0)
    one.values["asynchrony"] = np.where(TIMES <= 3.0, TIMES, np.nan)
    finer.values["asynchrony"] = one.values["asynchrony"] + np.where(TIMES[10] == TIMES, 0.5, 0.1)
    found = error_bars(one, finer)["asynchrony_error"]
    safety = 4.0 / 3.0 * rules()["asynchrony"].safety
    np.testing.assert_allclose(found[:10], 0.1 * safety, rtol=1e-9)
    np.testing.assert_allclose(found[10:31], 0.5 * safety, rtol=1e-9)
    assert np.isnan(found[31:]).all()


def test_bars_cover_what_a_finer_run_finds() -> None:
    scene = ring(**{"solver.error_bars": True})
    barred = run_frame(scene).values
    finer = {"solver.tolerance": 5e-6, "rods.elements": 2, "solver.error_bars": False}
    truth = run_frame(scene.with_values(finer)).values
    for name in ("deployment_time", "asynchrony_max"):
        error = abs(float(barred[name] - truth[name]))
        assert error < barred[f"{name}_error"] < 0.05 * truth[name]


@pytest.mark.parametrize("rotor", [{}, {"rotor_inertia": 1e-7}])
def test_bars_of_motors_cover_what_finer_steps_find(rotor) -> None:
    winding = rotor | {"torque_constant": 0.02, "no_load_current": 0.01}
    values = {
        f"cables.{plane}.winch.winding.{key}": value
        for plane in ("upper", "lower") for key, value in winding.items()
    }  # fmt: skip
    values |= {"structure.sections": 5, "margin": "none", "solver.tolerance": 3e-3}
    scene = load_scene("ring18-motor").with_values(values)
    found = run_frame(scene.with_values({"solver.error_bars": True})).values
    finer = {"solver.tolerance": 5e-5, "solver.step": 0.02, "rods.elements": 4}
    truth = run_frame(scene.with_values(finer)).values
    names = [f"peak_motor_{each}" for each in ("torque", "power", "current")]
    names += ["longest_motor_lag", "total_motor_energy", "total_motor_electrical_energy"]
    for name in names:
        bar = float(found[f"{name}_error"])
        at_once = rotor and name in ("peak_motor_torque", "peak_motor_current")  # closed forms
        assert (bar == 0.0) if at_once else 0.0 < bar < 0.2 * float(found[name]), name
        assert abs(float(found[name]) - float(truth[name])) <= bar, name


def test_bars_of_what_locks_do_cover_what_finer_steps_find() -> None:
    fields = {
        "structure.sections": 4, "boom.base": "fixed", "record.reactions": True,
        "solver.error_bars": True,
    }  # fmt: skip
    scene = load_scene("ring18-cable").with_values(fields)
    one, other = (
        run_frame(scene.with_values({"solver.tolerance": tolerance})).values
        for tolerance in (3e-3, 3e-4)
    )
    for name in (
        "least_latch_rate", "peak_latch_rate", "peak_lock_impulse", "peak_base_force",
        "peak_base_torque",
    ):  # fmt: skip
        apart = abs(float(one[name] - other[name]))
        assert apart <= float(one[f"{name}_error"] + other[f"{name}_error"]), name


FILE = """
name = "some"
scene = "ring18"
design = {{ kind = "random", samples = 10 }}
error_bars_every = 4
[set]
"structure.sections" = 3
[inputs]
"loads.force" = {{ kind = "uniform", low = 0.02, high = 0.03 }}
{more}
"""


def test_one_sample_in_four_has_bars(tmp_path) -> None:
    file = tmp_path / "some.toml"
    file.write_text(FILE.format(more=""))
    table = load_campaign(file).draw()
    asked = [bool(table.values_of(k)["solver.error_bars"]) for k in range(10)]
    assert asked == [k % 4 == 0 for k in range(10)]
    file.write_text(
        FILE.format(more='"solver.error_bars" = { kind = "discrete", values = [true, false] }')
    )
    with pytest.raises(InputError, match="leave out one"):
        load_campaign(file).draw()


def test_budget_says_which_error_dominates() -> None:
    rng = np.random.default_rng(3)
    values = 10.0 + rng.normal(size=100)
    bars = np.where(np.arange(100) % 10 == 0, 0.02, np.nan)
    campaign = xr.Dataset(
        {
            "status": ("sample", np.zeros(100, dtype=int)),
            "deployment_time": ("sample", values, {"units": "s"}),
            "deployment_time_error": ("sample", bars, {"units": "s"}),
            "asynchrony_max": ("sample", 5.0 + 3e-2 * values, {"units": "degree"}),
            "asynchrony_max_error": ("sample", bars, {"units": "degree"}),
            "energy_error": ("sample", values),
        },
        coords={"sample": np.arange(100)},
        attrs={"design": json.dumps({"kind": "random", "samples": 100})},
    )
    campaign.status[0] = 2
    spread = values[1:].std(ddof=1)
    assert "deployment_time" in error_lines(campaign)[2]
    rows = errors_of(campaign)
    first = rows["deployment_time"]
    assert first["sampling (standard error)"] == f"{spread / 99**0.5:.2g}"
    assert first["numerical (error bars)"] == "0.02"
    assert first["samples with bars"] == "9"
    assert first["largest bar"] == "0.02 (sample 10)"
    assert first["dominates"] == "sampling"
    assert rows["asynchrony_max"]["dominates"] == "numerical"
    assert "engines not measured" in "\n".join(error_lines(campaign))
    # One Sobol design has no standard error, and a few replicates that of their means.
    one = {"kind": "sobol", "samples": 100}
    alone = errors_of(campaign.assign_attrs(design=json.dumps(one)))["deployment_time"]
    assert alone["sampling (standard error)"] == "-"
    assert alone["numerical (error bars)"] == "0.02"
    campaign.status[0] = 0
    apart = campaign.assign(deployment_time=campaign.deployment_time + np.arange(100) % 4)
    told = errors_of(apart.assign_attrs(design=json.dumps(one | {"replicates": 4})))
    means = apart.deployment_time.to_numpy().reshape(25, 4).mean(axis=0)
    assert told["deployment_time"]["sampling (standard error)"] == f"{means.std(ddof=1) / 2:.2g}"


def errors_of(campaign: xr.Dataset) -> dict[str, dict[str, str]]:
    """The row of each output in the error budget of an analysis."""
    table = error_tables(analyse(campaign))[0]
    return {row[0]: dict(zip(table.head, row, strict=True)) for row in table.rows}


def test_cases_run_as_a_campaign_with_bars_and_steps_as_inputs(tmp_path, capfd) -> None:
    cases = [
        {"solver.step": step, "solver.tolerance": tolerance, "solver.error_bars": True}
        for step, tolerance in ((0.2, 1e-3), (0.1, 3e-5))
    ]
    scene = ring(**SOON, **{"solver.end_time": 4.0})
    file = run_cases(
        tmp_path, "steps", scene, cases, workers=1, title="two steps", fidelity="frame"
    )
    with xr.open_dataset(file) as found:
        assert (found.status == 0).all()
        np.testing.assert_array_equal(found.solver_step, [0.2, 0.1])
        errors = found.deployment_time_error.values
        assert any(" +- " in line for line in notes(found))
    assert errors[1] < errors[0]
    # Who asked for the cases tells what they mean.
    begin, end = capfd.readouterr().err.splitlines()
    assert "0 of 2 samples done" in begin
    assert end.endswith("campaign.nc: 2 samples, 0 failed")
    with pytest.raises(InputError, match="case 1"):
        run_cases(tmp_path / "b", "x", scene, [{"a": 1}, {"b": 2}], workers=1)
