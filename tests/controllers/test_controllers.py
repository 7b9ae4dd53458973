"""Controllers that sample sensors and command winches: closed forms, both engines, states."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import PrivateAttr, ValidationError
from scipy.integrate import quad

import ringsim
from ringsim.cable.control import CommandedWinding, Controller, SampledTension, Sampler
from ringsim.choice import kinds_of
from ringsim.parts.faults import LAST, SILENT
from ringsim.refusal import InputError
from ringsim.scene import Scene, load_scene

FREE = {"kind": "commanded", "max_speed": 0.3, "max_payout": 0.3}
STIFFNESS, TARGET, GAIN, PERIOD = 2e3, 5.0, 2e-3, 0.1
ENGINES = ("frame", "full")


def both(**values: Any) -> dict[str, Any]:
    """Values of either cable."""
    return {
        f"cables.{plane}.{name}": value
        for plane in ("upper", "lower")
        for name, value in values.items()
    }


def held_section(**controller: Any) -> Scene:
    """One section whose V-joints are held: its ropes are springs of a known length."""
    stuck = {"kind": "stuck-vjoint", "section": 1, "time": 0.0, "stiffness": 1e6, "damping": 100.0}
    law = {"kind": "sampled-tension", "target": TARGET, "gain": GAIN, "opening_rate": 1e-9}
    values = {
        "structure.sections": 1,
        "structure.opening_angle": 60.0,
        "solver.end_time": 2.0,
        "solver.tolerance": 1e-3,
        "record.interval": PERIOD,
        "faults": [stuck | {"plane": plane} for plane in ("upper", "lower")],
        "controller": law | {"period": PERIOD} | controller,
    }
    ropes = both(winch={"winding": FREE}, friction={"kind": "none"}, axial_stiffness=STIFFNESS)
    return load_scene("truss2").with_values(values | ropes)


def tension_of(wound: float, path: float, width: float) -> float:
    """Of a rope of this path from which so much has been wound: Hooke's law, smooth at slack."""
    force = STIFFNESS * (path / (path - wound) - 1.0)
    return float(np.logaddexp(0.0, force / width) * width)


def path_of(run: Any) -> float:
    """Of the upper rope, by Hooke's law of the last state: T = EA (S / (S - w) - 1)."""
    tension = float(run["cable_tension"].sel(plane="upper").isel(span=0)[-1])
    return float(run["wound_length"].sel(plane="upper")[-1]) * (1.0 + STIFFNESS / tension)


# The law of the winch.


def test_rope_wound_is_the_integral_of_the_rate() -> None:
    law = CommandedWinding(max_speed=0.2, max_payout=0.1, acceleration=0.1).told(0.15, 1.0)
    law = law.told(-0.5, 2.0).told(0.05, 6.0)  # the second comes before the first is reached
    assert law.speed == 0.05
    again = CommandedWinding(max_speed=0.2, max_payout=0.1, acceleration=0.1).told(0.15, 1.0)
    laws = [(1.0, 2.0, again), (2.0, 6.0, again.told(-0.5, 2.0)), (6.0, 9.0, law)]
    wound = 0.0
    for begin, end, one in laws:
        breaks = [time for time in one.breaks() if begin < time < end]
        wound += quad(one.wound_rate, begin, end, points=breaks or None)[0]
        assert one.wound(end) == pytest.approx(wound, rel=1e-9)
    assert laws[1][2].speed == -0.1
    assert law.wound_rate(6.0) == -0.1
    assert law.wound_rate(7.5) == pytest.approx(0.05)


# Closed forms on one section.


@pytest.mark.parametrize(
    ("fidelity", "delay"), [("frame", 0.0), ("frame", 0.03), ("frame", 0.15), ("full", 0.15)]
)
def test_a_sampled_loop_follows_its_recursion(fidelity: str, delay: float) -> None:
    """w(k+1) = w(k) + what is held: the command of the sample before until the delay is over."""
    scene = held_section(delay=delay)
    run = ringsim.simulate(scene, fidelity=fidelity)
    path = path_of(run)
    width = scene.cables.upper.slack_width  # type: ignore[union-attr]
    late, rest = divmod(delay, PERIOD)
    commands, wound = [0.0] * (int(late) + 1), [0.0]
    for _ in range(19):
        commands.append(GAIN * (TARGET - tension_of(wound[-1], path, width)))
        before, now = commands[-2 - int(late)], commands[-1 - int(late)]
        wound.append(wound[-1] + rest * before + (PERIOD - rest) * now)
    found = run["wound_length"].sel(plane="upper").values[:20]
    assert found == pytest.approx(wound, abs=1e-4 * max(wound))
    # e(k+1) = (1 - a) e(k), a = g p EA S / (S - w)^2, where the rope is taut without a delay.
    if delay == 0.0:
        tension = run["cable_tension"].sel(plane="upper").isel(span=0).values
        ratio = (TARGET - tension[8:15]) / (TARGET - tension[7:14])
        slope = STIFFNESS * path / (path - found[7:14]) ** 2
        assert ratio == pytest.approx(1.0 - GAIN * PERIOD * slope, abs=1e-3)


def test_noise_of_the_load_cell_moves_the_tension_as_it_must() -> None:
    """Var(T) = a s^2 / (2 - a) of e(k+1) = (1 - a) e(k) - a n(k)."""
    scene = held_section(period=0.05, load_cell={"standard_deviation": 0.5}, seed=3.0)
    scene = scene.with_values(
        {"solver.end_time": 20.0, "record.interval": 0.05, "solver.tolerance": 0.01}
    )
    run = ringsim.simulate(scene, fidelity="frame")
    path = path_of(run)
    tension = run["cable_tension"].sel(plane="upper").isel(span=0).values[60:]
    a = GAIN * STIFFNESS * 0.05 / path
    # Samples that follow one another agree by 1 - a: so many are worth one of their own.
    own = len(tension) * a / (2.0 - a)
    assert np.var(tension) == pytest.approx(0.25 * a / (2.0 - a), rel=4.0 * np.sqrt(2.0 / own))
    assert np.mean(tension) == pytest.approx(TARGET, abs=4.0 * 0.5 * np.sqrt(1.0 / len(tension)))


def test_a_short_period_meets_the_ideal_law_at_first_order() -> None:
    """The ideal law is solved within each step; the same gain held over a period is late by half
    of it.
    """
    goal = {"gain": 0.02, "target": 0.1, "opening_rate": 0.1}
    free = {"max_speed": 0.05, "max_payout": 0.05}
    shared = both(axial_stiffness=1e2, damping_time=0.1) | {
        "solver.end_time": 1.0, "solver.tolerance": 1e-4, "structure.opening_angle": 60.0,
        "record.interval": 0.5,
    }  # fmt: skip
    truss = load_scene("truss2").with_values(shared)
    ideal = truss.with_values(both(winch={"winding": {"kind": "tension-feedback"} | goal | free}))
    sampled = truss.with_values(both(winch={"winding": {"kind": "commanded"} | free}))
    exact = ringsim.simulate(ideal, fidelity="frame")["wound_length"].values
    errors = []
    for period in (0.2, 0.1, 0.05):
        law = {"kind": "sampled-tension", "period": period} | goal
        run = ringsim.simulate(sampled.with_values({"controller": law}), fidelity="frame")
        errors.append(np.abs(run["wound_length"].values - exact).max())
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.15)
    assert errors[1] / errors[2] == pytest.approx(2.0, abs=0.15)
    assert errors[2] < 0.01 * exact.max()


# Sensors.


class Chain:
    """What a sampler asks of the ropes."""

    winch_tensions = np.full((2, 2), 10.0)
    wound = wound_rate = np.zeros((2, 2))


class Noted(Controller):
    """Keeps what it is shown."""

    kind: Literal["noted-by-tests"] = "noted-by-tests"

    def reset(self) -> None:
        self.state.update(shown=[], tension=[])

    def step(self, time: float, readings: Any) -> dict[str, float]:
        self.state["shown"].append(readings.opening_angle)
        self.state["tension"].append(readings.tension["upper"])
        return {}


def sampled(count: int, **fields: Any) -> tuple[Sampler, NDArray[np.float64]]:
    """Samples of V-joints at 30 deg by a sampler, shape (count, planes, sections), deg."""
    values = both(winch={"winding": FREE})
    scene = load_scene("ring18-cable").with_values(values)
    law = Noted(period=0.1, **fields)
    sampler = law.sampler(scene)
    for k in range(count):
        assert sampler.next_time == pytest.approx(0.1 * k)
        sampler.due(0.1 * k, np.full((2, 18), np.radians(30.0)), Chain())
    return sampler, np.array(sampler.controller.state["shown"])


def test_encoders_have_noise_bias_and_steps() -> None:
    _, plain = sampled(2)
    assert plain == pytest.approx(30.0)
    sampler, shown = sampled(
        200, encoder={"standard_deviation": 0.5, "bias": 0.2, "resolution": 0.01},
        load_cell={"standard_deviation": 2.0, "resolution": 0.5},
    )  # fmt: skip
    error = 4.0 / np.sqrt(shown.size)
    assert shown.mean() == pytest.approx(30.2, abs=0.5 * error)
    assert shown.std() == pytest.approx(0.5, rel=error / np.sqrt(2.0))
    later = np.corrcoef((shown[1:] - 30.2).ravel(), (shown[:-1] - 30.2).ravel())[0, 1]
    joints = np.corrcoef(shown[:, 0, :-1].ravel(), shown[:, 0, 1:].ravel())[0, 1]
    assert abs(later) < error
    assert abs(joints) < 1.5 * error
    assert np.allclose(np.round(shown / 0.01), shown / 0.01, atol=1e-6)
    tension = np.array(sampler.controller.state["tension"])
    assert tension.std() == pytest.approx(2.0, rel=4.0 / np.sqrt(2.0 * len(tension)))
    assert np.array_equal(np.round(tension / 0.5) * 0.5, tension)
    _, same = sampled(3, encoder={"standard_deviation": 0.5, "bias": 0.2, "resolution": 0.01})
    assert np.array_equal(same, shown[:3])
    _, other = sampled(3, encoder={"standard_deviation": 0.5}, seed=0.5)
    assert not np.any(np.isclose(other, shown[:3], atol=1e-4).all(axis=(1, 2)))


def test_a_failed_encoder_shows_its_last_reading_or_nothing() -> None:
    sampler, _ = sampled(2, encoder={"standard_deviation": 0.5})
    sampler.encoders[0, 3], sampler.encoders[1, 5] = LAST, SILENT
    for k in (2, 3):
        sampler.due(0.1 * k, np.full((2, 18), np.radians(40.0)), Chain())
    shown = np.array(sampler.controller.state["shown"])
    assert shown[2, 0, 3] == shown[3, 0, 3] == shown[1, 0, 3]
    assert np.isnan(shown[2:, 1, 5]).all()
    assert np.isfinite(shown[2:]).sum() == 2 * 35
    assert shown[2:, 0, 4] == pytest.approx(40.0, abs=3.0)


def test_a_failed_encoder_in_a_run() -> None:
    """The plane whose only encoder has stuck seems to be behind: its winch gets the more."""
    law = {"kind": "synchronise", "period": 0.5, "speed": 0.02, "gain": 0.05}
    failed = {"kind": "failed-sensor", "plane": "upper", "section": 1, "time": 1.2}
    truss = load_scene("truss2").with_values(
        both(winch={"winding": FREE})
        | {"structure.sections": 1, "structure.opening_angle": 60.0, "controller": law}
        | {"solver.end_time": 3.0, "record.interval": 0.5, "faults": [failed]}
    )
    run = ringsim.simulate(truss, fidelity="frame")
    angles, wound = (run[name] for name in ("opening_angle", "wound_length"))
    speed = wound.diff("time") / 0.5
    assert speed.sel(plane="upper").values[:3] == pytest.approx(0.02, rel=1e-3)
    # The fault strikes between samples, so that the last reading is that of 1 s.
    seen = float(angles.sel(plane="upper", section=1, time=1.0))
    for time in (1.5, 2.0, 2.5):
        behind = 0.5 * (float(angles.sel(plane="lower", section=1, time=time)) - seen)
        told = 0.02 * (1.0 + 0.05 * behind * np.array([1.0, -1.0]))
        assert speed.sel(time=time + 0.5).values == pytest.approx(told, rel=1e-6)
        assert behind > 1.0


# Runs.


def ring(**controller: Any) -> Scene:
    """Six sections whose lower winch starts late."""
    law = {"kind": "synchronise", "period": 0.2, "delay": 0.25, "speed": 0.12, "gain": 0.05}
    noise = {"encoder": {"standard_deviation": 0.2, "resolution": 0.1}, "seed": 5.0}
    late = {"kind": "commanded", "max_speed": 0.2, "acceleration": 0.3}
    return load_scene("ring18-cable").with_values(
        both(winch={"winding": late})
        | {"structure.sections": 6, "cables.lower.winch.start_time": 0.5}
        | {"controller": law | noise | controller, "solver.end_time": 6.0}
    )


def same(one: Any, other: Any) -> bool:
    """Whether two runs agree bit by bit but for their times."""
    clocks = [name for name in one if name.endswith(("wall_time", "cpu_time"))]
    return bool(one.drop_vars(clocks).equals(other.drop_vars(clocks)))


def test_engines_agree_on_a_controlled_run() -> None:
    scene = ring().with_values({"structure.sections": 4, "solver.end_time": 1.2})
    frame, full = (ringsim.simulate(scene, fidelity=fidelity) for fidelity in ENGINES)
    assert full["opening_angle"].values == pytest.approx(frame["opening_angle"].values, abs=0.02)
    assert full["wound_length"].values == pytest.approx(frame["wound_length"].values, abs=2e-5)
    assert full["winch_command"].values == pytest.approx(frame["winch_command"].values, rel=1e-3)
    for run in (frame, full):
        assert float(run["energy_error"]) < 1e-3
    rate = frame["wound_length"].diff("time") / frame["time"].diff("time")
    assert np.ptp(rate.sel(plane="upper").values[-20:]) > 1e-4  # noise did move the winches


MOTOR = {
    "kind": "motor", "no_load_speed": 600.0, "stall_torque": 0.05, "gear_ratio": 50.0,
    "drum_radius": 0.02, "speed": 400.0, "rotor_inertia": 1e-6,
}  # fmt: skip


@pytest.mark.parametrize(("delay", "winding"), [(0.25, None), (0.0, None), (0.0, MOTOR)], ids=str)
def test_a_controlled_run_goes_on_from_a_state_bit_by_bit(
    delay: float, winding: dict[str, Any] | None, tmp_path: Path
) -> None:
    """Also between a sample and its command, which the state must remember."""
    scene = ring(delay=delay).with_values({"record.state_interval": 0.85, "solver.end_time": 2.0})
    if winding:
        scene = scene.with_values(both(winch={"winding": winding}))
    whole = ringsim.simulate(scene, fidelity="frame")
    whole.to_netcdf(tmp_path / "whole.nc")
    start = ringsim.read_state(tmp_path / "whole.nc", at=float(whole["state_time"][1]))
    rest = ringsim.simulate(scene, start=start)
    names = ("opening_angle", "cable_tension", "wound_length", "energy_error", "winch_command")
    assert all(whole[name].equals(rest[name]) for name in names)
    other = scene.with_values({"controller.gain": 0.5})
    changed = ringsim.simulate(other, start=start)
    assert not changed["wound_length"].equals(whole["wound_length"])
    early = whole["time"].values <= start.time
    assert np.array_equal(changed["wound_length"][:, early], whole["wound_length"][:, early])


def test_a_synchronised_ring_opens_more_nearly_in_step() -> None:
    plain = ring(gain=0.0, encoder={})
    controlled = ring(gain=0.2, encoder={})
    apart = []
    for scene in (plain, controlled):
        angles = ringsim.simulate(scene, fidelity="frame")["opening_angle"].mean("section")
        apart.append(float(np.abs(angles.diff("plane")).values[:, -50:].mean()))
    assert apart[1] < 0.7 * apart[0]


@pytest.mark.parametrize("fidelity", ENGINES)
def test_a_program_that_steps_a_run_is_a_controller(fidelity: str) -> None:
    scene = ring(delay=0.0).with_values({"structure.sections": 3, "solver.end_time": 1.0})
    law = scene.controller
    assert law is not None
    expected = ringsim.simulate(scene, fidelity=fidelity)
    own = law.begin(scene)
    outside = law.model_dump(exclude={"kind", "speed", "gain"}) | {"kind": "outside"}
    run = ringsim.steps(scene.with_values({"controller": outside}), fidelity)
    times = []
    for readings in run:
        times.append(run.time)
        run.command(**own.step(run.time, readings))
    assert times == pytest.approx(np.arange(6) * 0.2)
    names = ("opening_angle", "cable_tension", "wound_length")
    assert all(run.result[name].equals(expected[name]) for name in names)


def test_what_is_commanded_is_recorded_and_waits_for_the_start() -> None:
    """A winch has from its start on what it was told before; nothing is cut to another sample."""
    late = {"winding": FREE, "start_time": 0.7}
    scene = load_scene("truss2").with_values(
        both(winch=late) | {"solver.end_time": 1.5, "record.interval": 0.1}
    )
    run = ringsim.steps(scene, period=1.0)
    for _ in run:
        run.command(upper=0.02 + 0.01 * run.time)
    told = run.result["winch_command"].sel(plane="upper").isel(winch=0)
    assert told.values == pytest.approx([0.02] * 10 + [0.03] * 6)
    assert run.result["winch_command"].sel(plane="lower").isel(winch=0).values == pytest.approx(0.0)
    wound = run.result["wound_length"].sel(plane="upper")
    assert wound.values[[7, 10, 15]] == pytest.approx([0.0, 0.006, 0.021], abs=1e-9)


def test_a_program_is_told_at_once_what_it_cannot_command() -> None:
    run = ringsim.steps(load_scene("truss2"), period=0.5)
    for words, speeds in {
        'commands a winch "uper"': {"uper": 0.1},
        'of kind "constant" takes no commands': {"upper": 0.1},
    }.items():
        for _ in run:
            with pytest.raises(InputError, match=words):
                run.command(**speeds)
            break


def test_two_loops_over_one_run_do_not_meet() -> None:
    run = ringsim.steps(load_scene("truss2").with_values({"solver.end_time": 1.0}), period=0.5)
    first, second = iter(run), iter(run)
    next(first)
    next(second)
    first.close()  # type: ignore[attr-defined]
    assert len(list(second)) == 2


class Private(Controller):
    """Keeps a list of its own beside its state."""

    kind: Literal["private-by-tests"] = "private-by-tests"
    _own: list[float] = PrivateAttr(default_factory=list)

    def step(self, time: float, readings: Any) -> dict[str, float]:
        self._own.append(time)
        return {"upper": 0.01 * len(self._own)}


def test_nothing_goes_from_one_run_to_the_next() -> None:
    scene = load_scene("truss2").with_values(
        both(winch={"winding": FREE})
        | {"controller": {"kind": "private-by-tests", "period": 0.25}, "solver.end_time": 1.0}
    )
    runs = [ringsim.simulate(scene, fidelity="frame") for _ in range(2)]
    assert runs[0]["wound_length"].equals(runs[1]["wound_length"])


def test_a_loop_that_is_left_ends_the_run() -> None:
    run = ringsim.steps(load_scene("truss2"), period=0.5)
    for readings in run:
        assert readings.opening_angle.shape == (2, 2)
        if run.time >= 1.0:
            break
    with pytest.raises(RuntimeError, match="has not ended"):
        _ = run.result
    assert len(list(run)) > 3  # it may be run again, from the start
    assert run.result.attrs["reason"]


# What is refused, and what fails.


class Broken(Controller):
    """Commands what it is told to, or raises."""

    kind: Literal["broken-by-tests"] = "broken-by-tests"
    how: str = "raise"

    def step(self, time: float, readings: Any) -> dict[str, float]:
        if time < 0.35:
            return {}
        if self.how == "raise":
            raise ZeroDivisionError("no such angle")
        wrong = {"name": {"uper": 0.1}, "list": [0.1], "nan": {"upper": float("nan")}}
        return wrong[self.how]  # type: ignore[return-value]


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("list", "at 0.4 s: gives [0.1]: must be speeds (m/s) by winch, or None"),
        ("name", 'at 0.4 s: commands a winch "uper" (there are: upper, lower)'),
        ("nan", 'at 0.4 s: commands nan for the winch "upper": must be a number of m/s'),
    ],
)
def test_a_command_that_is_none_is_a_status(how: str, words: str) -> None:
    assert words in crashed(how, "frame")


@pytest.mark.parametrize("fidelity", ENGINES)
def test_a_controller_that_raises_is_a_status(fidelity: str) -> None:
    assert "ZeroDivisionError: no such angle" in crashed("raise", fidelity)


def crashed(how: str, fidelity: str) -> str:
    """Why a run with a broken controller has ended."""
    scene = load_scene("truss2").with_values(
        both(winch={"winding": FREE})
        | {"controller": {"kind": "broken-by-tests", "period": 0.2, "how": how}}
    )
    run = ringsim.simulate(scene, fidelity=fidelity)
    assert run["status"].attrs["flag_meanings"].split()[int(run["status"])] == "crashed"
    return str(run.attrs["reason"])


def test_what_cannot_be_is_refused() -> None:
    law = {"kind": "synchronise", "period": 0.2, "speed": 0.1, "gain": 0.05}
    cases: list[tuple[str, dict[str, Any], str]] = [
        ("ring18-cable", {"controller": law}, 'winding of kind "commanded" or "motor"'),
        ("ring18", {"controller": law}, "no winch of this scene takes commands"),
        ("ring18-cable", both(winch={"winding": FREE}) | {"controller": law | {"period": 1e-6}},
         "controller.period"),
        ("ring18-cable", both(winch={"winding": FREE}) | {"cables.lower": "none",
         "controller": law}, "needs a cable in either plane"),
        ("ring18-flight", {"controller": law}, "leave its ramp out"),
        ("ring18-motor", {"cables.upper.winch.winding.speed": None, "controller": law},
         "give its speed"),
        ("truss2", both(winch={"winding": FREE | {"speed": 0.5}}), "must lie between"),
        ("truss2", both(winch={"winding": FREE | {"wound_before": 0.5}}), "written by runs"),
        ("truss2", {"faults": [{"kind": "failed-sensor", "section": 1, "time": 1.0}]},
         "no controller that reads one"),
    ]  # fmt: skip
    for name, values, words in cases:
        with pytest.raises((InputError, ValidationError), match=words):
            load_scene(name).with_values(values)
    scene = load_scene("truss2").with_values(
        {"controller": {"kind": "outside", "period": 0.5}, "solver.end_time": 1.0}
    )
    with pytest.raises(InputError, match=r"only ringsim\.steps in Python"):
        ringsim.simulate(scene)
    with pytest.raises(InputError, match="give period"):
        ringsim.steps("truss2")


def test_kinds_are_known() -> None:
    assert {"synchronise", "sampled-tension", "outside"} <= set(kinds_of(Controller))
    assert SampledTension.model_fields["gain"].default == 0.02
